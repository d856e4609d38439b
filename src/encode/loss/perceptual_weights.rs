//! Perceptual weights: how much an error counts, by its place and its scale (activity masking).
//!
//! An error is hard to see where the picture itself varies. Measures of visible differences divide
//! the variance of the error by that of the picture, and do so on several scales: most of the weight
//! of SSIMULACRA2 lies on the structural similarity of luma at a quarter and an eighth of the size.
//! So a coarse error, which shifts the means of small blocks of pixels, counts more than a fine one,
//! and both count less in texture than on even ground.

use super::activity::{self, BLOCK, Luma, RADII, SCALES};
use crate::encode::error::Result;
use crate::encode::importance;
use crate::encode::progress::Observer;
use crate::encode::quality::Gradients;
use crate::encode::source::Source;

/// The weights of a block for squared errors on each scale.
pub(crate) type BlockWeights = [f32; SCALES];

// Constants: docs/tuning.md, "What a person sees".
/// The mean weight on each scale; they add up to 1.
const BY_SCALE: [f64; SCALES] = [0.4, 0.35, 0.25];
/// The share of all colour channels in the errors on each scale; the rest is that of luma.
pub(super) const COLOR: [f32; SCALES] = [0.85, 0.1, 0.5];
/// The weight is the variance to the power of minus this.
const MASKING: f64 = 0.4;
/// The largest and the least weight on a scale, as a factor on its geometric mean.
const MOST: f64 = 8.0;
/// How often an error counts in a gradient without noise, where people see blotches and bands that measures
/// of visible differences do not.
const IN_GRADIENT: f32 = 4.0;
/// Shares of the colour channels in luma, those of Y in SSIMULACRA2's colour space XYB, about.
const LUMA: [f32; 3] = [0.265, 0.657, 0.078];
/// Rows of blocks that one task computes.
const BAND: usize = 16;

/// The perceptual weights of a picture.
#[derive(Debug)]
pub(crate) struct PerceptualWeights {
    /// Blocks in a row.
    columns: usize,
    /// Row by row.
    blocks: Vec<BlockWeights>,
    /// The share of each channel in luma, 0 for alpha, scaled such that an error that is the same in
    /// all colour channels of all pixels of a block counts the same on every scale.
    pub(crate) luma: [f32; 4],
    /// Number of channels that are not alpha.
    pub(crate) colors: usize,
    /// The mean on each scale before normalization: the lower, the more texture there is.
    pub(crate) means: [f64; SCALES],
}

impl PerceptualWeights {
    pub(crate) fn new(source: &Source<'_>, observer: &mut Observer<'_>) -> Result<Self> {
        let model = source.color();
        let colors = model.channels() - usize::from(model.has_alpha());
        let shares = if colors == 1 { [1.0, 0.0, 0.0] } else { LUMA };
        let backgrounds = source.backgrounds();
        let [columns, rows] = source.size().map(|side| side.div_ceil(BLOCK));
        let mut blocks = vec![[0.0; SCALES]; columns * rows];
        let mut means = [0.0; SCALES];
        let mut logarithms = vec![[0.0; SCALES]; columns * rows];
        let bands = logarithms.chunks_mut(columns * BAND).enumerate();
        observer.map(bands, |(band, blocks)| {
            let first = band * BAND;
            let rows = first..first + blocks.len() / columns;
            for background in backgrounds {
                let background = source.is_premultiplied().then_some(*background);
                let luma = Luma { source, shares: &shares[..colors], background };
                activity::add_logarithms(&luma, rows.clone(), blocks);
            }
        })?;
        let power = -MASKING / (RADII.len() * backgrounds.len()) as f64;
        for (scale, share) in BY_SCALE.into_iter().enumerate() {
            let logarithms = logarithms.iter().map(|block| power * f64::from(block[scale]));
            let (values, mean) = normalized(logarithms);
            observer.poll()?;
            means[scale] = mean;
            for (block, value) in blocks.iter_mut().zip(values) {
                block[scale] = (share * value) as f32;
            }
        }
        let gradients = Gradients::new(source);
        stress(&mut blocks, columns, |x, y| if gradients.has(x, y) { IN_GRADIENT } else { 1.0 });
        if let Some(curve) = source.curve() {
            // Errors are of codes, and count by the square of what becomes of them.
            stress(&mut blocks, columns, |x, y| {
                curve.slope(code(source, &shares[..colors], [x, y])).powi(2)
            });
        }
        if let Some(importance_at) = source.importance() {
            let middle = |at: usize| (at as f32 + 0.5) * BLOCK as f32;
            let of_blocks = (0..columns * rows)
                .map(|at| importance_at([middle(at % columns), middle(at / columns)]));
            let of_blocks = importance::normalized(of_blocks.collect());
            stress(&mut blocks, columns, |x, y| of_blocks[y / BLOCK * columns + x / BLOCK]);
        }
        let [red, green, blue] = shares.map(|share| share * (colors as f32).sqrt());
        Ok(Self { columns, blocks, luma: [red, green, blue, 0.0], colors, means })
    }

