//! The weights of [`Kernel`](crate::kernel::Kernel), sixteen at a time and with the same bits.

use fearless_simd::{Simd, SimdFloat, f32x16, prelude::*};

#[cfg(feature = "encode")]
use crate::kernel::QUARTIC_CUTOFF;
use crate::math::{EXP2_POLYNOMIAL, LOG2_E, ROUND_MAGIC};

/// The larger of each value and a limit; the limit for NaN.
#[inline(always)]
pub(crate) fn larger<S: Simd, V: SimdFloat<S, Element = f32>>(simd: S, values: V, limit: f32) -> V {
    // The maximum of WebAssembly passes NaN on and orders zeros, for which x86 takes eight
    // instructions.
    if cfg!(target_arch = "wasm32") {
        return values.simd_gt(limit).select(values, V::splat(simd, limit));
    }
    values.max(limit)
}

/// The smaller of each value and a limit; the limit for NaN.
#[inline(always)]
pub(crate) fn smaller<S: Simd, V: SimdFloat<S, Element = f32>>(
    simd: S,
    values: V,
    limit: f32,
) -> V {
    if cfg!(target_arch = "wasm32") {
        return values.simd_lt(limit).select(values, V::splat(simd, limit));
    }
    values.min(limit)
}

/// A kernel as a type, for which the inner loop is compiled.
pub(crate) trait Weight: Copy {
    /// The part of the weight that depends on u only, which all points of a column share.
    fn column<S: Simd>(self, simd: S, u: f32x16<S>) -> f32x16<S>;

    /// The weights of points, from that part for their columns and from their v.
    fn weight<S: Simd>(self, simd: S, column: f32x16<S>, v: f32x16<S>) -> f32x16<S>;
}

/// [`Kernel::Exponential`](crate::kernel::Kernel::Exponential).
#[derive(Clone, Copy)]
pub(crate) struct Exponential {
    pub(crate) cutoff: f32,
}

/// [`Kernel::Quartic`](crate::kernel::Kernel::Quartic).
#[derive(Clone, Copy)]
pub(crate) struct Quartic;

impl Weight for Quartic {
    #[inline(always)]
    fn column<S: Simd>(self, simd: S, u: f32x16<S>) -> f32x16<S> {
        f32x16::splat(simd, 1.0) - u * u
    }

    #[inline(always)]
    fn weight<S: Simd>(self, simd: S, column: f32x16<S>, v: f32x16<S>) -> f32x16<S> {
        let t = larger(simd, column - v * v, 0.0);
        t * t
    }
}

impl Quartic {
    /// The square roots of the weights at squared Mahalanobis distances: 1 - q / 4, and 0 for q
    /// over 4.
    #[cfg(feature = "encode")]
    #[inline(always)]
    pub(crate) fn root<S: Simd>(self, simd: S, q: f32x16<S>) -> f32x16<S> {
        larger(simd, f32x16::splat(simd, 1.0) - q * (1.0 / QUARTIC_CUTOFF), 0.0)
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
    pub(crate) fn at<S: Simd, V: SimdFloat<S, Element = f32>>(self, simd: S, q: V) -> V {
        let zero = V::splat(simd, 0.0);
        q.simd_le(self.cutoff).select(exp(simd, q * -0.5), zero)
    }
}

/// [`math::exp`](crate::math::exp), sixteen at a time.
#[inline(always)]
pub(crate) fn exp<S: Simd, V: SimdFloat<S, Element = f32>>(simd: S, x: V) -> V {
    let y = smaller(simd, larger(simd, x * LOG2_E, -126.0), 126.0);
    let shifted = y + ROUND_MAGIC;
    let f = y - (shifted - ROUND_MAGIC);
    let mut p = V::splat(simd, EXP2_POLYNOMIAL[0]);
    for &coefficient in &EXP2_POLYNOMIAL[1..] {
        p = p * f + coefficient;
    }
    // The low bits of `shifted` are y, rounded to an integer.
    let power = (shifted.to_bits() - (ROUND_MAGIC.to_bits() - 127)) << 23;
    p * V::from_bits(power)
}
