//! The residuals around one Gaussian, and how the error, the sum of their squares times their
//! perceptual weights, depends on it.

use core::array;
use core::ops::Range;

use fearless_simd::{Simd, dispatch, f32x16, prelude::*};
use rayon::prelude::*;

use super::kernel_weights::{KernelWeights, kernel_root};
use super::residuals::{Band, ROWS_PER_TASK, StoredLanes, is_shared, load, store, window};
use crate::coding::entropy::to_axes;
use crate::color::{ColorModel, with_channels};
use crate::encode::loss::ColorCurvature;
use crate::encode::mul_add::MulAdd;
use crate::encode::own_frame::{GeometryChange, GeometrySums};
use crate::encode::tiled_source::TiledSource;
use crate::gaussian::Gaussian;
use crate::simd::LANES;

// Constants: docs/tuning.md, "Search for a target".
/// The residuals of a window of up to so many pixels are kept without the Gaussian. Those of a wider
/// one would take as much memory as all others, and are computed again.
const MOST_KEPT: usize = 1 << 15;

/// The residuals of a rectangle around one Gaussian, without it.
#[derive(Debug)]
pub(crate) struct Window {
    place: Place,
    without: Without,
    /// As [`MOST_KEPT`].
    most_kept: usize,
}

/// A rectangle of the picture.
#[derive(Clone, Copy, Debug, Default)]
struct Place {
    /// First column and row, in pixels.
    corner: [usize; 2],
    /// Number of vectors in a row, and number of rows.
    size: [usize; 2],
}

/// A rectangle of a band.
#[derive(Clone, Copy, Debug)]
struct Frame<'a> {
    band: &'a Band<'a>,
    place: Place,
}

/// The residuals without a Gaussian.
#[derive(Debug, Default)]
struct Without {
    /// The residuals, if they are kept: row by row, in each row vector by vector, and for each vector
    /// channel by channel.
    kept: Vec<StoredLanes>,
    /// Otherwise, what was taken out.
    removed: Option<Removed>,
}

/// A Gaussian that is not part of the rendering.
#[derive(Clone, Copy, Debug)]
struct Removed {
    weights: KernelWeights,
    /// What it adds to the residuals, for a weight of 1.
    color: [f32; 4],
}

/// How much a Gaussian changes the error of its window, and the derivatives by its colour.
#[derive(Clone, Copy, Debug)]
pub(crate) struct ErrorChange {
    /// The error with the Gaussian, minus that without it.
    pub(crate) error: f32,
    /// Half of the derivative of `error` by the amplitude along each colour axis.
    pub(crate) by_axis: [f32; 4],
    /// The sum of squared weights times perceptual weights: times the [`ColorCurvature`], it is half of the
    /// second derivatives by the amplitudes.
    pub(crate) squared_weights: f32,
    /// The Gaussian's amplitudes along the colour axes.
    amplitudes: [f32; 4],
}

impl ErrorChange {
    /// The change of error for other amplitudes, `codes` times `units`, where nothing is clamped.
    pub(crate) fn with_color(
        &self,
        codes: [i32; 4],
        units: [f32; 4],
        curvature: &ColorCurvature,
    ) -> f32 {
        let amplitudes = array::from_fn(|axis| codes[axis] as f32 * units[axis]);
        let mut error = self.squared_weights * curvature.of(amplitudes);
        for (axis, row) in curvature.by_axis().iter().enumerate() {
            let present: f32 = row.iter().zip(self.amplitudes).map(|(a, b)| a * b).sum();
            // Half of the derivative where all amplitudes are 0.
            let at_zero = self.by_axis[axis] - self.squared_weights * present;
            error += 2.0 * amplitudes[axis] * at_zero;
        }
        error
    }
}

