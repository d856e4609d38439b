//! The arguments of the command line, with their help texts.

use core::num::NonZeroU32;
use std::path::PathBuf;

use clap::{Parser, Subcommand, ValueEnum};
use image_gip::{Precision, Region, Target, Tune};
use rayon::{ThreadPool, ThreadPoolBuildError, ThreadPoolBuilder};

/// Encodes, decodes, inspects and compares .gip files: pictures made of 2D Gaussians.
#[derive(Debug, Parser)]
#[command(
    version,
    arg_required_else_help = false,
    after_help = "\
Examples:
  gip encode photo.jpg photo.gip                     a good quality
  gip encode photo.png small.gip --size 20000        a file of 20,000 bytes
  gip decode photo.gip photo.png                     back to pixels
  gip decode photo.gip thumb.png --size 160x120      a thumbnail, rendered at that size
  gip info photo.gip                                 what the file contains
  gip compare photo.png photo.gip                    how much they differ

In place of any file, `-` is standard input or standard output.
Exit status: 0 for success, 1 for failure, 2 for wrong usage."
)]
pub(crate) struct Args {
    #[command(subcommand)]
    pub(crate) command: Command,
}

#[derive(Debug, Subcommand)]
pub(crate) enum Command {
    Encode(Encode),
    Decode(Decode),
    Info(Info),
    Compare(Compare),
}

/// Encodes a picture as a .gip file.
///
/// Reads PNG, JPEG, WebP, TIFF, GIF, BMP, Netpbm, QOI, TGA, DDS, ICO, farbfeld, OpenEXR, Radiance
/// HDR and .gip, with 8 or 16 bits per sample, gray or RGB, with or without alpha. Gray stays gray.
/// Alpha is dropped if every pixel is opaque. Samples that are floats (OpenEXR, HDR) are taken as
/// linear light, clipped, and stored as 16-bit sRGB. An Exif orientation is applied to the pixels,
/// and the tag in the stored Exif is reset. ICC profile, Exif and XMP are stored.
#[derive(Debug, clap::Args)]
#[command(
    allow_negative_numbers = true,
    after_help = "\
At most one of --gaussians, --bpp, --size, --psnr, --quality and --lambda may be given. If the target cannot
be met, the file comes as close as possible, and the report gives the reason."
)]
pub(crate) struct Encode {
    /// The picture, or `-` for standard input.
    pub(crate) input: PathBuf,
    /// The .gip file to write, or `-` for standard output.
    pub(crate) output: PathBuf,
    #[command(flatten)]
    pub(crate) target: TargetArgs,
    /// What to minimize for the size of the file.
    #[arg(long, value_enum, default_value_t = TuneArg::Visual)]
    pub(crate) tune: TuneArg,
    /// Time to spend, from 1 (least) to 9 (most).
    #[arg(long, value_name = "E", default_value_t = 5,
          value_parser = clap::value_parser!(u8).range(1..=9))]
    pub(crate) effort: u8,
    /// How the Gaussians are stored.
    #[arg(long, value_enum, default_value_t = PrecisionArg::Entropy)]
    pub(crate) precision: PrecisionArg,
    /// Write OUTPUT even if its name does not end in .gip.
    #[arg(long)]
    pub(crate) force: bool,
    /// Seed of the random numbers; the same picture, options and seed give the same file.
    #[arg(long, value_name = "S", default_value_t = 0)]
    pub(crate) seed: u64,
    #[command(flatten)]
    pub(crate) threads: ThreadCount,
    /// Print the report as one JSON object. It goes to standard error if OUTPUT is `-`.
    ///
    /// Fields: width, height, gaussians (their number), bytes, bpp (bits per pixel of the whole
    /// file), psnr (in dB, of the decoded file), psnr_float (in dB, before rounding to samples), quality
    /// (an estimate of SSIMULACRA2, from 0 to 100), iterations (of training), evaluations (of the kernel, during training), seconds, peak_memory
    /// (in bytes), shortfall (null, or why the target was not met). An infinite PSNR, of an exact
    /// copy, is given as 999.
    #[arg(long)]
    pub(crate) json: bool,
}

