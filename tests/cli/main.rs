//! The tool `gip`, from outside. All in one program, since the codecs of `image` are compiled into each.

mod batch;
mod batch_inputs;
mod batch_recovery;
mod batch_shards;
mod colors;
mod commands;
#[path = "../common/mod.rs"]
mod common;
mod damage;
mod frames;
mod gaussians;
mod jpeg;
mod jpeg_kinds;
mod limits;
mod metadata;
mod orientation;
#[path = "../pictures/mod.rs"]
mod pictures;
mod prefix;
mod room;
mod square;
mod tiff;
mod transform;