/// The derivatives of the squared error by a Gaussian that is part of the rendering.
#[derive(Clone, Copy, Debug)]
pub(crate) struct ErrorGradient {
    /// The change of error by the Gaussian, with the derivatives by its colour.
    pub(crate) change: ErrorChange,
    /// The derivatives by the components of a [`GeometryChange`].
    pub(crate) by_geometry: GeometryChange,
    /// The mean perceptual weight of the pixels, each weighted by the squared weight of the Gaussian.
    pub(crate) perceptual_weight: f32,
}

impl Default for Window {
    /// A window that is still empty.
    fn default() -> Self {
        Self { place: Place::default(), without: Without::default(), most_kept: MOST_KEPT }
    }
}

impl Window {
    /// Size in bytes of what the largest window for some Gaussians keeps.
    pub(crate) fn memory(tiled: &TiledSource, gaussians: &[Gaussian]) -> usize {
        let size = [tiled.width, tiled.height];
        let windows = gaussians.iter().filter_map(|gaussian| window(gaussian, size));
        let pixels =
            windows.map(|[columns, rows]| columns.len().next_multiple_of(LANES) * rows.len());
        let largest = pixels.filter(|&pixels| pixels <= MOST_KEPT).max().unwrap_or(0);
        largest * tiled.channels * size_of::<i16>()
    }

    /// Takes a Gaussian out of the rendering in its window, all rows of which `band` must have. Returns
    /// the derivatives of the error by the Gaussian before; `None` if its window is outside the picture.
    pub(crate) fn without(
        &mut self,
        band: &Band<'_>,
        gaussian: &Gaussian,
        model: ColorModel,
    ) -> Option<ErrorGradient> {
        let [columns, rows] = band.window(gaussian)?;
        self.place = Place {
            corner: [columns.start, rows.start],
            size: [columns.len().div_ceil(LANES), rows.len()],
        };
        let sums =
            with_channels!(CHANNELS = band.channels(), self.without_of::<CHANNELS>(band, gaussian));
        // Without any weight in the picture, nothing depends on it.
        let perceptual_weight =
            if sums.weights > 0.0 { sums.change.squares / sums.weights } else { 1.0 };
        Some(ErrorGradient {
            change: sums.change.with_present(gaussian, model, band.curvature()),
            by_geometry: sums.by_geometry(gaussian),
            perceptual_weight,
        })
    }

    /// [`Window::without`] for a number of channels.
    fn without_of<const CHANNELS: usize>(
        &mut self,
        band: &Band<'_>,
        gaussian: &Gaussian,
    ) -> GradientSums {
        let weights = KernelWeights::new(gaussian);
        let frame = self.frame(band);
        let [vectors, rows] = self.place.size;
        let is_kept = vectors * rows * LANES <= self.most_kept;
        let Without { kept, removed } = &mut self.without;
        // Old values are overwritten, so that they need not be cleared.
        kept.resize(if is_kept { vectors * rows * CHANNELS } else { 0 }, [0; LANES]);
        *removed = (!is_kept)
            .then_some(Removed { weights, color: band.curvature().times(gaussian.color) });
        let kept = kept.as_chunks_mut::<CHANNELS>().0;
        let of_rows = |(rows, kept)| frame.gradient_of_rows(gaussian, &weights, rows, kept);
        if !self.place.is_shared() {
            return of_rows((0..rows, is_kept.then_some(kept)));
        }
        let mut kept = kept.chunks_mut(ROWS_PER_TASK * vectors);
        let tasks: Vec<_> = self.place.tasks().map(|rows| (rows, kept.next())).collect();
        let sums: Vec<GradientSums> = tasks.into_par_iter().map(of_rows).collect();
        sums.into_iter().fold(GradientSums::default(), GradientSums::plus)
    }

    /// The change of error by a Gaussian that is not part of the rendering.
    pub(crate) fn change(
        &self,
        band: &Band<'_>,
        gaussian: &Gaussian,
        model: ColorModel,
    ) -> ErrorChange {
        let sums =
            with_channels!(CHANNELS = band.channels(), self.change_of::<CHANNELS>(band, gaussian));
        sums.with_absent(gaussian, model, band.curvature())
    }

