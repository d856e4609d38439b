//! The search for the quantization step with which a file meets its target.

/// The search for the step with a log ratio of 0: a secant method that keeps a bracket.
#[derive(Clone, Copy, Debug)]
pub(crate) struct StepSearch {
    /// The step to try next, as a base-2 logarithm.
    pub(crate) at: f64,
    /// The expected derivative of the log ratio by the step.
    slope: f64,
    /// The finest step that is tried.
    pub(crate) finest: f64,
    /// The last steps with a positive log ratio, and with one that is not positive; each with its
    /// log ratio.
    bracket: [Option<(f64, f64)>; 2],
}

impl StepSearch {
    pub(crate) fn new(at: f64, slope: f64, finest: f64) -> Self {
        Self { at, slope, finest, bracket: [None; 2] }
    }

    /// Whether the log ratio with the present step asks for a finer one than the finest.
    pub(crate) fn is_exhausted(&self, log_ratio: f64) -> bool {
        self.at <= self.finest && log_ratio / self.slope > 0.0
    }

    /// Moves to the next step, given the log ratio with the present one.
    pub(crate) fn report(&mut self, log_ratio: f64) {
        let other = self.bracket[usize::from(log_ratio > 0.0)];
        self.bracket[usize::from(log_ratio <= 0.0)] = Some((self.at, log_ratio));
        self.at = match other {
            Some((other_step, other_log_ratio)) => {
                let share = (log_ratio / (log_ratio - other_log_ratio)).clamp(0.1, 0.9);
                self.at + share * (other_step - self.at)
            }
            None => self.at - (log_ratio / self.slope).clamp(-2.0, 2.0),
        };
        self.at = self.at.max(self.finest);
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_search_finds_the_step_at_any_slope() {
        for steepness in [0.05, 0.3, 0.7, 3.0] {
            for sign in [-1.0, 1.0] {
                let log_ratio =
                    |at: f64| sign * steepness * ((at + 3.7) + 0.1 * (at + 3.7).powi(3));
                let mut search = StepSearch::new(1.0, sign * 0.37, f64::NEG_INFINITY);
                for _ in 0..40 {
                    search.report(log_ratio(search.at));
                }
                assert!(log_ratio(search.at).abs() < 0.01, "{steepness} {sign}: {search:?}");
            }
        }
    }

    #[test]
    fn a_search_for_what_no_step_gives_ends_at_the_finest() {
        // A PSNR that stays out of reach: finer steps bring ever less.
        let log_ratio = |at: f64| 1.0 + at.exp2();
        let mut search = StepSearch::new(0.0, 0.36, -4.0);
        let mut reported = 0;
        while !search.is_exhausted(log_ratio(search.at)) {
            search.report(log_ratio(search.at));
            reported += 1;
        }
        assert_eq!((search.at, reported), (-4.0, 2));
        // There, what is good enough needs no finer step.
        assert!(!search.is_exhausted(-0.1));
    }
}
