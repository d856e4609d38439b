//! From a fit to a file of the packed coding that meets its target.

use super::aim::{Aim, FileAim, PSNR_TOLERANCE, SIZE_TOLERANCE};
use super::error::{EncodeError, Result};
use super::file::FileLayout;
use super::fit::budget::Budget;
use super::fit::{Fit, Work};
use super::job::Job;
use super::options::Precision;
use super::progress::Observer;
use super::quality::Judge;
use super::source::Source;
use super::verify::Verified;
use crate::coding::packed::{PackedCodes, Quantizer, UniformQuantizer};
use crate::gaussian::component_count;

// Constants: docs/tuning.md, "Not measured".
/// How often a finished fit may be extended to meet its target.
const MAX_ROUNDS: u32 = 8;
/// How many times as many Gaussians more a decibel takes, somewhat more than it needs.
const GAUSSIANS_PER_DECIBEL: f64 = 0.3;
/// From how many decibels below a PSNR on training begins again.
const FAR: f64 = 1.0;
/// How often in a row more Gaussians may bring nothing.
const MAX_FAILURES: u32 = 2;
/// From which factor on the error that a quality allows Gaussians are added, and the most times as many
/// that there are after an addition.
const CLOSE: f64 = 1.05;
const MOST_FACTOR: f64 = 2.0;
/// How often a finished fit may be extended for a quality.
const MAX_EXTENSIONS: u32 = 4;
/// How many single Gaussians are tried without.
const MAX_TRIALS: usize = 64;

/// Size in bytes of a file without Gaussians.
pub(crate) fn least_length(job: &Job<'_>, layout: &FileLayout<'_>) -> u64 {
    layout.packed_length(&quantizers(job), 0)
}

/// How many Gaussians a file of so many bytes has, up to one for each pixel.
pub(crate) fn count_for_size(bytes: u64, job: &Job<'_>, layout: &FileLayout<'_>) -> usize {
    let quantizers = quantizers(job);
    let fits = |count: usize| layout.packed_length(&quantizers, count) <= bytes;
    let (mut low, mut high) = (0, job.pixels() + 1);
    while high - low > 1 {
        let middle = usize::midpoint(low, high);
        if fits(middle) { low = middle } else { high = middle }
    }
    low
}

/// The file of a finished fit, which is extended or trimmed to the target.
pub(crate) fn finish(
    mut fit: Fit<'_>,
    job: &Job<'_>,
    judge: &Judge<'_>,
    budget: Budget,
    layout: &FileLayout<'_>,
    observer: &mut Observer<'_>,
) -> Result<(Vec<u8>, Work)> {
    let file = match (job.aim, budget) {
        (Aim::File(FileAim::Psnr(psnr)), _) => {
            let fitted = raised(&mut fit, psnr, layout, job.source, observer)?;
            trimmed(layout, layout.ordered(&fitted), job.source, psnr, observer)?
        }
        (Aim::File(FileAim::Quality(quality)), _) => {
            extended(&mut fit, quality, layout, judge, observer)?
        }
        (Aim::File(FileAim::Size(_)), Budget::Count(count)) => {
            fill(&mut fit, count, observer)?;
            layout.write_packed(&fit.fitted())
        }
        _ => layout.write_packed(&fit.fitted()),
    };
    Ok((file, fit.work()))
}

/// Quantizers of the depths that a file will have.
fn quantizers(job: &Job<'_>) -> Vec<Quantizer> {
    let depths = job.training.quantization.depths().to_array();
    let quantizer = |depth: Option<u8>| match depth {
        Some(bits) if job.precision == Precision::Packed => {
            Quantizer::Linear(UniformQuantizer { bits, scale: 1.0, offset: 0.0 })
        }
        _ => Quantizer::Float,
    };
    let count = component_count(job.source.color().channels());
    depths.into_iter().take(count).map(quantizer).collect()
}

/// Adds to a fit what pruning left it short of a size that holds so many Gaussians.
fn fill(fit: &mut Fit<'_>, count: usize, observer: &mut Observer<'_>) -> Result<()> {
    let count = count.min(fit.most());
    for _ in 0..MAX_ROUNDS {
        let before = fit.len();
        if before as f64 >= count as f64 * (1.0 + SIZE_TOLERANCE) / 2.0 {
            break;
        }
        fit.resize(count, observer)?;
        if fit.len() == before {
            // There is nothing left to correct.
            break;
        }
    }
    Ok(())
}

