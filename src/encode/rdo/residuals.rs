//! How far a rendering is from its source at every sample, and what Gaussians change there.

use core::ops::Range;

use fearless_simd::{Level, Simd, dispatch, f32x16, mask32x16, prelude::*};
use rayon::prelude::*;

use crate::encode::raster::{Raster, centers};
use crate::gaussian::{Gaussian, inverse_cholesky};
use crate::kernel::QUARTIC_RADIUS;
use crate::render::simd_kernel::Quartic;

pub(crate) const LANES: usize = 16;
pub(crate) type Lanes = [f32; LANES];
/// Rows that one thread changes at a time.
const BAND: usize = 64;
/// How much larger than its Gaussian a window is, for candidates to lie within, and in pixels.
const MARGIN: (f32, f32) = (1.2, 1.0);

/// Rendering minus source, before clamping.
#[derive(Debug)]
pub(crate) struct Residuals {
    width: usize,
    height: usize,
    channels: usize,
    /// Rendering minus source, row after row, in each channel after channel; padded for whole
    /// vectors.
    errors: Vec<f32>,
    /// Which errors are clamped; in the layout of `errors`.
    marks: Vec<u8>,
    stride: usize,
    level: Level,
}

/// Bits of samples whose errors count on one side only, or not at all.
const NOT_BELOW: u8 = 1;
const NOT_ABOVE: u8 = 2;

/// The same for sixteen samples, a bit for each.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Marks {
    not_below: u16,
    not_above: u16,
}

impl Marks {
    pub(crate) fn new(marks: &[u8; LANES]) -> Self {
        let bits = |bit: u8| {
            let lanes = (0..).zip(marks);
            lanes.map(|(lane, mark)| u16::from(mark & bit != 0) << lane).sum()
        };
        Self { not_below: bits(NOT_BELOW), not_above: bits(NOT_ABOVE) }
    }

    /// What errors count as.
    #[inline(always)]
    pub(crate) fn clamped<S: Simd>(self, simd: S, errors: f32x16<S>) -> f32x16<S> {
        let mask = |bits: u16| mask32x16::from_bitmask(simd, bits.into());
        let errors = mask(self.not_below).select(errors.max(0.0), errors);
        mask(self.not_above).select(errors.min(0.0), errors)
    }
}

impl Residuals {
    /// Of nothing, until lines are set.
    pub(crate) fn new(raster: &Raster) -> Self {
        let (width, height, channels) = (raster.width, raster.height, raster.channels);
        let stride = width + LANES;
        let mut marks = vec![NOT_BELOW | NOT_ABOVE; stride * height * channels];
        marks.par_chunks_mut(stride).enumerate().for_each(|(line, marks)| {
            let samples = raster.line(line / channels, line % channels);
            for (mark, sample) in marks.iter_mut().zip(samples) {
                // Output is clamped: beyond white or black where the source is so, all is well.
                *mark = if sample <= 0.0 {
                    NOT_BELOW
                } else if sample >= 1.0 {
                    NOT_ABOVE
                } else {
                    0
                };
            }
        });
        let errors = vec![0.0; marks.len()];
        Self { width, height, channels, errors, marks, stride, level: Level::new() }
    }

    /// Sets rows from `first` on to a rendering, plane after plane.
    pub(crate) fn set(&mut self, raster: &Raster, first: usize, rendering: &[f32]) {
        let (width, channels) = (self.width, self.channels);
        let rows = rendering.len() / (width * channels);
        let lines = self.errors.par_chunks_mut(self.stride).skip(first * channels);
        lines.take(rows * channels).enumerate().for_each(|(line, errors)| {
            let (row, channel) = (line / channels, line % channels);
            let rendered = &rendering[(channel * rows + row) * width..][..width];
            let samples = raster.line(first + row, channel);
            for ((error, value), sample) in errors.iter_mut().zip(rendered).zip(samples) {
                *error = value - sample;
            }
        });
    }

    /// Bytes that the residuals of a source take, with windows that do not touch.
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

    /// The columns and rows in which a Gaussian and its like may show; `None` outside the picture.
    pub(crate) fn bounds(&self, gaussian: &Gaussian) -> Option<[Range<usize>; 2]> {
        let [l11, l21, l22] = gaussian.cholesky;
        let extents = [l11, (l21 * l21 + l22 * l22).sqrt()];
        let mut bounds = [0..0, 0..0];
        for (axis, length) in [self.width, self.height].into_iter().enumerate() {
            let reach = QUARTIC_RADIUS * (MARGIN.0 * extents[axis]) + MARGIN.1;
            // Casts saturate.
            let first = (gaussian.center[axis] - reach - 0.5).ceil().max(0.0) as usize;
            let end = (gaussian.center[axis] + reach + 0.5).floor().max(0.0) as usize;
            bounds[axis] = first..end.min(length);
            if bounds[axis].is_empty() {
                return None;
            }
        }
        Some(bounds)
    }

