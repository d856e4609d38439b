//! Texture: what a picture has too much of to store it sample by sample, as noise of the strength that a
//! map gives (spec, sections 5.7 and 9.7).
//!
//! [`chunk`] reads and writes the Gaussians of the map, [`map`] says what the map's values mean,
//! [`noise`] lists the patterns, [`gains`] has what they are multiplied by, and [`synthesis`] adds them up, all
//! with the [`arithmetic`] of the backend. Functions are inlined into that of a level, where that has instructions of
//! its own; WebAssembly has one level for all code, and the large ones are not copied there: pages load them.

mod arithmetic;
mod chunk;
mod gains;
mod map;
mod noise;
mod synthesis;

#[cfg(feature = "std")]
pub(crate) use arithmetic::Vectors;
pub(crate) use arithmetic::{Arithmetic, Plain};
pub(crate) use chunk::Texture;
pub(crate) use map::{CELL, NodeMap};
#[cfg(feature = "encode")]
pub(crate) use map::{OCTAVES, amplitude_sum, direction_sum, has_amplitude};
pub(crate) use synthesis::Synthesis;
