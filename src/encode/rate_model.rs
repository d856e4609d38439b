//! The rate model of the entropy coding: what training, rounding to the quantization grid and the choice of
//! codes assume about rate (bits) and distortion (squared error, where a full sample is 1, weighted for the
//! eye if the encoder is tuned for it).
//!
//! All steps follow from one, the step of colour, which is proportional to the square root of the
//! distortion per Gaussian. The *norm* of a Gaussian is the Euclidean length of its colour
//! times the square root of its area l11 l22: its square, the *energy*, is proportional to the sum of
//! the squares that it adds to the picture.

use super::loss::{ColorCurvature, Distortion};
use super::options::Tune;
use crate::coding::entropy::{MAX_EXPONENT, MOST_CODE, Quantization, steps, to_axes};
use crate::color::ColorModel;
use crate::gaussian::{Gaussian, component_count};

// Constants: docs/tuning.md, "Rate model".
/// The bits of a component ([`component_bits`]) on average over the Gaussians of a usual picture.
pub(crate) const USUAL_COMPONENT_BITS: f64 = 2.2;
/// The increase of log2 of [`bits_per_gaussian`] for one more bit per component.
const BITS_BY_COMPONENT: f64 = 0.15;
/// The share of a target's squared error that the fit may have; quantization adds the rest.
pub(crate) const SHARE_OF_FIT: f64 = 0.8;
/// The squared step of colour, as a share of the distortion per Gaussian: with it, a Gaussian takes
/// about [`bits_per_gaussian`].
const SQUARED_STEP: f64 = 0.22;
/// The range of the step of colour.
const STEP_RANGE: (f64, f64) = (1e-4, 16.0);
/// The Lagrange multiplier lambda, in squared steps of colour per bit: with it, making all steps a
/// little finer lowers the distortion by as much as lambda times the bits that it adds.
pub(crate) const LAMBDA: f32 = 0.322;

/// Bits of a Gaussian that is weaker than a step, and more for each bit of a component.
const LEAST_BITS: f64 = 9.0;
const BITS_OF_COMPONENT: f64 = 1.0;
/// Gaussians that the size is foretold by.
const MOST_OF_SAMPLE: usize = 1000;

/// Bits that an entropy-coded Gaussian takes on average, where a component takes `component_bits`. A
/// file of a given size is fitted with as many Gaussians as fit in at this rate: fewer and more
/// precise ones if they are strong, more and coarser ones if they are weak.
pub(crate) fn bits_per_gaussian(tune: Tune, component_bits: f64) -> f64 {
    let usual = match tune {
        Tune::Visual => 28.0,
        Tune::Psnr => 27.0,
    };
    usual * (BITS_BY_COMPONENT * (component_bits - USUAL_COMPONENT_BITS)).exp2()
}

/// The bits that a component of a Gaussian is taken to cost: log2(1 + s^2) / 2, where s is the
/// Gaussian's norm in steps of colour, because the steps of geometry get finer as it grows.
pub(crate) fn component_bits(gaussian: &Gaussian, color_step: f64) -> f64 {
    0.5 * (1.0 + f64::from(gaussian.energy()) / (color_step * color_step)).log2()
}

/// The step of colour with this base-2 logarithm, in the range of steps.
pub(crate) fn color_step(step: f64) -> f64 {
    step.exp2().clamp(STEP_RANGE.0, STEP_RANGE.1)
}

/// The base-2 logarithm of the step of colour for `count` Gaussians whose picture has this
/// distortion.
pub(crate) fn step_for(Distortion(distortion): Distortion, count: usize) -> f64 {
    0.5 * (SQUARED_STEP * distortion / count.max(1) as f64).log2()
}

/// The base-2 logarithm of the least step of colour with which all of these Gaussians have codes.
pub(crate) fn least_step(gaussians: &[Gaussian], model: ColorModel) -> f64 {
    let norm = |gaussian: &Gaussian| {
        let [l11, _, l22] = gaussian.cholesky;
        let axes = to_axes(gaussian.color, model);
        axes.iter().fold(0.0, |most: f32, axis| most.max(axis.abs())) * (l11 * l22).sqrt()
    };
    let largest = gaussians.iter().map(norm).fold(0.0, f32::max);
    f64::from(largest / MOST_CODE).log2()
}

