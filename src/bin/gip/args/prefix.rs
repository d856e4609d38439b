//! The arguments of `gip prefix`.

use std::path::PathBuf;

/// Cuts a small .gip file from the beginning of a large one.
///
/// The first layers of a file are a picture: of the strongest Gaussians, blurred, but of the same size. This writes a
/// file of as many layers as fit into BYTES, as a placeholder for example, without decoding and encoding. `gip info`
/// shows how many bytes there can be. Colour space and ICC profile are kept, and Exif if it turns the picture; texture
/// and other metadata are left out. `gip encode --first-layer` makes files whose first layer fits.
///
/// The beginning of a file that is cut off is enough, if it has the layers.
#[derive(Debug, clap::Args)]
pub(crate) struct Prefix {
    /// The .gip file, or `-` for standard input.
    pub(crate) input: PathBuf,
    /// Most bytes of the small file.
    #[arg(value_name = "BYTES")]
    pub(crate) bytes: usize,
    /// The .gip file to write, or `-` for standard output.
    pub(crate) output: PathBuf,
    /// Write OUTPUT even if its name does not end in .gip.
    #[arg(long)]
    pub(crate) force: bool,
}
