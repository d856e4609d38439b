//! From samples to linear light, and to the responses of the eye's cones.

#![expect(clippy::needless_range_loop, reason = "loops over indices are vectorized")]

use fearless_simd::{Simd, f32x16, i32x16, prelude::*};

use crate::color::{ColorModel, SampleDepth};
use crate::encode::appearance::Curve;
use crate::encode::rows::Lanes;
use crate::encode::source::{SPAN, Source};
use crate::region::Region;

/// Pixels of a row in a block.
pub(super) const COLUMNS: usize = SPAN;
/// The transfer function of sRGB above its linear part, as a polynomial from the constant term on:
/// responses are within 4e-6.
const TRANSFER: [f32; 8] = [
    0.000_853_155_2,
    0.035_317_65,
    0.485_987_45,
    0.851_088_9,
    -0.795_362,
    0.741_209_15,
    -0.424_272_9,
    0.105_189_63,
];
/// The bias of the cube root that models the response of the eye's cones (JPEG XL, annex L.2).
const BIAS: f32 = 0.003_793_073;
/// Its cube root.
const BIAS_ROOT: f32 = 0.155_954_2;
/// The shares of linear light that the long, medium and short cones take in.
const LONG: [f32; 3] = [0.3, 0.622, 0.078];
const MEDIUM: [f32; 3] = [0.23, 0.692, 0.078];
const SHORT: [f32; 3] = [0.243_423, 0.204_767, 0.551_81];

/// A channel of what the eye takes in, XYB, scaled and shifted as SSIMULACRA2 does.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum Channel {
    /// Red against green, X.
    Opponent,
    /// Y.
    Luma,
    /// Blue minus luma, B.
    Blue,
}

/// A row of a block, where a full sample is 1.
pub(super) type BlockRow = [Lanes; COLUMNS / 16];

/// A picture, or some rows of one.
pub(super) trait Samples: Sync {
    fn model(&self) -> ColorModel;

    /// Copies the samples from a column and row on to the channels of a block's row; what is beyond the
    /// last column stays.
    fn read(&self, x: usize, y: usize, channels: &mut [[f32; COLUMNS]; 4]);
}

/// A strip of a rendering, which is seen as a decoder shows it: clamped and rounded.
pub(super) struct Strip<'a> {
    pub(super) model: ColorModel,
    pub(super) depth: SampleDepth,
    pub(super) region: Region,
    /// Plane after plane.
    pub(super) planes: &'a [f32],
    /// What samples look like, if they are not about those of sRGB.
    pub(super) curve: Option<&'static Curve>,
}

impl Samples for Strip<'_> {
    fn model(&self) -> ColorModel {
        self.model
    }

    #[inline(always)]
    fn read(&self, x: usize, y: usize, channels: &mut [[f32; COLUMNS]; 4]) {
        let (width, pixels) = (self.region.width as usize, self.region.pixels() as usize);
        let count = COLUMNS.min(width - x);
        let at = (y - self.region.y as usize) * width + x;
        let full_scale = f32::from(self.depth.max_sample());
        let scale = 1.0 / full_scale;
        for (channel, plane) in channels.iter_mut().zip(self.planes.chunks_exact(pixels)) {
            channel[..count].copy_from_slice(&plane[at..][..count]);
            for x in 0..COLUMNS {
                channel[x] = (channel[x].clamp(0.0, 1.0) * full_scale + 0.5).floor() * scale;
            }
        }
        see(self.curve, self.model, count, channels);
    }
}

impl Samples for Source<'_> {
    fn model(&self) -> ColorModel {
        self.color()
    }

    #[inline(always)]
    fn read(&self, x: usize, y: usize, channels: &mut [[f32; COLUMNS]; 4]) {
        let count = Source::read(self, x, y, channels);
        let scale = 1.0 / f32::from(self.depth().max_sample());
        for channel in &mut channels[..self.color().channels()] {
            for x in 0..COLUMNS {
                channel[x] *= scale;
            }
        }
        see(self.curve(), self.color(), count, channels);
    }
}

/// Replaces the colours of so many pixels by what they look like.
#[inline(always)]
fn see(curve: Option<&Curve>, model: ColorModel, count: usize, channels: &mut [[f32; COLUMNS]; 4]) {
    let Some(curve) = curve else { return };
    let colors = model.channels() - usize::from(model.has_alpha());
    for channel in &mut channels[..colors] {
        for value in &mut channel[..count] {
            *value = curve.at(*value);
        }
    }
}

