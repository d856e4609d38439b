//! The signature, and the types of chunks (spec, sections 4.1 to 4.3).

use core::fmt;

/// The first eight bytes of every file: a byte that no text starts with, the letters `GIP`, and
/// line endings that a transfer as text would change (as in PNG).
pub(crate) const SIGNATURE: [u8; 8] = [0xC7, b'G', b'I', b'P', b'\r', b'\n', 0x1A, b'\n'];

/// Longest payload of a chunk, in bytes.
pub(crate) const MAX_CHUNK_LENGTH: u32 = (1 << 31) - 1;

/// Bytes of a chunk besides its payload: length, type and CRC.
pub(crate) const FRAMING: usize = 12;

/// The type of a chunk: four ASCII letters (spec, section 4.3).
///
/// A first letter in upper case means *critical*: a decoder that does not know the type must refuse
/// the file. Lower case means *ancillary*: a decoder that does not know the type skips the chunk.
#[derive(Clone, Copy, PartialEq, Eq, Hash)]
pub struct ChunkType(pub [u8; 4]);

impl ChunkType {
    /// The header, always the first chunk.
    pub const GHDR: Self = Self(*b"GHDR");
    /// The quantizers.
    pub const QNTZ: Self = Self(*b"QNTZ");
    /// One layer of Gaussians.
    pub const GAUS: Self = Self(*b"GAUS");
    /// The bounds of the layers: where each of them shows.
    pub const BNDS: Self = Self(*b"bNDS");
    /// The texture: the Gaussians of its map.
    pub const TXTR: Self = Self(*b"tXTR");
    /// The end of the file, always the last chunk.
    pub const GEND: Self = Self(*b"GEND");
    /// An ICC profile.
    pub const ICCP: Self = Self(*b"iCCP");
    /// Exif data: a TIFF stream.
    pub const EXIF: Self = Self(*b"eXIf");
    /// An XMP packet.
    pub const XMP: Self = Self(*b"xMPd");
    /// A keyword and its text.
    pub const TEXT: Self = Self(*b"tEXt");

    /// Whether the chunk is critical: a decoder must know this type to show the picture.
    #[must_use]
    pub const fn is_critical(self) -> bool {
        self.0[0].is_ascii_uppercase()
    }

    /// Whether all four bytes are ASCII letters.
    pub(crate) fn is_well_formed(self) -> bool {
        self.0.iter().all(u8::is_ascii_alphabetic)
    }
}

impl fmt::Display for ChunkType {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        for byte in self.0 {
            fmt::Display::fmt(&byte.escape_ascii(), f)?;
        }
        Ok(())
    }
}

impl fmt::Debug for ChunkType {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(f, "ChunkType({self})")
    }
}
