//! The encoder, after the paper GaussianImage++.
//!
//! `fit` turns pixels into Gaussians, `rdo` turns Gaussians into codes of the entropy coding, and
//! `file` writes codes as bytes; `pipeline` runs these stages one after the other.

mod adopted;
mod aim;
mod alpha_bleed;
mod appearance;
mod encoder;
mod entropy;
mod error;
mod file;
mod fit;
mod importance;
mod job;
mod loss;
mod mul_add;
mod options;
mod outcome;
mod own_frame;
mod packed;
mod pairs;
mod pipeline;
mod progress;
mod quality;
mod rate_model;
mod rdo;
mod reduced;
mod resolutions;
mod rows;
mod sample_tile;
mod shortfall;
mod sketch;
mod source;
mod stopwatch;
mod strips;
#[cfg(test)]
mod testing;
mod texture;
mod tiled_source;
mod verify;
mod workload;
mod writer;

pub use encoder::{Encoded, Encoder, Report, encode};
pub use error::{EncodeError, OptionError, SourceError, WriteError};
pub(crate) use fit::training;
pub use fit::{CustomPlacement, ErrorMap, VectorQuantizer};
pub use importance::Importance;
pub use loss::ErrorNorm;
pub use options::{Precision, Target, Tune};
pub use progress::Progress;
pub use shortfall::Shortfall;
pub use source::Source;
pub use writer::Writer;
