//! Training in the shape parameterizations: the backward half of [`Parameterization::to_cholesky`], the frames that
//! steps are taken in, and the bounds that keep shapes sound.

use glam::{Mat2, Mat3, Vec2, Vec3};

use crate::gaussian::{Parameterization, inverse_cholesky};

/// Smallest standard deviation that is trained, in pixels: narrower Gaussians fall between the
/// pixels, where no error is seen.
pub(crate) const MIN_DEVIATION: f32 = 0.4;

/// What a pass over the pixels says about the geometry of one Gaussian. With s = -2 dLoss/dq at a
/// pixel and d = pixel centre - centre of the Gaussian, these are sums over the pixels.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub(crate) struct GeometrySums {
    /// Sum of s d.
    pub(crate) first: [f32; 2],
    /// Sum of s d d^T: (xx, xy, yy).
    pub(crate) second: [f32; 3],
}

impl GeometrySums {
    /// The gradients of the loss by the centre and by the three values of `parameterization`.
    ///
    /// q = |z|^2 with z = M d, M the inverse of the Cholesky factor L. From dM = -M dL M follow
    /// dLoss/dcentre = M^T M (sum of s d), dLoss/dL = the lower triangle of M^T Z and
    /// dLoss/dSigma = M^T Z M / 2, where Z = M (sum of s d d^T) M^T.
    pub(crate) fn gradients(
        &self,
        parameterization: Parameterization,
        values: Vec3,
    ) -> (Vec2, Vec3) {
        let [i11, w, i22] = inverse_cholesky(parameterization.to_cholesky(values.into()));
        // glam's matrices are built from columns.
        let m = Mat2::from_cols(Vec2::new(i11, w), Vec2::new(0.0, i22));
        let [xx, xy, yy] = self.second;
        let moments = Mat2::from_cols(Vec2::new(xx, xy), Vec2::new(xy, yy));
        let center = m.transpose() * (m * Vec2::from(self.first));
        let by_factor = m.transpose() * (m * moments * m.transpose());
        let shape = match parameterization {
            Parameterization::Cholesky => {
                Vec3::new(by_factor.x_axis.x, by_factor.x_axis.y, by_factor.y_axis.y)
            }
            Parameterization::Covariance => {
                let by_covariance = by_factor * m * 0.5;
                // xy stands for both off-diagonal entries.
                Vec3::new(
                    by_covariance.x_axis.x,
                    by_covariance.x_axis.y + by_covariance.y_axis.x,
                    by_covariance.y_axis.y,
                )
            }
            Parameterization::RotationScale => {
                let by_covariance = by_factor * m * 0.5;
                let (axis1, axis2) = axes(values.z);
                // Sigma = s1^2 a1 a1^T + s2^2 a2 a2^T, and a1 turns into a2, a2 into -a1.
                let along = |a: Vec2, b: Vec2| a.dot(by_covariance * b);
                Vec3::new(
                    2.0 * values.x * along(axis1, axis1),
                    2.0 * values.y * along(axis2, axis2),
                    (values.x * values.x - values.y * values.y)
                        * (along(axis1, axis2) + along(axis2, axis1)),
                )
            }
        };
        (center, shape)
    }
}

/// The units in which a Gaussian takes steps: a step of centre or shape is the frame times a
/// vector of learning rates, and the gradient by that vector is the transposed frame times the
/// gradient.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Frame {
    pub(crate) center: Mat2,
    pub(crate) shape: Mat3,
}

impl Frame {
    /// Pixels, and the parameterization's own units.
    pub(crate) const ABSOLUTE: Self = Self { center: Mat2::IDENTITY, shape: Mat3::IDENTITY };

