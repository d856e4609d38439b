//! A quadratic model of the squared error as a function of a small change of a Gaussian's geometry.
//! The curvatures, and the frame in which changes are measured, are those of `encode/curvature.rs`.

use crate::encode::curvature::{POSITION, RATIO, SIZE, SLANT};
use crate::gaussian::Gaussian;

/// A change of a Gaussian's geometry, or a gradient by its components.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub(crate) struct GeometryChange {
    /// The change of the centre, in the Gaussian's frame before.
    pub(crate) center: [f32; 2],
    /// The change of ln(l11 l22) / 2.
    pub(crate) size: f32,
    /// The change of ln(l11 / l22) / 2.
    pub(crate) ratio: f32,
    /// The change of l21 / l22.
    pub(crate) slant: f32,
}

impl GeometryChange {
    /// A Gaussian after this change, with the same strength.
    pub(crate) fn applied(&self, gaussian: &Gaussian) -> Gaussian {
        let [l11, l21, l22] = gaussian.cholesky;
        let [u, v] = self.center;
        let (m11, m22) =
            (l11 * (self.size + self.ratio).exp(), l22 * (self.size - self.ratio).exp());
        Gaussian {
            center: [gaussian.center[0] + l11 * u, gaussian.center[1] + l21 * u + l22 * v],
            cholesky: [m11, (l21 / l22 + self.slant) * m22, m22],
            color: gaussian.color.map(|color| color * (-self.size).exp()),
        }
    }

    /// The change of the squared error that the model predicts for a change of geometry; `self` is the
    /// gradient. `slant` is the Gaussian's l21 / l22, and `squared_strength` the sum of its squared colours
    /// times its area.
    pub(crate) fn error_change(&self, change: &Self, slant: f32, squared_strength: f32) -> f32 {
        let linear = self.center[0] * change.center[0]
            + self.center[1] * change.center[1]
            + self.size * change.size
            + self.ratio * change.ratio
            + self.slant * change.slant;
        // A change of the ratio also shears a slanted Gaussian, unless the slant makes up for it.
        let shear = change.slant - 2.0 * slant * change.ratio;
        let [u, v] = change.center;
        let quadratic = POSITION * (u * u + v * v)
            + SIZE * change.size * change.size
            + RATIO * change.ratio * change.ratio
            + SLANT * shear * shear;
        linear + squared_strength * quadratic
    }

    /// The change of geometry with the least error, where `self` is the gradient. Every component
    /// is clamped to `max_change`.
    pub(crate) fn minimizer(&self, slant: f32, squared_strength: f32, max_change: f32) -> Self {
        let component = |derivative: f32, curvature: f32| {
            (-derivative / (2.0 * curvature * squared_strength)).clamp(-max_change, max_change)
        };
        let ratio = component(self.ratio + 2.0 * slant * self.slant, RATIO);
        Self {
            center: self.center.map(|derivative| component(derivative, POSITION)),
            size: component(self.size, SIZE),
            ratio,
            slant: component(self.slant, SLANT) + 2.0 * slant * ratio,
        }
    }
}

/// The sums over pixels from which the gradient by a Gaussian's geometry follows. In them, e is the
/// scalar product of the Gaussian's colour and the residual at a pixel, and t = 1 - q/4.
#[derive(Clone, Copy, Debug)]
pub(crate) struct GeometryErrorSums {
    /// The sums of e t u and e t v.
    pub(crate) first: [f32; 2],
    /// The sums of e t u^2, e t u v and e t v^2.
    pub(crate) second: [f32; 3],
    /// The sum of e t^2.
    pub(crate) weighted: f32,
}

