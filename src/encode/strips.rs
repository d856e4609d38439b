//! Strips of a large picture.

use crate::region::Region;

/// Pixels that are rendered and compared at a time, about: floats of a large picture are many, and
/// the observer does not wait.
const STRIP_PIXELS: u32 = 1 << 20;

/// A picture in strips of whole rows, which are rendered and compared one by one.
pub(crate) fn strips(width: u32, height: u32) -> impl Iterator<Item = Region> {
    let rows = (STRIP_PIXELS / width).max(1);
    let region = move |y| Region { x: 0, y, width, height: rows.min(height - y) };
    (0..height).step_by(rows as usize).map(region)
}
