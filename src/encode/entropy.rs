//! From a fit to an entropy-coded file that meets its target.

use core::ops::Range;

use super::aim::{Aim, FileAim};
use super::error::Result;
use super::file::FileLayout;
use super::fit::budget::Budget;
use super::fit::{Fit, Work};
use super::job::Job;
use super::loss::{Distortion, SquaredError};
use super::progress::Observer;
use super::quality::Judge;
use super::rdo::{SearchWork, TargetSearch};
use super::tiled_source::TiledSource;
use super::workload::TEXTURE;
use super::{rate_model, sketch, texture};
use crate::chunk::ChunkType;
use crate::coding::entropy::QuantizedCodes;
use crate::gaussian::Gaussian;
use crate::limits::Limits;
use crate::render::Picture;

// Constants: docs/tuning.md, "Not measured".
/// How often a finished fit may be extended.
const MAX_ROUNDS: u32 = 8;

/// How often the number of Gaussians of a finished fit may be corrected for a quality.
const MAX_CORRECTIONS: u32 = 5;
/// The factors on the number of Gaussians that need no correction: finer or coarser steps of quantization
/// make up for them.
const CLOSE: Range<f64> = 0.75..1.2;
/// The least and the largest factor for a correction.
const FACTORS: (f64, f64) = (0.25, 4.0);
/// The range of p, where the error is taken to be proportional to the number of Gaussians to the power of -p.
/// Two fits tell p: it is low for noise, and high for smooth pictures.
const POWERS: (f64, f64) = (0.4, 2.0);

/// From this log ratio from a quality on (see `aim.rs`; a point or two), the codes of a second
/// fit are tried.
const MISSED: f64 = 0.1;

/// The most of a size that a texture may take.
const MOST_OF_SIZE: f64 = 0.1;

/// A fit before it was changed.
pub(crate) struct Fitted {
    gaussians: Vec<Gaussian>,
    distortion: Distortion,
}

/// Size in bytes of a file without Gaussians.
pub(crate) fn least_length(layout: &FileLayout<'_>, observer: &mut Observer<'_>) -> Result<u64> {
    let quantization = rate_model::quantization(0.0, &[1.0; 4][..layout.header().color.channels()]);
    let empty = QuantizedCodes { quantization, codes: Vec::new() };
    Ok(layout.write_entropy(&layout.coded(empty, observer)?, observer)?.len() as u64)
}

/// The file of a finished fit, which is extended and coded for the target.
pub(crate) fn finish(
    mut fit: Fit<'_>,
    job: &Job<'_>,
    judge: &Judge<'_>,
    budget: Budget,
    tiled: &TiledSource,
    layout: &FileLayout<'_>,
    observer: &mut Observer<'_>,
) -> Result<(Vec<u8>, Work)> {
    if let Budget::SquaredError(error) = budget {
        extend(&mut fit, error, job, observer)?;
    }
    let too_good = if let Aim::File(FileAim::Quality(quality)) = job.aim {
        correct(&mut fit, quality, job, judge, layout, observer)?
    } else {
        None
    };
    code(fit, too_good, job, judge, tiled, layout, observer)
}

/// The file of a fit as it is, coded for the target, or of `too_good` if that comes nearer to the target.
pub(crate) fn code(
    fit: Fit<'_>,
    too_good: Option<Fitted>,
    job: &Job<'_>,
    judge: &Judge<'_>,
    tiled: &TiledSource,
    layout: &FileLayout<'_>,
    observer: &mut Observer<'_>,
) -> Result<(Vec<u8>, Work)> {
    let (gaussians, distortion, mut work) =
        (fit.gaussians(), fit.best_error().distortion, fit.work());
    let is_adopted = fit.is_adopted();
    let of_other = too_good.as_ref().map_or(0, |fitted| size_of_val(&fitted.gaussians[..]));
    let memory = TargetSearch::memory(tiled, &gaussians) + of_other;
    work.peak_memory = work.peak_memory.max(memory);
    // Rate-distortion optimisation needs the memory.
    drop(fit);
    observer.poll()?;
    let search_work = SearchWork::new(job, gaussians.len());
    let texture = if job.has_texture() && !sketch::is_small(job.aim) {
        let work = job.workload(gaussians.len()).of(TEXTURE);
        observer.expect(work + search_work.whole());
        let limits = Limits::none();
        let picture = Picture::new(layout.header(), &gaussians, &limits, 0);
        let step = job.aim.step(distortion, gaussians.len());
        let payload = texture::payload(job, &picture, step, observer)?;
        observer.advance(work)?;
        payload.filter(|payload| has_room(job.aim, payload))
    } else {
        None
    };
    let layout = &layout.with_texture(texture.as_deref());
    let mut search = TargetSearch::new(judge, tiled, layout, search_work, observer)?;
    if is_adopted {
        search = search.at_any_error();
    }
    let (mut coded, log_ratio) = search.run(&gaussians, distortion, job.aim, observer)?;
    if let Some(fitted) = too_good.filter(|_| log_ratio > MISSED) {
        observer.expect(SearchWork::new(job, fitted.gaussians.len()).whole());
        let (other, log_ratio_of_other) =
            search.run(&fitted.gaussians, fitted.distortion, job.aim, observer)?;
        if log_ratio_of_other < log_ratio {
            coded = other;
        }
    }
    Ok((layout.write_entropy(&coded, observer)?, work))
}

