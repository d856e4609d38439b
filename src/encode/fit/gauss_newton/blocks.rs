//! Gauss-Newton steps of trained Cholesky factors, sixteen Gaussians at a time.
//!
//! The gradients in a Gaussian's own frame follow directly from the sums of the pass
//! (`encode/own_frame.rs`).
//!
//! Loops are over indices, as in `fit/training_tile.rs`. There are no fused multiplications, so all
//! machines get the same bits.

use fearless_simd::{Level, Simd, dispatch, f32x16, prelude::*};

use super::{FASTER, LEAST_PACE, MOST_PACE, SLOWER, State};
use crate::encode::fit::components::{Bounds, Components, MAX_COLOR};
use crate::encode::fit::parameterization::MIN_DEVIATION;
use crate::encode::fit::pass::SplatGradient;
use crate::encode::fit::rate_term::RateTerm;
use crate::encode::fit::training::GaussNewton;
use crate::encode::own_frame::{
    CENTER_CURVATURE, COLOR_CURVATURE, GeometrySums, RATIO_CURVATURE, SHEAR_CURVATURE,
    SIZE_CURVATURE,
};
use crate::gaussian::MAX_COMPONENTS;
use crate::render::simd_kernel;
use crate::render::splat::Splat;
use crate::simd::LANES;

/// The reciprocals of the curvatures for a strength or an area of 1.
const RECIPROCALS: Components = Components {
    center: [1.0 / CENTER_CURVATURE; 2],
    shape: [1.0 / SIZE_CURVATURE, 1.0 / RATIO_CURVATURE, 1.0 / SHEAR_CURVATURE],
    color: [1.0 / COLOR_CURVATURE; 4],
};

/// What the steps of all Gaussians have in common.
#[derive(Clone, Copy, Debug)]
pub(in crate::encode::fit) struct BlockStep<'a> {
    pub(in crate::encode::fit) options: &'a GaussNewton,
    /// The parameterization is that by Cholesky factors.
    pub(in crate::encode::fit) bounds: Bounds,
    /// The factor on the learning rate.
    pub(in crate::encode::fit) factor: f32,
    pub(in crate::encode::fit) rate_term: Option<RateTerm>,
}

