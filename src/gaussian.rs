//! One Gaussian, and the parameterizations in which its shape is stored (spec, section 8).

use crate::math;

/// Most components that a Gaussian is stored with: two of position, three of shape, four of
/// colour.
pub(crate) const MAX_COMPONENTS: usize = 9;
/// Smallest diagonal entry of a Cholesky factor that is drawn, in pixels.
pub(crate) const MIN_DIAGONAL: f32 = 1.0 / 4096.0;
/// Largest magnitude of a coordinate and of an entry of a Cholesky factor that is drawn, in
/// pixels.
pub(crate) const MAX_EXTENT: f32 = 16_777_216.0;
/// Largest magnitude of a colour that is drawn.
pub(crate) const MAX_COLOR: f32 = 65_536.0;

/// One Gaussian of a picture: `color * kernel(q)` is added at every point, where q is the squared
/// Mahalanobis distance from `center` (paper, equations 1 and 2).
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Gaussian {
    /// Centre (x, y) in pixels of the stored size: x to the right, y down, the centre of the
    /// first pixel at (0.5, 0.5).
    pub center: [f32; 2],
    /// The Cholesky factor (l11, l21, l22) of the covariance, in pixels: the covariance is
    /// L L^T with L lower triangular, so it is positive definite whenever l11, l22 > 0.
    pub cholesky: [f32; 3],
    /// Amplitude per channel, 1.0 being a full sample; may be negative. Channels that the colour
    /// model lacks are 0.
    pub color: [f32; 4],
}

impl Gaussian {
    /// One that adds nothing.
    pub(crate) const NOTHING: Self =
        Self { center: [0.0; 2], cholesky: [1.0, 0.0, 1.0], color: [0.0; 4] };

    /// The covariance (xx, xy, yy) in square pixels.
    #[must_use]
    pub fn covariance(&self) -> [f32; 3] {
        let [l11, l21, l22] = self.cholesky;
        [l11 * l11, l11 * l21, l21 * l21 + l22 * l22]
    }

    /// The conic (xx, xy, yy), the inverse of the covariance:
    /// q = xx dx^2 + 2 xy dx dy + yy dy^2. Not finite for a degenerate Gaussian.
    #[must_use]
    pub fn conic(&self) -> [f32; 3] {
        let [i11, w, i22] = inverse_cholesky(self.cholesky);
        [i11 * i11 + w * w, w * i22, i22 * i22]
    }

    /// How much the Gaussian adds to the picture by itself: squared samples summed up over the
    /// pixels, but for a constant of the kernel.
    #[cfg(feature = "encode")]
    pub(crate) fn importance(&self) -> f32 {
        let [l11, _, l22] = self.cholesky;
        self.color.iter().map(|color| color * color).sum::<f32>() * l11 * l22
    }

    /// Whether the renderer draws this Gaussian: all values within the format's bounds and the
    /// covariance positive definite (spec, section 8.5).
    #[must_use]
    pub fn is_drawable(&self) -> bool {
        let [l11, l21, l22] = self.cholesky;
        // Comparisons that NaN fails.
        self.center.iter().all(|c| c.abs() <= MAX_EXTENT)
            && (MIN_DIAGONAL..=MAX_EXTENT).contains(&l11)
            && (MIN_DIAGONAL..=MAX_EXTENT).contains(&l22)
            && l21.abs() <= MAX_EXTENT
            && self.color.iter().all(|c| c.abs() <= MAX_COLOR)
    }

    /// A Gaussian from its stored components, in file order.
    pub(crate) fn from_components(values: &[f32], parameterization: Parameterization) -> Self {
        let mut color = [0.0; 4];
        color[..values.len() - 5].copy_from_slice(&values[5..]);
        Self {
            center: [values[0], values[1]],
            cholesky: parameterization.to_cholesky([values[2], values[3], values[4]]),
            color,
        }
    }
}

/// The inverse (i11, w, i22) of a Cholesky factor: q = (i11 dx)^2 + (w dx + i22 dy)^2.
pub(crate) fn inverse_cholesky([l11, l21, l22]: [f32; 3]) -> [f32; 3] {
    let (i11, i22) = (1.0 / l11, 1.0 / l22);
    [i11, -(l21 * i11) * i22, i22]
}

/// What the three shape components of a stored Gaussian mean (paper, section "2D Gaussian
/// Splatting": the three parameterizations).
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash)]
#[non_exhaustive]
pub enum Parameterization {
    /// The covariance itself: (xx, xy, yy) in square pixels. The paper's own choice. Not every
    /// triple is a covariance; those that are not are not drawn.
    Covariance,
    /// The Cholesky factor of the covariance: (l11, l21, l22) in pixels.
    Cholesky,
    /// Standard deviations along the two axes in pixels, and the angle of the first axis against
    /// x in radians, towards y: (s1, s2, angle).
    RotationScale,
}

impl Parameterization {
    /// The code that the header stores.
    #[cfg(feature = "encode")]
    pub(crate) const fn code(self) -> u8 {
        match self {
            Self::Covariance => 0,
            Self::Cholesky => 1,
            Self::RotationScale => 2,
        }
    }

