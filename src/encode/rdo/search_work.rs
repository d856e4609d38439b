//! How much work the search for a target is, for the progress that is told.

use super::step_search::Aim;
use crate::encode::job::Job;
use crate::encode::options::Tune;
use crate::encode::workload::Workload;

/// Most passes of coordinate descent until a target is met.
pub(super) const MOST_PASSES: u32 = 12;
/// Tries of first passes for a size, and for a PSNR or a quality.
const FIRST_TRIES: (f64, f64) = (1.5, 3.0);
/// Fewest passes in which lambda is adjusted, usually.
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
            None => self.descent(0, self.passes) + self.workload.verification(),
            Some(Aim::Size { .. }) => FIRST_TRIES.0 * self.first_try() + self.later_tries(),
            Some(_) => FIRST_TRIES.1 * self.first_try() + self.later_tries(),
        }
    }

    /// So many passes after `done` ones.
    fn descent(&self, done: u32, count: u32) -> f64 {
        self.workload.descent(done + 1, count)
    }

    /// A comparison with the aim.
    pub(super) fn comparison(&self) -> f64 {
        let measuring = match self.aim {
            None | Some(Aim::Size { .. }) => 0.0,
            Some(Aim::Psnr(_)) => self.workload.error(),
            Some(Aim::Dissimilarity(_)) => self.workload.quality(),
        };
        self.workload.coding() + measuring
    }

    /// The first passes of a try.
    pub(super) fn first_try(&self) -> f64 {
        self.descent(0, self.first_passes()) + self.comparison()
    }

    /// The tries in which lambda is adjusted, and all after them.
    pub(super) fn later_tries(&self) -> f64 {
        let tries = match self.aim {
            // It takes all passes, and if the codes are not tuned for it, the first try usually ends
            // beside the target.
            Some(Aim::Psnr(_)) => {
                let first = self.adjusting(MOST_PASSES - self.first_passes());
                first + if self.tune == Tune::Psnr { 0.0 } else { self.another_try() }
            }
            _ => self.adjusting(self.usual_passes()),
        };
        tries + self.workload.verification()
    }

    /// One more try, and all after it.
    pub(super) fn one_more_try(&self) -> f64 {
        self.another_try() + self.workload.verification()
    }

    fn another_try(&self) -> f64 {
        self.first_try() + self.adjusting(self.usual_passes())
    }

    /// So many passes in which lambda is adjusted.
    fn adjusting(&self, passes: u32) -> f64 {
        self.descent(self.first_passes(), passes) + f64::from(passes) * self.comparison()
    }

    fn usual_passes(&self) -> u32 {
        (self.passes.min(MOST_PASSES) - self.first_passes()).max(LEAST_PASSES)
    }
}
