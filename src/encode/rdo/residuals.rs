//! The residuals of a rendering at every sample, and their change when Gaussians are added or
//! removed.

use core::ops::Range;

use fearless_simd::{Level, Simd, dispatch, f32x16, i16x16, prelude::*};
use rayon::prelude::*;

use super::kernel_weights::{KernelWeights, Lanes};
use crate::color::with_channels;
use crate::encode::error::Result;
use crate::encode::loss::{BLOCK, ColorCurvature, PictureLoss, residual};
use crate::encode::mul_add::MulAdd;
use crate::encode::progress::Observer;
use crate::encode::sample_tile::{FULL_SCALE, SampleLine, TILE_WIDTH};
use crate::encode::tiled_source::TiledSource;
use crate::gaussian::Gaussian;
use crate::kernel::QUARTIC_RADIUS;
use crate::render::simd_kernel::{larger, smaller};
use crate::render::tile_grid::TILE_HEIGHT;
use crate::simd::LANES;

/// Threads share a window of more pixels.
const MOST_OF_ONE_TASK: usize = 1 << 13;
/// Rows of such a window that one task goes through.
pub(super) const ROWS_PER_TASK: usize = 32;
// Constants: docs/tuning.md, "Not measured".
/// The margin of a window around its Gaussian, for candidates that are larger or elsewhere: a
/// factor on the extent, and pixels.
const MARGIN: (f32, f32) = (1.2, 1.0);

/// A residual of 1, where a full sample is 1, as it is stored.
const UNIT: f32 = 4096.0;
/// The largest residual that is stored.
const MOST: f32 = i16::MAX as f32 / UNIT;
/// Added to a float of less than 2^22, it leaves the rounded float in the lowest bits.
const ROUNDER: f32 = (3 << 22) as f32;

/// Sixteen residuals as they are stored.
pub(crate) type StoredLanes = [i16; LANES];

/// The residuals of a picture, rendering minus source, and how much their squares count.
///
/// The rendering is clamped as in the output: where the source is black, a rendering below black is no
/// error, nor one above white where the source is white. Changes of the rendering are not clamped: they
/// count as errors there, although the output would hide them, so the descent avoids them.
///
/// What the descent minimizes, the *error*, is as simple as a sum of squared residuals, each times the
/// perceptual weight of its pixel. The distortion counts the means of blocks too: [`Residuals::shift`] moves
/// the residuals such that, times their perceptual weights, they are half of its gradient. What a colour that
/// is added changes of it is the [`ColorCurvature`] times the colour.
#[derive(Debug)]
pub(crate) struct Residuals {
    width: usize,
    height: usize,
    channels: usize,
    /// In units of 1 / [`UNIT`], row by row, and in each row channel by channel; every line is padded
    /// such that a vector from any pixel on is inside.
    residuals: Vec<i16>,
    /// The perceptual weights of pixels, padded by 0 as `residuals`: one line for each row of blocks, or a
    /// single one where all rows are the same.
    perceptual_weights: Vec<f32>,
    curvature: ColorCurvature,
    stride: usize,
    level: Level,
}

impl Residuals {
    /// Residuals of 0, until [`Residuals::set`] sets them.
    pub(crate) fn new(tiled: &TiledSource, observer: &mut Observer<'_>) -> Result<Self> {
        let (width, height, channels) = (tiled.width, tiled.height, tiled.channels);
        let stride = width + LANES;
        let mut perceptual_weights = vec![0.0; stride * weight_lines(tiled)];
        let lines = perceptual_weights.chunks_exact_mut(stride).enumerate();
        observer.map(lines, |(row, line)| {
            for (x, value) in line[..width].iter_mut().enumerate() {
                *value = tiled.loss.weight_at(x, row * BLOCK);
            }
        })?;
        let residuals = vec![0; stride * height * channels];
        let level = Level::new();
        let curvature = tiled.loss.color_curvature();
        Ok(Self {
            width,
            height,
            channels,
            residuals,
            perceptual_weights,
            curvature,
            stride,
            level,
        })
    }

    /// Sets the residuals of the rows from `first` on, from a rendering of them, plane after plane.
    pub(crate) fn set(&mut self, tiled: &TiledSource, first: usize, rendering: &[f32]) {
        let (width, channels, level) = (self.width, self.channels, self.level);
        let rows = rendering.len() / (width * channels);
        let lines = self.residuals.par_chunks_mut(self.stride).skip(first * channels);
        lines.take(rows * channels).enumerate().for_each(|(line, residuals)| {
            let (row, channel) = (line / channels, line % channels);
            let rendered = &rendering[(channel * rows + row) * width..][..width];
            let samples = tiled.line(first + row, channel);
            for ((values, samples), residuals) in
                rendered.chunks(TILE_WIDTH).zip(samples).zip(residuals.chunks_mut(LANES))
            {
                dispatch!(level, simd => set(simd, values, samples, residuals));
            }
        });
    }

