//! The kernel: how a Gaussian falls off with the squared Mahalanobis distance q (spec, section
//! 9.3).

use crate::container::ChunkType;
use crate::error::DecodeError;
use crate::math;

/// Largest cut-off of the reference kernel.
const MAX_CUTOFF: f32 = 64.0;
/// Where the quartic kernel ends.
pub(crate) const QUARTIC_CUTOFF: f32 = 4.0;

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
    pub(super) const fn scale(self) -> f32 {
        match self {
            Self::Exponential { .. } => 1.0,
            Self::Quartic => 0.5,
        }
    }

    /// Its variance along each axis, for a covariance of 1.
    pub(super) const fn variance(self) -> f32 {
        match self {
            Self::Exponential { .. } => 1.0,
            Self::Quartic => 0.5,
        }
    }

    /// The weight at a point (u, v), in scaled distances, which may be infinite.
    pub(super) fn weight(self, (u, v): (f32, f32)) -> f32 {
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

#[cfg(feature = "std")]
pub(crate) mod simd {
    //! The same weights, sixteen at a time and bit for bit.

    use fearless_simd::{Simd, f32x16, prelude::*, u32x16};

    use crate::math::{EXP2_POLYNOMIAL, LOG2_E, ROUND_MAGIC};

    /// A kernel whose parameters are known when the inner loop is compiled.
    pub(crate) trait Weight: Copy {
        /// What all points with the same u have in common.
        fn column<S: Simd>(self, simd: S, u: f32x16<S>) -> f32x16<S>;

        /// The weights of points, from what their columns have in common.
        fn weight<S: Simd>(self, simd: S, column: f32x16<S>, v: f32x16<S>) -> f32x16<S>;
    }

    #[derive(Clone, Copy)]
    pub(crate) struct Exponential {
        pub(crate) cutoff: f32,
    }

    #[derive(Clone, Copy)]
    pub(crate) struct Quartic;

    impl Weight for Quartic {
        #[inline(always)]
        fn column<S: Simd>(self, simd: S, u: f32x16<S>) -> f32x16<S> {
            f32x16::splat(simd, 1.0) - u * u
        }

        #[inline(always)]
        fn weight<S: Simd>(self, _: S, column: f32x16<S>, v: f32x16<S>) -> f32x16<S> {
            let t = (column - v * v).max(0.0);
            t * t
        }
    }

    impl Weight for Exponential {
        #[inline(always)]
        fn column<S: Simd>(self, _: S, u: f32x16<S>) -> f32x16<S> {
            u * u
        }

        #[inline(always)]
        fn weight<S: Simd>(self, simd: S, column: f32x16<S>, v: f32x16<S>) -> f32x16<S> {
            self.at(simd, column + v * v)
        }
    }

    impl Exponential {
        /// The weights at squared Mahalanobis distances.
        #[inline(always)]
        pub(crate) fn at<S: Simd>(self, simd: S, q: f32x16<S>) -> f32x16<S> {
            let zero = f32x16::splat(simd, 0.0);
            q.simd_le(self.cutoff).select(exp(simd, q * -0.5), zero)
        }
    }

    /// [`math::exp`](crate::math::exp), sixteen at a time.
    #[inline(always)]
    pub(crate) fn exp<S: Simd>(simd: S, x: f32x16<S>) -> f32x16<S> {
        let y = (x * LOG2_E).max(-126.0).min(126.0);
        let shifted = y + ROUND_MAGIC;
        let f = y - (shifted - ROUND_MAGIC);
        let mut p = f32x16::splat(simd, EXP2_POLYNOMIAL[0]);
        for &coefficient in &EXP2_POLYNOMIAL[1..] {
            p = p * f + coefficient;
        }
        // The low bits of `shifted` are the rounded y itself.
        let exponent: u32x16<S> = shifted.bitcast();
        let power = (exponent - (ROUND_MAGIC.to_bits() - 127)) << 23;
        p * power.bitcast::<f32x16<S>>()
    }
}
