//! What the pipeline is asked for.

use super::fit::training::Training;
use super::options::{Precision, Target};
use super::source::Source;
use crate::container::Metadata;

/// What is to be encoded, and how.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Job<'a> {
    pub(crate) source: &'a Source<'a>,
    pub(crate) target: Target,
    pub(crate) precision: Precision,
    pub(crate) seed: u64,
    pub(crate) metadata: &'a Metadata,
    pub(crate) training: &'a Training,
    /// Of rate-distortion optimisation over the codes of entropy-coded Gaussians.
    pub(crate) passes: u32,
}
