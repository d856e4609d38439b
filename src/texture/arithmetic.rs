//! The two loops of texture for which the plain code is far slower than SIMD code; both have the same bits.

#[cfg(feature = "std")]
use fearless_simd::{Simd, f32x8, f32x16, prelude::*};

use super::map::CELL;

/// Plain code, or SIMD code.
pub(crate) trait Arithmetic: Copy {
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
        let mixed = |at: usize| {
            let [near, far] = [near, far].map(|row| f32x16::load_array_ref(self.0, &row[at]));
            near * 0.75 + far * 0.25
        };
        let mut last = f32x16::splat(self.0, 0.0);
        let mut mean = mixed(0);
        for (at, out) in out.as_chunks_mut::<32>().0.iter_mut().enumerate() {
            let next = if at + 1 < near.len() { mixed(at + 1) } else { last };
            let [left, right] = [last.slide::<15>(mean), mean.slide::<1>(next)];
            let [first, second] = [left, right].map(|beside| mean * 0.75 + beside * 0.25);
            let (low, high) = first.interleave(second);
            low.store_slice(&mut out[..16]);
            high.store_slice(&mut out[16..]);
            (last, mean) = (mean, next);
        }
    }
}

/// How far a point in a cell is on the way from one node to the next.
#[inline(always)]
pub(super) const fn step<const POINTS: usize>(at: usize) -> f32 {
    (at as f32 + 0.5) / POINTS as f32
}

/// [`Arithmetic::ramp`] for any lattice.
#[inline(always)]
pub(super) fn ramp<const POINTS: usize>(left: f32, change: f32) -> [f32; POINTS] {
    core::array::from_fn(|at| left + change * step::<POINTS>(at))
}
