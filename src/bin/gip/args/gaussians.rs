//! The arguments of `gip export` and `gip import`.

use std::path::PathBuf;

use clap::ValueEnum;
use image_gip::{Parameterization, Precision};

use super::limits::LimitArgs;
use super::values::{ThreadCount, number, size};
use crate::errors::WrongUsage;

/// Writes the Gaussians of a .gip file for other programs.
///
/// The extension of OUTPUT sets the format: npz, json, jsonl, ply or svg. NPZ and JSON have all numbers, exactly, those
/// of the texture's map too, and `gip import` reads them. PLY has the properties that viewers of 3D Gaussians know, to
/// about six digits; viewers draw the Gaussians over each other and do not add them, so that they show where which spots
/// are, not the picture. SVG adds radial gradients up, as near to the picture as browsers do it. What has no place in a
/// format is told. docs/gaussians.md describes the formats.
#[derive(Debug, clap::Args)]
#[command(after_help = "\
Examples:
  gip export photo.gip photo.npz
  gip export photo.gip - | head -3")]
pub(crate) struct Export {
    /// The .gip file, or `-` for standard input.
    pub(crate) input: PathBuf,
    /// The file to write, or `-` for standard output (jsonl).
    pub(crate) output: PathBuf,
    /// The format, in place of the one that the extension of OUTPUT names.
    #[arg(long, value_enum, value_name = "FORMAT")]
    pub(crate) format: Option<GaussianFormat>,
    #[command(flatten)]
    pub(crate) limits: LimitArgs,
}

/// Makes a .gip file of Gaussians of other programs, or of what `gip export` writes.
///
/// The extension of INPUT tells the format: npz, json, jsonl or ply. Nothing is fitted. A file of 3D Gaussians is looked
/// at along z, and its Gaussians are added up. What the input says of the header is taken from there, but for what
/// the options below say; without both, the kernel is quartic (of PLY exponential), the base colour black, and samples have
/// 8 bits. A texture is left out. docs/gaussians.md describes the formats.
#[derive(Debug, clap::Args)]
#[command(after_help = "\
Examples:
  gip import photo.npz photo.gip
  gip import spots.jsonl small.gip --size 640x480 --precision entropy --color-step 0.05")]
pub(crate) struct Import {
    /// The Gaussians, or `-` for standard input (jsonl).
    pub(crate) input: PathBuf,
    /// The .gip file to write, or `-` for standard output.
    pub(crate) output: PathBuf,
    /// The format, in place of the one that the extension of INPUT names.
    #[arg(long, value_enum, value_name = "FORMAT")]
    pub(crate) format: Option<GaussianFormat>,
    /// How the Gaussians are stored.
    #[arg(long, value_enum, default_value_t = StoredAs::F32)]
    pub(crate) precision: StoredAs,
    /// Bit depths of position, shape and colour with --precision packed, each from 1 to 16 [default: 12,10,6].
    #[arg(long, value_name = "P,S,C", value_parser = bits)]
    pub(crate) bits: Option<[u8; 3]>,
    /// Step of colour with --precision entropy, from 0.000001 to 1000: the difference of the amplitudes of neighbouring
    /// codes, where 1 is a full sample, times the Gaussian's size in pixels. Stronger ones are finer in position and shape
    /// as well [default: 0.02].
    #[arg(long, value_name = "S", value_parser = |text: &str| number(text, 1e-6, 1000.0))]
    pub(crate) color_step: Option<f64>,
    /// What is stored of a shape, unless with --precision entropy.
    #[arg(long, value_enum, default_value_t = Shape::Cholesky)]
    pub(crate) parameterization: Shape,
    #[command(flatten)]
    pub(crate) header: HeaderArgs,
    /// Write OUTPUT even if its name does not end in .gip.
    #[arg(long)]
    pub(crate) force: bool,
    #[command(flatten)]
    pub(crate) limits: LimitArgs,
    #[command(flatten)]
    pub(crate) threads: ThreadCount,
}

impl Import {
    /// # Errors
    /// When an option is of another precision.
    pub(crate) fn check(&self) -> Result<(), WrongUsage> {
        let wrong = |option: &str, precision: &str| {
            Err(WrongUsage(format!("{option} needs --precision {precision}")))
        };
        match self.precision {
            StoredAs::F32 | StoredAs::Entropy if self.bits.is_some() => wrong("--bits", "packed"),
            StoredAs::F32 | StoredAs::Packed if self.color_step.is_some() => {
                wrong("--color-step", "entropy")
            }
            _ => Ok(()),
        }
    }
}

