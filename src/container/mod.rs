//! The container: signature, chunks, header, metadata (spec, sections 4 and 5).

mod chunk;
mod header;
mod metadata;
mod parser;

pub use chunk::ChunkType;
#[cfg(any(feature = "encode", feature = "image"))]
pub(crate) use chunk::SIGNATURE;
#[cfg(feature = "encode")]
pub(crate) use chunk::write_chunk;
pub use header::{Coding, Header};
#[cfg(feature = "encode")]
pub(crate) use header::{MAX_SIDE, VERSION};
pub use metadata::{Metadata, Text};
pub(crate) use parser::{Event, Parser};
