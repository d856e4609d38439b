//! A Gaussian's own frame: the gradient and the curvature of the squared error there.
//!
//! With its Cholesky factor L and its centre m, a point p has the coordinates (u, v) = L^-1 (p - m), and
//! q = u^2 + v^2. The geometry changes in five directions: the *centre* along u and v, and the shape, where L
//! becomes L (I + D), by *size*, *ratio* and *shear*. D is the identity for the size, diag(1, -1) for the
//! ratio, and 1 in the lower left corner for the shear. The logarithm of the size is ln(l11 l22) / 2, that
//! of the ratio ln(l11 / l22) / 2.
//!
//! Codes have the *slant*, l21 / l22, in place of the shear. Where the slant remains, a change of the ratio
//! shears the Gaussian, too: the shear is the change of the slant, minus twice the slant times the change
//! of the ratio.
//!
//! When the size of a Gaussian changes, its colour changes too, such that its norm, colour times the
//! square root of the area l11 l22, and with it the sum of its squares, remains the same. Then the Hessian
//! is diagonal: it mixes neither the directions of the geometry nor geometry and colour.

use core::ops::{Add, Mul, Sub};

use crate::gaussian::Gaussian;

/// The curvatures: half of the second derivatives of the squared error of one Gaussian, which are integrals
/// of the squares of the quartic kernel's derivatives. Those by the geometry are for an energy of 1.
///
/// By either coordinate of the centre: 2 pi / 3.
pub(crate) const CENTER_CURVATURE: f32 = 2.094_395;
/// By the logarithm of the size: 4 pi / 3.
pub(crate) const SIZE_CURVATURE: f32 = 4.188_79;
/// By the logarithm of the ratio: 16 pi / 15.
pub(crate) const RATIO_CURVATURE: f32 = 3.351_032;
/// By the shear: 4 pi / 15.
pub(crate) const SHEAR_CURVATURE: f32 = 0.837_758;
/// By the colour, for an area of 1: 4 pi / 5.
pub(crate) const COLOR_CURVATURE: f32 = 2.513_274;

/// The sums over pixels from which the gradient by a Gaussian's geometry follows. In them, s is
/// -2 dLoss/dq, where the loss is half the error, and d the pixel minus the centre: in pixels, or in the
/// own frame.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub(crate) struct GeometrySums<T = f32> {
    /// The sum of s d: (x, y). In the own frame, it is the gradient by the centre.
    pub(crate) first: [T; 2],
    /// The sum of s d d^T: (xx, xy, yy).
    pub(crate) second: [T; 3],
}

impl<T: Copy + Add<Output = T> + Sub<Output = T> + Mul<Output = T>> GeometrySums<T> {
    /// Sums in pixels, in the own frame instead, given the inverse M of the Cholesky factor: M (sum of
    /// s d) and M (sum of s d d^T) M^T.
    #[inline(always)]
    pub(crate) fn in_own_frame(self, [i11, w, i22]: [T; 3]) -> Self {
        let Self { first: [x, y], second: [xx, xy, yy] } = self;
        let across = w * xx + i22 * xy;
        Self {
            first: [i11 * x, w * x + i22 * y],
            second: [i11 * i11 * xx, i11 * across, w * across + i22 * (w * xy + i22 * yy)],
        }
    }

    /// The gradient by size, ratio and shear, where colours stay: the sums of the products of the entries
    /// of D and of these sums in the own frame.
    #[inline(always)]
    pub(crate) fn by_shape(self) -> [T; 3] {
        let [uu, uv, vv] = self.second;
        [uu + vv, uu - vv, uv]
    }
}

impl Add for GeometrySums {
    type Output = Self;

    fn add(self, other: Self) -> Self {
        Self {
            first: core::array::from_fn(|at| self.first[at] + other.first[at]),
            second: core::array::from_fn(|at| self.second[at] + other.second[at]),
        }
    }
}

/// The coordinates of a point in a Gaussian's own frame.
pub(crate) fn coordinates(gaussian: &Gaussian, [x, y]: [f32; 2]) -> [f32; 2] {
    let [l11, l21, l22] = gaussian.cholesky;
    let u = (x - gaussian.center[0]) / l11;
    [u, (y - gaussian.center[1] - l21 * u) / l22]
}

