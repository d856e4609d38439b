//! The two loops of texture for which the plain code is far slower than SIMD code; both have the same bits.

#[cfg(feature = "std")]
use fearless_simd::{Simd, f32x8, f32x16, prelude::*};

use super::map::CELL;

/// Plain code, or SIMD code.
pub(crate) trait Arithmetic: Copy {
    /// Runs `work`, whose loops are vectorized for the level of this code.
    fn run<T>(self, work: impl FnOnce() -> T) -> T;

    /// The values at the points of a cell between two nodes, from that at the first of them and its change.
    fn ramp(self, left: f32, change: f32) -> [f32; CELL];

    /// A row between two rows of a lattice, enlarged by two: three quarters of the nearest point and one quarter
    /// of the next one, first between the rows, then along them. The first and the last value are not right.
    fn enlarge<const WIDTH: usize, const TWICE: usize>(
        self,
        near: &[f32; WIDTH],
        far: &[f32; WIDTH],
        out: &mut [f32; TWICE],
    );
}

/// Scalar code: the reference.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Plain;

impl Arithmetic for Plain {
    fn run<T>(self, work: impl FnOnce() -> T) -> T {
        work()
    }

    fn ramp(self, left: f32, change: f32) -> [f32; CELL] {
        ramp(left, change)
    }

    fn enlarge<const WIDTH: usize, const TWICE: usize>(
        self,
        near: &[f32; WIDTH],
        far: &[f32; WIDTH],
        out: &mut [f32; TWICE],
    ) {
        let mixed = |column: usize| near[column] * 0.75 + far[column] * 0.25;
        for column in 1..WIDTH - 1 {
            let near = mixed(column) * 0.75;
            out[2 * column] = near + mixed(column - 1) * 0.25;
            out[2 * column + 1] = near + mixed(column + 1) * 0.25;
        }
    }
}

/// SIMD code of a level.
#[cfg(feature = "std")]
#[derive(Clone, Copy, Debug)]
pub(crate) struct Vectors<S>(pub(crate) S);

#[cfg(feature = "std")]
impl<S: Simd> Arithmetic for Vectors<S> {
    #[inline]
    fn run<T>(self, work: impl FnOnce() -> T) -> T {
        self.0.vectorize(work)
    }

    #[inline(always)]
    fn ramp(self, left: f32, change: f32) -> [f32; CELL] {
        let steps = f32x8::load_array(self.0, ramp(0.0, 1.0));
        (f32x8::splat(self.0, left) + steps * change).to_array()
    }

    #[inline(always)]
    fn enlarge<const WIDTH: usize, const TWICE: usize>(
        self,
        near: &[f32; WIDTH],
        far: &[f32; WIDTH],
        out: &mut [f32; TWICE],
    ) {
        let (near, far) = (near.as_chunks::<16>().0, far.as_chunks::<16>().0);
        let mut last = f32x16::splat(self.0, 0.0);
        let mut mean = mixed(self.0, &near[0], &far[0]);
        for (at, out) in out.as_chunks_mut::<32>().0.iter_mut().enumerate() {
            let next = match (near.get(at + 1), far.get(at + 1)) {
                (Some(near), Some(far)) => mixed(self.0, near, far),
                _ => last,
            };
            let near = mean * 0.75;
            let first = near + last.slide::<15>(mean) * 0.25;
            let second = near + mean.slide::<1>(next) * 0.25;
            let (low, high) = first.interleave(second);
            low.store_slice(&mut out[..16]);
            high.store_slice(&mut out[16..]);
            (last, mean) = (mean, next);
        }
    }
}

/// Points between two rows.
#[cfg(feature = "std")]
#[inline(always)]
fn mixed<S: Simd>(simd: S, near: &[f32; 16], far: &[f32; 16]) -> f32x16<S> {
    f32x16::load_array_ref(simd, near) * 0.75 + f32x16::load_array_ref(simd, far) * 0.25
}

/// How far a point in a cell is on the way from one node to the next.
#[inline(always)]
pub(super) const fn step<const POINTS: usize>(at: usize) -> f32 {
    (at as f32 + 0.5) / POINTS as f32
}

/// [`Arithmetic::ramp`] for any lattice.
#[inline(always)]
pub(super) fn ramp<const POINTS: usize>(left: f32, change: f32) -> [f32; POINTS] {
    // A closure would not always be compiled into the loop around it.
    let mut values = [0.0; POINTS];
    for (at, value) in values.iter_mut().enumerate() {
        *value = left + change * step::<POINTS>(at);
    }
    values
}
