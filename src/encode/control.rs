//! One run from pixels to a file, steered to the caller's target.

use super::budget::Budget;
use super::coded::{self, Coder};
use super::fit::Fit;
use super::layout::Layout;
use super::options::{PSNR_TOLERANCE, SIZE_TOLERANCE};
use super::packed;
use super::progress::Observer;
use super::raster::Raster;
use super::rate;
use super::source::Source;
use super::training::Training;
use super::verify::{Distortion, Verified};
use super::{EncodeError, Encoder, Precision, Target};

/// What an encoding took.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Work {
    pub(crate) iterations: u32,
    pub(crate) evaluations: u64,
    /// Bytes.
    pub(crate) peak_memory: usize,
}

/// A file, and what it took.
#[derive(Debug)]
pub(crate) struct Finished {
    pub(crate) file: Vec<u8>,
    pub(crate) work: Work,
}

/// A finished encoding, verified.
#[derive(Debug)]
pub(crate) struct Outcome {
    pub(crate) file: Vec<u8>,
    pub(crate) work: Work,
    pub(crate) gaussians: u32,
    pub(crate) distortion: Distortion,
    pub(crate) shortfall: Option<String>,
}

/// Fits `source` and meets the encoder's target, with `passes` over the codes of coded Gaussians.
pub(crate) fn encode(
    encoder: &Encoder,
    source: &Source<'_>,
    training: &Training,
    passes: u32,
    observer: &mut Observer<'_>,
) -> Result<Outcome, EncodeError> {
    let (target, precision) = (encoder.target, encoder.precision);
    let raster = Raster::new(source);
    let layout = Layout::new(source, training, raster.mean(), &encoder.metadata);
    let budget = budget(encoder, training, &raster, &layout)?;
    let mut fit = Fit::new(&raster, training, budget, precision, layout.base(), encoder.seed);
    fit.run(observer)?;
    // An extension takes a quarter of the time.
    let extension = training.iterations.div_ceil(4);
    let Finished { file, work } = match precision {
        Precision::Coded => {
            let coder = Coder::new(source, &raster, &layout, passes);
            coder.finish(fit, target, extension, observer)
        }
        _ => packed::finish(fit, &layout, target, budget, extension, source, observer),
    }?;
    let pixels = raster.pixels();
    // The decoder needs memory, too.
    drop(raster);
    observer.poll()?;
    let verified = Verified::new(&file, source);
    let gaussians = verified.gaussians();
    let distortion = verified.distortion(gaussians, observer)?;
    let shortfall = shortfall(target, pixels, file.len(), distortion.psnr, gaussians);
    Ok(Outcome { file, work, gaussians, distortion, shortfall })
}

/// What decides the number of Gaussians during training.
fn budget(
    encoder: &Encoder,
    training: &Training,
    raster: &Raster,
    layout: &Layout<'_>,
) -> Result<Budget, EncodeError> {
    let (target, precision) = (encoder.target, encoder.precision);
    let is_coded = precision == Precision::Coded;
    if let Some(bytes) = target.bytes(raster.pixels()) {
        let most = raster.pixels();
        let count = if is_coded {
            coded::count_for_size(bytes, most, layout)
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
            let share = if is_coded { rate::SHARE_OF_FIT } else { 1.0 };
            Budget::Error(share * raster.error_of(psnr))
        }
        Target::Gaussians(count) => Budget::Count(count as usize),
        _ => unreachable!("the others were handled above"),
    })
}

/// Why the target was not met, if it was not.
fn shortfall(
    target: Target,
    pixels: usize,
    bytes: usize,
    psnr: f64,
    gaussians: u32,
) -> Option<String> {
    if let Target::Psnr(target) = target {
        return (psnr < target || psnr > target + PSNR_TOLERANCE).then(|| {
            if psnr < target {
                format!("{psnr:.2} dB is what this effort and precision reach")
            } else {
                format!("with {gaussians} Gaussians the picture already has {psnr:.2} dB")
            }
        });
    }
    let wanted = target.bytes(pixels)?;
    ((bytes as f64) < wanted as f64 * SIZE_TOLERANCE).then(|| {
        format!(
            "{gaussians} Gaussians, {bytes} bytes, are what the picture needs or the size holds"
        )
    })
}
