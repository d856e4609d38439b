//! The two ways to store Gaussians: codes of a fixed length, packed, and entropy coding (spec,
//! section 7).

pub(crate) mod entropy;
pub(crate) mod packed;
