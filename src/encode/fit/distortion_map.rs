//! The distortion of single pixels, by which new Gaussians are placed (paper, section "Distortion
//! Driven Densification").

use super::training::Distortion;
use crate::encode::sensitivity::BLOCK;
use crate::encode::tiled_source::{TILE_WIDTH, TilePlane, TiledSource};
use crate::render::tile_grid::TILE_HEIGHT;

/// The distortion of every pixel of a tile, of which the first pixel is (left, top) and the residuals are
/// `planes`; 0 where the output is exact already.
///
/// Residuals count as in the error that training minimizes: times the square root of the sensitivity. The
/// planes have them times the sensitivity itself, which would leave next to nothing to places of low
/// sensitivity (docs/tuning.md, "Growth").
pub(super) fn of_tile(
    tiled: &TiledSource,
    [left, top]: [usize; 2],
    planes: &[TilePlane],
    measure: Distortion,
) -> TilePlane {
    let largest = over_channels(
        planes,
        |largest, residual| {
            if residual > largest { residual } else { largest }
        },
    );
    let mut distortions = match measure {
        Distortion::L1 => over_channels(planes, |sum, residual| sum + residual),
        Distortion::L3 => {
            let squares = over_channels(planes, |sum, residual| sum + residual * residual);
            squares.map(|line| line.map(|square| square * square.sqrt()))
        }
    };
    for y in (0..TILE_HEIGHT).step_by(BLOCK) {
        for x in (0..TILE_WIDTH).step_by(BLOCK) {
            let sensitivity = tiled.sensitivity_near([(left + x) as f32, (top + y) as f32]);
            // A residual of less than half a quantization step disappears when samples are
            // rounded.
            let exact = tiled.half_step * sensitivity;
            let weight = match measure {
                Distortion::L1 => 1.0 / sensitivity.sqrt(),
                Distortion::L3 => 1.0 / (sensitivity * sensitivity.sqrt()),
            };
            for row in y..y + BLOCK {
                for column in x..x + BLOCK {
                    let is_exact = largest[row][column] < exact;
                    distortions[row][column] *= if is_exact { 0.0 } else { weight };
                }
            }
        }
    }
    distortions
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