/// The base-2 logarithm of the step of colour for a Lagrange multiplier in squared error per bit,
/// where samples are 0 to 255.
pub(crate) fn step_for_lambda(lambda: f64) -> f64 {
    0.5 * (lambda / (255.0 * 255.0) / f64::from(LAMBDA)).log2()
}

/// The Lagrange multiplier for which [`step_for_lambda`] gives this step.
pub(crate) fn lambda_for_step(step: f64) -> f64 {
    (2.0 * step).exp2() * f64::from(LAMBDA) * 255.0 * 255.0
}

/// The distortion per Gaussian for which [`step_for`] gives this step.
pub(crate) fn distortion_per_gaussian(step: f64) -> Distortion {
    Distortion((2.0 * step).exp2() / SQUARED_STEP)
}

/// The quantization grid for a step of colour, given by its base-2 logarithm, and multiples of it for each colour
/// axis, of which the first is 1: the nearest one that a file can have.
pub(crate) fn quantization(step: f64, axis_steps: &[f32]) -> Quantization {
    let step = steps::rounded(color_step(step) as f32);
    let color = axis_steps.iter().map(|multiple| step * steps::rounded_ratio(*multiple));
    Quantization::new(steps::USUAL_GEOMETRY, color.collect())
}

/// The Lagrange multiplier lambda for a quantization grid: squared error per bit.
pub(crate) fn lambda(quantization: &Quantization) -> f32 {
    LAMBDA * quantization.color[0] * quantization.color[0]
}

/// The step exponent for a Gaussian where errors count `perceptual weight` times: the base-2 logarithm of its norm
/// in steps of colour, with the curvature of the distortion, rounded and clamped to 0 to [`MAX_EXPONENT`].
pub(crate) fn step_exponent(
    gaussian: &Gaussian,
    perceptual_weight: f32,
    curvature: &ColorCurvature,
    quantization: &Quantization,
    model: ColorModel,
) -> u32 {
    let [l11, _, l22] = gaussian.cholesky;
    let squared = curvature.of(to_axes(gaussian.color, model));
    let steps = (squared * l11 * l22 * perceptual_weight).sqrt() / quantization.color[0];
    steps.max(1.0).log2().round().min(MAX_EXPONENT as f32) as u32
}

/// How the size of a file depends on the step: a Gaussian takes some bits, and some more for each bit of its
/// components ([`component_bits`]).
#[derive(Debug)]
pub(crate) struct SizeModel {
    /// The energies of some of the Gaussians.
    energies: Vec<f64>,
    /// Bits of all Gaussians for one bit of each of these.
    factor: f64,
    bits_by_component: f64,
}

impl SizeModel {
    pub(crate) fn new(gaussians: &[Gaussian], channels: usize) -> Self {
        let interval = (gaussians.len() / MOST_OF_SAMPLE).max(1);
        let sample = gaussians.iter().step_by(interval);
        let energies: Vec<f64> = sample.map(|gaussian| f64::from(gaussian.energy())).collect();
        Self {
            factor: gaussians.len() as f64 / energies.len().max(1) as f64,
            energies,
            bits_by_component: BITS_OF_COMPONENT * component_count(channels) as f64,
        }
    }

    /// The base-2 logarithm of the bits with a step.
    fn log_bits(&self, step: f64) -> f64 {
        let squared = (2.0 * step).exp2();
        let bits = |energy: &f64| 0.5 * (1.0 + energy / squared).log2();
        let by_components: f64 = self.energies.iter().map(bits).sum();
        let all = LEAST_BITS * self.energies.len() as f64 + self.bits_by_component * by_components;
        (self.factor * all.max(1.0)).log2()
    }

    /// The step with which a file has about so many bits.
    pub(crate) fn step_for_bits(&self, bits: f64) -> f64 {
        self.step_for(bits.max(1.0).log2())
    }

