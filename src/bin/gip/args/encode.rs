//! The arguments of `gip encode`.

use std::path::PathBuf;

use clap::ValueEnum;
use image_gip::{Encoder, Precision, Target, Tune};

use super::keep::Keep;
use super::limits::LimitArgs;
use super::values::{ThreadCount, number};
use crate::errors::WrongUsage;

/// Encodes a picture as a .gip file.
///
/// Reads PNG, JPEG, WebP, TIFF, GIF, BMP, Netpbm, QOI, TGA, DDS (DXT1, 3 and 5), ICO, farbfeld, OpenEXR, Radiance
/// HDR and .gip, with 8 or 16 bits per sample, gray or RGB, with or without alpha. Gray stays gray.
/// Alpha is dropped if every pixel is opaque. Of several pictures, the first is taken; of an icon's, the one
/// of most bits per pixel, and of these the largest; of OpenEXR's layers, the first that is RGB. Samples that are
/// floats are clipped and stored with 16 bits: in OpenEXR and HDR they are linear light, and become
/// sRGB; in TIFF they are from 0 to 1, like integers from 0 to their largest. CMYK, YCbCr and CIELAB
/// become RGB. A .gip is read without its texture, which would take many bytes as detail.
///
/// Colours: an ICC profile is kept, if it is one of gray or RGB, and so is what a PNG says by cICP, mDCV and cLLI,
/// PQ and HLG included. What it says by gAMA and cHRM becomes a profile, or sRGB if it is only a gamma; so does the
/// Adobe RGB of a camera's Exif. What cannot be kept is told. Of PQ, the quality and what shows to the eye are those
/// of the picture as a display of standard range shows it.
///
/// The picture is stored upright: an Exif orientation is applied to the pixels, and reset in Exif and XMP. ICC
/// profile, Exif and XMP are stored; of the tags of a TIFF those of description, artist, copyright, camera, dates
/// and resolution, as Exif. Texts of PNG and IPTC are not read, nor are other resolutions, but pixels that are not
/// square are told. More is in docs/metadata.md.
#[derive(Debug, clap::Args)]
#[command(
    allow_negative_numbers = true,
    after_help = "\
At most one of --gaussians, --bpp, --bytes, --psnr, --quality and --lambda may be given. If the target cannot \
be met, the file comes as close as possible, and the report gives the reason. A size counts the metadata: one \
that the file would have without them, but not with them, is an error."
)]
pub(crate) struct Encode {
    /// The picture, or `-` for standard input.
    pub(crate) input: PathBuf,
    /// The .gip file to write, or `-` for standard output.
    pub(crate) output: PathBuf,
    #[command(flatten)]
    pub(crate) encoder: EncoderArgs,
    /// Write OUTPUT even if its name does not end in .gip.
    #[arg(long)]
    pub(crate) force: bool,
    /// If INPUT is truncated or damaged, encode what can be read of it, and print a warning, instead of
    /// failing.
    ///
    /// PNG, JPEG, TIFF, GIF, .gip and formats without compression are shown as far as they go. Damage
    /// in the middle of a JPEG is noticed where it changes how many data the picture takes. WebP, GIF, BMP, Netpbm,
    /// TGA, QOI, DDS, farbfeld, HDR, and most of TIFF, ICO and OpenEXR have no checksum either: damage in the middle
    /// of them is noticed only where what follows cannot be decoded.
    #[arg(long)]
    pub(crate) allow_partial: bool,
    #[command(flatten)]
    pub(crate) limits: LimitArgs,
    #[command(flatten)]
    pub(crate) keep: Keep,
    #[command(flatten)]
    pub(crate) threads: ThreadCount,
    /// Print the report as one JSON object. It goes to standard error if OUTPUT is `-`.
    ///
    /// Fields: width, height, gaussians (their number), bytes, bpp (bits per pixel of the whole
    /// file), psnr (in dB, of the decoded file), psnr_float (in dB, before rounding to samples), quality
    /// (an estimate of SSIMULACRA2, from 0 to 100; it and both PSNRs are those of the picture without its
    /// texture), texture_gaussians and texture_bytes (what the texture takes), iterations (of training), evaluations (of the kernel, during training), seconds, peak_memory
    /// (in bytes), shortfall (null, or why the target was not met), warnings (an array of what of the input is
    /// lost, such as all frames but the first). An infinite PSNR, of an exact
    /// copy, is given as 999.
    #[arg(long)]
    pub(crate) json: bool,
}

