//! The residuals of a rendering at every sample, and their change when Gaussians are added or
//! removed.

use core::ops::Range;

use fearless_simd::{Level, Simd, dispatch, f32x16, mask32x16, prelude::*};
use rayon::prelude::*;

use super::kernel_weights::{KernelWeights, LANES, Lanes};
use crate::encode::raster::Raster;
use crate::gaussian::Gaussian;
use crate::kernel::QUARTIC_RADIUS;

/// Rows that one task changes.
const BAND: usize = 64;
/// The margin of a window around its Gaussian, for candidates that are larger or elsewhere: a
/// factor on the extent, and pixels.
const MARGIN: (f32, f32) = (1.2, 1.0);

/// The residuals of a picture, rendering minus source, before the rendering is clamped.
#[derive(Debug)]
pub(crate) struct Residuals {
    width: usize,
    height: usize,
    channels: usize,
    /// Row by row, and in each row channel by channel; every line is padded to whole vectors.
    residuals: Vec<f32>,
    /// Whether positive or negative residuals are ignored, because the output is clamped; in the
    /// layout of `residuals`.
    ignored: Vec<u8>,
    stride: usize,
    level: Level,
}

/// Bits of [`Residuals::ignored`]: for samples that are black, that are white, and both for
/// padding.
const IGNORE_NEGATIVE: u8 = 1;
const IGNORE_POSITIVE: u8 = 2;

/// The ignored residuals of sixteen samples, one bit for each.
#[derive(Clone, Copy, Debug)]
pub(crate) struct ClampMask {
    negative: u16,
    positive: u16,
}

impl ClampMask {
    pub(crate) fn new(ignored: &[u8; LANES]) -> Self {
        let bits = |bit: u8| {
            let lanes = (0..).zip(ignored);
            lanes.map(|(lane, ignored)| u16::from(ignored & bit != 0) << lane).sum()
        };
        Self { negative: bits(IGNORE_NEGATIVE), positive: bits(IGNORE_POSITIVE) }
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
    pub(crate) fn new(raster: &Raster) -> Self {
        let (width, height, channels) = (raster.width, raster.height, raster.channels);
        let stride = width + LANES;
        let mut ignored = vec![IGNORE_NEGATIVE | IGNORE_POSITIVE; stride * height * channels];
        ignored.par_chunks_mut(stride).enumerate().for_each(|(line, ignored)| {
            let samples = raster.line(line / channels, line % channels);
            for (ignored, sample) in ignored.iter_mut().zip(samples) {
                // The output is clamped: where the source is black, a rendering below black is no
                // error, and above white where the source is white.
                *ignored = if sample <= 0.0 {
                    IGNORE_NEGATIVE
                } else if sample >= 1.0 {
                    IGNORE_POSITIVE
                } else {
                    0
                };
            }
        });
        let residuals = vec![0.0; ignored.len()];
        Self { width, height, channels, residuals, ignored, stride, level: Level::new() }
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

    /// Size in bytes of the residuals of a source, and of the windows of one batch of Gaussians,
    /// which do not overlap.
    pub(crate) fn memory(raster: &Raster) -> usize {
        let samples = (raster.width + LANES) * raster.height * raster.channels;
        samples * (2 * size_of::<f32>() + size_of::<u8>())
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

    /// The residuals of sixteen samples of a row from column x on, and which of them are ignored.
    /// The column is inside the picture, so the padding suffices.
    pub(crate) fn vector(&self, x: usize, y: usize, channel: usize) -> (&Lanes, &[u8; LANES]) {
        let at = (y * self.channels + channel) * self.stride + x;
        let residuals = self.residuals[at..at + LANES].try_into();
        let ignored = self.ignored[at..at + LANES].try_into();
        (residuals.expect("whole vectors"), ignored.expect("whole vectors"))
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