    /// Moves every residual such that, times its perceptual weight, it is half the gradient of the
    /// distortion.
    pub(crate) fn shift(&mut self, loss: &PictureLoss, observer: &mut Observer<'_>) -> Result<()> {
        if loss.weights().is_none() {
            return Ok(());
        }
        with_channels!(CHANNELS = self.channels, self.shift_of::<CHANNELS>(loss, observer))
    }

    #[expect(clippy::needless_range_loop, reason = "see `encode/fit/training_tile.rs`")]
    fn shift_of<const CHANNELS: usize>(
        &mut self,
        loss: &PictureLoss,
        observer: &mut Observer<'_>,
    ) -> Result<()> {
        let (level, stride, width) = (self.level, self.stride, self.width);
        let band = TILE_HEIGHT * CHANNELS * stride;
        let perceptual_weights = self.perceptual_weights.chunks(TILE_HEIGHT / BLOCK * stride);
        let bands = self.residuals.chunks_mut(band).zip(perceptual_weights).enumerate();
        observer.map(bands, |(row, (residuals, by_pixel))| {
            let rows = residuals.len() / (CHANNELS * stride);
            for x in (0..width).step_by(TILE_WIDTH) {
                let columns = TILE_WIDTH.min(width - x);
                let corner = [x, row * TILE_HEIGHT];
                let mut planes = [[[0.0; TILE_WIDTH]; TILE_HEIGHT]; CHANNELS];
                dispatch!(level, simd => {
                    for channel in 0..CHANNELS {
                        for y in 0..rows {
                            let at = (y * CHANNELS + channel) * stride + x;
                            load(simd, &residuals[at..]).store_array(&mut planes[channel][y]);
                            planes[channel][y][columns..].fill(0.0);
                        }
                    }
                    loss.differentiate(simd, corner, [columns, rows], &mut planes);
                    for channel in 0..CHANNELS {
                        for y in 0..rows {
                            let at = (y * CHANNELS + channel) * stride + x;
                            let by_pixel = vector(&by_pixel[y / BLOCK * stride + x..]);
                            let gradients = f32x16::load_array_ref(simd, &planes[channel][y]);
                            let by_pixel = f32x16::load_array_ref(simd, by_pixel);
                            store(simd, gradients / by_pixel, &mut residuals[at..]);
                        }
                    }
                });
            }
        })?;
        Ok(())
    }

    /// Size in bytes of the residuals of a source.
    pub(crate) fn memory(tiled: &TiledSource) -> usize {
        let by_column = tiled.height * tiled.channels * size_of::<i16>();
        let perceptual_weights = weight_lines(tiled) * size_of::<f32>();
        (tiled.width + LANES) * (by_column + perceptual_weights)
    }

    /// Width and height of the picture.
    pub(crate) fn size(&self) -> [usize; 2] {
        [self.width, self.height]
    }

    /// All rows in bands: `first` ones, and then `height` at a time.
    pub(crate) fn bands(&mut self, first: usize, height: usize) -> impl Iterator<Item = Band<'_>> {
        let (size, channels, stride, level) = (self.size(), self.channels, self.stride, self.level);
        let (perceptual_weights, curvature) = (&self.perceptual_weights[..], &self.curvature);
        let line = channels * stride;
        let (start, rest) = self.residuals.split_at_mut(first.min(size[1]) * line);
        let mut row = 0;
        core::iter::once(start).chain(rest.chunks_mut(height * line)).map(move |residuals| {
            let rows = row..row + residuals.len() / line;
            row = rows.end;
            Band { size, channels, stride, level, rows, residuals, perceptual_weights, curvature }
        })
    }

    /// All rows in one band.
    pub(crate) fn whole(&mut self) -> Band<'_> {
        let height = self.height;
        self.bands(height, height).next().expect("a picture has rows")
    }
}

/// Some rows of the residuals, which can be changed independently of the others.
#[derive(Debug)]
pub(crate) struct Band<'a> {
    /// Width and height of the picture.
    size: [usize; 2],
    channels: usize,
    stride: usize,
    level: Level,
    rows: Range<usize>,
    residuals: &'a mut [i16],
    perceptual_weights: &'a [f32],
    curvature: &'a ColorCurvature,
}

