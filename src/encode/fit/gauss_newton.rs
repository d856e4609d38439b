//! A Gauss-Newton step with momentum.
//!
//! The curvature is that of a Gaussian alone. Gaussians that overlap take their steps at the same time:
//! together they may go too far, or not far enough. So every Gaussian has a step size of its own, its
//! *pace*, which is a factor on its steps: it rises while successive gradients agree, and falls when they
//! turn round (as in Rprop; Riedmiller and Braun, 1993).

pub(super) mod blocks;

use glam::{Vec2, Vec3};

use super::components::{Bounds, Components, Slope};
use super::parameterization::OwnFrame;
use super::training::GaussNewton;
use crate::encode::own_frame::{
    CENTER_CURVATURE, COLOR_CURVATURE, RATIO_CURVATURE, SHEAR_CURVATURE, SIZE_CURVATURE,
};
use crate::gaussian::MAX_COMPONENTS;
use crate::math;

// Constants: docs/tuning.md, "Steps of training".
/// The pace of a new Gaussian: it is born with others that see the same residuals, and at full pace
/// all of them would take the same step, and never come to rest.
const FIRST_PACE: f32 = 0.4;
/// The change of the pace, and its range.
const FASTER: f32 = 1.2;
const SLOWER: f32 = 0.8;
const MUCH_SLOWER: f32 = 0.25;
const LEAST_PACE: f32 = 0.02;
const MOST_PACE: f32 = 3.0;

/// The state for one Gaussian.
#[derive(Clone, Copy, Debug)]
pub(super) struct State {
    /// Moving average of the gradient.
    mean: Components,
    /// The factor on steps.
    pace: f32,
    /// The sum of the weights in the moving average, for the bias correction: 0 before the first step.
    weight: f32,
}

impl State {
    pub(super) const NEW: Self = Self { mean: Components::ZERO, pace: FIRST_PACE, weight: 0.0 };

    /// Makes the next steps smaller after a setback, without waiting for the gradient to turn round.
    pub(super) fn slow_down(&mut self) {
        self.pace *= MUCH_SLOWER;
    }
}

