//! The search for the quantization step with which a file meets its target.

use crate::encode::options::Target;

// Constants: docs/tuning.md, "Search for a target".
/// The share of a target size that is aimed at.
const AIMED_SHARE_OF_SIZE: f64 = 0.997;
/// By how many dB the PSNR that is aimed at exceeds the target.
const AIMED_PSNR_EXCESS: f64 = 0.02;
/// The deviations of size that are good enough: a file that is a little too large will be shortened.
const TOLERANCE_OF_SIZE: (f64, f64) = (-0.009, 0.04);
/// The deviations of size that are left to the shortening, even if there are passes left.
const WELL_SHORTENED: (f64, f64) = (0.003, 0.014);
/// What is added to a deviation on the wrong side of the tolerance, so that every deviation on the
/// right side is preferred.
const WRONG_SIDE_PENALTY: f64 = 1e3;

/// The size, PSNR or visual quality that is aimed at, inside the tolerance of the target.
///
/// The *deviation* of a file is the base-2 logarithm of its size, of its squared error, or of
/// its error to the eye, divided by the one that is aimed at. It is positive for files that are too large
/// or too distorted.
#[derive(Clone, Copy, Debug)]
pub(crate) enum Aim {
    /// A size in bytes.
    Size { most: f64 },
    /// A PSNR of the decoded file in dB.
    Psnr(f64),
    /// A visual quality.
    Quality(f64),
}

impl Aim {
    /// The aim for a target; `None` if the target is no size, PSNR or quality.
    pub(crate) fn new(target: Target, pixels: usize) -> Option<Self> {
        if let Target::Psnr(psnr) = target {
            return Some(Self::Psnr(psnr + AIMED_PSNR_EXCESS));
        }
        if let Some(quality) = target.quality() {
            return Some(Self::Quality(quality));
        }
        target.bytes(pixels).map(|bytes| Self::Size { most: AIMED_SHARE_OF_SIZE * bytes as f64 })
    }

    /// How badly a file with this deviation misses its target: 0 if it meets the target. `weak` is the share
    /// of its Gaussians that hardly show, which a file that is too large is shortened by.
    pub(crate) fn miss(self, deviation: f64, weak: f64) -> f64 {
        let (below, above) = match self {
            Self::Size { .. } => {
                let (below, above) = TOLERANCE_OF_SIZE;
                (below, weak.clamp(WELL_SHORTENED.1, above))
            }
            Self::Psnr(_) => (-0.009, 0.006),
            // At a quality of 75, a third of a point; less at a higher one.
            Self::Quality(_) => (-0.03, 0.03),
        };
        if deviation > above {
            return WRONG_SIDE_PENALTY + deviation;
        }
        (below - deviation).max(0.0)
    }

    /// The deviation to aim at.
    pub(crate) fn middle(self) -> f64 {
        match self {
            Self::Size { .. } => 0.5 * (TOLERANCE_OF_SIZE.0 + TOLERANCE_OF_SIZE.1),
            Self::Psnr(_) | Self::Quality(_) => 0.0,
        }
    }

    /// What of a deviation is to be corrected.
    pub(crate) fn beyond(self, deviation: f64) -> f64 {
        match self {
            // Files that are shortened a little are as good as others.
            Self::Size { .. } => deviation - deviation.clamp(WELL_SHORTENED.0, WELL_SHORTENED.1),
            Self::Psnr(_) | Self::Quality(_) => deviation,
        }
    }

    /// Whether a pass with another Lagrange multiplier corrects a deviation.
    pub(crate) fn is_within_lambda(self, deviation: f64) -> bool {
        match self {
            // A pass removes Gaussians, but adds none.
            Self::Size { .. } => (-0.012..0.05).contains(&deviation),
            Self::Psnr(_) | Self::Quality(_) => (-0.1..0.03).contains(&deviation),
        }
    }

    /// By how much the deviation changes when all steps double.
    pub(crate) fn by_step(self) -> f64 {
        match self {
            Self::Size { .. } => -0.38,
            Self::Psnr(_) | Self::Quality(_) => 0.36,
        }
    }

    /// The change of the deviation with a Lagrange multiplier of 2^`lambda` times the usual one.
    pub(crate) fn change_by_lambda(self, lambda: f64) -> f64 {
        lambda * self.by_lambda(lambda > 0.0)
    }

    /// The change of the base-2 logarithm of the Lagrange multiplier that corrects a deviation.
    pub(crate) fn lambda_against(self, deviation: f64) -> f64 {
        let rises = match self {
            Self::Size { .. } => deviation > 0.0,
            Self::Psnr(_) | Self::Quality(_) => deviation < 0.0,
        };
        -deviation / self.by_lambda(rises)
    }