impl Band<'_> {
    /// The columns and rows of the window of a Gaussian ([`window`]), whether the band has them or not.
    pub(crate) fn window(&self, gaussian: &Gaussian) -> Option<[Range<usize>; 2]> {
        window(gaussian, self.size)
    }

    pub(crate) fn rows(&self) -> Range<usize> {
        self.rows.clone()
    }

    pub(crate) fn channels(&self) -> usize {
        self.channels
    }

    pub(crate) fn level(&self) -> Level {
        self.level
    }

    /// How the error curves with the colour of a Gaussian.
    pub(crate) fn curvature(&self) -> &ColorCurvature {
        self.curvature
    }

    /// Adds a Gaussian times a factor to the rendering in some of the band's rows.
    pub(crate) fn add(&mut self, gaussian: &Gaussian, factor: f32, within: Range<usize>) {
        let Some([columns, rows]) = self.window(gaussian) else { return };
        let first = rows.start.max(within.start).max(self.rows.start);
        let end = rows.end.min(within.end).min(self.rows.end);
        if first >= end {
            return;
        }
        let (level, stride, line) = (self.level, self.stride, self.channels * self.stride);
        let color = self.curvature.times(gaussian.color).map(|color| color * factor);
        let color = &color[..self.channels];
        let weights = KernelWeights::new(gaussian);
        let residuals = &mut self.residuals[(first - self.rows.start) * line..];
        let residuals = &mut residuals[..(end - first) * line];
        let draw = |first: usize, residuals: &mut [i16]| {
            dispatch!(level, simd => draw(simd, &weights, color, &columns, first, residuals, stride));
        };
        if is_shared(columns.len() * rows.len()) {
            let tasks = residuals.par_chunks_mut(ROWS_PER_TASK * line).enumerate();
            tasks.for_each(|(task, residuals)| draw(first + task * ROWS_PER_TASK, residuals));
        } else {
            draw(first, residuals);
        }
    }

    #[inline(always)]
    fn place(&self, x: usize, y: usize, channel: usize) -> usize {
        ((y - self.rows.start) * self.channels + channel) * self.stride + x
    }

    /// The residuals of the sixteen pixels from (x, y) on, of which the first is inside the picture.
    #[inline(always)]
    pub(crate) fn vector<S: Simd>(&self, simd: S, x: usize, y: usize, channel: usize) -> f32x16<S> {
        load(simd, &self.residuals[self.place(x, y, channel)..])
    }

    /// The perceptual weights of these pixels; 0 outside the picture.
    #[inline(always)]
    pub(crate) fn perceptual_weights(&self, x: usize, y: usize) -> &Lanes {
        let is_single = self.perceptual_weights.len() == self.stride;
        let line = if is_single { 0 } else { y / BLOCK };
        vector(&self.perceptual_weights[line * self.stride + x..])
    }
}

/// Adds weights times a colour to rows from `first` on.
#[inline(always)]
fn draw<S: Simd>(
    simd: S,
    weights: &KernelWeights,
    color: &[f32],
    columns: &Range<usize>,
    first: usize,
    residuals: &mut [i16],
    stride: usize,
) {
    let vectors = columns.len().div_ceil(LANES);
    for (y, row) in (first..).zip(residuals.chunks_exact_mut(color.len() * stride)) {
        for vector in weights.span(columns.start, y, vectors) {
            let x = columns.start + vector * LANES;
            let weight = weights.at(simd, x, y);
            for (channel, &color) in color.iter().enumerate() {
                // The last vector may reach into the padding.
                let residuals = &mut row[channel * stride + x..];
                let changed = weight.fused_mul_add(color, load(simd, residuals));
                store(simd, changed, residuals);
            }
        }
    }
}

/// Number of different lines of perceptual weights.
fn weight_lines(tiled: &TiledSource) -> usize {
    tiled.loss.weights().map_or(1, |_| tiled.height.div_ceil(BLOCK))
}

/// The columns and rows of the window of a Gaussian in a picture of a width and height: the bounding box
/// of where it is visible, with a margin. `None` if that is outside the picture.
pub(super) fn window(gaussian: &Gaussian, size: [usize; 2]) -> Option<[Range<usize>; 2]> {
    let [l11, l21, l22] = gaussian.cholesky;
    let extents = [l11, (l21 * l21 + l22 * l22).sqrt()];
    let mut window = [0..0, 0..0];
    for (axis, length) in size.into_iter().enumerate() {
        let reach = QUARTIC_RADIUS * (MARGIN.0 * extents[axis]) + MARGIN.1;
        // Casts saturate.
        let first = (gaussian.center[axis] - reach - 0.5).ceil().max(0.0) as usize;
        let end = (gaussian.center[axis] + reach + 0.5).floor().max(0.0) as usize;
        window[axis] = first..end.min(length);
        if window[axis].is_empty() {
            return None;
        }
    }
    Some(window)
}

