//! Metadata: colour space, ICC profile, Exif, XMP and texts (spec, section 5.5).

#[cfg(feature = "encode")]
use alloc::borrow::Cow;
use alloc::string::String;
use alloc::vec::Vec;

use super::color_space::{Cicp, ContentLight, MasteringDisplay};
use super::exif;
use crate::chunk::ChunkType;
#[cfg(feature = "encode")]
use crate::chunk::MAX_CHUNK_LENGTH;
use crate::orientation::Orientation;

/// Most bytes of a keyword.
const MAX_KEYWORD: usize = 79;

/// The metadata of a file. It is passed on as it is stored, and does not change the samples (spec,
/// section 5.5).
#[derive(Clone, Debug, Default, PartialEq, Eq)]
#[non_exhaustive]
pub struct Metadata {
    /// The colour space of the colour channels in codes. It counts before the ICC profile.
    pub cicp: Option<Cicp>,
    /// The display on which the picture was made.
    pub mastering_display: Option<MasteringDisplay>,
    /// How bright the picture is.
    pub content_light: Option<ContentLight>,
    /// The ICC profile of the colour channels. Without one, and without codes, they are sRGB.
    pub icc_profile: Option<Vec<u8>>,
    /// Exif data: a TIFF stream, which begins with `II` or `MM`.
    pub exif: Option<Vec<u8>>,
    /// An XMP packet: XML in UTF-8.
    pub xmp: Option<Vec<u8>>,
    /// Keywords and their texts, in file order.
    pub texts: Vec<Text>,
}

/// Why metadata cannot be stored.
#[cfg(feature = "encode")]
#[derive(Clone, Debug, PartialEq, Eq, thiserror::Error)]
#[non_exhaustive]
pub enum MetadataError {
    /// The ICC profile, the Exif data or the XMP packet is longer than a chunk can be.
    #[error("metadata of more than 2^31 - 1 bytes")]
    TooLong,
    /// This keyword is empty or too long.
    #[error("keyword {0:?}; it must be 1 to 79 bytes long")]
    Keyword(String),
    /// This keyword, or its text, contains a NUL character.
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
    /// The keyword: 1 to 79 bytes of UTF-8 without NUL, such as `Title`, `Author` or `Copyright`.
    pub keyword: String,
    /// The text: any UTF-8 without NUL.
    pub text: String,
}

impl Metadata {
    /// How the picture is to be turned for display: what the Exif data say, if they say anything
    /// that Exif knows. The decoder's samples are not turned.
    #[must_use]
    pub fn orientation(&self) -> Orientation {
        self.exif.as_deref().and_then(exif::orientation).unwrap_or_default()
    }

    /// Whether Exif data say that the picture is to be turned.
    fn turns(exif: &[u8]) -> bool {
        exif::orientation(exif).unwrap_or_default() != Orientation::NoTransforms
    }

    /// Makes Exif say that the picture is upright. One that says nothing stays as it is.
    #[cfg(feature = "metadata")]
    pub(crate) fn reset_exif_orientation(&mut self) {
        if let Some(exif) = &mut self.exif {
            exif::reset_orientation(exif);
        }
    }

