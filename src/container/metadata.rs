//! The ancillary chunks that this crate understands (spec, section 5.5).

use alloc::string::String;
use alloc::vec::Vec;

use crate::chunk::ChunkType;
#[cfg(feature = "encode")]
use crate::chunk::MAX_CHUNK_LENGTH;
use crate::error::DecodeError;

/// Most bytes in a keyword.
const MAX_KEYWORD: usize = 79;

/// What a file carries besides its picture. Stored as it is, never interpreted.
#[derive(Clone, Debug, Default, PartialEq, Eq)]
#[non_exhaustive]
pub struct Metadata {
    /// An ICC profile for the colour channels; without one they are sRGB.
    pub icc_profile: Option<Vec<u8>>,
    /// Exif data: a TIFF stream, starting with `II` or `MM`.
    pub exif: Option<Vec<u8>>,
    /// An XMP packet: UTF-8 XML.
    pub xmp: Option<Vec<u8>>,
    /// Keywords and texts, in file order.
    pub texts: Vec<Text>,
}

/// Why metadata cannot be stored.
#[cfg(feature = "encode")]
#[derive(Clone, Debug, PartialEq, Eq, thiserror::Error)]
#[non_exhaustive]
pub enum MetadataError {
    /// A profile, Exif or XMP is longer than a chunk can be.
    #[error("metadata of more than 2^31 - 1 bytes")]
    TooLong,
    /// A keyword is empty or too long.
    #[error("keyword {0:?}; it must be 1 to 79 bytes long")]
    Keyword(String),
    /// A keyword or the text of this keyword has a NUL.
    #[error("a NUL in the text {0:?}")]
    Nul(String),
    /// The text of this keyword is longer than a chunk can be.
    #[error("the text {0:?} is over 2^31 - 1 bytes long")]
    TextTooLong(String),
}

/// A keyword and its text.
#[derive(Clone, Debug, PartialEq, Eq)]
#[non_exhaustive]
pub struct Text {
    /// 1 to 79 bytes of UTF-8 without NUL, such as `Title`, `Author`, `Copyright`.
    pub keyword: String,
    /// Any UTF-8 text without NUL.
    pub text: String,
}

impl Metadata {
    /// Takes the payload of a known ancillary chunk; the first of each single-valued kind counts,
    /// later ones are an error.
    pub(crate) fn take(&mut self, chunk: ChunkType, payload: Vec<u8>) -> Result<(), DecodeError> {
        let slot = match chunk {
            ChunkType::ICCP => &mut self.icc_profile,
            ChunkType::EXIF => &mut self.exif,
            ChunkType::XMP => &mut self.xmp,
            _ => {
                self.texts.push(Text::parse(&payload)?);
                return Ok(());
            }
        };
        if slot.is_some() {
            return Err(DecodeError::malformed(chunk, "appears twice"));
        }
        *slot = Some(payload);
        Ok(())
    }

    /// Whether `chunk` is one of those that [`Metadata::take`] takes.
    pub(crate) fn knows(chunk: ChunkType) -> bool {
        matches!(chunk, ChunkType::ICCP | ChunkType::EXIF | ChunkType::XMP | ChunkType::TEXT)
    }

    /// Bytes held, a little more rather than less.
    pub(crate) fn size(&self) -> u64 {
        // A growing vector of texts holds up to three places for each at the moment it grows, and
        // a short string costs what the allocator's smallest pieces do.
        const PER_TEXT: usize = 4 * size_of::<Text>();

        let blobs = [&self.icc_profile, &self.exif, &self.xmp];
        let blobs = blobs.into_iter().flatten().map(Vec::len).sum::<usize>();
        let texts = self.texts.iter().map(|t| t.keyword.len() + t.text.len()).sum::<usize>();
        blobs as u64 + texts as u64 + (self.texts.len() * PER_TEXT) as u64
    }

    /// Says what cannot be stored, if anything cannot.
    #[cfg(feature = "encode")]
    pub(crate) fn check(&self) -> Result<(), MetadataError> {
        let blobs = [&self.icc_profile, &self.exif, &self.xmp];
        if blobs.into_iter().flatten().any(|blob| blob.len() > MAX_CHUNK_LENGTH as usize) {
            return Err(MetadataError::TooLong);
        }
        for Text { keyword, text } in &self.texts {
            if !(1..=MAX_KEYWORD).contains(&keyword.len()) {
                return Err(MetadataError::Keyword(keyword.clone()));
            }
            if keyword.contains('\0') || text.contains('\0') {
                return Err(MetadataError::Nul(keyword.clone()));
            }
            if keyword.len() + text.len() >= MAX_CHUNK_LENGTH as usize {
                return Err(MetadataError::TextTooLong(keyword.clone()));
            }
        }
        Ok(())
    }

    /// The chunks that carry this metadata, in the order in which they are written.
    #[cfg(feature = "encode")]
    pub(crate) fn chunks(&self) -> impl Iterator<Item = (ChunkType, Vec<u8>)> + '_ {
        let blobs = [
            (ChunkType::ICCP, &self.icc_profile),
            (ChunkType::EXIF, &self.exif),
            (ChunkType::XMP, &self.xmp),
        ];
        let blobs = blobs.into_iter().filter_map(|(chunk, blob)| Some((chunk, blob.clone()?)));
        blobs.chain(self.texts.iter().map(|text| (ChunkType::TEXT, text.to_payload())))
    }
}

impl Text {
    /// A keyword of 1 to 79 bytes and its text, both without NUL.
    #[must_use]
    pub fn new(keyword: impl Into<String>, text: impl Into<String>) -> Self {
        Self { keyword: keyword.into(), text: text.into() }
    }

    fn parse(payload: &[u8]) -> Result<Self, DecodeError> {
        const CHUNK: ChunkType = ChunkType::TEXT;
        let nul = payload
            .iter()
            .position(|&byte| byte == 0)
            .ok_or_else(|| DecodeError::malformed(CHUNK, "no NUL after the keyword"))?;
        if !(1..=MAX_KEYWORD).contains(&nul) {
            return Err(DecodeError::malformed(CHUNK, "the keyword is not 1 to 79 bytes long"));
        }
        let utf8 = |bytes| match core::str::from_utf8(bytes) {
            Ok(text) => Ok(String::from(text)),
            Err(_) => Err(DecodeError::malformed(CHUNK, "is not UTF-8")),
        };
        let (keyword, text) = (utf8(&payload[..nul])?, utf8(&payload[nul + 1..])?);
        if text.contains('\0') {
            return Err(DecodeError::malformed(CHUNK, "a NUL in the text"));
        }
        Ok(Self { keyword, text })
    }

    #[cfg(feature = "encode")]
    fn to_payload(&self) -> Vec<u8> {
        [self.keyword.as_bytes(), &[0], self.text.as_bytes()].concat()
    }
}
