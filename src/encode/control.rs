//! Rate control: one training run, steered to the caller's target and finished on real files.

use super::budget::Budget;
use super::fit::{Fit, Fitted};
use super::layout::{Layout, layers_length};
use super::progress::Observer;
use super::raster::Raster;
use super::source::Source;
use super::training::Training;
use super::verify::{Distortion, Verified};
use super::{EncodeError, Encoder, Precision, Target};
use crate::quantizer::{Quantizer, Steps};

/// By how much a PSNR may exceed its target, in dB.
const PSNR_TOLERANCE: f64 = 0.05;
/// The least share of a size that a file must fill.
const SIZE_TOLERANCE: f64 = 0.99;
/// How often a finished fit may be extended to meet its target.
const MAX_ROUNDS: u32 = 8;

/// How many single Gaussians are tried without.
const MAX_TRIALS: usize = 64;

/// A finished encoding.
#[derive(Debug)]
pub(crate) struct Outcome {
    pub(crate) file: Vec<u8>,
    pub(crate) gaussians: u32,
    pub(crate) psnr: f64,
    pub(crate) psnr_float: f64,
    pub(crate) iterations: u32,
    pub(crate) evaluations: u64,
    pub(crate) peak_memory: u64,
    pub(crate) shortfall: Option<String>,
}

/// Fits `source` and meets the encoder's target.
pub(crate) fn encode(
    encoder: &Encoder,
    source: &Source<'_>,
    training: &Training,
    observer: &mut Observer<'_>,
) -> Result<Outcome, EncodeError> {
    let raster = Raster::new(source);
    let layout = Layout::new(source, training, raster.mean(), &encoder.metadata);
    let budget = budget(encoder, training, &raster, &layout)?;
    let base = layout.base();
    let mut fit = Fit::new(&raster, training, budget, encoder.precision, base, encoder.seed);
    fit.run(observer)?;

    if encoder.precision == Precision::Coded {
        let (iterations, evaluations) = (fit.iterations, fit.evaluations);
        let peak_memory = fit.peak_memory as u64;
        let (gaussians, error) = (fit.gaussians(), fit.best_error());
        drop(fit);
        let coder = super::coded::Coder::new(&raster, &layout);
        let coded = coder.encode(&gaussians, error, encoder.target, observer)?;
        let file = layout.write_set(&coded);
        drop(raster);
        let verified = Verified::new(&file, source);
        let gaussians = verified.gaussians();
        let Distortion { psnr, psnr_float } = verified.distortion(gaussians, observer)?;
        return Ok(Outcome {
            gaussians,
            psnr,
            psnr_float,
            iterations,
            evaluations,
            peak_memory,
            shortfall: shortfall(
                encoder.target,
                (source.width() * source.height()) as usize,
                file.len(),
                psnr,
                gaussians,
            ),
            file,
        });
    }
    let mut file = layout.write(&fit.fitted());
    for _ in 0..MAX_ROUNDS {
        let more = missing(encoder.target, budget, &file, source, &fit, observer)?;
        let more = more.min(fit.most().saturating_sub(fit.len()));
        if more == 0 {
            break;
        }
        let before = fit.len();
        fit.extend(more, training.iterations.div_ceil(4), observer)?;
        file = layout.write(&fit.fitted());
        if fit.len() == before {
            // There is nothing left to correct.
            break;
        }
    }
    let pixels = raster.pixels();
    let (iterations, evaluations) = (fit.iterations, fit.evaluations);
    let peak_memory = fit.peak_memory as u64;
    if let Target::Psnr(target) = encoder.target {
        file = trimmed(&layout, layout.ordered(&fit.fitted()), file, source, target, observer)?;
    }
    // The decoder needs memory, too.
    drop(fit);
    drop(raster);
    let verified = Verified::new(&file, source);
    let gaussians = verified.gaussians();
    let Distortion { psnr, psnr_float } = verified.distortion(gaussians, observer)?;
    Ok(Outcome {
        gaussians,
        psnr,
        psnr_float,
        iterations,
        evaluations,
        peak_memory,
        shortfall: shortfall(encoder.target, pixels, file.len(), psnr, gaussians),
        file,
    })
}