    /// The parameterization that a header's code names.
    pub(crate) const fn from_code(code: u8) -> Option<Self> {
        match code {
            0 => Some(Self::Covariance),
            1 => Some(Self::Cholesky),
            2 => Some(Self::RotationScale),
            _ => None,
        }
    }

    /// The Cholesky factor that stored values stand for; entries that are not finite or not
    /// positive where the values are no covariance.
    pub(crate) fn to_cholesky(self, [a, b, c]: [f32; 3]) -> [f32; 3] {
        match self {
            Self::Covariance => {
                // Of a negative number the root is NaN, which is never drawn.
                let l11 = math::sqrt(a);
                let l21 = b / l11;
                [l11, l21, math::sqrt(c - l21 * l21)]
            }
            Self::Cholesky => [a, b, c],
            Self::RotationScale => {
                if c.is_nan() || c.abs() > 1024.0 {
                    return [f32::NAN; 3];
                }
                let (sin, cos) = math::sin_cos(c);
                let (a2, b2) = (a * a, b * b);
                let l11 = math::sqrt((cos * cos) * a2 + (sin * sin) * b2);
                [l11, (cos * sin) * (a2 - b2) / l11, a * b / l11]
            }
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::testing::config;
    use proptest::prelude::*;

    /// The covariance that a parameterization's values stand for, in f64.
    fn covariance(parameterization: Parameterization, values: [f32; 3]) -> [f64; 3] {
        let [a, b, c] = values.map(f64::from);
        match parameterization {
            Parameterization::Covariance => [a, b, c],
            Parameterization::Cholesky => [a * a, a * b, b * b + c * c],
            Parameterization::RotationScale => {
                let (sin, cos) = c.sin_cos();
                let (a, b) = (a * a, b * b);
                [cos * cos * a + sin * sin * b, cos * sin * (a - b), sin * sin * a + cos * cos * b]
            }
        }
    }

    proptest! {
        #![proptest_config(config(200))]

        #[test]
        fn every_chart_yields_its_covariance(
            s1 in 0.01_f32..1000.0, s2 in 0.01_f32..1000.0, angle in -7.0_f32..7.0,
        ) {
            // Comparable axes keep the direct covariance well conditioned in f32.
            let s2 = s2.clamp(s1 / 30.0, s1 * 30.0);
            let [xx, xy, yy] = covariance(Parameterization::RotationScale, [s1, s2, angle]);
            let l11 = xx.sqrt();
            let cholesky = [l11, xy / l11, f64::from(s1) * f64::from(s2) / l11];
            for (parameterization, values) in [
                (Parameterization::Covariance, [xx, xy, yy].map(|v| v as f32)),
                (Parameterization::Cholesky, cholesky.map(|v| v as f32)),
                (Parameterization::RotationScale, [s1, s2, angle]),
            ] {
                let gaussian = Gaussian {
                    center: [0.0; 2],
                    cholesky: parameterization.to_cholesky(values),
                    color: [0.0; 4],
                };
                prop_assert!(gaussian.is_drawable());
                let size = xx + yy;
                let found = gaussian.covariance();
                for (found, expected) in found.into_iter().zip([xx, xy, yy]) {
                    let error = (f64::from(found) - expected).abs();
                    prop_assert!(error <= 4e-6 * size, "{parameterization:?}: {found} against {expected}");
                }
            }
        }

        #[test]
        fn the_conic_inverts_the_covariance(
            l11 in 0.1_f32..100.0, l21 in -50.0_f32..50.0, l22 in 0.1_f32..100.0,
        ) {
            let gaussian =
                Gaussian { center: [0.0; 2], cholesky: [l11, l21, l22], color: [0.0; 4] };
            let [a, b, c] = gaussian.covariance().map(f64::from);
            let [i, j, k] = gaussian.conic().map(f64::from);
            let scale = (a + c) * (i + k) * 1e-6;
            prop_assert!((a * i + b * j - 1.0).abs() < scale);
            prop_assert!((a * j + b * k).abs() < scale);
            prop_assert!((b * j + c * k - 1.0).abs() < scale);
        }
    }

    #[test]
    fn what_is_no_covariance_is_not_drawn() {
        for values in
            [[-1.0, 0.0, 1.0], [1.0, 0.0, -1.0], [1.0, 1.0, 1.0], [0.0; 3], [1.0, 2.0, 1.0]]
        {
            let cholesky = Parameterization::Covariance.to_cholesky(values);
            let gaussian = Gaussian { center: [0.0; 2], cholesky, color: [0.0; 4] };
            assert!(!gaussian.is_drawable(), "{values:?} gives {cholesky:?}");
        }
        for values in [[0.0, 1.0, 0.0], [1.0, 1.0, f32::NAN], [1.0, 1.0, 1e9], [-1.0, 1.0, 0.0]] {
            let cholesky = Parameterization::RotationScale.to_cholesky(values);
            let gaussian = Gaussian { center: [0.0; 2], cholesky, color: [0.0; 4] };
            assert!(!gaussian.is_drawable(), "{values:?} gives {cholesky:?}");
        }
    }
}
