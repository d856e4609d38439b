//! The loss of a picture's renderings.

use fearless_simd::{Simd, f32x16, prelude::*};

use super::color_curvature::ColorCurvature;
use super::error::{Distortion, RenderingError, SquaredError};
use super::gradient;
use super::perceptual_weights::PerceptualWeights;
use crate::color::ColorModel;
use crate::encode::error::Result;
use crate::encode::mul_add::MulAdd;
use crate::encode::options::Tune;
use crate::encode::progress::Observer;
use crate::encode::sample_tile::{FULL_SCALE, SampleTile, TilePlane, inside};
use crate::encode::source::Source;
use crate::render::simd_kernel::{larger, smaller};
use crate::render::tile_grid::TILE_HEIGHT;

// Constants: docs/tuning.md, "What a person sees".
/// Coarser steps of both chroma axes, whose errors count less than those of luma.
const VISUAL_AXIS_STEPS: [f32; 4] = [1.0, 1.625, 1.625, 1.0];

/// How much errors count in a picture.
#[derive(Debug)]
pub(crate) struct PictureLoss {
    size: [usize; 2],
    /// That of the source.
    pub(super) half_step: f32,
    /// `None` if all errors count the same.
    weights: Option<PerceptualWeights>,
    color: ColorModel,
    /// Whether its channels are what the colour model says.
    has_colors: bool,
}

impl PictureLoss {
    pub(crate) fn new(
        source: &Source<'_>,
        tune: Tune,
        observer: &mut Observer<'_>,
    ) -> Result<Self> {
        let weights = match tune {
            Tune::Visual => Some(PerceptualWeights::new(source, observer)?),
            Tune::Psnr => None,
        };
        Ok(Self {
            size: source.size(),
            half_step: half_step(source),
            weights,
            color: source.color(),
            has_colors: true,
        })
    }

    /// That of a picture of which this one is a copy, smaller by a factor.
    pub(crate) fn enlarged(&self, source: &Source<'_>, factor: usize) -> Self {
        let Self { weights, color, has_colors, .. } = self;
        Self {
            size: source.size(),
            half_step: half_step(source),
            weights: weights.as_ref().map(|weights| weights.enlarged(source.size(), factor)),
            color: *color,
            has_colors: *has_colors,
        }
    }

    /// The loss of a picture whose channels are no colours.
    pub(crate) fn without_colors(self) -> Self {
        Self { has_colors: false, ..self }
    }

    /// How the distortion curves with the colour of a Gaussian.
    pub(crate) fn color_curvature(&self) -> ColorCurvature {
        self.curvature(ColorCurvature::of_distortion)
    }

    /// The same as a share of that by gray, for which the learning rate of training is meant.
    pub(crate) fn relative_curvature(&self) -> ColorCurvature {
        self.curvature(ColorCurvature::relative_to_gray)
    }

    /// The perceptual weights, if they are of colours.
    fn color_weights(&self) -> Option<&PerceptualWeights> {
        self.weights.as_ref().filter(|_| self.has_colors)
    }

    fn curvature(&self, visual: impl Fn([f32; 4], ColorModel) -> ColorCurvature) -> ColorCurvature {
        match self.color_weights() {
            Some(weights) => visual(weights.luma, self.color),
            None => ColorCurvature::of_squared_error(self.color),
        }
    }

    /// What it is tuned for.
    pub(crate) fn tune(&self) -> Tune {
        if self.weights.is_some() { Tune::Visual } else { Tune::Psnr }
    }

