//! The tool `gip`, from outside. All in one program, since the codecs of `image` are compiled into each.

mod batch;
mod batch_recovery;
mod commands;
#[path = "../common/mod.rs"]
mod common;
#[path = "../pictures/mod.rs"]
mod pictures;
mod room;

/// An Exif block with one entry, the orientation "rotate by 90 degrees".
const EXIF_ROTATE_90: &[u8] = b"MM\0\x2a\0\0\0\x08\0\x01\x01\x12\0\x03\0\0\0\x01\0\x06\0\0\0\0\0\0";
