//! The way of Gaussians from elsewhere to a file that meets its target.

use super::aim::{Aim, FileAim};
use super::entropy;
use super::error::Result;
use super::file::FileLayout;
use super::fit::budget::Budget;
use super::fit::{Fit, Work};
use super::job::Job;
use super::outcome::Outcome;
use super::pipeline::within_reach;
use super::progress::Observer;
use super::quality::Judge;
use super::rate_model::SHARE_OF_FIT;
use super::rdo::SearchWork;
use super::resolutions::Resolutions;
use super::tiled_source::TiledSource;
use super::verify;
use super::workload::PREPARATION;
use crate::limits::Limits;
use crate::render::Picture;

/// The file of the last job, of Gaussians that are given for its source. Codes them for the target, and decodes the
/// file to tell what it shows.
pub(crate) fn encode(
    jobs: &[Job<'_>],
    fitted: &Picture<'_>,
    observer: &mut Observer<'_>,
) -> Result<Outcome> {
    let job = jobs.last().expect("there is a job");
    verify::check_limits(job)?;
    let judge = Judge::new(job.source);
    let preparation = job.workload(0).of(PREPARATION);
    let all = fitted.gaussians().len();
    observer.expect(preparation + SearchWork::new(job, all).whole());
    let tiled = TiledSource::new(job.source, job.tune, observer)?;
    let layout = FileLayout::of_fitted(fitted.header(), job.metadata);
    let layout = layout.with_first_layer(job.first_layer);
    let asked = job.aim;
    let (aim, budget) = within_reach(job, &layout, &tiled, observer)?;
    observer.advance(preparation)?;
    let job = &Job { aim, ..*job };
    // A number, or a size, may have no room for all.
    let is_limited = matches!(aim, Aim::Count(_) | Aim::File(FileAim::Size(_)));
    let room = if is_limited { budget } else { Budget::Count(all) };

    let sources = Resolutions::single(&tiled);
    let (base, work) = (layout.base(), Work::default());
    let mut fit = Fit::new(sources, job.training, room, job.precision, base, job.seed, work);
    fit.adopt(fitted.gaussians(), observer)?;
    reduce(&mut fit, aim, budget, &judge, &layout, observer)?;
    let preparing = tiled.memory() + tiled.scratch_memory;
    let (file, mut work) = entropy::code(fit, None, job, &judge, &tiled, &layout, observer)?;
    work.peak_memory = work.peak_memory.max(preparing);
    // The decoder needs memory, too.
    drop(tiled);
    Outcome::of(file, work, job, asked, &judge, &layout, observer)
}

/// Keeps the fewest Gaussians that a PSNR or a quality needs.
fn reduce(
    fit: &mut Fit<'_>,
    aim: Aim,
    budget: Budget,
    judge: &Judge<'_>,
    layout: &FileLayout<'_>,
    observer: &mut Observer<'_>,
) -> Result<()> {
    match (aim, budget) {
        (_, Budget::SquaredError(most)) => {
            fit.reduce(&|fit, _| Ok(fit.best_error().squared <= most), observer)
        }
        (Aim::File(FileAim::Quality(quality)), _) => {
            let is_enough = |fit: &Fit<'_>, observer: &mut Observer<'_>| {
                let (gaussians, limits) = (fit.gaussians(), Limits::none());
                let picture = Picture::new(layout.header(), &gaussians, &limits, 0);
                Ok(judge.judge(&picture, observer)?.excess(quality) <= SHARE_OF_FIT)
            };
            fit.reduce(&is_enough, observer)
        }
        _ => Ok(()),
    }
}
