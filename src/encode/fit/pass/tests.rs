//! Tests of the pass against formulas in f64, and of its SIMD code.

use super::*;
use crate::color::ColorModel;
use crate::encode::fit::components::Components;
use crate::encode::loss::plain_distortion;
use crate::encode::options::Tune;
use crate::encode::progress::unobserved;
use crate::encode::source::Source;
use crate::encode::testing::{MODELS, PARAMETERIZATIONS, source, tiled};
use crate::gaussian::{Gaussian, Parameterization, component_count};
use crate::testing::simd_levels;

const WIDTH: usize = 37;
const HEIGHT: usize = 21;
const BASE: [f32; 4] = [0.4, 0.5, 0.45, 0.55];

/// Runs a pass with an observer that never cancels.
fn run(pass: &mut Pass, scene: &Scene<'_>) -> RenderingError {
    unobserved(|observer| {
        pass.bin(scene, observer)?;
        pass.run(scene, None, observer)
    })
}

/// Half the distortion in f64, directly from the formulas of the paper.
fn loss(
    scene: &[Components<f64>],
    parameterization: Parameterization,
    kernel: Kernel,
    source: &Source<'_>,
    tiled: &TiledSource,
) -> f64 {
    let channels = source.color().channels();
    let mut residuals = Vec::new();
    for y in 0..HEIGHT {
        for x in 0..WIDTH {
            let mut sums = BASE.map(f64::from);
            for &Components { center, shape: [a, b, c], color } in scene {
                let (xx, xy, yy) = match parameterization {
                    Parameterization::Covariance => (a, b, c),
                    Parameterization::Cholesky => (a * a, a * b, b * b + c * c),
                    Parameterization::RotationScale => {
                        let (sin, cos) = c.sin_cos();
                        let (a, b) = (a * a, b * b);
                        (
                            cos * cos * a + sin * sin * b,
                            cos * sin * (a - b),
                            sin * sin * a + cos * cos * b,
                        )
                    }
                };
                let (dx, dy) = (x as f64 + 0.5 - center[0], y as f64 + 0.5 - center[1]);
                let determinant = xx * yy - xy * xy;
                let q = (yy * dx * dx - 2.0 * xy * dx * dy + xx * dy * dy) / determinant;
                let weight = match kernel {
                    Kernel::Quartic => (1.0 - q / 4.0).max(0.0).powi(2),
                    Kernel::Exponential { cutoff } if q <= f64::from(cutoff) => (-q / 2.0).exp(),
                    Kernel::Exponential { .. } => 0.0,
                };
                for (sum, color) in sums.iter_mut().zip(color) {
                    *sum += color * weight;
                }
            }
            for (channel, sum) in sums[..channels].iter().enumerate() {
                let index = (y * WIDTH + x) * channels + channel;
                let sample = f64::from(source.wide_sample(index)) / 65535.0;
                residuals.push(sum - sample);
            }
        }
    }
    let distortion = match tiled.loss.weights() {
        Some(weights) => plain_distortion(weights, [WIDTH, HEIGHT], &residuals),
        None => residuals.iter().map(|residual| residual * residual).sum(),
    };
    0.5 * distortion
}

/// Gaussians of many shapes: round, rotated, very elongated, and across the border of the picture.
fn scene(
    parameterization: Parameterization,
    channels: usize,
    rng: &mut fastrand::Rng,
) -> Vec<Components> {
    (0..12)
        .map(|index| {
            let (s1, s2) = match index % 3 {
                0 => (2.0 + 3.0 * rng.f32(), 2.0 + 3.0 * rng.f32()),
                1 => (6.0, 1.0 + rng.f32()),
                _ => (12.0, 0.8),
            };
            let angle = rng.f32() * 6.0 - 3.0;
            let factor = Parameterization::RotationScale.to_cholesky([s1, s2, angle]);
            let shape = match parameterization {
                Parameterization::RotationScale => [s1, s2, angle],
                _ => parameterization.shape_of(factor),
            };
            let center = [rng.f32() * 45.0 - 4.0, rng.f32() * 27.0 - 3.0];
            let mut color = [0.0; 4];
            color[..channels].fill_with(|| rng.f32() * 0.4 - 0.2);
            Components { center, shape, color }
        })
        .collect()
}

