//! Tests of the window against plain sums over the picture in f64.

use super::*;
use crate::color::ColorModel;
use crate::encode::raster::Raster;
use crate::encode::source::Source;

const WIDTH: usize = 45;
const HEIGHT: usize = 37;

/// A random source and a random rendering of it. If `clamped`, the source has black and white
/// samples.
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
    let gaussian = |center, cholesky| Gaussian { center, cholesky, color: [0.3, -0.2, 0.1, 0.25] };
    vec![
        gaussian([20.3, 17.8], [3.0, 1.0, 2.0]),
        gaussian([2.0, 36.0], [6.0, -9.0, 0.5]),
        gaussian([44.6, 10.0], [0.4, 0.0, 0.4]),
        gaussian([22.0, 18.0], [200.0, 100.0, 90.0]),
    ]
}

/// The quartic kernel of a Gaussian at a pixel, in f64.
fn plain_weight(gaussian: &Gaussian, pixel: usize) -> f64 {
    let [l11, l21, l22] = gaussian.cholesky.map(f64::from);
    let (x, y) = (pixel % WIDTH, pixel / WIDTH);
    let u = (x as f64 + 0.5 - f64::from(gaussian.center[0])) / l11;
    let v = (y as f64 + 0.5 - f64::from(gaussian.center[1]) - l21 * u) / l22;
    (1.0 - (u * u + v * v) / 4.0).max(0.0).powi(2)
}

/// The sum of squared errors in f64 with a Gaussian, times `factor`, added to the rendering.
fn plain_error(
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
    let source =
        Source::new_u8(WIDTH as u32, HEIGHT as u32, model, source).expect("the sizes agree");
    let raster = Raster::new(&source);
    let mut residuals = Residuals::new(&raster);
    residuals.set(&raster, 0, rendering);
    residuals
}

const MODELS: [ColorModel; 4] =
    [ColorModel::Gray, ColorModel::GrayAlpha, ColorModel::Rgb, ColorModel::Rgba];

#[test]
fn changes_are_those_of_the_plain_error() {
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
                let without = plain_error(&scene, channels, &gaussian, -1.0);
                let with = plain_error(&scene, channels, &gaussian, 0.0);
                let error = (found - (with - without)).abs();
                assert!(
                    error < 1e-4 * with,
                    "{model:?} {clamped} {gaussian:?}: {found}, error {error}"
                );
            }
        }
    }
}

#[test]
fn gradients_are_those_of_the_plain_error() {
    for model in MODELS {
        for clamped in [false, true] {
            let scene = scene(model.channels(), clamped);
            let residuals = residuals(&scene, model);
            for gaussian in gaussians() {
                let mut window = Window::default();
                assert!(window.load(&residuals, &gaussian));
                let gradient = window.gradient(&gaussian, model).by_geometry;
                let none = GeometryChange::default();
                let directions = [
                    (gradient.center[0], GeometryChange { center: [1.0, 0.0], ..none }),
                    (gradient.center[1], GeometryChange { center: [0.0, 1.0], ..none }),
                    (gradient.size, GeometryChange { size: 1.0, ..none }),
                    (gradient.ratio, GeometryChange { ratio: 1.0, ..none }),
                    (gradient.slant, GeometryChange { slant: 1.0, ..none }),
                ];
                for (found, direction) in directions {
                    let expected = derivative(&scene, model.channels(), &gaussian, &direction);
                    let error = (f64::from(found) - expected).abs();
                    assert!(
                        error < 2e-2 + 1e-2 * expected.abs(),
                        "{gaussian:?} {direction:?}: {found}, expected {expected}"
                    );
                }
            }
        }
    }
}

/// The derivative of the sum of squared errors along a direction, by a central difference.
fn derivative(
    scene: &(Vec<u8>, Vec<f32>),
    channels: usize,
    gaussian: &Gaussian,
    direction: &GeometryChange,
) -> f64 {
    const STEP: f32 = 1e-3;
    // The Gaussian is part of the rendering, where the changed one replaces it.
    let mut without = scene.clone();
    let present = *gaussian;
    let at = |step: f32| {
        let change = GeometryChange {
            center: direction.center.map(|component| step * component),
            size: step * direction.size,
            ratio: step * direction.ratio,
            slant: step * direction.slant,
        };
        change.applied(&present)
    };
    subtract(&mut without.1, channels, gaussian);
    let ends = [STEP, -STEP].map(|step| plain_error(&without, channels, &at(step), 1.0));
    (ends[0] - ends[1]) / f64::from(2.0 * STEP)
}

/// Removes a Gaussian from a rendering.
fn subtract(rendering: &mut [f32], channels: usize, gaussian: &Gaussian) {
    for channel in 0..channels {
        for pixel in 0..WIDTH * HEIGHT {
            let weight = plain_weight(gaussian, pixel);
            rendering[channel * WIDTH * HEIGHT + pixel] -= weight as f32 * gaussian.color[channel];
        }
    }
}

#[test]
fn what_is_added_can_be_removed() {
    let scene = scene(3, true);
    let mut residuals = residuals(&scene, ColorModel::Rgb);
    for gaussian in gaussians() {
        residuals.add(&[(gaussian, 1.0)]);
        let mut window = Window::default();
        assert!(window.load(&residuals, &gaussian));
        window.remove(&gaussian);
        let found = f64::from(window.change(&gaussian, ColorModel::Rgb).error);
        residuals.add(&[(gaussian, -1.0)]);
        let expected =
            plain_error(&scene, 3, &gaussian, 1.0) - plain_error(&scene, 3, &gaussian, 0.0);
        assert!((found - expected).abs() < 1e-3, "{gaussian:?}: {found}, {expected}");
    }
    let outside = Gaussian { center: [-90.0, 3.0], ..gaussians()[0] };
    assert!(!Window::default().load(&residuals, &outside));
}
