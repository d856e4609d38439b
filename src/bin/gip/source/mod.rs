//! Reading pictures of any format, and telling what of them cannot be kept.

mod colors;
mod extended_xmp;
mod format;
mod formats;
mod frames;
mod gip;
mod jpeg;
mod light;
mod metadata;
mod read;
mod stored;
mod tiff;

pub(crate) use read::Reading;
