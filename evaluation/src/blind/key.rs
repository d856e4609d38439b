//! Which picture of a triplet is which.

use std::fmt;
use std::path::Path;

use anyhow::{Context, Result};
use serde::{Deserialize, Serialize};

/// What is at the side of the original.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord, Serialize, Deserialize)]
#[serde(rename_all = "lowercase")]
pub(super) enum Shown {
    /// Ours, with texture as by default.
    Textured,
    /// Ours without texture.
    Plain,
    Avif,
}

/// A row of the key.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub(super) struct Triplet {
    /// The name of its file without `.png`.
    pub(super) triplet: String,
    pub(super) picture: String,
    /// What the picture shows; empty if nobody said.
    pub(super) content: String,
    /// The crop's upper left corner and size, in the picture's pixels.
    pub(super) x: u32,
    pub(super) y: u32,
    pub(super) width: u32,
    pub(super) height: u32,
    /// How many pixels wide a pixel is shown.
    pub(super) scale: u32,
    /// Bits per pixel that were asked for.
    pub(super) bpp: f64,
    pub(super) left: Shown,
    pub(super) right: Shown,
    /// Bits per pixel of the files.
    pub(super) left_bpp: f64,
    pub(super) right_bpp: f64,
    /// The version of our codec.
    pub(super) version: String,
}

impl Triplet {
    /// The size of the smaller file divided by that of the larger one.
    pub(super) fn size_ratio(&self) -> f64 {
        self.left_bpp.min(self.right_bpp) / self.left_bpp.max(self.right_bpp)
    }

    /// What the textured version is compared with.
    pub(super) fn other(&self) -> Shown {
        if self.left == Shown::Textured { self.right } else { self.left }
    }
}

impl fmt::Display for Shown {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str(match self {
            Self::Textured => "textured",
            Self::Plain => "plain",
            Self::Avif => "AVIF",
        })
    }
}

pub(super) fn write(path: &Path, triplets: &[Triplet]) -> Result<()> {
    let mut writer =
        csv::Writer::from_path(path).with_context(|| format!("cannot write {}", path.display()))?;
    triplets.iter().try_for_each(|triplet| writer.serialize(triplet))?;
    Ok(writer.flush()?)
}

pub(super) fn read(path: &Path) -> Result<Vec<Triplet>> {
    let unreadable = || format!("cannot read {}", path.display());
    let mut reader = csv::Reader::from_path(path).with_context(unreadable)?;
    reader.deserialize().collect::<Result<_, _>>().with_context(unreadable)
}
