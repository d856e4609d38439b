//! Gauss-Newton steps with momentum, sixteen Gaussians at a time.
//!
//! The curvature is that of a Gaussian alone. Those that overlap take their steps at the same time, and
//! together they would go too far, or, where they share the way, not far enough. So every Gaussian has
//! a step size of its own, a factor on its steps: it rises while gradients point where earlier ones did, and
//! falls when they turn round (as in Rprop; Riedmiller and Braun, 1993).
//!
//! Steps are taken in the own frame of a Gaussian: its Cholesky factor L becomes L (I - D), whatever the
//! parameterization of its shape is.
//!
//! Loops are over indices, as in `fit/training_tile.rs`. There are no fused multiplications, so all
//! machines get the same bits.

use fearless_simd::{Level, Simd, dispatch, f32x16, prelude::*};

use super::components::{Bounds, Components, MOST_COLOR, Slope};
use super::parameterization::MIN_DEVIATION;
use super::pass::SplatGradient;
use super::rate_term::RateTerm;
use super::training::GaussNewton;
use crate::encode::loss::{ColorCurvature, Matrix};
use crate::encode::mul_add::MulAdd;
use crate::encode::own_frame::{
    CENTER_CURVATURE, COLOR_CURVATURE, GeometrySums, RATIO_CURVATURE, SHEAR_CURVATURE,
    SIZE_CURVATURE,
};
use crate::gaussian::{MAX_COMPONENTS, Parameterization};
use crate::render::simd_kernel;
use crate::render::splat::Splat;
use crate::simd::LANES;

// Constants: docs/tuning.md, "Steps of training".
/// The step size of a new Gaussian: it is born with others that see the same residuals, and at the full
/// size all of them would take the same step, and never come to rest.
const FIRST_STEP_SIZE: f32 = 0.4;
/// The change of the step size, and its range.
const FASTER: f32 = 1.2;
const SLOWER: f32 = 0.85;
const MUCH_SLOWER: f32 = 0.25;
const LEAST_STEP_SIZE: f32 = 0.02;
const MOST_STEP_SIZE: f32 = 3.0;

/// The state for one Gaussian.
#[derive(Clone, Copy, Debug)]
pub(super) struct State {
    /// Moving average of the gradient in the own frame: by the centre; by the logarithms of size and
    /// ratio, and by the shear; by the colour.
    mean: Components,
    /// The factor on its steps.
    step_size: f32,
    /// The sum of the weights in the moving average, for the bias correction: 0 before the first step.
    weight: f32,
}

impl State {
    pub(super) const NEW: Self =
        Self { mean: Components::ZERO, step_size: FIRST_STEP_SIZE, weight: 0.0 };

    /// Multiplies the gradients that it remembers by a factor.
    pub(super) fn scale(&mut self, factor: f32) {
        self.mean = Components::from_array(self.mean.to_array().map(|mean| mean * factor));
    }

    /// Makes the next steps smaller after a setback, without waiting for the gradient to turn round.
    pub(super) fn slow_down(&mut self) {
        self.step_size *= MUCH_SLOWER;
    }
}

/// The reciprocals of the curvatures for an energy or an area of 1.
const RECIPROCALS: Components = Components {
    center: [1.0 / CENTER_CURVATURE; 2],
    shape: [1.0 / SIZE_CURVATURE, 1.0 / RATIO_CURVATURE, 1.0 / SHEAR_CURVATURE],
    color: [1.0 / COLOR_CURVATURE; 4],
};

/// What the steps of all Gaussians have in common.
#[derive(Clone, Copy, Debug)]
pub(super) struct Step<'a> {
    pub(super) options: &'a GaussNewton,
    pub(super) bounds: Bounds,
    /// The factor on the learning rate.
    pub(super) factor: f32,
    pub(super) rate_term: Option<RateTerm>,
    /// How the distortion curves with the colour, as a share of that by gray.
    pub(super) curvature: ColorCurvature,
}

/// A gradient of the loss, without the rate term, from which that in the own frame follows.
pub(super) trait Gradient: Copy + Default {
    /// The gradients in the own frames of sixteen Gaussians with these Cholesky factors, where colours
    /// do not depend on the size.
    fn in_own_frame<S: Simd>(
        simd: S,
        cholesky: [f32x16<S>; 3],
        slopes: &[Slope<Self>; LANES],
    ) -> Components<f32x16<S>>;
}

