//! The way of a picture to a file that meets its target.

use super::error::EncodeError;
use super::file::FileLayout;
use super::fit::budget::Budget;
use super::fit::{Fit, Work};
use super::job::Job;
use super::options::{Precision, Target};
use super::progress::Observer;
use super::raster::Raster;
use super::rate_model;
use super::shortfall::Shortfall;
use super::verify::{Distortion, Verified};
use super::{entropy, packed};

/// A finished encoding, verified.
#[derive(Debug)]
pub(crate) struct Outcome {
    pub(crate) file: Vec<u8>,
    pub(crate) work: Work,
    pub(crate) gaussians: u32,
    pub(crate) distortion: Distortion,
    pub(crate) shortfall: Option<Shortfall>,
}

/// Fits the source, codes the Gaussians for the target, and decodes the file to tell what it shows.
pub(crate) fn encode(job: &Job<'_>, observer: &mut Observer<'_>) -> Result<Outcome, EncodeError> {
    let Job { source, target, precision, training, .. } = *job;
    let raster = Raster::new(source);
    let (kernel, parameterization) = (training.kernel, training.parameterization);
    let layout = FileLayout::new(source, raster.mean(), kernel, parameterization, job.metadata);

    let budget = budget(job, &raster, &layout)?;
    let mut fit = Fit::new(&raster, training, budget, precision, layout.base(), job.seed);
    fit.run(observer)?;

    let (file, work) = match precision {
        Precision::Entropy => entropy::finish(fit, job, &raster, &layout, observer),
        Precision::Packed | Precision::Float => packed::finish(fit, job, budget, &layout, observer),
    }?;

    let pixels = raster.pixels();
    // The decoder needs memory, too.
    drop(raster);
    observer.poll()?;
    let verified = Verified::new(&file, source);
    let gaussians = verified.gaussians();
    let distortion = verified.distortion(gaussians, observer)?;
    let shortfall = Shortfall::of(target, pixels, file.len(), distortion.psnr, gaussians);
    Ok(Outcome { file, work, gaussians, distortion, shortfall })
}

/// What decides the number of Gaussians during training.
fn budget(job: &Job<'_>, raster: &Raster, layout: &FileLayout<'_>) -> Result<Budget, EncodeError> {
    let Job { target, precision, training, .. } = *job;
    let is_coded = precision == Precision::Entropy;
    if let Some(bytes) = target.bytes(raster.pixels()) {
        let most = raster.pixels();
        let count = if is_coded {
            entropy::count_for_size(bytes, most, layout)
        } else {
            packed::count_for_size(bytes, most, precision, training, raster.channels, layout)
        };
        return count.map(Budget::Count);
    }
    if let Some(error) = target.error_per_gaussian() {
        return Ok(Budget::ErrorPerGaussian(error));
    }
    Ok(match target {
        Target::Psnr(psnr) => {
            let share = if is_coded { rate_model::SHARE_OF_FIT } else { 1.0 };
            Budget::Error(share * raster.error_of(psnr))
        }
        Target::Gaussians(count) => Budget::Count(count as usize),
        _ => unreachable!("the others were handled above"),
    })
}