impl GeometryErrorSums {
    /// The gradient of the squared error by the geometry of `gaussian`.
    pub(crate) fn gradient(&self, gaussian: &Gaussian) -> GeometryChange {
        let [_, l21, l22] = gaussian.cholesky;
        let [uu, uv, vv] = self.second;
        GeometryChange {
            center: self.first.map(|sum| 2.0 * sum),
            size: 2.0 * (uu + vv - self.weighted),
            ratio: 2.0 * (uu - vv - 2.0 * l21 / l22 * uv),
            slant: 2.0 * uv,
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// The change from one Gaussian's geometry to that of another.
    fn between(from: &Gaussian, to: &Gaussian) -> GeometryChange {
        let [l11, l21, l22] = from.cholesky;
        let [m11, m21, m22] = to.cholesky;
        let [dx, dy] = [to.center[0] - from.center[0], to.center[1] - from.center[1]];
        let u = dx / l11;
        let (log1, log2) = ((m11 / l11).ln(), (m22 / l22).ln());
        GeometryChange {
            center: [u, (dy - l21 * u) / l22],
            size: 0.5 * (log1 + log2),
            ratio: 0.5 * (log1 - log2),
            slant: m21 / m22 - l21 / l22,
        }
    }

    /// What a Gaussian adds to the first channel at a point.
    fn value(gaussian: &Gaussian, x: f64, y: f64) -> f64 {
        let [l11, l21, l22] = gaussian.cholesky.map(f64::from);
        let u = (x - f64::from(gaussian.center[0])) / l11;
        let v = (y - f64::from(gaussian.center[1]) - l21 * u) / l22;
        f64::from(gaussian.color[0]) * (1.0 - (u * u + v * v) / 4.0).max(0.0).powi(2)
    }

    /// The integral of the squared difference of two Gaussians, as a sum over fine pixels.
    fn difference(first: &Gaussian, second: &Gaussian) -> f64 {
        let steps = 400;
        let at = |step: i32| f64::from(step) / f64::from(steps) * 30.0 - 15.0;
        let pixel = (30.0 / f64::from(steps)).powi(2);
        let points = (0..steps).flat_map(|row| (0..steps).map(move |column| (at(column), at(row))));
        points.map(|(x, y)| (value(first, x, y) - value(second, x, y)).powi(2) * pixel).sum()
    }

    fn gaussian() -> Gaussian {
        Gaussian { center: [0.3, -0.2], cholesky: [2.0, 0.9, 1.5], color: [0.5, 0.0, 0.0, 0.0] }
    }

    fn changes() -> [GeometryChange; 7] {
        let none = GeometryChange::default();
        let small = 0.02;
        [
            GeometryChange { center: [small, 0.0], ..none },
            GeometryChange { center: [0.0, small], ..none },
            GeometryChange { size: small, ..none },
            GeometryChange { ratio: small, ..none },
            GeometryChange { slant: small, ..none },
            GeometryChange { ratio: small, slant: -small, ..none },
            GeometryChange {
                center: [small, -small],
                size: -small,
                ratio: small,
                slant: 0.5 * small,
            },
        ]
    }

    #[test]
    fn an_applied_change_is_found_again() {
        for change in changes() {
            let found = between(&gaussian(), &change.applied(&gaussian()));
            assert!((found.size - change.size).abs() < 1e-6, "{found:?}");
            assert!((found.ratio - change.ratio).abs() < 1e-6, "{found:?}");
            assert!((found.slant - change.slant).abs() < 1e-6, "{found:?}");
            assert!((found.center[0] - change.center[0]).abs() < 1e-6, "{found:?}");
            assert!((found.center[1] - change.center[1]).abs() < 1e-6, "{found:?}");
        }
    }

    #[test]
    fn curvatures_are_those_of_the_kernel() {
        let gaussian = gaussian();
        let [l11, l21, l22] = gaussian.cholesky;
        let squared_strength = gaussian.color[0] * gaussian.color[0] * l11 * l22;
        let gradient = GeometryChange::default();
        for change in changes() {
            let expected = difference(&gaussian, &change.applied(&gaussian));
            let found = f64::from(gradient.error_change(&change, l21 / l22, squared_strength));
            assert!((found / expected - 1.0).abs() < 0.05, "{change:?}: {found:e}, {expected:e}");
        }
    }

    #[test]
    fn the_minimizer_has_the_least_error() {
        let gradient = GeometryChange { center: [0.2, -0.1], size: 0.3, ratio: -0.2, slant: 0.1 };
        let best = gradient.minimizer(0.6, 2.0, 1.0);
        let least = gradient.error_change(&best, 0.6, 2.0);
        for change in changes() {
            for sign in [-1.0, 1.0] {
                let near = GeometryChange {
                    center: [0, 1].map(|axis| best.center[axis] + sign * change.center[axis]),
                    size: best.size + sign * change.size,
                    ratio: best.ratio + sign * change.ratio,
                    slant: best.slant + sign * change.slant,
                };
                assert!(gradient.error_change(&near, 0.6, 2.0) > least, "{change:?}");
            }
        }
    }
}
