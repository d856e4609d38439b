//! Why a file does not meet its target.

use core::fmt;

use super::options::{PSNR_TOLERANCE, SIZE_TOLERANCE, Target};

/// Why a file does not meet its target within 1 % of size or 0.05 dB. The text says it in words.
#[derive(Clone, Copy, Debug, PartialEq)]
#[non_exhaustive]
pub enum Shortfall {
    /// The PSNR is below its target: this is what the effort and the precision reach.
    PsnrBelow {
        /// PSNR of the file in dB.
        psnr: f64,
    },
    /// The PSNR is above its target even with these few Gaussians.
    PsnrAbove {
        /// PSNR of the file in dB.
        psnr: f64,
        /// Gaussians in the file.
        gaussians: u32,
    },
    /// A file of the target's size shows no better picture at this effort than this smaller one.
    SizeUseless {
        /// Bytes of the file.
        bytes: usize,
        /// Gaussians in the file.
        gaussians: u32,
    },
    /// The file is smaller than its target: the picture needs no more, or the next Gaussian would not
    /// fit.
    SizeBelow {
        /// Bytes of the file.
        bytes: usize,
        /// Gaussians in the file.
        gaussians: u32,
    },
}

impl Shortfall {
    /// That of a file with so many bytes, Gaussians and decibels; `None` if it meets its target.
    pub(crate) fn of(
        target: Target,
        pixels: usize,
        bytes: usize,
        psnr: f64,
        gaussians: u32,
    ) -> Option<Self> {
        if let Target::Psnr(target) = target {
            return if psnr < target {
                Some(Self::PsnrBelow { psnr })
            } else {
                (psnr > target + PSNR_TOLERANCE).then_some(Self::PsnrAbove { psnr, gaussians })
            };
        }
        let least = target.bytes(pixels)? as f64 * SIZE_TOLERANCE;
        ((bytes as f64) < least).then_some(Self::SizeBelow { bytes, gaussians })
    }
}

impl fmt::Display for Shortfall {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Self::PsnrBelow { psnr } => {
                write!(f, "{psnr:.2} dB is what this effort and precision reach")
            }
            Self::PsnrAbove { psnr, gaussians } => {
                write!(f, "with {gaussians} Gaussians the picture already has {psnr:.2} dB")
            }
            Self::SizeUseless { bytes, gaussians } => write!(
                f,
                "more than {gaussians} Gaussians, {bytes} bytes, do not improve the picture at this effort"
            ),
            Self::SizeBelow { bytes, gaussians } => write!(
                f,
                "{gaussians} Gaussians, {bytes} bytes, are what the picture needs or the size holds"
            ),
        }
    }
}