/// The splats of a scene.
fn splats_of(scene: &[Components], parameterization: Parameterization) -> Vec<Splat> {
    let splat = |components: &Components| {
        Splat::new(&components.gaussian(parameterization)).expect("the scene is valid")
    };
    scene.iter().map(splat).collect()
}

/// The samples of a picture of noise, and splats.
fn noise_and_splats(seed: u64) -> (Vec<u8>, Vec<Splat>) {
    let mut rng = fastrand::Rng::with_seed(seed);
    let samples = (0..WIDTH * HEIGHT * 3).map(|_| rng.u8(..)).collect();
    let scene = scene(Parameterization::Cholesky, 3, &mut rng);
    (samples, splats_of(&scene, Parameterization::Cholesky))
}

fn gradients(
    scene: &[Components],
    parameterization: Parameterization,
    kernel: Kernel,
    tiled: &TiledSource,
) -> Vec<Components> {
    let splats = splats_of(scene, parameterization);
    let mut pass = Pass::new(tiled);
    run(&mut pass, &Scene { tiled, splats: &splats, kernel, base: BASE });
    let gradients = scene.iter().enumerate().map(|(index, components)| {
        let SplatGradient { geometry, color } = pass.gradient(index, tiled.channels);
        let (center, shape) = parameterization.gradients(&geometry, components.shape);
        Components { center, shape, color }
    });
    gradients.collect()
}

#[test]
fn every_gradient_equals_its_finite_difference() {
    let mut rng = fastrand::Rng::with_seed(1);
    // Without black and white samples, where the residual is clamped. The cut-off is so far out
    // that the discontinuity there is below the resolution of f32.
    let kernels = [Kernel::Quartic, Kernel::Exponential { cutoff: 40.0 }];
    let cases = PARAMETERIZATIONS.into_iter().flat_map(|c| kernels.map(|k| (c, k, Tune::Psnr)));
    let visual = (Parameterization::Cholesky, Kernel::Quartic, Tune::Visual);
    for (parameterization, kernel, tune) in cases.chain([visual]) {
        for color in MODELS {
            let channels = color.channels();
            let samples: Vec<u8> = (0..WIDTH * HEIGHT * channels).map(|_| rng.u8(1..255)).collect();
            let source = source([WIDTH, HEIGHT], color, &samples);
            let scene = scene(parameterization, channels, &mut rng);
            let exact = scene.iter().map(|components| components.to_array().map(f64::from));
            let exact = exact.collect::<Vec<_>>();
            let tiled = tiled(source, tune);
            let found = gradients(&scene, parameterization, kernel, &tiled);
            for (index, found) in found.iter().enumerate() {
                let found = found.to_array();
                for component in 0..component_count(channels) {
                    let step = 1e-5 * exact[index][component].abs().max(1.0);
                    let moved = |by: f64| {
                        let mut moved = exact.clone();
                        moved[index][component] += by;
                        let moved: Vec<_> = moved.into_iter().map(Components::from_array).collect();
                        loss(&moved, parameterization, kernel, &source, &tiled)
                    };
                    let expected = (moved(step) - moved(-step)) / (2.0 * step);
                    let error = (f64::from(found[component]) - expected).abs();
                    // Relative, except for gradients near 0, which are sums of terms that cancel.
                    let error = error / (expected.abs() + 0.1);
                    assert!(
                        error <= 2e-3,
                        "{parameterization:?} {kernel:?} {tune:?} {color:?}, Gaussian {index}, \
                         component {component}: {} against {expected}",
                        found[component]
                    );
                }
            }
        }
    }
}

