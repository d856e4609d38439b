//! The residuals around one Gaussian, and how the error, the sum of their squares times their
//! sensitivities, depends on it.

use fearless_simd::{Level, Simd, dispatch, f32x16, prelude::*};

use super::kernel_weights::{KernelWeights, LANES, kernel_root};
use super::quadratic_model::{GeometryChange, GeometryErrorSums};
use super::residuals::{Residuals, StoredLanes, load, store};
use crate::coding::entropy::to_axes;
use crate::color::ColorModel;
use crate::gaussian::Gaussian;

/// The residuals of a rectangle around one Gaussian, without it.
#[derive(Debug)]
pub(crate) struct Window<'a> {
    all: &'a Residuals,
    level: Level,
    /// First column and row, in pixels.
    corner: [usize; 2],
    /// Number of vectors in a row, and number of rows.
    size: [usize; 2],
    /// Row by row, in each row vector by vector, and for each vector channel by channel.
    residuals: Vec<StoredLanes>,
}

/// How much a Gaussian changes the error of its window, and the derivatives by its colour.
#[derive(Clone, Copy, Debug)]
pub(crate) struct ErrorChange {
    /// The error with the Gaussian, minus that without it.
    pub(crate) error: f32,
    /// Half of the derivative of `error` by the amplitude along each colour axis.
    pub(crate) by_axis: [f32; 4],
    /// The sum of squared weights times sensitivities, which is half of the second derivative by each
    /// amplitude.
    pub(crate) squared_weights: f32,
    /// The Gaussian's amplitudes along the colour axes.
    amplitudes: [f32; 4],
}

impl ErrorChange {
    /// The change of error for other amplitudes, `codes` times `units`, where nothing is clamped.
    pub(crate) fn with_color(&self, codes: [i32; 4], units: [f32; 4]) -> f32 {
        let axes = codes.iter().zip(units).zip(self.by_axis).zip(self.amplitudes);
        axes.map(|(((&code, unit), by_axis), present)| {
            let amplitude = code as f32 * unit;
            // Half of the derivative at amplitude 0.
            let at_zero = by_axis - present * self.squared_weights;
            amplitude * (amplitude * self.squared_weights + 2.0 * at_zero)
        })
        .sum()
    }
}

/// The derivatives of the squared error by a Gaussian that is part of the rendering.
#[derive(Clone, Copy, Debug)]
pub(crate) struct ErrorGradient {
    /// The change of error by the Gaussian, with the derivatives by its colour.
    pub(crate) change: ErrorChange,
    /// The derivatives by the components of a [`GeometryChange`].
    pub(crate) by_geometry: GeometryChange,
    /// The mean sensitivity of the pixels, each weighted by the squared weight of the Gaussian.
    pub(crate) sensitivity: f32,
}

impl<'a> Window<'a> {
    /// A window that is still empty.
    pub(crate) fn new(all: &'a Residuals) -> Self {
        Self { all, level: all.level(), corner: [0; 2], size: [0; 2], residuals: Vec::new() }
    }

    /// Takes a Gaussian out of the rendering in its window. Returns the derivatives of the error by the
    /// Gaussian before; `None` if its window is outside the picture.
    pub(crate) fn without(
        &mut self,
        gaussian: &Gaussian,
        model: ColorModel,
    ) -> Option<ErrorGradient> {
        let [columns, rows] = self.all.window(gaussian)?;
        self.corner = [columns.start, rows.start];
        self.size = [columns.len().div_ceil(LANES), rows.len()];
        let [vectors, rows] = self.size;
        // Old values are overwritten, so that they need not be cleared.
        self.residuals.resize(vectors * rows * self.all.channels(), [0; LANES]);
        let level = self.level;
        let (sums, by_geometry, sensitivity) = match self.all.channels() {
            1 => dispatch!(level, simd => self.without_with::<_, 1>(simd, gaussian)),
            2 => dispatch!(level, simd => self.without_with::<_, 2>(simd, gaussian)),
            3 => dispatch!(level, simd => self.without_with::<_, 3>(simd, gaussian)),
            _ => dispatch!(level, simd => self.without_with::<_, 4>(simd, gaussian)),
        };
        Some(ErrorGradient { change: sums.change(gaussian, model), by_geometry, sensitivity })
    }

