//! The trained values of one Gaussian, and the bounds that they are clamped to.

use glam::{Vec2, Vec3};

use super::parameterization;
use crate::coding::entropy::CenterGrid;
use crate::gaussian::{MAX_COMPONENTS, Parameterization};

/// The components of a Gaussian in the order of the file: centre, shape, colour. Absent channels
/// are 0.
pub(crate) type Row = [f32; MAX_COMPONENTS];

// Constants: docs/tuning.md, "Growth".
/// Largest magnitude of a trained colour: where larger colours cancel each other, the picture
/// depends on rounding errors.
pub(super) const MAX_COLOR: f32 = 8.0;

/// Pixels by which rounding may move a centre outwards: where a Gaussian is steep, an error along x
/// moves it along y.
const MOST_ROUNDING: f32 = 1.0;

/// The shape components of a row.
#[inline]
pub(crate) fn shape_of(row: &Row) -> Vec3 {
    Vec3::from_slice(&row[2..5])
}

/// What the step of a Gaussian depends on.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Slope {
    pub(crate) gradient: Row,
    /// How much a squared error counts there.
    pub(crate) sensitivity: f32,
}

/// The layout of the rows of a picture, and the bounds of their values.
#[derive(Clone, Copy, Debug)]
pub(crate) struct RowBounds {
    pub(crate) parameterization: Parameterization,
    pub(crate) channels: usize,
    /// Width and height of the picture in pixels.
    pub(crate) size: Vec2,
}

impl RowBounds {
    /// Largest standard deviation that is trained, in pixels: twice the longer side of the picture.
    #[inline]
    pub(super) fn max_deviation(self) -> f32 {
        2.0 * self.size.max_element()
    }

    /// The row with all values clamped, so that the shape is valid.
    #[inline]
    pub(crate) fn clamped(self, mut row: Row) -> Row {
        let shape =
            parameterization::clamped(self.parameterization, shape_of(&row), self.max_deviation());
        row[2..5].copy_from_slice(&shape.to_array());
        self.clamp_position_and_color(&mut row);
        row
    }

    /// The ranges of x and y of a centre. Farther outside, it would widen the range over which positions
    /// are quantized, for a Gaussian of which little is visible; and it would leave the grid of the entropy
    /// coding, which moves a centre inwards, and a long Gaussian with it.
    #[inline]
    pub(super) fn center_ranges(self) -> [(f32, f32); 2] {
        let grid = CenterGrid::new(self.size.x as u32, self.size.y as u32);
        let margin = (8.0 + 0.05 * self.size).min(Vec2::splat(grid.margin() - MOST_ROUNDING));
        [(-margin.x, self.size.x + margin.x), (-margin.y, self.size.y + margin.y)]
    }

    /// Clamps everything but the shape.
    #[inline]
    pub(crate) fn clamp_position_and_color(self, row: &mut Row) {
        for (value, (low, high)) in row[..2].iter_mut().zip(self.center_ranges()) {
            *value = value.clamp(low, high);
        }
        for value in &mut row[5..] {
            *value = value.clamp(-MAX_COLOR, MAX_COLOR);
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn centers_have_codes_even_where_a_gaussian_is_steep() {
        for side in [1, 8, 96, 128, 129, 200, 256, 257, 480, 512, 513, 768, 3000, 65_536_u32] {
            let grid = CenterGrid::new(side, 8);
            let bounds = RowBounds {
                parameterization: Parameterization::Cholesky,
                channels: 1,
                size: Vec2::new(side as f32, 8.0),
            };
            let mut rows = [[-1e6; MAX_COMPONENTS], [1e6; MAX_COMPONENTS]];
            for (row, outwards) in rows.iter_mut().zip([-0.9, 0.9]) {
                bounds.clamp_position_and_color(row);
                let rounded = [row[0], row[1]].map(|coordinate| coordinate + outwards);
                let coded = grid.center(grid.units(rounded));
                let is_near = |(a, b): (&f32, &f32)| (a - b).abs() < 0.01;
                assert!(rounded.iter().zip(&coded).all(is_near), "{side}: {rounded:?} {coded:?}");
            }
        }
    }
}
