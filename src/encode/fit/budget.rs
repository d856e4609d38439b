//! The budget: how many Gaussians a picture gets.

/// What sets the number of Gaussians, where a full sample is 1.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) enum Budget {
    /// This many Gaussians.
    Count(usize),
    /// As many Gaussians as bring the sum of squared errors down to this.
    SquaredError(f64),
    /// As many Gaussians as leave this distortion per Gaussian. The slope of the distortion over the
    /// number of Gaussians is then the same for every picture, so simple pictures get few.
    DistortionPerGaussian(f64),
}

/// The error is about proportional to the number of Gaussians to the power of -`POWER` (Kodak,
/// 1,000 to 10,000 Gaussians).
const POWER: f64 = 1.1;

impl Budget {
    /// The number of Gaussians that is expected to meet the budget, extrapolated from `count`
    /// Gaussians with an error of `error`, which is what the budget sets; at most `most`.
    pub(crate) fn wanted(self, count: usize, error: f64, most: usize) -> usize {
        let ratio = match self {
            Self::Count(wanted) => return wanted.min(most),
            Self::SquaredError(target) => (error / target).powf(1.0 / POWER),
            Self::DistortionPerGaussian(target) => {
                (error / count.max(1) as f64 / target).powf(1.0 / (POWER + 1.0))
            }
        };
        // The cast of a float saturates, and that of NaN gives 0. A target of 0 gives `most`.
        let wanted = (count.max(1) as f64 * ratio).ceil() as usize;
        wanted.min(most)
    }
}