/// What the header of the file says, in place of what the input says.
#[derive(Debug, clap::Args)]
#[command(next_help_heading = "Header")]
pub(crate) struct HeaderArgs {
    /// Size of the picture in pixels, in which centres and covariances are.
    #[arg(long, value_name = "WxH", value_parser = size)]
    pub(crate) size: Option<(u32, u32)>,
    /// Bits per sample, 8 or 16.
    #[arg(long, value_name = "BITS", value_parser = depth)]
    pub(crate) depth: Option<u8>,
    /// The weight of a Gaussian around its centre.
    #[arg(long, value_enum)]
    pub(crate) kernel: Option<Weight>,
    /// The largest squared Mahalanobis distance with a weight over 0, of the exponential kernel: over 0, at most 64
    /// [default: 11.082527, where the weight is 1/255].
    #[arg(long, value_name = "Q", value_parser = |text: &str| number(text, 1e-6, 64.0))]
    pub(crate) cutoff: Option<f64>,
    /// The colour that the Gaussians are added to: a sample for all channels, or one for each, from 0 to 255, or to
    /// 65535 with 16 bits.
    #[arg(long, value_name = "C,C,C", value_delimiter = ',')]
    pub(crate) base_color: Vec<u16>,
}

impl HeaderArgs {
    /// The base colour, in 1/65535 of a full sample, of a picture whose input says this depth: one number for all of the
    /// channels, if there is one; `None` if it is not given.
    ///
    /// # Errors
    /// When a sample has more bits than the picture.
    pub(crate) fn base_color(
        &self,
        depth: Option<u8>,
        channels: usize,
    ) -> Result<Option<Vec<u16>>, WrongUsage> {
        let (most, unit) =
            if self.depth.or(depth) == Some(16) { (u16::MAX, 1) } else { (255, 257) };
        if let Some(sample) = self.base_color.iter().find(|sample| **sample > most) {
            return Err(WrongUsage(format!("--base-color {sample}; it must be 0 to {most}")));
        }
        let given: Vec<u16> = self.base_color.iter().map(|sample| sample * unit).collect();
        Ok(match given[..] {
            [] => None,
            [sample] => Some(vec![sample; channels]),
            _ => Some(given),
        })
    }
}

/// A format that Gaussians are exported to.
#[derive(Clone, Copy, Debug, PartialEq, Eq, ValueEnum)]
pub(crate) enum GaussianFormat {
    /// Arrays of NumPy, as numpy.load reads them
    Npz,
    /// One JSON object
    Json,
    /// A JSON object of the header on the first line, and one of a Gaussian on each further line
    Jsonl,
    /// The PLY of viewers of 3D Gaussians
    Ply,
    /// Radial gradients; it cannot be imported
    Svg,
}

/// How the Gaussians are stored.
#[derive(Clone, Copy, Debug, ValueEnum)]
pub(crate) enum StoredAs {
    /// Packed coding with 32-bit floats, which lose nothing
    F32,
    /// Packed coding with codes of fixed bit depths, whose ranges are those of the values
    Packed,
    /// Entropy coding, rounded to its grid, for the smallest files; with the quartic kernel only
    Entropy,
}

impl From<StoredAs> for Precision {
    fn from(arg: StoredAs) -> Self {
        match arg {
            StoredAs::F32 => Self::Float,
            StoredAs::Packed => Self::Packed,
            StoredAs::Entropy => Self::Entropy,
        }
    }
}

/// What is stored of a shape.
#[derive(Clone, Copy, Debug, ValueEnum)]
pub(crate) enum Shape {
    /// The Cholesky factor of the covariance, in pixels
    Cholesky,
    /// The covariance, in square pixels
    Covariance,
    /// Two standard deviations in pixels and an angle
    RotationScale,
}

impl From<Shape> for Parameterization {
    fn from(arg: Shape) -> Self {
        match arg {
            Shape::Cholesky => Self::Cholesky,
            Shape::Covariance => Self::Covariance,
            Shape::RotationScale => Self::RotationScale,
        }
    }
}

/// The weight of a Gaussian at a squared Mahalanobis distance q.
#[derive(Clone, Copy, Debug, ValueEnum)]
pub(crate) enum Weight {
    /// (1 - q / 4)^2 for q below 4
    Quartic,
    /// exp(-q / 2) up to the cut-off
    Exponential,
}

impl Weight {
    /// The name that the formats have for it.
    pub(crate) fn name(self) -> &'static str {
        match self {
            Self::Quartic => "quartic",
            Self::Exponential => "exponential",
        }
    }
}

/// Parses `P,S,C`.
fn bits(text: &str) -> Result<[u8; 3], String> {
    let depths: Option<Vec<u8>> = text.split(',').map(|depth| depth.parse().ok()).collect();
    depths
        .and_then(|depths| depths.try_into().ok())
        .filter(|depths: &[u8; 3]| depths.iter().all(|depth| (1..=16).contains(depth)))
        .ok_or_else(|| "not three whole numbers P,S,C from 1 to 16".into())
}

/// Parses 8 or 16.
fn depth(text: &str) -> Result<u8, String> {
    text.parse()
        .ok()
        .filter(|depth| [8, 16].contains(depth))
        .ok_or_else(|| "neither 8 nor 16".into())
}
