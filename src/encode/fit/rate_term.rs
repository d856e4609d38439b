//! The rate term of Gauss-Newton steps, which makes Gaussians cheap to code (entropy coding only).

use fearless_simd::{Simd, f32x16, prelude::*};

use crate::encode::loss::Distortion;
use crate::encode::options::Tune;
use crate::encode::rate_model::{LAMBDA, step_for};
use crate::gaussian::component_count;

// Constants: docs/tuning.md, "Steps of training".
/// The weight of the term, as a share of lambda: with more, training loses more quality than it saves bits.
fn weight(tune: Tune) -> f32 {
    match tune {
        Tune::Visual => 0.75,
        Tune::Psnr => 0.55,
    }
}

/// The rate term. A Gaussian of norm s, in steps of colour, with the Cholesky factor L and the area
/// A = l11 l22 is taken to cost these bits, up to a constant:
///
/// - log2(1 + s^2) / 2 for every component, as in
///   [`component_bits`](crate::encode::rate_model::component_bits). Weak Gaussians fade away, and strong
///   ones do not grow only to cancel each other.
/// - log2(1 / A) for the position: the larger a Gaussian, the fewer places there are for it.
/// - log2(T / (2 A)) for the shape, where T is the trace of the covariance. With the standard deviations
///   s1 and s2 along the axes, it is log2((s1 / s2 + s2 / s1) / 2), so 0 for a circle: most Gaussians
///   are nearly round, and needles are rare.
#[derive(Clone, Copy, Debug)]
pub(super) struct RateTerm {
    squared_step: f32,
    components: f32,
    /// Half of what a bit costs, times log2(e): the training loss is half the distortion, and
    /// gradients are those of natural logarithms.
    weight: f32,
}

impl RateTerm {
    /// The term for `count` Gaussians whose picture has this distortion.
    pub(super) fn new(tune: Tune, distortion: Distortion, count: usize, channels: usize) -> Self {
        let squared_step = (2.0 * step_for(distortion, count)).exp2() as f32;
        Self {
            squared_step,
            components: component_count(channels) as f32,
            weight: 0.5 * weight(tune) * LAMBDA * squared_step * core::f32::consts::LOG2_E,
        }
    }

    /// The gradients of half the term by the colours of sixteen Gaussians of these areas and squared lengths
    /// of colour, as factors on the colours.
    #[inline(always)]
    pub(super) fn by_color<S: Simd>(&self, area: f32x16<S>, squared: f32x16<S>) -> f32x16<S> {
        area * (self.weight * self.components) / (squared * area + self.squared_step)
    }

    /// The gradients of half the term by size (at constant norm), ratio and shear, each in the
    /// Gaussian's own frame, for sixteen Gaussians with these Cholesky factors.
    #[inline(always)]
    pub(super) fn by_shape<S: Simd>(
        &self,
        simd: S,
        [l11, l21, l22]: [f32x16<S>; 3],
    ) -> [f32x16<S>; 3] {
        let twice = f32x16::splat(simd, 2.0 * self.weight);
        let (first, second) = (l11 * l11 + l21 * l21, l22 * l22);
        let by_trace = twice / (first + second);
        [-twice, by_trace * (first - second), by_trace * (l21 * l22)]
    }
}

#[cfg(test)]
mod tests {
    use fearless_simd::{Level, dispatch};

    use super::*;

    /// Bits of a Gaussian with a Cholesky factor and three channels.
    fn bits([l11, l21, l22]: [f64; 3], color: [f64; 3], squared_step: f64) -> f64 {
        let area = l11 * l22;
        let energy = color.iter().map(|color| color * color).sum::<f64>() * area;
        let components = 8.0 * 0.5 * (1.0 + energy / squared_step).log2();
        let shape = ((l11 * l11 + l21 * l21 + l22 * l22) / (2.0 * area)).log2();
        components - area.log2() + shape
    }

    #[test]
    fn the_gradient_is_that_of_the_bits() {
        let (distortion, count) = (Distortion(3.0), 20);
        let squared_step = (2.0 * step_for(distortion, count)).exp2();
        let rate_term = RateTerm::new(Tune::Psnr, distortion, count, 3);
        for (cholesky, color) in [
            ([2.0, 0.3, 1.5], [0.3, -0.1, 0.2]),
            ([0.5, -4.0, 3.0], [0.0, 2.0, -0.01]),
            ([9.0, 0.0, 0.4], [0.001, 0.0, 0.0]),
        ] {
            let [l11, l21, l22] = cholesky;
            let squared = color.iter().map(|color| color * color).sum::<f64>();
            let (by_shape, by_color) = dispatch!(Level::new(), simd => {
                let wide = |value: f64| f32x16::splat(simd, value as f32);
                let by_shape = rate_term.by_shape(simd, cholesky.map(wide));
                let by_color = rate_term.by_color(wide(l11 * l22), wide(squared));
                (by_shape.map(|lanes| lanes.to_array()[3]), by_color.to_array()[3])
            });
            let lambda = f64::from(weight(Tune::Psnr) * LAMBDA) * squared_step;
            let at =
                |shape: [f64; 3], color: [f64; 3]| 0.5 * lambda * bits(shape, color, squared_step);
            let along = |direction: usize, by: f64| match direction {
                0 => at(cholesky.map(|l| l * by.exp()), color.map(|color| color / by.exp())),
                1 => at([l11 * by.exp(), l21 * by.exp(), l22 / by.exp()], color),
                2 => at([l11, l21 + l22 * by, l22], color),
                channel => {
                    let mut color = color;
                    color[channel - 3] += by;
                    at(cholesky, color)
                }
            };
            let by_color = color.map(|color| by_color * color as f32);
            for (direction, found) in by_shape.into_iter().chain(by_color).enumerate() {
                let expected = (along(direction, 1e-5) - along(direction, -1e-5)) / 2e-5;
                let error = (f64::from(found) - expected).abs();
                assert!(
                    error < 1e-4 * lambda + 1e-3 * expected.abs(),
                    "{direction}: {found}, {expected}"
                );
            }
        }
    }
}
