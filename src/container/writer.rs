//! Signature and chunk framing: length, type, payload, CRC-32 (spec, sections 4.1 and 4.2).

use alloc::vec::Vec;

use byteorder::{ByteOrder, LittleEndian};

use crate::chunk::{ChunkType, MAX_CHUNK_LENGTH, SIGNATURE};

/// A file that is being written, chunk by chunk.
#[derive(Debug)]
pub(crate) struct ChunkWriter {
    file: Vec<u8>,
}

impl ChunkWriter {
    /// Begins a file.
    pub(crate) fn new() -> Self {
        Self { file: SIGNATURE.to_vec() }
    }

    /// Appends one chunk. The payload is at most [`MAX_CHUNK_LENGTH`] bytes long.
    pub(crate) fn chunk(&mut self, kind: ChunkType, payload: &[u8]) {
        assert!(payload.len() <= MAX_CHUNK_LENGTH as usize, "the caller splits layers");
        let mut word = [0; 4];
        LittleEndian::write_u32(&mut word, payload.len() as u32);
        self.file.extend_from_slice(&word);
        self.file.extend_from_slice(&kind.0);
        self.file.extend_from_slice(payload);
        let mut crc = crc32fast::Hasher::new();
        crc.update(&kind.0);
        crc.update(payload);
        LittleEndian::write_u32(&mut word, crc.finalize());
        self.file.extend_from_slice(&word);
    }

    /// Ends the file.
    pub(crate) fn finish(mut self) -> Vec<u8> {
        self.chunk(ChunkType::GEND, &[]);
        self.file
    }
}
