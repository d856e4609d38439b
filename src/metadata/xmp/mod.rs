//! XMP: reading packets, what of them is safe to pass on, and changes to them.

mod edit;
mod packet;
mod safe;

pub(super) use edit::reset_orientation;
pub(super) use safe::safe;
