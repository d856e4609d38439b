//! The encoder: pixels to Gaussians (`fit`), Gaussians to codes (`rdo`), codes to bytes (`file`);
//! `pipeline` is the way through them (paper: GaussianImage++).

mod encoder;
mod entropy;
mod error;
mod file;
mod fit;
mod job;
mod options;
mod packed;
mod pipeline;
mod progress;
mod raster;
mod rate_model;
mod rdo;
mod shortfall;
mod source;
mod strips;
mod verify;

pub use encoder::{Encoded, Encoder, Report, encode};
pub use error::{EncodeError, OptionError, SourceError};
pub(crate) use fit::training;
pub use options::{Precision, Target};
pub use progress::Progress;
pub use shortfall::Shortfall;
pub use source::Source;
