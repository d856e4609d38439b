//! How fine and how dear things are, by the error that a picture has anyway: what training, rounding
//! and the choice of codes have in common.

use crate::coding::entropy::{Lattice, MAX_CLASS, to_axes};
use crate::color::ColorModel;
use crate::gaussian::Gaussian;

/// Bits that a Gaussian takes, about: what decides how many a size holds.
pub(crate) const BITS_PER_GAUSSIAN: f64 = 29.0;
/// The share of the error that is there before rounding.
pub(crate) const SHARE_OF_FIT: f64 = 0.8;
/// The squared step of colour for a squared error of 1 per Gaussian: what gives Gaussians of
/// [`BITS_PER_GAUSSIAN`].
const STEP: f64 = 0.22;
/// Steps that a lattice may have.
const STEPS: (f64, f64) = (1e-4, 16.0);
/// Squared error that a bit is worth, in squared steps of colour: where the error of rounding
/// falls as fast by finer steps as it grows by their bits.
const LAMBDA: f32 = 0.322;
/// Steps of geometry that harm as much as a step of colour, for a Gaussian whose colour times the
/// root of its area is 1: from integrals of the quartic kernel's derivatives.
const POSITION: f32 = 1.095;
const SIZE: f32 = 0.775;
const RATIO: f32 = 0.866;
const SLANT: f32 = 1.732;
/// How much of what bits are worth counts in training: all of it leaves less error to be corrected
/// later than it saves.
const SHRINKAGE: f32 = 0.4;
/// Components of a Gaussian beside its colours.
const GEOMETRY: usize = 5;

/// The logarithm to base 2 of the step of colour for `count` Gaussians that leave a squared error.
pub(crate) fn step_for(error: f64, count: usize) -> f64 {
    0.5 * (STEP * error / count.max(1) as f64).log2()
}

/// The lattice of a step of colour, given by its logarithm to base 2.
pub(crate) fn lattice(step: f64, model: ColorModel) -> Lattice {
    let step = step.exp2().clamp(STEPS.0, STEPS.1) as f32;
    Lattice::new([POSITION, SIZE, RATIO, SLANT], vec![step; model.channels()])
}

/// The squared error that a bit is worth.
pub(crate) fn lambda(lattice: &Lattice) -> f32 {
    LAMBDA * lattice.color[0] * lattice.color[0]
}

/// The class of precision for a Gaussian's strength: as many times as that is twice a step.
pub(crate) fn class_of(gaussian: &Gaussian, lattice: &Lattice, model: ColorModel) -> u32 {
    let [l11, _, l22] = gaussian.cholesky;
    let squared = to_axes(gaussian.color, model).iter().map(|c| c * c).sum::<f32>();
    let steps = (squared * l11 * l22).sqrt() / lattice.color[0];
    steps.max(1.0).log2().round().min(MAX_CLASS as f32) as u32
}

/// What training has to do with bits: each component of a Gaussian takes about log2(1 + s^2) / 2 of
/// them, s being its strength in steps, since steps of geometry get finer with it. So what is weak
/// fades away, and what is strong gets there without others that cancel it.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Shrinkage {
    squared_step: f32,
    weight: f32,
}

impl Shrinkage {
    /// For `count` Gaussians that leave a squared error.
    pub(crate) fn new(error: f64, count: usize, channels: usize) -> Self {
        let squared_step = (2.0 * step_for(error, count)).exp2() as f32;
        let components = (GEOMETRY + channels) as f32;
        let weight = SHRINKAGE * LAMBDA * components * (0.5 * core::f32::consts::LOG2_E);
        Self { squared_step, weight: weight * squared_step }
    }

    /// Half of the derivative by the colour of what the Gaussian's bits are worth.
    pub(crate) fn gradient(&self, gaussian: &Gaussian) -> [f32; 4] {
        let [l11, _, l22] = gaussian.cholesky;
        let area = l11 * l22;
        let squared = gaussian.color.iter().map(|color| color * color).sum::<f32>();
        let factor = self.weight * area / (self.squared_step + squared * area);
        gaussian.color.map(|color| factor * color)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn shrinkage_is_the_derivative_of_bits() {
        let gaussian = Gaussian {
            center: [3.0, 4.0],
            cholesky: [2.0, 0.3, 1.5],
            color: [0.3, -0.1, 0.2, 0.0],
        };
        let (error, count) = (3.0, 20);
        let lattice = lattice(step_for(error, count), ColorModel::Rgb);
        let worth = |color: [f64; 4]| {
            let squared = color.iter().map(|color| color * color).sum::<f64>() * 2.0 * 1.5;
            let steps = squared / f64::from(lattice.color[0]).powi(2);
            let bits = 8.0 * 0.5 * (1.0 + steps).log2();
            f64::from(SHRINKAGE) * f64::from(lambda(&lattice)) * bits
        };
        let gradient = Shrinkage::new(error, count, 3).gradient(&gaussian);
        for channel in 0..3 {
            let at = |off: f64| {
                let mut color = gaussian.color.map(f64::from);
                color[channel] += off;
                worth(color)
            };
            let half = (at(1e-4) - at(-1e-4)) / 2e-4 / 2.0;
            let relative = f64::from(gradient[channel]) / half - 1.0;
            assert!(relative.abs() < 1e-3, "channel {channel}: {gradient:?}, {half}");
        }
        assert_eq!(gradient[3], 0.0);
    }

    #[test]
    fn classes_double() {
        let lattice = lattice(0.0, ColorModel::Gray);
        let class = |color: f32| {
            let cholesky = [4.0, 1.0, 1.0];
            let gaussian = Gaussian { center: [0.0; 2], cholesky, color: [color, 0.0, 0.0, 0.0] };
            class_of(&gaussian, &lattice, ColorModel::Gray)
        };
        assert_eq!([0.0, 0.1, 0.5, 1.0, 2.0, 4.0, 1e6].map(class), [0, 0, 0, 1, 2, 3, MAX_CLASS]);
    }
}
