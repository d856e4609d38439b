//! The fields of a payload, one after the other.

use byteorder::{ByteOrder, LittleEndian};

use super::varint;
use crate::chunk::ChunkType;
use crate::error::{DecodeError, Reason};

/// What is left of a payload.
#[derive(Debug)]
pub(crate) struct Fields<'a> {
    /// The chunk that errors name.
    chunk: ChunkType,
    rest: &'a [u8],
}

impl<'a> Fields<'a> {
    /// The fields of a payload of this chunk.
    pub(crate) fn new(chunk: ChunkType, payload: &'a [u8]) -> Self {
        Self { chunk, rest: payload }
    }

    /// The next byte.
    pub(crate) fn u8(&mut self) -> Result<u8, DecodeError> {
        self.take::<1>().map(|[byte]| byte)
    }

    /// The next number of 16 bits.
    pub(crate) fn u16(&mut self) -> Result<u16, DecodeError> {
        self.take().map(u16::from_le_bytes)
    }

    /// The next binary32.
    pub(crate) fn f32(&mut self) -> Result<f32, DecodeError> {
        self.take::<4>().map(|bytes| LittleEndian::read_f32(&bytes))
    }

    /// The next number of one to five bytes.
    pub(crate) fn varint(&mut self) -> Result<u32, DecodeError> {
        let number = varint::read(&mut self.rest);
        number.map_err(|flaw| self.malformed(flaw.reason()))?.ok_or_else(|| self.too_short())
    }

    /// All bytes that are left.
    pub(crate) fn rest(self) -> &'a [u8] {
        self.rest
    }

    /// Checks that nothing is left.
    pub(crate) fn finish(&self) -> Result<(), DecodeError> {
        if self.rest.is_empty() {
            return Ok(());
        }
        Err(self.malformed("is longer than its fields"))
    }

    /// The error of a field that breaks a rule.
    pub(crate) fn malformed(&self, reason: impl Into<Reason>) -> DecodeError {
        DecodeError::malformed(self.chunk, reason)
    }

    /// The error of a field that may be valid in another version.
    pub(crate) fn unsupported(&self, what: &'static str, value: u32) -> DecodeError {
        DecodeError::unsupported(self.chunk, what, value)
    }

    fn take<const LENGTH: usize>(&mut self) -> Result<[u8; LENGTH], DecodeError> {
        let (field, rest) = self.rest.split_first_chunk().ok_or_else(|| self.too_short())?;
        self.rest = rest;
        Ok(*field)
    }

    fn too_short(&self) -> DecodeError {
        self.malformed("is shorter than its fields")
    }
}
