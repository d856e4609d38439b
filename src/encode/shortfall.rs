//! Why a file does not meet its target.

use core::fmt;

use super::aim::{FileAim, PSNR_TOLERANCE, QUALITY_TOLERANCE, SIZE_TOLERANCE};
use super::quality::{MOST_QUALITY, Verdict};

/// Why a file does not meet its target within 1 % of size, 0.05 dB, or 1 of quality. The text says it
/// in words.
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
    /// The visual quality is below its target: this is what the effort and the precision reach.
    QualityBelow {
        /// Estimated quality of the file.
        quality: f64,
    },
    /// The visual quality is about the highest that is aimed at, but below its target.
    QualityCapped {
        /// Estimated quality of the file.
        quality: f64,
    },
    /// The visual quality is above its target even with these few Gaussians.
    QualityAbove {
        /// Estimated quality of the file.
        quality: f64,
        /// Gaussians in the file.
        gaussians: u32,
    },
    /// The file has no Gaussian, and is larger than its target all the same.
    SizeAbove {
        /// Bytes of the file.
        bytes: usize,
        /// Bytes of the metadata in it.
        metadata: usize,
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
    /// The file is smaller than its target, and the picture could be better, but this effort finds no use
    /// for more bytes.
    SizeUnused {
        /// Bytes of the file.
        bytes: usize,
        /// Gaussians in the file.
        gaussians: u32,
    },
}

// Constants: docs/tuning.md, "Not measured".
/// Bytes that one more Gaussian may need.
const BYTES_OF_GAUSSIAN: f64 = 24.0;

/// What a file has reached.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Reached {
    pub(crate) bytes: usize,
    /// Bytes of the metadata among them.
    pub(crate) metadata: usize,
    /// In dB.
    pub(crate) psnr: f64,
    /// The PSNR in dB of a picture of which nothing but the rounding to samples is left.
    pub(crate) exact_psnr: f64,
    /// From 0 to 100.
    pub(crate) quality: f64,
    /// All that a quality asks for.
    pub(crate) verdict: Verdict,
    pub(crate) gaussians: u32,
}

impl Shortfall {
    /// That of a file; `None` if it meets its target.
    pub(crate) fn of(aim: FileAim, reached: Reached) -> Option<Self> {
        let Reached { bytes, metadata, psnr, exact_psnr, quality, verdict, gaussians } = reached;
        match aim {
            FileAim::Psnr(target) if psnr < target => Some(Self::PsnrBelow { psnr }),
            FileAim::Psnr(target) => {
                (psnr > target + PSNR_TOLERANCE).then_some(Self::PsnrAbove { psnr, gaussians })
            }
            FileAim::Quality(target) => {
                let aimed = target.min(MOST_QUALITY);
                if quality < aimed - QUALITY_TOLERANCE {
                    return Some(Self::QualityBelow { quality });
                }
                if quality < target - QUALITY_TOLERANCE {
                    return Some(Self::QualityCapped { quality });
                }
                // What keeps gradients clean and small pictures sound is no surplus.
                let most = target + QUALITY_TOLERANCE;
                let is_above = quality > most && verdict.excess(most) < 1.0;
                is_above.then_some(Self::QualityAbove { quality, gaussians })
            }
            FileAim::Size(most) => {
                let most = most as f64;
                let missing = most - bytes as f64;
                if missing < 0.0 {
                    return Some(Self::SizeAbove { bytes, metadata });
                }
                if missing <= (1.0 - SIZE_TOLERANCE) * most {
                    return None;
                }
                let is_needless = psnr >= exact_psnr || missing < BYTES_OF_GAUSSIAN;
                Some(if is_needless {
                    Self::SizeBelow { bytes, gaussians }
                } else {
                    Self::SizeUnused { bytes, gaussians }
                })
            }
        }
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
            Self::QualityBelow { quality } => {
                write!(f, "quality {quality:.1} is what this effort and precision reach")
            }
            Self::QualityCapped { quality } => {
                write!(f, "quality {quality:.1}: more than {MOST_QUALITY} is not aimed at")
            }
            Self::QualityAbove { quality, gaussians } => {
                write!(f, "with {gaussians} Gaussians the picture already has quality {quality:.1}")
            }
            Self::SizeAbove { bytes, metadata } => {
                write!(f, "{bytes} bytes are the least that this picture takes")?;
                if *metadata > 0 {
                    write!(f, ", of which {metadata} are metadata")?;
                }
                Ok(())
            }
            Self::SizeUseless { bytes, gaussians } => write!(
                f,
                "more than {gaussians} Gaussians, {bytes} bytes, do not improve the picture at this effort"
            ),
            Self::SizeBelow { bytes, gaussians } => write!(
                f,
                "{gaussians} Gaussians, {bytes} bytes, are what the picture needs or the size holds"
            ),
            Self::SizeUnused { bytes, gaussians } => write!(
                f,
                "{gaussians} Gaussians, {bytes} bytes, are all that this effort finds use for"
            ),
        }
    }
}
