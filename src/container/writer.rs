//! Writes the signature and the framing of chunks: length, type, payload, CRC-32 (spec, sections
//! 4.1 and 4.2).

use alloc::vec::Vec;

use byteorder::{ByteOrder, LittleEndian};

use crate::chunk::{ChunkType, MAX_CHUNK_LENGTH, SIGNATURE};

/// Writes a file chunk by chunk.
#[derive(Debug)]
pub(crate) struct ChunkWriter {
    file: Vec<u8>,
}

impl ChunkWriter {
    /// Begins a file: with the signature.
    pub(crate) fn new() -> Self {
        Self { file: SIGNATURE.to_vec() }
    }

    /// Appends a chunk, whose payload must have at most [`MAX_CHUNK_LENGTH`] bytes.
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

    /// The file so far.
    pub(crate) fn into_bytes(self) -> Vec<u8> {
        self.file
    }

    /// Appends `GEND`, and returns the file.
    pub(crate) fn finish(mut self) -> Vec<u8> {
        self.chunk(ChunkType::GEND, &[]);
        self.file
    }
}
