//! Where new Gaussians go: the error of single pixels (paper, section "Distortion Driven Densification").

use fearless_simd::{Level, Simd, dispatch, f32x16, prelude::*};

use super::activity::BLOCK;
use super::picture_loss::PictureLoss;
use crate::encode::sample_tile::{TILE_WIDTH, TilePlane};
use crate::render::tile_grid::TILE_HEIGHT;

/// The error of a pixel, by which new Gaussians are placed, from the residuals of its channels.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
#[non_exhaustive]
pub enum ErrorNorm {
    /// The sum of absolute residuals (paper).
    L1,
    /// The cube of the Euclidean length of the residuals.
    L3,
}

impl PictureLoss {
    /// The error of every pixel of the tile whose first pixel is (left, top), given half the gradient of the
    /// distortion; 0 where the output is exact already.
    ///
    /// Residuals count as in the error that training minimizes: times the square root of the weight. The
    /// planes have them times the weight itself, which would leave next to nothing to places of low weight
    /// (docs/tuning.md, "Growth").
    pub(crate) fn placement_errors(
        &self,
        level: Level,
        corner: [usize; 2],
        planes: &[TilePlane],
        norm: ErrorNorm,
    ) -> TilePlane {
        dispatch!(level, simd => self.placement_errors_with(simd, corner, planes, norm))
    }

    /// [`Self::placement_errors`]. Loops are over indices, as in `fit/training_tile.rs`.
    #[inline(always)]
    fn placement_errors_with<S: Simd>(
        &self,
        simd: S,
        [left, top]: [usize; 2],
        planes: &[TilePlane],
        norm: ErrorNorm,
    ) -> TilePlane {
        let zero = f32x16::splat(simd, 0.0);
        let mut errors = [[0.0; TILE_WIDTH]; TILE_HEIGHT];
        for y in (0..TILE_HEIGHT).step_by(BLOCK) {
            let (mut exact, mut factor) = ([0.0; TILE_WIDTH], [0.0; TILE_WIDTH]);
            for x in 0..TILE_WIDTH {
                if x % BLOCK > 0 {
                    (exact[x], factor[x]) = (exact[x - 1], factor[x - 1]);
                    continue;
                }
                let weight = self.weight_near([(left + x) as f32, (top + y) as f32]);
                // A residual of less than half a quantization step disappears when samples are
                // rounded.
                exact[x] = self.half_step * weight;
                factor[x] = match norm {
                    ErrorNorm::L1 => 1.0 / weight.sqrt(),
                    ErrorNorm::L3 => 1.0 / (weight * weight.sqrt()),
                };
            }
            let [exact, factor] = [exact, factor].map(|line| f32x16::load_array(simd, line));
            for row in y..y + BLOCK {
                // The largest magnitude of the channels, the sum, and the sum of squares.
                let (mut largest, mut sum, mut squares) = (zero, zero, zero);
                for plane in planes {
                    let residual = f32x16::load_array_ref(simd, &plane[row]).abs();
                    largest = residual.simd_gt(largest).select(residual, largest);
                    sum += residual;
                    squares += residual * residual;
                }
                let error = match norm {
                    ErrorNorm::L1 => sum,
                    ErrorNorm::L3 => squares * squares.sqrt(),
                };
                let factor = largest.simd_lt(exact).select(zero, factor);
                (error * factor).store_array(&mut errors[row]);
            }
        }
        errors
    }
}
