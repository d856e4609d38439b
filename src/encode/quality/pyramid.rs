//! A picture as the eye takes it in: luma and blue, on several scales.

use fearless_simd::{Simd, f32x16, prelude::*};

use super::light::{BlockRow, COLUMNS, Samples, blue_minus_luma, linear_row, luma};
use super::rows::Group;

/// Luma at all of the size, a half, a quarter and an eighth of it, and blue minus luma at a 16th.
pub(super) const SCALES: usize = 5;
/// Rows that make one row on the coarsest scale.
pub(super) const ROWS: usize = 1 << (SCALES - 1);

/// The linear light of some columns of [`ROWS`] rows.
struct Block {
    planes: [[BlockRow; ROWS]; 3],
    columns: usize,
    rows: usize,
}

/// Fills groups with rows of a picture on all scales, from the row `first` of `rows` rows on. It is
/// picture number `which` of the groups.
#[inline(always)]
pub(super) fn fill<S: Simd>(
    simd: S,
    picture: &impl Samples,
    [width, rows]: [usize; 2],
    first: usize,
    which: usize,
    groups: &mut [Group; SCALES],
) {
    let mut samples = [[0.0; COLUMNS]; 4];
    let mut block = Block { planes: [[[[0.0; 16]; COLUMNS / 16]; ROWS]; 3], columns: 0, rows: 0 };
    for x in (0..width).step_by(COLUMNS) {
        (block.columns, block.rows) = (COLUMNS.min(width - x), rows);
        for row in 0..rows {
            picture.read(x, first + row, &mut samples);
            let light = block.planes.each_mut().map(|plane| &mut plane[row]);
            linear_row(simd, picture.model(), &samples, light);
        }
        for (scale, group) in groups.iter_mut().enumerate() {
            if scale > 0 {
                block.halve(simd);
            }
            for row in 0..block.rows {
                let responses = block.responses(simd, row, scale + 1 == SCALES);
                let part = group.part(which, row, x >> scale);
                part[..block.columns].copy_from_slice(&responses.as_flattened()[..block.columns]);
            }
        }
    }
}

impl Block {
    /// The responses of a row: of blue minus luma, or of luma.
    #[inline(always)]
    fn responses<S: Simd>(&self, simd: S, row: usize, is_blue: bool) -> BlockRow {
        let mut responses = [[0.0; 16]; COLUMNS / 16];
        for at in 0..self.columns.div_ceil(16) {
            let [red, green, blue] = &self.planes;
            let light = [
                f32x16::load_array_ref(simd, &red[row][at]),
                f32x16::load_array_ref(simd, &green[row][at]),
                f32x16::load_array_ref(simd, &blue[row][at]),
            ];
            let response = if is_blue { blue_minus_luma(simd, light) } else { luma(simd, light) };
            response.store_array(&mut responses[at]);
        }
        responses
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
    use crate::encode::quality::rows::Rows;
    use crate::encode::source::Source;
    use crate::testing::simd_levels;

    /// Luma, or blue minus luma, of all pixels of a gray picture at a 2^scale-th of the size, where
    /// `light` is linear.
    fn plain(light: &[f64], [width, height]: [usize; 2], scale: usize) -> Vec<f64> {
        if scale == 0 {
            return light.iter().map(|light| (light + 0.003_793_073).cbrt()).collect();
        }
        let half = [width, height].map(|side| side.div_ceil(2));
        let means = (0..half[1]).flat_map(|y| (0..half[0]).map(move |x| [x, y]));
        let means = means.map(|[x, y]| {
            let mut sum = 0.0;
            for [dx, dy] in [[0, 0], [1, 0], [0, 1], [1, 1]] {
                let [x, y] = [(2 * x + dx).min(width - 1), (2 * y + dy).min(height - 1)];
                sum += 0.25 * light[y * width + x];
            }
            sum
        });
        plain(&means.collect::<Vec<_>>(), half, scale - 1)
    }

    #[test]
    fn scales_are_those_of_the_definition() {
        for size in [[COLUMNS + 21, 13], [COLUMNS, ROWS], [1, 1], [9, 3]] {
            let mut rng = fastrand::Rng::with_seed(3);
            let samples: Vec<u8> = (0..size[0] * size[1]).map(|_| rng.u8(..)).collect();
            let source = Source::new_u8(size[0] as u32, size[1] as u32, ColorModel::Gray, &samples)
                .expect("the sizes agree");
            let light: Vec<f64> = samples
                .iter()
                .map(|&sample| {
                    let encoded = f64::from(sample) / 255.0;
                    if encoded <= 0.04045 {
                        encoded / 12.92
                    } else {
                        ((encoded + 0.055) / 1.055).powf(2.4)
                    }
                })
                .collect();
            for (name, level) in simd_levels() {
                let scaled = |scale: usize| size.map(|side| side.div_ceil(1 << scale));
                let mut rows: [Rows; SCALES] =
                    core::array::from_fn(|scale| Rows::new(scaled(scale), ROWS >> scale));
                let mut groups = rows.each_mut().map(Rows::blank);
                dispatch!(level, simd => fill(simd, &source, size, 0, 1, &mut groups));
                for (scale, group) in groups.iter_mut().enumerate() {
                    let [width, height] = scaled(scale);
                    let expected = plain(&light, size, scale);
                    for y in 0..height {
                        for (x, &found) in group.part(1, y, 0)[..width].iter().enumerate() {
                            let luma = expected[y * width + x];
                            // Gray has no blue that luma has not.
                            let expected = if scale + 1 < SCALES { luma } else { 0.0 };
                            let error = (f64::from(found) - expected).abs();
                            assert!(error < 5e-6, "{name} {scale} {x} {y}: {found}, {expected}");
                        }
                    }
                }
            }
        }
    }
}