/// The target that the file has to meet. Without any of them it is --quality 75.
#[derive(Debug, clap::Args)]
#[group(multiple = false)]
pub(crate) struct TargetArgs {
    /// At most N Gaussians, from 1 to 4194304.
    #[arg(long, help_heading = "Targets", value_name = "N",
          value_parser = clap::value_parser!(u32).range(1..=4_194_304))]
    gaussians: Option<u32>,
    /// A file of at most B bits per pixel, from 0.0001 to 1000.
    #[arg(long, help_heading = "Targets", value_name = "B",
          value_parser = |text: &str| number(text, 0.0001, 1000.0))]
    bpp: Option<f64>,
    /// A file of at most BYTES bytes, from 1 to 1073741824.
    #[arg(long, help_heading = "Targets", value_name = "BYTES",
          value_parser = clap::value_parser!(u64).range(1..))]
    size: Option<u64>,
    /// A PSNR of the decoded file of DB decibels, from 1 to 120.
    #[arg(long, help_heading = "Targets", value_name = "DB",
          value_parser = |text: &str| number(text, 1.0, 120.0))]
    psnr: Option<f64>,
    /// A visual quality from 0 (smallest) to 100 (best), on the scale of SSIMULACRA2 [default: 75].
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
    pub(crate) fn target(&self) -> Target {
        self.gaussians
            .map(Target::Gaussians)
            .or(self.bpp.map(Target::BitsPerPixel))
            .or(self.size.map(Target::Bytes))
            .or(self.psnr.map(Target::Psnr))
            .or(self.quality.map(Target::Quality))
            .or(self.lambda.map(Target::Lambda))
            .unwrap_or_default()
    }
}

/// What the encoder minimizes.
#[derive(Clone, Copy, Debug, ValueEnum)]
pub(crate) enum TuneArg {
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
pub(crate) enum PrecisionArg {
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

#[derive(Debug, clap::Args)]
pub(crate) struct ThreadCount {
    /// Number of threads, from 1 to 1024; the result does not depend on it [default: one per
    /// core].
    #[arg(long = "threads", value_name = "T",
          value_parser = clap::value_parser!(u16).range(1..=1024))]
    count: Option<u16>,
}

impl ThreadCount {
    /// The thread pool in which the work is done.
    pub(crate) fn pool(&self) -> Result<ThreadPool, ThreadPoolBuildError> {
        ThreadPoolBuilder::new().num_threads(self.count.map_or(0, usize::from)).build()
    }
}

/// Decodes a .gip file to a picture.
///
/// The extension of OUTPUT sets the format: png, tif, webp, jpg, bmp, tga, qoi, gif, ico, ff, pgm,
/// ppm, pnm or pam. On standard output it is PNG. Gray becomes RGB if the format has no gray, and
/// 16 bits become 8 if it has no more. Alpha is never dropped: a picture with alpha cannot be
/// written in a format without it. ICC profile and Exif are written to formats that support them
/// (PNG, JPEG, WebP; in TIFF only the profile). An orientation in the file's Exif is applied.
#[derive(Debug, clap::Args)]
#[command(
    allow_negative_numbers = true,
    after_help = "\
Examples:
  gip decode photo.gip double.png --scale 2
  gip decode photo.gip detail.png --scale 4 --region 800,600,400,300
  gip decode photo.gip - | display -"
)]
pub(crate) struct Decode {
    /// The .gip file, or `-` for standard input.
    pub(crate) input: PathBuf,
    /// The picture to write, or `-` for standard output (PNG).
    pub(crate) output: PathBuf,
    /// Render F times as wide and high, from 0.001 to 1000. The Gaussians themselves are scaled; no
    /// pixels are resampled.
    #[arg(long, value_name = "F", conflicts_with = "size",
          value_parser = |text: &str| number(text, 0.001, 1000.0))]
    pub(crate) scale: Option<f64>,
    /// Render the whole picture at W by H pixels.
    #[arg(long, value_name = "WxH", value_parser = size)]
    pub(crate) size: Option<(u32, u32)>,
    /// Render only a region: the W by H pixels whose first one is (X, Y). Coordinates are pixels of
    /// the output, after --scale or --size.
    #[arg(long, value_name = "X,Y,W,H", value_parser = region)]
    pub(crate) region: Option<Region>,
    /// If the file is truncated or damaged, write the picture of the Gaussians that can be decoded,
    /// and print a warning, instead of failing.
    #[arg(long)]
    pub(crate) allow_partial: bool,
    #[command(flatten)]
    pub(crate) threads: ThreadCount,
}

/// Shows what a .gip file contains.
#[derive(Debug, clap::Args)]
pub(crate) struct Info {
    /// The .gip file, or `-` for standard input.
    pub(crate) file: PathBuf,
    /// Print one JSON object: the size of the file, all fields of the header, number and bytes of
    /// the chunks of each type, bits per Gaussian by attribute, and sizes of the metadata.
    ///
    /// `bits_per_gaussian.coded` counts the framing of the chunks too. `components` has the
    /// quantizer of each component of the packed coding; with the entropy coding it is empty.
    /// `lattice_steps` has the quantization steps of the entropy coding; with the packed coding it
    /// is null.
    #[arg(long)]
    pub(crate) json: bool,
}

