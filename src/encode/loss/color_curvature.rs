//! How the distortion curves with the colour of a Gaussian.

use core::array;

use crate::coding::entropy::to_axes;
use crate::color::ColorModel;

// Constants: docs/tuning.md, "What a person sees".
/// The curvature by each colour channel, and by luma. With the mean weights, those of a Gaussian that is wide
/// against the blocks of all scales are 0.5 and 0.5; most are small, and count less in the means of blocks.
const OF_CHANNELS: f32 = 0.32;
const OF_LUMA: f32 = 0.42;

/// A symmetric matrix, 0 in the rows and columns of channels that are absent.
pub(crate) type Matrix = [[f32; 4]; 4];

/// Half of the second derivatives of the distortion by the colour of a usual Gaussian, as a share of the
/// sum of its squared weights times perceptual weights.
#[derive(Clone, Copy, Debug)]
pub(crate) struct ColorCurvature {
    by_channel: Matrix,
    inverse: Matrix,
    by_axis: Matrix,
}

impl ColorCurvature {
    /// That of the squared error.
    pub(crate) fn of_squared_error(model: ColorModel) -> Self {
        Self::new(model, [1.0; 4], [0.0; 4])
    }

    /// That of the perceptual distortion, given the share of each channel in luma (0 for alpha).
    pub(super) fn of_distortion(luma: [f32; 4], model: ColorModel) -> Self {
        Self::scaled(luma, model, 1.0)
    }

    /// The same as a share of that by gray.
    pub(super) fn relative_to_gray(luma: [f32; 4], model: ColorModel) -> Self {
        Self::scaled(luma, model, 1.0 / (OF_CHANNELS + OF_LUMA))
    }

    /// That of the perceptual distortion, times a scale for all but alpha.
    fn scaled(luma: [f32; 4], model: ColorModel, scale: f32) -> Self {
        let colors = model.channels() - usize::from(model.has_alpha());
        let own = array::from_fn(|at| if at < colors { scale * OF_CHANNELS } else { 1.0 });
        Self::new(model, own, luma.map(|share| (scale * OF_LUMA).sqrt() * share))
    }

    /// The diagonal matrix of `own`, plus the outer product of `luma` with itself.
    fn new(model: ColorModel, own: [f32; 4], luma: [f32; 4]) -> Self {
        let present = model.channels();
        let matrix = |entry: &dyn Fn(usize, usize) -> f32| -> Matrix {
            array::from_fn(|row| {
                array::from_fn(|column| match row.max(column) < present {
                    true => entry(row, column),
                    false => 0.0,
                })
            })
        };
        let diagonal = |row, column, value| if row == column { value } else { 0.0 };
        let by_channel =
            matrix(&|row, column| diagonal(row, column, own[row]) + luma[row] * luma[column]);
        // Sherman and Morrison's formula.
        let shares: [f32; 4] = array::from_fn(|at| luma[at] / own[at]);
        let scale = 1.0 / (1.0 + dot(shares, luma));
        let inverse = matrix(&|row, column| {
            diagonal(row, column, 1.0 / own[row]) - scale * shares[row] * shares[column]
        });
        // The axes are orthonormal. All matrices are symmetric.
        let halfway = by_channel.map(|row| to_axes(row, model));
        let columns = array::from_fn(|at| halfway.map(|row| row[at]));
        let by_axis = columns.map(|column: [f32; 4]| to_axes(column, model));
        Self { by_channel, inverse, by_axis }
    }

    /// By pairs of channels.
    pub(crate) fn by_channel(&self) -> &Matrix {
        &self.by_channel
    }

    /// The inverse of that by pairs of channels.
    pub(crate) fn inverse(&self) -> &Matrix {
        &self.inverse
    }

    /// By pairs of colour axes.
    pub(crate) fn by_axis(&self) -> &Matrix {
        &self.by_axis
    }

    /// Half the derivatives by each channel, of a colour that is added.
    #[inline(never)]
    pub(crate) fn times(&self, color: [f32; 4]) -> [f32; 4] {
        self.by_channel.map(|row| dot(row, color))
    }

    /// The increase of the distortion with these amplitudes along the colour axes, where it is least without.
    #[inline(never)]
    pub(crate) fn of(&self, amplitudes: [f32; 4]) -> f32 {
        dot(self.by_axis.map(|row| dot(row, amplitudes)), amplitudes)
    }
}

#[inline]
fn dot(a: [f32; 4], b: [f32; 4]) -> f32 {
    a[0] * b[0] + a[1] * b[1] + a[2] * b[2] + a[3] * b[3]
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::encode::testing::MODELS;

    #[test]
    fn axes_and_channels_have_the_same_curvature() {
        let mut rng = fastrand::Rng::with_seed(7);
        for model in MODELS {
            let luma = if model.channels() < 3 { [1.0, 0.0, 0.0] } else { [0.46, 1.14, 0.14] };
            let luma = [luma[0], luma[1], luma[2], 0.0];
            for curvature in [
                ColorCurvature::of_squared_error(model),
                ColorCurvature::of_distortion(luma, model),
                ColorCurvature::relative_to_gray(luma, model),
            ] {
                let mut color = [0.0; 4];
                color[..model.channels()].fill_with(|| rng.f32() - 0.5);
                let by_axes = curvature.of(to_axes(color, model));
                let by_channels = dot(curvature.times(color), color);
                assert!(
                    (by_axes - by_channels).abs() < 1e-6,
                    "{model:?}: {by_axes}, {by_channels}"
                );
                assert!(by_axes > 0.0);
                let back = curvature.inverse().map(|row| dot(row, curvature.times(color)));
                for (found, expected) in back.into_iter().zip(color) {
                    assert!((found - expected).abs() < 1e-5, "{model:?}: {found}, {expected}");
                }
            }
        }
    }
}
