//! Which format a file has.

use std::path::Path;

use image::ImageFormat;

/// Bytes that tell the format.
pub(super) const START: usize = 16;

#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum Format {
    Gip,
    /// What `image` reads, but for this one.
    Image(ImageFormat),
    Tiff,
}

impl Format {
    /// The format of the file with this name and these first bytes. A format without a signature is
    /// recognized by its extension.
    pub(super) fn of(path: &Path, start: &[u8]) -> Option<Self> {
        if start.starts_with(b"\xC7GIP") {
            return Some(Self::Gip);
        }
        // `image` does not know the signature of files with offsets of 64 bits.
        if start.starts_with(b"II+\0") || start.starts_with(b"MM\0+") {
            return Some(Self::Tiff);
        }
        if let Ok(format) = image::guess_format(start) {
            return Some(Self::from(format));
        }
        let extension = path.extension()?;
        if extension.eq_ignore_ascii_case("gip") {
            return Some(Self::Gip);
        }
        ImageFormat::from_extension(extension).map(Self::from)
    }
}

impl From<ImageFormat> for Format {
    fn from(format: ImageFormat) -> Self {
        if format == ImageFormat::Tiff { Self::Tiff } else { Self::Image(format) }
    }
}
