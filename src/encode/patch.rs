//! The part of a picture that one Gaussian shows in, and what changes there with it.

use core::ops::Range;

use rayon::prelude::*;

use fearless_simd::{Level, Simd, dispatch, f32x16, prelude::*};

use super::raster::Raster;
use crate::color::ColorModel;
use crate::gaussian::{Gaussian, inverse_cholesky};
use crate::lattice;
use crate::render::centers;

const LANES: usize = 16;
/// How much larger than its Gaussian a patch is, for candidates to lie within, and in pixels.
const MARGIN: (f32, f32) = (1.2, 1.0);
/// Mahalanobis distance at which the quartic kernel ends.
const RADIUS: f32 = 2.828_427;

/// A rendering and its errors, before clamping.
#[derive(Debug)]
pub(crate) struct Picture {
    width: usize,
    height: usize,
    channels: usize,
    /// Rendering minus source, channel after channel; rows are padded for whole vectors.
    errors: Vec<f32>,
    /// Which errors are clamped; in the layout of `errors`.
    marks: Vec<u8>,
    stride: usize,
    level: Level,
}

/// The surroundings of one Gaussian, without it.
#[derive(Debug, Default)]
pub(crate) struct Patch {
    /// First column and row, in pixels.
    corner: [usize; 2],
    /// Vectors in a row, and rows.
    size: [usize; 2],
    channels: usize,
    /// Channel after channel, row after row.
    errors: Vec<f32>,
    marks: Vec<u8>,
    is_clamped: bool,
    /// The range that errors are clamped to, if any are.
    low: Vec<f32>,
    high: Vec<f32>,
    level: Option<Level>,
}

/// What a Gaussian does to its patch.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Change {
    /// Of the sum of squared errors, against leaving it out.
    pub(crate) error: f32,
    /// Half of the derivative by the amplitude along each colour axis.
    pub(crate) by_axis: [f32; 4],
    /// Sum of squared weights: half of the second derivative.
    pub(crate) weight: f32,
    /// The amplitudes along the colour axes.
    axes: [f32; 4],
}

impl Change {
    /// The change of error for other amplitudes, where nothing is clamped: `codes` in `units`.
    pub(crate) fn with(&self, codes: [i32; 4], units: [f32; 4], channels: usize) -> f32 {
        (0..channels)
            .map(|axis| {
                let amplitude = codes[axis] as f32 * units[axis];
                // At amplitude 0 the derivative is what the errors alone say.
                let alone = self.by_axis[axis] - self.axes[axis] * self.weight;
                amplitude * (amplitude * self.weight + 2.0 * alone)
            })
            .sum()
    }
}

/// Marks of samples whose errors count on one side only, or not at all.
const NOT_BELOW: u8 = 1;
const NOT_ABOVE: u8 = 2;

impl Picture {
    /// From a rendering, plane after plane.
    pub(crate) fn new(raster: &Raster, rendering: &[f32]) -> Self {
        let (width, height, channels) = (raster.width, raster.height, raster.channels);
        let stride = width + LANES;
        let mut errors = vec![0.0; stride * height * channels];
        let mut marks = vec![NOT_BELOW | NOT_ABOVE; errors.len()];
        for (index, rendered) in rendering.chunks_exact(width).enumerate() {
            let (channel, y) = (index / height, index % height);
            for (x, value) in rendered.iter().enumerate() {
                let sample = raster.sample(x, y)[channel];
                errors[index * stride + x] = value - sample;
                // Output is clamped: beyond white or black where the source is so, all is well.
                marks[index * stride + x] = if sample <= 0.0 {
                    NOT_BELOW
                } else if sample >= 1.0 {
                    NOT_ABOVE
                } else {
                    0
                };
            }
        }
        Self { width, height, channels, errors, marks, stride, level: Level::new() }
    }

    pub(crate) fn width(&self) -> usize {
        self.width
    }

    pub(crate) fn height(&self) -> usize {
        self.height
    }

    /// Sum of squared errors, as output has them.
    pub(crate) fn error(&self) -> f64 {
        let lines = self.errors.par_chunks(self.stride).zip(self.marks.par_chunks(self.stride));
        let sums = lines.map(|(errors, marks)| {
            let clamped = errors.iter().zip(marks).map(|(&error, &mark)| clamped(error, mark));
            clamped.map(|error| f64::from(error * error)).sum()
        });
        sums.collect::<Vec<f64>>().iter().sum()
    }

