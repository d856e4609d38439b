//! What a walk through a JPEG finds.

use std::borrow::Cow;

use super::bits::Damage;
use crate::source::square::Density;

/// The last marker.
const END: &[u8] = &[0xFF, 0xD9];

/// What the data of a JPEG are like, as far as data without a checksum tell. Nothing is said about what
/// the decoder refuses by itself, such as an invalid header.
#[derive(Debug, Default)]
pub(crate) struct Survey {
    /// Whether there is an ICC profile, or a part of one.
    pub(crate) has_profile: bool,
    /// How many pictures the file has, if it has an index of them.
    pub(crate) pictures: Option<usize>,
    /// Why the data are not just as many as the picture takes, of the codes that there are.
    pub(super) damage: Option<Damage>,
    /// Where a segment begins that the file ends in.
    pub(super) cut: Option<usize>,
    pub(super) is_jfif: bool,
    /// Pixels per unit that JFIF gives.
    pub(crate) density: Option<Density>,
    /// The colour transform that Adobe's segment gives.
    pub(super) adobe: Option<u8>,
    /// The components' identifiers.
    pub(super) ids: Vec<u8>,
    /// Whether the sampling or the scans are such that the usual decoder reads them wrong.
    pub(super) is_unusual: bool,
    pub(super) unread: Option<&'static str>,
}

/// What three components are.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum Colors {
    Rgb,
    YCbCr,
}

impl Survey {
    pub(crate) fn damage(&self) -> Option<&'static str> {
        self.damage.map(Damage::text)
    }

    /// Why no decoder reads the picture, if that can be told from its header.
    pub(crate) fn unread(&self) -> Option<&'static str> {
        let is_cmyk = self.is_unusual && self.ids.len() > 3;
        let cmyk =
            is_cmyk.then_some("JPEG of four colours with such sampling or scans is not read");
        self.unread.or(cmyk)
    }

    /// The colours of a picture that only the other decoder reads right; `None` if the usual one does.
    pub(crate) fn unusual(&self) -> Option<Colors> {
        // JFIF has precedence over Adobe's segment, and both over identifiers, as in libjpeg.
        let is_named_rgb = self.ids == *b"RGB";
        let is_rgb = match (self.is_jfif, self.adobe) {
            (true, _) => false,
            (false, Some(transform)) => transform == 0,
            (false, None) => is_named_rgb,
        };
        let is_misread = is_named_rgb && !is_rgb;
        let colors = if is_rgb { Colors::Rgb } else { Colors::YCbCr };
        (self.is_unusual || is_misread).then_some(colors)
    }

    /// The file with an end after its last whole segment, or after the data that there are, if it ends too
    /// early.
    pub(crate) fn closed<'a>(&self, file: Cow<'a, [u8]>) -> Cow<'a, [u8]> {
        if self.damage != Some(Damage::TooFew) {
            return file;
        }
        let whole = &file[..self.cut.unwrap_or(file.len())];
        [whole, END].concat().into()
    }
}
