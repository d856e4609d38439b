//! How the distortion curves with the colour of a Gaussian.

use core::array;

use crate::coding::entropy::to_axes;
use crate::color::ColorModel;

// Constants: docs/tuning.md, "What a person sees".
/// The curvature by each colour channel, and by luma. Those of a Gaussian that is wide against all scales of
/// the perceptual weights follow from these, 0.415 and 0.585; most Gaussians are small, and count less in the
/// means of blocks.
const OF_CHANNELS: f32 = 0.32;
const OF_LUMA: f32 = 0.42;

/// A symmetric matrix, 0 in the rows and columns of channels that are absent.
type Matrix = [[f32; 4]; 4];

/// Half of the second derivatives of the distortion by the colour of a usual Gaussian, as a share of the
/// sum of its squared weights times perceptual weights.
#[derive(Clone, Copy, Debug)]
pub(crate) struct ColorCurvature {
    by_channel: Matrix,
    by_axis: Matrix,
}

impl ColorCurvature {
    /// That of the squared error.
    pub(crate) fn of_squared_error(model: ColorModel) -> Self {
        Self::new(model, |row, column| if row == column { 1.0 } else { 0.0 })
    }

    /// That of the perceptual distortion, given the share of each channel in luma.
    pub(super) fn of_distortion(luma: [f32; 4], model: ColorModel) -> Self {
        let colors = model.channels() - usize::from(model.has_alpha());
        Self::new(model, |row, column| {
            let own = if row < colors { OF_CHANNELS } else { 1.0 };
            // Alpha is no part of luma.
            OF_LUMA * luma[row] * luma[column] + if row == column { own } else { 0.0 }
        })
    }

    /// That with these second derivatives by pairs of channels.
    fn new(model: ColorModel, entry: impl Fn(usize, usize) -> f32) -> Self {
        let channels = model.channels();
        let mut by_channel = [[0.0; 4]; 4];
        for (row, entries) in by_channel.iter_mut().enumerate().take(channels) {
            for (column, value) in entries.iter_mut().enumerate().take(channels) {
                *value = entry(row, column);
            }
        }
        // The axes are orthonormal. Both matrices are symmetric.
        let halfway = by_channel.map(|row| to_axes(row, model));
        let columns = array::from_fn(|at| halfway.map(|row| row[at]));
        let by_axis = columns.map(|column: [f32; 4]| to_axes(column, model));
        Self { by_channel, by_axis }
    }

    /// By pairs of colour axes.
    pub(crate) fn by_axis(&self) -> &Matrix {
        &self.by_axis
    }

    /// Half the derivatives by each channel, of a colour that is added.
    #[inline]
    pub(crate) fn times(&self, color: [f32; 4]) -> [f32; 4] {
        self.by_channel.map(|row| dot(row, color))
    }

    /// The increase of the distortion with these amplitudes along the colour axes, where it is least without.
    #[inline]
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
            }
        }
    }
}
