//! What an encoding aims at: its target, resolved for the picture.

use super::error::OptionError;
use super::loss::Distortion;
use super::options::Target;
use super::rate_model;
use crate::gaussian::MAX_GAUSSIANS;

/// By how much a PSNR may exceed its target, in dB.
pub(crate) const PSNR_TOLERANCE: f64 = 0.05;
/// The share of a target size that a file must reach.
pub(crate) const SIZE_TOLERANCE: f64 = 0.99;
/// By how much a quality may miss its target.
pub(crate) const QUALITY_TOLERANCE: f64 = 1.0;

// Constants: docs/tuning.md, "Not measured" and "Search for a target".
/// The quality of [`Target::Auto`].
const AUTO_QUALITY: f64 = 75.0;
/// The share of a target size that a search aims at.
const AIMED_SHARE_OF_SIZE: f64 = 0.997;
/// By how many dB the PSNR that a search aims at exceeds the target.
const AIMED_PSNR_EXCESS: f64 = 0.02;
/// The log ratios of size that are good enough: a file that is a little too large will be shortened.
const TOLERANCE_OF_SIZE: (f64, f64) = (-0.009, 0.04);
/// The log ratios of size that are left to the shortening, even if there are passes left.
const WELL_SHORTENED: (f64, f64) = (0.003, 0.02);
/// What is added to a log ratio on the wrong side of the tolerance, so that every log ratio on the
/// right side is preferred.
const WRONG_SIDE_PENALTY: f64 = 1e3;

/// What the stages of an encoding steer by.
#[derive(Clone, Copy, Debug)]
pub(crate) enum Aim {
    /// At most this many Gaussians.
    Count(u32),
    /// A Lagrange multiplier, where samples are 0 to 255.
    Lambda(f64),
    /// A property of the file, for which a search compares files.
    File(FileAim),
}

/// The size, PSNR or visual quality that a file is to have.
///
/// The *log ratio* of a file is the base-2 logarithm of its size, of its squared error, or of
/// its error to the eye, divided by the one that is aimed at. It is positive for files that are too large
/// or too distorted.
#[derive(Clone, Copy, Debug)]
pub(crate) enum FileAim {
    /// At most this many bytes.
    Size(u64),
    /// A PSNR of the decoded file in dB.
    Psnr(f64),
    /// A visual quality.
    Quality(f64),
}

impl Aim {
    /// The aim for a target and a picture with so many pixels.
    ///
    /// # Errors
    /// [`OptionError::Target`] when the target's number is out of range.
    pub(crate) fn new(target: Target, pixels: usize) -> Result<Self, OptionError> {
        let within = |name, value, least, most| {
            if (least..=most).contains(&value) {
                Ok(value)
            } else {
                Err(OptionError::Target { name, value, least, most })
            }
        };
        let aim = match target {
            Target::Gaussians(count) => {
                within("number of Gaussians", count.into(), 1.0, MAX_GAUSSIANS.into())?;
                return Ok(Self::Count(count));
            }
            Target::Lambda(lambda) => {
                return Ok(Self::Lambda(within("lambda", lambda, 0.01, 1e6)?));
            }
            Target::Bytes(bytes) => {
                within("size in bytes", bytes as f64, 1.0, f64::from(1 << 30))?;
                FileAim::Size(bytes)
            }
            Target::BitsPerPixel(rate) => {
                let rate = within("bits per pixel", rate, 1e-6, 1e6)?;
                FileAim::Size((rate * pixels as f64 / 8.0) as u64)
            }
            Target::Psnr(psnr) => FileAim::Psnr(within("PSNR in dB", psnr, 1.0, 120.0)?),
            Target::Quality(quality) => FileAim::Quality(within("quality", quality, 0.0, 100.0)?),
            Target::Auto => FileAim::Quality(AUTO_QUALITY),
        };
        Ok(Self::File(aim))
    }

    /// The base-2 logarithm of the colour step, about, of a file of so many Gaussians whose fit has this distortion.
    pub(crate) fn step(self, distortion: Distortion, count: usize) -> f64 {
        match self {
            Self::Lambda(lambda) => rate_model::step_for_lambda(lambda),
            Self::Count(_) | Self::File(_) => rate_model::step_for(distortion, count),
        }
    }

    /// What is asked of the file, if anything.
    pub(crate) fn of_file(self) -> Option<FileAim> {
        if let Self::File(aim) = self { Some(aim) } else { None }
    }

    /// Whether the error decides, and leaves the number of Gaussians open.
    pub(crate) fn is_by_error(self) -> bool {
        !matches!(self, Self::Count(_) | Self::File(FileAim::Size(_)))
    }
}