#[test]
fn every_simd_level_gives_the_same_bits() {
    let (samples, splats) = noise_and_splats(2);
    let source = source([WIDTH, HEIGHT], ColorModel::Rgb, &samples);
    let run = |level, tiled: &TiledSource| {
        let mut pass = Pass { level, ..Pass::new(tiled) };
        let kernel = Kernel::Quartic;
        let error = run(&mut pass, &Scene { tiled, splats: &splats, kernel, base: BASE });
        let gradients = (0..splats.len()).map(|splat| pass.gradient(splat, 3));
        (error, gradients.collect())
    };
    let bits = |(error, gradients): (RenderingError, Vec<SplatGradient>)| -> Vec<u64> {
        let gradients = gradients.iter().flat_map(|gradient| {
            let GeometrySums { first, second } = gradient.geometry;
            first.into_iter().chain(second).chain(gradient.color).map(f32::to_bits)
        });
        gradients
            .map(u64::from)
            .chain([error.squared.0, error.distortion.0].map(f64::to_bits))
            .collect()
    };
    for tune in [Tune::Visual, Tune::Psnr] {
        let tiled = tiled(source, tune);
        let expected = run(Level::baseline(), &tiled);
        assert!(expected.0.squared.0 > 0.0 && expected.0.distortion.0 > 0.0);
        let expected = bits(expected);
        for (name, level) in simd_levels() {
            let found = bits(run(level, &tiled));
            assert_eq!(found.len(), expected.len(), "{tune:?} {name}");
            let differing = found.iter().zip(&expected).filter(|(a, b)| a != b).count();
            assert_eq!(differing, 0, "{tune:?} {name}: of {} values", expected.len());
        }
    }
}

#[test]
fn pixels_outside_the_picture_and_values_above_white_are_no_error() {
    let white = [255; 5 * 3 * 3];
    let tiled = tiled(source([5, 3], ColorModel::Rgb, &white), Tune::Visual);
    let gaussian =
        Gaussian { center: [4.0, 2.0], cholesky: [9.0, 1.0, 7.0], color: [3.0, 3.0, 3.0, 0.0] };
    let splat = Splat::new(&gaussian).expect("it is valid");
    let mut pass = Pass::new(&tiled);
    let kernel = Kernel::Quartic;
    let scene = Scene { tiled: &tiled, splats: &[splat], kernel, base: [0.9; 4] };
    let error = run(&mut pass, &scene);
    assert_eq!(error, RenderingError::default());
    assert_eq!(pass.gradient(0, 3), SplatGradient::default());
}

#[test]
fn measured_placement_errors_are_those_of_the_tiles_rendered_again() {
    let (samples, splats) = noise_and_splats(3);
    let source = source([WIDTH, HEIGHT], ColorModel::Rgb, &samples);
    for tune in [Tune::Visual, Tune::Psnr] {
        let tiled = tiled(source, tune);
        let scene = Scene { tiled: &tiled, splats: &splats, kernel: Kernel::Quartic, base: BASE };
        for norm in [ErrorNorm::L1, ErrorNorm::L3] {
            let mut pass = Pass::new(&tiled);
            unobserved(|observer| {
                pass.bin(&scene, observer)?;
                pass.run(&scene, Some(norm), observer)
            });
            let columns = tiled.width.div_ceil(TILE_WIDTH);
            let expected = pass.placement_errors();
            assert_eq!(expected.len(), columns * tiled.height.div_ceil(TILE_HEIGHT));
            for (tile, &expected) in expected.iter().enumerate() {
                let corner = [tile % columns * TILE_WIDTH, tile / columns * TILE_HEIGHT];
                let planes = pass.residuals(&scene, tile);
                let found = tiled.loss.placement_errors(pass.level, corner, &planes, norm);
                assert!(expected > 0.0);
                assert_eq!(found.as_flattened().iter().sum::<f32>(), expected);
            }
        }
    }
}