impl BlockStep<'_> {
    /// One step for each Gaussian. `slope` returns, for an index and its values, the gradient of the pass
    /// and how much a squared error counts there. `splats`, if there are as many, become those of the
    /// new values.
    pub(in crate::encode::fit) fn run(
        &self,
        level: Level,
        values: &mut [Components],
        states: &mut [State],
        splats: &mut [Splat],
        slope: impl Fn(usize, &Components) -> (SplatGradient, f32),
    ) {
        dispatch!(level, simd => {
            let (blocks, rest) = values.as_chunks_mut::<LANES>();
            let (state_blocks, rest_states) = states.as_chunks_mut::<LANES>();
            for block in 0..blocks.len() {
                let values = &mut blocks[block];
                let mut slopes = [(SplatGradient::default(), 1.0); LANES];
                for lane in 0..LANES {
                    slopes[lane] = slope(block * LANES + lane, &values[lane]);
                }
                let made = self.step(simd, values, &mut state_blocks[block], &slopes);
                write(splats, block * LANES, &made);
            }
            if let Some(&any) = rest.first() {
                let mut values = [any; LANES];
                let mut states = [State::NEW; LANES];
                let mut slopes = [(SplatGradient::default(), 1.0); LANES];
                for lane in 0..rest.len() {
                    values[lane] = rest[lane];
                    states[lane] = rest_states[lane];
                    slopes[lane] = slope(blocks.len() * LANES + lane, &values[lane]);
                }
                let made = self.step(simd, &mut values, &mut states, &slopes);
                write(splats, blocks.len() * LANES, &made);
                rest.copy_from_slice(&values[..rest.len()]);
                rest_states.copy_from_slice(&states[..rest.len()]);
            }
        });
    }

    /// Steps of sixteen Gaussians. Returns the splats of the new values.
    #[inline(always)]
    #[expect(clippy::needless_range_loop, reason = "see the top of the file")]
    fn step<S: Simd>(
        &self,
        simd: S,
        values: &mut [Components; LANES],
        states: &mut [State; LANES],
        slopes: &[(SplatGradient, f32); LANES],
    ) -> [Splat; LANES] {
        let zero = f32x16::splat(simd, 0.0);
        let one = f32x16::splat(simd, 1.0);
        let mut old = [zero; MAX_COMPONENTS];
        let mut mean = [zero; MAX_COMPONENTS];
        for index in 0..MAX_COMPONENTS {
            old[index] = f32x16::from_fn(simd, |lane| values[lane].to_array()[index]);
            mean[index] = f32x16::from_fn(simd, |lane| states[lane].mean.to_array()[index]);
        }
        let pace = f32x16::from_fn(simd, |lane| states[lane].pace);
        let weight = f32x16::from_fn(simd, |lane| states[lane].weight);
        let sensitivity = f32x16::from_fn(simd, |lane| slopes[lane].1);

        let Components { center: [x, y], shape: [l11, l21, l22], color } =
            Components::from_array(old);
        let area = l11 * l22;
        let squared_color =
            color[0] * color[0] + color[1] * color[1] + color[2] * color[2] + color[3] * color[3];
        let gradient = self.gradient(simd, [l11, l21, l22], color, area, squared_color, slopes);
        let gradient = gradient.to_array();

        let area = area * sensitivity;
        let damping = self.options.damping * self.options.damping;
        let by_strength = one / ((squared_color + damping) * area);
        let by_area = one / area;
        let parts = Components::by_attribute(by_strength, by_strength, by_area).to_array();
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
        let changed = (pace * change).max(LEAST_PACE).min(MOST_PACE);
        let new_pace = weight.simd_gt(zero).select(changed, pace);
        let momentum = self.options.momentum;
        let new_weight = weight * momentum + (1.0 - momentum);
        let rate = new_pace * (self.options.rate * self.factor) / new_weight;
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
        let pace = stepped.select(new_pace, pace).to_array();
        let weight = stepped.select(new_weight, weight).to_array();
        for lane in 0..LANES {
            states[lane].pace = pace[lane];
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

    /// The gradients in the own frames.
    #[inline(always)]
    fn gradient<S: Simd>(
        &self,
        simd: S,
        cholesky: [f32x16<S>; 3],
        color: [f32x16<S>; 4],
        area: f32x16<S>,
        squared_color: f32x16<S>,
        slopes: &[(SplatGradient, f32); LANES],
    ) -> Components<f32x16<S>> {
        let zero = f32x16::splat(simd, 0.0);
        let mut sums = GeometrySums { first: [zero; 2], second: [zero; 3] };
        for axis in 0..sums.first.len() {
            sums.first[axis] = f32x16::from_fn(simd, |lane| slopes[lane].0.geometry.first[axis]);
        }
        for entry in 0..sums.second.len() {
            sums.second[entry] =
                f32x16::from_fn(simd, |lane| slopes[lane].0.geometry.second[entry]);
        }
        let sums = sums.in_own_frame(inverse(cholesky));
        let mut shape = sums.by_shape();
        let mut by_color = color;
        for channel in 0..color.len() {
            by_color[channel] = f32x16::from_fn(simd, |lane| slopes[lane].0.color[channel]);
            // The colour falls as the size grows.
            shape[0] -= color[channel] * by_color[channel];
        }
        if let Some(rate_term) = self.rate_term {
            let rate_by_shape = rate_term.by_shape(simd, cholesky);
            for index in 0..shape.len() {
                shape[index] += rate_by_shape[index];
            }
            let rate_by_color = rate_term.by_color(area, squared_color);
            for channel in 0..color.len() {
                by_color[channel] += rate_by_color * color[channel];
            }
        }
        Components { center: sums.first, shape, color: by_color }
    }

    /// [`Bounds::clamped`] for finite values.
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
            new.color[channel] = new.color[channel].max(-MAX_COLOR).min(MAX_COLOR);
        }
    }
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

