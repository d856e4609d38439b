//! Reading pictures of any format, and telling what of them cannot be kept.

mod bmp;
mod clipping;
mod colors;
mod exr;
mod extended_xmp;
mod fault;
mod format;
mod formats;
mod frames;
mod gip;
mod hdr;
mod ico;
mod jpeg;
mod light;
mod metadata;
mod png_chunks;
mod read;
mod screen;
mod square;
mod stored;
mod tiff;
mod unread;
mod webp;

pub(crate) use format::is_picture;
pub(crate) use read::Reading;
pub(crate) use unread::is_unread_picture;
