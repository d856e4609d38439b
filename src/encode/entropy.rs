//! From a fit to an entropy-coded file that meets its target.

use super::error::EncodeError;
use super::file::FileLayout;
use super::fit::budget::Budget;
use super::fit::{Fit, Work};
use super::job::Job;
use super::options::{Target, Tune};
use super::progress::Observer;
use super::raster::Raster;
use super::rate_model;
use super::rdo::{Residuals, TargetSearch};
use crate::coding::entropy::{Code, LatticeCodes};
use crate::gaussian::Gaussian;

/// How often a finished fit may be extended.
const MAX_ROUNDS: u32 = 8;

/// How many Gaussians a file of a size holds, about, up to `most`.
pub(crate) fn count_for_size(
    bytes: u64,
    most: usize,
    tune: Tune,
    layout: &FileLayout<'_>,
) -> Result<usize, EncodeError> {
    let lattice = rate_model::lattice(0.0, layout.header().color);
    let empty = LatticeCodes { lattice, codes: Vec::new() };
    let least = layout.write_entropy(&empty).len() as u64;
    layout.check_size(bytes, least)?;
    Ok((((bytes - least) * 8) as f64 / rate_model::bits_per_gaussian(tune)).min(most as f64)
        as usize)
}

/// The file of a finished fit, which is extended and coded for the target.
pub(crate) fn finish(
    mut fit: Fit<'_>,
    job: &Job<'_>,
    raster: &Raster,
    layout: &FileLayout<'_>,
    observer: &mut Observer<'_>,
) -> Result<(Vec<u8>, Work), EncodeError> {
    if let Target::Psnr(psnr) = job.target {
        extend(&mut fit, rate_model::SHARE_OF_FIT * raster.error_of(psnr), observer)?;
    }
    let (gaussians, distortion, mut work) =
        (fit.gaussians(), fit.best_error().distortion, fit.work());
    let codes = gaussians.len() * (size_of::<Gaussian>() + 2 * size_of::<Code>());
    let memory = raster.memory() + Residuals::memory(raster) + codes;
    work.peak_memory = work.peak_memory.max(memory);
    // Rate-distortion optimisation needs the memory.
    drop(fit);
    let search = TargetSearch::new(job.source, raster, layout, job.passes);
    let coded = search.run(&gaussians, distortion, job.target, observer)?;
    observer.poll()?;
    Ok((layout.write_entropy(&coded), work))
}

/// Extends a fit until its squared error is at most `error`, or nothing helps.
fn extend(fit: &mut Fit<'_>, error: f64, observer: &mut Observer<'_>) -> Result<(), EncodeError> {
    for _ in 0..MAX_ROUNDS {
        let before = fit.len();
        let squared = fit.best_error().squared;
        let wanted = Budget::Error(error).wanted(before, squared, fit.most());
        if squared <= error || wanted <= before {
            break;
        }
        fit.extend(wanted - before, observer)?;
        if fit.len() == before {
            break;
        }
    }
    Ok(())
}