impl FileAim {
    /// The bytes, dB or quality that a search aims at, inside the tolerance.
    pub(crate) fn wanted(self) -> f64 {
        match self {
            Self::Size(bytes) => AIMED_SHARE_OF_SIZE * bytes as f64,
            Self::Psnr(psnr) => psnr + AIMED_PSNR_EXCESS,
            Self::Quality(quality) => quality,
        }
    }

    /// How badly a file with this log ratio misses its target: 0 if it meets the target. `weak` is the share
    /// of its Gaussians that hardly show, which a file that is too large is shortened by.
    pub(crate) fn violation(self, log_ratio: f64, weak: f64) -> f64 {
        let (below, above) = match self {
            Self::Size(_) => {
                let (below, above) = TOLERANCE_OF_SIZE;
                (below, weak.clamp(WELL_SHORTENED.1, above))
            }
            Self::Psnr(_) => (-0.009, 0.006),
            // At a quality of 75, a third of a point; less at a higher one.
            Self::Quality(_) => (-0.03, 0.03),
        };
        if log_ratio > above {
            return WRONG_SIDE_PENALTY + log_ratio;
        }
        (below - log_ratio).max(0.0)
    }

    /// The log ratio to aim at.
    pub(crate) fn middle(self) -> f64 {
        match self {
            Self::Size(_) => 0.5 * (TOLERANCE_OF_SIZE.0 + TOLERANCE_OF_SIZE.1),
            Self::Psnr(_) | Self::Quality(_) => 0.0,
        }
    }

    /// What of a log ratio is to be corrected.
    pub(crate) fn beyond(self, log_ratio: f64) -> f64 {
        match self {
            // Files that are shortened a little are as good as others.
            Self::Size(_) => log_ratio - log_ratio.clamp(WELL_SHORTENED.0, WELL_SHORTENED.1),
            Self::Psnr(_) | Self::Quality(_) => log_ratio,
        }
    }

    /// Whether a pass with another Lagrange multiplier corrects a log ratio.
    pub(crate) fn is_within_lambda(self, log_ratio: f64) -> bool {
        match self {
            // A pass removes Gaussians, but adds none.
            Self::Size(_) => (-0.012..0.05).contains(&log_ratio),
            Self::Psnr(_) | Self::Quality(_) => (-0.1..0.03).contains(&log_ratio),
        }
    }

    /// By how much the log ratio changes when all steps double.
    pub(crate) fn by_step(self) -> f64 {
        match self {
            Self::Size(_) => -0.38,
            Self::Psnr(_) | Self::Quality(_) => 0.36,
        }
    }

    /// The change of the log ratio with a Lagrange multiplier of 2^`lambda` times the usual one.
    pub(crate) fn change_by_lambda(self, lambda: f64) -> f64 {
        lambda * self.by_lambda(lambda > 0.0)
    }

    /// The change of the base-2 logarithm of the Lagrange multiplier that corrects a log ratio.
    pub(crate) fn lambda_against(self, log_ratio: f64) -> f64 {
        let rises = match self {
            Self::Size(_) => log_ratio > 0.0,
            Self::Psnr(_) | Self::Quality(_) => log_ratio < 0.0,
        };
        -log_ratio / self.by_lambda(rises)
    }

    /// The change of the log ratio when the Lagrange multiplier doubles: from the usual one if it rises above
    /// that, and up to the usual one otherwise. Errors change less below it, because a pass removes
    /// Gaussians but adds none.
    fn by_lambda(self, rises: bool) -> f64 {
        match (self, rises) {
            (Self::Size(_), _) => -0.05,
            (_, true) => 0.2,
            (_, false) => 0.04,
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_file_that_misses_by_0_meets_its_target() {
        let (size, psnr) = (FileAim::Size(5000), FileAim::Psnr(30.0));
        for log_ratio in (-60..60).map(|step| f64::from(step) * 1e-3) {
            let bytes = size.wanted() * log_ratio.exp2();
            // A file that is a little too large is shortened.
            if size.violation(log_ratio, 0.1) == 0.0 {
                assert!((SIZE_TOLERANCE * 5000.0..1.03 * 5000.0).contains(&bytes), "{bytes}");
            }
            let reached = psnr.wanted() - log_ratio * 10.0 * 2_f64.log10();
            if psnr.violation(log_ratio, 0.0) == 0.0 {
                assert!((30.0..30.0 + PSNR_TOLERANCE).contains(&reached), "{reached}");
            }
        }
        // What shows is not removed.
        assert!(size.violation(0.03, 0.01) > 0.0);
        for aim in [size, psnr] {
            assert_eq!(aim.violation(0.0, 0.0), 0.0);
            assert!(aim.violation(-1.0, 0.0) > aim.violation(-0.5, 0.0));
            assert!(aim.violation(0.5, 0.0) > aim.violation(-5.0, 0.0));
        }
    }
}
