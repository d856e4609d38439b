//! The budget: how many Gaussians a picture gets.

use crate::encode::loss::{Distortion, RenderingError, SquaredError};
use crate::encode::options::Tune;
use crate::encode::rate_model;

/// What sets the number of Gaussians, where a full sample is 1.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) enum Budget {
    /// This many Gaussians.
    Count(usize),
    /// As many Gaussians as take this many bits.
    Bits { bits: f64, tune: Tune },
    /// As many Gaussians as bring the sum of squared errors down to this.
    SquaredError(SquaredError),
    /// As many Gaussians as leave this distortion per Gaussian. The slope of the distortion over the
    /// number of Gaussians is then the same for every picture, so simple pictures get few.
    DistortionPerGaussian(Distortion),
}

// Constants: docs/tuning.md, "Growth".
/// The error is about proportional to the number of Gaussians to the power of -`POWER`.
const POWER: f64 = 1.1;

impl Budget {
    /// The number of Gaussians that is expected to meet the budget, extrapolated from `count`
    /// Gaussians with this error; at most `most`. `component_bits` returns the bits of a component
    /// ([`rate_model::component_bits`]) on average.
    pub(crate) fn wanted(
        self,
        count: usize,
        error: RenderingError,
        component_bits: impl FnOnce() -> f64,
        most: usize,
    ) -> usize {
        let count = count.max(1) as f64;
        let wanted = match self {
            Self::Count(wanted) => return wanted.min(most),
            Self::Bits { bits, tune } => {
                bits / rate_model::bits_per_gaussian(tune, component_bits())
            }
            Self::SquaredError(SquaredError(target)) => {
                count * (error.squared.0 / target).powf(1.0 / POWER)
            }
            Self::DistortionPerGaussian(Distortion(target)) => {
                count * (error.distortion.0 / count / target).powf(1.0 / (POWER + 1.0))
            }
        };
        // The cast of a float saturates, and that of NaN gives 0. A target of 0 gives `most`.
        (wanted.ceil() as usize).min(most)
    }
}
