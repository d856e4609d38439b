#![cfg_attr(not(feature = "std"), no_std)]

//! `.gip`: pictures made of 2D Gaussians.

#[cfg(feature = "decode")]
extern crate alloc;

#[cfg(feature = "decode")]
mod coding;
#[cfg(feature = "decode")]
mod color;
#[cfg(feature = "decode")]
mod container;
#[cfg(feature = "decode")]
mod decoder;
#[cfg(feature = "encode")]
mod encode;
#[cfg(feature = "decode")]
mod error;
#[cfg(feature = "decode")]
mod gaussian;
#[cfg(feature = "image")]
mod image;
#[cfg(feature = "decode")]
mod limits;
#[cfg(feature = "decode")]
mod math;
#[cfg(feature = "encode")]
pub mod metrics;
#[cfg(feature = "decode")]
mod quantizer;
#[cfg(feature = "decode")]
mod render;

#[cfg(feature = "image")]
pub use crate::image::{GipDecoder, GipEncoder, register};
#[cfg(feature = "decode")]
pub use color::{ColorModel, SampleDepth};
#[cfg(feature = "decode")]
pub use container::{ChunkType, Header, Metadata, Text};
#[cfg(all(feature = "decode", feature = "std"))]
pub use decoder::Decoder;
#[cfg(feature = "decode")]
pub use decoder::{ChunkStatistics, StreamDecoder};
#[cfg(feature = "encode")]
pub use encode::{EncodeError, Encoded, Encoder, Precision, Progress, Report, Source, Target};
#[cfg(feature = "decode")]
pub use error::{DecodeError, LimitKind, Reason, Unsupported};
#[cfg(feature = "decode")]
pub use gaussian::{Chart, Gaussian};
#[cfg(feature = "decode")]
pub use limits::Limits;
#[cfg(feature = "decode")]
pub use quantizer::{Quantizer, Steps};
#[cfg(feature = "decode")]
pub use render::{Kernel, Picture, Region, RenderOptions};

#[cfg(feature = "encode")]
pub mod training {
    //! The constants of training, for those who study the method: see [`Training`].

    pub use crate::encode::training::{
        Densification, Distortion, Filter, NewColor, NewShape, Optimizer, Placement, Portion,
        Quantization, Schedule, Training, Units,
    };
}
