//! The residuals of a rendering at every sample, and their change when Gaussians are added or
//! removed.

use core::ops::Range;

use fearless_simd::{Level, Simd, dispatch, f32x16, mask32x16, prelude::*};
use rayon::prelude::*;

use super::kernel_weights::{KernelWeights, LANES, Lanes};
use crate::encode::distortion::differentiate;
use crate::encode::error::EncodeError;
use crate::encode::progress::Observer;
use crate::encode::raster::{Raster, TILE_WIDTH};
use crate::encode::sensitivity::{BLOCK, Sensitivity};
use crate::gaussian::Gaussian;
use crate::kernel::QUARTIC_RADIUS;
use crate::render::tile_grid::TILE_HEIGHT;

/// Rows that one task changes.
const BAND: usize = 64;
/// The margin of a window around its Gaussian, for candidates that are larger or elsewhere: a
/// factor on the extent, and pixels.
const MARGIN: (f32, f32) = (1.2, 1.0);
/// Work for the mask of a sample, and for the shift of a residual.
const WORK: (f64, f64) = (2.0, 4.0);

/// The residuals of a picture, rendering minus source, before the rendering is clamped, and how much
/// their squares count.
///
/// The descent minimizes the sum of squared residuals, each times the sensitivity of its pixel. The
/// distortion counts the means of blocks too: [`Residuals::shift`] moves the residuals such that the
/// gradient of that sum is the gradient of the distortion.
#[derive(Debug)]
pub(crate) struct Residuals {
    width: usize,
    height: usize,
    channels: usize,
    /// Row by row, and in each row channel by channel; every line is padded to whole vectors.
    residuals: Vec<f32>,
    /// Which residuals are ignored, because the output is clamped; in the layout of `residuals`, each
    /// for as many samples as a vector has.
    ignored: Vec<ClampMask>,
    /// The sensitivities of pixels, padded as `residuals`; one line for each row of blocks.
    sensitivities: Vec<f32>,
    stride: usize,
    level: Level,
}

/// The ignored residuals of sixteen samples, one bit for each.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub(crate) struct ClampMask {
    /// Those of samples that are black.
    negative: u16,
    /// Those of samples that are white.
    positive: u16,
}

impl ClampMask {
    pub(crate) const NONE: Self = Self { negative: 0, positive: 0 };
    const ALL: Self = Self { negative: u16::MAX, positive: u16::MAX };

    /// The mask of samples and padding.
    fn new(samples: impl Iterator<Item = f32>) -> Self {
        let mut mask = Self::ALL;
        for (lane, sample) in samples.enumerate() {
            // The output is clamped: where the source is black, a rendering below black is no
            // error, and above white where the source is white.
            mask.negative &= !(u16::from(sample > 0.0) << lane);
            mask.positive &= !(u16::from(sample < 1.0) << lane);
        }
        mask
    }

    /// The mask of the sixteen samples from `lane` on, of which the first are those of `self`.
    fn shifted(self, next: Self, lane: usize) -> Self {
        let bits =
            |low: u16, high: u16| ((u32::from(high) << LANES | u32::from(low)) >> lane) as u16;
        Self {
            negative: bits(self.negative, next.negative),
            positive: bits(self.positive, next.positive),
        }
    }

    /// The residuals, with 0 for those that are ignored.
    #[inline(always)]
    pub(crate) fn clamped<S: Simd>(self, simd: S, residuals: f32x16<S>) -> f32x16<S> {
        let mask = |bits: u16| mask32x16::from_bitmask(simd, bits.into());
        let residuals = mask(self.negative).select(residuals.max(0.0), residuals);
        mask(self.positive).select(residuals.min(0.0), residuals)
    }
}

