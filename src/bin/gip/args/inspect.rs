//! The arguments of `gip info` and `gip compare`.

use std::path::PathBuf;

use super::limits::LimitArgs;

/// Shows what .gip files contain.
///
/// Of several files, what is told of each stands below its name. A file that cannot be read is reported, and
/// the others are shown.
#[derive(Debug, clap::Args)]
#[command(after_help = "\
Exit status: 0 for success, 1 for failure, 2 for wrong usage, 3 if some of several files failed.")]
pub(crate) struct Info {
    /// The .gip files; `-` is standard input.
    #[arg(required = true, value_name = "FILE")]
    pub(crate) files: Vec<PathBuf>,
    /// Print one JSON object for each file, on a line of its own: the name and the size of the file, all fields
    /// of the header, number and bytes of the chunks of each type, bits per Gaussian by attribute, and sizes of
    /// the metadata.
    ///
    /// In `file`, the name, a byte that is not UTF-8 is U+FFFD and two hexadecimal digits, and so are the bytes of
    /// a U+FFFD in a name.
    /// `prefixes` has, for each number of layers from the first on, the number of Gaussians, the place where they
    /// end in the file (`end`), and the size of the file that `gip prefix` makes of them (`bytes`).
    /// `width` and `height` are those of the picture as stored; `upright_width` and `upright_height` those after it
    /// is turned by `orientation`, 1 to 8 as in Exif.
    /// `bits_per_gaussian.coded` counts the framing of the chunks too. `components` has the
    /// quantizer of each component of the packed coding; with the entropy coding it is empty.
    /// `quantization_steps` has the quantization steps of the entropy coding; with the packed coding it
    /// is null. `texture` is null without one; its `bytes` are null if the file has more chunks of its type,
    /// which are skipped.
    #[arg(long)]
    pub(crate) json: bool,
    #[command(flatten)]
    pub(crate) limits: LimitArgs,
}

/// Measures how much two pictures differ.
///
/// Each may be a .gip file, which is shown without its texture, or any picture that `gip encode` reads. They are
/// compared upright, and must have the same size. An alpha channel that is opaque everywhere is ignored. Both are
/// converted to a colour model with the channels of both, and to the greater depth: gray becomes RGB, missing
/// alpha becomes opaque, 8 bits become 16. Colours count as they show, times their alpha. PSNR and the largest error are over
/// all samples of all channels. MS-SSIM is the mean over the channels, on up to five scales, as the
/// size allows.
#[derive(Debug, clap::Args)]
pub(crate) struct Compare {
    /// A picture, or `-` for standard input.
    pub(crate) a: PathBuf,
    /// Another one.
    pub(crate) b: PathBuf,
    /// Count colours as they are stored, where alpha is 0, too.
    #[arg(long)]
    pub(crate) keep_invisible: bool,
    /// Print one JSON object: width, height, channels, depth (bits per sample), psnr (in dB),
    /// ms_ssim, max_abs_error (in quantization steps of that depth). The PSNR of identical
    /// pictures, which is infinite, is given as 999.
    #[arg(long)]
    pub(crate) json: bool,
    #[command(flatten)]
    pub(crate) limits: LimitArgs,
}
