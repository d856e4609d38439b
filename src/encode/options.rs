//! What a caller can ask of the encoder.

use super::error::OptionError;

/// What the file shall meet.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
#[non_exhaustive]
pub enum Target {
    /// As many Gaussians as the picture needs for a sensible quality: the same as
    /// `Quality(50.0)`.
    #[default]
    Auto,
    /// At most this many Gaussians, 1 to 2^22; fewer where the picture needs fewer.
    Gaussians(u32),
    /// A file of at most this many bytes, and at least 99 % of it. Where that many bring a picture
    /// hardly anything, the file is smaller, and the report's shortfall says so.
    Bytes(u64),
    /// A file of at most this many bits per pixel, and at least 99 % of it; see [`Target::Bytes`].
    BitsPerPixel(f64),
    /// A PSNR of the decoded file at the source's depth, in dB, from 1 to 120: at least this much
    /// and at most 0.05 dB more. A PSNR that is out of reach ends with what the effort reaches, after up
    /// to one Gaussian per pixel and three times the effort's iterations; the report's shortfall says so.
    Psnr(f64),
    /// A quality from 0 to 100. Every picture gets Gaussians until each lowers the squared error
    /// by the same amount, so simple pictures get few; 10 more is about 1.6 times the Gaussians.
    Quality(f64),
}

/// By how much a PSNR may exceed its target, in dB.
pub(crate) const PSNR_TOLERANCE: f64 = 0.05;
/// The least share of a size that a file must fill.
pub(crate) const SIZE_TOLERANCE: f64 = 0.99;
/// Most Gaussians that an encoder writes: as many as a decoder accepts by default.
pub(crate) const MAX_GAUSSIANS: u32 = 1 << 22;

/// The quality of [`Target::Auto`].
const AUTO_QUALITY: f64 = 50.0;

impl Target {
    /// Says what is out of range, if anything is, and what is allowed.
    pub(crate) fn check(self) -> Result<(), OptionError> {
        let within = |name, value, least, most| {
            if (least..=most).contains(&value) {
                Ok(())
            } else {
                Err(OptionError::Target { name, value, least, most })
            }
        };
        match self {
            Self::Auto => Ok(()),
            Self::Gaussians(count) => {
                within("number of Gaussians", count.into(), 1.0, MAX_GAUSSIANS.into())
            }
            Self::Bytes(bytes) => within("size in bytes", bytes as f64, 1.0, f64::from(1 << 30)),
            Self::BitsPerPixel(rate) => within("bits per pixel", rate, 1e-6, 1e6),
            Self::Psnr(psnr) => within("PSNR in dB", psnr, 1.0, 120.0),
            Self::Quality(quality) => within("quality", quality, 0.0, 100.0),
        }
    }

    /// The most bytes that the file may have.
    pub(crate) fn bytes(self, pixels: usize) -> Option<u64> {
        match self {
            Self::Bytes(bytes) => Some(bytes),
            Self::BitsPerPixel(rate) => Some((rate * pixels as f64 / 8.0) as u64),
            _ => None,
        }
    }

    /// Whether the error decides how many Gaussians there are.
    pub(crate) fn is_by_error(self) -> bool {
        matches!(self, Self::Psnr(_)) || self.error_per_gaussian().is_some()
    }

    /// The squared error, in full samples, that every Gaussian shall account for at this quality.
    pub(crate) fn error_per_gaussian(self) -> Option<f64> {
        let quality = match self {
            Self::Auto => AUTO_QUALITY,
            Self::Quality(quality) => quality,
            _ => return None,
        };
        // In steps of 8 bits: 100,000 at quality 0, 1,000 at quality 100.
        Some(10_f64.powf(5.0 - 0.02 * quality) / (255.0 * 255.0))
    }
}

/// How attributes are stored.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash)]
#[non_exhaustive]
pub enum Precision {
    /// 32-bit floats: the fit exactly as it is.
    Float,
    /// Quantization-aware training and bit packing.
    Packed,
    /// Entropy coded, every code chosen by what it costs and what it does to the picture.
    Entropy,
}