    /// Adds the payload of a metadata chunk.
    ///
    /// # Errors
    /// When it breaks a rule: which one. Nothing is added then.
    pub(crate) fn insert(
        &mut self,
        chunk: ChunkType,
        payload: Vec<u8>,
    ) -> Result<(), &'static str> {
        let wrong = "has a wrong length or content";
        match chunk {
            ChunkType::CICP => self.cicp = Some(Cicp::parse(&payload).ok_or(wrong)?),
            ChunkType::MDCV => {
                self.mastering_display = Some(MasteringDisplay::parse(&payload).ok_or(wrong)?);
            }
            ChunkType::CLLI => {
                self.content_light = Some(ContentLight::parse(&payload).ok_or(wrong)?);
            }
            ChunkType::ICCP => self.icc_profile = Some(payload),
            ChunkType::EXIF => self.exif = Some(payload),
            ChunkType::XMP => self.xmp = Some(payload),
            _ => self.texts.push(Text::parse(&payload)?),
        }
        Ok(())
    }

    /// Whether there is what a chunk holds that may be there once.
    pub(crate) fn has(&self, chunk: ChunkType) -> bool {
        match chunk {
            ChunkType::CICP => self.cicp.is_some(),
            ChunkType::MDCV => self.mastering_display.is_some(),
            ChunkType::CLLI => self.content_light.is_some(),
            ChunkType::ICCP => self.icc_profile.is_some(),
            ChunkType::EXIF => self.exif.is_some(),
            ChunkType::XMP => self.xmp.is_some(),
            _ => false,
        }
    }

    /// What a placeholder keeps of a chunk, so that it is shown as the whole picture is: its colours as they are, and of
    /// Exif that turns it the orientation alone. `None` of all else, and of what breaks a rule.
    #[cfg(feature = "encode")]
    pub(crate) fn for_placeholder(chunk: ChunkType, payload: &[u8]) -> Option<Cow<'_, [u8]>> {
        let is_sound = || Self::default().insert(chunk, payload.into()).is_ok();
        match chunk {
            ChunkType::EXIF => {
                let turned = |orientation: &Orientation| *orientation != Orientation::NoTransforms;
                let orientation = exif::orientation(payload).filter(turned)?;
                Some(exif::of_orientation(orientation).into())
            }
            // A profile may be anything, and long.
            ChunkType::ICCP => Some(payload.into()),
            _ if Self::is_of_color(chunk) && is_sound() => Some(payload.into()),
            _ => None,
        }
    }

    /// Whether a chunk says which colours the samples stand for: it must come before the first layer.
    pub(crate) fn is_of_color(chunk: ChunkType) -> bool {
        use ChunkType as Type;

        matches!(chunk, Type::CICP | Type::MDCV | Type::CLLI | Type::ICCP)
    }

    /// Whether a chunk of metadata says how the picture is shown: its colours, or that it is turned. Such a one must
    /// come before the first layer.
    pub(crate) fn is_of_display(chunk: ChunkType, payload: &[u8]) -> bool {
        Self::is_of_color(chunk) || chunk == ChunkType::EXIF && Self::turns(payload)
    }

    /// Whether chunks of a type may say how the picture is shown.
    #[cfg(feature = "encode")]
    pub(crate) fn may_be_of_display(chunk: ChunkType) -> bool {
        Self::is_of_color(chunk) || chunk == ChunkType::EXIF
    }

    /// Whether a chunk is metadata, which [`Metadata::insert`] takes.
    pub(crate) fn includes(chunk: ChunkType) -> bool {
        use ChunkType as Type;

        Self::is_of_color(chunk) || matches!(chunk, Type::EXIF | Type::XMP | Type::TEXT)
    }

    /// An upper bound of the memory that a chunk with a payload of `length` bytes takes, in bytes.
    pub(crate) fn memory_of(chunk: ChunkType, length: usize) -> u64 {
        // While the vector of texts grows, it takes memory for up to three elements per text. The
        // fourth stands for the two strings: even a short one takes one of the allocator's smallest
        // blocks.
        const PER_TEXT: usize = 4 * size_of::<Text>();

        let text = if chunk == ChunkType::TEXT { PER_TEXT } else { 0 };
        (length + text) as u64
    }

    /// Checks that all of it can be stored.
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

    /// The chunks of this metadata, in the order in which they are written.
    #[cfg(feature = "encode")]
    pub(crate) fn chunks(&self) -> impl Iterator<Item = (ChunkType, Vec<u8>)> + '_ {
        let once = [
            (ChunkType::CICP, self.cicp.map(|cicp| cicp.to_bytes().to_vec())),
            (ChunkType::MDCV, self.mastering_display.map(|display| display.to_bytes().to_vec())),
            (ChunkType::CLLI, self.content_light.map(|light| light.to_bytes().to_vec())),
            (ChunkType::ICCP, self.icc_profile.clone()),
            (ChunkType::EXIF, self.exif.clone()),
            (ChunkType::XMP, self.xmp.clone()),
        ];
        let once = once.into_iter().filter_map(|(chunk, payload)| Some((chunk, payload?)));
        once.chain(self.texts.iter().map(|text| (ChunkType::TEXT, text.to_payload())))
    }
}

impl Text {
    /// A keyword and its text. Both are checked when a file is written; see [`Text::keyword`] and
    /// [`Text::text`].
    #[must_use]
    pub fn new(keyword: impl Into<String>, text: impl Into<String>) -> Self {
        Self { keyword: keyword.into(), text: text.into() }
    }

    /// The text of a payload, or the rule that it breaks.
    fn parse(payload: &[u8]) -> Result<Self, &'static str> {
        let nul = payload.iter().position(|&byte| byte == 0).ok_or("no NUL after the keyword")?;
        if !(1..=MAX_KEYWORD).contains(&nul) {
            return Err("the keyword is not 1 to 79 bytes long");
        }
        let utf8 = |bytes| match core::str::from_utf8(bytes) {
            Ok(text) => Ok(String::from(text)),
            Err(_) => Err("is not UTF-8"),
        };
        let (keyword, text) = (utf8(&payload[..nul])?, utf8(&payload[nul + 1..])?);
        if text.contains('\0') {
            return Err("a NUL in the text");
        }
        Ok(Self { keyword, text })
    }

    #[cfg(feature = "encode")]
    fn to_payload(&self) -> Vec<u8> {
        [self.keyword.as_bytes(), &[0], self.text.as_bytes()].concat()
    }
}