/// Writes a block of splats from an index on, as far as there is room.
#[inline(always)]
fn write(splats: &mut [Splat], first: usize, block: &[Splat; LANES]) {
    let end = splats.len().min(first + LANES);
    if first < end {
        splats[first..end].copy_from_slice(&block[..end - first]);
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::encode::fit::components::Slope;
    use crate::encode::fit::parameterization::gradients;
    use crate::gaussian::Parameterization;
    use crate::testing::simd_levels;

    const OPTIONS: GaussNewton =
        GaussNewton { rate: 1.3, momentum: 0.7, damping: 0.02, trust_region: 0.3 };
    const PARAMETERIZATION: Parameterization = Parameterization::Cholesky;

    fn block_step(rate_term: Option<RateTerm>, channels: usize) -> BlockStep<'static> {
        let bounds = Bounds::new(PARAMETERIZATION, channels, [90, 60]);
        BlockStep { options: &OPTIONS, bounds, factor: 0.8, rate_term }
    }

    /// Gaussians of all shapes, a part of which the step clamps.
    fn values(count: usize, channels: usize, rng: &mut fastrand::Rng) -> Vec<Components> {
        let components = |_| {
            let center = [110.0 * rng.f32() - 10.0, 80.0 * rng.f32() - 10.0];
            let mut deviation = || 0.4 + 9.0 * rng.f32() * rng.f32();
            let (l11, l22) = (deviation(), deviation());
            let shape = [l11, 8.0 * rng.f32() - 4.0, l22];
            let mut color = [0.0; 4];
            color[..channels].fill_with(|| 2.0 * rng.f32() - 1.0);
            Components { center, shape, color }
        };
        (0..count).map(components).collect()
    }

    fn slopes(count: usize, channels: usize, rng: &mut fastrand::Rng) -> Vec<(SplatGradient, f32)> {
        let slope = |_| {
            let strength = 10_f32.powf(3.0 * rng.f32() - 2.0);
            let mut value = || strength * (rng.f32() - 0.5);
            let geometry =
                GeometrySums { first: [value(), value()], second: [value(), value(), value()] };
            let mut color = [0.0; 4];
            color[..channels].fill_with(value);
            (SplatGradient { geometry, color }, 0.5 + rng.f32())
        };
        (0..count).map(slope).collect()
    }

    /// The steps of Gaussians one by one, through the gradients of the parameterization.
    fn step_each(
        step: &BlockStep<'_>,
        values: &mut [Components],
        states: &mut [State],
        slopes: &[(SplatGradient, f32)],
    ) {
        for ((values, state), (by_splat, sensitivity)) in values.iter_mut().zip(states).zip(slopes)
        {
            let mut by_splat = *by_splat;
            if let Some(rate_term) = step.rate_term {
                by_splat += rate_term.gradient(&values.gaussian(PARAMETERIZATION));
            }
            let (center, shape) = gradients(&by_splat.geometry, PARAMETERIZATION, values.shape);
            let gradient = Components { center, shape, color: by_splat.color };
            let slope = Slope { gradient, sensitivity: *sensitivity };
            super::super::step(values, state, &slope, step.options, step.bounds, step.factor);
        }
    }

    #[test]
    fn blocks_take_the_steps_of_single_gaussians() {
        let mut rng = fastrand::Rng::with_seed(5);
        for channels in [1, 3, 4] {
            for rate_term in [None, Some(RateTerm::new(0.3, 40, channels))] {
                // Two blocks and a part of one.
                let count = 2 * LANES + 5;
                let step = block_step(rate_term, channels);
                let mut found = values(count, channels, &mut rng);
                let mut states = vec![State::NEW; count];
                for _ in 0..4 {
                    let slopes = slopes(count, channels, &mut rng);
                    let (mut expected, mut expected_states) = (found.clone(), states.clone());
                    step_each(&step, &mut expected, &mut expected_states, &slopes);
                    let before = found.clone();
                    let mut splats = vec![Splat::NOWHERE; count];
                    step.run(
                        Level::new(),
                        &mut found,
                        &mut states,
                        &mut splats,
                        |index, values| {
                            assert_eq!(*values, before[index]);
                            slopes[index]
                        },
                    );
                    assert_ne!(found, before);
                    let splat =
                        |values: &Components| Splat::new(&values.gaussian(PARAMETERIZATION));
                    let of_values: Vec<_> = found.iter().filter_map(splat).collect();
                    assert_eq!(format!("{splats:?}"), format!("{of_values:?}"));
                    for index in 0..count {
                        let [l11, _, l22] = found[index].shape;
                        let scale = 1e-4 * (1.0 + l22.max(l11));
                        let (found, expected) =
                            (found[index].to_array(), expected[index].to_array());
                        for (found, expected) in found.into_iter().zip(expected) {
                            assert!(
                                (found - expected).abs() <= scale,
                                "{channels} {index}: {found}, {expected}"
                            );
                        }
                        let (state, expected) = (states[index], expected_states[index]);
                        assert_eq!([state.pace, state.weight], [expected.pace, expected.weight]);
                        let (mean, expected) = (state.mean.to_array(), expected.mean.to_array());
                        let size = expected.iter().fold(1.0, |most: f32, x| most.max(x.abs()));
                        for (found, expected) in mean.into_iter().zip(expected) {
                            assert!((found - expected).abs() <= 1e-4 * size, "{found}, {expected}");
                        }
                    }
                }
            }
        }
    }

    #[test]
    fn a_gaussian_whose_gradient_is_not_finite_stays() {
        let mut rng = fastrand::Rng::with_seed(6);
        let mut slopes = slopes(LANES, 3, &mut rng);
        slopes[3].0.geometry.second[1] = f32::NAN;
        slopes[8].0.color[2] = f32::INFINITY;
        let before = values(LANES, 3, &mut rng);
        let (mut after, mut states) = (before.clone(), vec![State::NEW; LANES]);
        block_step(None, 3)
            .run(Level::new(), &mut after, &mut states, &mut [], |index, _| slopes[index]);
        for index in 0..LANES {
            assert_eq!(after[index] == before[index], [3, 8].contains(&index), "{index}");
            assert_eq!(states[index].weight == 0.0, [3, 8].contains(&index), "{index}");
        }
    }

    #[test]
    fn every_simd_level_gives_the_same_bits() {
        let run = |level| {
            let mut rng = fastrand::Rng::with_seed(7);
            let count = 3 * LANES + 1;
            let step = block_step(Some(RateTerm::new(0.3, 40, 3)), 3);
            let (mut values, mut states) = (values(count, 3, &mut rng), vec![State::NEW; count]);
            for _ in 0..3 {
                let slopes = slopes(count, 3, &mut rng);
                step.run(level, &mut values, &mut states, &mut [], |index, _| slopes[index]);
            }
            let all = values.into_iter().chain(states.iter().map(|state| state.mean));
            all.flat_map(|values| values.to_array().map(f32::to_bits)).collect::<Vec<_>>()
        };
        let expected = run(Level::baseline());
        for (name, level) in simd_levels() {
            assert_eq!(run(level), expected, "{name}");
        }
    }
}