    /// [`Window::change`] for a number of channels.
    fn change_of<const CHANNELS: usize>(&self, band: &Band<'_>, gaussian: &Gaussian) -> ChangeSums {
        let (frame, without) = (self.frame(band), &self.without);
        let weights = KernelWeights::new(gaussian);
        let of_rows = |rows| frame.change_of_rows::<CHANNELS>(&weights, rows, without);
        if !self.place.is_shared() {
            return of_rows(0..self.place.size[1]);
        }
        let tasks: Vec<Range<usize>> = self.place.tasks().collect();
        let sums: Vec<ChangeSums> = tasks.into_par_iter().map(of_rows).collect();
        sums.into_iter().fold(ChangeSums::default(), ChangeSums::plus)
    }

    fn frame<'a>(&self, band: &'a Band<'a>) -> Frame<'a> {
        Frame { band, place: self.place }
    }
}

impl Place {
    /// Whether threads share it.
    fn is_shared(&self) -> bool {
        let [vectors, rows] = self.size;
        is_shared(vectors * rows * LANES)
    }

    /// The rows of every task.
    fn tasks(&self) -> impl Iterator<Item = Range<usize>> {
        let [_, rows] = self.size;
        let starts = (0..rows).step_by(ROWS_PER_TASK);
        starts.map(move |start| start..rows.min(start + ROWS_PER_TASK))
    }
}

