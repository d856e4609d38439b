//! The distortion of a tile, and its gradient.
//!
//! The distortion is the sum over all pixels and scales of w ((1 - c) l^2 + c |r|^2), where r are the means
//! of the residuals of the colour channels over the pixel's block on the scale, l that of luma, w the
//! perceptual weight on the scale, and c the share of colour ([`COLOR`]). Blocks are whole: outside the
//! picture, residuals are 0. Residuals of alpha are not averaged. The distortion is quadratic in the
//! residuals.

use super::activity::{BLOCK, SCALES};
use super::error::Distortion;
use super::perceptual_weights::{COLOR, PerceptualWeights};
use crate::encode::sample_tile::{TILE_WIDTH, TilePlane};

/// Replaces the residuals of a tile, of which the first pixel is (x, y), by half the gradient of its
/// distortion by them, and returns the distortion. `size` is the number of columns and rows inside
/// the picture; residuals outside are 0, and so are their gradients.
///
/// The compiler turns the loops into code of the SIMD level that the caller is dispatched to. They are
/// over indices, as in `fit/training_tile.rs`.
#[inline(always)]
#[expect(clippy::needless_range_loop, reason = "see above")]
pub(super) fn differentiate<const CHANNELS: usize>(
    weights: &PerceptualWeights,
    [x, y]: [usize; 2],
    [columns, rows]: [usize; 2],
    planes: &mut [TilePlane; CHANNELS],
) -> Distortion {
    let (luma, colors) = (weights.luma, weights.colors);
    let mut inside = [0.0; TILE_WIDTH];
    for x in 0..TILE_WIDTH {
        inside[x] = if x < columns { 1.0 } else { 0.0 };
    }
    let mut total = [0.0; TILE_WIDTH];
    for first in (0..rows).step_by(BLOCK) {
        let blocks = &weights.row((y + first) / BLOCK)[x / BLOCK..];
        let mut by_scale = [[0.0; TILE_WIDTH]; SCALES];
        for x in 0..TILE_WIDTH {
            // Where there is no block, residuals are 0.
            let block = blocks[(x / BLOCK).min(blocks.len() - 1)];
            for scale in 0..SCALES {
                by_scale[scale][x] = block[scale];
            }
        }
        let [fine, medium, coarse] = by_scale;
        let mut lines = [[0.0; TILE_WIDTH]; BLOCK];
        for channel in 0..CHANNELS {
            for row in 0..BLOCK {
                for x in 0..TILE_WIDTH {
                    lines[row][x] += luma[channel] * planes[channel][first + row][x];
                }
            }
        }
        // Half the gradient by luma.
        let mut by_luma = [[0.0; TILE_WIDTH]; BLOCK];
        let (pairs, whole) = block_means(&lines);
        for row in 0..BLOCK {
            for x in 0..TILE_WIDTH {
                let by_means = coarse[x] * (1.0 - COLOR[2]) * whole[x]
                    + medium[x] * (1.0 - COLOR[1]) * pairs[row / 2][x];
                let by_pixel = fine[x] * (1.0 - COLOR[0]) * lines[row][x];
                by_luma[row][x] = (by_means + by_pixel) * inside[x];
            }
        }
        let (mut by_sample, mut flat) = ([0.0; TILE_WIDTH], [0.0; TILE_WIDTH]);
        for x in 0..TILE_WIDTH {
            by_sample[x] = fine[x] * COLOR[0];
            flat[x] = fine[x] + medium[x] + coarse[x];
        }
        for channel in 0..CHANNELS {
            let is_color = channel < colors;
            // All of the weight of alpha is that of its single pixels.
            let by_sample = if is_color { &by_sample } else { &flat };
            let mut by_mean = [[0.0; TILE_WIDTH]; 2];
            if is_color {
                lines.copy_from_slice(&planes[channel][first..first + BLOCK]);
                let (pairs, whole) = block_means(&lines);
                for pair in 0..2 {
                    for x in 0..TILE_WIDTH {
                        let by_means =
                            coarse[x] * COLOR[2] * whole[x] + medium[x] * COLOR[1] * pairs[pair][x];
                        by_mean[pair][x] = by_means * inside[x];
                    }
                }
            }
            for row in 0..BLOCK.min(rows - first) {
                let residuals = &mut planes[channel][first + row];
                for x in 0..TILE_WIDTH {
                    let gradient = by_sample[x] * residuals[x]
                        + by_mean[row / 2][x]
                        + luma[channel] * by_luma[row][x];
                    total[x] += gradient * residuals[x];
                    residuals[x] = gradient;
                }
            }
        }
    }
    Distortion(total.iter().map(|&sum| f64::from(sum)).sum())
}

/// The means over 2 x 2 pixels, of both pairs of rows, and over 4 x 4 pixels, in every column of their blocks.
#[inline(always)]
fn block_means(lines: &[[f32; TILE_WIDTH]; BLOCK]) -> ([[f32; TILE_WIDTH]; 2], [f32; TILE_WIDTH]) {
    let (mut pairs, mut whole) = ([[0.0; TILE_WIDTH]; 2], [0.0; TILE_WIDTH]);
    let (mut half, mut sums) = ([0.0; TILE_WIDTH], [0.0; TILE_WIDTH]);
    for pair in 0..2 {
        for x in 0..TILE_WIDTH {
            sums[x] = lines[2 * pair][x] + lines[2 * pair + 1][x];
        }
        for x in 0..TILE_WIDTH {
            pairs[pair][x] = 0.25 * (sums[x] + sums[x ^ 1]);
        }
    }
    for x in 0..TILE_WIDTH {
        half[x] = 0.25 * (pairs[0][x] + pairs[1][x]);
    }
    for x in 0..TILE_WIDTH {
        whole[x] = half[x] + half[x ^ 2];
    }
    (pairs, whole)
}

