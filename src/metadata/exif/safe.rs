//! What of Exif is safe to pass on.

use exif::{Context, Field, In, Tag, Value};

use super::tags::{Exif, write};
use crate::orientation::Orientation;

/// The values that a tag may have. Anything else in its place is not what the tag says.
#[derive(Clone, Copy, Debug)]
enum Kind {
    /// So many texts, of which each ends with a NUL.
    Texts(usize),
    /// A text of this form: `0` stands for a digit or a blank, `+` for a sign or a blank, and all else for
    /// itself.
    Form(&'static [u8]),
    /// Up to so many digits and blanks.
    Digits(usize),
    /// Up to so many integers or rational numbers.
    Numbers(u32),
    /// Four digits that are not a text.
    Version,
}

const DATE: Kind = Kind::Form(b"0000:00:00 00:00:00");
const OFFSET: Kind = Kind::Form(b"+00:00");
const FRACTION: Kind = Kind::Digits(9);

/// The tags that are safe, besides the orientation (Exif 3.0, section 4.6).
const SAFE: &[(Tag, Kind)] = &[
    (Tag::XResolution, Kind::Numbers(1)),
    (Tag::YResolution, Kind::Numbers(1)),
    (Tag::ResolutionUnit, Kind::Numbers(1)),
    (Tag::WhitePoint, Kind::Numbers(2)),
    (Tag::PrimaryChromaticities, Kind::Numbers(6)),
    (Tag::ColorSpace, Kind::Numbers(1)),
    (Tag::Gamma, Kind::Numbers(1)),
    // These tell the colour space "Adobe RGB" where Exif has no number for it.
    (Tag::InteroperabilityIndex, Kind::Form(b"R00")),
    (Tag(Context::Interop, 2), Kind::Version),
    (Tag::ExifVersion, Kind::Version),
    (Tag::ImageDescription, Kind::Texts(1)),
    (Tag::Artist, Kind::Texts(1)),
    // Of the photographer and of the editor.
    (Tag::Copyright, Kind::Texts(2)),
    (Tag::DateTime, DATE),
    (Tag::DateTimeOriginal, DATE),
    (Tag::DateTimeDigitized, DATE),
    (Tag::OffsetTime, OFFSET),
    (Tag::OffsetTimeOriginal, OFFSET),
    (Tag::OffsetTimeDigitized, OFFSET),
    (Tag::SubSecTime, FRACTION),
    (Tag::SubSecTimeOriginal, FRACTION),
    (Tag::SubSecTimeDigitized, FRACTION),
];

impl Kind {
    /// Numbers and characters of the value at most.
    fn most(self) -> u32 {
        match self {
            Self::Texts(_) => u32::MAX,
            // With the NULs that some programs fill fields up with.
            Self::Form(_) | Self::Digits(_) => 64,
            Self::Numbers(most) => most,
            Self::Version => 4,
        }
    }

    /// What of a value is safe.
    fn safe(self, value: Value) -> Option<Value> {
        let digit = |byte: &u8| byte.is_ascii_digit() || *byte == b' ';
        match value {
            Value::Ascii(texts) => {
                let mut texts = texts.first()?.split(|byte| *byte == 0);
                if let Self::Texts(most) = self {
                    // What follows an empty one is seen by nobody.
                    let texts = texts.take_while(|text| !text.is_empty()).take(most);
                    let texts: Vec<_> = texts.map(<[u8]>::to_vec).collect();
                    return (!texts.is_empty()).then_some(Value::Ascii(texts));
                }
                let text = texts.next()?;
                let is_safe = match self {
                    Self::Form(form) => {
                        let fits = |(form, byte): (&u8, &u8)| match form {
                            b'0' => digit(byte),
                            b'+' => b"+- ".contains(byte),
                            _ => form == byte,
                        };
                        text.len() == form.len() && form.iter().zip(text).all(fits)
                    }
                    Self::Digits(most) => text.len() <= most && text.iter().all(digit),
                    _ => false,
                };
                is_safe.then(|| Value::Ascii(vec![text.to_vec()]))
            }
            Value::Undefined(bytes, at) => {
                let is_safe = matches!(self, Self::Version)
                    && bytes.len() == 4
                    && bytes.iter().all(u8::is_ascii_digit);
                is_safe.then_some(Value::Undefined(bytes, at))
            }
            numbers => matches!(self, Self::Numbers(_)).then_some(numbers),
        }
    }
}

/// Exif of this orientation with the safe tags of another, as far as that can be read. It is written anew,
/// so that nothing else is between them; `None` if there is nothing to write. Returns, too, whether some
/// could not be read.
pub(in crate::metadata) fn safe(
    stream: &[u8],
    orientation: Orientation,
) -> (Option<Vec<u8>>, bool) {
    let mut fields = Vec::new();
    if orientation != Orientation::default() {
        let value = Value::Short(vec![orientation.to_exif().into()]);
        fields.push(Field { tag: Tag::Orientation, ifd_num: In::PRIMARY, value });
    }
    let Some(exif) = Exif::read(stream) else { return (write(&fields, false), true) };
    let mut is_damaged = exif.is_damaged();
    for &(tag, kind) in SAFE {
        match exif.field(tag, kind.most()) {
            Ok(Some(Field { value, .. })) => {
                let value = kind.safe(value);
                fields.extend(value.map(|value| Field { tag, ifd_num: In::PRIMARY, value }));
            }
            Ok(None) => {}
            Err(_) => is_damaged = true,
        }
    }
    (write(&fields, exif.is_little_endian()), is_damaged)
}
