//! One Gaussian, and the parameterizations in which its shape is stored (spec, section 8).

use core::ops::Range;

use crate::math;

/// The components of a stored Gaussian that are its centre, and those that are its shape. The others
/// are its colour (spec, section 8.1).
pub(crate) const CENTER: Range<usize> = 0..2;
pub(crate) const SHAPE: Range<usize> = CENTER.end..5;
/// Most components of a stored Gaussian: those of one with four channels.
pub(crate) const MAX_COMPONENTS: usize = component_count(4);
/// Smallest diagonal entry of the Cholesky factor of a Gaussian that is drawn, in pixels.
pub(crate) const MIN_DIAGONAL: f32 = 1.0 / 4096.0;
/// Largest magnitude of a coordinate, and of an entry of the Cholesky factor, of a Gaussian that is
/// drawn, in pixels.
pub(crate) const MAX_EXTENT: f32 = 16_777_216.0;
/// Most Gaussians of a file that is written: as many as a decoder accepts by default.
#[cfg(feature = "encode")]
pub(crate) const MAX_GAUSSIANS: u32 = 1 << 22;
/// Largest magnitude of an amplitude of a Gaussian that is drawn.
pub(crate) const MAX_COLOR: f32 = 65_536.0;

/// One Gaussian of a picture. It adds `color * weight(q)` at every point, where q is the point's
/// squared Mahalanobis distance from `center`, and `weight` the picture's [`Kernel`](crate::Kernel)
/// (spec, sections 8 and 9; paper, equations 1 and 2).
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Gaussian {
    /// Centre (x, y) in pixels of the stored size: x to the right, y down. The centre of the first
    /// pixel is (0.5, 0.5).
    pub center: [f32; 2],
    /// The Cholesky factor (l11, l21, l22) of the covariance, in pixels of the stored size. The
    /// covariance is L L^T, where L is lower triangular; it is positive definite if l11 and l22 are
    /// positive.
    pub cholesky: [f32; 3],
    /// Amplitude in each channel of the colour model, where 1.0 is a full sample; may be negative.
    /// 0 in channels that the colour model lacks.
    pub color: [f32; 4],
}

impl Gaussian {
    /// A Gaussian that adds nothing.
    pub(crate) const NOTHING: Self =
        Self { center: [0.0; 2], cholesky: [1.0, 0.0, 1.0], color: [0.0; 4] };

    /// The covariance (xx, xy, yy) in square pixels.
    #[must_use]
    pub fn covariance(&self) -> [f32; 3] {
        let [l11, l21, l22] = self.cholesky;
        [l11 * l11, l11 * l21, l21 * l21 + l22 * l22]
    }

    /// The conic (xx, xy, yy), which is the inverse of the covariance, in 1 per square pixel:
    /// q = xx dx^2 + 2 xy dx dy + yy dy^2. It is not finite if l11 or l22 is 0.
    #[must_use]
    pub fn conic(&self) -> [f32; 3] {
        let [i11, w, i22] = inverse_cholesky(self.cholesky);
        [i11 * i11 + w * w, w * i22, i22 * i22]
    }

    /// The energy of the Gaussian: what it adds, squared and summed up over pixels and channels, up
    /// to a constant factor of the kernel.
    #[cfg(feature = "encode")]
    pub(crate) fn energy(&self) -> f32 {
        let [l11, _, l22] = self.cholesky;
        self.color.iter().map(|color| color * color).sum::<f32>() * l11 * l22
    }

    /// Whether the Gaussian is drawn: its covariance is positive definite, and all values are
    /// within the bounds of the format (spec, section 8.5).
    #[must_use]
    pub fn is_drawable(&self) -> bool {
        let [l11, l21, l22] = self.cholesky;
        // NaN fails every comparison.
        self.center.iter().all(|c| c.abs() <= MAX_EXTENT)
            && (MIN_DIAGONAL..=MAX_EXTENT).contains(&l11)
            && (MIN_DIAGONAL..=MAX_EXTENT).contains(&l22)
            && l21.abs() <= MAX_EXTENT
            && self.color.iter().all(|c| c.abs() <= MAX_COLOR)
    }

