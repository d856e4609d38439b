//! A micro-benchmark of kernel evaluations alone: the least time that splatting can take.

use std::hint::black_box;
use std::time::Instant;

use fearless_simd::{Level, Simd, dispatch, f32x16, prelude::*};

/// Rows of sixteen pixels with three channels, whose sums stay in registers.
const ROWS: usize = 8;
/// So few Gaussians that they stay in the first-level cache.
const GAUSSIANS: usize = 64;
const REPEATS: usize = 2_000;
/// The time is the least of so many runs.
const RUNS: usize = 10;

/// Seconds for one Gaussian at one pixel: the quartic kernel, added to three channels.
pub(crate) fn seconds_per_evaluation() -> f64 {
    let gaussians: Vec<[f32; 8]> = (0..GAUSSIANS)
        .map(|index| core::array::from_fn(|value| 0.01 * (index + value + 1) as f32))
        .collect();
    let level = Level::new();
    let run = || {
        let start = Instant::now();
        for _ in 0..REPEATS {
            let sums = dispatch!(level, simd => sums(simd, black_box(&gaussians)));
            black_box(sums);
        }
        start.elapsed().as_secs_f64()
    };
    let best = (0..RUNS).map(|_| run()).fold(f64::INFINITY, f64::min);
    best / (REPEATS * GAUSSIANS * ROWS * 16) as f64
}

#[inline(always)]
fn sums<S: Simd>(simd: S, gaussians: &[[f32; 8]]) -> [f32; 16] {
    let zero = f32x16::splat(simd, 0.0);
    let mut sums = [[zero; 3]; ROWS];
    let x = f32x16::from_fn(simd, |column| column as f32);
    for &[i11, w, i22, dx, dy, red, green, blue] in gaussians {
        let (u, slant) = ((x - dx) * i11, (x - dx) * w);
        let column = f32x16::splat(simd, 1.0) - u * u;
        for (row, sums) in sums.iter_mut().enumerate() {
            let v = slant + i22 * (row as f32 - dy);
            let root = (column - v * v).max(0.0);
            let weight = root * root;
            sums[0] += weight * red;
            sums[1] += weight * green;
            sums[2] += weight * blue;
        }
    }
    let mut total = zero;
    for sum in sums.as_flattened() {
        total += *sum;
    }
    total.to_array()
}
