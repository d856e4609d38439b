//! The arguments of `gip decode`.

use std::path::PathBuf;

use image_gip::Region;

use super::keep::Keep;
use super::limits::LimitArgs;
use super::values::{ThreadCount, bounds, extension, number, region, size};

/// Decodes a .gip file to a picture.
///
/// --format sets the format, and without it the extension of OUTPUT: png, tif, webp, jpg, bmp, tga, qoi,
/// gif, ico, ff, pgm, ppm, pnm or pam. On standard output it is PNG. Gray becomes RGB if the format has no gray, and
/// 16 bits become 8 if it has no more. Alpha is never dropped: a picture with alpha cannot be
/// written in a format without it. For GIF it is rounded to transparent or opaque, with a warning.
///
/// The picture is written upright: an orientation in the file's Exif is applied, and reset in Exif and XMP. Sizes
/// and regions are those of the upright picture. ICC profile and Exif are written to PNG, JPEG and WebP, to TIFF
/// the profile, to other formats nothing; XMP and texts are not written. A colour space in codes (cICP) is written
/// to PNG, and to formats with profiles as one, if there is one: not for PQ and HLG. A warning tells what was there
/// and is not written. More is in docs/metadata.md.
#[derive(Debug, clap::Args)]
#[command(
    allow_negative_numbers = true,
    after_help = "\
Examples:
  gip decode photo.gip thumb.jpg --fit 256
  gip decode photo.gip double.png --scale 2
  gip decode photo.gip detail.png --scale 4 --region 800,600,400,300
  gip decode photo.gip - | display -"
)]
pub(crate) struct Decode {
    /// The .gip file, or `-` for standard input.
    pub(crate) input: PathBuf,
    /// The picture to write, or `-` for standard output.
    pub(crate) output: PathBuf,
    /// Render F times as wide and high, from 0.001 to 1000. The Gaussians themselves are scaled; no
    /// pixels are resampled.
    #[arg(long, value_name = "F", conflicts_with = "size",
          value_parser = |text: &str| number(text, 0.001, 1000.0))]
    pub(crate) scale: Option<f64>,
    /// Render the whole picture at W by H pixels, which it has when it is upright.
    #[arg(long, value_name = "WxH", value_parser = size)]
    pub(crate) size: Option<(u32, u32)>,
    /// Render the whole picture as large as fits into SIZE: one number for both sides, or WxH.
    ///
    /// Width and height keep their ratio, and pictures are not enlarged.
    #[arg(long, value_name = "SIZE", value_parser = bounds, conflicts_with_all = ["scale", "size"])]
    pub(crate) fit: Option<(u32, u32)>,
    /// Render only a region: the W by H pixels whose first one is (X, Y). Coordinates are pixels of
    /// the upright output, after --scale, --size or --fit.
    #[arg(long, value_name = "X,Y,W,H", allow_hyphen_values = true, value_parser = region)]
    pub(crate) region: Option<Region>,
    /// The format of OUTPUT, as an extension, whatever the name of OUTPUT is.
    #[arg(long, value_name = "EXT", value_parser = extension)]
    pub(crate) format: Option<String>,
    /// Leave out the picture's texture: the noise in place of sand, water or leaves. The picture is then
    /// smoother, and nearer to the source sample by sample.
    #[arg(long)]
    pub(crate) no_texture: bool,
    /// If the file is truncated or damaged, write the picture of the Gaussians that can be decoded,
    /// and print a warning, instead of failing.
    #[arg(long)]
    pub(crate) allow_partial: bool,
    #[command(flatten)]
    pub(crate) keep: Keep,
    #[command(flatten)]
    pub(crate) limits: LimitArgs,
    #[command(flatten)]
    pub(crate) threads: ThreadCount,
}
