//! The decoder: bytes to Gaussians (spec, sections 4 and 11).

mod pending;
#[cfg(feature = "std")]
mod reader;
mod stream;
mod whole;

#[cfg(feature = "std")]
pub use reader::Decoder;
pub use stream::{ChunkStatistics, StreamDecoder};
pub use whole::{Decoded, Samples, decode};