    /// The step with which the base-2 logarithm of the size changes by so much, from that of a step on.
    pub(crate) fn step_for_change(&self, step: f64, change: f64) -> f64 {
        // What the model does not know, it does not know of the other step either.
        self.step_for(self.log_bits(step) + change)
    }

    /// The step with these bits, as a base-2 logarithm.
    fn step_for(&self, log_bits: f64) -> f64 {
        let (mut fine, mut coarse) = (STEP_RANGE.0.log2(), STEP_RANGE.1.log2());
        for _ in 0..24 {
            let middle = 0.5 * (fine + coarse);
            if self.log_bits(middle) > log_bits { fine = middle } else { coarse = middle }
        }
        0.5 * (fine + coarse)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn strong_gaussians_take_more_bits() {
        let bits = |color: f32| {
            let cholesky = [4.0, 1.0, 1.0];
            let gaussian = Gaussian { center: [0.0; 2], cholesky, color: [color, 0.0, 0.0, 0.0] };
            component_bits(&gaussian, 2.0)
        };
        // Norms of 0, 1 and the root of 3 steps.
        for (color, expected) in [(0.0, 0.0), (1.0, 0.5), (3.0_f32.sqrt(), 1.0)] {
            assert!((bits(color) - expected).abs() < 1e-6, "{color}");
        }
        for tune in [Tune::Visual, Tune::Psnr] {
            let [weak, usual, strong] = [bits(0.1), USUAL_COMPONENT_BITS, bits(100.0)]
                .map(|component_bits| bits_per_gaussian(tune, component_bits));
            assert!(10.0 < weak && weak < usual && usual < strong && strong < 100.0);
        }
    }

    #[test]
    fn the_model_of_the_size_finds_steps() {
        let mut rng = fastrand::Rng::with_seed(6);
        let gaussian = |_| {
            let [l11, l22] = [(); 2].map(|()| 1.0 + 9.0 * rng.f32());
            let color = [rng.f32() - 0.5, rng.f32() - 0.5, rng.f32() - 0.5, 0.0];
            Gaussian { center: [0.0; 2], cholesky: [l11, 0.0, l22], color }
        };
        // More than those of the sample.
        let gaussians: Vec<_> = (0..2500).map(gaussian).collect();
        let model = SizeModel::new(&gaussians, 3);
        let step = model.step_for_bits(60_000.0);
        let component_bits: f64 =
            (gaussians.iter()).map(|gaussian| component_bits(gaussian, color_step(step))).sum();
        let bits = LEAST_BITS * 2500.0 + 8.0 * BITS_OF_COMPONENT * component_bits;
        assert!((bits / 60_000.0 - 1.0).abs() < 0.02, "{bits}");
        // Twice as many bits, and back.
        let finer = model.step_for_change(step, 1.0);
        assert!(finer < step && (model.step_for_change(finer, -1.0) - step).abs() < 1e-3);
        // No step gives less than the least bits, nor more than the finest one.
        assert!((model.step_for_bits(1.0) - STEP_RANGE.1.log2()).abs() < 1e-3);
        assert!((model.step_for_bits(1e9) - STEP_RANGE.0.log2()).abs() < 1e-3);
        assert!(SizeModel::new(&[], 3).step_for_bits(1000.0).is_finite());
    }

    #[test]
    fn each_exponent_is_for_twice_the_norm() {
        let quantization = quantization(0.0, &[1.0]);
        let curvature = ColorCurvature::of_squared_error(ColorModel::Gray);
        let exponent = |color: f32| {
            let cholesky = [4.0, 1.0, 1.0];
            let gaussian = Gaussian { center: [0.0; 2], cholesky, color: [color, 0.0, 0.0, 0.0] };
            step_exponent(&gaussian, 1.0, &curvature, &quantization, ColorModel::Gray)
        };
        assert_eq!(
            [0.0, 0.1, 0.5, 1.0, 2.0, 4.0, 1e6].map(exponent),
            [0, 0, 0, 1, 2, 3, MAX_EXPONENT]
        );
    }
}
