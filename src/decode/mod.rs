//! The decoder: from bytes to Gaussians, and with a renderer to samples (spec, sections 4 and 11).

mod chunk_decoder;
mod chunk_statistics;
mod memory;
mod pending;
#[cfg(feature = "std")]
mod reader;
mod stream;
mod whole;

pub use chunk_statistics::ChunkStatistics;
#[cfg(feature = "std")]
pub use reader::Decoder;
pub use stream::StreamDecoder;
pub use whole::{Decoded, Samples, decode};
