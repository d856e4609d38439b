//! The signature, and the types and the framing of chunks (spec, sections 4.1 to 4.3).

use core::fmt;

#[cfg(feature = "encode")]
use crate::container::varint;

/// The bytes before the version, with which every file begins: a byte that no text starts with, the letters `GIP`,
/// and a line ending that a transfer as text would change (as in PNG).
pub(crate) const MAGIC: [u8; 6] = [0xC7, b'G', b'I', b'P', b'\r', b'\n'];
/// The version that this crate reads and writes.
pub(crate) const VERSION: u8 = 1;
/// The first eight bytes of every file of this version: a last one tells of transfers that change single line feeds.
pub(crate) const SIGNATURE: [u8; 8] = [0xC7, b'G', b'I', b'P', b'\r', b'\n', VERSION, b'\n'];

/// Longest payload of a chunk, in bytes.
pub(crate) const MAX_CHUNK_LENGTH: u32 = (1 << 31) - 1;
/// Bytes of a CRC.
pub(crate) const CRC_LENGTH: usize = 4;
/// Bytes of the shortest chunk, which is also the end of every file: a letter, a length of 0 and a CRC.
#[cfg(feature = "std")]
pub(crate) const LEAST_CHUNK: usize = 1 + 1 + CRC_LENGTH;

/// The type of a chunk (spec, section 4.3): one upper-case letter if it is *critical*, so that a decoder that does not
/// know it must refuse the file, or four letters of which the first is in lower case if it is *ancillary*, so that a
/// decoder that does not know it skips the chunk.
#[derive(Clone, Copy, PartialEq, Eq, Hash)]
pub struct ChunkType([u8; 4]);

impl ChunkType {
    /// The header, always the first chunk.
    pub const HEADER: Self = Self::critical(b'H');
    /// One layer of Gaussians.
    pub const LAYER: Self = Self::critical(b'L');
    /// The end of the file, always the last chunk.
    pub const END: Self = Self::critical(b'E');
    /// The bounds of the layers: where each of them shows.
    pub const BNDS: Self = Self(*b"bNDS");
    /// The texture: the Gaussians of its map.
    pub const TXTR: Self = Self(*b"tXTR");
    /// The colour space, in coding-independent code points.
    pub const CICP: Self = Self(*b"cICP");
    /// The display on which the picture was made.
    pub const MDCV: Self = Self(*b"mDCV");
    /// How bright the picture is.
    pub const CLLI: Self = Self(*b"cLLI");
    /// An ICC profile.
    pub const ICCP: Self = Self(*b"iCCP");
    /// Exif data: a TIFF stream.
    pub const EXIF: Self = Self(*b"eXIF");
    /// An XMP packet.
    pub const XMP: Self = Self(*b"xMPD");
    /// A keyword and its text.
    pub const TEXT: Self = Self(*b"tEXt");

    const fn critical(letter: u8) -> Self {
        Self([letter, 0, 0, 0])
    }

    /// The type that begins with these bytes, of which there are one or four: as many as [`ChunkType::length_from`]
    /// says.
    pub(crate) fn from_bytes(bytes: &[u8]) -> Self {
        let mut code = [0; 4];
        code[..bytes.len()].copy_from_slice(bytes);
        Self(code)
    }

    /// How many bytes a type has that begins with this one.
    pub(crate) const fn length_from(first: u8) -> usize {
        if first.is_ascii_lowercase() { 4 } else { 1 }
    }

    /// The letters of the type, without what it stands for: `H`, `bNDS`. What is no letter, in the error that says so,
    /// is escaped.
    pub fn letters(&self) -> impl fmt::Display {
        self.bytes().escape_ascii()
    }

    /// The bytes in the file.
    pub(crate) fn bytes(&self) -> &[u8] {
        &self.0[..Self::length_from(self.0[0])]
    }

    /// Whether the chunk is critical: a decoder must know this type to show the picture.
    #[must_use]
    pub const fn is_critical(self) -> bool {
        self.0[0].is_ascii_uppercase()
    }

    /// Whether all bytes are ASCII letters.
    pub(crate) fn is_well_formed(self) -> bool {
        self.bytes().iter().all(u8::is_ascii_alphabetic)
    }

    /// Bytes of a chunk of this type with a payload of `length` bytes: type, length, payload and CRC.
    #[cfg(feature = "encode")]
    pub(crate) fn framed(self, length: usize) -> usize {
        self.bytes().len() + varint::length(length as u32) + length + CRC_LENGTH
    }
}

/// The letters, and for those of this document that are a single one what it stands for.
impl fmt::Display for ChunkType {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        self.letters().fmt(f)?;
        match *self {
            Self::HEADER => f.write_str(" (header)"),
            Self::LAYER => f.write_str(" (layer)"),
            Self::END => f.write_str(" (end)"),
            _ => Ok(()),
        }
    }
}

impl fmt::Debug for ChunkType {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(f, "ChunkType({self})")
    }
}