    /// [`Window::without`] for a number of channels.
    #[inline(always)]
    #[expect(clippy::needless_range_loop, reason = "see `encode/fit/training_tile.rs`")]
    fn without_with<S: Simd, const CHANNELS: usize>(
        &mut self,
        simd: S,
        gaussian: &Gaussian,
    ) -> (WindowSums, GeometryChange, f32) {
        let weights = KernelWeights::new(gaussian);
        let ([left, top], [vectors, rows]) = (self.corner, self.size);
        let places = self.residuals.as_chunks_mut::<CHANNELS>().0;
        let zero = f32x16::splat(simd, 0.0);
        let (mut squares, mut products, mut all) = (zero, [zero; CHANNELS], zero);
        let (mut first, mut second) = ([zero; 2], [zero; 3]);
        for row in 0..rows {
            let y = top + row;
            let span = weights.span(left, y, vectors);
            for vector in 0..vectors {
                let x = left + vector * LANES;
                let place = &mut places[row * vectors + vector];
                let mut residuals = [zero; CHANNELS];
                for channel in 0..CHANNELS {
                    residuals[channel] = self.all.vector(simd, x, y, channel);
                }
                if span.contains(&vector) {
                    let [u, v] = weights.local(simd, x, y);
                    let root = kernel_root(simd, [u, v]);
                    let weight = root * root;
                    let sensitivity = f32x16::load_array_ref(simd, self.all.sensitivities(x, y));
                    let counted = weight * sensitivity;
                    squares = counted.mul_add_precise(weight, squares);
                    all = weight.mul_add_precise(weight, all);
                    let mut along = zero;
                    for channel in 0..CHANNELS {
                        let (residual, color) = (residuals[channel], gaussian.color[channel]);
                        products[channel] = counted.mul_add_precise(residual, products[channel]);
                        along = residual.mul_add_precise(color, along);
                        residuals[channel] = weight.mul_add_precise(-color, residual);
                    }
                    // dweight/dq = -root / 2, and q = u^2 + v^2.
                    let slope = along * sensitivity * root;
                    let (by_u, by_v) = (slope * u, slope * v);
                    first[0] += by_u;
                    first[1] += by_v;
                    second[0] = by_u.mul_add_precise(u, second[0]);
                    second[1] = by_u.mul_add_precise(v, second[1]);
                    second[2] = by_v.mul_add_precise(v, second[2]);
                }
                for channel in 0..CHANNELS {
                    store(simd, residuals[channel], &mut place[channel]);
                }
            }
        }
        let squared_weights = lane_sum(squares);
        let mut sums = WindowSums { error: 0.0, by_channel: [0.0; 4], squared_weights };
        let mut weighted = 0.0;
        for channel in 0..CHANNELS {
            let (color, product) = (gaussian.color[channel], lane_sum(products[channel]));
            sums.error += color * (2.0 * product - color * squared_weights);
            sums.by_channel[channel] = product;
            weighted += color * product;
        }
        let geometry = GeometryErrorSums {
            first: [lane_sum(first[0]), lane_sum(first[1])],
            second: [lane_sum(second[0]), lane_sum(second[1]), lane_sum(second[2])],
            weighted,
        };
        // Without any weight in the picture, nothing depends on it.
        let all = lane_sum(all);
        let sensitivity = if all > 0.0 { squared_weights / all } else { 1.0 };
        (sums, geometry.gradient(gaussian), sensitivity)
    }

    /// The change of error by a Gaussian that is not part of the rendering.
    pub(crate) fn change(&self, gaussian: &Gaussian, model: ColorModel) -> ErrorChange {
        let level = self.level;
        let sums = match self.all.channels() {
            1 => dispatch!(level, simd => self.sums::<_, 1>(simd, gaussian)),
            2 => dispatch!(level, simd => self.sums::<_, 2>(simd, gaussian)),
            3 => dispatch!(level, simd => self.sums::<_, 3>(simd, gaussian)),
            _ => dispatch!(level, simd => self.sums::<_, 4>(simd, gaussian)),
        };
        sums.change(gaussian, model)
    }

    /// [`Window::change`] for a number of channels.
    #[inline(always)]
    #[expect(clippy::needless_range_loop, reason = "see `encode/fit/training_tile.rs`")]
    fn sums<S: Simd, const CHANNELS: usize>(&self, simd: S, gaussian: &Gaussian) -> WindowSums {
        let weights = KernelWeights::new(gaussian);
        let ([left, top], [vectors, rows]) = (self.corner, self.size);
        let places = self.residuals.as_chunks::<CHANNELS>().0;
        let zero = f32x16::splat(simd, 0.0);
        let (mut squares, mut products) = (zero, [zero; CHANNELS]);
        for row in 0..rows {
            let y = top + row;
            for vector in weights.span(left, y, vectors) {
                let x = left + vector * LANES;
                let weight = weights.at(simd, x, y);
                let sensitivity = f32x16::load_array_ref(simd, self.all.sensitivities(x, y));
                let counted = weight * sensitivity;
                squares = counted.mul_add_precise(weight, squares);
                let residuals = &places[row * vectors + vector];
                for channel in 0..CHANNELS {
                    let residual = load(simd, &residuals[channel]);
                    products[channel] = counted.mul_add_precise(residual, products[channel]);
                }
            }
        }
        let squared_weights = lane_sum(squares);
        let mut sums = WindowSums { error: 0.0, by_channel: [0.0; 4], squared_weights };
        for channel in 0..CHANNELS {
            let (color, product) = (gaussian.color[channel], lane_sum(products[channel]));
            sums.error += color * (color * squared_weights + 2.0 * product);
            sums.by_channel[channel] = color * squared_weights + product;
        }
        sums
    }
}

/// An [`ErrorChange`] by channels instead of colour axes.
#[derive(Clone, Copy, Debug)]
struct WindowSums {
    error: f32,
    /// Half of the derivative of `error` by the amplitude in each channel.
    by_channel: [f32; 4],
    squared_weights: f32,
}

impl WindowSums {
    fn change(&self, gaussian: &Gaussian, model: ColorModel) -> ErrorChange {
        ErrorChange {
            error: self.error,
            by_axis: to_axes(self.by_channel, model),
            squared_weights: self.squared_weights,
            amplitudes: to_axes(gaussian.color, model),
        }
    }
}

#[inline(always)]
fn lane_sum<S: Simd>(vector: f32x16<S>) -> f32 {
    vector.to_array().iter().sum()
}

#[cfg(test)]
mod tests;
