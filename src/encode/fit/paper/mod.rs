//! What is the paper's own (GaussianImage++, arXiv:2512.19108) and not part of the default encoding: its
//! constants, Adam, LSQ+ with quantization-aware training for the packed coding, and where and how its new
//! Gaussians begin. docs/ARCHITECTURE.md, "The paper's terms", tells where the rest of its method is.

pub(super) mod adam;
mod constants;
mod lsq;
mod placement;
mod ranges;
pub(super) mod vector_quantizer;

pub(super) use lsq::{LsqQuantizers, QuantizerGradients, add, decoded};
pub(super) use placement::{largest, random_shape};
pub(crate) use ranges::quantizers_for;
pub use vector_quantizer::VectorQuantizer;
