//! The input of the pipeline.

use super::aim::Aim;
use super::fit::training::Training;
use super::options::{Precision, Tune};
use super::source::Source;
use super::workload::Workload;
use crate::container::Metadata;
use crate::limits::Limits;

/// A picture to encode, and the options to encode it with.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Job<'a> {
    pub(crate) source: &'a Source<'a>,
    pub(crate) aim: Aim,
    pub(crate) tune: Tune,
    pub(crate) precision: Precision,
    pub(crate) seed: u64,
    pub(crate) metadata: &'a Metadata,
    pub(crate) training: &'a Training,
    /// The limits of the decoder that is to read the file.
    pub(crate) limits: &'a Limits,
    /// Passes of rate-distortion optimization over the codes of an entropy-coded file.
    pub(crate) passes: u32,
}

impl Job<'_> {
    /// Number of pixels.
    pub(crate) fn pixels(&self) -> usize {
        self.source.pixels()
    }

    /// The work if the picture gets so many Gaussians.
    pub(crate) fn workload(&self, gaussians: usize) -> Workload {
        Workload::new(self.pixels(), gaussians)
    }
}
