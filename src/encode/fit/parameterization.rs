//! Training of the shape in each parameterization (paper, paragraph "2D Gaussian Splatting" of the
//! section "Methodology"): the gradients, a Gaussian's own frame, and the bounds that keep shapes
//! valid.

use glam::{Mat2, Mat3, Vec2, Vec3};

use crate::encode::own_frame::GeometrySums;
use crate::gaussian::{Parameterization, inverse_cholesky};

// Constants: docs/tuning.md, "Growth".
/// Smallest standard deviation that is trained, in pixels: a narrower Gaussian can lie between the
/// centres of pixels, where it has no effect and no gradient.
pub(crate) const MIN_DEVIATION: f32 = 0.4;

impl Parameterization {
    /// The gradients of the loss by the centre and by the three shape values.
    ///
    /// With M the inverse of the Cholesky factor L, q = |M d|^2. From dM = -M dL M follow
    /// dLoss/dcentre = M^T M (sum of s d), dLoss/dL = the lower triangle of M^T Z, and
    /// dLoss/dSigma = M^T Z M / 2, where Z = M (sum of s d d^T) M^T.
    #[inline]
    pub(crate) fn gradients(self, sums: &GeometrySums, values: [f32; 3]) -> ([f32; 2], [f32; 3]) {
        let [i11, w, i22] = inverse_cholesky(self.to_cholesky(values));
        // glam builds matrices from columns.
        let m = Mat2::from_cols(Vec2::new(i11, w), Vec2::new(0.0, i22));
        let [xx, xy, yy] = sums.second;
        let moments = Mat2::from_cols(Vec2::new(xx, xy), Vec2::new(xy, yy));
        let center = m.transpose() * (m * Vec2::from(sums.first));
        let by_factor = m.transpose() * (m * moments * m.transpose());
        let shape = match self {
            Self::Cholesky => [by_factor.x_axis.x, by_factor.x_axis.y, by_factor.y_axis.y],
            Self::Covariance => {
                let by_covariance = by_factor * m * 0.5;
                // xy stands for both off-diagonal entries.
                [
                    by_covariance.x_axis.x,
                    by_covariance.x_axis.y + by_covariance.y_axis.x,
                    by_covariance.y_axis.y,
                ]
            }
            Self::RotationScale => {
                let by_covariance = by_factor * m * 0.5;
                let [s1, s2, angle] = values;
                let (axis1, axis2) = axes(angle);
                // Sigma = s1^2 a1 a1^T + s2^2 a2 a2^T, da1/dangle = a2 and da2/dangle = -a1.
                let along = |a: Vec2, b: Vec2| a.dot(by_covariance * b);
                [
                    2.0 * s1 * along(axis1, axis1),
                    2.0 * s2 * along(axis2, axis2),
                    (s1 * s1 - s2 * s2) * (along(axis1, axis2) + along(axis2, axis1)),
                ]
            }
        };
        (center.to_array(), shape)
    }

    /// The shape values of a Cholesky factor.
    pub(crate) fn shape_of(self, [l11, l21, l22]: [f32; 3]) -> [f32; 3] {
        let (xx, xy, yy) = (l11 * l11, l11 * l21, l21 * l21 + l22 * l22);
        match self {
            Self::Cholesky => [l11, l21, l22],
            Self::Covariance => [xx, xy, yy],
            Self::RotationScale => {
                let (mean, half) = ((xx + yy) * 0.5, (xx - yy) * 0.5);
                let s1 = (mean + half.hypot(xy)).sqrt();
                // Computed from the determinant, the smaller deviation does not suffer cancellation.
                [s1, l11 * l22 / s1, 0.5 * xy.atan2(half)]
            }
        }
    }

    /// The shape values of a Gaussian that is larger by a factor.
    pub(crate) fn scaled(self, [a, b, c]: [f32; 3], factor: f32) -> [f32; 3] {
        match self {
            Self::Cholesky => [a * factor, b * factor, c * factor],
            Self::Covariance => [a, b, c].map(|entry| entry * (factor * factor)),
            Self::RotationScale => [a * factor, b * factor, c],
        }
    }

    /// The shape values of the covariance that `values` stand for, plus `variance` times the identity.
    pub(crate) fn widened(self, values: [f32; 3], variance: f32) -> [f32; 3] {
        let [l11, l21, l22] = self.to_cholesky(values);
        let xx = l11 * l11 + variance;
        let wide11 = xx.sqrt();
        let wide21 = l11 * l21 / wide11;
        let yy = l21 * l21 + l22 * l22 + variance;
        self.shape_of([wide11, wide21, (yy - wide21 * wide21).max(0.0).sqrt()])
    }