    /// Those of a picture of some size of which this one is a copy, smaller by a factor.
    pub(super) fn enlarged(&self, size: [usize; 2], factor: usize) -> Self {
        let [columns, rows] = size.map(|side| side.div_ceil(BLOCK));
        let block = |at| self.row(at / columns / factor)[at % columns / factor];
        let blocks = (0..columns * rows).map(block).collect();
        Self { columns, blocks, ..*self }
    }

    /// A row of blocks.
    #[inline]
    pub(crate) fn row(&self, row: usize) -> &[BlockWeights] {
        &self.blocks[row * self.columns..][..self.columns]
    }

    /// The weight of an error of a pixel on all scales.
    #[inline]
    pub(crate) fn at(&self, x: usize, y: usize) -> f32 {
        self.row(y / BLOCK)[x / BLOCK].iter().sum()
    }

    /// Size in bytes.
    pub(crate) fn memory(&self) -> usize {
        size_of_val(&self.blocks[..])
    }

    /// Size in bytes of what else [`PerceptualWeights::new`] needs.
    pub(crate) fn scratch_memory(&self, source: &Source<'_>) -> usize {
        let [_, height] = source.size();
        let tasks = height.div_ceil(BAND * BLOCK).min(rayon::current_num_threads());
        tasks * activity::memory(source, BAND) + size_of_val(&self.blocks[..])
    }
}

/// Multiplies the weights of blocks by factors, given their first pixels, and scales all of them to the same mean as
/// before.
fn stress(blocks: &mut [BlockWeights], columns: usize, factor: impl Fn(usize, usize) -> f32) {
    let mut sum = 0.0;
    for (index, block) in blocks.iter_mut().enumerate() {
        let (x, y) = (index % columns * BLOCK, index / columns * BLOCK);
        let factor = factor(x, y);
        for value in block {
            *value *= factor;
            sum += f64::from(*value);
        }
    }
    let mean = (sum / blocks.len() as f64) as f32;
    blocks.iter_mut().flatten().for_each(|value| *value /= mean);
}

/// The mean luma of a block's codes, where a full sample is 1.
fn code(source: &Source<'_>, shares: &[f32], [x, y]: [usize; 2]) -> f32 {
    let ([width, height], channels) = (source.size(), source.color().channels());
    let (mut sum, mut count) = (0.0, 0.0);
    for row in y..(y + BLOCK).min(height) {
        for column in x..(x + BLOCK).min(width) {
            let samples = ((row * width + column) * channels..).zip(shares);
            sum +=
                samples.map(|(at, share)| share * f32::from(source.wide_sample(at))).sum::<f32>();
            count += 65535.0;
        }
    }
    sum / count
}

/// Weights from their logarithms, with a mean of 1, and their mean before.
fn normalized(logarithms: impl Iterator<Item = f64> + Clone) -> (impl Iterator<Item = f64>, f64) {
    let count = logarithms.clone().count() as f64;
    let middle = logarithms.clone().sum::<f64>() / count;
    let clamped = logarithms.map(|value| (value - middle).clamp(-MOST.ln(), MOST.ln()).exp());
    let values: Vec<f64> = clamped.collect();
    let mean = values.iter().sum::<f64>() / count;
    (values.into_iter().map(move |value| value / mean), mean * middle.exp())
}

#[cfg(test)]
mod tests {
    use super::super::activity::LEAST_VARIANCE;
    use super::*;
    use crate::color::ColorModel;
    use crate::encode::appearance::Curve;
    use crate::encode::progress::unobserved;
    use crate::encode::testing::{MODELS, source};

    /// The weights of a block before they are normalized, directly from the definition.
    fn plain(source: &Source<'_>, block: [usize; 2], scale: usize) -> f64 {
        let [width, height] = source.size();
        let side = 1 << scale;
        let luma = |x: usize, y: usize| {
            let at = (y * width + x) * 3;
            let samples = (at..at + 3).zip(LUMA);
            samples
                .map(|(at, share)| f64::from(source.wide_sample(at)) / 65535.0 * f64::from(share))
                .sum::<f64>()
        };
        let mean = |values: &[f64]| values.iter().sum::<f64>() / values.len() as f64;
        let value = |x: usize, y: usize| {
            let rows = y * side..((y + 1) * side).min(height);
            let columns = x * side..((x + 1) * side).min(width);
            mean(&rows.flat_map(|y| columns.clone().map(move |x| luma(x, y))).collect::<Vec<_>>())
        };
        let size = [width.div_ceil(side), height.div_ceil(side)];
        let around = |at: usize, radius: usize, length: usize| {
            at.saturating_sub(radius)..(at + radius + 1).min(length)
        };
        let mut logarithms = Vec::new();
        let per_block = BLOCK / side;
        for y in block[1] * per_block..((block[1] + 1) * per_block).min(size[1]) {
            for x in block[0] * per_block..((block[0] + 1) * per_block).min(size[0]) {
                for radius in RADII {
                    let radius = (radius as f64 / side as f64).round() as usize;
                    let rows = around(y, radius, size[1]);
                    let columns = around(x, radius, size[0]);
                    let values: Vec<f64> =
                        rows.flat_map(|y| columns.clone().map(move |x| value(x, y))).collect();
                    let squares: Vec<f64> = values.iter().map(|value| value * value).collect();
                    let variance = mean(&squares) - mean(&values).powi(2);
                    logarithms.push((variance + LEAST_VARIANCE).ln());
                }
            }
        }
        (-MASKING * mean(&logarithms)).exp()
    }

