//! One channel of a picture, and how much two of them differ in structure.

use fearless_simd::{Level, dispatch};

use crate::encode::error::EncodeError;
use crate::encode::progress::Observer;

/// Rows that one task compares.
const BAND: usize = 32;
/// Work for a pixel.
const WORK: f64 = 15.0;
/// The Gaussian window of standard deviation 1.5, from its middle.
const WINDOW: [f32; RADIUS + 1] = [0.266_56, 0.213_44, 0.109_59, 0.036_075, 0.007_615];
const RADIUS: usize = 4;
/// What keeps the structural dissimilarity of even ground finite.
const LEAST_VARIANCE: f32 = 0.0009;

/// One channel of a picture.
#[derive(Clone, Debug, Default)]
pub(super) struct Plane {
    pub(super) width: usize,
    /// Row by row.
    pub(super) values: Vec<f32>,
}

/// How much two planes differ. An L1 norm is a mean, an L4 norm the 4th root of a mean of 4th powers.
#[derive(Clone, Copy, Debug, Default)]
pub(super) struct Differences {
    /// The L1 norm of structural dissimilarity, 1 - SSIM.
    pub(super) structure_l1: f64,
    /// Its L4 norm.
    pub(super) structure_l4: f64,
    /// The L4 norm of detail that the second plane has and the first one lacks.
    pub(super) artifacts_l4: f64,
    /// The L4 norm of detail that is lost in the second plane.
    pub(super) lost_l4: f64,
}

impl Plane {
    pub(super) fn height(&self) -> usize {
        self.values.len() / self.width
    }

    /// How much another plane of the same size differs.
    ///
    /// # Errors
    /// [`EncodeError::Cancelled`] when the caller cancels.
    pub(super) fn differences(
        &self,
        other: &Self,
        observer: &mut Observer<'_>,
    ) -> Result<Differences, EncodeError> {
        let level = Level::new();
        let bands = 0..self.height().div_ceil(BAND);
        let sums = observer.map(WORK * (self.width * BAND) as f64, bands, |band| {
            let first = band * BAND;
            let end = self.height().min(first + BAND);
            dispatch!(level, _ => sums(self, other, first, end))
        })?;
        // Added band by band, so that the sums do not depend on the threads.
        let mut total = [0.0; 4];
        for sums in sums {
            total.iter_mut().zip(sums).for_each(|(total, sum)| *total += sum);
        }
        let [structure, structure_4, artifacts_4, lost_4] =
            total.map(|sum| sum / self.values.len() as f64);
        Ok(Differences {
            structure_l1: structure,
            structure_l4: structure_4.sqrt().sqrt(),
            artifacts_l4: artifacts_4.sqrt().sqrt(),
            lost_l4: lost_4.sqrt().sqrt(),
        })
    }
}

