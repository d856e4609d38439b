//! The region of an output that is rendered.

/// Largest width and height of an output: every pixel centre is exact in `f32`.
pub(crate) const MAX_OUTPUT_SIDE: u32 = 1 << 23;

/// A rectangle of output pixels: columns x to x + width - 1 and rows y to y + height - 1, counted
/// from the output's upper left corner.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash)]
pub struct Region {
    /// First column.
    pub x: u32,
    /// First row.
    pub y: u32,
    /// Width in pixels, at least 1.
    pub width: u32,
    /// Height in pixels, at least 1.
    pub height: u32,
}

impl Region {
    /// Whether it is inside of `width` x `height` pixels, and not empty.
    pub(crate) fn is_inside(self, width: u32, height: u32) -> bool {
        let inside = |at: u32, length: u32, whole: u32| {
            length > 0 && at.checked_add(length).is_some_and(|end| end <= whole)
        };
        inside(self.x, self.width, width) && inside(self.y, self.height, height)
    }

    /// The number of its pixels.
    pub(crate) fn pixels(self) -> u64 {
        u64::from(self.width) * u64::from(self.height)
    }
}