/// The linear light of a row of a block from its samples, over a background.
#[inline(always)]
pub(super) fn linear_row<S: Simd>(
    simd: S,
    model: ColorModel,
    channels: &[[f32; COLUMNS]; 4],
    background: f32,
    light: [&mut BlockRow; 3],
) {
    let alpha = if model.has_alpha() { Some(model.channels() - 1) } else { None };
    let colors = if model.channels() < 3 { 1 } else { 3 };
    let [red, green, blue] = light;
    for at in 0..COLUMNS / 16 {
        let mut values = [f32x16::splat(simd, 0.0); 4];
        for channel in 0..model.channels() {
            values[channel] = f32x16::load_array_ref(simd, &channels[channel].as_chunks().0[at]);
        }
        if let Some(alpha) = alpha {
            let opacity = values[alpha];
            let background = opacity * -background + background;
            for channel in 0..colors {
                values[channel] = values[channel] * opacity + background;
            }
        }
        let first = linear(simd, values[0]);
        first.store_array(&mut red[at]);
        if colors == 1 {
            first.store_array(&mut green[at]);
            first.store_array(&mut blue[at]);
        } else {
            linear(simd, values[1]).store_array(&mut green[at]);
            linear(simd, values[2]).store_array(&mut blue[at]);
        }
    }
}

/// The linear light of encoded samples.
#[inline(always)]
fn linear<S: Simd>(simd: S, encoded: f32x16<S>) -> f32x16<S> {
    let mut light = f32x16::splat(simd, TRANSFER[TRANSFER.len() - 1]);
    for power in (0..TRANSFER.len() - 1).rev() {
        light = light * encoded + TRANSFER[power];
    }
    encoded.simd_le(0.04045).select(encoded * (1.0 / 12.92), light)
}

/// The linear light of an encoded sample, directly from the definition of sRGB.
#[cfg(test)]
pub(super) fn plain_linear(encoded: f64) -> f64 {
    if encoded <= 0.04045 { encoded / 12.92 } else { ((encoded + 0.055) / 1.055).powf(2.4) }
}

/// The responses to linear light in the order of [`Channel`]; that of blue only if it is wanted.
#[inline(always)]
pub(super) fn responses<S: Simd>(
    simd: S,
    light: [f32x16<S>; 3],
    with_blue: bool,
) -> [f32x16<S>; 3] {
    let (long, medium) = (response(simd, LONG, light), response(simd, MEDIUM, light));
    let opponent = (long - medium) * 7.0 + 0.42;
    let luma = (long + medium) * 0.5;
    let blue = if with_blue { response(simd, SHORT, light) - luma + 0.55 } else { luma };
    [opponent, luma + (0.01 - BIAS_ROOT), blue]
}

#[inline(always)]
fn response<S: Simd>(simd: S, shares: [f32; 3], [red, green, blue]: [f32x16<S>; 3]) -> f32x16<S> {
    let light = red * shares[0] + green * shares[1] + (blue * shares[2] + BIAS);
    cube_root(simd, light)
}

/// The cube root of normal positive numbers, within a few units in the last place.
#[inline(always)]
fn cube_root<S: Simd>(simd: S, x: f32x16<S>) -> f32x16<S> {
    // The exponent by -1/3: the reciprocal of the cube root, within 3.4 %.
    let bits = f32x16::float_from(x.bitcast::<i32x16<S>>());
    let bits: i32x16<S> = (bits * (-1.0 / 3.0) + 1_419_900_676.0).to_int();
    let mut root = bits.bitcast::<f32x16<S>>();
    // With d = 1 - x root^3, the reciprocal is root (1 - d)^(-1/3).
    for _ in 0..2 {
        let d = f32x16::splat(simd, 1.0) - x * (root * root * root);
        root *= d * (d * (2.0 / 9.0) + 1.0 / 3.0) + 1.0;
    }
    x * root * root
}

#[cfg(test)]
mod tests {
    use fearless_simd::{Level, dispatch};

    use super::*;
    use crate::testing::simd_levels;

    /// Applies a function to many numbers from 0 to 1 at every SIMD level, which must not matter.
    fn applied(function: impl Fn(f32) -> f64, found: impl Fn(Level, Lanes) -> Lanes, most: f64) {
        for first in (0..65_536).step_by(16) {
            let values: Lanes = core::array::from_fn(|lane| (first + lane) as f32 / 65_535.0);
            let results = simd_levels().into_iter().map(|(_, level)| found(level, values));
            let results: Vec<Lanes> = results.collect();
            for result in &results {
                assert_eq!(result, &results[0], "the SIMD level matters");
            }
            for (value, found) in values.into_iter().zip(results[0]) {
                let expected = function(value);
                let error = (f64::from(found) - expected).abs();
                assert!(error <= most, "{value}: {found}, {expected}");
            }
        }
    }

    #[test]
    fn light_is_that_of_srgb() {
        let expected = |encoded: f32| plain_linear(f64::from(encoded));
        let found = |level, values: Lanes| dispatch!(level, simd => *linear(simd, f32x16::load_array(simd, values)).as_array());
        applied(expected, found, 1.2e-5);
    }

    #[test]
    fn responses_are_cube_roots() {
        let expected = |light: f32| f64::from(light + BIAS).cbrt();
        let found = |level, values: Lanes| {
            dispatch!(level, simd => {
                *cube_root(simd, f32x16::load_array(simd, values) + BIAS).as_array()
            })
        };
        applied(expected, found, 4e-7);
    }
}
