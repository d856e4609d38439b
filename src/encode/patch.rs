//! The part of a picture that one Gaussian shows in, and what changes there with it.

use core::ops::Range;

use rayon::prelude::*;

use fearless_simd::{Level, Simd, dispatch, f32x16, mask32x16, prelude::*};

use super::displacement::{Displacement, Moments};
use super::raster::Raster;
use crate::color::ColorModel;
use crate::gaussian::{Gaussian, inverse_cholesky};
use crate::lattice;
use crate::render::centers;

const LANES: usize = 16;
type Lanes = [f32; LANES];
/// Rows of a picture that one thread changes at a time.
const BAND: usize = 64;
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
    /// Rendering minus source, row after row, in each channel after channel; padded for whole
    /// vectors.
    errors: Vec<f32>,
    /// Which errors are clamped; in the layout of `errors`.
    marks: Vec<u8>,
    stride: usize,
    level: Level,
}

/// The surroundings of one Gaussian.
#[derive(Debug, Default)]
pub(crate) struct Patch {
    /// First column and row, in pixels.
    corner: [usize; 2],
    /// Vectors in a row, and rows.
    size: [usize; 2],
    channels: usize,
    /// Row after row; the channels of a vector side by side.
    errors: Vec<Lanes>,
    /// One for each vector of the errors; empty if all count.
    marks: Vec<Marks>,
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
    pub(crate) fn with(&self, codes: [i32; 4], units: [f32; 4]) -> f32 {
        let axes = codes.iter().zip(units).zip(self.by_axis).zip(self.axes);
        axes.map(|(((&code, unit), by_axis), present)| {
            let amplitude = code as f32 * unit;
            // At amplitude 0 the derivative is what the errors alone say.
            let alone = by_axis - present * self.weight;
            amplitude * (amplitude * self.weight + 2.0 * alone)
        })
        .sum()
    }
}

/// Bits of samples whose errors count on one side only, or not at all.
const NOT_BELOW: u8 = 1;
const NOT_ABOVE: u8 = 2;

/// The same for sixteen samples, a bit for each.
#[derive(Clone, Copy, Debug)]
struct Marks {
    not_below: u16,
    not_above: u16,
}

impl Marks {
    fn new(marks: &[u8]) -> Self {
        let bits = |bit: u8| {
            let lanes = (0..).zip(marks);
            lanes.map(|(lane, mark)| u16::from(mark & bit != 0) << lane).sum()
        };
        Self { not_below: bits(NOT_BELOW), not_above: bits(NOT_ABOVE) }
    }

    /// What errors count as.
    #[inline(always)]
    fn clamped<S: Simd>(self, simd: S, errors: f32x16<S>) -> f32x16<S> {
        let mask = |bits: u16| mask32x16::from_bitmask(simd, bits.into());
        let errors = mask(self.not_below).select(errors.max(0.0), errors);
        mask(self.not_above).select(errors.min(0.0), errors)
    }
}

impl Picture {
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

    /// Bytes that the picture of a source takes, with patches that do not touch.
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