    /// The quantization steps of the colour axes, as multiples of the step of colour.
    pub(crate) fn axis_steps(&self) -> &'static [f32] {
        let steps = match self.color_weights() {
            Some(_) => &VISUAL_AXIS_STEPS,
            None => &[1.0; 4],
        };
        &steps[..self.color.channels()]
    }

    /// The perceptual weights, unless all errors count the same.
    pub(crate) fn weights(&self) -> Option<&PerceptualWeights> {
        self.weights.as_ref()
    }

    /// How much a squared error of a pixel counts.
    #[inline]
    pub(crate) fn weight_at(&self, x: usize, y: usize) -> f32 {
        self.weights.as_ref().map_or(1.0, |weights| weights.at(x, y))
    }

    /// How much a squared error counts at a position in pixels, or at the nearest one inside the
    /// picture.
    #[inline]
    pub(crate) fn weight_near(&self, [x, y]: [f32; 2]) -> f32 {
        let [width, height] = self.size;
        // Casts saturate.
        self.weight_at((x as usize).min(width - 1), (y as usize).min(height - 1))
    }

    /// How much a squared error counts on average under a Gaussian, which may lie across areas of very
    /// different weights: at three points around its centre, one standard deviation away.
    #[inline]
    pub(crate) fn weight_under(&self, center: [f32; 2], cholesky: [f32; 3]) -> f32 {
        const HALF_ROOT_OF_THREE: f32 = 0.866_025_4;
        let ([x, y], [l11, l21, l22]) = (center, cholesky);
        let near = |u: f32, v: f32| self.weight_near([x + l11 * u, y + l21 * u + l22 * v]);
        let [left, right] = [-HALF_ROOT_OF_THREE, HALF_ROOT_OF_THREE].map(|u| near(u, -0.5));
        (near(0.0, 1.0) + left + right) / 3.0
    }

    /// The error of a rendering, `planes`, in the tile whose first pixel is `corner`. `size` is the number of
    /// columns and rows inside the picture. `planes` becomes half the gradient of the distortion by the
    /// samples of the rendering: where all errors count the same, the residuals.
    ///
    /// Loops are over indices, as in `fit/training_tile.rs`.
    #[inline(always)]
    #[expect(clippy::needless_range_loop, reason = "see `fit/training_tile.rs`")]
    pub(crate) fn of_tile<S: Simd, const CHANNELS: usize>(
        &self,
        simd: S,
        target: SampleTile<'_, CHANNELS>,
        corner: [usize; 2],
        size: [usize; 2],
        planes: &mut [TilePlane; CHANNELS],
    ) -> RenderingError {
        let zero = f32x16::splat(simd, 0.0);
        let inside = inside(simd, size[0]);
        let mut total = zero;
        for channel in 0..CHANNELS {
            for row in 0..TILE_HEIGHT {
                let inside = if row < size[1] { inside } else { zero };
                let sample = target.line(channel, row).load(simd);
                let target = sample * (1.0 / FULL_SCALE);
                let value = f32x16::load_array_ref(simd, &planes[channel][row]);
                let residual = residual(simd, (value - target) * inside, sample);
                residual.store_array(&mut planes[channel][row]);
                let clamped = smaller(simd, larger(simd, value, 0.0), 1.0);
                let clamped = (clamped - target) * inside;
                total = clamped.fused_mul_add(clamped, total);
            }
        }
        let squared = total.to_array().iter().map(|&squared| f64::from(squared)).sum();
        let distortion = match &self.weights {
            Some(weights) => gradient::differentiate(simd, weights, corner, size, planes),
            None => Distortion(squared),
        };
        RenderingError { squared: SquaredError(squared), distortion }
    }

    /// Replaces the residuals of a tile by half the gradient of the distortion, as [`Self::of_tile`] has it.
    #[inline(always)]
    pub(crate) fn differentiate<S: Simd, const CHANNELS: usize>(
        &self,
        simd: S,
        corner: [usize; 2],
        size: [usize; 2],
        planes: &mut [TilePlane; CHANNELS],
    ) {
        if let Some(weights) = &self.weights {
            gradient::differentiate(simd, weights, corner, size, planes);
        }
    }

    /// Size in bytes.
    pub(crate) fn memory(&self) -> usize {
        self.weights.as_ref().map_or(0, PerceptualWeights::memory)
    }

    /// Size in bytes of what else [`PictureLoss::new`] needs.
    pub(crate) fn scratch_memory(&self, source: &Source<'_>) -> usize {
        self.weights.as_ref().map_or(0, |weights| weights.scratch_memory(source))
    }
}

/// Half of the quantization step of a source's depth, where a full sample is 1.
fn half_step(source: &Source<'_>) -> f32 {
    0.5 / f32::from(source.depth().max_sample())
}

/// The residuals of sixteen samples, given the differences of a rendering from the source and the samples of
/// the source (from 0 to [`FULL_SCALE`]): as the output is clamped, a rendering above white is no error where
/// the source is white, nor one below black where the source is black.
#[inline(always)]
pub(crate) fn residual<S: Simd>(simd: S, difference: f32x16<S>, sample: f32x16<S>) -> f32x16<S> {
    let zero = f32x16::splat(simd, 0.0);
    let residual = sample.simd_ge(FULL_SCALE).select(smaller(simd, difference, 0.0), difference);
    sample.simd_le(zero).select(larger(simd, residual, 0.0), residual)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::color::ColorModel;
    use crate::encode::progress::unobserved;
    use crate::encode::testing::source;

    #[test]
    fn what_lies_under_a_gaussian_counts() {
        // Even ground on the left, and noise on the right.
        let mut rng = fastrand::Rng::with_seed(2);
        let samples: Vec<u8> =
            (0..96 * 96).map(|i| if i % 96 < 48 { 128 } else { rng.u8(..) }).collect();
        let source = source([96, 96], ColorModel::Gray, &samples);
        let loss = |tune| unobserved(|observer| PictureLoss::new(&source, tune, observer));
        let visual = loss(Tune::Visual);
        let [even, noise] = [8.0, 88.0].map(|x| visual.weight_near([x, 48.0]));
        assert!(even > 4.0 * noise, "{even}, {noise}");
        let under = |x, cholesky| visual.weight_under([x, 48.0], cholesky);
        // Small, wide, high, outside the picture.
        assert!((under(8.5, [0.1, 0.0, 0.1]) / even - 1.0).abs() < 1e-5);
        assert!((under(60.0, [30.0, 0.0, 2.0]) - noise) > 0.1 * even);
        assert!(under(60.0, [2.0, 0.0, 30.0]) < 2.0 * noise);
        assert!(under(-1e30, [1e30, 1e30, 1.0]).is_finite());
        assert_eq!(loss(Tune::Psnr).weight_under([60.0, 48.0], [30.0, 0.0, 2.0]), 1.0);
    }
}
