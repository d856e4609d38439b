//! The trained values of one Gaussian, and the bounds that they are clamped to.

use glam::{Vec2, Vec3};

use super::parameterization;
use crate::gaussian::{MAX_COMPONENTS, Parameterization};

/// The components of a Gaussian in the order of the file: centre, shape, colour. Absent channels
/// are 0.
pub(crate) type Row = [f32; MAX_COMPONENTS];

// Constants: docs/tuning.md, "Growth".
/// Largest magnitude of a trained colour: where larger colours cancel each other, the picture
/// depends on rounding errors.
pub(super) const MAX_COLOR: f32 = 8.0;

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
    /// are quantized, for a Gaussian of which little is visible.
    #[inline]
    pub(super) fn center_ranges(self) -> [(f32, f32); 2] {
        let margin = 8.0 + 0.05 * self.size;
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
