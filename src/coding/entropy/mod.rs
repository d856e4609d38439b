//! The entropy coding (coding 1): the Gaussians of a layer as a set, in the order of a tree of
//! cells, with every attribute entropy coded (spec, sections 7.3 to 7.5).

mod attributes;
mod cells;
mod contexts;
#[cfg(all(fuzzing, feature = "encode"))]
pub mod fuzzing;
mod layer;
mod numbers;
mod quantization;
mod rans;
mod statistics;
pub(crate) mod steps;
mod symbol;
mod tables;
#[cfg(all(test, feature = "encode"))]
mod tables_fit;
mod tree_walk;

#[cfg(feature = "encode")]
pub(crate) use cells::CenterGrid;
#[cfg(feature = "encode")]
pub(crate) use layer::EncodedLayer;
pub(crate) use layer::LayerCoder;
pub(crate) use quantization::Quantization;
pub use quantization::QuantizationSteps;
#[cfg(feature = "encode")]
pub(crate) use quantization::{Code, MAX_EXPONENT, MOST_CODE, QuantizedCodes, to_axes};
#[cfg(feature = "encode")]
pub(crate) use rans::SymbolCosts;
pub use statistics::AttributeBits;
