//! The residuals around one Gaussian, and how the error, the sum of their squares times their
//! sensitivities, depends on it.

use core::ops::Range;

use fearless_simd::{Level, Simd, dispatch, f32x16, prelude::*};

use super::kernel_weights::{KernelWeights, LANES, Lanes, kernel_root};
use super::quadratic_model::{GeometryChange, GeometryErrorSums};
use super::residuals::{ClampMask, Residuals};
use crate::coding::entropy::to_axes;
use crate::color::ColorModel;
use crate::gaussian::Gaussian;

/// The residuals of a rectangle around one Gaussian.
#[derive(Debug, Default)]
pub(crate) struct Window {
    /// First column and row, in pixels.
    corner: [usize; 2],
    /// Number of vectors in a row, and number of rows.
    size: [usize; 2],
    channels: usize,
    /// Row by row, in each row vector by vector, and for each vector channel by channel.
    residuals: Vec<Lanes>,
    /// In the layout of `residuals`; empty if no residuals are ignored.
    masks: Vec<ClampMask>,
    /// The sensitivities of pixels, row by row, in each row vector by vector.
    sensitivities: Vec<Lanes>,
    level: Option<Level>,
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

impl Window {
    /// Loads the residuals of the window of a Gaussian. Returns false if the window is outside the
    /// picture.
    pub(crate) fn load(&mut self, residuals: &Residuals, gaussian: &Gaussian) -> bool {
        let Some([columns, rows]) = residuals.window(gaussian) else { return false };
        let (vectors, channels) = (columns.len().div_ceil(LANES), residuals.channels());
        self.corner = [columns.start, rows.start];
        self.size = [vectors, rows.len()];
        self.channels = channels;
        self.level = Some(residuals.level());
        // Old values are overwritten, so that they need not be cleared.
        self.residuals.resize(vectors * rows.len() * channels, [0.0; LANES]);
        self.sensitivities.clear();
        self.masks.clear();
        let lines = self.residuals.chunks_exact_mut(vectors * channels);
        for (index, (y, line)) in rows.zip(lines).enumerate() {
            let x = columns.start;
            self.sensitivities.extend_from_slice(residuals.sensitivities(x, y, vectors));
            for channel in 0..channels {
                let values = residuals.vectors(x, y, channel, vectors);
                let places = line[channel..].iter_mut().step_by(channels);
                places.zip(values).for_each(|(place, value)| *place = *value);
                if let Some(masks) = residuals.ignored(x, y, channel, vectors) {
                    self.masks.resize(self.size[1] * vectors * channels, ClampMask::NONE);
                    let line = &mut self.masks[index * vectors * channels + channel..];
                    line.iter_mut()
                        .step_by(channels)
                        .zip(masks)
                        .for_each(|(place, mask)| *place = mask);
                }
            }
        }
        true
    }

    /// Whether the source is black or white somewhere in the window, where residuals are clamped.
    pub(crate) fn is_clamped(&self) -> bool {
        !self.masks.is_empty()
    }

    /// Removes a Gaussian from the rendering.
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
        let weights = KernelWeights::new(gaussian);
        let [vectors, rows] = self.size;
        for row in 0..rows {
            let y = self.corner[1] + row;
            let span = weights.span(self.corner[0], y, vectors);
            let x = self.corner[0] + span.start * LANES;
            let line =
                &mut self.residuals.as_chunks_mut::<CHANNELS>().0[row * vectors..][..vectors];
            let line = line.get_mut(span).unwrap_or_default();
            for (index, residuals) in line.iter_mut().enumerate() {
                let weight = weights.at(simd, x + index * LANES, y);
                for (residuals, color) in residuals.iter_mut().zip(gaussian.color) {
                    (f32x16::load_array_ref(simd, residuals) - weight * color)
                        .store_array(residuals);
                }
            }
        }
    }

    /// The change of error by a Gaussian that is not part of the rendering.
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

