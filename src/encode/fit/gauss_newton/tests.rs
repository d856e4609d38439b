//! Tests of the steps.

use super::*;
use crate::color::ColorModel;
use crate::encode::fit::parameterization::OwnFrame;
use crate::encode::loss::Distortion;
use crate::encode::options::Tune;
use crate::encode::testing::weight;
use crate::gaussian::{Gaussian, component_count};
use crate::testing::simd_levels;

const OPTIONS: GaussNewton =
    GaussNewton { rate: 1.3, momentum: 0.7, damping: 0.02, trust_region: 0.3 };
/// Those of which the angle of a circle is not a value.
const PARAMETERIZATIONS: [Parameterization; 2] =
    [Parameterization::Covariance, Parameterization::Cholesky];

fn step_in(parameterization: Parameterization, size: [u32; 2], channels: usize) -> Step<'static> {
    let bounds = Bounds::new(parameterization, channels, size);
    let color = [ColorModel::Gray, ColorModel::GrayAlpha, ColorModel::Rgb, ColorModel::Rgba];
    let curvature = ColorCurvature::of_squared_error(color[channels - 1]);
    Step { options: &OPTIONS, bounds, factor: 0.8, rate_term: None, curvature }
}

/// Gaussians of all shapes, a part of which the step clamps.
fn values(
    count: usize,
    parameterization: Parameterization,
    channels: usize,
    rng: &mut fastrand::Rng,
) -> Vec<Components> {
    let components = |_| {
        let center = [110.0 * rng.f32() - 10.0, 80.0 * rng.f32() - 10.0];
        let mut deviation = || 0.4 + 9.0 * rng.f32() * rng.f32();
        let (l11, l22) = (deviation(), deviation());
        let cholesky = [l11, 8.0 * rng.f32() - 4.0, l22];
        let shape = parameterization.shape_of(cholesky);
        let mut color = [0.0; 4];
        color[..channels].fill_with(|| 2.0 * rng.f32() - 1.0);
        Components { center, shape, color }
    };
    (0..count).map(components).collect()
}

fn slopes(count: usize, channels: usize, rng: &mut fastrand::Rng) -> Vec<Slope<SplatGradient>> {
    let slope = |_| {
        let strength = 10_f32.powf(3.0 * rng.f32() - 2.0);
        let mut value = || strength * (rng.f32() - 0.5);
        let geometry =
            GeometrySums { first: [value(), value()], second: [value(), value(), value()] };
        let mut color = [0.0; 4];
        color[..channels].fill_with(value);
        Slope { gradient: SplatGradient { geometry, color }, perceptual_weight: 0.5 + rng.f32() }
    };
    (0..count).map(slope).collect()
}

/// The gradient in the own frame, through that by the values.
fn in_own_frame(
    slope: &Slope<SplatGradient>,
    values: &Components,
    parameterization: Parameterization,
) -> Slope {
    let by_splat = slope.gradient;
    let (center, shape) = parameterization.gradients(&by_splat.geometry, values.shape);
    let (center, shape) = OwnFrame::new(parameterization, values.shape).gradient(center, shape);
    let gradient = Components { center, shape, color: by_splat.color };
    Slope { gradient, perceptual_weight: slope.perceptual_weight }
}

