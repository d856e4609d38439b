//! Every bound that a decoder applies to a file it does not trust (spec, section 10).

use crate::error::{DecodeError, LimitKind};

/// Bounds that are checked before anything is allocated or computed.
///
/// The defaults accept every ordinary picture and keep a hostile file to a few seconds and a few
/// hundred megabytes. All fields may be changed; `Limits::none()` lifts them all.
#[derive(Clone, Debug, PartialEq, Eq)]
#[non_exhaustive]
pub struct Limits {
    /// Largest width in pixels, of the file and of what is rendered. Default 65,536.
    pub max_width: u32,
    /// Largest height in pixels, of the file and of what is rendered. Default 65,536.
    pub max_height: u32,
    /// Most pixels, of the file and of what is rendered. Default 2^28.
    pub max_pixels: u64,
    /// Most Gaussians. Default 2^22.
    pub max_gaussians: u32,
    /// Most bytes that decoder and renderer may hold at a time, the caller's own output buffer
    /// not counted. Default 512 MiB.
    pub max_memory: u64,
    /// Most kernel evaluations in one rendering: the sum over the Gaussians of the pixels that
    /// each covers at most, in whole tiles of 8x8 and as if it were as wide everywhere as at its
    /// widest. Default 2^32, a few seconds on one core.
    pub max_work: u64,
}

impl Default for Limits {
    fn default() -> Self {
        Self {
            max_width: 1 << 16,
            max_height: 1 << 16,
            max_pixels: 1 << 28,
            max_gaussians: 1 << 22,
            max_memory: 512 << 20,
            max_work: 1 << 32,
        }
    }
}

impl Limits {
    /// No bounds but those of the format itself. For trusted files only.
    #[must_use]
    pub const fn none() -> Self {
        Self {
            max_width: u32::MAX,
            max_height: u32::MAX,
            max_pixels: u64::MAX,
            max_gaussians: u32::MAX,
            max_memory: u64::MAX,
            max_work: u64::MAX,
        }
    }

    /// Checks the size of a picture, in pixels.
    pub(crate) fn check_size(&self, width: u32, height: u32) -> Result<(), DecodeError> {
        check(LimitKind::Width, u64::from(width), u64::from(self.max_width))?;
        check(LimitKind::Height, u64::from(height), u64::from(self.max_height))?;
        check(LimitKind::Pixels, u64::from(width) * u64::from(height), self.max_pixels)
    }

    /// Checks a number of Gaussians.
    pub(crate) fn check_gaussians(&self, count: u32) -> Result<(), DecodeError> {
        check(LimitKind::Gaussians, u64::from(count), u64::from(self.max_gaussians))
    }

    /// Checks bytes held at a time.
    pub(crate) fn check_memory(&self, bytes: u64) -> Result<(), DecodeError> {
        check(LimitKind::Memory, bytes, self.max_memory)
    }

    /// Checks kernel evaluations.
    pub(crate) fn check_work(&self, evaluations: u64) -> Result<(), DecodeError> {
        check(LimitKind::Work, evaluations, self.max_work)
    }
}

fn check(kind: LimitKind, wanted: u64, allowed: u64) -> Result<(), DecodeError> {
    if wanted > allowed {
        return Err(DecodeError::Limit { kind, wanted, allowed });
    }
    Ok(())
}
