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
    /// The strength of the texture, 0 to 100.
    pub(crate) texture: u8,
    /// Most bytes of the file that the first layer makes; `None` for one of the usual size.
    pub(crate) first_layer: Option<u32>,
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

    /// Whether its file may have a texture.
    pub(crate) fn has_texture(&self) -> bool {
        self.texture > 0 && self.tune == Tune::Visual
    }

    /// The work if the picture gets so many Gaussians.
    pub(crate) fn workload(&self, gaussians: usize) -> Workload {
        Workload::new(self.pixels(), gaussians)
    }
}
