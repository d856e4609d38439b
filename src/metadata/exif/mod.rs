//! Exif: its tags, and which of them are safe to pass on.

mod safe;
mod tags;

pub(super) use safe::safe;
pub(super) use tags::{Exif, write};