/// Whether a file has room for a texture with this payload: a small one needs its bytes for Gaussians.
fn has_room(aim: Aim, payload: &[u8]) -> bool {
    let Aim::File(FileAim::Size(bytes)) = aim else { return true };
    ChunkType::TXTR.framed(payload.len()) as f64 <= MOST_OF_SIZE * bytes as f64
}

/// Extends a fit until its squared error is at most `error`, or nothing helps.
fn extend(
    fit: &mut Fit<'_>,
    error: SquaredError,
    job: &Job<'_>,
    observer: &mut Observer<'_>,
) -> Result<()> {
    for _ in 0..MAX_ROUNDS {
        let before = fit.len();
        let found = fit.best_error();
        let usual_bits = || rate_model::USUAL_COMPONENT_BITS;
        let wanted = Budget::SquaredError(error).wanted(before, found, usual_bits, fit.most());
        if found.squared <= error || wanted <= before {
            break;
        }
        observer.expect(
            job.workload(wanted).retraining(job.training.iterations)
                + SearchWork::new(job, wanted).whole(),
        );
        fit.resize(wanted, observer)?;
        if fit.len() == before {
            break;
        }
    }
    Ok(())
}

/// Adds or removes Gaussians until a fit has about as many as the quality needs. Returns the fit of before if
/// it was too good: of a picture such as ordered dither, which few more Gaussians turn from a bad copy into an
/// exact one, the next fit may have such strong Gaussians that no file of it comes near the quality.
fn correct(
    fit: &mut Fit<'_>,
    wanted_quality: f64,
    job: &Job<'_>,
    judge: &Judge<'_>,
    layout: &FileLayout<'_>,
    observer: &mut Observer<'_>,
) -> Result<Option<Fitted>> {
    let mut too_good = None;
    let mut power = 1.0;
    let mut last: Option<(f64, f64)> = None;
    for round in 0..MAX_CORRECTIONS {
        let before = fit.len();
        let gaussians = fit.gaussians();
        let limits = Limits::none();
        let picture = Picture::new(layout.header(), &gaussians, &limits, 0);
        // The error is about inversely proportional to the number of Gaussians, but not where a few of
        // them make the picture. There, too many are better than too few.
        let verdict = judge.judge(&picture, observer)?;
        let factor = verdict.excess(wanted_quality) / rate_model::SHARE_OF_FIT;
        let is_close = factor < CLOSE.end && (factor > CLOSE.start || round > 0);
        let count = before.max(1) as f64;
        if let Some((last_count, last_factor)) = last {
            let found = (last_factor / factor).ln() / (count / last_count).ln();
            power = if found.is_finite() { found.clamp(POWERS.0, POWERS.1) } else { 1.0 };
        }
        last = Some((count, factor));
        let wanted = count * factor.powf(1.0 / power).clamp(FACTORS.0, FACTORS.1);
        let wanted = (wanted.ceil() as usize).min(fit.most());
        if is_close || wanted == before {
            break;
        }
        if factor <= CLOSE.start {
            too_good = Some(Fitted { gaussians, distortion: fit.best_error().distortion });
        }
        observer.expect(
            job.workload(wanted).retraining(job.training.iterations)
                + SearchWork::new(job, wanted).whole(),
        );
        fit.resize(wanted, observer)?;
        if fit.len() == before {
            break;
        }
    }
    Ok(too_good)
}
