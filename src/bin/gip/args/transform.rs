//! The arguments of `gip transform`.

use std::path::PathBuf;

use clap::ValueEnum;
use image_gip::{Orientation, Region};

use super::keep::Keep;
use super::limits::LimitArgs;
use super::values::{ThreadCount, region};

/// Turns, mirrors or crops a .gip file without encoding it again.
///
/// The Gaussians are moved and turned, and nothing is fitted. The picture is first made upright, as it is shown; what
/// Exif and XMP say of that is reset. Then it is cropped, then rotated, and then mirrored.
///
/// Floats stay exact, up to the rounding of floats. An entropy-coded file keeps its quantization grid, and Gaussians that
/// are on it afterwards are exact: all of a picture that is mirrored or turned by 180 degrees, if no position interval
/// exceeds the largest power of two that divides its sides. The others are rounded, and the difference is told. If one
/// has no code, as after a crop that leaves its centre far outside, floats are stored. They are for packed files, too.
/// Texture goes along, with other noise.
#[derive(Debug, clap::Args)]
#[command(after_help = "\
Examples:
  gip transform photo.gip turned.gip --rotate 90
  gip transform photo.gip part.gip --crop 200,100,640,480 --flip horizontal")]
pub(crate) struct Transform {
    /// The .gip file, or `-` for standard input.
    pub(crate) input: PathBuf,
    /// The .gip file to write, or `-` for standard output.
    pub(crate) output: PathBuf,
    /// Keep only the W by H pixels whose first one is (X, Y), in pixels of the upright picture.
    #[arg(long, value_name = "X,Y,W,H", allow_hyphen_values = true, value_parser = region)]
    pub(crate) crop: Option<Region>,
    /// Rotate clockwise by so many degrees.
    #[arg(long, value_name = "DEGREES", value_enum)]
    pub(crate) rotate: Option<Rotation>,
    /// Mirror the picture.
    #[arg(long, value_name = "AXIS", value_enum)]
    pub(crate) flip: Option<Flip>,
    /// Write OUTPUT even if its name does not end in .gip.
    #[arg(long)]
    pub(crate) force: bool,
    #[command(flatten)]
    pub(crate) keep: Keep,
    #[command(flatten)]
    pub(crate) limits: LimitArgs,
    #[command(flatten)]
    pub(crate) threads: ThreadCount,
}

/// A rotation, clockwise.
#[derive(Clone, Copy, Debug, ValueEnum)]
pub(crate) enum Rotation {
    /// A quarter of a turn
    #[value(name = "90")]
    Quarter,
    /// Half of a turn
    #[value(name = "180")]
    Half,
    /// Three quarters of a turn
    #[value(name = "270")]
    ThreeQuarters,
}

/// What is exchanged when a picture is mirrored.
#[derive(Clone, Copy, Debug, ValueEnum)]
pub(crate) enum Flip {
    /// Left and right
    Horizontal,
    /// Top and bottom
    Vertical,
}

impl Transform {
    /// How the upright picture is turned.
    pub(crate) fn turn(&self) -> Orientation {
        let rotation = match self.rotate {
            None => Orientation::NoTransforms,
            Some(Rotation::Quarter) => Orientation::Rotate90,
            Some(Rotation::Half) => Orientation::Rotate180,
            Some(Rotation::ThreeQuarters) => Orientation::Rotate270,
        };
        rotation.then(match self.flip {
            None => Orientation::NoTransforms,
            Some(Flip::Horizontal) => Orientation::FlipHorizontal,
            Some(Flip::Vertical) => Orientation::FlipVertical,
        })
    }
}