/// The distortion of a picture's residuals, in interleaved order, directly from its definition.
#[cfg(test)]
pub(crate) fn plain_distortion(
    weights: &PerceptualWeights,
    [width, height]: [usize; 2],
    residuals: &[f64],
) -> f64 {
    let channels = residuals.len() / (width * height);
    let at = |x: usize, y: usize| (y * width + x) * channels;
    let mut distortion = 0.0;
    for y in 0..height.next_multiple_of(BLOCK) {
        for x in 0..width.next_multiple_of(BLOCK) {
            let by_scale = weights.row(y / BLOCK)[x / BLOCK].map(f64::from);
            if x < width && y < height {
                let alpha = &residuals[at(x, y)..][weights.colors..channels];
                let squares: f64 = alpha.iter().map(|residual| residual * residual).sum();
                distortion += by_scale.iter().sum::<f64>() * squares;
            }
            for (scale, weight) in by_scale.into_iter().enumerate() {
                let side = 1 << scale;
                let mut means = [0.0; 3];
                for y in (y / side * side..height).take(side) {
                    for x in (x / side * side..width).take(side) {
                        let pixel = &residuals[at(x, y)..][..weights.colors];
                        for (mean, residual) in means.iter_mut().zip(pixel) {
                            *mean += residual / (side * side) as f64;
                        }
                    }
                }
                let shares = weights.luma.map(f64::from);
                let luma: f64 = means.iter().zip(shares).map(|(mean, share)| mean * share).sum();
                let squares: f64 = means.iter().map(|mean| mean * mean).sum();
                let color = f64::from(COLOR[scale]);
                distortion += weight * ((1.0 - color) * luma * luma + color * squares);
            }
        }
    }
    distortion
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::color::ColorModel;
    use crate::encode::progress::unobserved;
    use crate::encode::testing::source;
    use crate::render::tile_grid::TILE_HEIGHT;

    /// Residuals in the tile whose first pixel is `corner`.
    fn tile<const CHANNELS: usize>(
        residuals: &[f64],
        [width, height]: [usize; 2],
        corner: [usize; 2],
    ) -> [TilePlane; CHANNELS] {
        let mut planes = [[[0.0; TILE_WIDTH]; TILE_HEIGHT]; CHANNELS];
        for (y, row) in (corner[1]..height).take(TILE_HEIGHT).enumerate() {
            for (x, column) in (corner[0]..width).take(TILE_WIDTH).enumerate() {
                for (channel, plane) in planes.iter_mut().enumerate() {
                    plane[y][x] = residuals[(row * width + column) * CHANNELS + channel] as f32;
                }
            }
        }
        planes
    }

    fn check<const CHANNELS: usize>(model: ColorModel) {
        let size = [TILE_WIDTH + 7, TILE_HEIGHT + 5];
        let [width, height] = size;
        let mut rng = fastrand::Rng::with_seed(CHANNELS as u64);
        let samples: Vec<u8> = (0..width * height * CHANNELS).map(|_| rng.u8(..)).collect();
        let source = source(size, model, &samples);
        let weights = unobserved(|observer| PerceptualWeights::new(&source, observer));
        let mut residuals: Vec<f64> = samples.iter().map(|_| rng.f64() - 0.4).collect();

        let mut distortion = 0.0;
        let mut found = vec![0.0; residuals.len()];
        for y in (0..height).step_by(TILE_HEIGHT) {
            for x in (0..width).step_by(TILE_WIDTH) {
                let inside = [(width - x).min(TILE_WIDTH), (height - y).min(TILE_HEIGHT)];
                let mut planes = tile::<CHANNELS>(&residuals, size, [x, y]);
                distortion += differentiate(&weights, [x, y], inside, &mut planes).0;
                for (channel, plane) in planes.iter().enumerate() {
                    for (row, line) in plane.iter().enumerate() {
                        for (column, &gradient) in line.iter().enumerate() {
                            if row < inside[1] && column < inside[0] {
                                let at = (y + row) * width + x + column;
                                found[at * CHANNELS + channel] = f64::from(gradient);
                            } else {
                                assert_eq!(gradient, 0.0, "outside the picture");
                            }
                        }
                    }
                }
            }
        }
        let expected = plain_distortion(&weights, size, &residuals);
        assert!((distortion / expected - 1.0).abs() < 1e-5, "{model:?}: {distortion}, {expected}");
        for at in 0..residuals.len() {
            let here = residuals[at];
            let mut with = |residual: f64| {
                residuals[at] = residual;
                plain_distortion(&weights, size, &residuals)
            };
            // The distortion is quadratic, so that the difference quotient is exact.
            let half = (with(here + 0.1) - with(here - 0.1)) / 0.4;
            with(here);
            assert!((found[at] - half).abs() < 1e-4, "{model:?} {at}: {}, {half}", found[at]);
        }
    }

    #[test]
    fn distortion_and_gradient_are_those_of_the_definition() {
        check::<1>(ColorModel::Gray);
        check::<2>(ColorModel::GrayAlpha);
        check::<3>(ColorModel::Rgb);
        check::<4>(ColorModel::Rgba);
    }
}