    /// The change of the deviation when the Lagrange multiplier doubles: from the usual one if it rises above
    /// that, and up to the usual one otherwise. Errors change less below it, because a pass removes
    /// Gaussians but adds none.
    fn by_lambda(self, rises: bool) -> f64 {
        match (self, rises) {
            (Self::Size { .. }, _) => -0.05,
            (_, true) => 0.2,
            (_, false) => 0.04,
        }
    }
}

/// The search for the step with a deviation of 0: a secant method that keeps a bracket.
#[derive(Clone, Copy, Debug)]
pub(crate) struct StepSearch {
    /// The step to try next, as a base-2 logarithm.
    pub(crate) at: f64,
    /// The expected derivative of the deviation by the step.
    slope: f64,
    /// The finest step that is tried.
    finest: f64,
    /// The last steps with a positive deviation, and with one that is not positive; each with its
    /// deviation.
    bracket: [Option<(f64, f64)>; 2],
}

impl StepSearch {
    pub(crate) fn new(at: f64, slope: f64, finest: f64) -> Self {
        Self { at, slope, finest, bracket: [None; 2] }
    }

    /// Whether the deviation with the present step asks for a finer one than the finest.
    pub(crate) fn is_exhausted(&self, deviation: f64) -> bool {
        self.at <= self.finest && deviation / self.slope > 0.0
    }

    /// The finest step that is tried.
    pub(crate) fn finest(&self) -> f64 {
        self.finest
    }

    /// Moves to the next step, given the deviation with the present one.
    pub(crate) fn tell(&mut self, deviation: f64) {
        let other = self.bracket[usize::from(deviation > 0.0)];
        self.bracket[usize::from(deviation <= 0.0)] = Some((self.at, deviation));
        self.at = match other {
            Some((other_step, other_deviation)) => {
                let share = (deviation / (deviation - other_deviation)).clamp(0.1, 0.9);
                self.at + share * (other_step - self.at)
            }
            None => self.at - (deviation / self.slope).clamp(-2.0, 2.0),
        };
        self.at = self.at.max(self.finest);
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::encode::options::{PSNR_TOLERANCE, SIZE_TOLERANCE};

    #[test]
    fn a_file_that_misses_by_0_meets_its_target() {
        let size = Aim::new(Target::Bytes(5000), 100).expect("a target");
        let psnr = Aim::new(Target::Psnr(30.0), 100).expect("a target");
        assert!(Aim::new(Target::Gaussians(5), 100).is_none());
        for deviation in (-60..60).map(|step| f64::from(step) * 1e-3) {
            let bytes = AIMED_SHARE_OF_SIZE * 5000.0 * deviation.exp2();
            // A file that is a little too large is shortened.
            if size.miss(deviation, 0.1) == 0.0 {
                assert!((SIZE_TOLERANCE * 5000.0..1.03 * 5000.0).contains(&bytes), "{bytes}");
            }
            let reached = 30.0 + AIMED_PSNR_EXCESS - deviation * 10.0 * 2_f64.log10();
            if psnr.miss(deviation, 0.0) == 0.0 {
                assert!((30.0..30.0 + PSNR_TOLERANCE).contains(&reached), "{reached}");
            }
        }
        // What shows is not removed.
        assert!(size.miss(0.03, 0.01) > 0.0);
        for aim in [size, psnr] {
            assert_eq!(aim.miss(0.0, 0.0), 0.0);
            assert!(aim.miss(-1.0, 0.0) > aim.miss(-0.5, 0.0));
            assert!(aim.miss(0.5, 0.0) > aim.miss(-5.0, 0.0));
        }
    }

    #[test]
    fn a_search_finds_the_step_at_any_slope() {
        for steepness in [0.05, 0.3, 0.7, 3.0] {
            for sign in [-1.0, 1.0] {
                let deviation =
                    |at: f64| sign * steepness * ((at + 3.7) + 0.1 * (at + 3.7).powi(3));
                let mut search = StepSearch::new(1.0, sign * 0.37, f64::NEG_INFINITY);
                for _ in 0..40 {
                    search.tell(deviation(search.at));
                }
                assert!(deviation(search.at).abs() < 0.01, "{steepness} {sign}: {search:?}");
            }
        }
    }

    #[test]
    fn a_search_for_what_no_step_gives_ends_at_the_finest() {
        // A PSNR that stays out of reach: finer steps bring ever less.
        let deviation = |at: f64| 1.0 + at.exp2();
        let mut search = StepSearch::new(0.0, 0.36, -4.0);
        let mut told = 0;
        while !search.is_exhausted(deviation(search.at)) {
            search.tell(deviation(search.at));
            told += 1;
        }
        assert_eq!((search.at, told), (-4.0, 2));
        // There, what is good enough needs no finer step.
        assert!(!search.is_exhausted(-0.1));
    }
}