    /// [`Window::change`] for a number of channels.
    #[inline(always)]
    fn sums<S: Simd, const CHANNELS: usize>(&self, simd: S, gaussian: &Gaussian) -> WindowSums {
        if self.is_clamped() {
            return self.clamped_sums::<S, CHANNELS>(simd, gaussian);
        }
        let weights = KernelWeights::new(gaussian);
        let [vectors, rows] = self.size;
        let mut squares = f32x16::splat(simd, 0.0);
        let mut products = [squares; CHANNELS];
        for row in 0..rows {
            let y = self.corner[1] + row;
            let span = weights.span(self.corner[0], y, vectors);
            let x = self.corner[0] + span.start * LANES;
            let lines =
                self.line::<CHANNELS>(row, &span).iter().zip(self.sensitivities(row, &span));
            for (index, (residuals, sensitivities)) in lines.enumerate() {
                let weight = weights.at(simd, x + index * LANES, y);
                let counted = weight * f32x16::load_array_ref(simd, sensitivities);
                squares += counted * weight;
                for (product, residuals) in products.iter_mut().zip(residuals) {
                    *product += counted * f32x16::load_array_ref(simd, residuals);
                }
            }
        }
        let squared_weights = lane_sum(squares);
        let mut sums = WindowSums { error: 0.0, by_channel: [0.0; 4], squared_weights };
        for (channel, &product) in products.iter().enumerate() {
            let (color, product) = (gaussian.color[channel], lane_sum(product));
            sums.error += color * (color * squared_weights + 2.0 * product);
            sums.by_channel[channel] = color * squared_weights + product;
        }
        sums
    }

    /// [`Window::sums`] where residuals are clamped.
    #[inline(always)]
    fn clamped_sums<S: Simd, const CHANNELS: usize>(
        &self,
        simd: S,
        gaussian: &Gaussian,
    ) -> WindowSums {
        let weights = KernelWeights::new(gaussian);
        let [vectors, rows] = self.size;
        let zero = f32x16::splat(simd, 0.0);
        let (mut change, mut squares, mut products) = (zero, zero, [zero; CHANNELS]);
        for row in 0..rows {
            let y = self.corner[1] + row;
            let span = weights.span(self.corner[0], y, vectors);
            let x = self.corner[0] + span.start * LANES;
            let lines =
                self.line::<CHANNELS>(row, &span).iter().zip(self.masks::<CHANNELS>(row, &span));
            let lines = lines.zip(self.sensitivities(row, &span));
            for (index, ((residuals, masks), sensitivities)) in lines.enumerate() {
                let weight = weights.at(simd, x + index * LANES, y);
                let sensitivity = f32x16::load_array_ref(simd, sensitivities);
                for channel in 0..CHANNELS {
                    let without = f32x16::load_array_ref(simd, &residuals[channel]);
                    let with = without + weight * gaussian.color[channel];
                    let clamped = masks[channel].clamped(simd, with);
                    let before = masks[channel].clamped(simd, without);
                    change += (clamped * clamped - before * before) * sensitivity;
                    products[channel] += weight * sensitivity * clamped;
                    let counts = clamped.simd_eq(with);
                    squares += counts.select(weight * sensitivity * weight, zero);
                }
            }
        }
        let mut by_channel = [0.0; 4];
        for (sum, &product) in by_channel.iter_mut().zip(&products) {
            *sum = lane_sum(product);
        }
        WindowSums {
            error: lane_sum(change),
            by_channel,
            squared_weights: lane_sum(squares) / CHANNELS as f32,
        }
    }

    /// The derivatives of the error by a Gaussian that is part of the rendering.
    pub(crate) fn gradient(&self, gaussian: &Gaussian, model: ColorModel) -> ErrorGradient {
        let level = self.level.unwrap_or_else(Level::new);
        let (sums, by_geometry, sensitivity) = match self.channels {
            1 => dispatch!(level, simd => self.gradient_with::<_, 1>(simd, gaussian)),
            2 => dispatch!(level, simd => self.gradient_with::<_, 2>(simd, gaussian)),
            3 => dispatch!(level, simd => self.gradient_with::<_, 3>(simd, gaussian)),
            _ => dispatch!(level, simd => self.gradient_with::<_, 4>(simd, gaussian)),
        };
        ErrorGradient { change: sums.change(gaussian, model), by_geometry, sensitivity }
    }