    /// The Gaussian's own frame: the centre moves in standard deviations, the shape changes
    /// relative to itself.
    pub(crate) fn relative(parameterization: Parameterization, values: Vec3) -> Self {
        let [l11, l21, l22] = parameterization.to_cholesky(values.into());
        let center = Mat2::from_cols(Vec2::new(l11, l21), Vec2::new(0.0, l22));
        let shape = match parameterization {
            // L becomes L (I + D) with D lower triangular, whatever L is.
            Parameterization::Cholesky => Mat3::from_cols(
                Vec3::new(l11, l21, 0.0),
                Vec3::new(0.0, l22, 0.0),
                Vec3::new(0.0, 0.0, l22),
            ),
            Parameterization::Covariance => {
                let [xx, _, yy] = values.into();
                Mat3::from_diagonal(Vec3::new(xx, (xx * yy).sqrt(), yy))
            }
            Parameterization::RotationScale => {
                // A turn changes the picture as much as the axes differ.
                let ratio = values.x / values.y;
                let turn = 1.0 / (ratio - 1.0 / ratio).abs().max(1.0);
                Mat3::from_diagonal(Vec3::new(values.x, values.y, turn))
            }
        };
        Self { center, shape }
    }
}

/// The parameterization's values for a Cholesky factor.
pub(crate) fn from_cholesky(parameterization: Parameterization, [l11, l21, l22]: [f32; 3]) -> Vec3 {
    let (xx, xy, yy) = (l11 * l11, l11 * l21, l21 * l21 + l22 * l22);
    match parameterization {
        Parameterization::Cholesky => Vec3::new(l11, l21, l22),
        Parameterization::Covariance => Vec3::new(xx, xy, yy),
        Parameterization::RotationScale => {
            let (mean, half) = ((xx + yy) * 0.5, (xx - yy) * 0.5);
            let s1 = (mean + half.hypot(xy)).sqrt();
            // The determinant gives the small axis without cancellation.
            Vec3::new(s1, l11 * l22 / s1, 0.5 * xy.atan2(half))
        }
    }
}

/// The parameterization's values for a covariance, and that plus `variance` along both axes.
pub(crate) fn widened(parameterization: Parameterization, values: Vec3, variance: f32) -> Vec3 {
    let [l11, l21, l22] = parameterization.to_cholesky(values.into());
    let xx = l11 * l11 + variance;
    let wide11 = xx.sqrt();
    let wide21 = l11 * l21 / wide11;
    let yy = l21 * l21 + l22 * l22 + variance;
    from_cholesky(parameterization, [wide11, wide21, (yy - wide21 * wide21).max(0.0).sqrt()])
}

/// The nearest values that are a covariance with standard deviations from [`MIN_DEVIATION`] to
/// `max`. Values that are not finite become a round Gaussian.
pub(crate) fn confined(parameterization: Parameterization, values: Vec3, max: f32) -> Vec3 {
    if !values.is_finite() {
        return from_cholesky(parameterization, [1.0, 0.0, 1.0]);
    }
    match parameterization {
        Parameterization::Cholesky => {
            let l11 = values.x.clamp(MIN_DEVIATION, max);
            let l21 = values.y.clamp(-max, max);
            // The product of both deviations is l11 l22, and the larger one at most the length of
            // all three.
            let least = MIN_DEVIATION * (l11.hypot(l21) / l11).max(1.0);
            Vec3::new(l11, l21, values.z.clamp(MIN_DEVIATION, max).max(least))
        }
        Parameterization::Covariance => {
            let xx = values.x.clamp(MIN_DEVIATION * MIN_DEVIATION, max * max);
            let yy = values.z.clamp(MIN_DEVIATION * MIN_DEVIATION, max * max);
            // Conditional variances stay above the least variance, and above what rounding of the
            // determinant may cost.
            let square = (xx * yy - MIN_DEVIATION * MIN_DEVIATION * xx.max(yy)).max(0.0);
            let room = square.min(xx * yy * (1.0 - 1e-5)).sqrt();
            Vec3::new(xx, values.y.clamp(-room, room), yy)
        }
        Parameterization::RotationScale => {
            // The same ellipse returns after half a turn; an exact remainder keeps far angles sound.
            let half_turn = core::f32::consts::PI;
            let rest = values.z % half_turn;
            let angle =
                if rest.abs() > 0.5 * half_turn { rest - half_turn.copysign(rest) } else { rest };
            Vec3::new(values.x.clamp(MIN_DEVIATION, max), values.y.clamp(MIN_DEVIATION, max), angle)
        }
    }
}