    /// Shape values clamped so that they are a covariance with standard deviations from about
    /// [`MIN_DEVIATION`] to about `max`. Values that are not finite become a round Gaussian.
    #[inline]
    pub(crate) fn clamped(self, values: [f32; 3], max: f32) -> [f32; 3] {
        if !values.iter().all(|value| value.is_finite()) {
            return self.shape_of([1.0, 0.0, 1.0]);
        }
        let [a, b, c] = values;
        match self {
            Self::Cholesky => {
                let l11 = a.clamp(MIN_DEVIATION, max);
                let l21 = b.clamp(-max, max);
                // The smaller deviation is l11 l22 divided by the larger one, and that is about the
                // length of (l11, l21).
                let least = MIN_DEVIATION * ((l11 * l11 + l21 * l21).sqrt() / l11).max(1.0);
                [l11, l21, c.clamp(MIN_DEVIATION, max).max(least)]
            }
            Self::Covariance => {
                let xx = a.clamp(MIN_DEVIATION * MIN_DEVIATION, max * max);
                let yy = c.clamp(MIN_DEVIATION * MIN_DEVIATION, max * max);
                // Conditional variances stay above the least variance, and so far above 0 that rounding
                // errors of the determinant do not matter.
                let square = (xx * yy - MIN_DEVIATION * MIN_DEVIATION * xx.max(yy)).max(0.0);
                let max_xy = square.min(xx * yy * (1.0 - 1e-5)).sqrt();
                [xx, b.clamp(-max_xy, max_xy), yy]
            }
            Self::RotationScale => {
                // Half a turn leaves the ellipse as it is. The remainder of a division is exact, so
                // angles of any magnitude can be reduced.
                let half_turn = core::f32::consts::PI;
                let rest = c % half_turn;
                let angle = if rest.abs() > 0.5 * half_turn {
                    rest - half_turn.copysign(rest)
                } else {
                    rest
                };
                [a.clamp(MIN_DEVIATION, max), b.clamp(MIN_DEVIATION, max), angle]
            }
        }
    }

    /// Which of the three shape values have a logarithmic quantizer: those that are positive and span
    /// decades (paper, appendix, section "More Analysis Results": log-uniform quantization).
    pub(crate) fn is_logarithmic(self) -> [bool; 3] {
        match self {
            Self::Covariance | Self::Cholesky => [true, false, true],
            Self::RotationScale => [true, true, false],
        }
    }
}

/// The derivatives of the centre and of the shape values by the directions of a Gaussian's own frame
/// (`encode/own_frame.rs`).
#[derive(Clone, Copy, Debug)]
pub(crate) struct OwnFrame {
    /// The Cholesky factor L: the derivative of the centre by its coordinates (u, v) in the frame.
    pub(crate) center: Mat2,
    /// The derivatives of the three shape values by the logarithms of size and ratio, and by the shear,
    /// in columns.
    pub(crate) shape: Mat3,
}

impl OwnFrame {
    #[inline]
    pub(crate) fn new(parameterization: Parameterization, values: [f32; 3]) -> Self {
        let [l11, l21, l22] = parameterization.to_cholesky(values);
        let values = Vec3::from(values);
        let center = Mat2::from_cols(Vec2::new(l11, l21), Vec2::new(0.0, l22));
        // The derivatives of the covariance (xx, xy, yy): L (D + D^T) L^T.
        let by_ratio = 2.0 * Vec3::new(l11 * l11, l11 * l21, l21 * l21 - l22 * l22);
        let by_shear = Vec3::new(0.0, l11 * l22, 2.0 * l21 * l22);
        let shape = match parameterization {
            Parameterization::Cholesky => {
                Mat3::from_cols(values, Vec3::new(l11, l21, -l22), Vec3::new(0.0, l22, 0.0))
            }
            Parameterization::Covariance => Mat3::from_cols(2.0 * values, by_ratio, by_shear),
            Parameterization::RotationScale => {
                let (axis1, axis2) = axes(values.z);
                let [s1, s2, _] = values.into();
                // The angle of a circle does not matter; near one it would change without bound.
                let difference = (s1 * s1 - s2 * s2).abs().max(0.1 * s1 * s2).copysign(s1 - s2);
                let changed = |change: Vec3| {
                    let change = Mat2::from_cols(
                        Vec2::new(change.x, change.y),
                        Vec2::new(change.y, change.z),
                    );
                    let along = |a: Vec2, b: Vec2| a.dot(change * b);
                    Vec3::new(
                        along(axis1, axis1) / (2.0 * s1),
                        along(axis2, axis2) / (2.0 * s2),
                        along(axis1, axis2) / difference,
                    )
                };
                Mat3::from_cols(Vec3::new(s1, s2, 0.0), changed(by_ratio), changed(by_shear))
            }
        };
        Self { center, shape }
    }

    /// A gradient by the centre and by the shape values, by their coordinates in the frame instead.
    #[inline]
    pub(crate) fn gradient(&self, center: [f32; 2], shape: [f32; 3]) -> ([f32; 2], [f32; 3]) {
        let center = self.center.transpose() * Vec2::from(center);
        let shape = self.shape.transpose() * Vec3::from(shape);
        (center.to_array(), shape.to_array())
    }
}

/// The directions of the two axes of a Gaussian whose first axis is at this angle to x.
fn axes(angle: f32) -> (Vec2, Vec2) {
    let (sin, cos) = angle.sin_cos();
    (Vec2::new(cos, sin), Vec2::new(-sin, cos))
}

#[cfg(test)]
mod tests {
    use proptest::prelude::*;

