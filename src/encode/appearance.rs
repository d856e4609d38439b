//! What code values look like where they are far from those of sRGB, on whose scale errors are judged: those of PQ, and
//! linear light.
//!
//! Quality, perceptual weights and smooth areas are all measured on samples of sRGB, so samples of PQ are shown by a
//! curve as a display of standard range shows them: the luminance relative to reference white, compressed by Reinhard's
//! curve, which compresses what is bright and keeps the contrast of what is dark, and encoded as sRGB. The curve is of
//! each channel by itself, and rises up to the largest code, so no error is out of sight.
//!
//! HLG needs none: BT.2100 made it such that a display of standard range shows it as it is. With the same compression,
//! the light of its display at 1000 cd/m² is within 0.05 of the code (a test below). Other transfer functions are near
//! that of sRGB, and primaries count as those of sRGB.

use std::sync::LazyLock;

use crate::container::Metadata;

/// Codes of transfer characteristics (Rec. ITU-T H.273, table 3).
const LINEAR: u8 = 8;
const PQ: u8 = 16;
/// Luminance in cd/m² of the largest code of PQ (BT.2100), and of reference white (BT.2408).
const PEAK: f64 = 10_000.0;
const REFERENCE_WHITE: f64 = 203.0;
/// PQ's constants: m1, m2, c1, c2 and c3 (BT.2100, table 4).
const M1: f64 = 2610.0 / 16_384.0;
const M2: f64 = 2523.0 / 4096.0 * 128.0;
const C1: f64 = 3424.0 / 4096.0;
const C2: f64 = 2413.0 / 4096.0 * 32.0;
const C3: f64 = 2392.0 / 4096.0 * 32.0;
/// Pieces of a curve, which are straight.
const PIECES: usize = 4096;

static OF_PQ: LazyLock<Curve> = LazyLock::new(|| {
    let most = PEAK / REFERENCE_WHITE;
    // Where the curve is flatter, an error counts as much as one of a code of sRGB: a display of high range shows it, and
    // PQ is about uniform there.
    Curve::new(1.0, |code| srgb(compressed(pq_luminance(code) / REFERENCE_WHITE, most)))
});
static OF_LINEAR: LazyLock<Curve> = LazyLock::new(|| Curve::new(0.0, srgb));

/// A sample of sRGB for each code, both from 0 to 1.
#[derive(Debug)]
pub(crate) struct Curve {
    ends: Vec<f32>,
    /// The least slope that counts.
    least_slope: f32,
}

impl Curve {
    /// The curve of a picture with such metadata; `None` if its samples are about as they look.
    pub(crate) fn of(metadata: &Metadata) -> Option<&'static Self> {
        match metadata.cicp?.transfer {
            PQ => Some(&OF_PQ),
            LINEAR => Some(&OF_LINEAR),
            _ => None,
        }
    }

    fn new(least_slope: f32, function: impl Fn(f64) -> f64) -> Self {
        let end = |index| function(index as f64 / PIECES as f64) as f32;
        Self { ends: (0..=PIECES).map(end).collect(), least_slope }
    }

    /// The piece that a code is in, and where, as a share.
    #[inline(always)]
    fn place(code: f32) -> (usize, f32) {
        let at = code * PIECES as f32;
        // The cast saturates.
        let piece = (at as usize).min(PIECES - 1);
        (piece, at - piece as f32)
    }

    /// What a code looks like.
    #[inline(always)]
    pub(crate) fn at(&self, code: f32) -> f32 {
        let (piece, share) = Self::place(code);
        self.ends[piece] + (self.ends[piece + 1] - self.ends[piece]) * share
    }

    /// The curve of PQ.
    #[cfg(test)]
    pub(crate) fn of_pq() -> &'static Self {
        &OF_PQ
    }

    /// The code that looks like this.
    #[cfg(test)]
    pub(crate) fn code(&self, look: f32) -> f32 {
        let (mut least, mut most) = (0.0, 1.0);
        for _ in 0..30 {
            let middle = 0.5 * (least + most);
            if self.at(middle) < look { least = middle } else { most = middle }
        }
        0.5 * (least + most)
    }

    /// How much more the error of a code counts than that of a sample of sRGB.
    pub(crate) fn slope(&self, code: f32) -> f32 {
        let (piece, _) = Self::place(code);
        ((self.ends[piece + 1] - self.ends[piece]) * PIECES as f32).max(self.least_slope)
    }
}

/// The luminance in cd/m² of a code of PQ.
fn pq_luminance(code: f64) -> f64 {
    let root = code.powf(1.0 / M2);
    PEAK * ((root - C1).max(0.0) / (C2 - C3 * root)).powf(1.0 / M1)
}

/// Light relative to reference white, compressed such that the most light becomes 1 (Reinhard et al., Photographic
/// tone reproduction for digital images, 2002).
fn compressed(light: f64, most: f64) -> f64 {
    light * (1.0 + light / (most * most)) / (1.0 + light)
}

/// The sample of sRGB that stands for linear light.
fn srgb(light: f64) -> f64 {
    if light <= 0.003_130_8 { 12.92 * light } else { 1.055 * light.powf(1.0 / 2.4) - 0.055 }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::container::Cicp;

    #[test]
    fn luminance_is_that_of_pq() {
        // Codes of 10 bits in full range, as BT.2408 has them in percent: 58 % and 75 %.
        for (code, luminance) in [(0.0, 0.0), (0.580_689, 203.0), (0.751_827, 1000.0), (1.0, PEAK)]
        {
            let found = pq_luminance(code);
            assert!((found - luminance).abs() < 0.001 * PEAK.min(luminance + 0.1), "{found}");
        }
    }

    #[test]
    fn curves_rise_over_all_codes() {
        let curve = |transfer| {
            let cicp = Some(Cicp::new(9, transfer));
            Curve::of(&Metadata { cicp, ..Metadata::default() })
        };
        for transfer in [LINEAR, PQ] {
            let curve = curve(transfer).expect("one of its own");
            assert!(curve.ends.is_sorted_by(|a, b| a < b));
            assert_eq!([curve.at(0.0), curve.at(1.0)], [0.0, 1.0]);
            let code = 0.3 + 0.5 / PIECES as f32;
            let rise = (curve.at(code + 1e-4) - curve.at(code - 1e-4)) / 2e-4;
            assert!((rise - curve.slope(code)).abs() < 0.02, "{rise}");
        }
        for transfer in [1, 2, 13, 14, 18, 255] {
            assert!(curve(transfer).is_none(), "{transfer}");
        }
        assert!(Curve::of(&Metadata::default()).is_none());
    }

    #[test]
    fn hlg_looks_as_its_codes_are() {
        // BT.2100, table 5: the inverse OETF, then the OOTF of a display of 1000 cd/m², with a gamma of 1.2.
        let light = |code: f64| {
            let (a, b, c) = (0.178_832_77, 0.284_668_92, 0.559_910_73);
            let scene = match code {
                0.5.. => (((code - c) / a).exp() + b) / 12.0,
                _ => code * code / 3.0,
            };
            1000.0 / REFERENCE_WHITE * scene.powf(1.2)
        };
        for percent in 0..=100 {
            let code = f64::from(percent) / 100.0;
            let shown = srgb(compressed(light(code), 1000.0 / REFERENCE_WHITE));
            assert!((shown - code).abs() < 0.05, "{code}: {shown}");
        }
    }
}
