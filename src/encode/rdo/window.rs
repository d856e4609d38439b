//! The part of a picture that one Gaussian shows in, and what changes there with it.

use core::ops::Range;

use fearless_simd::{Level, Simd, dispatch, f32x16, prelude::*};

use super::quadratic_model::{GeometryChange, GeometryErrorSums};
use super::residuals::{LANES, Lanes, Marks, PlacedKernel, Residuals, root, weight};
use crate::coding::entropy::to_axes;
use crate::color::ColorModel;
use crate::gaussian::Gaussian;

/// The surroundings of one Gaussian.
#[derive(Debug, Default)]
pub(crate) struct Window {
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

/// What a Gaussian does to its window.
#[derive(Clone, Copy, Debug)]
pub(crate) struct ErrorChange {
    /// Of the sum of squared errors, against leaving it out.
    pub(crate) error: f32,
    /// Half of the derivative by the amplitude along each colour axis.
    pub(crate) by_axis: [f32; 4],
    /// Sum of squared weights: half of the second derivative.
    pub(crate) weight: f32,
    /// The amplitudes along the colour axes.
    axes: [f32; 4],
}

impl ErrorChange {
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

/// How squared errors change with what a Gaussian is.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Slopes {
    /// What the Gaussian does as it is.
    pub(crate) change: ErrorChange,
    /// Derivatives by a [`GeometryChange`].
    pub(crate) by_geometry: GeometryChange,
}

impl Window {
    /// Cuts out the surroundings of a Gaussian. Whether there are any.
    pub(crate) fn load(&mut self, residuals: &Residuals, gaussian: &Gaussian) -> bool {
        let Some([columns, rows]) = residuals.bounds(gaussian) else { return false };
        let (vectors, channels) = (columns.len().div_ceil(LANES), residuals.channels());
        self.corner = [columns.start, rows.start];
        self.size = [vectors, rows.len()];
        self.channels = channels;
        self.level = Some(residuals.level());
        let length = vectors * rows.len() * channels;
        self.errors.clear();
        self.errors.reserve_exact(length);
        self.marks.clear();
        let lines = rows.flat_map(|y| (0..vectors).map(move |vector| (y, vector)));
        let parts = lines.flat_map(|(y, vector)| {
            let x = columns.start + vector * LANES;
            (0..channels).map(move |channel| residuals.vector(x, y, channel))
        });
        let mut is_clamped = false;
        for (errors, marks) in parts.clone() {
            self.errors.push(*errors);
            is_clamped |= *marks != [0; LANES];
        }
        if is_clamped {
            self.marks.reserve_exact(length);
            self.marks.extend(parts.map(|(_, marks)| Marks::new(marks)));
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
        let weights = PlacedKernel::new(gaussian);
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
    pub(crate) fn change(&self, gaussian: &Gaussian, model: ColorModel) -> ErrorChange {
        let level = self.level.unwrap_or_else(Level::new);
        let sums = match self.channels {
            1 => dispatch!(level, simd => self.sums::<_, 1>(simd, gaussian)),
            2 => dispatch!(level, simd => self.sums::<_, 2>(simd, gaussian)),
            3 => dispatch!(level, simd => self.sums::<_, 3>(simd, gaussian)),
            _ => dispatch!(level, simd => self.sums::<_, 4>(simd, gaussian)),
        };
        sums.change(gaussian, model)
    }

    #[inline(always)]
    fn sums<S: Simd, const CHANNELS: usize>(&self, simd: S, gaussian: &Gaussian) -> Sums {
        if self.is_clamped() {
            return self.clamped_sums::<S, CHANNELS>(simd, gaussian);
        }
        let weights = PlacedKernel::new(gaussian);
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
        let weights = PlacedKernel::new(gaussian);
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
        let (sums, by_geometry) = match self.channels {
            1 => dispatch!(level, simd => self.slopes_with::<_, 1>(simd, gaussian)),
            2 => dispatch!(level, simd => self.slopes_with::<_, 2>(simd, gaussian)),
            3 => dispatch!(level, simd => self.slopes_with::<_, 3>(simd, gaussian)),
            _ => dispatch!(level, simd => self.slopes_with::<_, 4>(simd, gaussian)),
        };
        Slopes { change: sums.change(gaussian, model), by_geometry }
    }

    #[inline(always)]
    fn slopes_with<S: Simd, const CHANNELS: usize>(
        &self,
        simd: S,
        gaussian: &Gaussian,
    ) -> (Sums, GeometryChange) {
        let weights = PlacedKernel::new(gaussian);
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
                let weight = weight(root);
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
                // dweight/dq is -root / 2, and q is u^2 + v^2.
                let slope = along * root;
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
        let moments =
            GeometryErrorSums { first: first.map(total), second: second.map(total), along };
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

/// Sums over a window.
#[derive(Clone, Copy, Debug)]
struct Sums {
    error: f32,
    /// Half of the derivative by each channel.
    by_channel: [f32; 4],
    weight: f32,
}

impl Sums {
    fn change(&self, gaussian: &Gaussian, model: ColorModel) -> ErrorChange {
        let by_axis = to_axes(self.by_channel, model);
        let axes = to_axes(gaussian.color, model);
        ErrorChange { error: self.error, by_axis, weight: self.weight, axes }
    }
}

#[inline(always)]
fn total<S: Simd>(vector: f32x16<S>) -> f32 {
    vector.to_array().iter().sum()
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::color::ColorModel;
    use crate::encode::raster::Raster;
    use crate::encode::source::Source;

    const WIDTH: usize = 45;
    const HEIGHT: usize = 37;

    /// A source with black and white in it, if wanted, its raster, and a rendering.
    fn scene(channels: usize, clamped: bool) -> (Vec<u8>, Vec<f32>) {
        let mut random = fastrand::Rng::with_seed(3);
        let source = (0..WIDTH * HEIGHT * channels)
            .map(|_| match random.u8(..) {
                value @ (0..40 | 216..) if clamped => {
                    if value < 40 {
                        0
                    } else {
                        255
                    }
                }
                value => value.clamp(1, 254),
            })
            .collect();
        let rendering = (0..WIDTH * HEIGHT * channels).map(|_| random.f32() * 1.4 - 0.2).collect();
        (source, rendering)
    }

    fn gaussians() -> Vec<Gaussian> {
        let gaussian =
            |center, cholesky| Gaussian { center, cholesky, color: [0.3, -0.2, 0.1, 0.25] };
        vec![
            gaussian([20.3, 17.8], [3.0, 1.0, 2.0]),
            gaussian([2.0, 36.0], [6.0, -9.0, 0.5]),
            gaussian([44.6, 10.0], [0.4, 0.0, 0.4]),
            gaussian([22.0, 18.0], [200.0, 100.0, 90.0]),
        ]
    }

    /// The quartic kernel of a Gaussian at a pixel.
    fn plain_weight(gaussian: &Gaussian, pixel: usize) -> f64 {
        let [l11, l21, l22] = gaussian.cholesky.map(f64::from);
        let (x, y) = (pixel % WIDTH, pixel / WIDTH);
        let u = (x as f64 + 0.5 - f64::from(gaussian.center[0])) / l11;
        let v = (y as f64 + 0.5 - f64::from(gaussian.center[1]) - l21 * u) / l22;
        (1.0 - (u * u + v * v) / 4.0).max(0.0).powi(2)
    }

    /// The sum of squared errors with a Gaussian added to the rendering `factor` times, in f64.
    fn plain(
        (source, rendering): &(Vec<u8>, Vec<f32>),
        channels: usize,
        gaussian: &Gaussian,
        factor: f64,
    ) -> f64 {
        let mut sum = 0.0;
        for (at, &sample) in source.iter().enumerate() {
            let (pixel, channel) = (at / channels, at % channels);
            let weight = plain_weight(gaussian, pixel);
            let value = f64::from(rendering[channel * WIDTH * HEIGHT + pixel])
                + factor * weight * f64::from(gaussian.color[channel]);
            let error = value - f64::from(sample) / 255.0;
            let counts = match sample {
                0 => error.max(0.0),
                255 => error.min(0.0),
                _ => error,
            };
            sum += counts * counts;
        }
        sum
    }

    fn residuals((source, rendering): &(Vec<u8>, Vec<f32>), model: ColorModel) -> Residuals {
        let source = Source::new_u8(WIDTH as u32, HEIGHT as u32, model, source).expect("sound");
        let raster = Raster::new(&source);
        let mut residuals = Residuals::new(&raster);
        residuals.set(&raster, 0, rendering);
        residuals
    }

    const MODELS: [ColorModel; 4] =
        [ColorModel::Gray, ColorModel::GrayAlpha, ColorModel::Rgb, ColorModel::Rgba];

    #[test]
    fn changes_are_those_of_the_plain_sum() {
        for model in MODELS {
            for clamped in [false, true] {
                let scene = scene(model.channels(), clamped);
                let residuals = residuals(&scene, model);
                for gaussian in gaussians() {
                    let mut window = Window::default();
                    assert!(window.load(&residuals, &gaussian));
                    window.remove(&gaussian);
                    let found = f64::from(window.change(&gaussian, model).error);
                    let channels = model.channels();
                    let without = plain(&scene, channels, &gaussian, -1.0);
                    let with = plain(&scene, channels, &gaussian, 0.0);
                    let off = (found - (with - without)).abs();
                    assert!(
                        off < 1e-4 * with,
                        "{model:?} {clamped} {gaussian:?}: {found}, off {off}"
                    );
                }
            }
        }
    }

    #[test]
    fn slopes_are_the_derivatives_of_the_plain_sum() {
        for model in MODELS {
            for clamped in [false, true] {
                let scene = scene(model.channels(), clamped);
                let residuals = residuals(&scene, model);
                for gaussian in gaussians() {
                    let mut window = Window::default();
                    assert!(window.load(&residuals, &gaussian));
                    let slopes = window.slopes(&gaussian, model).by_geometry;
                    let none = GeometryChange::default();
                    let ways = [
                        (slopes.center[0], GeometryChange { center: [1.0, 0.0], ..none }),
                        (slopes.center[1], GeometryChange { center: [0.0, 1.0], ..none }),
                        (slopes.size, GeometryChange { size: 1.0, ..none }),
                        (slopes.ratio, GeometryChange { ratio: 1.0, ..none }),
                        (slopes.slant, GeometryChange { slant: 1.0, ..none }),
                    ];
                    for (slope, way) in ways {
                        let seen = derivative(&scene, model.channels(), &gaussian, &way);
                        let off = (f64::from(slope) - seen).abs();
                        assert!(
                            off < 2e-2 + 1e-2 * seen.abs(),
                            "{gaussian:?} {way:?}: {slope}, {seen}"
                        );
                    }
                }
            }
        }
    }

    /// The derivative of the sum of squared errors along a way, by differences.
    fn derivative(
        scene: &(Vec<u8>, Vec<f32>),
        channels: usize,
        gaussian: &Gaussian,
        way: &GeometryChange,
    ) -> f64 {
        const STEP: f32 = 1e-3;
        // The Gaussian is part of the rendering: it goes, and the moved one comes.
        let mut without = scene.clone();
        let present = *gaussian;
        let at = |step: f32| {
            let moved = GeometryChange {
                center: way.center.map(|part| step * part),
                size: step * way.size,
                ratio: step * way.ratio,
                slant: step * way.slant,
            };
            moved.applied(&present)
        };
        subtract(&mut without.1, channels, gaussian);
        let ends = [STEP, -STEP].map(|step| plain(&without, channels, &at(step), 1.0));
        (ends[0] - ends[1]) / f64::from(2.0 * STEP)
    }

    fn subtract(rendering: &mut [f32], channels: usize, gaussian: &Gaussian) {
        for channel in 0..channels {
            for pixel in 0..WIDTH * HEIGHT {
                let weight = plain_weight(gaussian, pixel);
                rendering[channel * WIDTH * HEIGHT + pixel] -=
                    weight as f32 * gaussian.color[channel];
            }
        }
    }

    #[test]
    fn what_is_added_can_be_taken_away() {
        let scene = scene(3, true);
        let mut residuals = residuals(&scene, ColorModel::Rgb);
        for gaussian in gaussians() {
            residuals.add(&[(gaussian, 1.0)]);
            let mut window = Window::default();
            assert!(window.load(&residuals, &gaussian));
            window.remove(&gaussian);
            let found = f64::from(window.change(&gaussian, ColorModel::Rgb).error);
            residuals.add(&[(gaussian, -1.0)]);
            let expected = plain(&scene, 3, &gaussian, 1.0) - plain(&scene, 3, &gaussian, 0.0);
            assert!((found - expected).abs() < 1e-3, "{gaussian:?}: {found}, {expected}");
        }
        let nowhere = Gaussian { center: [-90.0, 3.0], ..gaussians()[0] };
        assert!(!Window::default().load(&residuals, &nowhere));
    }
}
