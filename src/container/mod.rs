//! The container of a file: signature, chunks, header and metadata (spec, sections 4 and 5).

mod color_space;
mod exif;
pub(crate) mod fields;
mod header;
mod metadata;
mod parser;
#[cfg(feature = "encode")]
mod prefix;
pub(crate) mod varint;
#[cfg(feature = "encode")]
mod writer;

pub use color_space::{Cicp, ContentLight, MasteringDisplay};
#[cfg(feature = "metadata")]
pub(crate) use exif::{ByteOrder, Directory, Entry};
pub(crate) use header::Dequantizer;
#[cfg(feature = "encode")]
pub(crate) use header::MAX_SIDE;
pub use header::{Coding, Header};
#[cfg(feature = "encode")]
pub use metadata::MetadataError;
pub use metadata::{Metadata, Text};
pub(crate) use parser::{Event, Parser};
#[cfg(feature = "encode")]
pub use prefix::{Prefix, Prefixes};
#[cfg(feature = "encode")]
pub(crate) use writer::ChunkWriter;