/// The options of the encoder.
#[derive(Debug, clap::Args)]
pub(crate) struct EncoderArgs {
    #[command(flatten)]
    target: TargetArgs,
    /// What to minimize for the size of the file.
    #[arg(long, value_enum, default_value_t = TuneArg::Visual)]
    tune: TuneArg,
    /// Time to spend, from 1 (least) to 7 (most).
    #[arg(long, value_name = "E", default_value_t = 4,
          value_parser = clap::value_parser!(u8).range(1..=7))]
    effort: u8,
    /// Strength of the texture, from 0 (none) to 100: with 50, about as strong as in the picture. It takes the
    /// place of fine irregular detail that the file has no bits for, such as sand, water and leaves. Files of
    /// --tune psnr and of the packed coding have none.
    #[arg(long, value_name = "T", default_value_t = 50,
          value_parser = clap::value_parser!(u8).range(0..=100))]
    texture: u8,
    /// Let the first layer make a file of at most N bytes, from 80 to 65536, as a placeholder: `gip prefix` cuts it
    /// off. Colour space, ICC profile and orientation are in it; all other metadata are stored after it. Not with
    /// --precision packed or f32, whose layers have the usual size.
    #[arg(long, value_name = "N", value_parser = clap::value_parser!(u32).range(80..=65_536))]
    first_layer: Option<u32>,
    /// How the Gaussians are stored.
    #[arg(long, value_enum, default_value_t = PrecisionArg::Entropy)]
    precision: PrecisionArg,
    /// Seed of the random numbers; the same picture, options and seed give the same file.
    #[arg(long, value_name = "S", default_value_t = 0)]
    seed: u64,
    /// Keep colours where alpha is 0. By default what does not show takes the colours around it: the file
    /// is smaller, and scaled pictures have no fringes.
    #[arg(long)]
    keep_invisible: bool,
}

impl EncoderArgs {
    /// The arguments above and the group of the targets, for what excludes them. The group that
    /// `clap` makes of a struct is empty if another struct is flattened into it.
    pub(super) const IDS: [&str; 8] = [
        "TargetArgs",
        "tune",
        "effort",
        "texture",
        "first_layer",
        "precision",
        "seed",
        "keep_invisible",
    ];

    /// # Errors
    /// When two options exclude each other.
    pub(crate) fn encoder(&self) -> Result<Encoder, WrongUsage> {
        if self.first_layer.is_some() && !matches!(self.precision, PrecisionArg::Entropy) {
            let text = "--first-layer cannot be used with --precision packed or f32, whose layers have \
                        the usual size";
            return Err(WrongUsage(text.into()));
        }
        let encoder = Encoder::new()
            .with_target(self.target.target())
            .with_tune(self.tune.into())
            .with_effort(self.effort)
            .with_texture(self.texture)
            .with_first_layer(self.first_layer)
            .with_precision(self.precision.into())
            .with_seed(self.seed)
            .with_keep_invisible(self.keep_invisible);
        Ok(encoder)
    }
}

