//! The kernel: how a Gaussian falls off with the squared Mahalanobis distance q (spec, section
//! 9.3).

use crate::chunk::ChunkType;
use crate::error::DecodeError;
use crate::math;

/// Largest cut-off of the reference kernel.
const MAX_CUTOFF: f32 = 64.0;
/// The Mahalanobis distance at which the quartic kernel ends.
pub(crate) const QUARTIC_RADIUS: f32 = 2.0;
/// Its square.
pub(crate) const QUARTIC_CUTOFF: f32 = QUARTIC_RADIUS * QUARTIC_RADIUS;

/// What is added at squared Mahalanobis distance q from a Gaussian's centre, relative to its
/// colour.
#[derive(Clone, Copy, Debug, PartialEq)]
#[non_exhaustive]
pub enum Kernel {
    /// The paper's: exp(-q / 2) for q up to a cut-off, else 0. Discontinuous there.
    Exponential {
        /// The largest q that is drawn, in (0, 64]. The paper's code draws weights of at least
        /// 1/255, that is up to 2 ln 255 = 11.08.
        cutoff: f32,
    },
    /// (1 - q / 4)^2 for q < 4, else 0, the quartic or biweight kernel of statistics: like
    /// exp(-q / 2) near the centre, but without an exponential, smooth where it ends, and with far
    /// fewer pixels under it.
    Quartic,
}

impl Kernel {
    /// The paper's kernel as its released code cuts it off: at weights below 1/255.
    pub const PAPER: Self = Self::Exponential { cutoff: 11.082_527 };

    /// The value of q from which on nothing is drawn.
    #[must_use]
    pub const fn cutoff(self) -> f32 {
        match self {
            Self::Exponential { cutoff } => cutoff,
            Self::Quartic => QUARTIC_CUTOFF,
        }
    }

    /// By what distances are multiplied before the weight is taken: the quartic kernel ends at a
    /// distance of 1 then, which saves a pixel two operations.
    pub(crate) const fn scale(self) -> f32 {
        match self {
            Self::Exponential { .. } => 1.0,
            Self::Quartic => 0.5,
        }
    }

    /// Its variance along each axis, for a covariance of 1.
    pub(crate) const fn variance(self) -> f32 {
        match self {
            Self::Exponential { .. } => 1.0,
            Self::Quartic => 0.5,
        }
    }

    /// The weight at a point (u, v), in scaled distances, which may be infinite.
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

    /// The code that the header stores.
    #[cfg(feature = "encode")]
    pub(crate) const fn code(self) -> u8 {
        match self {
            Self::Exponential { .. } => 0,
            Self::Quartic => 1,
        }
    }

    /// The kernel that a header names, with the cut-off that it states.
    pub(crate) fn parse(code: u8, cutoff: f32) -> Result<Self, DecodeError> {
        const CHUNK: ChunkType = ChunkType::GHDR;
        match code {
            0 if cutoff > 0.0 && cutoff <= MAX_CUTOFF => Ok(Self::Exponential { cutoff }),
            1 if cutoff == QUARTIC_CUTOFF => Ok(Self::Quartic),
            0 => Err(DecodeError::malformed(CHUNK, "a cut-off that is not in (0, 64]")),
            1 => {
                Err(DecodeError::malformed(CHUNK, "a cut-off of the quartic kernel that is not 4"))
            }
            _ => Err(DecodeError::unsupported(CHUNK, "kernel", code.into())),
        }
    }
}
