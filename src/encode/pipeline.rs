//! The way of a picture to a file that meets its target.

use super::aim::{Aim, FileAim};
use super::error::Result;
use super::file::FileLayout;
use super::fit::budget::Budget;
use super::fit::{Fit, Work};
use super::job::Job;
use super::loss::{PerceptualWeights, RenderingError, SquaredError};
use super::options::{Precision, Tune};
use super::outcome::{LEAST_GAIN, Outcome};
use super::progress::Observer;
use super::quality::{self, Judge};
use super::rate_model;
use super::rdo::SearchWork;
use super::resolutions::Resolutions;
use super::shortfall::Shortfall;
use super::sketch::{self, Sketch};
use super::tiled_source::TiledSource;
use super::workload::PREPARATION;
use super::{entropy, packed, resolutions, verify};

// Constants: docs/tuning.md, "Search for a target".
/// If the target is a size, and fewer pixels than this come to each Gaussian, the file is compared with one
/// of fewer Gaussians: in a short run, more may bring nothing.
const PIXELS_PER_GAUSSIAN_OF_LARGE: usize = 5;
/// Pixels per Gaussian of the file that it is compared with.
const PIXELS_PER_GAUSSIAN_OF_MODEST: usize = 8;
/// How often a file may get more Gaussians, and what they must bring each time, in dB.
const MOST_EXTENSIONS: u32 = 4;
const LEAST_GAIN_OF_MORE: f64 = 0.1;
/// By how many points of quality a file of the picture itself must be better than a sketch, which is better where it is
/// shown small.
const LEAST_POINTS_OF_WHOLE: f64 = 2.0;
/// Pixels per Gaussian and corrections of the number of Gaussians that the progress report assumes before
/// they are known.
const USUAL_PIXELS: usize = 100;
const USUAL_CORRECTIONS: f64 = 0.5;