    /// The columns and rows in which a Gaussian and its like may show; `None` outside the picture.
    pub(crate) fn bounds(&self, gaussian: &Gaussian) -> Option<[Range<usize>; 2]> {
        let [l11, l21, l22] = gaussian.cholesky;
        let extents = [l11, (l21 * l21 + l22 * l22).sqrt()];
        let mut bounds = [0..0, 0..0];
        for (axis, length) in [self.width, self.height].into_iter().enumerate() {
            let reach = RADIUS * (MARGIN.0 * extents[axis]) + MARGIN.1;
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

    /// Adds a Gaussian to the rendering, `factor` times.
    pub(crate) fn add(&mut self, gaussian: &Gaussian, factor: f32) {
        let Some([columns, rows]) = self.bounds(gaussian) else { return };
        let level = self.level;
        dispatch!(level, simd => self.add_with(simd, gaussian, factor, columns, rows));
    }

    #[inline(always)]
    fn add_with<S: Simd>(
        &mut self,
        simd: S,
        gaussian: &Gaussian,
        factor: f32,
        columns: Range<usize>,
        rows: Range<usize>,
    ) {
        let weights = Weights::new(gaussian);
        for y in rows {
            for x in columns.clone().step_by(LANES) {
                let weight = weights.at(simd, x, y);
                // The padding takes what lies beyond the last column.
                for channel in 0..self.channels {
                    let at = (channel * self.height + y) * self.stride + x;
                    let errors: &mut [f32; LANES] =
                        (&mut self.errors[at..at + LANES]).try_into().expect("whole vectors");
                    let sum = f32x16::load_array_ref(simd, errors)
                        + weight * (factor * gaussian.color[channel]);
                    sum.store_array(errors);
                }
            }
        }
    }
}

/// What an error counts as.
fn clamped(error: f32, mark: u8) -> f32 {
    let low = if mark & NOT_BELOW != 0 { 0.0 } else { f32::MIN };
    let high = if mark & NOT_ABOVE != 0 { 0.0 } else { f32::MAX };
    error.clamp(low, high)
}

/// The quartic kernel of one Gaussian.
#[derive(Clone, Copy, Debug)]
struct Weights {
    center: [f32; 2],
    inverse: [f32; 3],
}

impl Weights {
    fn new(gaussian: &Gaussian) -> Self {
        Self { center: gaussian.center, inverse: inverse_cholesky(gaussian.cholesky) }
    }

    /// The weights of sixteen pixels from (x, y) on.
    #[inline(always)]
    fn at<S: Simd>(&self, simd: S, x: usize, y: usize) -> f32x16<S> {
        let [i11, w, i22] = self.inverse;
        let dx = centers(simd, x as u32) - self.center[0];
        let u = dx * i11;
        let v = dx * w + i22 * (y as f32 + 0.5 - self.center[1]);
        let t = (f32x16::splat(simd, 1.0) - (u * u + v * v) * 0.125).max(0.0);
        let t2 = t * t;
        t2 * t2
    }
}

impl Patch {
    /// Cuts out the surroundings of a Gaussian, and takes it away. Whether there are any.
    pub(crate) fn load(&mut self, picture: &Picture, gaussian: &Gaussian) -> bool {
        let Some([columns, rows]) = picture.bounds(gaussian) else { return false };
        let width = columns.len().next_multiple_of(LANES);
        self.corner = [columns.start, rows.start];
        self.size = [width / LANES, rows.len()];
        self.channels = picture.channels;
        self.errors.clear();
        self.marks.clear();
        for channel in 0..picture.channels {
            for y in rows.clone() {
                let at = (channel * picture.height + y) * picture.stride + columns.start;
                // Of the padding, one vector lies beyond the last column at most.
                self.errors.extend_from_slice(&picture.errors[at..at + width]);
                self.marks.extend_from_slice(&picture.marks[at..at + width]);
            }
        }
        self.is_clamped = self.marks.iter().any(|&mark| mark != 0);
        if self.is_clamped {
            let bound =
                |bit: u8, free: f32| move |&mark: &u8| if mark & bit != 0 { 0.0 } else { free };
            self.low.clear();
            self.low.extend(self.marks.iter().map(bound(NOT_BELOW, f32::MIN)));
            self.high.clear();
            self.high.extend(self.marks.iter().map(bound(NOT_ABOVE, f32::MAX)));
        }
        let level = picture.level;
        self.level = Some(level);
        dispatch!(level, simd => self.remove(simd, gaussian));
        true
    }

    /// Whether some of the errors count on one side only.
    pub(crate) fn is_clamped(&self) -> bool {
        self.is_clamped
    }

    #[inline(always)]
    fn remove<S: Simd>(&mut self, simd: S, gaussian: &Gaussian) {
        let weights = Weights::new(gaussian);
        let [vectors, rows] = self.size;
        for row in 0..rows {
            for vector in 0..vectors {
                let weight =
                    weights.at(simd, self.corner[0] + vector * LANES, self.corner[1] + row);
                for channel in 0..self.channels {
                    let at = ((channel * rows + row) * vectors + vector) * LANES;
                    let errors: &mut [f32; LANES] =
                        (&mut self.errors[at..at + LANES]).try_into().expect("whole vectors");
                    let rest =
                        f32x16::load_array_ref(simd, errors) - weight * gaussian.color[channel];
                    rest.store_array(errors);
                }
            }
        }
    }

    /// What a Gaussian does here.
    pub(crate) fn change(&self, gaussian: &Gaussian, model: ColorModel) -> Change {
        let level = self.level.unwrap_or_else(Level::new);
        let (error, by_channel, weight) = if self.is_clamped {
            dispatch!(level, simd => self.clamped_change(simd, gaussian))
        } else {
            dispatch!(level, simd => self.plain_change(simd, gaussian))
        };
        let by_axis = lattice::to_axes(by_channel, model);
        Change { error, by_axis, weight, axes: lattice::to_axes(gaussian.color, model) }
    }

    #[inline(always)]
    fn plain_change<S: Simd>(&self, simd: S, gaussian: &Gaussian) -> (f32, [f32; 4], f32) {
        let weights = Weights::new(gaussian);
        let [vectors, rows] = self.size;
        let mut squares = f32x16::splat(simd, 0.0);
        let mut products = [squares; 4];
        for row in 0..rows {
            for vector in 0..vectors {
                let weight =
                    weights.at(simd, self.corner[0] + vector * LANES, self.corner[1] + row);
                squares += weight * weight;
                for (channel, product) in products[..self.channels].iter_mut().enumerate() {
                    *product += weight * self.vector(simd, &self.errors, channel, row, vector);
                }
            }
        }
        let weight = total(squares);
        let (mut error, mut by_channel) = (0.0, [0.0; 4]);
        for channel in 0..self.channels {
            let (color, product) = (gaussian.color[channel], total(products[channel]));
            error += color * (color * weight + 2.0 * product);
            by_channel[channel] = color * weight + product;
        }
        (error, by_channel, weight)
    }

    #[inline(always)]
    fn clamped_change<S: Simd>(&self, simd: S, gaussian: &Gaussian) -> (f32, [f32; 4], f32) {
        let weights = Weights::new(gaussian);
        let [vectors, rows] = self.size;
        let zero = f32x16::splat(simd, 0.0);
        let (mut change, mut squares, mut products) = (zero, zero, [zero; 4]);
        for row in 0..rows {
            for vector in 0..vectors {
                let weight =
                    weights.at(simd, self.corner[0] + vector * LANES, self.corner[1] + row);
                for (channel, product) in products[..self.channels].iter_mut().enumerate() {
                    let low = self.vector(simd, &self.low, channel, row, vector);
                    let high = self.vector(simd, &self.high, channel, row, vector);
                    let without = self.vector(simd, &self.errors, channel, row, vector);
                    let with = without + weight * gaussian.color[channel];
                    let clamped = with.max(low).min(high);
                    let before = without.max(low).min(high);
                    change += clamped * clamped - before * before;
                    *product += weight * clamped;
                    let counts = clamped.simd_eq(with);
                    squares += counts.select(weight * weight, zero);
                }
            }
        }
        let by_channel = core::array::from_fn(|channel| total(products[channel]));
        (total(change), by_channel, total(squares) / self.channels as f32)
    }

    #[inline(always)]
    fn vector<S: Simd>(
        &self,
        simd: S,
        values: &[f32],
        channel: usize,
        row: usize,
        vector: usize,
    ) -> f32x16<S> {
        let [vectors, rows] = self.size;
        let at = ((channel * rows + row) * vectors + vector) * LANES;
        let values: &[f32; LANES] = values[at..at + LANES].try_into().expect("whole vectors");
        f32x16::load_array_ref(simd, values)
    }
}

#[inline(always)]
fn total<S: Simd>(vector: f32x16<S>) -> f32 {
    vector.to_array().iter().sum()
}