    /// Columns of noise of 8 strengths, from none to all of the range.
    fn noise(width: usize, height: usize) -> Vec<u8> {
        let mut rng = fastrand::Rng::with_seed(4);
        let pixels = (0..height).flat_map(|_| 0..width);
        pixels
            .flat_map(|x| {
                let reach = [0, 1, 3, 7, 15, 31, 63, 127][x * 8 / width];
                [(); 3].map(|()| 128 - reach + rng.u8(0..=2 * reach))
            })
            .collect()
    }

    #[test]
    fn weights_are_those_of_the_definition() {
        // Several bands, the last one of less than a block.
        let (width, height) = (43, 4 * 2 * BAND + 6);
        let samples = noise(width, height);
        let source = source([width, height], ColorModel::Rgb, &samples);
        let weights = unobserved(|observer| PerceptualWeights::new(&source, observer));
        let rows = height.div_ceil(BLOCK);
        for scale in 0..SCALES {
            let found: Vec<f64> = (0..rows)
                .flat_map(|row| weights.row(row).iter().map(|block| f64::from(block[scale])))
                .collect();
            let mean = found.iter().sum::<f64>() / found.len() as f64;
            assert!((mean - BY_SCALE[scale]).abs() < 1e-5, "scale {scale}: {mean}");
            let blocks = (0..found.len()).map(|at| {
                let columns = width.div_ceil(BLOCK);
                plain(&source, [at % columns, at / columns], scale)
            });
            let expected: Vec<f64> = blocks.collect();
            let geometric_mean = |values: &[f64]| {
                (values.iter().map(|value| value.ln()).sum::<f64>() / values.len() as f64).exp()
            };
            let mean = geometric_mean(&expected);
            let expected: Vec<f64> =
                expected.iter().map(|value| (value / mean).clamp(1.0 / MOST, MOST)).collect();
            let factor = expected.iter().sum::<f64>() / expected.len() as f64;
            for (at, (found, expected)) in found.iter().zip(expected).enumerate() {
                let expected = expected / factor * BY_SCALE[scale];
                assert!(
                    (found / expected - 1.0).abs() < 1e-3,
                    "scale {scale}, block {at}: {found}, {expected}"
                );
            }
        }
    }

    #[test]
    fn errors_on_even_ground_count_more_than_in_texture() {
        let samples = noise(64, 64);
        let source = source([64, 64], ColorModel::Rgb, &samples);
        let weights = unobserved(|observer| PerceptualWeights::new(&source, observer));
        let across: Vec<f32> = (4..64).step_by(8).map(|x| weights.at(x, 32)).collect();
        assert!(across.is_sorted_by(|a, b| a > b), "{across:?}");
    }

    #[test]
    fn every_model_and_size_has_weights() {
        for model in MODELS {
            for [width, height] in [[1, 1], [1, 70], [2, 3], [17, 9]] {
                let samples = vec![200; width * height * model.channels()];
                let source = source([width, height], model, &samples);
                let weights = unobserved(|observer| PerceptualWeights::new(&source, observer));
                // Errors count the same everywhere in an even picture.
                let found = weights.at(width - 1, height - 1);
                assert!((found - 1.0).abs() < 1e-5, "{model:?}, {width}x{height}: {found}");
                let squares = weights.luma.iter().sum::<f32>().powi(2);
                assert!((squares - weights.colors as f32).abs() < 1e-5, "{model:?}");
            }
        }
    }

    #[test]
    fn weights_of_pq_are_those_of_what_it_looks_like() {
        let (width, height) = (64, 32);
        let samples = noise(width, height);
        let curve = Curve::of_pq();
        let codes: Vec<u16> = (samples.iter())
            .map(|&sample| (curve.code(f32::from(sample) / 255.0) * 65535.0).round() as u16)
            .collect();
        let plain = source([width, height], ColorModel::Rgb, &samples);
        let pq = Source::new_u16(width as u32, height as u32, ColorModel::Rgb, &codes);
        let pq = pq.expect("the sizes agree").seen_by(Some(curve));
        let [plain_weights, weights] = [plain, pq]
            .map(|source| unobserved(|observer| PerceptualWeights::new(&source, observer)));
        for (found, expected) in weights.means.iter().zip(plain_weights.means) {
            assert!((found / expected - 1.0).abs() < 1e-3, "{found}, {expected}");
        }
        // Those of codes also count the slope of the curve.
        let ratio = |x: usize, y| {
            let slope = curve.slope(code(&pq, &LUMA, [x, y]));
            weights.at(x, y) / plain_weights.at(x, y) / slope.powi(2)
        };
        for (x, y) in [(4, 0), (60, 20), (32, 28)] {
            assert!((ratio(x, y) / ratio(0, 0) - 1.0).abs() < 1e-3, "{x} {y}");
        }
    }
}
