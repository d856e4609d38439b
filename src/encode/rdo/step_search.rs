//! How a file is steered to its target.

use crate::encode::options::Target;

/// What is aimed at: this share of a size, and beyond a PSNR, in dB.
const SIZE_AIMED: f64 = 0.997;
const PSNR_AIMED: f64 = 0.02;
/// How much worse it is to miss a target on the wrong side.
const WRONG: f64 = 1e3;

/// What the codes are steered to. How far they are from it is a logarithm to base 2.
#[derive(Clone, Copy, Debug)]
pub(crate) enum Aim {
    /// Most bytes of the file.
    Size { most: f64 },
    /// PSNR of the decoded file in dB.
    Psnr(f64),
}

impl Aim {
    /// Aims within what is allowed, for there is some play.
    pub(crate) fn new(target: Target, pixels: usize) -> Option<Self> {
        if let Target::Psnr(psnr) = target {
            return Some(Self::Psnr(psnr + PSNR_AIMED));
        }
        target.bytes(pixels).map(|bytes| Self::Size { most: SIZE_AIMED * bytes as f64 })
    }

    /// By how much something is off that misses its target, and 0 for what meets it.
    pub(crate) fn miss(self, off: f64) -> f64 {
        let (below, above) = match self {
            // What is a little too long will be shortened.
            Self::Size { .. } => (-0.009, 0.011),
            Self::Psnr(_) => (-0.009, 0.006),
        };
        if off > above {
            // What is on the wrong side counts for more than anything on the right one.
            return WRONG + off;
        }
        (below - off).max(0.0)
    }

    /// By how much `off` changes when all steps double.
    pub(crate) fn by_step(self) -> f64 {
        match self {
            Self::Size { .. } => -0.38,
            Self::Psnr(_) => 0.36,
        }
    }

    /// By how much `off` changes when what a bit is worth doubles.
    pub(crate) fn by_lambda(self) -> f64 {
        match self {
            Self::Size { .. } => -0.04,
            Self::Psnr(_) => 0.08,
        }
    }
}

/// The search for the step with which nothing is off, by secants within brackets.
#[derive(Clone, Copy, Debug)]
pub(crate) struct StepSearch {
    /// The step to try next, as a logarithm to base 2.
    pub(crate) at: f64,
    /// By how much what is off changes with the step.
    slope: f64,
    /// The finest step that is tried.
    finest: f64,
    /// The nearest steps with which too much, and too little, is off, and by how much.
    bracket: [Option<(f64, f64)>; 2],
}

impl StepSearch {
    pub(crate) fn new(at: f64, slope: f64, finest: f64) -> Self {
        Self { at, slope, finest, bracket: [None; 2] }
    }

    /// Whether a finer step is needed than the finest, if so much is off with the present one.
    pub(crate) fn is_exhausted(&self, off: f64) -> bool {
        self.at <= self.finest && off / self.slope > 0.0
    }

    /// Goes on from how much is off with the present step.
    pub(crate) fn tell(&mut self, off: f64) {
        let told = (self.at, off);
        let other = self.bracket[usize::from(off > 0.0)];
        self.bracket[usize::from(off <= 0.0)] = Some(told);
        self.at = match other {
            Some((at, there)) => {
                let share = (off / (off - there)).clamp(0.1, 0.9);
                self.at + share * (at - self.at)
            }
            None => self.at - (off / self.slope).clamp(-2.0, 2.0),
        };
        self.at = self.at.max(self.finest);
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::encode::options::{PSNR_TOLERANCE, SIZE_TOLERANCE};

    #[test]
    fn what_is_aimed_at_meets_the_target() {
        let size = Aim::new(Target::Bytes(5000), 100).expect("a target");
        let psnr = Aim::new(Target::Psnr(30.0), 100).expect("a target");
        assert!(Aim::new(Target::Gaussians(5), 100).is_none());
        for off in (-40..40).map(|step| f64::from(step) * 1e-3) {
            let bytes = SIZE_AIMED * 5000.0 * off.exp2();
            // A little too long is shortened.
            if size.miss(off) == 0.0 {
                assert!((SIZE_TOLERANCE * 5000.0..5025.0).contains(&bytes), "{bytes}");
            }
            let reached = 30.0 + PSNR_AIMED - off * 10.0 * 2_f64.log10();
            if psnr.miss(off) == 0.0 {
                assert!((30.0..30.0 + PSNR_TOLERANCE).contains(&reached), "{reached}");
            }
        }
        for aim in [size, psnr] {
            assert_eq!(aim.miss(0.0), 0.0);
            assert!(aim.miss(-1.0) > aim.miss(-0.5) && aim.miss(0.5) > aim.miss(-5.0));
        }
    }

    #[test]
    fn a_search_finds_steps_however_steep() {
        for steepness in [0.05, 0.3, 0.7, 3.0] {
            for sign in [-1.0, 1.0] {
                let off = |at: f64| sign * steepness * ((at + 3.7) + 0.1 * (at + 3.7).powi(3));
                let mut search = StepSearch::new(1.0, sign * 0.37, f64::NEG_INFINITY);
                for _ in 0..40 {
                    search.tell(off(search.at));
                }
                assert!(off(search.at).abs() < 0.01, "{steepness} {sign}: {search:?}");
            }
        }
    }

    #[test]
    fn a_search_for_what_no_step_gives_ends_at_the_finest() {
        // A PSNR that stays out of reach: finer steps bring ever less.
        let off = |at: f64| 1.0 + at.exp2();
        let mut search = StepSearch::new(0.0, 0.36, -4.0);
        let mut told = 0;
        while !search.is_exhausted(off(search.at)) {
            search.tell(off(search.at));
            told += 1;
        }
        assert_eq!((search.at, told), (-4.0, 2));
        // There, what is good enough needs no finer step.
        assert!(!search.is_exhausted(-0.1));
    }
}