/// Which of the parameterization's values are quantized by their logarithm: those that are positive and span
/// decades (paper, appendix: log-uniform quantization of the variances).
pub(crate) fn logarithmic(parameterization: Parameterization) -> [bool; 3] {
    match parameterization {
        Parameterization::Covariance | Parameterization::Cholesky => [true, false, true],
        Parameterization::RotationScale => [true, true, false],
    }
}

fn axes(angle: f32) -> (Vec2, Vec2) {
    let (sin, cos) = angle.sin_cos();
    (Vec2::new(cos, sin), Vec2::new(-sin, cos))
}

#[cfg(test)]
mod tests {
    use proptest::prelude::*;

    use super::*;
    use crate::gaussian::Gaussian;
    use crate::testing::config;

    const PARAMETERIZATIONS: [Parameterization; 3] =
        [Parameterization::Covariance, Parameterization::Cholesky, Parameterization::RotationScale];

    fn covariance(parameterization: Parameterization, values: Vec3) -> [f32; 3] {
        let cholesky = parameterization.to_cholesky(values.into());
        Gaussian { center: [0.0; 2], cholesky, color: [0.0; 4] }.covariance()
    }

    proptest! {
        #![proptest_config(config(128))]

        #[test]
        fn shapes_survive_the_way_through_every_chart(
            l11 in 0.3_f32..50.0, l21 in -50.0_f32..50.0, l22 in 0.3_f32..50.0,
        ) {
            let expected = covariance(Parameterization::Cholesky, Vec3::new(l11, l21, l22));
            for parameterization in PARAMETERIZATIONS {
                let found = covariance(parameterization, from_cholesky(parameterization, [l11, l21, l22]));
                for (found, expected_value) in found.iter().zip(expected) {
                    let scale = expected[0] + expected[2];
                    prop_assert!((found - expected_value).abs() <= 1e-5 * scale, "{parameterization:?}");
                }
            }
        }

        #[test]
        fn the_filter_adds_its_variance_along_both_axes(
            l11 in 0.3_f32..50.0, l21 in -50.0_f32..50.0, l22 in 0.3_f32..50.0,
            variance in 0.0_f32..300.0,
        ) {
            let [xx, xy, yy] = covariance(Parameterization::Cholesky, Vec3::new(l11, l21, l22));
            for parameterization in PARAMETERIZATIONS {
                let values = from_cholesky(parameterization, [l11, l21, l22]);
                let found = covariance(parameterization, widened(parameterization, values, variance));
                let scale = xx + yy + variance;
                for (found, expected) in found.iter().zip([xx + variance, xy, yy + variance]) {
                    prop_assert!((found - expected).abs() <= 2e-5 * scale, "{parameterization:?}");
                }
            }
        }

        #[test]
        fn whatever_is_confined_is_drawn(values in prop::array::uniform3(any::<f32>())) {
            for parameterization in PARAMETERIZATIONS {
                let confined = confined(parameterization, Vec3::from(values), 4096.0);
                let cholesky = parameterization.to_cholesky(confined.into());
                let gaussian = Gaussian { center: [0.0; 2], cholesky, color: [0.0; 4] };
                prop_assert!(gaussian.is_drawable(), "{parameterization:?} {values:?}: {cholesky:?}");
            }
        }
    }

    #[test]
    fn confining_leaves_ordinary_shapes_alone() {
        for parameterization in PARAMETERIZATIONS {
            let values = from_cholesky(parameterization, [3.0, -1.0, 2.0]);
            assert_eq!(confined(parameterization, values, 100.0), values, "{parameterization:?}");
        }
    }
}
