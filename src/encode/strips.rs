//! Division of a large picture into strips.

use crate::region::Region;

/// Most pixels of a strip. It bounds the memory of a rendering to floats, and the time from one
/// poll of the observer to the next.
const STRIP_PIXELS: u32 = 1 << 20;

/// The strips of a picture from top to bottom, each of whole rows.
pub(crate) fn strips(width: u32, height: u32) -> impl Iterator<Item = Region> {
    let rows = (STRIP_PIXELS / width).max(1);
    let region = move |y| Region { x: 0, y, width, height: rows.min(height - y) };
    (0..height).step_by(rows as usize).map(region)
}
