//! XMP: reading packets, what of them is safe to pass on, and changes to them.

mod extension;
mod orientation;
mod packet;
mod safe;

pub(super) use extension::{join, name};
pub(super) use orientation::reset_orientation;
pub(super) use safe::safe;
