//! The errors of the decoder (spec, section 1).

use alloc::borrow::Cow;
use alloc::format;
use alloc::string::String;
use core::fmt;

use thiserror::Error;

use crate::chunk::ChunkType;
use crate::color::ColorModel;
use crate::region::{MAX_OUTPUT_SIDE, Region};

/// Why a file was not decoded, or not to its end (spec, section 11).
///
/// What was decoded before the error remains available from the decoder.
#[derive(Debug, Error)]
#[non_exhaustive]
pub enum DecodeError {
    /// The first bytes are not those of a `.gip` file.
    #[error("not a .gip file: the signature does not match")]
    Signature,
    /// The file breaks a rule of the format.
    #[error("chunk {chunk}: {reason}")]
    Malformed {
        /// The chunk that breaks the rule.
        chunk: ChunkType,
        /// Which rule.
        reason: Reason,
    },
    /// The file may be valid, but requires something that this decoder does not have: a later
    /// version, another quantizer, an unknown critical chunk.
    #[error("chunk {chunk}: unsupported: {what}")]
    Unsupported {
        /// The chunk that requires it.
        chunk: ChunkType,
        /// What it requires.
        what: Unsupported,
    },
    /// The file ends too early. The Gaussians that have arrived are available.
    #[error("unexpected end of the file in {}", match .chunk {
        Some(chunk) => format!("chunk {chunk}"),
        None => String::from("the signature or between two chunks"),
    })]
    UnexpectedEnd {
        /// The chunk that is incomplete; `None` if the file ends between two chunks, in the type of a chunk, or in
        /// the signature.
        chunk: Option<ChunkType>,
    },
    /// The file or the request requires more than one of the [`Limits`](crate::Limits) allows.
    #[error("limit exceeded: {kind}: {wanted} required, {allowed} allowed")]
    Limit {
        /// Which limit.
        kind: LimitKind,
        /// What the file or the request requires, in the unit of the limit. It may require more:
        /// the check ends as soon as the limit is exceeded.
        wanted: u64,
        /// The limit.
        allowed: u64,
    },
    /// The caller requested something that cannot be done.
    #[error("invalid request: {0}")]
    Request(#[from] RequestError),
    /// An earlier call failed. The decoder cannot continue after an error.
    #[error("decoding already failed")]
    AlreadyFailed,
    /// The reader failed.
    #[cfg(feature = "std")]
    #[error("reading failed: {0}")]
    Io(#[from] std::io::Error),
}

impl DecodeError {
    /// The error of a chunk that breaks a rule.
    pub(crate) fn malformed(chunk: ChunkType, reason: impl Into<Reason>) -> Self {
        Self::Malformed { chunk, reason: reason.into() }
    }

    /// The error of a chunk that requires something that this decoder does not have.
    pub(crate) fn unsupported(chunk: ChunkType, what: &'static str, value: u32) -> Self {
        Self::Unsupported { chunk, what: Unsupported { what, value: Some(value) } }
    }

    /// The error of a critical chunk of an unknown type.
    pub(crate) fn unknown_critical(chunk: ChunkType) -> Self {
        let what = Unsupported { what: "critical chunk of an unknown type", value: None };
        Self::Unsupported { chunk, what }
    }

    /// Whether the file ended too early: with more bytes, decoding could have continued.
    #[must_use]
    pub fn is_unexpected_end(&self) -> bool {
        matches!(self, Self::UnexpectedEnd { .. })
    }
}

/// Why a header and Gaussians are no picture that the format can hold.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Error)]
#[non_exhaustive]
pub enum PictureError {
    /// A field of the header is out of range.
    #[error("{0}")]
    Header(&'static str),
    /// There are too many Gaussians.
    #[error("{found} Gaussians; there may be at most {allowed}")]
    Count {
        /// How many there are.
        found: usize,
        /// How many there may be.
        allowed: u32,
    },
    /// A Gaussian is not drawn by the rules of the format, or would not be as a file would have it.
    #[error("Gaussian {index}: {rule}")]
    Gaussian {
        /// The index of the first one of which this is so.
        index: usize,
        /// The rule that it breaks.
        rule: &'static str,
    },
}

/// A request of the caller that cannot be fulfilled.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Error)]
#[non_exhaustive]
pub enum RequestError {
    /// The output buffer has the wrong length.
    #[error("the output buffer holds {found} samples, {wanted} are needed")]
    BufferLength {
        /// Length of the buffer in samples.
        found: usize,
        /// Length of the output in samples.
        wanted: usize,
    },
    /// The size of the whole output is out of range: each side must be 1 to 2^23 pixels.
    #[error("an output of {width}x{height} pixels; each side must be 1 to {MAX_OUTPUT_SIDE}")]
    OutputSize {
        /// Width in pixels.
        width: u32,
        /// Height in pixels.
        height: u32,
    },
    /// The region is empty, or not inside the output.
    #[error(
        "the region {}x{} at ({}, {}) is empty or not inside the {width}x{height} output",
        region.width, region.height, region.x, region.y
    )]
    Region {
        /// The region, in output pixels.
        region: Region,
        /// Width of the whole output in pixels.
        width: u32,
        /// Height of the whole output in pixels.
        height: u32,
    },
    /// The requested colour model lacks a channel of the file's own.
    #[error("{from:?} cannot be written as {to:?}")]
    ColorModel {
        /// The colour model of the file.
        from: ColorModel,
        /// The requested colour model.
        to: ColorModel,
    },
}

/// Which of the [`Limits`](crate::Limits) was exceeded.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
#[non_exhaustive]
pub enum LimitKind {
    /// Width in pixels.
    Width,
    /// Height in pixels.
    Height,
    /// Number of pixels.
    Pixels,
    /// Number of Gaussians.
    Gaussians,
    /// Memory in bytes.
    Memory,
    /// Work in kernel evaluations.
    Work,
}

impl fmt::Display for LimitKind {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str(match self {
            Self::Width => "width",
            Self::Height => "height",
            Self::Pixels => "pixels",
            Self::Gaussians => "Gaussians",
            Self::Memory => "bytes of memory",
            Self::Work => "kernel evaluations",
        })
    }
}

/// A chunk that breaks a rule, but was skipped, as the picture can be shown without it (spec, section 4.3): metadata,
/// bounds of layers, or a texture.
#[derive(Clone, Debug, PartialEq, Eq)]
#[non_exhaustive]
pub struct SkippedChunk {
    /// Its type.
    pub chunk: ChunkType,
    /// Which rule it breaks.
    pub reason: Reason,
}

impl fmt::Display for SkippedChunk {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(f, "chunk {} is skipped: {}", self.chunk, self.reason)
    }
}

/// The rule that a malformed chunk breaks, as a text for people. The texts may change in any
/// release.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Reason(pub(crate) Cow<'static, str>);

impl From<&'static str> for Reason {
    fn from(text: &'static str) -> Self {
        Self(Cow::Borrowed(text))
    }
}

impl From<String> for Reason {
    fn from(text: String) -> Self {
        Self(Cow::Owned(text))
    }
}

impl fmt::Display for Reason {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str(&self.0)
    }
}

/// What a file requires that this decoder does not have, as a text for people.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Unsupported {
    what: &'static str,
    value: Option<u32>,
}

impl fmt::Display for Unsupported {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str(self.what)?;
        self.value.map_or(Ok(()), |value| write!(f, " {value}"))
    }
}
