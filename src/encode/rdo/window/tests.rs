//! Tests of the window against plain sums over the picture in f64.

use super::*;
use crate::color::ColorModel;
use crate::encode::options::Tune;
use crate::encode::progress::unobserved;
use crate::encode::rdo::residuals::Residuals;
use crate::encode::testing::{self, MODELS, residual, tiled};
use crate::encode::tiled_source::TiledSource;

// The window of a Gaussian that covers all is shared by threads.
const WIDTH: usize = 125;
const HEIGHT: usize = 67;

/// A source and a rendering of it.
struct Scene {
    model: ColorModel,
    source: Vec<u8>,
    /// Plane after plane.
    rendering: Vec<f32>,
    tiled: TiledSource,
}

/// A random source, with even ground on the left, and a random rendering of it. If `clamped`, the
/// source has black and white samples.
fn scene(model: ColorModel, clamped: bool) -> Scene {
    let channels = model.channels();
    let mut random = fastrand::Rng::with_seed(3);
    let mut source: Vec<u8> = (0..WIDTH * HEIGHT * channels)
        .map(|_| match random.u8(..) {
            0..40 if clamped => 0,
            216.. if clamped => 255,
            value => value.clamp(1, 254),
        })
        .collect();
    for (at, sample) in source.iter_mut().enumerate() {
        if at / channels % WIDTH < WIDTH / 3 && (1..255).contains(sample) {
            *sample = 128;
        }
    }
    let rendering = (0..WIDTH * HEIGHT * channels).map(|_| random.f32() * 1.4 - 0.2).collect();
    let tiled = tiled(testing::source([WIDTH, HEIGHT], model, &source), Tune::Visual);
    Scene { model, source, rendering, tiled }
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

/// Gaussians, each with a limit within which the residuals of its window are kept, and with one beyond
/// which they are not.
fn gaussians_kept_or_not() -> impl Iterator<Item = (Gaussian, usize)> {
    gaussians().into_iter().flat_map(|gaussian| [(gaussian, MOST_KEPT), (gaussian, 0)])
}

/// The quartic kernel of a Gaussian at a pixel.
fn plain_weight(gaussian: &Gaussian, pixel: usize) -> f64 {
    testing::weight(gaussian, [pixel % WIDTH, pixel / WIDTH].map(|at| at as f64 + 0.5))
}

/// The residuals in f64 with a Gaussian, times `factor`, added after the rendering was clamped: its colour times
/// the curvature. In interleaved order.
fn plain_residuals(scene: &Scene, gaussian: &Gaussian, factor: f64) -> Vec<f64> {
    let channels = scene.model.channels();
    let color = scene.tiled.loss.color_curvature().times(gaussian.color);
    let samples = scene.source.iter().enumerate();
    let residuals = samples.map(|(at, &sample)| {
        let (pixel, channel) = (at / channels, at % channels);
        let clamped = residual(scene.rendering[channel * WIDTH * HEIGHT + pixel], sample);
        clamped + factor * plain_weight(gaussian, pixel) * f64::from(color[channel])
    });
    residuals.collect()
}

/// The error in f64 with a Gaussian, times `factor`, added to the rendering.
fn plain_error(scene: &Scene, gaussian: &Gaussian, factor: f64) -> f64 {
    weighted_error(scene, plain_residuals(scene, gaussian, factor).into_iter())
}

/// The sum of r C^-1 r times perceptual weights, where C is the curvature: half of its gradient by what is added
/// in front of C is r.
fn weighted_error(scene: &Scene, residuals: impl Iterator<Item = f64>) -> f64 {
    let inverse = inverse_curvature(scene);
    let residuals: Vec<f64> = residuals.collect();
    let pixels = residuals.chunks(scene.model.channels()).enumerate();
    let terms = pixels.map(|(pixel, residuals)| {
        let perceptual_weight = scene.tiled.loss.weight_at(pixel % WIDTH, pixel / WIDTH);
        let rows = residuals.iter().zip(&inverse).map(|(residual, row)| {
            residual * row.iter().zip(residuals).map(|(entry, other)| entry * other).sum::<f64>()
        });
        f64::from(perceptual_weight) * rows.sum::<f64>()
    });
    terms.sum()
}

/// The inverse of the curvature by channel, by Gauss-Jordan elimination.
fn inverse_curvature(scene: &Scene) -> [[f64; 4]; 4] {
    let curvature = scene.tiled.loss.color_curvature();
    let unit = |at: usize| array::from_fn(|index| if index == at { 1.0 } else { 0.0 });
    let mut left: [[f64; 4]; 4] = array::from_fn(|row| curvature.times(unit(row)).map(f64::from));
    let mut right: [[f64; 4]; 4] = array::from_fn(|row| unit(row).map(f64::from));
    let channels = scene.model.channels();
    for pivot in 0..channels {
        let scale = 1.0 / left[pivot][pivot];
        for matrix in [&mut left, &mut right] {
            matrix[pivot] = matrix[pivot].map(|entry| entry * scale);
        }
        let (of_left, of_right) = (left[pivot], right[pivot]);
        for row in (0..channels).filter(|&row| row != pivot) {
            let factor = left[row][pivot];
            for (matrix, of_pivot) in [(&mut left, of_left), (&mut right, of_right)] {
                for (entry, of_pivot) in matrix[row].iter_mut().zip(of_pivot) {
                    *entry -= factor * of_pivot;
                }
            }
        }
    }
    right
}

fn residuals(scene: &Scene) -> Residuals {
    let mut residuals = unobserved(|observer| Residuals::new(&scene.tiled, observer));
    residuals.set(&scene.tiled, 0, &scene.rendering);
    residuals
}

#[test]
fn changes_are_those_of_the_plain_error() {
    for model in MODELS {
        for clamped in [false, true] {
            let scene = scene(model, clamped);
            let mut residuals = residuals(&scene);
            let band = residuals.whole();
            for (gaussian, most_kept) in gaussians_kept_or_not() {
                let mut window = Window { most_kept, ..Window::default() };
                assert!(window.without(&band, &gaussian, model).is_some());
                let found = f64::from(window.change(&band, &gaussian, model).error);
                let without = plain_error(&scene, &gaussian, -1.0);
                let with = plain_error(&scene, &gaussian, 0.0);
                let error = (found - (with - without)).abs();
                assert!(
                    error < 1e-4 * with,
                    "{model:?} {clamped} {gaussian:?} {most_kept}: {found}, error {error}"
                );
            }
        }
    }
}

#[test]
fn gradients_are_those_of_the_plain_error() {
    for model in MODELS {
        for clamped in [false, true] {
            let scene = scene(model, clamped);
            let mut residuals = residuals(&scene);
            let band = residuals.whole();
            for (gaussian, most_kept) in gaussians_kept_or_not() {
                let mut window = Window { most_kept, ..Window::default() };
                let without = window.without(&band, &gaussian, model);
                let gradient = without.expect("the window is inside").by_geometry;
                let none = GeometryChange::default();
                let directions = [
                    (gradient.center[0], GeometryChange { center: [1.0, 0.0], ..none }),
                    (gradient.center[1], GeometryChange { center: [0.0, 1.0], ..none }),
                    (gradient.size, GeometryChange { size: 1.0, ..none }),
                    (gradient.ratio, GeometryChange { ratio: 1.0, ..none }),
                    (gradient.slant, GeometryChange { slant: 1.0, ..none }),
                ];
                for (found, direction) in directions {
                    let expected = derivative(&scene, &gaussian, &direction);
                    let error = (f64::from(found) - expected).abs();
                    assert!(
                        error < 4e-2 + 1e-2 * expected.abs(),
                        "{gaussian:?} {direction:?}: {found}, expected {expected}"
                    );
                }
            }
        }
    }
}

/// The derivative of the error along a direction, by a central difference.
fn derivative(scene: &Scene, gaussian: &Gaussian, direction: &GeometryChange) -> f64 {
    const STEP: f32 = 1e-3;
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
    // The Gaussian is part of the rendering, where the changed one replaces it.
    let kept = plain_residuals(scene, gaussian, -1.0);
    let ends = [STEP, -STEP].map(|step| {
        let changed = at(step);
        let color = scene.tiled.loss.color_curvature().times(changed.color);
        let residuals = kept.iter().enumerate().map(|(at, residual)| {
            let (pixel, channel) = (at / scene.model.channels(), at % scene.model.channels());
            residual + plain_weight(&changed, pixel) * f64::from(color[channel])
        });
        weighted_error(scene, residuals)
    });
    (ends[0] - ends[1]) / f64::from(2.0 * STEP)
}

#[test]
fn what_is_added_can_be_removed() {
    let scene = scene(ColorModel::Rgb, true);
    let mut residuals = residuals(&scene);
    let mut band = residuals.whole();
    for gaussian in gaussians() {
        band.add(&gaussian, 1.0, 0..HEIGHT);
        let mut window = Window::default();
        assert!(window.without(&band, &gaussian, ColorModel::Rgb).is_some());
        let found = f64::from(window.change(&band, &gaussian, ColorModel::Rgb).error);
        band.add(&gaussian, -1.0, 0..HEIGHT);
        let expected = plain_error(&scene, &gaussian, 1.0) - plain_error(&scene, &gaussian, 0.0);
        let error = (found - expected).abs();
        assert!(error < 1e-3 + 1e-4 * expected.abs(), "{gaussian:?}: {found}, {expected}");
    }
    let outside = Gaussian { center: [-90.0, 3.0], ..gaussians()[0] };
    assert!(Window::default().without(&band, &outside, ColorModel::Rgb).is_none());
}

#[test]
fn bands_together_are_the_whole() {
    let scene = scene(ColorModel::Rgb, true);
    let [mut all, mut by_band] = [residuals(&scene), residuals(&scene)];
    for gaussian in gaussians() {
        all.whole().add(&gaussian, 1.0, 0..HEIGHT);
        let mut next = 0;
        for mut band in by_band.bands(9, 16) {
            assert_eq!(band.rows().start, next);
            next = band.rows().end;
            band.add(&gaussian, 1.0, 0..33);
            band.add(&gaussian, 1.0, 33..HEIGHT);
        }
        assert_eq!(next, HEIGHT);
        let change = |residuals: &mut Residuals| {
            let (band, mut window) = (residuals.whole(), Window::default());
            assert!(window.without(&band, &gaussian, ColorModel::Rgb).is_some());
            window.change(&band, &gaussian, ColorModel::Rgb).error
        };
        assert_eq!(change(&mut all), change(&mut by_band));
    }
}