/// One step for one Gaussian. The moving average is that of gradients in the Gaussian's own frame: by
/// the centre, the logarithms of size and ratio, the shear, and the colour.
#[inline]
pub(super) fn step(
    components: &mut Components,
    state: &mut State,
    slope: &Slope,
    options: &GaussNewton,
    bounds: Bounds,
    factor: f32,
) {
    let Components { center, shape, color } = *components;
    let frame = OwnFrame::new(bounds.parameterization, shape);
    let mut by_shape = frame.shape.transpose() * Vec3::from(slope.gradient.shape);
    // The colour falls as the size grows.
    let colors = color.iter().zip(&slope.gradient.color);
    by_shape.x -= colors.map(|(color, gradient)| color * gradient).sum::<f32>();
    let by_center = frame.center.transpose() * Vec2::from(slope.gradient.center);
    let (by_center, by_shape) = (by_center.to_array(), by_shape.to_array());
    let gradient = Components { center: by_center, shape: by_shape, ..slope.gradient }.to_array();

    let area = frame.center.determinant() * slope.sensitivity;
    let squared_color = color.iter().map(|color| color * color).sum::<f32>();
    let squared_strength = (squared_color + options.damping * options.damping) * area;
    let curvatures = Components {
        center: [CENTER_CURVATURE * squared_strength; 2],
        shape: [SIZE_CURVATURE, RATIO_CURVATURE, SHEAR_CURVATURE]
            .map(|curvature| curvature * squared_strength),
        color: [COLOR_CURVATURE * area; 4],
    }
    .to_array();
    let momentum = options.momentum;
    let mut mean = state.mean.to_array();
    let agreement: f32 =
        (0..MAX_COMPONENTS).map(|index| mean[index] * gradient[index] / curvatures[index]).sum();
    // Before the first step there is nothing to agree with.
    if state.weight > 0.0 {
        let change = if agreement < 0.0 { SLOWER } else { FASTER };
        state.pace = (state.pace * change).clamp(LEAST_PACE, MOST_PACE);
    }
    state.weight = momentum * state.weight + (1.0 - momentum);
    let rate = state.pace * (options.rate * factor) / state.weight;
    let mut steps = [0.0; MAX_COMPONENTS];
    for index in 0..MAX_COMPONENTS {
        let mean = &mut mean[index];
        *mean = momentum * *mean + (1.0 - momentum) * gradient[index];
        steps[index] = rate * *mean / curvatures[index];
    }
    let trusted = |step: f32| step.clamp(-options.trust_region, options.trust_region);
    state.mean = Components::from_array(mean);
    let steps = Components::from_array(steps);
    let center = Vec2::from(center) - frame.center * Vec2::from(steps.center).map(trusted);
    let by_shape = Vec3::from(steps.shape).map(trusted);
    let shape: Vec3 = Vec3::from(shape) - frame.shape * by_shape;
    let faded = math::exp(by_shape.x);
    let color = core::array::from_fn(|channel| color[channel] * faded - steps.color[channel]);
    let (center, shape) = (center.to_array(), shape.to_array());
    *components = bounds.clamped(Components { center, shape, color });
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::gaussian::{Gaussian, Parameterization, component_count};

    const OPTIONS: GaussNewton =
        GaussNewton { rate: 1.0, momentum: 0.7, damping: 1e-3, trust_region: 0.2 };
    const CHANNELS: usize = 1;
    /// Pixels in a row or column, and for each unit of length.
    const SIDE: i32 = 96;
    const DENSITY: f32 = 2.0;

    fn bounds(parameterization: Parameterization) -> Bounds {
        let length = (SIDE as f32 / DENSITY) as u32;
        Bounds::new(parameterization, CHANNELS, [length; 2])
    }

    /// The quartic kernel of a Gaussian at all pixels.
    fn rendering(components: &Components, parameterization: Parameterization) -> Vec<f64> {
        let Gaussian { center, cholesky, color } = components.gaussian(parameterization);
        let [l11, l21, l22] = cholesky.map(f64::from);
        let pixels = (0..SIDE).flat_map(|y| (0..SIDE).map(move |x| (x, y)));
        pixels
            .map(|(x, y)| {
                let at = |pixel: i32| (f64::from(pixel) + 0.5) / f64::from(DENSITY);
                let u = (at(x) - f64::from(center[0])) / l11;
                let v = (at(y) - f64::from(center[1]) - l21 * u) / l22;
                f64::from(color[0]) * (1.0 - (u * u + v * v) / 4.0).max(0.0).powi(2)
            })
            .collect()
    }

    /// Half of the squared error per unit of area.
    fn loss(components: &Components, source: &[f64], parameterization: Parameterization) -> f64 {
        let rendering = rendering(components, parameterization);
        let squares = rendering.iter().zip(source).map(|(value, source)| (value - source).powi(2));
        0.5 * squares.sum::<f64>() / f64::from(DENSITY * DENSITY)
    }

    fn gradient(
        components: &Components,
        source: &[f64],
        parameterization: Parameterization,
    ) -> Components {
        let mut gradient = [0.0; MAX_COMPONENTS];
        for (index, value) in gradient.iter_mut().enumerate().take(component_count(CHANNELS)) {
            let at = |step: f32| {
                let mut moved = components.to_array();
                moved[index] += step;
                loss(&Components::from_array(moved), source, parameterization)
            };
            *value = ((at(1e-2) - at(-1e-2)) / 2e-2) as f32;
        }
        Components::from_array(gradient)
    }

    #[test]
    fn a_gaussian_alone_comes_to_its_optimum() {
        for parameterization in [Parameterization::Covariance, Parameterization::Cholesky] {
            let from = |[l11, l21, l22]: [f32; 3], center: [f32; 2], color: f32| {
                let shape = super::super::parameterization::from_cholesky(
                    parameterization,
                    [l11, l21, l22],
                );
                Components { center, shape, color: [color, 0.0, 0.0, 0.0] }
            };
            let optimum = from([5.0, -2.0, 3.0], [24.0, 22.0], 0.5);
            let source = rendering(&optimum, parameterization);
            let mut found = from([4.0, 0.0, 4.0], [25.5, 21.0], 0.1);
            let before = loss(&found, &source, parameterization);
            let mut state = State::NEW;
            for _ in 0..40 {
                let gradient = gradient(&found, &source, parameterization);
                let slope = Slope { gradient, sensitivity: 1.0 };
                step(&mut found, &mut state, &slope, &OPTIONS, bounds(parameterization), 1.0);
            }
            let after = loss(&found, &source, parameterization);
            assert!(after < 1e-3 * before, "{parameterization:?}: {before}, {after}, {found:?}");
            let mut pairs = found.to_array().into_iter().zip(optimum.to_array());
            assert!(pairs.all(|(a, b)| (a - b).abs() < 0.1), "{found:?}");
        }
    }

    #[test]
    fn the_pace_rises_with_agreement_and_falls_with_contradiction() {
        let color = [0.5, 0.0, 0.0, 0.0];
        let mut values = Components { center: [24.0; 2], shape: [3.0, 0.0, 3.0], color };
        let mut state = State::NEW;
        let mut paced = |by_color: f32| {
            let mut gradient = Components::ZERO;
            gradient.color[0] = by_color;
            let slope = Slope { gradient, sensitivity: 1.0 };
            let bounds = bounds(Parameterization::Cholesky);
            step(&mut values, &mut state, &slope, &OPTIONS, bounds, 0.01);
            state.pace
        };
        let paces = [1.0, 1.0, 1.0, -9.0, 9.0].map(&mut paced);
        assert_eq!(paces[0], FIRST_PACE);
        assert!(paces[0] < paces[1] && paces[1] < paces[2], "{paces:?}");
        assert!(paces[2] > paces[3] && paces[3] > paces[4], "{paces:?}");
        for _ in 0..50 {
            paced(9.0);
        }
        assert_eq!(paced(9.0), MOST_PACE);
    }
}