/// The target that the file has to meet. Without any of them it is --quality 75.
#[derive(Debug, clap::Args)]
#[group(multiple = false)]
struct TargetArgs {
    /// At most N Gaussians, from 1 to 4194304.
    #[arg(long, help_heading = "Targets", value_name = "N",
          value_parser = clap::value_parser!(u32).range(1..=4_194_304))]
    gaussians: Option<u32>,
    /// A file of at most B bits per pixel, from 0.000001 to 1000000.
    #[arg(long, help_heading = "Targets", value_name = "B",
          value_parser = |text: &str| number(text, 1e-6, 1e6))]
    bpp: Option<f64>,
    /// A file of at most N bytes, from 1 to 1073741824.
    #[arg(long, help_heading = "Targets", value_name = "N",
          value_parser = clap::value_parser!(u64).range(1..=1 << 30))]
    bytes: Option<u64>,
    /// A PSNR of the decoded file without its texture of DB decibels, from 1 to 120.
    #[arg(long, help_heading = "Targets", value_name = "DB",
          value_parser = |text: &str| number(text, 1.0, 120.0))]
    psnr: Option<f64>,
    /// A visual quality from 0 (smallest) to 100 (best), on the scale of SSIMULACRA2, of the picture without
    /// its texture; no more than 97 is aimed at [default: 75].
    #[arg(long, help_heading = "Targets", value_name = "Q",
          value_parser = |text: &str| number(text, 0.0, 100.0))]
    quality: Option<f64>,
    /// A Lagrange multiplier from 0.01 to 1000000: the squared error that a bit must save, where
    /// samples are 0 to 255. For comparisons over many pictures.
    #[arg(long, help_heading = "Targets", value_name = "L",
          value_parser = |text: &str| number(text, 0.01, 1e6))]
    lambda: Option<f64>,
}

impl TargetArgs {
    fn target(&self) -> Target {
        self.gaussians
            .map(Target::Gaussians)
            .or(self.bpp.map(Target::BitsPerPixel))
            .or(self.bytes.map(Target::Bytes))
            .or(self.psnr.map(Target::Psnr))
            .or(self.quality.map(Target::Quality))
            .or(self.lambda.map(Target::Lambda))
            .unwrap_or_default()
    }
}

/// What the encoder minimizes.
#[derive(Clone, Copy, Debug, ValueEnum)]
enum TuneArg {
    /// The error that a person sees
    Visual,
    /// The squared error, for the highest PSNR
    Psnr,
}

impl From<TuneArg> for Tune {
    fn from(arg: TuneArg) -> Self {
        match arg {
            TuneArg::Visual => Self::Visual,
            TuneArg::Psnr => Self::Psnr,
        }
    }
}

/// How the Gaussians are stored.
#[derive(Clone, Copy, Debug, ValueEnum)]
enum PrecisionArg {
    /// Packed coding with 32-bit floats: the fitted values themselves; files several times as large
    F32,
    /// Packed coding: codes of fixed bit depths, after quantization-aware training
    Packed,
    /// Entropy coding: codes chosen by rate-distortion optimization; the smallest files
    Entropy,
}

impl From<PrecisionArg> for Precision {
    fn from(arg: PrecisionArg) -> Self {
        match arg {
            PrecisionArg::F32 => Self::Float,
            PrecisionArg::Packed => Self::Packed,
            PrecisionArg::Entropy => Self::Entropy,
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use clap::Parser;

    #[derive(Debug, Parser)]
    struct Line {
        #[command(flatten)]
        target: TargetArgs,
    }

    #[test]
    fn targets() {
        let target = |flags: &[&str]| {
            let line = Line::try_parse_from([&["gip"], flags].concat());
            line.ok().map(|line| line.target.target())
        };
        assert_eq!(target(&[]), Some(Target::Auto));
        assert_eq!(target(&["--gaussians", "9"]), Some(Target::Gaussians(9)));
        assert_eq!(target(&["--bpp", "0.5"]), Some(Target::BitsPerPixel(0.5)));
        assert_eq!(target(&["--bytes", "900"]), Some(Target::Bytes(900)));
        assert_eq!(target(&["--psnr", "31.5"]), Some(Target::Psnr(31.5)));
        assert_eq!(target(&["--quality", "0"]), Some(Target::Quality(0.0)));
        assert_eq!(target(&["--lambda", "700"]), Some(Target::Lambda(700.0)));
        assert_eq!(target(&["--quality", "50", "--psnr", "30"]), None);
    }
}
