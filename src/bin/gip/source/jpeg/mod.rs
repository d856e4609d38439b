//! Whether a JPEG is whole. The decoder shows something in any case, as browsers do.

mod bits;
mod frame;
mod scan;
mod segments;

pub(super) use segments::damage;