/// What decides the number of Gaussians during training.
fn budget(
    encoder: &Encoder,
    training: &Training,
    raster: &Raster,
    layout: &Layout<'_>,
) -> Result<Budget, EncodeError> {
    let target = encoder.target;
    if let Some(bytes) = target.bytes(raster.pixels())
        && encoder.precision == Precision::Coded
    {
        let least = 140;
        return Ok(Budget::Count(
            (bytes.saturating_sub(least) as f64 * 8.0 / super::coded::BITS_PER_GAUSSIAN) as usize,
        ));
    }
    if let Some(bytes) = target.bytes(raster.pixels()) {
        let quantizers = quantizers(encoder.precision, training, raster.channels);
        let least = layout.least_length(&quantizers);
        if bytes < least {
            return Err(EncodeError::Option(format!(
                "a size of {bytes} bytes; this picture takes at least {least} without any Gaussian"
            )));
        }
        let fits = |count: usize| least + layers_length(&quantizers, count) <= bytes;
        let (mut low, mut high) = (0, raster.pixels() + 1);
        while high - low > 1 {
            let middle = usize::midpoint(low, high);
            if fits(middle) { low = middle } else { high = middle }
        }
        return Ok(Budget::Count(low));
    }
    if let Some(error) = target.error_per_gaussian() {
        return Ok(Budget::ErrorPerGaussian(error));
    }
    Ok(match target {
        Target::Psnr(psnr) => {
            let samples = (raster.pixels() * raster.channels) as f64;
            let share = if encoder.precision == Precision::Coded {
                super::coded::SHARE_OF_FIT
            } else {
                1.0
            };
            Budget::Error(share * samples * 10_f64.powf(-psnr / 10.0))
        }
        Target::Gaussians(count) => Budget::Count(count as usize),
        _ => unreachable!("the others were handled above"),
    })
}

/// Quantizers of the depths that a file will have.
fn quantizers(precision: Precision, training: &Training, channels: usize) -> Vec<Quantizer> {
    let depths = &training.quantization;
    let packed = |bits| Quantizer::Linear(Steps { bits, scale: 1.0, offset: 0.0 });
    (0..5 + channels)
        .map(|component| match (precision, component) {
            (Precision::Float | Precision::Coded, _) => Quantizer::Float,
            (Precision::Packed, 0 | 1) => packed(depths.position_bits),
            (Precision::Packed, 2..5) => packed(depths.shape_bits),
            (Precision::Packed, _) => packed(depths.color_bits),
        })
        .collect()
}

/// How many Gaussians a finished fit still needs for its target.
fn missing(
    target: Target,
    budget: Budget,
    file: &[u8],
    source: &Source<'_>,
    fit: &Fit<'_>,
    observer: &mut Observer<'_>,
) -> Result<usize, EncodeError> {
    Ok(match (target, budget) {
        (Target::Psnr(target), _) => {
            let psnr = Verified::new(file, source).distortion(u32::MAX, observer)?.psnr;
            // A decibel takes somewhat less than 0.3 times as many Gaussians again.
            if psnr >= target {
                0
            } else {
                (fit.len() as f64 * 0.3 * (target - psnr)).ceil() as usize
            }
        }
        // Pruning may have left a file too small.
        (Target::Bytes(_) | Target::BitsPerPixel(_), Budget::Count(count))
            if (fit.len() as f64) < count as f64 * (1.0 + SIZE_TOLERANCE) / 2.0 =>
        {
            count.saturating_sub(fit.len())
        }
        _ => 0,
    })
}

/// The file with as few Gaussians as reach `target`: first the fewest in file order, then without
/// those that are not needed among the last ones, where one Gaussian is worth more than the
/// tolerance. The file as it is if it falls short.
fn trimmed(
    layout: &Layout<'_>,
    mut fitted: Fitted,
    mut file: Vec<u8>,
    source: &Source<'_>,
    target: f64,
    observer: &mut Observer<'_>,
) -> Result<Vec<u8>, EncodeError> {
    let fewest = least_prefix(&Verified::new(&file, source), target, observer)?;
    fitted.codes.truncate(fewest as usize);
    file = layout.write(&fitted);
    let mut psnr = Verified::new(&file, source).distortion(u32::MAX, observer)?.psnr;
    for index in (0..fitted.codes.len()).rev().take(MAX_TRIALS) {
        if psnr <= target + PSNR_TOLERANCE {
            break;
        }
        let mut fewer = fitted.clone();
        fewer.codes.remove(index);
        let trial = layout.write(&fewer);
        let reached = Verified::new(&trial, source).distortion(u32::MAX, observer)?.psnr;
        if reached >= target {
            (fitted, file, psnr) = (fewer, trial, reached);
        }
    }
    Ok(file)
}

/// The fewest of the file's first Gaussians that reach `target`; all of them if none do.
fn least_prefix(
    verified: &Verified<'_>,
    target: f64,
    observer: &mut Observer<'_>,
) -> Result<u32, EncodeError> {
    let mut reaches = |count| Ok(verified.distortion(count, observer)?.psnr >= target);
    let (mut short, mut enough) = (0, verified.gaussians());
    // Nearly monotone, and whatever this ends on was seen to be enough.
    while enough - short > 1 {
        let middle = u32::midpoint(short, enough);
        if reaches(middle)? { enough = middle } else { short = middle }
    }
    Ok(if reaches(short)? { short } else { enough })
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
