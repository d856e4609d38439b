//! TIFF, which `image` reads with few of its colours.

mod colors;
mod pages;
mod read;
mod samples;
mod strips;
mod tags;

pub(super) use read::{dimensions, read};
