//! Reading pictures of any format, and telling what of them cannot be kept.

mod extended_xmp;
mod frames;
mod metadata;
mod read;

pub(crate) use read::{dimensions, read};
