//! TIFF, which `image` reads with few of its colours.

mod colors;
mod read;
mod samples;
mod tags;

pub(super) use read::{dimensions, read};
