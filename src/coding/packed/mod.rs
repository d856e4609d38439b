//! The packed coding (coding 0): Gaussian after Gaussian, every component with the bit depth of its
//! quantizer (spec, sections 6, 7.1 and 7.2).

mod bits;
mod layer;
mod quantizer;

pub(crate) use layer::PackedLayerReader;
#[cfg(feature = "encode")]
pub(crate) use layer::{PackedCodes, packed_length, write_layer};
#[cfg(feature = "encode")]
pub(crate) use quantizer::MAX_PARAMETER;
pub use quantizer::{Quantizer, UniformQuantizer};
