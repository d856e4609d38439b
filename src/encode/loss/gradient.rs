//! The distortion of a tile, and its gradient.
//!
//! The distortion is the sum over all pixels and scales of w ((1 - c) l^2 + c |r|^2), where r are the means
//! of the residuals of the colour channels over the pixel's block on the scale, l that of luma, w the
//! perceptual weight on the scale, and c the share of colour ([`COLOR`]). Blocks are whole: outside the
//! picture, residuals are 0. Residuals of alpha are not averaged. The distortion is quadratic in the
//! residuals.

use fearless_simd::{Simd, f32x4, f32x16, prelude::*};

use super::activity::BLOCK;
use super::error::Distortion;
use super::perceptual_weights::{BlockWeights, COLOR, PerceptualWeights};
use crate::encode::pairs::{doubled, doubled_half, doubled_quarter, folded, folded_half};
use crate::encode::sample_tile::{TilePlane, inside};

/// Replaces the residuals of a tile, of which the first pixel is (x, y), by half the gradient of its
/// distortion by them, and returns the distortion. `size` is the number of columns and rows inside
/// the picture; residuals outside are 0, and so are their gradients.
///
/// Loops are over indices, as in `fit/training_tile.rs`.
#[inline(always)]
pub(super) fn differentiate<S: Simd, const CHANNELS: usize>(
    simd: S,
    weights: &PerceptualWeights,
    [x, y]: [usize; 2],
    [columns, rows]: [usize; 2],
    planes: &mut [TilePlane; CHANNELS],
) -> Distortion {
    let (luma, colors) = (weights.luma, weights.colors);
    let zero = f32x16::splat(simd, 0.0);
    let inside = inside(simd, columns);
    let mut total = zero;
    for first in (0..rows).step_by(BLOCK) {
        let blocks = &weights.row((y + first) / BLOCK)[x / BLOCK..];
        let [fine, medium, coarse] =
            [by_block(simd, blocks, 0), by_block(simd, blocks, 1), by_block(simd, blocks, 2)];
        let fine_by_pair = doubled_quarter(fine);
        let medium_by_pair = doubled_quarter(medium);
        let flat = doubled_half(fine_by_pair + medium_by_pair + doubled_quarter(coarse));
        let fine = doubled_half(fine_by_pair);
        let medium = medium_by_pair.combine(medium_by_pair);
        let mut residuals = [[zero; BLOCK]; CHANNELS];
        let mut lines = [zero; BLOCK];
        for channel in 0..CHANNELS {
            for row in 0..BLOCK {
                let line = f32x16::load_array_ref(simd, &planes[channel][first + row]);
                residuals[channel][row] = line;
                lines[row] += line * luma[channel];
            }
        }
        let [medium_share, coarse_share] = [1.0 - COLOR[1], 1.0 - COLOR[2]];
        let of_luma = by_means(lines, medium * medium_share, coarse * coarse_share);
        // Half the gradient by luma.
        let mut by_luma = [zero; BLOCK];
        for row in 0..BLOCK {
            let by_pixel = fine * (1.0 - COLOR[0]) * lines[row];
            by_luma[row] = (of_luma[row / 2] + by_pixel) * inside;
        }
        let by_sample = fine * COLOR[0];
        for channel in 0..CHANNELS {
            let is_color = channel < colors;
            // All of the weight of alpha is that of its single pixels.
            let by_sample = if is_color { by_sample } else { flat };
            let mut by_mean = [zero; 2];
            if is_color {
                let [upper, lower] =
                    by_means(residuals[channel], medium * COLOR[1], coarse * COLOR[2]);
                by_mean = [upper * inside, lower * inside];
            }
            for row in 0..BLOCK.min(rows - first) {
                let residual = residuals[channel][row];
                let gradient =
                    by_sample * residual + by_mean[row / 2] + by_luma[row] * luma[channel];
                total += gradient * residual;
                gradient.store_array(&mut planes[channel][first + row]);
            }
        }
    }
    Distortion(total.to_array().iter().map(|&sum| f64::from(sum)).sum())
}

/// The weights of four blocks on a scale. Where there is no block, residuals are 0.
#[inline(always)]
fn by_block<S: Simd>(simd: S, blocks: &[BlockWeights], scale: usize) -> f32x4<S> {
    let last = blocks.len() - 1;
    f32x4::from_fn(simd, |block| blocks[block.min(last)][scale])
}

/// Half the gradient of the errors of means by the samples of the upper two and of the lower two lines of blocks.
/// `medium` has the weights of the means over 2 x 2 pixels, those of the upper lines in the low half;
/// `coarse` those of the means over 4 x 4 pixels.
#[inline(always)]
fn by_means<S: Simd>(
    lines: [f32x16<S>; BLOCK],
    medium: f32x16<S>,
    coarse: f32x4<S>,
) -> [f32x16<S>; 2] {
    let [first, second, third, fourth] = lines;
    let pairs = folded(first + second, third + fourth) * 0.25;
    let (upper, lower) = pairs.split();
    let whole = doubled_quarter(folded_half((upper + lower) * 0.25) * coarse);
    doubled(pairs * medium + whole.combine(whole))
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
    use fearless_simd::{Level, dispatch};

    use super::*;
    use crate::color::ColorModel;
    use crate::encode::progress::unobserved;
    use crate::encode::sample_tile::TILE_WIDTH;
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
                dispatch!(Level::new(), simd => {
                    distortion += differentiate(simd, &weights, [x, y], inside, &mut planes).0;
                });
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
