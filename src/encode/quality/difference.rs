//! How much the rows of a source and of a rendering differ in structure.

#![expect(clippy::needless_range_loop, reason = "loops over indices are vectorized")]

use core::ops::Range;

use fearless_simd::{Simd, f32x16, prelude::*};

use crate::encode::rows::{Lanes, Rows};

/// The Gaussian window of standard deviation 1.5, from its middle.
const WINDOW: [f32; RADIUS + 1] = [0.266_56, 0.213_44, 0.109_59, 0.036_075, 0.007_615];
pub(super) const RADIUS: usize = 4;
/// What keeps the structural distance of even ground finite.
const LEAST_VARIANCE: f32 = 0.0009;
/// Vectors of a row that are compared at a time: the rows around them stay in the first-level cache.
const VECTORS: usize = 32;

/// Sums over pixels: of structural distance, 1 - SSIM; of detail that the rendering has and the source
/// lacks; of detail that is lost in the rendering; and of the 4th powers of the three.
pub(super) type Sums = [f64; 6];

/// Adds sums over other pixels.
pub(super) fn add(total: &mut Sums, sums: Sums) {
    for (total, sum) in total.iter_mut().zip(sums) {
        *total += sum;
    }
}

/// Means in a window around sixteen columns: of the source, the rendering, the sum of their squares,
/// and their product.
type Means<S> = [f32x16<S>; 4];

/// Rows from y - 4 to y + 4.
type Around<'a> = [[&'a [Lanes]; 2]; 2 * RADIUS + 1];

/// The sums over the row at y.
#[inline(always)]
pub(super) fn differences<S: Simd>(simd: S, rows: &Rows, y: usize) -> Sums {
    let around: Around<'_> =
        core::array::from_fn(|offset| rows.row((y + offset) as isize - RADIUS as isize));
    let mut sums = Sums::default();
    let vectors = rows.width.div_ceil(16);
    for first in (0..vectors).step_by(VECTORS) {
        let end = vectors.min(first + VECTORS);
        add(&mut sums, part(simd, &around, first..end, rows.width));
    }
    sums
}

/// The sums over some vectors of a row.
#[inline(always)]
fn part<S: Simd>(simd: S, around: &Around<'_>, vectors: Range<usize>, width: usize) -> Sums {
    // Those and one on either side.
    let mut means = [[[0.0; 16]; VECTORS + 2]; 4];
    for at in 0..vectors.len() + 2 {
        let down = means_down(simd, around, vectors.start + at);
        for which in 0..4 {
            down[which].store_array(&mut means[which][at]);
        }
    }
    let [source, rendering] = around[RADIUS];
    let mut sums = [f32x16::splat(simd, 0.0); 6];
    for at in 0..vectors.len() {
        let [mean_a, mean_b, squares, product] = [
            mean_across(simd, &means[0], at),
            mean_across(simd, &means[1], at),
            mean_across(simd, &means[2], at),
            mean_across(simd, &means[3], at),
        ];
        let a = f32x16::load_array_ref(simd, &source[vectors.start + at + 1]);
        let b = f32x16::load_array_ref(simd, &rendering[vectors.start + at + 1]);
        let shift = mean_a - mean_b;
        let covariance = product - mean_a * mean_b;
        let variances = squares - (mean_a * mean_a + mean_b * mean_b);
        let similarity = (shift * shift * -1.0 + 1.0) * (covariance * 2.0 + LEAST_VARIANCE)
            / (variances + LEAST_VARIANCE);
        let structure = (similarity * -1.0 + 1.0).max(0.0);
        let detail = ((b - mean_b).abs() + 1.0) / ((a - mean_a).abs() + 1.0) - 1.0;
        let columns = width - (vectors.start + at) * 16;
        let mut found = [structure, detail.max(0.0), (detail * -1.0).max(0.0)];
        if columns < 16 {
            let inside = f32x16::from_fn(simd, |lane| if lane < columns { 1.0 } else { 0.0 });
            for which in 0..3 {
                found[which] *= inside;
            }
        }
        for which in 0..3 {
            sums[which] += found[which];
            let square = found[which] * found[which];
            sums[which + 3] += square * square;
        }
    }
    sums.map(|sum| sum.as_array().iter().map(|&lane| f64::from(lane)).sum())
}

/// Means down the columns.
#[inline(always)]
fn means_down<S: Simd>(simd: S, around: &Around<'_>, at: usize) -> Means<S> {
    let mut means = [f32x16::splat(simd, 0.0); 4];
    for offset in 0..2 * RADIUS + 1 {
        let weight = WINDOW[offset.abs_diff(RADIUS)];
        let a = f32x16::load_array_ref(simd, &around[offset][0][at]);
        let b = f32x16::load_array_ref(simd, &around[offset][1][at]);
        let [weighted_a, weighted_b] = [a * weight, b * weight];
        means[0] += weighted_a;
        means[1] += weighted_b;
        means[2] += weighted_a * a + weighted_b * b;
        means[3] += weighted_a * b;
    }
    means
}

