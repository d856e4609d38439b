//! Reading pictures of any format, and telling what of them cannot be kept.

mod frames;
mod read;

pub(crate) use read::{dimensions, read};
