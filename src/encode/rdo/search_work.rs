//! How much work the search for a target is, for the progress that is told.

use super::step_search::Aim;
use crate::encode::job::Job;
use crate::encode::options::Tune;
use crate::encode::workload::Workload;

/// Most passes of coordinate descent until a target is met.
pub(super) const MOST_PASSES: u32 = 12;
/// Tries of first passes for a size, and for a PSNR or a quality.
const FIRST_TRIES: (f64, f64) = (1.5, 3.0);
/// Fewest passes after the first ones.
const LEAST_PASSES: u32 = 2;

/// The work of a search and of what follows it. How often something is tried is what is usual with
/// photographs; when more turns out to be needed, the estimate is replaced.
#[derive(Clone, Copy, Debug)]
pub(crate) struct SearchWork {
    workload: Workload,
    /// Passes that the effort sets.
    pub(super) passes: u32,
    tune: Tune,
    aim: Option<Aim>,
}

impl SearchWork {
    pub(crate) fn new(job: &Job<'_>, gaussians: usize) -> Self {
        let aim = Aim::new(job.target, job.pixels());
        Self { workload: job.workload(gaussians), passes: job.passes, tune: job.tune, aim }
    }

    /// Passes of a try before lambda is adjusted.
    pub(super) fn first_passes(&self) -> u32 {
        self.passes.div_ceil(4)
    }

    /// All.
    pub(crate) fn whole(&self) -> f64 {
        match self.aim {
            None => self.passes(0, self.passes) + self.end(),
            Some(Aim::Size { .. }) => FIRST_TRIES.0 * self.first_try() + self.later_tries(),
            Some(_) => FIRST_TRIES.1 * self.first_try() + self.later_tries(),
        }
    }

    /// So many passes after `done` ones.
    pub(super) fn passes(&self, done: u32, count: u32) -> f64 {
        self.workload.descent(done + 1, count)
    }

    /// A comparison with the aim.
    pub(super) fn comparison(&self) -> f64 {
        self.workload.coding()
            + match self.aim {
                None | Some(Aim::Size { .. }) => 0.0,
                Some(Aim::Psnr(_)) => self.workload.error(),
                Some(Aim::Dissimilarity(_)) => self.workload.quality(),
            }
    }

    /// The first passes of a try.
    pub(super) fn first_try(&self) -> f64 {
        self.passes(0, self.first_passes()) + self.comparison()
    }

    /// The passes in which lambda is adjusted, and all after them.
    pub(super) fn later_tries(&self) -> f64 {
        let first = self.first_passes();
        let usual = self.passes.min(MOST_PASSES) - first;
        let adjusted = |passes| self.passes(first, passes) + f64::from(passes) * self.comparison();
        let tries = match self.aim {
            Some(Aim::Size { .. }) => adjusted(usual.max(LEAST_PASSES)),
            // It takes all passes, and if the codes are not tuned for it, the first try usually ends
            // beside the target.
            Some(Aim::Psnr(_)) if self.tune == Tune::Psnr => adjusted(MOST_PASSES - first),
            Some(Aim::Psnr(_)) => {
                adjusted(MOST_PASSES - first) + self.first_try() + adjusted(usual.max(3))
            }
            _ => adjusted(usual),
        };
        tries + self.end()
    }

    /// One more try, and all after it.
    pub(super) fn one_more_try(&self) -> f64 {
        let usual = (self.passes.min(MOST_PASSES) - self.first_passes()).max(3);
        let comparisons = f64::from(usual) * self.comparison();
        self.first_try() + self.passes(self.first_passes(), usual) + comparisons + self.end()
    }

    /// All after the search: verification.
    fn end(&self) -> f64 {
        self.workload.verification()
    }
}