/// The sums over some rows of structural dissimilarity, and of the 4th powers of it, of artifacts and
/// of lost detail. The compiler turns the loops into code of the SIMD level.
#[inline(always)]
fn sums(a: &Plane, b: &Plane, first: usize, end: usize) -> [f64; 4] {
    let width = a.width;
    let rows = first.saturating_sub(RADIUS)..(end + RADIUS).min(a.height());
    let mut padded = vec![0.0; width + 2 * RADIUS];
    // Means along the rows of a, b, a^2, b^2 and a b.
    let mut along: [Vec<f32>; 5] = core::array::from_fn(|_| vec![0.0; width * rows.len()]);
    let row_of = |plane: &'_ Plane, y: usize| -> core::ops::Range<usize> {
        y * plane.width..(y + 1) * plane.width
    };
    for (index, y) in rows.clone().enumerate() {
        let (a, b) = (&a.values[row_of(a, y)], &b.values[row_of(b, y)]);
        let products = |which: usize, x: usize| match which {
            0 => a[x],
            1 => b[x],
            2 => a[x] * a[x],
            3 => b[x] * b[x],
            _ => a[x] * b[x],
        };
        for (which, means) in along.iter_mut().enumerate() {
            for (x, value) in padded[RADIUS..][..width].iter_mut().enumerate() {
                *value = products(which, x);
            }
            let means = &mut means[index * width..][..width];
            let at: [&[f32]; 2 * RADIUS + 1] =
                core::array::from_fn(|offset| &padded[offset..][..width]);
            for (x, mean) in means.iter_mut().enumerate() {
                let pairs = WINDOW[1] * (at[3][x] + at[5][x])
                    + WINDOW[2] * (at[2][x] + at[6][x])
                    + WINDOW[3] * (at[1][x] + at[7][x])
                    + WINDOW[4] * (at[0][x] + at[8][x]);
                *mean = WINDOW[0] * at[4][x] + pairs;
            }
        }
    }
    let mut means: [Vec<f32>; 5] = core::array::from_fn(|_| vec![0.0; width]);
    let mut differences: [Vec<f32>; 3] = core::array::from_fn(|_| vec![0.0; width]);
    let mut total = [0.0; 4];
    for y in first..end {
        // Outside the picture everything is 0.
        for (means, along) in means.iter_mut().zip(&along) {
            means.fill(0.0);
            for other in y.saturating_sub(RADIUS).max(rows.start)..(y + RADIUS + 1).min(rows.end) {
                let weight = WINDOW[other.abs_diff(y)];
                let line = &along[(other - rows.start) * width..][..width];
                for (mean, value) in means.iter_mut().zip(line) {
                    *mean += weight * value;
                }
            }
        }
        let [mean_a, mean_b, aa, bb, ab] = &means;
        let [structure, artifacts, lost] = &mut differences;
        let (a, b) = (&a.values[row_of(a, y)], &b.values[row_of(b, y)]);
        for x in 0..width {
            let shift = mean_a[x] - mean_b[x];
            let covariance = ab[x] - mean_a[x] * mean_b[x];
            let variances = aa[x] - mean_a[x] * mean_a[x] + (bb[x] - mean_b[x] * mean_b[x]);
            let similarity = (1.0 - shift * shift) * (2.0 * covariance + LEAST_VARIANCE)
                / (variances + LEAST_VARIANCE);
            structure[x] = (1.0 - similarity).max(0.0);
            let detail = (1.0 + (b[x] - mean_b[x]).abs()) / (1.0 + (a[x] - mean_a[x]).abs()) - 1.0;
            artifacts[x] = detail.max(0.0);
            lost[x] = (-detail).max(0.0);
        }
        let fourth = |values: &[f32]| {
            values
                .iter()
                .map(|value| f64::from(value * value))
                .map(|square| square * square)
                .sum::<f64>()
        };
        total[0] += structure.iter().map(|&value| f64::from(value)).sum::<f64>();
        total[1] += fourth(structure);
        total[2] += fourth(artifacts);
        total[3] += fourth(lost);
    }
    total
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::encode::progress::unobserved;

    /// Differences of two planes in f64, directly from the definition.
    fn plain(a: &Plane, b: &Plane) -> Differences {
        let (width, height) = (a.width, a.height());
        let blurred = |value: &dyn Fn(usize) -> f64, x: usize, y: usize| {
            let mut sum = 0.0;
            for row in 0..height {
                for column in 0..width {
                    let [dx, dy] = [column.abs_diff(x), row.abs_diff(y)];
                    if dx <= RADIUS && dy <= RADIUS {
                        let weight = f64::from(WINDOW[dx]) * f64::from(WINDOW[dy]);
                        sum += weight * value(row * width + column);
                    }
                }
            }
            sum
        };
        let [a, b] = [a, b].map(|plane| move |at: usize| f64::from(plane.values[at]));
        let c2 = f64::from(LEAST_VARIANCE);
        let mut sums = [0.0; 4];
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
                sums[0] += structure;
                sums[1] += structure.powi(4);
                sums[2] += detail.max(0.0).powi(4);
                sums[3] += (-detail).max(0.0).powi(4);
            }
        }
        let [structure, structure_4, artifacts_4, lost_4] =
            sums.map(|sum| sum / (width * height) as f64);
        Differences {
            structure_l1: structure,
            structure_l4: structure_4.powf(0.25),
            artifacts_l4: artifacts_4.powf(0.25),
            lost_l4: lost_4.powf(0.25),
        }
    }

    fn plane(width: usize, height: usize, seed: u64) -> Plane {
        let mut rng = fastrand::Rng::with_seed(seed);
        Plane { width, values: (0..width * height).map(|_| rng.f32()).collect() }
    }

    fn differences(a: &Plane, b: &Plane) -> Differences {
        unobserved(|observer| a.differences(b, observer))
    }

    #[test]
    fn differences_are_those_of_the_definition() {
        // More rows than a band, and fewer columns than the window.
        for (width, height) in [(23, BAND + 9), (3, 5), (1, 1)] {
            let (a, b) = (plane(width, height, 1), plane(width, height, 2));
            let (found, expected) = (differences(&a, &b), plain(&a, &b));
            let pairs = [
                (found.structure_l1, expected.structure_l1),
                (found.structure_l4, expected.structure_l4),
                (found.artifacts_l4, expected.artifacts_l4),
                (found.lost_l4, expected.lost_l4),
            ];
            for (found, expected) in pairs {
                assert!((found - expected).abs() < 1e-4 * expected + 1e-6, "{found}, {expected}");
            }
            let none = differences(&a, &a);
            assert!(none.structure_l1 < 1e-5 && none.artifacts_l4 == 0.0 && none.lost_l4 == 0.0);
        }
    }
}