#[test]
fn gradients_by_splats_and_by_values_give_the_same_steps() {
    let mut rng = fastrand::Rng::with_seed(5);
    for (parameterization, channels) in
        PARAMETERIZATIONS.into_iter().flat_map(|p| [1, 3, 4].map(|channels| (p, channels)))
    {
        for rate_term in [None, Some(RateTerm::new(Tune::Visual, Distortion(0.3), 40, channels))] {
            // Two blocks and a part of one.
            let count = 2 * LANES + 5;
            let step = Step { rate_term, ..step_in(parameterization, [90, 60], channels) };
            let mut found = values(count, parameterization, channels, &mut rng);
            let mut states = vec![State::NEW; count];
            for _ in 0..4 {
                let slopes = slopes(count, channels, &mut rng);
                let (mut expected, mut expected_states) = (found.clone(), states.clone());
                let before = found.clone();
                step.run(
                    Level::new(),
                    &mut expected,
                    &mut expected_states,
                    &mut [],
                    |index, at| in_own_frame(&slopes[index], at, parameterization),
                );
                let mut splats = vec![Splat::NOWHERE; count];
                step.run(Level::new(), &mut found, &mut states, &mut splats, |index, values| {
                    assert_eq!(*values, before[index]);
                    slopes[index]
                });
                assert_ne!(found, before);
                let splat = |values: &Components| values.splat(parameterization);
                let of_values: Vec<_> = found.iter().map(splat).collect();
                assert_eq!(format!("{splats:?}"), format!("{of_values:?}"));
                for index in 0..count {
                    let [found, expected] = [found[index], expected[index]]
                        .map(|values| values.gaussian(parameterization));
                    let scale = 1e-3 * (1.0 + found.cholesky[0].max(found.cholesky[2]));
                    let numbers = |gaussian: Gaussian| {
                        let Gaussian { center, cholesky, color } = gaussian;
                        center.into_iter().chain(cholesky).chain(color)
                    };
                    for (a, b) in numbers(found).zip(numbers(expected)) {
                        assert!((a - b).abs() <= scale, "{parameterization:?} {index}: {a}, {b}");
                    }
                    let (state, expected) = (states[index], expected_states[index]);
                    assert_eq!(state.weight, expected.weight);
                    let (mean, expected) = (state.mean.to_array(), expected.mean.to_array());
                    let size = expected.iter().fold(1.0, |most: f32, x| most.max(x.abs()));
                    for (a, b) in mean.into_iter().zip(expected) {
                        assert!((a - b).abs() <= 1e-3 * size, "{parameterization:?}: {a}, {b}");
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
    slopes[3].gradient.geometry.second[1] = f32::NAN;
    slopes[8].gradient.color[2] = f32::INFINITY;
    let before = values(LANES, Parameterization::Cholesky, 3, &mut rng);
    let (mut after, mut states) = (before.clone(), vec![State::NEW; LANES]);
    let step = step_in(Parameterization::Cholesky, [90, 60], 3);
    step.run(Level::new(), &mut after, &mut states, &mut [], |index, _| slopes[index]);
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
        let rate_term = Some(RateTerm::new(Tune::Visual, Distortion(0.3), 40, 3));
        let step = Step { rate_term, ..step_in(Parameterization::Cholesky, [90, 60], 3) };
        let mut values = values(count, Parameterization::Cholesky, 3, &mut rng);
        let mut states = vec![State::NEW; count];
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

const ALONE: GaussNewton =
    GaussNewton { rate: 1.0, momentum: 0.7, damping: 1e-3, trust_region: 0.2 };
const CHANNELS: usize = 1;
/// Pixels in a row or column, and for each unit of length.
const SIDE: i32 = 96;
const DENSITY: f32 = 2.0;
const LENGTH: f32 = SIDE as f32 / DENSITY;

/// A step of a Gaussian alone, against the gradient by its values.
fn step_alone(
    values: &mut Components,
    state: &mut State,
    gradient: &Components,
    parameterization: Parameterization,
    factor: f32,
) {
    let step = step_in(parameterization, [LENGTH as u32; 2], CHANNELS);
    let step = Step { options: &ALONE, factor, ..step };
    let (values, state) = (core::slice::from_mut(values), core::slice::from_mut(state));
    step.run(Level::new(), values, state, &mut [], |_, values| {
        let frame = OwnFrame::new(parameterization, values.shape);
        let (center, shape) = frame.gradient(gradient.center, gradient.shape);
        let gradient = Components { center, shape, ..*gradient };
        Slope { gradient, perceptual_weight: 1.0 }
    });
}

/// The quartic kernel of a Gaussian at all pixels.
fn rendering(components: &Components, parameterization: Parameterization) -> Vec<f64> {
    let gaussian = components.gaussian(parameterization);
    let pixels = (0..SIDE).flat_map(|y| (0..SIDE).map(move |x| (x, y)));
    pixels
        .map(|(x, y)| {
            let at = [x, y].map(|pixel| (f64::from(pixel) + 0.5) / f64::from(DENSITY));
            f64::from(gaussian.color[0]) * weight(&gaussian, at)
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
    for parameterization in PARAMETERIZATIONS {
        let from = |[l11, l21, l22]: [f32; 3], center: [f32; 2], color: f32| {
            let shape = parameterization.shape_of([l11, l21, l22]);
            Components { center, shape, color: [color, 0.0, 0.0, 0.0] }
        };
        let optimum = from([5.0, -2.0, 3.0], [24.0, 22.0], 0.5);
        let source = rendering(&optimum, parameterization);
        let mut found = from([4.0, 0.0, 4.0], [25.5, 21.0], 0.1);
        let before = loss(&found, &source, parameterization);
        let mut state = State::NEW;
        for _ in 0..40 {
            let gradient = gradient(&found, &source, parameterization);
            step_alone(&mut found, &mut state, &gradient, parameterization, 1.0);
        }
        let after = loss(&found, &source, parameterization);
        assert!(after < 1e-3 * before, "{parameterization:?}: {before}, {after}, {found:?}");
        let mut pairs = found.to_array().into_iter().zip(optimum.to_array());
        assert!(pairs.all(|(a, b)| (a - b).abs() < 0.1), "{found:?}");
    }
}

#[test]
fn the_step_size_rises_with_agreement_and_falls_with_contradiction() {
    let color = [0.5, 0.0, 0.0, 0.0];
    let mut values = Components { center: [24.0; 2], shape: [3.0, 0.0, 3.0], color };
    let mut state = State::NEW;
    let mut step_size_after = |by_color: f32| {
        let mut gradient = Components::ZERO;
        gradient.color[0] = by_color;
        step_alone(&mut values, &mut state, &gradient, Parameterization::Cholesky, 0.01);
        state.step_size
    };
    let step_sizes = [1.0, 1.0, 1.0, -9.0, 9.0].map(&mut step_size_after);
    assert_eq!(step_sizes[0], FIRST_STEP_SIZE);
    assert!(step_sizes[0] < step_sizes[1] && step_sizes[1] < step_sizes[2], "{step_sizes:?}");
    assert!(step_sizes[2] > step_sizes[3] && step_sizes[3] > step_sizes[4], "{step_sizes:?}");
    for _ in 0..50 {
        step_size_after(9.0);
    }
    assert_eq!(step_size_after(9.0), MOST_STEP_SIZE);
}
