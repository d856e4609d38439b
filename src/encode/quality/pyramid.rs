//! A picture as the eye takes it in: luma, red against green, and blue against luma, on several scales.

use fearless_simd::{Simd, f32x16, prelude::*};

use super::light::{BlockRow, COLUMNS, Channel, Samples, linear_row, responses};
use super::norms::{Measured, SCALES};
use crate::encode::rows::Group;

/// Rows that make one row on the coarsest scale.
pub(super) const ROWS: usize = 1 << (SCALES - 1);

/// The linear light of some columns of [`ROWS`] rows.
struct Block {
    planes: [[BlockRow; ROWS]; 3],
    columns: usize,
    rows: usize,
}

/// A picture over a background.
pub(super) struct Shown<'a, P> {
    pub(super) picture: &'a P,
    pub(super) size: [usize; 2],
    pub(super) background: f32,
}

/// Fills groups with rows of a picture, [`ROWS`] of them or as many as there are from the row `first`
/// on: one group for all that is measured. It is picture number `which` of the groups.
#[inline(always)]
pub(super) fn fill<S: Simd, P: Samples>(
    simd: S,
    shown: &Shown<'_, P>,
    first: usize,
    which: usize,
    measured: &[Measured],
    groups: &mut [Group],
) {
    let Shown { picture, size: [width, height], background } = *shown;
    let mut samples = [[0.0; COLUMNS]; 4];
    let mut block = Block { planes: [[[[0.0; 16]; COLUMNS / 16]; ROWS]; 3], columns: 0, rows: 0 };
    for x in (0..width).step_by(COLUMNS) {
        (block.columns, block.rows) = (COLUMNS.min(width - x), ROWS.min(height - first));
        for row in 0..block.rows {
            picture.read(x, first + row, &mut samples);
            let light = block.planes.each_mut().map(|plane| &mut plane[row]);
            linear_row(simd, picture.model(), &samples, background, light);
        }
        let mut at = 0;
        for scale in 0..SCALES {
            if scale > 0 {
                block.halve(simd);
            }
            let end = at + measured[at..].iter().take_while(|found| found.scale == scale).count();
            block.take(simd, x >> scale, which, &measured[at..end], &mut groups[at..end]);
            at = end;
        }
    }
}

impl Block {
    /// Writes the responses that are measured on its scale to groups, from a column on.
    #[inline(always)]
    fn take<S: Simd>(
        &self,
        simd: S,
        x: usize,
        which: usize,
        measured: &[Measured],
        groups: &mut [Group],
    ) {
        if measured.is_empty() {
            return;
        }
        let with_blue = measured.iter().any(|found| found.channel == Channel::Blue);
        let mut line = [[[0.0; 16]; COLUMNS / 16]; 3];
        for row in 0..self.rows {
            for at in 0..self.columns.div_ceil(16) {
                let [red, green, blue] = &self.planes;
                let light = [
                    f32x16::load_array_ref(simd, &red[row][at]),
                    f32x16::load_array_ref(simd, &green[row][at]),
                    f32x16::load_array_ref(simd, &blue[row][at]),
                ];
                let [opponent, luma, blue] = responses(simd, light, with_blue);
                opponent.store_array(&mut line[0][at]);
                luma.store_array(&mut line[1][at]);
                blue.store_array(&mut line[2][at]);
            }
            for (found, group) in measured.iter().zip(&mut *groups) {
                let part = group.part(which, row, x);
                let values = line[found.channel as usize].as_flattened();
                part[..self.columns].copy_from_slice(&values[..self.columns]);
            }
        }
    }

    /// Makes it half as wide and high; the last row and column of an odd number count twice.
    #[inline(always)]
    fn halve<S: Simd>(&mut self, simd: S) {
        let (columns, rows) = (self.columns, self.rows);
        (self.columns, self.rows) = (columns.div_ceil(2), rows.div_ceil(2));
        for plane in &mut self.planes {
            if columns % 2 == 1 {
                for row in &mut plane[..rows] {
                    row.as_flattened_mut()[columns] = row.as_flattened()[columns - 1];
                }
            }
            if rows % 2 == 1 {
                plane[rows] = plane[rows - 1];
            }
            for row in 0..self.rows {
                for at in 0..self.columns.div_ceil(16) {
                    let left = sum(simd, plane, row, 2 * at);
                    let right = sum(simd, plane, row, 2 * at + 1);
                    let (even, odd) = left.deinterleave(right);
                    ((even + odd) * 0.25).store_array(&mut plane[row][at]);
                }
            }
        }
    }
}