    /// The rule that a Gaussian which is not drawn breaks.
    pub(crate) fn flaw(&self) -> Option<&'static str> {
        let [l11, l21, l22] = self.cholesky;
        let is_diagonal = |entry: &f32| (MIN_DIAGONAL..=MAX_EXTENT).contains(entry);
        let rules = [
            (
                self.center.iter().all(|c| c.abs() <= MAX_EXTENT),
                "its centre must be within +-2^24 pixels",
            ),
            (
                [l11, l22].iter().all(is_diagonal),
                "l11 and l22 of its Cholesky factor must be 2^-12 to 2^24 pixels",
            ),
            (l21.abs() <= MAX_EXTENT, "l21 of its Cholesky factor must be within +-2^24 pixels"),
            (self.color.iter().all(|c| c.abs() <= MAX_COLOR), "its colour must be within +-2^16"),
        ];
        rules.into_iter().find(|(holds, _)| !holds).map(|(_, rule)| rule)
    }

    /// A Gaussian from its components in the order of the file (spec, section 8.1).
    #[inline]
    pub(crate) fn from_components(values: &[f32], parameterization: Parameterization) -> Self {
        let mut color = [0.0; 4];
        let (&[x, y, a, b, c], channels) =
            values.split_first_chunk().expect("all have a centre and a shape");
        color[..channels.len()].copy_from_slice(channels);
        Self { center: [x, y], cholesky: parameterization.to_cholesky([a, b, c]), color }
    }
}

/// How many components a stored Gaussian has with so many channels.
pub(crate) const fn component_count(channels: usize) -> usize {
    SHAPE.end + channels
}

/// The inverse (i11, w, i22) of a Cholesky factor, with which q = (i11 dx)^2 + (w dx + i22 dy)^2.
pub(crate) fn inverse_cholesky([l11, l21, l22]: [f32; 3]) -> [f32; 3] {
    let (i11, i22) = (1.0 / l11, 1.0 / l22);
    [i11, -(l21 * i11) * i22, i22]
}

/// What the three components of a stored shape mean: the three parameterizations of the paper's
/// section "2D Gaussian Splatting" (spec, sections 8.2 to 8.4).
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash)]
#[non_exhaustive]
pub enum Parameterization {
    /// The covariance itself: (xx, xy, yy) in square pixels, as the paper has it. Not every triple
    /// is a covariance; a Gaussian with one that is not is not drawn.
    Covariance,
    /// The Cholesky factor of the covariance: (l11, l21, l22) in pixels.
    Cholesky,
    /// (s1, s2, angle): the standard deviations in pixels along two perpendicular axes, and the
    /// angle in radians from x to the first axis, towards y.
    RotationScale,
}

impl Parameterization {
    /// The code in the header.
    #[cfg(feature = "encode")]
    pub(crate) const fn code(self) -> u8 {
        match self {
            Self::Covariance => 0,
            Self::Cholesky => 1,
            Self::RotationScale => 2,
        }
    }

    /// The parameterization with this code in the header.
    pub(crate) const fn from_code(code: u8) -> Option<Self> {
        match code {
            0 => Some(Self::Covariance),
            1 => Some(Self::Cholesky),
            2 => Some(Self::RotationScale),
            _ => None,
        }
    }

    /// The Cholesky factor (l11, l21, l22) of a stored shape. If that is not a covariance, an entry
    /// is not finite or not positive, so that the Gaussian is not drawn.
    #[inline]
    pub(crate) fn to_cholesky(self, [a, b, c]: [f32; 3]) -> [f32; 3] {
        match self {
            Self::Covariance => {
                // The root of a negative number is NaN.
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

    /// The covariance of a stored shape, in f64.
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
        fn every_parameterization_gives_its_covariance(
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
    fn what_is_not_drawn_has_a_flaw() {
        let good = Gaussian { center: [3.0, -9.0], cholesky: [2.0, -1.0, 0.5], color: [0.5; 4] };
        assert!(good.is_drawable() && good.flaw().is_none());
        for bad in [f32::NAN, f32::INFINITY, 1e9] {
            let flawed = [
                Gaussian { center: [bad, 0.0], ..good },
                Gaussian { cholesky: [bad, 0.0, 1.0], ..good },
                Gaussian { cholesky: [1.0, bad, 1.0], ..good },
                Gaussian { cholesky: [1.0, 0.0, -1.0], ..good },
                Gaussian { color: [0.0, 0.0, 0.0, bad], ..good },
            ];
            for flawed in flawed {
                assert!(!flawed.is_drawable() && flawed.flaw().is_some(), "{flawed:?}");
            }
        }
    }

    #[test]
    fn a_shape_that_is_not_a_covariance_is_not_drawn() {
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
