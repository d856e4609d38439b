//! The packed coding: every component at its fixed bit depth, Gaussian after Gaussian (spec, sections
//! 6 and 7.2).

mod bits;
mod layer;
mod quantizer;

pub(crate) use layer::LayerReader;
#[cfg(feature = "encode")]
pub(crate) use layer::{LAYER_PREFIX, PackedCodes, packed_length, write_layer};
#[cfg(feature = "encode")]
pub(crate) use quantizer::MAX_PARAMETER;
pub use quantizer::{Quantizer, UniformQuantizer};
