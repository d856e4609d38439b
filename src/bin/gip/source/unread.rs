//! Formats of pictures that are not read.

use std::path::Path;

/// Extensions of their files: of codecs, of cameras' raw files, and of programs.
const UNREAD: [&str; 73] = [
    "3fr", "ai", "ani", "ari", "arw", "avci", "avcs", "avif", "avifs", "bay", "bpg", "cap", "cdr",
    "cin", "cr2", "cr3", "crw", "cur", "dcm", "dcr", "dcs", "djvu", "dng", "dpx", "emf", "eps",
    "erf", "fff", "fits", "flif", "gpr", "heic", "heics", "heif", "heifs", "hif", "icns", "iiq",
    "j2c", "j2k", "jls", "jng", "jp2", "jpc", "jpf", "jph", "jpm", "jpx", "jxl", "jxr", "kdc",
    "kra", "mef", "mos", "mrw", "nef", "nrw", "ora", "orf", "pcx", "pef", "psb", "psd", "raf",
    "raw", "rw2", "rwl", "sr2", "srf", "srw", "svg", "x3f", "xcf",
];

/// Whether a name is that of a picture in a format that is not read.
pub(crate) fn is_unread_picture(path: &Path) -> bool {
    unread(path).is_some()
}

/// The name of the format that is not read, if the extension of a name is that of one.
pub(super) fn unread(path: &Path) -> Option<String> {
    let extension = path.extension()?.to_ascii_lowercase();
    UNREAD.iter().find(|unread| extension == **unread).map(|name| name.to_ascii_uppercase())
}

#[cfg(test)]
mod tests {
    use super::*;
    use image::ImageFormat;

    #[test]
    fn pictures_are_told_by_extensions_of_formats_that_are_not_read() {
        for name in ["a.HEIC", "b.cr3", "c.tar.avif", "x/d.Psd"] {
            assert!(is_unread_picture(Path::new(name)), "{name}");
        }
        for name in ["a.png", "avif", "a.avif/b", "c.txt", ".svg"] {
            assert!(!is_unread_picture(Path::new(name)), "{name}");
        }
        for extension in UNREAD {
            let format = ImageFormat::from_extension(extension);
            assert!(format.is_none_or(|format| !format.reading_enabled()), "{extension}");
        }
    }
}
