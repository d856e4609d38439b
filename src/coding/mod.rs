//! The two codings of Gaussians: packed, with codes of fixed bit depths, and entropy coded (spec,
//! sections 6 and 7).

pub(crate) mod entropy;
pub(crate) mod layer_count;
pub(crate) mod packed;
