//! What the command line accepts.

use core::num::NonZeroU32;
use std::path::PathBuf;

use clap::{Parser, Subcommand, ValueEnum};
use image_gip::{Precision, Region, Target};
use rayon::{ThreadPool, ThreadPoolBuildError, ThreadPoolBuilder};

/// Pictures as a few thousand 2D Gaussians: encodes, decodes, inspects and compares .gip files.
#[derive(Debug, Parser)]
#[command(
    version,
    arg_required_else_help = false,
    after_help = "\
Examples:
  gip encode photo.jpg photo.gip                     a sensible quality
  gip encode photo.png small.gip --size 20000        a file of 20,000 bytes
  gip decode photo.gip photo.png                     back to pixels
  gip decode photo.gip thumb.png --size 160x120      a thumbnail, straight from the Gaussians
  gip info photo.gip                                 what the file holds
  gip compare photo.png photo.gip                    how close they are

Wherever a file is read or written, `-` is standard input or standard output.
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

/// Turns a picture into a .gip file.
///
/// Reads PNG, JPEG, WebP, TIFF, GIF, BMP, Netpbm, QOI, TGA, DDS, ICO, farbfeld, OpenEXR, Radiance
/// HDR and .gip, with 8 or 16 bits, gray or RGB, with or without alpha. Gray stays gray; alpha is
/// dropped where every pixel is opaque; pictures of floats (OpenEXR, HDR) are taken as linear
/// light, clipped and stored as 16-bit sRGB. An Exif orientation is applied to the pixels, and the
/// tag in the stored Exif is reset. ICC profile, Exif and XMP are carried over.
#[derive(Debug, clap::Args)]
#[command(
    allow_negative_numbers = true,
    after_help = "\
At most one of --gaussians, --bpp, --size, --psnr and --quality may be given. If the target cannot
be met, the file comes as close as it can and the report says why."
)]
pub(crate) struct Encode {
    /// The picture, or `-` for standard input.
    pub(crate) input: PathBuf,
    /// The .gip file to write, or `-` for standard output.
    pub(crate) output: PathBuf,
    #[command(flatten)]
    pub(crate) target: TargetArgs,
    /// Time to spend, from 1 (least) to 9 (most).
    #[arg(long, value_name = "E", default_value_t = 5,
          value_parser = clap::value_parser!(u8).range(1..=9))]
    pub(crate) effort: u8,
    /// How the Gaussians are stored.
    #[arg(long, value_enum, default_value_t = PrecisionArg::Entropy)]
    pub(crate) precision: PrecisionArg,
    /// Write OUTPUT whatever its name; without this it must end in .gip.
    #[arg(long)]
    pub(crate) force: bool,
    /// Seed of everything random; the same picture, options and seed give the same file.
    #[arg(long, value_name = "S", default_value_t = 0)]
    pub(crate) seed: u64,
    #[command(flatten)]
    pub(crate) threads: ThreadCount,
    /// Print the report as one JSON object. It goes to standard error if OUTPUT is `-`.
    ///
    /// Fields: width, height, gaussians, bytes, bpp (bits per pixel of the whole file), psnr (dB,
    /// of the decoded file), psnr_float (dB, before rounding to samples), iterations, evaluations
    /// (of the kernel, in training), seconds, peak_memory (bytes), shortfall (null, or why the
    /// target was not met). A PSNR that is infinite (an exact copy) is given as 999.
    #[arg(long)]
    pub(crate) json: bool,
}

/// What the file shall meet. Without any of them: a sensible quality, the same as --quality 50.
#[derive(Debug, clap::Args)]
#[group(multiple = false)]
pub(crate) struct TargetArgs {
    /// At most N Gaussians, from 1 to 4194304.
    #[arg(long, help_heading = "Targets", value_name = "N", value_parser = clap::value_parser!(u32).range(1..=4_194_304))]
    gaussians: Option<u32>,
    /// A file of B bits per pixel, from 0.0001 to 1000.
    #[arg(long, help_heading = "Targets", value_name = "B", value_parser = |text: &str| number(text, 0.0001, 1000.0))]
    bpp: Option<f64>,
    /// A file of BYTES bytes.
    #[arg(long, help_heading = "Targets", value_name = "BYTES", value_parser = clap::value_parser!(u64).range(1..))]
    size: Option<u64>,
    /// A PSNR of the decoded file of DB decibels, from 1 to 120.
    #[arg(long, help_heading = "Targets", value_name = "DB", value_parser = |text: &str| number(text, 1.0, 120.0))]
    psnr: Option<f64>,
    /// A quality from 0 (smallest) to 100 (best) [default: 50].
    #[arg(long, help_heading = "Targets", value_name = "Q", value_parser = |text: &str| number(text, 0.0, 100.0))]
    quality: Option<f64>,
}

