//! What a decoder spends on a file at most (spec, section 10).

use crate::error::{DecodeError, LimitKind};

/// What a decoder spends on a file at most. Each limit is checked before the memory is allocated or
/// the work is done (spec, section 10).
///
/// The defaults accept every ordinary picture, and bound what a hostile file costs to a few hundred
/// megabytes and a few seconds more than an ordinary picture of its size. All fields may be changed;
/// [`Limits::none`] removes all limits.
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
    /// Most bytes that the decoder and the renderer may hold at any time; the caller's output
    /// buffer does not count. Default 512 MiB.
    pub max_memory: u64,
    /// Most kernel evaluations in one rendering beyond 64 for each pixel that is rendered, which is
    /// more than ordinary pictures take. Each Gaussian counts with an upper bound of the pixels that
    /// it covers: the rows of 8 x 8 tiles of the region that it reaches, times the most tiles of it
    /// that it can reach in one of them, times 64. Default 2^32, a few seconds on one core.
    pub max_work: u64,
}

/// Kernel evaluations for each pixel that are always allowed.
const WORK_PER_PIXEL: u64 = 64;

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
    /// No limits but those of the format. For trusted files only.
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

    /// Checks the size of a picture in pixels.
    pub(crate) fn check_size(&self, width: u32, height: u32) -> Result<(), DecodeError> {
        check(LimitKind::Width, u64::from(width), u64::from(self.max_width))?;
        check(LimitKind::Height, u64::from(height), u64::from(self.max_height))?;
        self.check_pixels(u64::from(width) * u64::from(height))
    }

    /// Checks a number of pixels.
    pub(crate) fn check_pixels(&self, pixels: u64) -> Result<(), DecodeError> {
        check(LimitKind::Pixels, pixels, self.max_pixels)
    }

    /// Checks a number of Gaussians.
    pub(crate) fn check_gaussians(&self, count: u32) -> Result<(), DecodeError> {
        check(LimitKind::Gaussians, u64::from(count), u64::from(self.max_gaussians))
    }

    /// Checks the memory that is held at one time, in bytes.
    pub(crate) fn check_memory(&self, bytes: u64) -> Result<(), DecodeError> {
        check(LimitKind::Memory, bytes, self.max_memory)
    }

    /// Checks the work of one rendering of so many pixels, in kernel evaluations.
    pub(crate) fn check_work(&self, evaluations: u64, pixels: u64) -> Result<(), DecodeError> {
        let allowed = pixels.saturating_mul(WORK_PER_PIXEL).saturating_add(self.max_work);
        check(LimitKind::Work, evaluations, allowed)
    }
}

fn check(kind: LimitKind, wanted: u64, allowed: u64) -> Result<(), DecodeError> {
    if wanted > allowed {
        return Err(DecodeError::Limit { kind, wanted, allowed });
    }
    Ok(())
}
