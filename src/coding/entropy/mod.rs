//! The entropy coding: the Gaussians of a layer as a set, in the order of a tree of cells, every
//! attribute entropy coded (spec, sections 7.3 to 7.5).

mod cells;
mod contexts;
#[cfg(all(fuzzing, feature = "encode"))]
pub mod fuzzing;
mod lattice;
mod layer;
mod rans;
mod statistics;
mod symbol;
mod tables;

#[cfg(feature = "encode")]
pub(crate) use cells::CenterGrid;
pub(crate) use lattice::Lattice;
pub use lattice::LatticeSteps;
#[cfg(feature = "encode")]
pub(crate) use lattice::{Code, LatticeCodes, MAX_CLASS, to_axes};
#[cfg(feature = "encode")]
pub(crate) use layer::EncodedLayer;
pub(crate) use layer::{LAYER_PREFIX, LayerCoder};
#[cfg(feature = "encode")]
pub(crate) use rans::SymbolCosts;
pub use statistics::AttributeBits;