impl TargetArgs {
    pub(crate) fn target(&self) -> Target {
        self.gaussians
            .map(Target::Gaussians)
            .or(self.bpp.map(Target::BitsPerPixel))
            .or(self.size.map(Target::Bytes))
            .or(self.psnr.map(Target::Psnr))
            .or(self.quality.map(Target::Quality))
            .unwrap_or_default()
    }
}

/// How the Gaussians are stored.
#[derive(Clone, Copy, Debug, ValueEnum)]
pub(crate) enum PrecisionArg {
    /// 32-bit floats: the fitted values themselves, several times as large
    F32,
    /// Quantization-aware training, codes of fixed bit depths
    Packed,
    /// Rate-distortion optimised codes, entropy coded: smallest
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
    /// The pool in which the work is done.
    pub(crate) fn pool(&self) -> Result<ThreadPool, ThreadPoolBuildError> {
        ThreadPoolBuilder::new().num_threads(self.count.map_or(0, usize::from)).build()
    }
}

/// Turns a .gip file into a picture.
///
/// The format follows OUTPUT's extension: png, tif, webp, jpg, bmp, tga, qoi, gif, ico, ff, pgm,
/// ppm, pnm or pam; on standard output it is PNG. Gray becomes RGB where the format knows no gray,
/// and 16 bits become 8 where it knows no more; alpha is never dropped: a format that has none is
/// refused for a picture that has it. ICC profile and Exif go into the formats that take them
/// (PNG, JPEG, WebP; TIFF the profile only). An orientation in the file's Exif is applied.
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
    /// Render F times as wide and high, from 0.001 to 1000. The Gaussians are evaluated at that
    /// scale; no pixels are resampled.
    #[arg(long, value_name = "F", conflicts_with = "size",
          value_parser = |text: &str| number(text, 0.001, 1000.0))]
    pub(crate) scale: Option<f64>,
    /// Render the whole picture W by H pixels large.
    #[arg(long, value_name = "WxH", value_parser = size)]
    pub(crate) size: Option<(u32, u32)>,
    /// Render only the W by H pixels from (X, Y) on, in pixels of the output at its scale.
    #[arg(long, value_name = "X,Y,W,H", value_parser = region)]
    pub(crate) region: Option<Region>,
    /// Write what can be shown of a file that is cut short or damaged, and warn, instead of
    /// failing.
    #[arg(long)]
    pub(crate) allow_partial: bool,
    #[command(flatten)]
    pub(crate) threads: ThreadCount,
}

/// Shows what a .gip file holds.
#[derive(Debug, clap::Args)]
pub(crate) struct Info {
    /// The .gip file, or `-` for standard input.
    pub(crate) file: PathBuf,
    /// Print one JSON object: all header fields, bytes per kind of chunk, bits per Gaussian by
    /// attribute, the quantizer of each component, sizes of the metadata.
    #[arg(long)]
    pub(crate) json: bool,
}

/// Measures how close two pictures are.
///
/// Each may be a .gip file or any picture that `gip encode` reads. Their sizes must agree. They
/// are compared with the channels and the depth of the richer one: gray is expanded to RGB,
/// missing alpha is opaque (and an opaque one does not count), 8 bits become 16. PSNR and the largest error are over all samples of
/// all channels; MS-SSIM is the mean over the channels, on up to five scales as the size allows.
#[derive(Debug, clap::Args)]
pub(crate) struct Compare {
    /// A picture, or `-` for standard input.
    pub(crate) a: PathBuf,
    /// Another one.
    pub(crate) b: PathBuf,
    /// Print one JSON object: width, height, channels, depth, psnr (dB), ms_ssim, max_abs_error
    /// (in steps of that depth). For identical pictures, whose PSNR is infinite, psnr is 999.
    #[arg(long)]
    pub(crate) json: bool,
}

/// A finite number within bounds.
fn number(text: &str, least: f64, most: f64) -> Result<f64, String> {
    text.parse()
        .ok()
        .filter(|number| (least..=most).contains(number))
        .ok_or_else(|| format!("not a number from {least} to {most}"))
}

/// `WxH`.
fn size(text: &str) -> Result<(u32, u32), String> {
    text.split_once('x')
        .and_then(|(width, height)| {
            let side = |text: &str| text.parse().ok().map(NonZeroU32::get);
            Some((side(width)?, side(height)?))
        })
        .ok_or_else(|| "not two positive whole numbers such as 640x480".into())
}

/// `X,Y,W,H`.
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