    /// [`Window::gradient`] for a number of channels.
    #[inline(always)]
    fn gradient_with<S: Simd, const CHANNELS: usize>(
        &self,
        simd: S,
        gaussian: &Gaussian,
    ) -> (WindowSums, GeometryChange, f32) {
        let weights = KernelWeights::new(gaussian);
        let [vectors, rows] = self.size;
        let zero = f32x16::splat(simd, 0.0);
        let (mut squares, mut products) = (zero, [zero; CHANNELS]);
        let (mut first, mut second) = ([zero; 2], [zero; 3]);
        let (mut all, mut all_counted) = (zero, zero);
        for row in 0..rows {
            let y = self.corner[1] + row;
            let span = weights.span(self.corner[0], y, vectors);
            let x = self.corner[0] + span.start * LANES;
            let masks = self.masks::<CHANNELS>(row, &span);
            let lines =
                self.line::<CHANNELS>(row, &span).iter().zip(self.sensitivities(row, &span));
            for (index, (residuals, sensitivities)) in lines.enumerate() {
                let [u, v] = weights.local(simd, x + index * LANES, y);
                let root = kernel_root(simd, [u, v]);
                let weight = root * root;
                let sensitivity = f32x16::load_array_ref(simd, sensitivities);
                let counted = weight * sensitivity;
                let mut square = counted * weight;
                all += weight * weight;
                all_counted += square;
                let mut along = zero;
                for channel in 0..CHANNELS {
                    let mut residual = f32x16::load_array_ref(simd, &residuals[channel]);
                    if let Some(masks) = masks.get(index) {
                        let clamped = masks[channel].clamped(simd, residual);
                        let counts = clamped.simd_eq(residual);
                        square -= counts.select(zero, counted * weight * (1.0 / CHANNELS as f32));
                        residual = clamped;
                    }
                    products[channel] += counted * residual;
                    along += residual * gaussian.color[channel];
                }
                squares += square;
                // dweight/dq = -root / 2, and q = u^2 + v^2.
                let slope = along * sensitivity * root;
                let (by_u, by_v) = (slope * u, slope * v);
                first[0] += by_u;
                first[1] += by_v;
                second[0] += by_u * u;
                second[1] += by_u * v;
                second[2] += by_v * v;
            }
        }
        let squared_weights = lane_sum(squares);
        let mut sums = WindowSums { error: 0.0, by_channel: [0.0; 4], squared_weights };
        for (channel, &product) in products.iter().enumerate() {
            let (color, product) = (gaussian.color[channel], lane_sum(product));
            sums.error += color * (2.0 * product - color * squared_weights);
            sums.by_channel[channel] = product;
        }
        let weighted: f32 = sums.by_channel.iter().zip(gaussian.color).map(|(b, c)| b * c).sum();
        let geometry = GeometryErrorSums {
            first: first.map(lane_sum),
            second: second.map(lane_sum),
            weighted,
        };
        // Without any weight in the picture, nothing depends on it.
        let all = lane_sum(all);
        let sensitivity = if all > 0.0 { lane_sum(all_counted) / all } else { 1.0 };
        (sums, geometry.gradient(gaussian), sensitivity)
    }

    /// The sensitivities of a span of a row.
    #[inline(always)]
    fn sensitivities(&self, row: usize, span: &Range<usize>) -> &[Lanes] {
        self.sensitivities[row * self.size[0]..][..self.size[0]]
            .get(span.clone())
            .unwrap_or_default()
    }

    /// The residuals of a span of a row.
    #[inline(always)]
    fn line<const CHANNELS: usize>(&self, row: usize, span: &Range<usize>) -> &[[Lanes; CHANNELS]] {
        let line = self.residuals.as_chunks::<CHANNELS>().0;
        line[row * self.size[0]..][..self.size[0]].get(span.clone()).unwrap_or_default()
    }

    /// The masks of a span of a row; empty if no residuals are clamped.
    #[inline(always)]
    fn masks<const CHANNELS: usize>(
        &self,
        row: usize,
        span: &Range<usize>,
    ) -> &[[ClampMask; CHANNELS]] {
        let lines = self.masks.as_chunks::<CHANNELS>().0;
        let start = row * self.size[0];
        lines.get(start + span.start..start + span.end).unwrap_or_default()
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