/// The gradient by the splat.
impl Gradient for SplatGradient {
    #[inline(always)]
    #[expect(clippy::needless_range_loop, reason = "see the top of the file")]
    fn in_own_frame<S: Simd>(
        simd: S,
        cholesky: [f32x16<S>; 3],
        slopes: &[Slope<Self>; LANES],
    ) -> Components<f32x16<S>> {
        let zero = f32x16::splat(simd, 0.0);
        let mut sums = GeometrySums { first: [zero; 2], second: [zero; 3] };
        for axis in 0..sums.first.len() {
            sums.first[axis] =
                f32x16::from_fn(simd, |lane| slopes[lane].gradient.geometry.first[axis]);
        }
        for entry in 0..sums.second.len() {
            sums.second[entry] =
                f32x16::from_fn(simd, |lane| slopes[lane].gradient.geometry.second[entry]);
        }
        let sums = sums.in_own_frame(inverse(cholesky));
        let mut color = [zero; 4];
        for channel in 0..color.len() {
            color[channel] = f32x16::from_fn(simd, |lane| slopes[lane].gradient.color[channel]);
        }
        Components { center: sums.first, shape: sums.by_shape(), color }
    }
}

/// The gradient in the own frame itself.
impl Gradient for Components {
    #[inline(always)]
    #[expect(clippy::needless_range_loop, reason = "see the top of the file")]
    fn in_own_frame<S: Simd>(
        simd: S,
        _: [f32x16<S>; 3],
        slopes: &[Slope<Self>; LANES],
    ) -> Components<f32x16<S>> {
        let mut gradient = [f32x16::splat(simd, 0.0); MAX_COMPONENTS];
        for index in 0..MAX_COMPONENTS {
            gradient[index] = f32x16::from_fn(simd, |lane| slopes[lane].gradient.to_array()[index]);
        }
        Components::from_array(gradient)
    }
}