/// Whether a Gaussian, or one that is hardly larger, shows in a picture of a width and height.
pub(crate) fn is_seen(gaussian: &Gaussian, size: [u32; 2]) -> bool {
    window(gaussian, size.map(|side| side as usize)).is_some()
}

/// Whether threads share a window of so many pixels: nearly no other one is independent of it.
pub(super) fn is_shared(pixels: usize) -> bool {
    pixels > MOST_OF_ONE_TASK
}

/// The first sixteen values.
#[inline(always)]
fn vector<T>(values: &[T]) -> &[T; LANES] {
    values.first_chunk().expect("lines are padded")
}

#[inline(always)]
pub(crate) fn load<S: Simd>(simd: S, stored: &[i16]) -> f32x16<S> {
    let (low, high) = i16x16::load_array_ref(simd, vector(stored)).widen();
    low.combine(high).to_float::<f32x16<S>>() * (1.0 / UNIT)
}

#[inline(always)]
pub(crate) fn store<S: Simd>(simd: S, residuals: f32x16<S>, to: &mut [i16]) {
    let to: &mut [i16; LANES] = to.first_chunk_mut().expect("lines are padded");
    let within = smaller(simd, larger(simd, residuals, -MOST), MOST);
    let scaled = within * UNIT + f32x16::splat(simd, ROUNDER);
    let scaled = scaled.to_array();
    for lane in 0..LANES {
        to[lane] = scaled[lane].to_bits() as i16;
    }
}

/// Sets the residuals of up to sixteen pixels of one channel.
#[inline(always)]
fn set<S: Simd>(simd: S, rendering: &[f32], samples: SampleLine<'_>, residuals: &mut [i16]) {
    let mut padded = [0.0; LANES];
    padded[..rendering.len()].copy_from_slice(rendering);
    let sample = samples.load(simd);
    let difference = f32x16::load_array_ref(simd, &padded) - sample * (1.0 / FULL_SCALE);
    store(simd, residual(simd, difference, sample), residuals);
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::encode::loss::plain_distortion;
    use crate::encode::options::Tune;
    use crate::encode::progress::unobserved;
    use crate::encode::testing::{self, MODELS, source, tiled};

    #[test]
    fn shifted_residuals_have_the_gradient_of_the_distortion() {
        let (width, height) = (TILE_WIDTH + 5, 2 * TILE_HEIGHT + 3);
        let mut rng = fastrand::Rng::with_seed(5);
        for model in MODELS {
            let channels = model.channels();
            let samples: Vec<u8> =
                (0..width * height * channels).map(|_| rng.u8(..).saturating_mul(2)).collect();
            let tiled = tiled(source([width, height], model, &samples), Tune::Visual);
            let rendering: Vec<f32> = samples.iter().map(|_| rng.f32() * 1.2 - 0.1).collect();
            let mut residuals = unobserved(|observer| Residuals::new(&tiled, observer));
            residuals.set(&tiled, 0, &rendering);
            let weights = tiled.loss.weights().expect("it is tuned");
            unobserved(|observer| residuals.shift(&tiled.loss, observer));

            let mut plain: Vec<f64> = (0..samples.len())
                .map(|at| {
                    let value = rendering[at % channels * width * height + at / channels];
                    testing::residual(value, samples[at])
                })
                .collect();
            for at in 0..plain.len() {
                let (pixel, channel) = (at / channels, at % channels);
                let (x, y) = (pixel % width, pixel / width);
                let here = plain[at];
                let mut with = |residual: f64| {
                    plain[at] = residual;
                    plain_distortion(weights, [width, height], &plain)
                };
                let half = (with(here + 0.1) - with(here - 0.1)) / 0.4;
                with(here);
                let stored = residuals.residuals[(y * channels + channel) * residuals.stride + x];
                let residual = f32::from(stored) / UNIT;
                let by_pixel = residuals.whole().perceptual_weights(x, y)[0];
                let found = f64::from(residual * by_pixel);
                let rounding = 0.5 / UNIT * by_pixel;
                assert!(
                    (found - half).abs() < 1e-4 + f64::from(rounding),
                    "{model:?} {at}: {found}, {half}"
                );
            }
        }
    }
}