impl Frame<'_> {
    /// The first column of a vector, and its row in the picture.
    #[inline(always)]
    fn pixel(&self, row: usize, vector: usize) -> [usize; 2] {
        let [x, y] = self.place.corner;
        [x + vector * LANES, y + row]
    }

    /// The residuals of a vector.
    #[inline(always)]
    #[expect(clippy::needless_range_loop, reason = "see `encode/fit/training_tile.rs`")]
    fn residuals<S: Simd, const CHANNELS: usize>(
        &self,
        simd: S,
        [x, y]: [usize; 2],
    ) -> [f32x16<S>; CHANNELS] {
        let mut residuals = [f32x16::splat(simd, 0.0); CHANNELS];
        for channel in 0..CHANNELS {
            residuals[channel] = self.band.vector(simd, x, y, channel);
        }
        residuals
    }

    /// The residuals of a vector without a Gaussian.
    #[inline(always)]
    #[expect(clippy::needless_range_loop, reason = "see `encode/fit/training_tile.rs`")]
    fn residuals_without<S: Simd, const CHANNELS: usize>(
        &self,
        simd: S,
        [x, y]: [usize; 2],
        removed: &Removed,
    ) -> [f32x16<S>; CHANNELS] {
        let mut residuals = self.residuals(simd, [x, y]);
        let weight = removed.weights.at(simd, x, y);
        for channel in 0..CHANNELS {
            let color = removed.color[channel];
            residuals[channel] = weight.fused_mul_add(-color, residuals[channel]);
        }
        residuals
    }

    /// [`Frame::gradient_sums`], compiled once for all that call it.
    #[inline(never)]
    fn gradient_of_rows<const CHANNELS: usize>(
        &self,
        gaussian: &Gaussian,
        weights: &KernelWeights,
        rows: Range<usize>,
        kept: Option<&mut [[StoredLanes; CHANNELS]]>,
    ) -> GradientSums {
        dispatch!(self.band.level(), simd => self.gradient_sums(simd, gaussian, weights, rows, kept))
    }

    /// [`Frame::change_sums`], compiled once for all that call it.
    #[inline(never)]
    fn change_of_rows<const CHANNELS: usize>(
        &self,
        weights: &KernelWeights,
        rows: Range<usize>,
        without: &Without,
    ) -> ChangeSums {
        dispatch!(self.band.level(), simd =>
            self.change_sums::<_, CHANNELS>(simd, weights, rows, without))
    }

    /// The sums over some rows for the gradient by a Gaussian. The residuals without it are put into
    /// `kept`, which has those of these rows.
    #[inline(always)]
    #[expect(clippy::needless_range_loop, reason = "see `encode/fit/training_tile.rs`")]
    fn gradient_sums<S: Simd, const CHANNELS: usize>(
        &self,
        simd: S,
        gaussian: &Gaussian,
        weights: &KernelWeights,
        rows: Range<usize>,
        mut kept: Option<&mut [[StoredLanes; CHANNELS]]>,
    ) -> GradientSums {
        let Place { corner: [left, top], size: [vectors, _] } = self.place;
        let zero = f32x16::splat(simd, 0.0);
        let removed = self.band.curvature().times(gaussian.color);
        let (mut squares, mut products, mut all) = (zero, [zero; CHANNELS], zero);
        let (mut first, mut second) = ([zero; 2], [zero; 3]);
        for row in rows.clone() {
            let span = weights.span(left, top + row, vectors);
            // Residuals outside of the span are kept, too.
            let visited = if kept.is_some() { 0..vectors } else { span.clone() };
            for vector in visited {
                let [x, y] = self.pixel(row, vector);
                let mut residuals: [_; CHANNELS] = self.residuals(simd, [x, y]);
                if span.contains(&vector) {
                    let [u, v] = weights.local(simd, x, y);
                    let root = kernel_root(simd, [u, v]);
                    let weight = root * root;
                    let perceptual_weight =
                        f32x16::load_array_ref(simd, self.band.perceptual_weights(x, y));
                    let counted = weight * perceptual_weight;
                    squares = counted.fused_mul_add(weight, squares);
                    all = weight.fused_mul_add(weight, all);
                    let mut along = zero;
                    for channel in 0..CHANNELS {
                        let (residual, color) = (residuals[channel], gaussian.color[channel]);
                        products[channel] = counted.fused_mul_add(residual, products[channel]);
                        along = residual.fused_mul_add(color, along);
                        residuals[channel] = weight.fused_mul_add(-removed[channel], residual);
                    }
                    // dweight/dq = -root / 2, and q = u^2 + v^2.
                    let slope = along * perceptual_weight * root;
                    let (by_u, by_v) = (slope * u, slope * v);
                    first[0] += by_u;
                    first[1] += by_v;
                    second[0] = by_u.fused_mul_add(u, second[0]);
                    second[1] = by_u.fused_mul_add(v, second[1]);
                    second[2] = by_v.fused_mul_add(v, second[2]);
                }
                if let Some(kept) = &mut kept {
                    let place = &mut kept[(row - rows.start) * vectors + vector];
                    for channel in 0..CHANNELS {
                        store(simd, residuals[channel], &mut place[channel]);
                    }
                }
            }
        }
        let mut change = ChangeSums { squares: lane_sum(squares), products: [0.0; 4] };
        for channel in 0..CHANNELS {
            change.products[channel] = lane_sum(products[channel]);
        }
        GradientSums {
            change,
            weights: lane_sum(all),
            geometry: GeometrySums { first: first.map(lane_sum), second: second.map(lane_sum) },
        }
    }

    /// The sums over some rows for the change of error by a Gaussian that is not part of the rendering.
    #[inline(always)]
    #[expect(clippy::needless_range_loop, reason = "see `encode/fit/training_tile.rs`")]
    fn change_sums<S: Simd, const CHANNELS: usize>(
        &self,
        simd: S,
        weights: &KernelWeights,
        rows: Range<usize>,
        without: &Without,
    ) -> ChangeSums {
        let Place { corner: [left, top], size: [vectors, _] } = self.place;
        let places = without.kept.as_chunks::<CHANNELS>().0;
        let zero = f32x16::splat(simd, 0.0);
        let (mut squares, mut products) = (zero, [zero; CHANNELS]);
        for row in rows {
            for vector in weights.span(left, top + row, vectors) {
                let [x, y] = self.pixel(row, vector);
                let weight = weights.at(simd, x, y);
                let perceptual_weight =
                    f32x16::load_array_ref(simd, self.band.perceptual_weights(x, y));
                let counted = weight * perceptual_weight;
                squares = counted.fused_mul_add(weight, squares);
                let residuals: [_; CHANNELS] = match &without.removed {
                    Some(removed) => self.residuals_without(simd, [x, y], removed),
                    None => {
                        let mut residuals = [zero; CHANNELS];
                        for channel in 0..CHANNELS {
                            residuals[channel] =
                                load(simd, &places[row * vectors + vector][channel]);
                        }
                        residuals
                    }
                };
                for channel in 0..CHANNELS {
                    products[channel] =
                        counted.fused_mul_add(residuals[channel], products[channel]);
                }
            }
        }
        let mut sums = ChangeSums { squares: lane_sum(squares), products: [0.0; 4] };
        for channel in 0..CHANNELS {
            sums.products[channel] = lane_sum(products[channel]);
        }
        sums
    }
}