    use super::*;
    use crate::encode::testing::PARAMETERIZATIONS;
    use crate::gaussian::Gaussian;
    use crate::testing::config;

    fn covariance(parameterization: Parameterization, values: [f32; 3]) -> [f32; 3] {
        let cholesky = parameterization.to_cholesky(values);
        Gaussian { center: [0.0; 2], cholesky, color: [0.0; 4] }.covariance()
    }

    proptest! {
        #![proptest_config(config(128))]

        #[test]
        fn a_shape_is_scaled_in_every_parameterization(
            l11 in 0.3_f32..50.0, l21 in -50.0_f32..50.0, l22 in 0.3_f32..50.0,
            factor in 0.1_f32..10.0,
        ) {
            let expected = covariance(Parameterization::Cholesky, [l11, l21, l22]);
            let scale = factor * factor * (expected[0] + expected[2]);
            for parameterization in PARAMETERIZATIONS {
                let values = parameterization.shape_of([l11, l21, l22]);
                let found = covariance(parameterization, parameterization.scaled(values, factor));
                for (found, expected) in found.iter().zip(expected) {
                    let error = (found - factor * factor * expected).abs();
                    prop_assert!(error <= 1e-5 * scale, "{parameterization:?}");
                }
            }
        }

        #[test]
        fn every_parameterization_keeps_the_covariance(
            l11 in 0.3_f32..50.0, l21 in -50.0_f32..50.0, l22 in 0.3_f32..50.0,
        ) {
            let expected = covariance(Parameterization::Cholesky, [l11, l21, l22]);
            for parameterization in PARAMETERIZATIONS {
                let values = parameterization.shape_of([l11, l21, l22]);
                let found = covariance(parameterization, values);
                let scale = expected[0] + expected[2];
                for (found, expected) in found.iter().zip(expected) {
                    let error = (found - expected).abs();
                    prop_assert!(error <= 1e-5 * scale, "{parameterization:?}");
                }
            }
        }

        #[test]
        fn the_filter_adds_its_variance_along_both_axes(
            l11 in 0.3_f32..50.0, l21 in -50.0_f32..50.0, l22 in 0.3_f32..50.0,
            variance in 0.0_f32..300.0,
        ) {
            let [xx, xy, yy] = covariance(Parameterization::Cholesky, [l11, l21, l22]);
            for parameterization in PARAMETERIZATIONS {
                let values = parameterization.shape_of([l11, l21, l22]);
                let wide = parameterization.widened(values, variance);
                let found = covariance(parameterization, wide);
                let scale = xx + yy + variance;
                for (found, expected) in found.iter().zip([xx + variance, xy, yy + variance]) {
                    prop_assert!((found - expected).abs() <= 2e-5 * scale, "{parameterization:?}");
                }
            }
        }

        #[test]
        fn clamped_shapes_are_valid(values in prop::array::uniform3(any::<f32>())) {
            for parameterization in PARAMETERIZATIONS {
                let clamped = parameterization.clamped(values, 4096.0);
                let cholesky = parameterization.to_cholesky(clamped);
                let gaussian = Gaussian { center: [0.0; 2], cholesky, color: [0.0; 4] };
                prop_assert!(
                    gaussian.is_drawable(),
                    "{parameterization:?} {values:?}: {cholesky:?}"
                );
            }
        }
    }

    /// In its own frame, a Gaussian changes as a step says: L becomes L (I + D).
    #[test]
    fn the_own_frame_has_the_derivatives_of_the_shape() {
        const STEP: f32 = 1e-3;
        let (l11, l21, l22) = (3.0, -1.0, 2.0);
        for parameterization in PARAMETERIZATIONS {
            let values = parameterization.shape_of([l11, l21, l22]);
            let frame = OwnFrame::new(parameterization, values);
            assert!(
                frame
                    .center
                    .abs_diff_eq(Mat2::from_cols(Vec2::new(l11, l21), Vec2::new(0.0, l22)), 1e-5)
            );
            // Size, ratio and shear.
            for (column, [d11, d21, d22]) in
                [[1.0, 0.0, 1.0], [1.0, 0.0, -1.0], [0.0, 1.0, 0.0]].into_iter().enumerate()
            {
                let at = |step: f32| {
                    let (d11, d21, d22) = (step * d11, step * d21, step * d22);
                    let changed =
                        [l11 * (1.0 + d11), l21 * (1.0 + d11) + l22 * d21, l22 * (1.0 + d22)];
                    Vec3::from(parameterization.shape_of(changed))
                };
                let expected = (at(STEP) - at(-STEP)) / (2.0 * STEP);
                let found = frame.shape.col(column);
                assert!(
                    found.abs_diff_eq(expected, 2e-2),
                    "{parameterization:?} {column}: {found}, {expected}"
                );
            }
        }
    }

    #[test]
    fn clamping_keeps_ordinary_shapes() {
        for parameterization in PARAMETERIZATIONS {
            let values = parameterization.shape_of([3.0, -1.0, 2.0]);
            assert_eq!(parameterization.clamped(values, 100.0), values, "{parameterization:?}");
        }
    }
}
