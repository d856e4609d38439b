//! Pairs of neighbouring lanes of vectors: their sums, and what is the same in both.

use fearless_simd::{Simd, f32x4, f32x8, f32x16, prelude::*};

/// The sums of pairs: those of `a` in the low half, of `b` in the high half.
#[inline(always)]
pub(crate) fn folded<S: Simd, V: SimdFloat<S, Element = f32>>(a: V, b: V) -> V {
    a.unzip_low(b) + a.unzip_high(b)
}

/// The sums of the pairs of eight lanes.
#[inline(always)]
pub(crate) fn folded_half<S: Simd>(lanes: f32x8<S>) -> f32x4<S> {
    let (low, high) = lanes.split();
    low.unzip_low(high) + low.unzip_high(high)
}

/// Every lane twice.
#[inline(always)]
pub(crate) fn doubled_quarter<S: Simd>(lanes: f32x4<S>) -> f32x8<S> {
    lanes.zip_low(lanes).combine(lanes.zip_high(lanes))
}

/// Every lane twice.
#[inline(always)]
pub(crate) fn doubled_half<S: Simd>(lanes: f32x8<S>) -> f32x16<S> {
    lanes.zip_low(lanes).combine(lanes.zip_high(lanes))
}

/// Every lane twice: those of the low half, and those of the high half.
#[inline(always)]
pub(crate) fn doubled<S: Simd>(lanes: f32x16<S>) -> [f32x16<S>; 2] {
    [lanes.zip_low(lanes), lanes.zip_high(lanes)]
}
