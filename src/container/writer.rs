//! Writes the signature and the framing of chunks: type, length, payload, CRC-32 (spec, sections
//! 4.1 and 4.2).

use alloc::vec::Vec;

use byteorder::{ByteOrder, LittleEndian};

use super::varint;
use crate::chunk::{CRC_LENGTH, ChunkType, MAX_CHUNK_LENGTH, SIGNATURE};

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

    /// Bytes of a file with a header of such a payload, and chunks of so many bytes between it and the end.
    pub(crate) fn length(header: usize, chunks: usize) -> usize {
        SIGNATURE.len() + ChunkType::HEADER.framed(header) + chunks + ChunkType::END.framed(0)
    }

    /// Appends a chunk, whose payload is these parts and has at most [`MAX_CHUNK_LENGTH`] bytes.
    pub(crate) fn chunk(&mut self, kind: ChunkType, payload: &[&[u8]]) {
        let length = payload.iter().map(|part| part.len()).sum::<usize>();
        assert!(length <= MAX_CHUNK_LENGTH as usize, "the caller splits layers");
        let start = self.file.len();
        self.file.extend_from_slice(kind.bytes());
        varint::write(length as u32, &mut self.file);
        payload.iter().for_each(|part| self.file.extend_from_slice(part));
        let mut crc = [0; CRC_LENGTH];
        LittleEndian::write_u32(&mut crc, crc32fast::hash(&self.file[start..]));
        self.file.extend_from_slice(&crc);
    }

    /// The file so far.
    pub(crate) fn into_bytes(self) -> Vec<u8> {
        self.file
    }

    /// Appends the end, and returns the file.
    pub(crate) fn finish(mut self) -> Vec<u8> {
        self.chunk(ChunkType::END, &[]);
        self.file
    }
}