/// Sixteen columns of a pair of rows, added.
#[inline(always)]
fn sum<S: Simd>(simd: S, plane: &[BlockRow; ROWS], pair: usize, at: usize) -> f32x16<S> {
    f32x16::load_array_ref(simd, &plane[2 * pair][at])
        + f32x16::load_array_ref(simd, &plane[2 * pair + 1][at])
}

#[cfg(test)]
mod tests {
    use fearless_simd::dispatch;

    use super::*;
    use crate::color::ColorModel;
    use crate::encode::quality::light::plain_linear;
    use crate::encode::rows::{Border, Rows};
    use crate::encode::testing::source;
    use crate::testing::simd_levels;

    /// X, Y and B of all pixels of a picture at a 2^scale-th of the size, where `light` is linear.
    fn plain(light: &[[f64; 3]], [width, height]: [usize; 2], scale: usize) -> Vec<[f64; 3]> {
        if scale == 0 {
            let cones =
                [[0.3, 0.622, 0.078], [0.23, 0.692, 0.078], [0.243_423, 0.204_767, 0.551_81]];
            let responses = |light: &[f64; 3]| {
                let [long, medium, short] = cones.map(|shares| {
                    let taken: f64 =
                        shares.iter().zip(light).map(|(share, light)| share * light).sum();
                    (taken + 0.003_793_073).cbrt() - 0.003_793_073_f64.cbrt()
                });
                let luma = 0.5 * (long + medium);
                [7.0 * (long - medium) + 0.42, luma + 0.01, short - luma + 0.55]
            };
            return light.iter().map(responses).collect();
        }
        let half = [width, height].map(|side| side.div_ceil(2));
        let means = (0..half[1]).flat_map(|y| (0..half[0]).map(move |x| [x, y]));
        let means = means.map(|[x, y]| {
            let mut sum = [0.0; 3];
            for [dx, dy] in [[0, 0], [1, 0], [0, 1], [1, 1]] {
                let [x, y] = [(2 * x + dx).min(width - 1), (2 * y + dy).min(height - 1)];
                for (sum, light) in sum.iter_mut().zip(light[y * width + x]) {
                    *sum += 0.25 * light;
                }
            }
            sum
        });
        plain(&means.collect::<Vec<_>>(), half, scale - 1)
    }

    #[test]
    fn scales_are_those_of_the_definition() {
        for size in [[COLUMNS + 21, 13], [COLUMNS, ROWS], [1, 1], [9, 3], [2, 7]] {
            let mut rng = fastrand::Rng::with_seed(3);
            let samples: Vec<u8> = (0..size[0] * size[1] * 3).map(|_| rng.u8(..)).collect();
            let source = source(size, ColorModel::Rgb, &samples);
            let linear = |sample: u8| plain_linear(f64::from(sample) / 255.0);
            let [width, height] = size;
            let pixels = samples.chunks_exact(3);
            let light: Vec<[f64; 3]> =
                pixels.map(|pixel| [0, 1, 2].map(|channel| linear(pixel[channel]))).collect();
            let measured = Measured::of_large();
            for (name, level) in simd_levels() {
                let scaled = |scale: usize| [width, height].map(|side| side.div_ceil(1 << scale));
                let mut groups: Vec<Group> = measured
                    .iter()
                    .map(|found| {
                        Rows::new(scaled(found.scale), Border::Zeros, ROWS >> found.scale).blank()
                    })
                    .collect();
                let shown = Shown { picture: &source, size, background: 0.0 };
                dispatch!(level, simd => fill(simd, &shown, 0, 1, &measured, &mut groups));
                for (found, group) in measured.iter().zip(&mut groups) {
                    let [columns, rows] = scaled(found.scale);
                    let expected = plain(&light, [width, height], found.scale);
                    for y in 0..rows.min(ROWS >> found.scale) {
                        for (x, &value) in group.part(1, y, 0)[..columns].iter().enumerate() {
                            let expected = expected[y * columns + x][found.channel as usize];
                            let error = (f64::from(value) - expected).abs();
                            assert!(error < 1e-4, "{name} {found:?} {x} {y}: {value}, {expected}");
                        }
                    }
                }
            }
        }
    }
}
