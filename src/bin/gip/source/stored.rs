//! A picture as its file has it.

use image::DynamicImage;
use image_gip::{Metadata, Orientation};

/// A picture before it is turned upright, with all metadata that its file has.
#[derive(Debug)]
pub(super) struct Stored {
    pub(super) image: DynamicImage,
    pub(super) orientation: Orientation,
    pub(super) metadata: Metadata,
    /// What the file has and the picture lacks, a sentence each.
    pub(super) warnings: Vec<String>,
}

/// What is said of a damaged picture that is taken all the same.
pub(super) fn partly(damage: impl std::fmt::Display) -> String {
    format!("{damage}; what could be read is taken")
}

/// What is said of channels that mean neither colours nor alpha, so many of all.
pub(super) fn left_out(channels: usize, all: usize) -> Option<String> {
    (channels > 0).then(|| {
        format!(
            "what it has beside colours and alpha ({channels} of its {all} channels) is left out"
        )
    })
}
