//! A picture as the eye takes it in: luma and blue, on several scales.

use rayon::prelude::*;

use super::plane::Plane;
use crate::color::ColorModel;
use crate::encode::error::EncodeError;
use crate::encode::progress::Observer;

/// Scales with luma: all of the size, a half, a quarter and an eighth of it.
pub(super) const LUMA_SCALES: usize = 4;
/// Entries of the table from encoded to linear samples, minus 1.
const TABLE: usize = 4095;
/// The bias of the cube root that models the response of the eye's cones (JPEG XL, annex L.2).
const BIAS: f32 = 0.003_793_073;
/// The responses of luma, the mean of the long and medium cones, and of the short cones to linear
/// light.
const LUMA: [f32; 3] = [0.265, 0.657, 0.078];
const SHORT: [f32; 3] = [0.243_423, 0.204_767, 0.551_81];
/// What stands behind transparent pixels.
const BACKGROUND: f32 = 0.5;
/// Work for a pixel of a plane, or of a picture that is halved.
const WORK: f64 = 12.0;

/// A picture on several scales, each half as wide and high as the one before.
#[derive(Clone, Debug, Default)]
pub(super) struct Pyramid {
    pub(super) luma: [Plane; LUMA_SCALES],
    /// Blue minus luma at a 16th of the size.
    pub(super) blue: Plane,
}

/// Collects the rows of a picture.
#[derive(Debug)]
pub(super) struct PyramidBuilder {
    width: usize,
    height: usize,
    model: ColorModel,
    /// From an encoded sample to linear light.
    linear: Vec<f32>,
    luma: Plane,
    /// Linear light at half of the size.
    half: LinearPicture,
}

/// A picture in linear light.
#[derive(Clone, Debug)]
struct LinearPicture {
    width: usize,
    pixels: Vec<[f32; 3]>,
}

impl PyramidBuilder {
    pub(super) fn new([width, height]: [usize; 2], model: ColorModel) -> Self {
        let linear = |index: usize| {
            let encoded = index as f32 / TABLE as f32;
            if encoded <= 0.04045 { encoded / 12.92 } else { ((encoded + 0.055) / 1.055).powf(2.4) }
        };
        let half = [width.div_ceil(2), height.div_ceil(2)];
        Self {
            width,
            height,
            model,
            linear: (0..=TABLE).map(linear).collect(),
            luma: Plane { width, values: vec![0.0; width * height] },
            half: LinearPicture { width: half[0], pixels: vec![[0.0; 3]; half[0] * half[1]] },
        }
    }

    /// Sets `rows` rows from `first` on, which is even; so is the number of rows, except at the bottom.
    /// `sample` gives the sample in a column and row of these, and of a channel, where a full sample
    /// is 1.
    pub(super) fn set(
        &mut self,
        first: usize,
        rows: usize,
        sample: impl Fn(usize, usize, usize) -> f32 + Sync,
    ) {
        let (width, height) = (self.width, self.height);
        let (model, linear) = (self.model, &self.linear);
        let lines = self.luma.values[first * width..][..rows * width].par_chunks_mut(2 * width);
        let halves = self.half.pixels.par_chunks_mut(self.half.width).skip(first / 2);
        lines.zip(halves).enumerate().for_each(|(pair, (lines, half))| {
            for (row, line) in lines.chunks_exact_mut(width).enumerate() {
                let y = 2 * pair + row;
                // At an odd end, the last row and column count twice.
                let down = if first + y + 1 == height && row == 0 { 2.0 } else { 1.0 };
                for (x, value) in line.iter_mut().enumerate() {
                    let color = linear_color(model, linear, |channel| sample(x, y, channel));
                    *value = luma(color);
                    let across = if x + 1 == width && x % 2 == 0 { 2.0 } else { 1.0 };
                    let weight = 0.25 * down * across;
                    for (sum, value) in half[x / 2].iter_mut().zip(color) {
                        *sum += weight * value;
                    }
                }
            }
        });
    }

    /// # Errors
    /// [`EncodeError::Cancelled`] when the caller cancels.
    pub(super) fn finish(self, observer: &mut Observer<'_>) -> Result<Pyramid, EncodeError> {
        let mut pyramid = Pyramid::default();
        let mut picture = self.half;
        for (scale, plane) in pyramid.luma.iter_mut().enumerate() {
            if scale > 1 {
                picture = picture.halved(observer)?;
            }
            if scale > 0 {
                *plane = picture.plane(luma, observer)?;
            }
        }
        pyramid.luma[0] = self.luma;
        let blue = |color| response(SHORT, color) - luma(color);
        pyramid.blue = picture.halved(observer)?.plane(blue, observer)?;
        Ok(pyramid)
    }
}

impl LinearPicture {
    /// Half as wide and high; the last row and column of an odd number count twice.
    fn halved(&self, observer: &mut Observer<'_>) -> Result<Self, EncodeError> {
        let (width, height) = (self.width, self.pixels.len() / self.width);
        let half = width.div_ceil(2);
        let mut pixels = vec![[0.0; 3]; half * height.div_ceil(2)];
        let rows = pixels.chunks_exact_mut(half).enumerate();
        observer.map(WORK * half as f64, rows, |(row, pixels)| {
            for (column, pixel) in pixels.iter_mut().enumerate() {
                let (x, y) = (2 * column, 2 * row);
                let (right, below) = ((x + 1).min(width - 1), (y + 1).min(height - 1));
                let corners = [[x, y], [right, y], [x, below], [right, below]];
                let corners = corners.map(|[x, y]| self.pixels[y * width + x]);
                *pixel = core::array::from_fn(|channel| {
                    0.25 * corners.iter().map(|corner| corner[channel]).sum::<f32>()
                });
            }
        })?;
        Ok(Self { width: half, pixels })
    }

    fn plane(
        &self,
        value: impl Fn([f32; 3]) -> f32 + Send + Sync,
        observer: &mut Observer<'_>,
    ) -> Result<Plane, EncodeError> {
        let width = self.width;
        let mut values = vec![0.0; self.pixels.len()];
        let rows = values.chunks_exact_mut(width).zip(self.pixels.chunks_exact(width));
        observer.map(WORK * width as f64, rows, |(values, pixels)| {
            values.iter_mut().zip(pixels).for_each(|(to, &color)| *to = value(color));
        })?;
        Ok(Plane { width, values })
    }
}

/// The linear light of a pixel.
#[inline(always)]
fn linear_color(model: ColorModel, linear: &[f32], sample: impl Fn(usize) -> f32) -> [f32; 3] {
    let alpha = if model.has_alpha() { sample(model.channels() - 1) } else { 1.0 };
    let value = |channel: usize| {
        let value = sample(channel) * alpha + BACKGROUND * (1.0 - alpha);
        // The cast saturates.
        linear[((value * TABLE as f32 + 0.5) as usize).min(TABLE)]
    };
    match model {
        ColorModel::Gray | ColorModel::GrayAlpha => [value(0); 3],
        ColorModel::Rgb | ColorModel::Rgba => [0, 1, 2].map(value),
    }
}

/// The response of luma to linear light.
#[inline(always)]
fn luma(color: [f32; 3]) -> f32 {
    response(LUMA, color)
}

#[inline(always)]
fn response(shares: [f32; 3], color: [f32; 3]) -> f32 {
    let light: f32 = shares.iter().zip(color).map(|(share, value)| share * value).sum();
    (light + BIAS).cbrt()
}
