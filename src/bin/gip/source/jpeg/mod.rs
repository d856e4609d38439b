//! Whether a JPEG is whole, and reading those that the usual decoder reads wrong. It shows something in any
//! case, as browsers do.

mod bits;
mod decoder;
mod frame;
mod index;
mod scan;
mod segments;
mod survey;

pub(super) use decoder::{Unusual, dimensions};
pub(super) use segments::survey;
pub(super) use survey::Survey;