/// The file of the last job, or of an earlier one that is better: those of lower efforts for the same picture.
/// With few pixels it is chance which of them ends in the better fit.
pub(crate) fn encode(jobs: &[Job<'_>], observer: &mut Observer<'_>) -> Result<Outcome> {
    let (first, later) = jobs.split_first().expect("there is a job");
    verify::check_limits(first)?;
    let judge = Judge::new(first.source);
    let mut best = encode_once(first, &judge, Work::default(), observer)?;
    for job in later {
        let outcome = encode_once(job, &judge, best.work, observer)?;
        let work = outcome.work;
        best = if best.is_better_than(&outcome, job.aim, job.tune) { best } else { outcome };
        best.work = work;
    }
    Ok(best)
}

/// The file of a job: a sketch, unless one of the picture itself shows more.
fn encode_once(
    job: &Job<'_>,
    judge: &Judge<'_>,
    work: Work,
    observer: &mut Observer<'_>,
) -> Result<Outcome> {
    if !sketch::is_for(job) {
        return encode_whole(job, judge, work, observer);
    }
    let sketch = encode_for_target(job, judge, Form::Sketch, work, observer)?;
    if !sketch::may_be_too_little(job) {
        return Ok(sketch);
    }
    let whole = encode_whole(job, judge, sketch.work, observer)?;
    let is_better = match job.tune {
        Tune::Visual => whole.quality >= sketch.quality + LEAST_POINTS_OF_WHOLE,
        Tune::Psnr => whole.psnr.rounded > sketch.psnr.rounded,
    };
    Ok(if is_better { whole } else { Outcome { work: whole.work, ..sketch } })
}

/// The file of a job that is no sketch. If its target is a size, one of more Gaussians where the size has room
/// for them, or of fewer where these show about as good a picture.
fn encode_whole(
    job: &Job<'_>,
    judge: &Judge<'_>,
    work: Work,
    observer: &mut Observer<'_>,
) -> Result<Outcome> {
    let outcome = encode_for_target(job, judge, Form::Whole(None), work, observer)?;
    let Aim::File(FileAim::Size(most_bytes)) = job.aim else { return Ok(outcome) };
    // Files are compared by PSNR with either tune: they are tuned alike, and with so many Gaussians the
    // estimate of quality is often near its highest, where it hardly tells them apart.
    let outcome = with_more(outcome, most_bytes, job, judge, observer)?;
    with_fewer(outcome, most_bytes, job, judge, observer)
}

/// A file with as many more Gaussians as its size has room for, as long as they make it better: of line
/// art, which needs fewer Gaussians than a photograph and finer steps, training does not foresee how many
/// have room.
fn with_more(
    mut outcome: Outcome,
    most_bytes: u64,
    job: &Job<'_>,
    judge: &Judge<'_>,
    observer: &mut Observer<'_>,
) -> Result<Outcome> {
    for _ in 0..MOST_EXTENSIONS {
        let Some(Shortfall::SizeUnused { bytes, gaussians }) = outcome.shortfall else { break };
        let room = most_bytes as f64 / bytes as f64;
        let count = (room * f64::from(gaussians)).ceil() as usize;
        // The packed coding knows beforehand how many have room.
        if job.precision != Precision::Entropy || count > job.pixels() {
            break;
        }
        let larger =
            encode_for_target(job, judge, Form::Whole(Some(count)), outcome.work, observer)?;
        if larger.psnr.rounded < outcome.psnr.rounded + LEAST_GAIN_OF_MORE {
            return Ok(Outcome { work: larger.work, ..outcome });
        }
        outcome = larger;
    }
    Ok(outcome)
}

/// A file, or one with fewer Gaussians where these show about as good a picture.
fn with_fewer(
    mut outcome: Outcome,
    most_bytes: u64,
    job: &Job<'_>,
    judge: &Judge<'_>,
    observer: &mut Observer<'_>,
) -> Result<Outcome> {
    let pixels = job.pixels();
    loop {
        let gaussians = outcome.gaussians as usize;
        let is_large = gaussians > pixels / PIXELS_PER_GAUSSIAN_OF_LARGE;
        // An effort that finds no use for the bytes may have begun with too many Gaussians; and where fewer
        // were better, still fewer may be.
        let is_unused = matches!(
            outcome.shortfall,
            Some(Shortfall::SizeUnused { .. } | Shortfall::SizeUseless { .. })
        );
        if !(is_large || is_unused || outcome.is_lost_to_rounding) || gaussians < 2 {
            return Ok(outcome);
        }
        let most = (pixels / PIXELS_PER_GAUSSIAN_OF_MODEST).min(gaussians / 2).max(1);
        let modest_job = Job { aim: Aim::Count(most as u32), ..*job };
        let modest =
            encode_for_target(&modest_job, judge, Form::Whole(None), outcome.work, observer)?;
        let least = if is_large { LEAST_GAIN * outcome.doublings(&modest) } else { 0.0 };
        if outcome.gain(&modest) >= least || modest.file.len() as u64 > most_bytes {
            return Ok(Outcome { work: modest.work, ..outcome });
        }
        let (bytes, gaussians) = (modest.file.len(), modest.gaussians);
        let shortfall = Some(Shortfall::SizeUseless { bytes, gaussians });
        outcome = Outcome { shortfall, ..modest };
    }
}

/// What is fitted.
#[derive(Clone, Copy, Debug)]
enum Form {
    /// A small copy of the picture.
    Sketch,
    /// The picture, with so many Gaussians, or as many as the target asks for.
    Whole(Option<usize>),
}

/// Fits the source, codes the Gaussians for the target, and decodes the file to tell what it shows. `work` was done
/// before.
fn encode_for_target(
    job: &Job<'_>,
    judge: &Judge<'_>,
    form: Form,
    work: Work,
    observer: &mut Observer<'_>,
) -> Result<Outcome> {
    let Job { source, precision, training, .. } = *job;
    let preparation = job.workload(0).of(PREPARATION);
    observer.expect(preparation + work_from_training(job, job.pixels() / USUAL_PIXELS));
    let (sketch, count) = match form {
        Form::Sketch => (Some(Sketch::of(job, observer)?), None),
        Form::Whole(count) => (None, count),
    };
    let tiled = match &sketch {
        Some(sketch) => sketch.tiled(source, observer)?,
        None => TiledSource::new(source, job.tune, observer)?,
    };
    let (kernel, parameterization) = (training.kernel, training.parameterization);
    let layout = FileLayout::new(source, tiled.mean, kernel, parameterization, job.metadata);
    let layout = layout.with_first_layer(job.first_layer);

    let asked = job.aim;
    let (aim, budget) = within_reach(job, &layout, &tiled, observer)?;
    let job = &Job { aim, ..*job };
    let budget = count.map_or(budget, Budget::Count);
    let expected = match budget {
        Budget::Count(count) => count,
        Budget::Bits { .. } => {
            let usual_bits = || rate_model::USUAL_COMPONENT_BITS;
            budget.wanted(0, RenderingError::default(), usual_bits, job.pixels())
        }
        _ => job.pixels() / USUAL_PIXELS,
    };
    observer.advance(preparation)?;
    observer.expect(work_from_training(job, expected));
    let preparing = tiled.memory() + tiled.scratch_memory;
    let peak_before = work.peak_memory.max(preparing);
    let work = Work { peak_memory: 0, ..work };
    let mut is_lost_to_rounding = false;
    let (file, mut work) = if let Some(sketch) = &sketch {
        sketch.encode(job, budget, &tiled, &layout, work, observer)
    } else {
        let copies = resolutions::copies(job, observer)?;
        let sources = Resolutions { picture: &tiled, copies: &copies };
        let mut fit = Fit::new(sources, training, budget, precision, layout.base(), job.seed, work);
        fit.run(job.workload(expected), observer)?;
        is_lost_to_rounding = fit.is_lost_to_rounding();
        match precision {
            Precision::Entropy => {
                entropy::finish(fit, job, judge, budget, &tiled, &layout, observer)
            }
            Precision::Packed | Precision::Float => {
                packed::finish(fit, job, judge, budget, &layout, observer)
            }
        }
    }?;

    work.peak_memory = work.peak_memory.max(peak_before);
    // The decoder needs memory, too.
    drop(tiled);
    let outcome = Outcome::of(file, work, job, asked, judge, &layout, observer)?;
    Ok(Outcome { is_lost_to_rounding, ..outcome })
}

/// The work from training on, about, with so many Gaussians.
fn work_from_training(job: &Job<'_>, gaussians: usize) -> f64 {
    let (workload, iterations) = (job.workload(gaussians), job.training.iterations);
    let later = match job.precision {
        Precision::Entropy => SearchWork::new(job, gaussians).whole(),
        Precision::Packed | Precision::Float => workload.verification(),
    };
    let rounds = if job.aim.is_by_error() { USUAL_CORRECTIONS } else { 0.0 };
    workload.training(iterations) + rounds * workload.retraining(iterations) + later
}

/// The aim, or the size of a file without Gaussians if the aim is a smaller one; and what decides the number of
/// Gaussians during training.
pub(crate) fn within_reach(
    job: &Job<'_>,
    layout: &FileLayout<'_>,
    tiled: &TiledSource,
    observer: &mut Observer<'_>,
) -> Result<(Aim, Budget)> {
    let is_coded = job.precision == Precision::Entropy;
    let budget = match job.aim {
        Aim::Count(count) => Budget::Count(count as usize),
        Aim::Lambda(lambda) => {
            let step = rate_model::step_for_lambda(lambda);
            Budget::DistortionPerGaussian(rate_model::distortion_per_gaussian(step))
        }
        Aim::File(FileAim::Size(bytes)) => {
            let least = if is_coded {
                entropy::least_length(layout, observer)?
            } else {
                packed::least_length(job, layout)
            };
            layout.check_size(bytes, least)?;
            let budget = if is_coded {
                let room = bytes.saturating_sub(least);
                Budget::Bits { bits: (room * 8) as f64, tune: job.tune }
            } else {
                Budget::Count(packed::count_for_size(bytes, job, layout))
            };
            return Ok((Aim::File(FileAim::Size(bytes.max(least))), budget));
        }
        Aim::File(FileAim::Psnr(psnr)) => {
            let share = if is_coded { rate_model::SHARE_OF_FIT } else { 1.0 };
            let error = SquaredError::at_psnr(psnr, tiled.samples());
            Budget::SquaredError(SquaredError(share * error.0))
        }
        Aim::File(FileAim::Quality(quality)) => {
            let [fine, .., coarse] = match tiled.loss.weights() {
                Some(weights) => weights.means,
                None => PerceptualWeights::new(job.source, observer)?.means,
            };
            Budget::Count(quality::count_for(quality, tiled.pixels(), [fine, coarse]))
        }
    };
    Ok((job.aim, budget))
}