/// Measures how much two pictures differ.
///
/// Each may be a .gip file or any picture that `gip encode` reads. They must have the same size. An
/// alpha channel that is opaque everywhere is ignored. Both are converted to a colour model with the
/// channels of both, and to the greater depth: gray becomes RGB, missing alpha becomes opaque, 8
/// bits become 16. PSNR and the largest error are over all samples of all channels. MS-SSIM is the
/// mean over the channels, on up to five scales, as the size allows.
#[derive(Debug, clap::Args)]
pub(crate) struct Compare {
    /// A picture, or `-` for standard input.
    pub(crate) a: PathBuf,
    /// Another one.
    pub(crate) b: PathBuf,
    /// Print one JSON object: width, height, channels, depth (bits per sample), psnr (in dB),
    /// ms_ssim, max_abs_error (in quantization steps of that depth). The PSNR of identical
    /// pictures, which is infinite, is given as 999.
    #[arg(long)]
    pub(crate) json: bool,
}

/// Parses a number from `least` to `most`.
fn number(text: &str, least: f64, most: f64) -> Result<f64, String> {
    text.parse()
        .ok()
        .filter(|number| (least..=most).contains(number))
        .ok_or_else(|| format!("not a number from {least} to {most}"))
}

/// Parses `WxH`.
fn size(text: &str) -> Result<(u32, u32), String> {
    text.split_once('x')
        .and_then(|(width, height)| {
            let side = |text: &str| text.parse().ok().map(NonZeroU32::get);
            Some((side(width)?, side(height)?))
        })
        .ok_or_else(|| "not two positive whole numbers such as 640x480".into())
}

/// Parses `X,Y,W,H`.
fn region(text: &str) -> Result<Region, String> {
    let numbers: Result<Vec<u32>, _> = text.split(',').map(str::parse).collect();
    match numbers.as_deref() {
        Ok(&[x, y, width, height]) if width > 0 && height > 0 => Ok(Region { x, y, width, height }),
        _ => Err("not four whole numbers X,Y,W,H with W and H of at least 1".into()),
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use clap::CommandFactory;

    #[test]
    fn the_definition_is_consistent() {
        Args::command().debug_assert();
    }

    #[test]
    fn help_explains_every_argument() {
        let mut tool = Args::command();
        tool.build();
        let mut commands: Vec<clap::Command> = tool.get_subcommands().cloned().collect();
        assert_eq!(commands.len(), 4 + 1, "four and `help`");
        commands.push(tool);
        for mut command in commands {
            let help = command.render_long_help().to_string();
            let words = help.split_whitespace().collect::<Vec<_>>().join(" ");
            let names = |text: &str| {
                assert!(words.contains(text), "{}: {text} is missing:\n{help}", command.get_name());
            };
            names(&command.get_about().expect("a text").to_string());
            for argument in command.get_arguments() {
                let text = argument.get_long_help().or(argument.get_help()).expect("a text");
                names(&text.to_string().split_whitespace().collect::<Vec<_>>().join(" "));
                if let Some(long) = argument.get_long() {
                    names(&format!("--{long}"));
                }
                if !argument.get_action().takes_values() {
                    continue;
                }
                for name in argument.get_value_names().expect("it takes values") {
                    names(name);
                }
                for default in argument.get_default_values() {
                    names(&format!("[default: {}]", default.display()));
                }
                for value in argument.get_possible_values() {
                    let text = value.get_help().expect("a text");
                    names(&format!("- {}: {text}", value.get_name()));
                }
            }
        }
    }

    #[test]
    fn targets() {
        let target = |flags: &[&str]| {
            let args = [&["gip", "encode", "a", "b"], flags].concat();
            match Args::try_parse_from(args).map(|args| args.command) {
                Ok(Command::Encode(args)) => Some(args.target.target()),
                _ => None,
            }
        };
        assert_eq!(target(&[]), Some(Target::Auto));
        assert_eq!(target(&["--gaussians", "9"]), Some(Target::Gaussians(9)));
        assert_eq!(target(&["--bpp", "0.5"]), Some(Target::BitsPerPixel(0.5)));
        assert_eq!(target(&["--size", "900"]), Some(Target::Bytes(900)));
        assert_eq!(target(&["--psnr", "31.5"]), Some(Target::Psnr(31.5)));
        assert_eq!(target(&["--quality", "0"]), Some(Target::Quality(0.0)));
        assert_eq!(target(&["--lambda", "700"]), Some(Target::Lambda(700.0)));
        assert_eq!(target(&["--quality", "50", "--psnr", "30"]), None);
    }

    #[test]
    fn sizes_and_regions() {
        assert_eq!(size("640x480"), Ok((640, 480)));
        assert_eq!(region("1,2,3,4"), Ok(Region { x: 1, y: 2, width: 3, height: 4 }));
        for text in ["", "x", "640", "0x5", "5x0", "-1x5", "5x5x5", "5X5"] {
            assert!(size(text).is_err(), "{text}");
        }
        for text in ["", "1,2,3", "1,2,3,0", "1,2,0,3", "1,2,3,4,5", "-1,2,3,4"] {
            assert!(region(text).is_err(), "{text}");
        }
    }
}