impl Step<'_> {
    /// One step for each Gaussian. `slope` returns what it depends on, for an index and the values.
    /// `splats`, if there are as many, become those of the new values.
    pub(super) fn run<G: Gradient>(
        &self,
        level: Level,
        values: &mut [Components],
        states: &mut [State],
        splats: &mut [Splat],
        mut slope: impl FnMut(usize, &Components) -> Slope<G>,
    ) {
        dispatch!(level, simd => {
            let (blocks, rest) = values.as_chunks_mut::<LANES>();
            let (state_blocks, rest_states) = states.as_chunks_mut::<LANES>();
            let count = blocks.len() * LANES;
            for (block, (values, states)) in blocks.iter_mut().zip(state_blocks).enumerate() {
                let splats = splats.get_mut(block * LANES..(block + 1) * LANES);
                let slope = |lane, values: &_| slope(block * LANES + lane, values);
                self.block(simd, values, states, LANES, splats, slope);
            }
            if let Some(&any) = rest.first() {
                let (mut values, mut states) = ([any; LANES], [State::NEW; LANES]);
                values[..rest.len()].copy_from_slice(rest);
                states[..rest.len()].copy_from_slice(rest_states);
                let splats = splats.get_mut(count..count + rest.len());
                let slope = |lane, values: &_| slope(count + lane, values);
                self.block(simd, &mut values, &mut states, rest.len(), splats, slope);
                rest.copy_from_slice(&values[..rest.len()]);
                rest_states.copy_from_slice(&states[..rest.len()]);
            }
        });
    }

    /// [`Self::run`] for sixteen Gaussians, of which the first `count` are there.
    #[inline(always)]
    #[expect(clippy::needless_range_loop, reason = "see the top of the file")]
    fn block<S: Simd, G: Gradient>(
        &self,
        simd: S,
        values: &mut [Components; LANES],
        states: &mut [State; LANES],
        count: usize,
        splats: Option<&mut [Splat]>,
        mut slope: impl FnMut(usize, &Components) -> Slope<G>,
    ) {
        let parameterization = self.bounds.parameterization;
        let is_cholesky = parameterization == Parameterization::Cholesky;
        let mut slopes = [Slope { gradient: G::default(), perceptual_weight: 1.0 }; LANES];
        for lane in 0..count {
            slopes[lane] = slope(lane, &values[lane]);
        }
        if !is_cholesky {
            for lane in 0..LANES {
                values[lane].shape = parameterization.to_cholesky(values[lane].shape);
            }
        }
        let made = self.step(simd, values, states, &slopes);
        if !is_cholesky {
            for lane in 0..LANES {
                let shape = parameterization.shape_of(values[lane].shape);
                values[lane] = self.bounds.clamped(Components { shape, ..values[lane] });
            }
        }
        if let Some(splats) = splats {
            for lane in 0..splats.len() {
                let of_values = || values[lane].splat(parameterization);
                splats[lane] = if is_cholesky { made[lane] } else { of_values() };
            }
        }
    }

    /// Steps of sixteen Gaussians whose shapes are their Cholesky factors. Returns the splats of the new
    /// values.
    #[inline(always)]
    #[expect(clippy::needless_range_loop, reason = "see the top of the file")]
    fn step<S: Simd, G: Gradient>(
        &self,
        simd: S,
        values: &mut [Components; LANES],
        states: &mut [State; LANES],
        slopes: &[Slope<G>; LANES],
    ) -> [Splat; LANES] {
        let zero = f32x16::splat(simd, 0.0);
        let one = f32x16::splat(simd, 1.0);
        let mut old = [zero; MAX_COMPONENTS];
        let mut mean = [zero; MAX_COMPONENTS];
        for index in 0..MAX_COMPONENTS {
            old[index] = f32x16::from_fn(simd, |lane| values[lane].to_array()[index]);
            mean[index] = f32x16::from_fn(simd, |lane| states[lane].mean.to_array()[index]);
        }
        let step_size = f32x16::from_fn(simd, |lane| states[lane].step_size);
        let weight = f32x16::from_fn(simd, |lane| states[lane].weight);
        let perceptual_weight = f32x16::from_fn(simd, |lane| slopes[lane].perceptual_weight);

        let Components { center: [x, y], shape: [l11, l21, l22], color } =
            Components::from_array(old);
        let area = l11 * l22;
        let squared_color =
            color[0] * color[0] + color[1] * color[1] + color[2] * color[2] + color[3] * color[3];
        let mut gradient = G::in_own_frame(simd, [l11, l21, l22], slopes);
        for channel in 0..color.len() {
            // The colour falls as the size grows.
            gradient.shape[0] -= color[channel] * gradient.color[channel];
        }
        if let Some(rate_term) = self.rate_term {
            let rate_by_shape = rate_term.by_shape(simd, [l11, l21, l22]);
            for index in 0..rate_by_shape.len() {
                gradient.shape[index] += rate_by_shape[index];
            }
            let rate_by_color = rate_term.by_color(area, squared_color);
            for channel in 0..color.len() {
                gradient.color[channel] += rate_by_color * color[channel];
            }
        }
        gradient.color = product(simd, self.curvature.inverse(), gradient.color);
        let gradient = gradient.to_array();

        let area = area * perceptual_weight;
        let damping = self.options.damping * self.options.damping;
        let curved = product(simd, self.curvature.by_channel(), color);
        let mut energy = zero;
        for channel in 0..color.len() {
            energy = color[channel].fused_mul_add(curved[channel], energy);
        }
        let by_energy = one / ((energy + damping) * area);
        let by_area = one / area;
        let parts = Components::by_attribute(by_energy, by_energy, by_area).to_array();
        let mut reciprocals = [zero; MAX_COMPONENTS];
        // 0 if all are finite, else NaN.
        let (mut agreement, mut finite) = (zero, zero);
        for index in 0..MAX_COMPONENTS {
            reciprocals[index] = parts[index] * RECIPROCALS.to_array()[index];
            agreement += mean[index] * gradient[index] * reciprocals[index];
            finite += gradient[index] * 0.0;
        }
        // A Gaussian whose gradient is not finite stays as it is until it is pruned.
        let stepped = finite.simd_eq(zero);

        // Before the first step there is nothing to agree with.
        let change = agreement
            .simd_lt(zero)
            .select(f32x16::splat(simd, SLOWER), f32x16::splat(simd, FASTER));
        let changed = (step_size * change).max(LEAST_STEP_SIZE).min(MOST_STEP_SIZE);
        let new_step_size = weight.simd_gt(zero).select(changed, step_size);
        let momentum = self.options.momentum;
        let new_weight = weight * momentum + (1.0 - momentum);
        let rate = new_step_size * (self.options.rate * self.factor) / new_weight;
        let mut new_mean = [zero; MAX_COMPONENTS];
        let mut steps = [zero; MAX_COMPONENTS];
        for index in 0..MAX_COMPONENTS {
            new_mean[index] = mean[index] * momentum + gradient[index] * (1.0 - momentum);
            steps[index] = rate * new_mean[index] * reciprocals[index];
        }
        let mut steps = Components::from_array(steps);
        let trusted = self.options.trust_region;
        for axis in 0..steps.center.len() {
            steps.center[axis] = steps.center[axis].max(-trusted).min(trusted);
        }
        for index in 0..steps.shape.len() {
            steps.shape[index] = steps.shape[index].max(-trusted).min(trusted);
        }

        let ([u, v], [size, ratio, shear]) = (steps.center, steps.shape);
        let mut new = Components {
            center: [x - l11 * u, y - (l21 * u + l22 * v)],
            shape: [
                l11 - l11 * (size + ratio),
                l21 - (l21 * (size + ratio) + l22 * shear),
                l22 - l22 * (size - ratio),
            ],
            color,
        };
        let faded = simd_kernel::exp(simd, size);
        for channel in 0..color.len() {
            new.color[channel] = color[channel] * faded - steps.color[channel];
        }
        self.clamp(simd, &mut new);

        let mut new = new.to_array();
        let mut by_component = [[0.0; LANES]; MAX_COMPONENTS];
        let mut averages = [[0.0; LANES]; MAX_COMPONENTS];
        for index in 0..MAX_COMPONENTS {
            new[index] = stepped.select(new[index], old[index]);
            by_component[index] = new[index].to_array();
            averages[index] = stepped.select(new_mean[index], mean[index]).to_array();
        }
        for lane in 0..LANES {
            values[lane] = lane_of(&by_component, lane);
            states[lane].mean = lane_of(&averages, lane);
        }
        let step_size = stepped.select(new_step_size, step_size).to_array();
        let weight = stepped.select(new_weight, weight).to_array();
        for lane in 0..LANES {
            states[lane].step_size = step_size[lane];
            states[lane].weight = weight[lane];
        }

        let [i11, w, i22] = inverse(Components::from_array(new).shape).map(f32x16::to_array);
        let mut splats = [Splat::NOWHERE; LANES];
        for lane in 0..LANES {
            let Components { center: [x, y], color, .. } = values[lane];
            splats[lane] = Splat { x, y, i11: i11[lane], w: w[lane], i22: i22[lane], color };
        }
        splats
    }

    /// [`Bounds::clamped`] for finite values, whose shapes are Cholesky factors.
    #[inline(always)]
    fn clamp<S: Simd>(&self, simd: S, new: &mut Components<f32x16<S>>) {
        let max = self.bounds.max_deviation;
        for (axis, (low, high)) in self.bounds.center_ranges.into_iter().enumerate() {
            new.center[axis] = new.center[axis].max(low).min(high);
        }
        let [l11, l21, l22] = new.shape;
        let l11 = l11.max(MIN_DEVIATION).min(max);
        let l21 = l21.max(-max).min(max);
        let long = (l11 * l11 + l21 * l21).sqrt() / l11;
        let least = long.max(1.0) * f32x16::splat(simd, MIN_DEVIATION);
        new.shape = [l11, l21, l22.max(MIN_DEVIATION).min(max).max(least)];
        for channel in 0..new.color.len() {
            new.color[channel] = new.color[channel].max(-MOST_COLOR).min(MOST_COLOR);
        }
    }
}

/// The product of a matrix and sixteen vectors.
#[inline(always)]
fn product<S: Simd>(simd: S, matrix: &Matrix, vectors: [f32x16<S>; 4]) -> [f32x16<S>; 4] {
    let mut products = [f32x16::splat(simd, 0.0); 4];
    for row in 0..products.len() {
        for column in 0..vectors.len() {
            products[row] = vectors[column].fused_mul_add(matrix[row][column], products[row]);
        }
    }
    products
}

/// The inverses of Cholesky factors, as [`crate::gaussian::inverse_cholesky`] has them.
#[inline(always)]
fn inverse<S: Simd>([l11, l21, l22]: [f32x16<S>; 3]) -> [f32x16<S>; 3] {
    let (i11, i22) = (1.0 / l11, 1.0 / l22);
    [i11, -(l21 * i11) * i22, i22]
}

/// The components of one of sixteen Gaussians.
#[inline(always)]
fn lane_of(components: &[[f32; LANES]; MAX_COMPONENTS], lane: usize) -> Components {
    let mut of_lane = [0.0; MAX_COMPONENTS];
    for index in 0..MAX_COMPONENTS {
        of_lane[index] = components[index][lane];
    }
    Components::from_array(of_lane)
}

#[cfg(test)]
mod tests;
