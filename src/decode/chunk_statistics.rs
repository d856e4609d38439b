//! How many chunks of each type a file has, and how large they are.

use alloc::vec::Vec;

use crate::chunk::ChunkType;

/// Most types that are counted. A file may have any number of unknown types, and they are not to
/// take memory.
const MAX_TYPES: usize = 64;

/// The number of chunks of one type in a file, and their size.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
#[non_exhaustive]
pub struct ChunkStatistics {
    /// The type.
    pub kind: ChunkType,
    /// The number of chunks.
    pub count: u32,
    /// The bytes of all these chunks, type, length and CRC included.
    pub bytes: u64,
}

/// The complete chunks of a file, by type.
#[derive(Debug, Default)]
pub(super) struct ChunkCounter {
    types: Vec<ChunkStatistics>,
}

impl ChunkCounter {
    /// Counts a chunk of `bytes` bytes.
    pub(super) fn add(&mut self, kind: ChunkType, bytes: u64) {
        if let Some(known) = self.types.iter_mut().find(|known| known.kind == kind) {
            known.count = known.count.saturating_add(1);
            known.bytes += bytes;
        } else if self.types.len() < MAX_TYPES {
            self.types.push(ChunkStatistics { kind, count: 1, bytes });
        }
    }

    /// The types in the order in which they have appeared.
    pub(super) fn types(&self) -> &[ChunkStatistics] {
        &self.types
    }
}