/// The mean along a row, where the vector of the mean's own columns is number `at` + 1.
#[inline(always)]
fn mean_across<S: Simd>(simd: S, values: &[Lanes], at: usize) -> f32x16<S> {
    let values = &values.as_flattened()[16 * at..16 * at + 48];
    let mut mean = load(simd, values, 16) * WINDOW[0];
    for distance in 1..=RADIUS {
        let pair = load(simd, values, 16 - distance) + load(simd, values, 16 + distance);
        mean += pair * WINDOW[distance];
    }
    mean
}

#[inline(always)]
fn load<S: Simd>(simd: S, values: &[f32], at: usize) -> f32x16<S> {
    f32x16::from_slice(simd, &values[at..at + 16])
}

#[cfg(test)]
mod tests {
    use fearless_simd::dispatch;

    use super::*;
    use crate::encode::rows::Border;
    use crate::testing::simd_levels;

    /// The sums over all rows in f64, directly from the definition.
    fn plain([width, height]: [usize; 2], border: Border, a: &[f32], b: &[f32]) -> Sums {
        let inside = |at: isize, length: usize| {
            let mut walk = (0..length).chain((1..length.max(2) - 1).rev()).cycle();
            match usize::try_from(at) {
                Ok(at) if at < length => Some(at),
                _ if border == Border::Zeros => None,
                // The mirror images have a period, which divides this.
                _ => walk.nth((at + 100 * 2 * (length as isize - 1)).max(0) as usize),
            }
        };
        let blurred = |value: &dyn Fn(usize) -> f64, x: usize, y: usize| {
            let reach = RADIUS as isize;
            let mut sum = 0.0;
            for dy in -reach..=reach {
                for dx in -reach..=reach {
                    let column = inside(x as isize + dx, width);
                    let row = inside(y as isize + dy, height);
                    if let (Some(column), Some(row)) = (column, row) {
                        let [dx, dy] = [dx, dy].map(isize::unsigned_abs);
                        let weight = f64::from(WINDOW[dx]) * f64::from(WINDOW[dy]);
                        sum += weight * value(row * width + column);
                    }
                }
            }
            sum
        };
        let [a, b] = [a, b].map(|values| move |at: usize| f64::from(values[at]));
        let c2 = f64::from(LEAST_VARIANCE);
        let mut sums = Sums::default();
        for y in 0..height {
            for x in 0..width {
                let [ma, mb] = [blurred(&a, x, y), blurred(&b, x, y)];
                let aa = blurred(&|at| a(at) * a(at), x, y) - ma * ma;
                let bb = blurred(&|at| b(at) * b(at), x, y) - mb * mb;
                let ab = blurred(&|at| a(at) * b(at), x, y) - ma * mb;
                let similarity = (1.0 - (ma - mb).powi(2)) * (2.0 * ab + c2) / (aa + bb + c2);
                let structure = (1.0 - similarity).max(0.0);
                let at = y * width + x;
                let detail = (1.0 + (b(at) - mb).abs()) / (1.0 + (a(at) - ma).abs()) - 1.0;
                let found = [structure, detail.max(0.0), (-detail).max(0.0)];
                for (which, found) in found.into_iter().enumerate() {
                    sums[which] += found;
                    sums[which + 3] += found.powi(4);
                }
            }
        }
        sums
    }

    /// All rows of two pictures.
    fn rows(size: [usize; 2], border: Border, pictures: [&[f32]; 2]) -> Rows {
        let mut rows = Rows::new(size, border, 4);
        for first in (0..size[1]).step_by(4) {
            let mut group = rows.blank();
            for (which, picture) in pictures.into_iter().enumerate() {
                for row in 0..4.min(size[1] - first) {
                    let values = &picture[(first + row) * size[0]..][..size[0]];
                    group.part(which, row, 0)[..size[0]].copy_from_slice(values);
                }
            }
            rows.push(group);
        }
        rows
    }

    #[test]
    fn sums_are_those_of_the_definition() {
        let mut rng = fastrand::Rng::with_seed(1);
        // More vectors than are compared at a time, and fewer columns than the window has.
        let sizes = [[16 * VECTORS + 9, 6], [23, 41], [3, 5], [1, 1]];
        let cases = sizes.map(|size| [(size, Border::Zeros), (size, Border::Mirrored)]);
        for (size, border) in cases.into_iter().flatten() {
            let mut picture = || (0..size[0] * size[1]).map(|_| rng.f32()).collect::<Vec<_>>();
            let (a, b) = (picture(), picture());
            let expected = plain(size, border, &a, &b);
            let (different, same) = (rows(size, border, [&a, &b]), rows(size, border, [&a, &a]));
            let total = |level, rows: &Rows| {
                let mut total = Sums::default();
                for y in 0..size[1] {
                    add(&mut total, dispatch!(level, simd => differences(simd, rows, y)));
                }
                total
            };
            for (name, level) in simd_levels() {
                let found = total(level, &different);
                for (found, expected) in found.into_iter().zip(expected) {
                    let error = (found - expected).abs();
                    assert!(
                        error < 1e-4 * expected + 1e-6,
                        "{name} {border:?}: {found}, {expected}"
                    );
                }
                assert_eq!(found, total(simd_levels()[0].1, &different), "{name}");
                assert_eq!(total(level, &same), Sums::default(), "{name}");
            }
        }
    }
}
