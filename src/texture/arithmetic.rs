//! What texture is computed with: one value at a time, or sixteen; both have the same bits.

use core::ops::{Add, Mul, Neg, Sub};

#[cfg(feature = "std")]
use fearless_simd::{Simd, f32x16, i32x16, prelude::*, u32x16};

use super::noise;
use crate::math;

/// Plain code, or SIMD code.
pub(crate) trait Arithmetic: Copy {
    /// Values side by side.
    type Values: Copy
        + Add<Output = Self::Values>
        + Sub<Output = Self::Values>
        + Mul<Output = Self::Values>
        + Neg<Output = Self::Values>;

    /// How many these are: 16 or a divisor of it.
    const LANES: usize;

    /// Runs `work`, which is compiled for the level of this code.
    fn run<T>(self, work: impl FnOnce() -> T) -> T;

    fn splat(self, value: f32) -> Self::Values;

    /// The first values of a slice.
    fn load(self, from: &[f32]) -> Self::Values;

    /// Sets the first values of a slice.
    fn store(self, values: Self::Values, to: &mut [f32]);

    /// The first values of a slice, twice as many.
    #[inline(always)]
    fn load_two(self, from: &[f32]) -> [Self::Values; 2] {
        [self.load(from), self.load(&from[Self::LANES..])]
    }

    /// Sets the first values of a slice, twice as many.
    #[inline(always)]
    fn store_two(self, [a, b]: [Self::Values; 2], to: &mut [f32]) {
        self.store(a, to);
        self.store(b, &mut to[Self::LANES..]);
    }

    /// Sets the first values of a slice, four times as many.
    #[inline(always)]
    fn store_four(self, [a, b, c, d]: [Self::Values; 4], to: &mut [f32]) {
        self.store(a, to);
        self.store(b, &mut to[Self::LANES..]);
        self.store(c, &mut to[2 * Self::LANES..]);
        self.store(d, &mut to[3 * Self::LANES..]);
    }

    /// The values one by one from either side.
    fn interleave(self, a: Self::Values, b: Self::Values) -> [Self::Values; 2];

    /// The values one by one from each of four.
    #[inline(always)]
    fn interleave_four(self, [a, b, c, d]: [Self::Values; 4]) -> [Self::Values; 4] {
        let ([even, later_even], [odd, later_odd]) = (self.interleave(a, c), self.interleave(b, d));
        let [first, second] = self.interleave(even, odd);
        let [third, fourth] = self.interleave(later_even, later_odd);
        [first, second, third, fourth]
    }

    /// What is so far on the way from one to the other.
    #[inline(always)]
    fn between(self, a: Self::Values, b: Self::Values, part: f32) -> Self::Values {
        a + (b - a) * self.splat(part)
    }

    /// The nearest numbers from 0 to 1; 0 for NaN.
    fn unit(self, values: Self::Values) -> Self::Values;

    fn sqrt(self, values: Self::Values) -> Self::Values;

    /// Whether all are 0.
    fn is_zero(self, values: Self::Values) -> bool;

    /// The numbers of blocks from `first` on, in a row with this seed: see [`noise::numbers`].
    fn numbers(self, first: u32, seed: u32) -> [Self::Values; 3];
}

/// Scalar code: the reference.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Plain;

impl Arithmetic for Plain {
    type Values = f32;

    const LANES: usize = 1;

    #[inline(always)]
    fn run<T>(self, work: impl FnOnce() -> T) -> T {
        work()
    }

    #[inline(always)]
    fn splat(self, value: f32) -> f32 {
        value
    }

    #[inline(always)]
    fn load(self, from: &[f32]) -> f32 {
        from[0]
    }

    #[inline(always)]
    fn store(self, values: f32, to: &mut [f32]) {
        to[0] = values;
    }

    #[inline(always)]
    fn interleave(self, a: f32, b: f32) -> [f32; 2] {
        [a, b]
    }

    #[inline(always)]
    #[expect(clippy::manual_clamp, reason = "`clamp` keeps NaN")]
    fn unit(self, values: f32) -> f32 {
        values.max(0.0).min(1.0)
    }

    #[inline(always)]
    fn sqrt(self, values: f32) -> f32 {
        math::sqrt(values)
    }

    #[inline(always)]
    fn is_zero(self, values: f32) -> bool {
        values == 0.0
    }

    #[inline(always)]
    fn numbers(self, first: u32, seed: u32) -> [f32; 3] {
        noise::numbers(first, seed).map(|number| number as f32)
    }
}

/// What all slices have.
#[cfg(feature = "std")]
const WHOLE: &str = "a whole vector";

/// SIMD code of a level.
#[cfg(feature = "std")]
#[derive(Clone, Copy, Debug)]
pub(crate) struct Vectors<S>(pub(crate) S);

#[cfg(feature = "std")]
impl<S: Simd> Arithmetic for Vectors<S> {
    type Values = f32x16<S>;

    const LANES: usize = 16;

    #[inline]
    fn run<T>(self, work: impl FnOnce() -> T) -> T {
        self.0.vectorize(work)
    }

    #[inline(always)]
    fn splat(self, value: f32) -> f32x16<S> {
        f32x16::splat(self.0, value)
    }

    #[inline(always)]
    fn load(self, from: &[f32]) -> f32x16<S> {
        f32x16::load_array_ref(self.0, from.first_chunk().expect(WHOLE))
    }

    #[inline(always)]
    fn store(self, values: f32x16<S>, to: &mut [f32]) {
        values.store_array(to.first_chunk_mut().expect(WHOLE));
    }

    #[inline(always)]
    fn interleave(self, a: f32x16<S>, b: f32x16<S>) -> [f32x16<S>; 2] {
        let (low, high) = a.interleave(b);
        [low, high]
    }

    #[inline(always)]
    fn unit(self, values: f32x16<S>) -> f32x16<S> {
        values.max_precise(self.splat(0.0)).min(self.splat(1.0))
    }

    #[inline(always)]
    fn sqrt(self, values: f32x16<S>) -> f32x16<S> {
        values.sqrt()
    }

    #[inline(always)]
    fn is_zero(self, values: f32x16<S>) -> bool {
        values.simd_eq(0.0).all_true()
    }

    #[inline(always)]
    fn numbers(self, first: u32, seed: u32) -> [f32x16<S>; 3] {
        // As in `noise::numbers`.
        let blocks = u32x16::load_array(self.0, core::array::from_fn(|at| at as u32)) + first;
        let mut hash = blocks * noise::BLOCK_FACTOR + seed;
        hash = (hash ^ (hash >> 15)) * noise::HASH_FACTOR;
        let hash: i32x16<S> = hash.bitcast();
        let [a, b, c] = [hash, hash << noise::BITS_AFTER, hash << noise::BITS_BEFORE];
        [number(a), number(b), number(c)]
    }
}

/// The number in the highest bits.
#[cfg(feature = "std")]
#[inline(always)]
fn number<S: Simd>(bits: i32x16<S>) -> f32x16<S> {
    (bits >> noise::BITS_BEFORE).to_float()
}
