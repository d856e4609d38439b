//! Errors of a rendering, in units that are not to be mixed up.

use core::ops::Add;

/// A sum of squared errors over samples that are clamped as in the output, where a full sample is 1.
#[derive(Clone, Copy, Debug, Default, PartialEq, PartialOrd)]
pub(crate) struct SquaredError(pub(crate) f64);

impl SquaredError {
    /// That of so many samples at a PSNR in dB.
    pub(crate) fn at_psnr(psnr: f64, samples: usize) -> Self {
        Self(samples as f64 * 10_f64.powf(-psnr / 10.0))
    }

    /// The PSNR of so many samples in dB.
    pub(crate) fn psnr(self, samples: usize) -> f64 {
        10.0 * (samples as f64 / self.0).log10()
    }
}

/// A sum of squared errors, in which the perceptual weights count if the encoder is tuned for the eye.
#[derive(Clone, Copy, Debug, Default, PartialEq, PartialOrd)]
pub(crate) struct Distortion(pub(crate) f64);

/// The error of a rendering.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub(crate) struct RenderingError {
    pub(crate) squared: SquaredError,
    /// What is minimized.
    pub(crate) distortion: Distortion,
}

impl Add for RenderingError {
    type Output = Self;

    fn add(self, other: Self) -> Self {
        Self {
            squared: SquaredError(self.squared.0 + other.squared.0),
            distortion: Distortion(self.distortion.0 + other.distortion.0),
        }
    }
}