    /// Adds Gaussians to the rendering, each as often as its factor says.
    pub(crate) fn add(&mut self, gaussians: &[(Gaussian, f32)]) {
        let (level, stride, channels) = (self.level, self.stride, self.channels);
        let added: Vec<_> = gaussians
            .iter()
            .filter_map(|(gaussian, factor)| {
                let color = gaussian.color.map(|color| color * factor);
                self.bounds(gaussian).map(|bounds| (Weights::new(gaussian), color, bounds))
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

    /// Where the error of a sample is.
    fn at(&self, x: usize, y: usize, channel: usize) -> usize {
        (y * self.channels + channel) * self.stride + x
    }
}

/// Where a Gaussian shows, and how strongly.
#[derive(Clone, Copy, Debug)]
struct Weights {
    center: [f32; 2],
    inverse: [f32; 3],
    /// Of a row by its distance from the centre: how far its middle is moved along x for every
    /// pixel, the squared half of its length at the centre, and how that falls with the squared
    /// distance.
    middle: f32,
    half: f32,
    fall: f32,
}

impl Weights {
    fn new(gaussian: &Gaussian) -> Self {
        let inverse = inverse_cholesky(gaussian.cholesky);
        let [i11, w, i22] = inverse;
        let a = i11 * i11 + w * w;
        let ratio = i11 * i22 / a;
        Self {
            center: gaussian.center,
            inverse,
            middle: -w * i22 / a,
            half: RADIUS * RADIUS / a,
            fall: ratio * ratio,
        }
    }

    /// The vectors of a row, counted from a column, that the Gaussian shows in.
    #[inline(always)]
    fn span(&self, corner: usize, y: usize, vectors: usize) -> Range<usize> {
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
    fn place<S: Simd>(&self, simd: S, x: usize, y: usize) -> [f32x16<S>; 2] {
        let [i11, w, i22] = self.inverse;
        let dx = centers(simd, x as u32) - self.center[0];
        [dx * i11, dx * w + i22 * (y as f32 + 0.5 - self.center[1])]
    }
}

/// 1 - q / 8, the fourth power of which is the quartic kernel.
#[inline(always)]
fn root<S: Simd>(simd: S, [u, v]: [f32x16<S>; 2]) -> f32x16<S> {
    (f32x16::splat(simd, 1.0) - (u * u + v * v) * 0.125).max(0.0)
}

#[inline(always)]
fn weight<S: Simd>(root: f32x16<S>) -> f32x16<S> {
    let squared = root * root;
    squared * squared
}

/// How squared errors change with what a Gaussian is.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Slopes {
    /// What the Gaussian does as it is.
    pub(crate) change: Change,
    /// Derivatives by a [`Displacement`].
    pub(crate) by_displacement: Displacement,
}

impl Patch {
    /// Cuts out the surroundings of a Gaussian. Whether there are any.
    pub(crate) fn load(&mut self, picture: &Picture, gaussian: &Gaussian) -> bool {
        let Some([columns, rows]) = picture.bounds(gaussian) else { return false };
        let vectors = columns.len().div_ceil(LANES);
        self.corner = [columns.start, rows.start];
        self.size = [vectors, rows.len()];
        self.channels = picture.channels;
        self.level = Some(picture.level);
        let length = vectors * rows.len() * picture.channels;
        self.errors.clear();
        self.errors.reserve_exact(length);
        self.marks.clear();
        let lines = rows.flat_map(|y| (0..vectors).map(move |vector| (y, vector)));
        let places = lines.flat_map(|(y, vector)| {
            let x = columns.start + vector * LANES;
            (0..picture.channels).map(move |channel| picture.at(x, y, channel))
        });
        let mut is_clamped = false;
        for at in places.clone() {
            // Of the padding, one vector lies beyond the last column at most.
            let errors = picture.errors[at..at + LANES].try_into();
            self.errors.push(errors.expect("whole vectors"));
            is_clamped |= picture.marks[at..at + LANES] != [0; LANES];
        }
        if is_clamped {
            self.marks.reserve_exact(length);
            self.marks.extend(places.map(|at| Marks::new(&picture.marks[at..at + LANES])));
        }
        true
    }

    /// Whether some of the errors count on one side only.
    pub(crate) fn is_clamped(&self) -> bool {
        !self.marks.is_empty()
    }

    /// Takes a Gaussian away.
    pub(crate) fn remove(&mut self, gaussian: &Gaussian) {
        let level = self.level.unwrap_or_else(Level::new);
        match self.channels {
            1 => dispatch!(level, simd => self.remove_with::<_, 1>(simd, gaussian)),
            2 => dispatch!(level, simd => self.remove_with::<_, 2>(simd, gaussian)),
            3 => dispatch!(level, simd => self.remove_with::<_, 3>(simd, gaussian)),
            _ => dispatch!(level, simd => self.remove_with::<_, 4>(simd, gaussian)),
        }
    }

    #[inline(always)]
    fn remove_with<S: Simd, const CHANNELS: usize>(&mut self, simd: S, gaussian: &Gaussian) {
        let weights = Weights::new(gaussian);
        let [vectors, rows] = self.size;
        for row in 0..rows {
            let y = self.corner[1] + row;
            let span = weights.span(self.corner[0], y, vectors);
            let x = self.corner[0] + span.start * LANES;
            let line = &mut self.errors.as_chunks_mut::<CHANNELS>().0[row * vectors..][..vectors];
            let line = line.get_mut(span).unwrap_or_default();
            for (index, errors) in line.iter_mut().enumerate() {
                let weight = weight(root(simd, weights.place(simd, x + index * LANES, y)));
                for (errors, color) in errors.iter_mut().zip(gaussian.color) {
                    (f32x16::load_array_ref(simd, errors) - weight * color).store_array(errors);
                }
            }
        }
    }

    /// What a Gaussian does here that was taken away before.
    pub(crate) fn change(&self, gaussian: &Gaussian, model: ColorModel) -> Change {
        let level = self.level.unwrap_or_else(Level::new);
        let sums = match self.channels {
            1 => dispatch!(level, simd => self.sums::<_, 1>(simd, gaussian)),
            2 => dispatch!(level, simd => self.sums::<_, 2>(simd, gaussian)),
            3 => dispatch!(level, simd => self.sums::<_, 3>(simd, gaussian)),
            _ => dispatch!(level, simd => self.sums::<_, 4>(simd, gaussian)),
        };
        let by_axis = lattice::to_axes(sums.by_channel, model);
        let axes = lattice::to_axes(gaussian.color, model);
        Change { error: sums.error, by_axis, weight: sums.weight, axes }
    }

    #[inline(always)]
    fn sums<S: Simd, const CHANNELS: usize>(&self, simd: S, gaussian: &Gaussian) -> Sums {
        if self.is_clamped() {
            return self.clamped_sums::<S, CHANNELS>(simd, gaussian);
        }
        let weights = Weights::new(gaussian);
        let [vectors, rows] = self.size;
        let mut squares = f32x16::splat(simd, 0.0);
        let mut products = [squares; CHANNELS];
        for row in 0..rows {
            let y = self.corner[1] + row;
            let span = weights.span(self.corner[0], y, vectors);
            let x = self.corner[0] + span.start * LANES;
            for (index, errors) in self.line::<CHANNELS>(row, &span).iter().enumerate() {
                let weight = weight(root(simd, weights.place(simd, x + index * LANES, y)));
                squares += weight * weight;
                for (product, errors) in products.iter_mut().zip(errors) {
                    *product += weight * f32x16::load_array_ref(simd, errors);
                }
            }
        }
        let weight = total(squares);
        let mut sums = Sums { error: 0.0, by_channel: [0.0; 4], weight };
        for (channel, &product) in products.iter().enumerate() {
            let (color, product) = (gaussian.color[channel], total(product));
            sums.error += color * (color * weight + 2.0 * product);
            sums.by_channel[channel] = color * weight + product;
        }
        sums
    }

    #[inline(always)]
    fn clamped_sums<S: Simd, const CHANNELS: usize>(&self, simd: S, gaussian: &Gaussian) -> Sums {
        let weights = Weights::new(gaussian);
        let [vectors, rows] = self.size;
        let zero = f32x16::splat(simd, 0.0);
        let (mut change, mut squares, mut products) = (zero, zero, [zero; CHANNELS]);
        for row in 0..rows {
            let y = self.corner[1] + row;
            let span = weights.span(self.corner[0], y, vectors);
            let x = self.corner[0] + span.start * LANES;
            let lines =
                self.line::<CHANNELS>(row, &span).iter().zip(self.marks::<CHANNELS>(row, &span));
            for (index, (errors, marks)) in lines.enumerate() {
                let weight = weight(root(simd, weights.place(simd, x + index * LANES, y)));
                for channel in 0..CHANNELS {
                    let without = f32x16::load_array_ref(simd, &errors[channel]);
                    let with = without + weight * gaussian.color[channel];
                    let clamped = marks[channel].clamped(simd, with);
                    let before = marks[channel].clamped(simd, without);
                    change += clamped * clamped - before * before;
                    products[channel] += weight * clamped;
                    let counts = clamped.simd_eq(with);
                    squares += counts.select(weight * weight, zero);
                }
            }
        }
        let mut by_channel = [0.0; 4];
        for (sum, &product) in by_channel.iter_mut().zip(&products) {
            *sum = total(product);
        }
        Sums { error: total(change), by_channel, weight: total(squares) / CHANNELS as f32 }
    }

    /// What a Gaussian does here that is still part of the errors, and how that changes with it.
    pub(crate) fn slopes(&self, gaussian: &Gaussian, model: ColorModel) -> Slopes {
        let level = self.level.unwrap_or_else(Level::new);
        let (sums, by_displacement) = match self.channels {
            1 => dispatch!(level, simd => self.slopes_with::<_, 1>(simd, gaussian)),
            2 => dispatch!(level, simd => self.slopes_with::<_, 2>(simd, gaussian)),
            3 => dispatch!(level, simd => self.slopes_with::<_, 3>(simd, gaussian)),
            _ => dispatch!(level, simd => self.slopes_with::<_, 4>(simd, gaussian)),
        };
        let by_axis = lattice::to_axes(sums.by_channel, model);
        let axes = lattice::to_axes(gaussian.color, model);
        let change = Change { error: sums.error, by_axis, weight: sums.weight, axes };
        Slopes { change, by_displacement }
    }

    #[inline(always)]
    fn slopes_with<S: Simd, const CHANNELS: usize>(
        &self,
        simd: S,
        gaussian: &Gaussian,
    ) -> (Sums, Displacement) {
        let weights = Weights::new(gaussian);
        let [vectors, rows] = self.size;
        let zero = f32x16::splat(simd, 0.0);
        let (mut squares, mut products) = (zero, [zero; CHANNELS]);
        let (mut first, mut second) = ([zero; 2], [zero; 3]);
        for row in 0..rows {
            let y = self.corner[1] + row;
            let span = weights.span(self.corner[0], y, vectors);
            let x = self.corner[0] + span.start * LANES;
            let marks = self.marks::<CHANNELS>(row, &span);
            for (index, errors) in self.line::<CHANNELS>(row, &span).iter().enumerate() {
                let [u, v] = weights.place(simd, x + index * LANES, y);
                let root = root(simd, [u, v]);
                let cube = root * root * root;
                let weight = cube * root;
                let mut square = weight * weight;
                let mut along = zero;
                for channel in 0..CHANNELS {
                    let mut error = f32x16::load_array_ref(simd, &errors[channel]);
                    if let Some(marks) = marks.get(index) {
                        let clamped = marks[channel].clamped(simd, error);
                        let counts = clamped.simd_eq(error);
                        square -= counts.select(zero, weight * weight * (1.0 / CHANNELS as f32));
                        error = clamped;
                    }
                    products[channel] += weight * error;
                    along += error * gaussian.color[channel];
                }
                squares += square;
                // dweight/dq is -cube / 2, and q is u^2 + v^2.
                let slope = along * cube;
                let (by_u, by_v) = (slope * u, slope * v);
                first[0] += by_u;
                first[1] += by_v;
                second[0] += by_u * u;
                second[1] += by_u * v;
                second[2] += by_v * v;
            }
        }
        let mut sums = Sums { error: 0.0, by_channel: [0.0; 4], weight: total(squares) };
        for (channel, &product) in products.iter().enumerate() {
            let (color, product) = (gaussian.color[channel], total(product));
            sums.error += color * (2.0 * product - color * sums.weight);
            sums.by_channel[channel] = product;
        }
        let along: f32 = sums.by_channel.iter().zip(gaussian.color).map(|(b, c)| b * c).sum();
        let moments = Moments { first: first.map(total), second: second.map(total), along };
        (sums, moments.slopes(gaussian))
    }

    /// The errors of a part of a row.
    #[inline(always)]
    fn line<const CHANNELS: usize>(&self, row: usize, span: &Range<usize>) -> &[[Lanes; CHANNELS]] {
        let line = self.errors.as_chunks::<CHANNELS>().0;
        line[row * self.size[0]..][..self.size[0]].get(span.clone()).unwrap_or_default()
    }

    /// The marks of a part of a row; none if all errors count.
    #[inline(always)]
    fn marks<const CHANNELS: usize>(
        &self,
        row: usize,
        span: &Range<usize>,
    ) -> &[[Marks; CHANNELS]] {
        let lines = self.marks.as_chunks::<CHANNELS>().0;
        let start = row * self.size[0];
        lines.get(start + span.start..start + span.end).unwrap_or_default()
    }
}

/// Sums over a patch.
#[derive(Clone, Copy, Debug)]
struct Sums {
    error: f32,
    /// Half of the derivative by each channel.
    by_channel: [f32; 4],
    weight: f32,
}

#[inline(always)]
fn total<S: Simd>(vector: f32x16<S>) -> f32 {
    vector.to_array().iter().sum()
}