impl Residuals {
    /// Residuals of 0, until [`Residuals::set`] sets them.
    ///
    /// # Errors
    /// [`EncodeError::Cancelled`] when the caller cancels.
    pub(crate) fn new(raster: &Raster, observer: &mut Observer<'_>) -> Result<Self, EncodeError> {
        let (width, height, channels) = (raster.width, raster.height, raster.channels);
        let stride = width + LANES;
        let masks = stride.div_ceil(LANES) + 1;
        let mut ignored = vec![ClampMask::ALL; masks * height * channels];
        let lines = ignored.chunks_exact_mut(masks).enumerate();
        observer.map(WORK.0 * width as f64, lines, |(line, ignored)| {
            let mut samples = raster.line(line / channels, line % channels);
            for mask in ignored {
                *mask = ClampMask::new(samples.by_ref().take(LANES));
            }
        })?;
        let mut sensitivities = vec![1.0; stride * height.div_ceil(BLOCK)];
        if let Some(sensitivity) = &raster.sensitivity {
            let lines = sensitivities.chunks_exact_mut(stride).enumerate();
            observer.map(WORK.0 * width as f64, lines, |(row, line)| {
                for (x, value) in line[..width].iter_mut().enumerate() {
                    *value = sensitivity.at(x, row * BLOCK);
                }
            })?;
        }
        let residuals = vec![0.0; stride * height * channels];
        let level = Level::new();
        Ok(Self { width, height, channels, residuals, ignored, sensitivities, stride, level })
    }

    /// Sets the residuals of the rows from `first` on, from a rendering of them, plane after plane.
    pub(crate) fn set(&mut self, raster: &Raster, first: usize, rendering: &[f32]) {
        let (width, channels) = (self.width, self.channels);
        let rows = rendering.len() / (width * channels);
        let lines = self.residuals.par_chunks_mut(self.stride).skip(first * channels);
        lines.take(rows * channels).enumerate().for_each(|(line, residuals)| {
            let (row, channel) = (line / channels, line % channels);
            let rendered = &rendering[(channel * rows + row) * width..][..width];
            let samples = raster.line(first + row, channel);
            for ((residual, value), sample) in residuals.iter_mut().zip(rendered).zip(samples) {
                *residual = value - sample;
            }
        });
    }

    /// Moves every residual such that, times its sensitivity, it is half the gradient of the
    /// distortion.
    ///
    /// # Errors
    /// [`EncodeError::Cancelled`] when the caller cancels.
    pub(crate) fn shift(
        &mut self,
        sensitivity: &Sensitivity,
        observer: &mut Observer<'_>,
    ) -> Result<(), EncodeError> {
        match self.channels {
            1 => self.shift_of::<1>(sensitivity, observer),
            2 => self.shift_of::<2>(sensitivity, observer),
            3 => self.shift_of::<3>(sensitivity, observer),
            _ => self.shift_of::<4>(sensitivity, observer),
        }
    }

    fn shift_of<const CHANNELS: usize>(
        &mut self,
        sensitivity: &Sensitivity,
        observer: &mut Observer<'_>,
    ) -> Result<(), EncodeError> {
        let (level, stride, width) = (self.level, self.stride, self.width);
        let band = TILE_HEIGHT * CHANNELS * stride;
        let sensitivities = self.sensitivities.chunks(TILE_HEIGHT / BLOCK * stride);
        let masks = self.masks();
        let ignored = self.ignored.chunks(TILE_HEIGHT * CHANNELS * masks);
        let bands = self.residuals.chunks_mut(band).zip(ignored).zip(sensitivities).enumerate();
        observer.map(WORK.1 * band as f64, bands, |(row, ((residuals, ignored), by_pixel))| {
            let rows = residuals.len() / (CHANNELS * stride);
            for x in (0..width).step_by(TILE_WIDTH) {
                let columns = TILE_WIDTH.min(width - x);
                let at = |y: usize, channel: usize| (y * CHANNELS + channel) * stride + x;
                let mut clamped = [[[0.0; TILE_WIDTH]; TILE_HEIGHT]; CHANNELS];
                for (channel, plane) in clamped.iter_mut().enumerate() {
                    for (y, line) in plane.iter_mut().enumerate().take(rows) {
                        let mask = ignored[(y * CHANNELS + channel) * masks + x / LANES];
                        line[..columns].copy_from_slice(&residuals[at(y, channel)..][..columns]);
                        dispatch!(level, simd => {
                            mask.clamped(simd, f32x16::load_array_ref(simd, line)).store_array(line);
                        });
                    }
                }
                let mut gradients = clamped;
                let corner = [x, row * TILE_HEIGHT];
                dispatch!(level, _ => {
                    differentiate(sensitivity, corner, [columns, rows], &mut gradients)
                });
                for channel in 0..CHANNELS {
                    for y in 0..rows {
                        let residuals = &mut residuals[at(y, channel)..][..columns];
                        let by_pixel = &by_pixel[y / BLOCK * stride + x..];
                        for (column, residual) in residuals.iter_mut().enumerate() {
                            let shifted = gradients[channel][y][column] / by_pixel[column];
                            *residual += shifted - clamped[channel][y][column];
                        }
                    }
                }
            }
        })?;
        Ok(())
    }