/// The best codes of a fit that gets more Gaussians until its file has a PSNR. Far below it, training
/// begins again: rounding may have undone what few strong Gaussians had learnt.
fn raised(
    fit: &mut Fit<'_>,
    target: f64,
    layout: &FileLayout<'_>,
    source: &Source<'_>,
    observer: &mut Observer<'_>,
) -> Result<PackedCodes> {
    let fitted = fit.fitted();
    let mut reached = psnr(&layout.write_packed(&fitted), source, observer)?;
    let mut best = (reached, fitted);
    let mut failures = 0;
    for _ in 0..MAX_ROUNDS {
        let missing = target - reached;
        let count = more(fit, 1.0 + GAUSSIANS_PER_DECIBEL * missing);
        if missing <= 0.0 || count <= fit.len() || failures == MAX_FAILURES {
            break;
        }
        if missing > FAR {
            fit.restart(count, observer)?;
        } else {
            fit.resize(count, observer)?;
        }
        let fitted = fit.fitted();
        reached = psnr(&layout.write_packed(&fitted), source, observer)?;
        failures += 1;
        if reached > best.0 {
            (best, failures) = ((reached, fitted), 0);
        }
    }
    Ok(best.1)
}

/// The best file of a fit that is extended until it has a quality. Codes of fixed depths are too coarse
/// to ask for smooth gradients as well.
fn extended(
    fit: &mut Fit<'_>,
    wanted: f64,
    layout: &FileLayout<'_>,
    judge: &Judge<'_>,
    observer: &mut Observer<'_>,
) -> Result<Vec<u8>> {
    let excess = |file: &[u8], observer: &mut Observer<'_>| {
        let verified = Verified::new(file, judge.source(), observer)?;
        let verdict = judge.judge(&verified.picture(), observer)?;
        Ok::<_, EncodeError>(verdict.excess_of_structure(wanted))
    };
    let file = layout.write_packed(&fit.fitted());
    let mut factor = excess(&file, observer)?;
    let mut best = (factor, file);
    for _ in 0..MAX_EXTENSIONS {
        let count = more(fit, factor);
        if factor < CLOSE || count <= fit.len() {
            break;
        }
        fit.resize(count, observer)?;
        let file = layout.write_packed(&fit.fitted());
        factor = excess(&file, observer)?;
        if factor < best.0 {
            best = (factor, file);
        }
    }
    Ok(best.1)
}

/// How many Gaussians are so many times as many as a fit has, as far as may be added at once.
fn more(fit: &Fit<'_>, factor: f64) -> usize {
    let count = fit.len().max(1) as f64 * factor.min(MOST_FACTOR);
    (count.ceil() as usize).min(fit.most())
}

/// The PSNR of a file in dB.
fn psnr(file: &[u8], source: &Source<'_>, observer: &mut Observer<'_>) -> Result<f64> {
    Verified::new(file, source, observer)?.psnr(u32::MAX, observer)
}

/// The file with as few Gaussians as reach `target`: first the fewest in file order, then without
/// those that are not needed among the last ones, where one Gaussian is worth more than the
/// tolerance. The file as it is if it falls short.
fn trimmed(
    layout: &FileLayout<'_>,
    mut fitted: PackedCodes,
    source: &Source<'_>,
    target: f64,
    observer: &mut Observer<'_>,
) -> Result<Vec<u8>> {
    let mut file = layout.write_packed(&fitted);
    let fewest = least_prefix(&Verified::new(&file, source, observer)?, target, observer)?;
    fitted.codes.truncate(fewest as usize);
    file = layout.write_packed(&fitted);
    let mut reached = psnr(&file, source, observer)?;
    for index in (0..fitted.codes.len()).rev().take(MAX_TRIALS) {
        if reached <= target + PSNR_TOLERANCE {
            break;
        }
        let mut fewer = fitted.clone();
        fewer.codes.remove(index);
        let trial = layout.write_packed(&fewer);
        let reached_with_fewer = psnr(&trial, source, observer)?;
        if reached_with_fewer >= target {
            (fitted, file, reached) = (fewer, trial, reached_with_fewer);
        }
    }
    Ok(file)
}

/// The fewest of the file's first Gaussians that reach `target`; all of them if none do.
fn least_prefix(verified: &Verified<'_>, target: f64, observer: &mut Observer<'_>) -> Result<u32> {
    let mut reaches = |count| -> Result<bool> { Ok(verified.psnr(count, observer)? >= target) };
    let (mut short, mut enough) = (0, verified.gaussians());
    // Nearly monotone, and whatever this ends on was seen to be enough.
    while enough - short > 1 {
        let middle = u32::midpoint(short, enough);
        if reaches(middle)? { enough = middle } else { short = middle }
    }
    Ok(if reaches(short)? { short } else { enough })
}
