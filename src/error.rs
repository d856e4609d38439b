//! What can go wrong while decoding, and where (spec, section 1).

use alloc::borrow::Cow;
use alloc::format;
use alloc::string::String;
use core::fmt;

use thiserror::Error;

use crate::chunk::ChunkType;
use crate::color::ColorModel;
use crate::region::Region;

/// Largest width and height of an output. Up to here every pixel centre is exact in `f32`.
pub(crate) const MAX_OUTPUT_SIDE: u32 = 1 << 23;

/// Why a file was not decoded, or not to its end.
///
/// Whatever was decoded before the error stays available from the decoder.
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
    /// The file is sound as far as it can be read, but asks for something that this decoder does
    /// not know: a later version, another coding, an unknown critical chunk.
    #[error("chunk {chunk}: unsupported: {what}")]
    Unsupported {
        /// The chunk that asks for it.
        chunk: ChunkType,
        /// What it asks for.
        what: Unsupported,
    },
    /// The file ends too early. The Gaussians that had arrived are available.
    #[error("unexpected end of the file in {}", match .chunk {
        Some(chunk) => format!("chunk {chunk}"),
        None => String::from("the signature or between two chunks"),
    })]
    UnexpectedEnd {
        /// The chunk that is incomplete; `None` between two chunks and in the signature.
        chunk: Option<ChunkType>,
    },
    /// A bound of [`Limits`](crate::Limits) would be exceeded.
    #[error("limit exceeded: {kind}: {wanted} wanted, {allowed} allowed")]
    Limit {
        /// Which bound.
        kind: LimitKind,
        /// What the file or the request asks for.
        wanted: u64,
        /// What the limits allow.
        allowed: u64,
    },
    /// The caller asked for something that cannot be done.
    #[error("invalid request: {0}")]
    Request(#[from] RequestError),
    /// An earlier call failed, and the decoder cannot go on from there.
    #[error("decoding already failed")]
    AlreadyFailed,
    /// The reader failed.
    #[cfg(feature = "std")]
    #[error("reading failed: {0}")]
    Io(#[from] std::io::Error),
}

impl DecodeError {
    /// A broken rule in `chunk`.
    pub(crate) fn malformed(chunk: ChunkType, reason: impl Into<Reason>) -> Self {
        Self::Malformed { chunk, reason: reason.into() }
    }

    /// Something that `chunk` asks for and this decoder does not have.
    pub(crate) fn unsupported(chunk: ChunkType, what: &'static str, value: u32) -> Self {
        Self::Unsupported { chunk, what: Unsupported { what, value: Some(value) } }
    }

    /// A critical chunk of an unknown type.
    pub(crate) fn unknown_critical(chunk: ChunkType) -> Self {
        let what = Unsupported { what: "critical chunk of an unknown type", value: None };
        Self::Unsupported { chunk, what }
    }

    /// Whether more bytes of the same file would have helped.
    #[must_use]
    pub fn is_unexpected_end(&self) -> bool {
        matches!(self, Self::UnexpectedEnd { .. })
    }
}

/// What a caller asked for that cannot be done.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Error)]
#[non_exhaustive]
pub enum RequestError {
    /// The output buffer has the wrong length.
    #[error("the output buffer holds {found} samples, {wanted} are needed")]
    BufferLength {
        /// Samples that the buffer holds.
        found: usize,
        /// Samples that the output has.
        wanted: usize,
    },
    /// The size of the whole output is out of range: each side is 1 to 2^23 pixels.
    #[error("an output of {width}x{height} pixels; each side must be 1 to {MAX_OUTPUT_SIDE}")]
    OutputSize {
        /// Width in pixels.
        width: u32,
        /// Height in pixels.
        height: u32,
    },
    /// The region is empty or reaches beyond the output.
    #[error(
        "the region {}x{} at ({}, {}) is empty or not inside the {width}x{height} output",
        region.width, region.height, region.x, region.y
    )]
    Region {
        /// The region.
        region: Region,
        /// Width of the whole output in pixels.
        width: u32,
        /// Height of the whole output in pixels.
        height: u32,
    },
    /// The colour model lacks a channel of the stored one.
    #[error("{from:?} cannot be written as {to:?}")]
    ColorModel {
        /// The colour model of the file.
        from: ColorModel,
        /// The one asked for.
        to: ColorModel,
    },
}

/// Which bound of [`Limits`](crate::Limits) was exceeded.
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
    /// Bytes of memory.
    Memory,
    /// Kernel evaluations.
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

/// The rule that a malformed chunk breaks, in words. New rules are not breaking changes.
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

/// What a file asks for that this decoder does not know.
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
