//! What a small change of a Gaussian's geometry does to the error, to second order.
//!
//! Everything is measured in the frame of the Gaussian itself, with its factor L and its centre m:
//! the place (u, v) of a point p is L^-1 (p - m), and q = u^2 + v^2. Where a Gaussian grows, its
//! colour is understood to shrink so that colour times the root of its area stays: that is how
//! codes have it, and what leaves the sum of its squares alone.

use crate::gaussian::Gaussian;

/// Half of the second derivatives of a Gaussian's squared error, for one whose colour times the
/// root of its area is 1: integrals of the quartic kernel (1 - q/4)^2.
const POSITION: f32 = 2.094_395;
const SIZE: f32 = 4.188_79;
const RATIO: f32 = 3.351_032;
const SLANT: f32 = 0.837_758;

/// From one Gaussian to another, or a slope along that way.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub(crate) struct GeometryChange {
    /// Of the centre, in the first one's frame.
    pub(crate) center: [f32; 2],
    /// Of the logarithm of the root of l11 l22.
    pub(crate) size: f32,
    /// Of the logarithm of the root of l11 / l22.
    pub(crate) ratio: f32,
    /// Of l21 / l22.
    pub(crate) slant: f32,
}

impl GeometryChange {
    /// From one Gaussian's centre and factor to those of another.
    pub(crate) fn between(from: &Gaussian, to: &Gaussian) -> Self {
        let [l11, l21, l22] = from.cholesky;
        let [m11, m21, m22] = to.cholesky;
        let [dx, dy] = [to.center[0] - from.center[0], to.center[1] - from.center[1]];
        let u = dx / l11;
        let (log1, log2) = ((m11 / l11).ln(), (m22 / l22).ln());
        Self {
            center: [u, (dy - l21 * u) / l22],
            size: 0.5 * (log1 + log2),
            ratio: 0.5 * (log1 - log2),
            slant: m21 / m22 - l21 / l22,
        }
    }

    /// The Gaussian that lies this far from another.
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

    /// The change of squared error along these slopes, for a Gaussian of a slant (l21 / l22) and
    /// of a squared strength: its squared colour times its area.
    pub(crate) fn change(&self, way: &Self, slant: f32, strength: f32) -> f32 {
        let linear = self.center[0] * way.center[0]
            + self.center[1] * way.center[1]
            + self.size * way.size
            + self.ratio * way.ratio
            + self.slant * way.slant;
        // What the ratio does to the slanted axis, the slant undoes.
        let sheared = way.slant - 2.0 * slant * way.ratio;
        let [u, v] = way.center;
        let quadratic = POSITION * (u * u + v * v)
            + SIZE * way.size * way.size
            + RATIO * way.ratio * way.ratio
            + SLANT * sheared * sheared;
        linear + strength * quadratic
    }

    /// The way along these slopes that lowers the error most, no longer than `reach` in any
    /// component.
    pub(crate) fn best(&self, slant: f32, strength: f32, reach: f32) -> Self {
        let way = |slope: f32, curvature: f32| {
            (-slope / (2.0 * curvature * strength)).clamp(-reach, reach)
        };
        let ratio = way(self.ratio + 2.0 * slant * self.slant, RATIO);
        Self {
            center: self.center.map(|slope| way(slope, POSITION)),
            size: way(self.size, SIZE),
            ratio,
            slant: way(self.slant, SLANT) + 2.0 * slant * ratio,
        }
    }
}

/// Sums over the pixels of a Gaussian: its colour times the error, with t = 1 - q/4 and its place.
#[derive(Clone, Copy, Debug)]
pub(crate) struct GeometryErrorSums {
    /// With t u and t v.
    pub(crate) first: [f32; 2],
    /// With t u^2, t u v and t v^2.
    pub(crate) second: [f32; 3],
    /// With t^2.
    pub(crate) along: f32,
}

impl GeometryErrorSums {
    /// The derivatives of the squared error.
    pub(crate) fn slopes(&self, gaussian: &Gaussian) -> GeometryChange {
        let [_, l21, l22] = gaussian.cholesky;
        let [uu, uv, vv] = self.second;
        GeometryChange {
            center: self.first.map(|sum| 2.0 * sum),
            size: 2.0 * (uu + vv - self.along),
            ratio: 2.0 * (uu - vv - 2.0 * l21 / l22 * uv),
            slant: 2.0 * uv,
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// The quartic kernel of a Gaussian at a point.
    fn shown(gaussian: &Gaussian, x: f64, y: f64) -> f64 {
        let [l11, l21, l22] = gaussian.cholesky.map(f64::from);
        let u = (x - f64::from(gaussian.center[0])) / l11;
        let v = (y - f64::from(gaussian.center[1]) - l21 * u) / l22;
        f64::from(gaussian.color[0]) * (1.0 - (u * u + v * v) / 4.0).max(0.0).powi(2)
    }

    /// The squared difference of two Gaussians and of a third from the first, over fine pixels.
    fn difference(first: &Gaussian, second: &Gaussian) -> f64 {
        let steps = 400;
        let at = |step: i32| f64::from(step) / f64::from(steps) * 30.0 - 15.0;
        let pixel = (30.0 / f64::from(steps)).powi(2);
        let places = (0..steps).flat_map(|row| (0..steps).map(move |column| (at(column), at(row))));
        places.map(|(x, y)| (shown(first, x, y) - shown(second, x, y)).powi(2) * pixel).sum()
    }

    fn gaussian() -> Gaussian {
        Gaussian { center: [0.3, -0.2], cholesky: [2.0, 0.9, 1.5], color: [0.5, 0.0, 0.0, 0.0] }
    }

    fn ways() -> [GeometryChange; 7] {
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
    fn there_and_back_is_nowhere() {
        for way in ways() {
            let there = way.applied(&gaussian());
            let found = GeometryChange::between(&gaussian(), &there);
            let off = GeometryChange { size: found.size - way.size, ..found };
            assert!(off.size.abs() < 1e-6 && (found.ratio - way.ratio).abs() < 1e-6, "{found:?}");
            assert!((found.slant - way.slant).abs() < 1e-6, "{found:?}");
            assert!((found.center[0] - way.center[0]).abs() < 1e-6, "{found:?}");
            assert!((found.center[1] - way.center[1]).abs() < 1e-6, "{found:?}");
        }
    }

    #[test]
    fn curvatures_are_those_of_the_kernel() {
        let gaussian = gaussian();
        let [l11, l21, l22] = gaussian.cholesky;
        let strength = gaussian.color[0] * gaussian.color[0] * l11 * l22;
        for way in ways() {
            let seen = difference(&gaussian, &way.applied(&gaussian));
            let said = f64::from(GeometryChange::default().change(&way, l21 / l22, strength));
            assert!((said / seen - 1.0).abs() < 0.05, "{way:?}: {said:e}, seen {seen:e}");
        }
    }

    #[test]
    fn the_best_way_is_where_the_slope_ends() {
        let slopes = GeometryChange { center: [0.2, -0.1], size: 0.3, ratio: -0.2, slant: 0.1 };
        let best = slopes.best(0.6, 2.0, 1.0);
        let least = slopes.change(&best, 0.6, 2.0);
        for way in ways() {
            for sign in [-1.0, 1.0] {
                let near = GeometryChange {
                    center: [0, 1].map(|axis| best.center[axis] + sign * way.center[axis]),
                    size: best.size + sign * way.size,
                    ratio: best.ratio + sign * way.ratio,
                    slant: best.slant + sign * way.slant,
                };
                assert!(slopes.change(&near, 0.6, 2.0) > least, "{way:?}");
            }
        }
    }
}
