//! Perceptual weights: how much an error counts, by its place and its scale (activity masking).
//!
//! An error is hard to see where the picture itself varies. Measures of visible differences divide
//! the variance of the error by that of the picture, and do so on several scales: most of the weight
//! of SSIMULACRA2 lies on the structural similarity of luma at a quarter and an eighth of the size.
//! So a coarse error, which shifts the means of small blocks of pixels, counts more than a fine one,
//! and both count less in texture than on even ground.

use core::ops::Range;

use crate::encode::error::Result;
use crate::encode::progress::Observer;
use crate::encode::quality::Gradients;
use crate::encode::source::Source;

/// Scales on which errors count: single pixels, and means over 2 x 2 and 4 x 4 pixels.
pub(crate) const SCALES: usize = 3;
/// Side in pixels of the blocks that have weights, which is that of the coarsest scale.
pub(crate) const BLOCK: usize = 1 << (SCALES - 1);

/// The weights of a block for squared errors on each scale.
pub(crate) type BlockWeights = [f32; SCALES];

// Constants: docs/tuning.md, "What a person sees".
/// The mean weight on each scale; they add up to 1.
const BY_SCALE: [f64; SCALES] = [0.4, 0.35, 0.25];
/// The share of all colour channels in the errors on each scale; the rest is that of luma.
pub(super) const COLOR: [f32; SCALES] = [0.85, 0.1, 0.5];
/// The weight is the variance to the power of minus this.
const MASKING: f64 = 0.4;
/// What is added to a variance: the square of a few quantization steps of 8 bits.
const LEAST_VARIANCE: f64 = (4.0 / 255.0) * (4.0 / 255.0);
/// The variances are those in square boxes with these radii in pixels.
const RADII: [usize; 3] = [2, 5, 14];
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
        for (scale, share) in BY_SCALE.into_iter().enumerate() {
            let mut logarithms = vec![0.0; blocks.len()];
            let bands = logarithms.chunks_mut(columns * BAND).enumerate();
            observer.map(bands, |(band, blocks)| {
                let first = band * BAND;
                let end = first + blocks.len() / columns;
                let rows = first..end;
                for background in backgrounds {
                    let over = source.is_premultiplied().then_some(*background);
                    let luma = LumaBand::new(source, &shares[..colors], scale, rows.clone(), over);
                    luma.add_logarithms(first, blocks);
                }
                for block in blocks {
                    *block /= backgrounds.len() as f32;
                }
            })?;
            let (values, mean) = normalized(&logarithms);
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
        let [width, height] = source.size();
        let tasks = height.div_ceil(BAND * BLOCK).min(rayon::current_num_threads());
        let rows = (BAND * BLOCK + 2 * RADII[RADII.len() - 1]).min(height);
        let sums = tasks * (width + 1) * (rows + 1) * size_of::<[f64; 2]>();
        sums + self.blocks.len() * size_of::<f32>()
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

/// What a sample of a colour looks like, scaled to 16 bits.
fn seen(source: &Source<'_>, at: usize) -> f32 {
    let sample = f32::from(source.wide_sample(at));
    source.curve().map_or(sample, |curve| curve.at(sample / 65535.0) * 65535.0)
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
fn normalized(logarithms: &[f32]) -> (impl Iterator<Item = f64>, f64) {
    let count = logarithms.len() as f64;
    let middle = logarithms.iter().map(|&value| f64::from(value)).sum::<f64>() / count;
    let clamped =
        move |&value: &f32| (f64::from(value) - middle).clamp(-MOST.ln(), MOST.ln()).exp();
    let mean = logarithms.iter().map(clamped).sum::<f64>() / count;
    (logarithms.iter().map(move |value| clamped(value) / mean), mean * middle.exp())
}

/// A radius in pixels of a scale, rounded.
fn scaled(radius: usize, scale: usize) -> usize {
    ((radius + (1 << scale) / 2) >> scale).max(1)
}

/// Sums over the rectangles from the first row and column of a part of the picture's luma.
struct LumaBand {
    scale: usize,
    /// First row, and numbers of columns and rows, at this scale.
    first: usize,
    width: usize,
    height: usize,
    /// Sums of values and of squares, with a column and a row of zeros before.
    sums: Vec<[f64; 2]>,
}

impl LumaBand {
    /// The luma on a scale around some rows of blocks, of the colours as they are or over a background.
    fn new(
        source: &Source<'_>,
        shares: &[f32],
        scale: usize,
        Range { start: first, end }: Range<usize>,
        background: Option<f32>,
    ) -> Self {
        let side = 1 << scale;
        let most = scaled(RADII[RADII.len() - 1], scale);
        let size = source.size();
        let [width, height] = size.map(|length| length.div_ceil(side));
        let channels = source.color().channels();
        let first = (first * (BLOCK / side)).saturating_sub(most);
        let end = (end * (BLOCK / side) + most).min(height);
        let stride = width + 1;
        let mut sums = vec![[0.0; 2]; stride * (end - first + 1)];
        let mut line = vec![0.0; size[0]];
        let mut means = vec![0.0; width];
        for y in first..end {
            means.fill(0.0);
            let rows = y * side..((y + 1) * side).min(size[1]);
            let count = rows.len();
            for row in rows {
                for (x, value) in line.iter_mut().enumerate() {
                    let at = (row * size[0] + x) * channels;
                    let samples = (at..).zip(shares);
                    *value =
                        samples.map(|(at, share)| share * seen(source, at) / 65535.0).sum::<f32>();
                    if let Some(background) = background {
                        let alpha = source.wide_sample((row * size[0] + x + 1) * channels - 1);
                        let alpha = f32::from(alpha) / 65535.0;
                        *value = *value * alpha + background * (1.0 - alpha);
                    }
                }
                for (mean, part) in means.iter_mut().zip(line.chunks(side)) {
                    *mean += part.iter().sum::<f32>() / (part.len() * count) as f32;
                }
            }
            let (before, after) = sums.split_at_mut((y - first + 1) * stride);
            let before = &before[(y - first) * stride..];
            let mut sum = [0.0; 2];
            for (x, &mean) in means.iter().enumerate() {
                let value = f64::from(mean);
                sum = [sum[0] + value, sum[1] + value * value];
                after[x + 1] = [before[x + 1][0] + sum[0], before[x + 1][1] + sum[1]];
            }
        }
        Self { scale, first, width, height: end - first, sums }
    }

    /// Adds the logarithms of the weights of rows of blocks, of which the first has the index
    /// `first` in the picture: means over the values of a block on this scale.
    fn add_logarithms(&self, first: usize, blocks: &mut [f32]) {
        let side = BLOCK >> self.scale;
        let columns = self.width.div_ceil(side);
        for (index, block) in blocks.iter_mut().enumerate() {
            let (left, top) =
                (index % columns * side, (first + index / columns) * side - self.first);
            let (mut sum, mut count) = (0.0, 0.0);
            for y in top..(top + side).min(self.height) {
                for x in left..(left + side).min(self.width) {
                    let product: f64 =
                        RADII.map(|radius| self.variance(x, y, radius)).iter().product();
                    sum += product.ln();
                    count += 1.0;
                }
            }
            *block += (-MASKING / RADII.len() as f64 * sum / count) as f32;
        }
    }

    /// The variance in the box around a value, plus the least variance.
    fn variance(&self, x: usize, y: usize, radius: usize) -> f64 {
        let radius = scaled(radius, self.scale);
        let (left, right) = (x.saturating_sub(radius), (x + radius + 1).min(self.width));
        let (top, bottom) = (y.saturating_sub(radius), (y + radius + 1).min(self.height));
        let stride = self.width + 1;
        let corner = |x: usize, y: usize| self.sums[y * stride + x];
        let [a, b, c, d] =
            [corner(left, top), corner(right, top), corner(left, bottom), corner(right, bottom)];
        let [sum, squares] = [0, 1].map(|which| d[which] - b[which] - c[which] + a[which]);
        let count = ((right - left) * (bottom - top)) as f64;
        let mean = sum / count;
        (squares / count - mean * mean).max(0.0) + LEAST_VARIANCE
    }
}

#[cfg(test)]
mod tests {
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
