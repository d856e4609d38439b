//! The kernel: the weight of a Gaussian at a squared Mahalanobis distance q (spec, section 9.3).

use crate::chunk::ChunkType;
use crate::error::DecodeError;
use crate::math;

/// Largest cut-off of the exponential kernel.
const MAX_CUTOFF: f32 = 64.0;
/// The Mahalanobis distance at which the quartic kernel ends.
pub(crate) const QUARTIC_RADIUS: f32 = 2.0;
/// The cut-off of the quartic kernel: the square of that.
pub(crate) const QUARTIC_CUTOFF: f32 = QUARTIC_RADIUS * QUARTIC_RADIUS;

/// The weight of a Gaussian at a squared Mahalanobis distance q from its centre: what is added to
/// each channel is its amplitude times this weight (spec, section 9.3; paper, equations 1 and 2).
#[derive(Clone, Copy, Debug, PartialEq)]
#[non_exhaustive]
pub enum Kernel {
    /// The kernel of the paper: exp(-q / 2) for q up to a cut-off, else 0. It is discontinuous at
    /// the cut-off.
    Exponential {
        /// The largest q with a weight over 0: over 0, at most 64. The paper's code draws weights
        /// of at least 1/255, which is a q of at most 2 ln 255 = 11.08.
        cutoff: f32,
    },
    /// (1 - q / 4)^2 for q < 4, else 0: the quartic or biweight kernel of statistics. Near the
    /// centre it is like exp(-q / 2), but it needs no exponential, ends smoothly, and covers far
    /// fewer pixels.
    Quartic,
}

impl Kernel {
    /// The kernel of the paper with the cut-off of its released code, which draws weights of at
    /// least 1/255.
    pub const PAPER: Self = Self::Exponential { cutoff: 11.082_527 };

    /// The cut-off: the weight is 0 for every larger q.
    #[must_use]
    pub const fn cutoff(self) -> f32 {
        match self {
            Self::Exponential { cutoff } => cutoff,
            Self::Quartic => QUARTIC_CUTOFF,
        }
    }

    /// The factor of all distances before the weight is computed. It makes the quartic kernel end
    /// at a distance of 1, which saves two operations per pixel (spec, section 9.2).
    pub(crate) const fn scale(self) -> f32 {
        match self {
            Self::Exponential { .. } => 1.0,
            Self::Quartic => 0.5,
        }
    }

    /// The variance of the kernel along each axis, for a stored covariance of 1.
    pub(crate) const fn variance(self) -> f32 {
        match self {
            Self::Exponential { .. } => 1.0,
            Self::Quartic => 0.5,
        }
    }

    /// The weight at a point (u, v), in distances multiplied by [`Kernel::scale`]. They may be
    /// infinite.
    pub(crate) fn weight(self, (u, v): (f32, f32)) -> f32 {
        match self {
            Self::Exponential { cutoff } => {
                let q = u * u + v * v;
                if q <= cutoff { math::exp(q * -0.5) } else { 0.0 }
            }
            Self::Quartic => {
                let t = ((1.0 - u * u) - v * v).max(0.0);
                t * t
            }
        }
    }

    /// Whether the cut-off is one that a file can have.
    pub(crate) fn is_valid(self) -> bool {
        match self {
            Self::Exponential { cutoff } => cutoff > 0.0 && cutoff <= MAX_CUTOFF,
            Self::Quartic => true,
        }
    }

    /// The exponential kernel with a cut-off that a file declares.
    pub(crate) fn exponential(cutoff: f32) -> Result<Self, DecodeError> {
        match cutoff {
            _ if cutoff.is_nan() || cutoff <= 0.0 => {
                Err(DecodeError::malformed(ChunkType::HEADER, "a cut-off that is not positive"))
            }
            _ if cutoff > MAX_CUTOFF => {
                Err(DecodeError::unsupported(ChunkType::HEADER, "cut-off over", MAX_CUTOFF as u32))
            }
            _ => Ok(Self::Exponential { cutoff }),
        }
    }
}