/// What the change of error by a Gaussian is made of.
#[derive(Clone, Copy, Debug, Default)]
struct ChangeSums {
    /// Squared weights times perceptual weights.
    squares: f32,
    /// Weights times perceptual weights times residuals, by channel.
    products: [f32; 4],
}

impl ChangeSums {
    fn plus(self, other: Self) -> Self {
        let products = array::from_fn(|channel| self.products[channel] + other.products[channel]);
        Self { squares: self.squares + other.squares, products }
    }

    /// The change of error, where the residuals are those with the Gaussian.
    fn with_present(
        &self,
        gaussian: &Gaussian,
        model: ColorModel,
        curvature: &ColorCurvature,
    ) -> ErrorChange {
        self.change(gaussian, model, curvature, self.products, -1.0)
    }

    /// The change of error, where the residuals are those without the Gaussian.
    fn with_absent(
        &self,
        gaussian: &Gaussian,
        model: ColorModel,
        curvature: &ColorCurvature,
    ) -> ErrorChange {
        let added = curvature.times(gaussian.color).map(|color| color * self.squares);
        let by_channel = array::from_fn(|channel| self.products[channel] + added[channel]);
        self.change(gaussian, model, curvature, by_channel, 1.0)
    }

    /// The change of error, given half of its derivatives; its quadratic part is added or subtracted.
    fn change(
        &self,
        gaussian: &Gaussian,
        model: ColorModel,
        curvature: &ColorCurvature,
        by_channel: [f32; 4],
        sign: f32,
    ) -> ErrorChange {
        let amplitudes = to_axes(gaussian.color, model);
        let channels = gaussian.color.iter().zip(self.products).take(model.channels());
        let linear: f32 = channels.map(|(&color, product)| color * product).sum();
        ErrorChange {
            error: 2.0 * linear + sign * self.squares * curvature.of(amplitudes),
            by_axis: to_axes(by_channel, model),
            squared_weights: self.squares,
            amplitudes,
        }
    }
}

/// What the derivatives of the error by a Gaussian are made of.
#[derive(Clone, Copy, Debug, Default)]
struct GradientSums {
    change: ChangeSums,
    /// Squared weights.
    weights: f32,
    /// In the Gaussian's own frame.
    geometry: GeometrySums,
}

impl GradientSums {
    fn plus(self, other: Self) -> Self {
        Self {
            change: self.change.plus(other.change),
            weights: self.weights + other.weights,
            geometry: self.geometry + other.geometry,
        }
    }

    fn by_geometry(&self, gaussian: &Gaussian) -> GeometryChange {
        let channels = gaussian.color.iter().zip(self.change.products);
        let by_color = channels.map(|(color, product)| color * product).sum();
        GeometryChange::gradient(gaussian, self.geometry, by_color)
    }
}

#[inline(always)]
fn lane_sum<S: Simd>(vector: f32x16<S>) -> f32 {
    vector.to_array().iter().sum()
}

#[cfg(test)]
mod tests;
