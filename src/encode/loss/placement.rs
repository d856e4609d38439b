//! Where new Gaussians go: the error of single pixels (paper, section "Distortion Driven Densification").

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
        [left, top]: [usize; 2],
        planes: &[TilePlane],
        norm: ErrorNorm,
    ) -> TilePlane {
        let largest = over_channels(
            planes,
            |largest, residual| {
                if residual > largest { residual } else { largest }
            },
        );
        let mut errors = match norm {
            ErrorNorm::L1 => over_channels(planes, |sum, residual| sum + residual),
            ErrorNorm::L3 => {
                let squares = over_channels(planes, |sum, residual| sum + residual * residual);
                squares.map(|line| line.map(|square| square * square.sqrt()))
            }
        };
        for y in (0..TILE_HEIGHT).step_by(BLOCK) {
            for x in (0..TILE_WIDTH).step_by(BLOCK) {
                let weight = self.weight_near([(left + x) as f32, (top + y) as f32]);
                // A residual of less than half a quantization step disappears when samples are
                // rounded.
                let exact = self.half_step * weight;
                let factor = match norm {
                    ErrorNorm::L1 => 1.0 / weight.sqrt(),
                    ErrorNorm::L3 => 1.0 / (weight * weight.sqrt()),
                };
                for row in y..y + BLOCK {
                    for column in x..x + BLOCK {
                        let is_exact = largest[row][column] < exact;
                        errors[row][column] *= if is_exact { 0.0 } else { factor };
                    }
                }
            }
        }
        errors
    }
}

/// Combines the magnitudes of the residuals of all channels at every pixel of a tile.
fn over_channels(residuals: &[TilePlane], combine: impl Fn(f32, f32) -> f32) -> TilePlane {
    let mut plane = [[0.0; TILE_WIDTH]; TILE_HEIGHT];
    for residual in residuals {
        for (line, residual) in plane.iter_mut().zip(residual) {
            for (value, residual) in line.iter_mut().zip(residual) {
                *value = combine(*value, residual.abs());
            }
        }
    }
    plane
}
