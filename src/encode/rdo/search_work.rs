//! Estimates of the work of the search for a target, for the progress report.

use crate::encode::aim::FileAim;
use crate::encode::job::Job;
use crate::encode::workload::{CODING, ERROR, QUALITY, Workload};

/// Average number of tries until a size is met, and until a PSNR or a quality is met.
const TRIES: (f64, f64) = (1.0, 1.5);

/// The estimated work of a search and of the stages after it. A search that needs more tries or passes than
/// usual replaces the estimate.
#[derive(Clone, Copy, Debug)]
pub(crate) struct SearchWork {
    workload: Workload,
    /// Passes that the effort sets.
    pub(super) passes: u32,
    aim: Option<FileAim>,
}

impl SearchWork {
    pub(crate) fn new(job: &Job<'_>, gaussians: usize) -> Self {
        Self { workload: job.workload(gaussians), passes: job.passes, aim: job.aim.of_file() }
    }

    /// Passes of a try before it is compared with the aim.
    pub(super) fn first_passes(&self) -> u32 {
        self.passes.div_ceil(4)
    }

    /// All.
    pub(crate) fn whole(&self) -> f64 {
        let tries = match self.aim {
            None | Some(FileAim::Size(_)) => TRIES.0,
            Some(_) => TRIES.1,
        };
        tries * self.one_try() + self.workload.verification()
    }

    /// One more try, and all after it.
    pub(super) fn one_more_try(&self) -> f64 {
        self.one_try() + self.workload.verification()
    }

    /// One more pass after `done` ones, and all after it.
    pub(super) fn one_more_pass(&self, done: u32) -> f64 {
        self.pass(done) + self.comparison() + self.workload.verification()
    }

    /// A pass after `done` ones.
    pub(super) fn pass(&self, done: u32) -> f64 {
        self.workload.descent(done + 1, 1)
    }

    /// A comparison with the aim.
    pub(super) fn comparison(&self) -> f64 {
        let measuring = match self.aim {
            None | Some(FileAim::Size(_)) => 0.0,
            Some(FileAim::Psnr(_)) => self.workload.of(ERROR),
            Some(FileAim::Quality(_)) => self.workload.of(QUALITY),
        };
        self.workload.of(CODING) + measuring
    }

    fn one_try(&self) -> f64 {
        let comparisons = self.aim.map_or(0, |_| self.passes + 1 - self.first_passes());
        self.workload.descent(1, self.passes) + f64::from(comparisons) * self.comparison()
    }
}