    /// Size in bytes of the residuals of a source.
    pub(crate) fn memory(raster: &Raster) -> usize {
        let samples = (raster.width + LANES) * raster.height * raster.channels;
        samples * size_of::<f32>()
            + samples.div_ceil(LANES) * size_of::<ClampMask>()
            + (raster.width + LANES) * raster.height.div_ceil(BLOCK) * size_of::<f32>()
    }

    pub(crate) fn width(&self) -> usize {
        self.width
    }

    pub(crate) fn height(&self) -> usize {
        self.height
    }

    /// The columns and rows of the window of a Gaussian: the bounding box of where it is visible,
    /// with a margin. `None` if that is outside the picture.
    pub(crate) fn window(&self, gaussian: &Gaussian) -> Option<[Range<usize>; 2]> {
        let [l11, l21, l22] = gaussian.cholesky;
        let extents = [l11, (l21 * l21 + l22 * l22).sqrt()];
        let mut window = [0..0, 0..0];
        for (axis, length) in [self.width, self.height].into_iter().enumerate() {
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

    /// Adds Gaussians to the rendering, each times its factor: 1 to add it, -1 to remove it.
    pub(crate) fn add(&mut self, gaussians: &[(Gaussian, f32)]) {
        let (level, stride, channels) = (self.level, self.stride, self.channels);
        let added: Vec<_> = gaussians
            .iter()
            .filter_map(|(gaussian, factor)| {
                let color = gaussian.color.map(|color| color * factor);
                self.window(gaussian).map(|window| (KernelWeights::new(gaussian), color, window))
            })
            .collect();
        // In every band the Gaussians are added in the same order, whichever thread does it.
        let bands = self.residuals.par_chunks_mut(stride * channels * BAND);
        bands.enumerate().for_each(|(band, residuals)| {
            for (weights, color, [columns, rows]) in &added {
                let first = band * BAND;
                let rows = rows.start.max(first)..rows.end.min(first + BAND);
                for y in rows {
                    let rows = residuals.chunks_exact_mut(stride).skip((y - first) * channels);
                    let start = columns.start;
                    let span = weights.span(start, y, columns.len().div_ceil(LANES));
                    for (row, &color) in rows.take(channels).zip(color) {
                        let span = span.clone();
                        dispatch!(level, simd => draw(simd, weights, color, start, y, span, row));
                    }
                }
            }
        });
    }

    pub(crate) fn channels(&self) -> usize {
        self.channels
    }

    pub(crate) fn level(&self) -> Level {
        self.level
    }

    /// Masks of a line.
    fn masks(&self) -> usize {
        self.stride.div_ceil(LANES) + 1
    }

    /// The residuals of so many vectors of a row from column x on. The first column of each is inside
    /// the picture, so the padding suffices.
    pub(crate) fn vectors(&self, x: usize, y: usize, channel: usize, count: usize) -> &[Lanes] {
        let at = (y * self.channels + channel) * self.stride + x;
        self.residuals[at..at + count * LANES].as_chunks().0
    }

    /// Which of these residuals are ignored; `None` if none of them is.
    pub(crate) fn ignored(
        &self,
        x: usize,
        y: usize,
        channel: usize,
        count: usize,
    ) -> Option<impl Iterator<Item = ClampMask>> {
        let line = (y * self.channels + channel) * self.masks();
        let masks = &self.ignored[line + x / LANES..][..=count];
        let masks = masks.windows(2).map(move |masks| masks[0].shifted(masks[1], x % LANES));
        masks.clone().any(|mask| mask != ClampMask::NONE).then_some(masks)
    }

    /// The sensitivities of the pixels of these vectors.
    pub(crate) fn sensitivities(&self, x: usize, y: usize, count: usize) -> &[Lanes] {
        let at = y / BLOCK * self.stride + x;
        self.sensitivities[at..at + count * LANES].as_chunks().0
    }
}

/// Adds a Gaussian of one colour to the vectors of a span of a row of one channel. The span is
/// counted from the column `start`.
#[inline(always)]
fn draw<S: Simd>(
    simd: S,
    weights: &KernelWeights,
    color: f32,
    start: usize,
    y: usize,
    span: Range<usize>,
    residuals: &mut [f32],
) {
    for vector in span {
        let x = start + vector * LANES;
        let weight = weights.at(simd, x, y);
        // The last vector may reach into the padding.
        let residuals: &mut Lanes =
            (&mut residuals[x..x + LANES]).try_into().expect("whole vectors");
        (f32x16::load_array_ref(simd, residuals) + weight * color).store_array(residuals);
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::color::ColorModel;
    use crate::encode::distortion::plain_distortion;
    use crate::encode::options::Tune;
    use crate::encode::progress::unobserved;
    use crate::encode::source::Source;

    #[test]
    fn shifted_residuals_have_the_gradient_of_the_distortion() {
        let (width, height) = (TILE_WIDTH + 5, 2 * TILE_HEIGHT + 3);
        let mut rng = fastrand::Rng::with_seed(5);
        for model in [ColorModel::Gray, ColorModel::GrayAlpha, ColorModel::Rgb, ColorModel::Rgba] {
            let channels = model.channels();
            let samples: Vec<u8> =
                (0..width * height * channels).map(|_| rng.u8(..).saturating_mul(2)).collect();
            let source = Source::new_u8(width as u32, height as u32, model, &samples)
                .expect("the sizes agree");
            let raster = unobserved(|observer| Raster::new(&source, Tune::Visual, observer));
            let rendering: Vec<f32> = samples.iter().map(|_| rng.f32() * 1.2 - 0.1).collect();
            let mut residuals = unobserved(|observer| Residuals::new(&raster, observer));
            residuals.set(&raster, 0, &rendering);
            let sensitivity = raster.sensitivity.as_ref().expect("it is tuned");
            unobserved(|observer| residuals.shift(sensitivity, observer));

            let mut plain: Vec<f64> = (0..samples.len())
                .map(|at| {
                    let value = rendering[at % channels * width * height + at / channels];
                    let residual = f64::from(value) - f64::from(samples[at]) / 255.0;
                    match samples[at] {
                        0 => residual.max(0.0),
                        255 => residual.min(0.0),
                        _ => residual,
                    }
                })
                .collect();
            for at in 0..plain.len() {
                let (pixel, channel) = (at / channels, at % channels);
                let (x, y) = (pixel % width, pixel / width);
                if plain[at] == 0.0 {
                    // Where the residual is ignored, so is its shift.
                    continue;
                }
                let here = plain[at];
                let mut with = |residual: f64| {
                    plain[at] = residual;
                    plain_distortion(sensitivity, [width, height], &plain)
                };
                let half = (with(here + 0.1) - with(here - 0.1)) / 0.4;
                with(here);
                let residual = residuals.vectors(x, y, channel, 1)[0][0];
                let found = f64::from(residual) * f64::from(residuals.sensitivities(x, y, 1)[0][0]);
                assert!((found - half).abs() < 1e-4, "{model:?} {at}: {found}, {half}");
            }
        }
    }
}