    /// Adds Gaussians to the rendering, each as often as its factor says.
    pub(crate) fn add(&mut self, gaussians: &[(Gaussian, f32)]) {
        let (level, stride, channels) = (self.level, self.stride, self.channels);
        let added: Vec<_> = gaussians
            .iter()
            .filter_map(|(gaussian, factor)| {
                let color = gaussian.color.map(|color| color * factor);
                self.bounds(gaussian).map(|bounds| (PlacedKernel::new(gaussian), color, bounds))
            })
            .collect();
        // Whatever thread takes a band, everything comes in the same order.
        let bands = self.errors.par_chunks_mut(stride * channels * BAND);
        bands.enumerate().for_each(|(band, errors)| {
            for (weights, color, [columns, rows]) in &added {
                let first = band * BAND;
                let rows = rows.start.max(first)..rows.end.min(first + BAND);
                for y in rows {
                    let rows = errors.chunks_exact_mut(stride).skip((y - first) * channels);
                    let start = columns.start;
                    let span = weights.span(start, y, columns.len().div_ceil(LANES));
                    for (row, &color) in rows.take(channels).zip(color) {
                        let span = span.clone();
                        dispatch!(level, simd => weights.draw(simd, color, start, y, span, row));
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

    /// The errors of sixteen samples of a row from one inside the picture on, and their marks. Of
    /// the padding, one vector lies beyond the last column at most.
    pub(crate) fn vector(&self, x: usize, y: usize, channel: usize) -> (&Lanes, &[u8; LANES]) {
        let at = (y * self.channels + channel) * self.stride + x;
        let errors = self.errors[at..at + LANES].try_into();
        let marks = self.marks[at..at + LANES].try_into();
        (errors.expect("whole vectors"), marks.expect("whole vectors"))
    }
}

/// Where a Gaussian shows, and how strongly.
#[derive(Clone, Copy, Debug)]
pub(crate) struct PlacedKernel {
    center: [f32; 2],
    inverse: [f32; 3],
    /// Of a row by its distance from the centre: how far its middle is moved along x for every
    /// pixel, the squared half of its length at the centre, and how that falls with the squared
    /// distance.
    middle: f32,
    half: f32,
    fall: f32,
}

impl PlacedKernel {
    pub(crate) fn new(gaussian: &Gaussian) -> Self {
        let inverse = inverse_cholesky(gaussian.cholesky);
        let [i11, w, i22] = inverse;
        let a = i11 * i11 + w * w;
        let ratio = i11 * i22 / a;
        Self {
            center: gaussian.center,
            inverse,
            middle: -w * i22 / a,
            half: QUARTIC_RADIUS * QUARTIC_RADIUS / a,
            fall: ratio * ratio,
        }
    }

    /// The vectors of a row, counted from a column, that the Gaussian shows in.
    #[inline(always)]
    pub(crate) fn span(&self, corner: usize, y: usize, vectors: usize) -> Range<usize> {
        let dy = y as f32 + 0.5 - self.center[1];
        let squared = self.half - self.fall * dy * dy;
        if squared <= 0.0 {
            return 0..0;
        }
        let half = squared.sqrt();
        let middle = self.center[0] + self.middle * dy - 0.5 - corner as f32;
        // Casts saturate.
        let first = ((middle - half) * (1.0 / LANES as f32)) as usize;
        let last = ((middle + half) * (1.0 / LANES as f32)) as usize;
        first..(last + 1).min(vectors)
    }

    /// Adds a colour to a part of a row of one channel.
    #[inline(always)]
    fn draw<S: Simd>(
        &self,
        simd: S,
        color: f32,
        start: usize,
        y: usize,
        span: Range<usize>,
        errors: &mut [f32],
    ) {
        for vector in span {
            let x = start + vector * LANES;
            let weight = weight(root(simd, self.place(simd, x, y)));
            // The padding takes what lies beyond the last column.
            let errors: &mut Lanes = (&mut errors[x..x + LANES]).try_into().expect("whole vectors");
            (f32x16::load_array_ref(simd, errors) + weight * color).store_array(errors);
        }
    }

    /// The place of sixteen pixels from (x, y) on in the Gaussian's own frame.
    #[inline(always)]
    pub(crate) fn place<S: Simd>(&self, simd: S, x: usize, y: usize) -> [f32x16<S>; 2] {
        let [i11, w, i22] = self.inverse;
        let dx = centers(simd, x as u32) - self.center[0];
        [dx * i11, dx * w + i22 * (y as f32 + 0.5 - self.center[1])]
    }
}

/// The root of the quartic kernel at a point of its own frame.
#[inline(always)]
pub(crate) fn root<S: Simd>(simd: S, [u, v]: [f32x16<S>; 2]) -> f32x16<S> {
    Quartic.root(simd, u * u + v * v)
}

#[inline(always)]
pub(crate) fn weight<S: Simd>(root: f32x16<S>) -> f32x16<S> {
    root * root
}
