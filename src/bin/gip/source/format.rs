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
    /// The format of a file with these first bytes.
    pub(super) fn by_signature(start: &[u8]) -> Option<Self> {
        if start.starts_with(b"\xC7GIP") {
            return Some(Self::Gip);
        }
        // `image` does not know the signature of files with offsets of 64 bits.
        if start.starts_with(b"II+\0") || start.starts_with(b"MM\0+") {
            return Some(Self::Tiff);
        }
        // Nor the other one of Radiance, which its decoder refuses.
        if start.starts_with(b"#?RGBE") {
            return Some(Self::Image(ImageFormat::Hdr));
        }
        image::guess_format(start).ok().map(Self::from)
    }

    /// The format that the extension of a name tells.
    pub(super) fn by_name(path: &Path) -> Option<Self> {
        let extension = path.extension()?;
        if extension.eq_ignore_ascii_case("gip") {
            return Some(Self::Gip);
        }
        // JPEG with several pictures.
        if extension.eq_ignore_ascii_case("mpo") {
            return Some(Self::Image(ImageFormat::Jpeg));
        }
        ImageFormat::from_extension(extension).map(Self::from)
    }

    /// The name in messages.
    pub(super) fn name(self) -> &'static str {
        match self {
            Self::Gip => "gip",
            Self::Tiff => "TIFF",
            Self::Image(format) => match format {
                ImageFormat::Png => "PNG",
                ImageFormat::Jpeg => "JPEG",
                ImageFormat::Gif => "GIF",
                ImageFormat::WebP => "WebP",
                ImageFormat::Pnm => "Netpbm",
                ImageFormat::Tga => "TGA",
                ImageFormat::Dds => "DDS",
                ImageFormat::Bmp => "BMP",
                ImageFormat::Ico => "ICO",
                ImageFormat::Hdr => "Radiance HDR",
                ImageFormat::OpenExr => "OpenEXR",
                ImageFormat::Farbfeld => "farbfeld",
                ImageFormat::Avif => "AVIF",
                ImageFormat::Qoi => "QOI",
                _ => "picture",
            },
        }
    }

    /// Whether a file with these first bytes cannot be of this format, as it has none of its signatures. One
    /// that ends in them may be. That of .gip is the decoder's concern.
    pub(super) fn is_excluded(self, start: &[u8]) -> bool {
        let has_signature = !matches!(self, Self::Gip | Self::Image(ImageFormat::Tga));
        has_signature && start.len() >= START && Self::by_signature(start) != Some(self)
    }

    /// Whether there is a decoder. `image` denies the one that it has for DDS.
    pub(super) fn is_read(self) -> bool {
        match self {
            Self::Gip | Self::Tiff | Self::Image(ImageFormat::Dds) => true,
            Self::Image(format) => format.reading_enabled(),
        }
    }
}

/// Whether the name is that of a picture that can be read, other than a .gip file.
pub(crate) fn is_picture(path: &Path) -> bool {
    Format::by_name(path).is_some_and(|format| format != Format::Gip && format.is_read())
}

impl From<ImageFormat> for Format {
    fn from(format: ImageFormat) -> Self {
        if format == ImageFormat::Tiff { Self::Tiff } else { Self::Image(format) }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn pictures_that_can_be_read_are_told_by_their_names() {
        for name in ["a.png", "b.JPG", "c.tif", "x/d.dds", "e.MPO", "f.pam"] {
            assert!(is_picture(Path::new(name)), "{name}");
        }
        for name in ["a.gip", "b.avif", "c.txt", "png", "d.png/e"] {
            assert!(!is_picture(Path::new(name)), "{name}");
        }
    }
}