/// A change of the geometry that a code has, or a gradient by it.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub(crate) struct GeometryChange {
    /// The change of the centre, in the frame before.
    pub(crate) center: [f32; 2],
    /// The change of ln(l11 l22) / 2.
    pub(crate) size: f32,
    /// The change of ln(l11 / l22) / 2.
    pub(crate) ratio: f32,
    /// The change of l21 / l22.
    pub(crate) slant: f32,
}

impl GeometryChange {
    /// The gradient of the squared error by the geometry of a Gaussian. `sums` are those in its own frame;
    /// `by_color` is the sum of the products of its colours and of half the gradient by them.
    pub(crate) fn gradient(gaussian: &Gaussian, sums: GeometrySums, by_color: f32) -> Self {
        let [_, l21, l22] = gaussian.cholesky;
        let [size, ratio, shear] = sums.by_shape();
        Self {
            center: sums.first.map(|sum| 2.0 * sum),
            size: 2.0 * (size - by_color),
            ratio: 2.0 * (ratio - 2.0 * l21 / l22 * shear),
            slant: 2.0 * shear,
        }
    }

    /// A Gaussian after this change, with the same norm.
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
    /// gradient. `slant` is the Gaussian's l21 / l22, and `energy` the sum of its squared colours
    /// times its area.
    pub(crate) fn error_change(&self, change: &Self, slant: f32, energy: f32) -> f32 {
        let linear = self.center[0] * change.center[0]
            + self.center[1] * change.center[1]
            + self.size * change.size
            + self.ratio * change.ratio
            + self.slant * change.slant;
        let shear = change.slant - 2.0 * slant * change.ratio;
        let [u, v] = change.center;
        let quadratic = CENTER_CURVATURE * (u * u + v * v)
            + SIZE_CURVATURE * change.size * change.size
            + RATIO_CURVATURE * change.ratio * change.ratio
            + SHEAR_CURVATURE * shear * shear;
        linear + energy * quadratic
    }

    /// The change of geometry with the least error, where `self` is the gradient. Every component
    /// is clamped to `max_change`.
    pub(crate) fn minimizer(&self, slant: f32, energy: f32, max_change: f32) -> Self {
        let component = |derivative: f32, curvature: f32| {
            (-derivative / (2.0 * curvature * energy)).clamp(-max_change, max_change)
        };
        let ratio = component(self.ratio + 2.0 * slant * self.slant, RATIO_CURVATURE);
        Self {
            center: self.center.map(|derivative| component(derivative, CENTER_CURVATURE)),
            size: component(self.size, SIZE_CURVATURE),
            ratio,
            slant: component(self.slant, SHEAR_CURVATURE) + 2.0 * slant * ratio,
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::encode::testing::weight;

    /// The change from one Gaussian's geometry to that of another.
    fn between(from: &Gaussian, to: &Gaussian) -> GeometryChange {
        let [l11, l21, l22] = from.cholesky;
        let [m11, m21, m22] = to.cholesky;
        let (log1, log2) = ((m11 / l11).ln(), (m22 / l22).ln());
        GeometryChange {
            center: coordinates(from, to.center),
            size: 0.5 * (log1 + log2),
            ratio: 0.5 * (log1 - log2),
            slant: m21 / m22 - l21 / l22,
        }
    }

    /// The integral of the squared difference of two Gaussians, as a sum over fine pixels.
    fn difference(first: &Gaussian, second: &Gaussian) -> f64 {
        let steps = 400;
        let at = |step: i32| f64::from(step) / f64::from(steps) * 30.0 - 15.0;
        let pixel = (30.0 / f64::from(steps)).powi(2);
        let points = (0..steps).flat_map(|row| (0..steps).map(move |column| (at(column), at(row))));
        // What a Gaussian adds to the first channel.
        let value = |gaussian: &Gaussian, at| f64::from(gaussian.color[0]) * weight(gaussian, at);
        points.map(|(x, y)| (value(first, [x, y]) - value(second, [x, y])).powi(2) * pixel).sum()
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
        let energy = gaussian.color[0] * gaussian.color[0] * l11 * l22;
        let gradient = GeometryChange::default();
        for change in changes() {
            let expected = difference(&gaussian, &change.applied(&gaussian));
            let found = f64::from(gradient.error_change(&change, l21 / l22, energy));
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
