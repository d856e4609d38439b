//! What of Exif is safe to pass on.

use std::io::Cursor;

use exif::experimental::Writer;
use exif::{Context, Exif, Field, In, Reader, Tag, Value};

use crate::orientation::Orientation;

/// The values that a tag may have. Anything else in its place is not what the tag says.
#[derive(Clone, Copy, Debug)]
enum Kind {
    /// ASCII.
    Text,
    /// Up to so many integers, rational numbers or bytes.
    Numbers(usize),
}

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
    (Tag::InteroperabilityIndex, Kind::Text),
    (Tag(Context::Interop, 2), Kind::Numbers(4)),
    (Tag::ExifVersion, Kind::Numbers(4)),
    (Tag::ImageDescription, Kind::Text),
    (Tag::Artist, Kind::Text),
    (Tag::Copyright, Kind::Text),
    (Tag::DateTime, Kind::Text),
    (Tag::DateTimeOriginal, Kind::Text),
    (Tag::DateTimeDigitized, Kind::Text),
    (Tag::OffsetTime, Kind::Text),
    (Tag::OffsetTimeOriginal, Kind::Text),
    (Tag::OffsetTimeDigitized, Kind::Text),
    (Tag::SubSecTime, Kind::Text),
    (Tag::SubSecTimeOriginal, Kind::Text),
    (Tag::SubSecTimeDigitized, Kind::Text),
];

impl Kind {
    fn includes(self, value: &Value) -> bool {
        let count = match value {
            Value::Ascii(_) => return matches!(self, Self::Text),
            Value::Short(numbers) => numbers.len(),
            Value::Long(numbers) => numbers.len(),
            Value::Rational(numbers) => numbers.len(),
            Value::Undefined(bytes, _) => bytes.len(),
            _ => return false,
        };
        matches!(self, Self::Numbers(most) if (1..=most).contains(&count))
    }
}

/// Exif of this orientation with the safe tags of another, if that can be read. It is written anew, so that
/// nothing else is between them; `None` if there is nothing to write.
pub(super) fn safe(exif: Option<&Exif>, orientation: Orientation) -> Option<Vec<u8>> {
    let value = Value::Short(vec![orientation.to_exif().into()]);
    let turn = Field { tag: Tag::Orientation, ifd_num: In::PRIMARY, value };
    let mut writer = Writer::new();
    if orientation != Orientation::default() {
        writer.push_field(&turn);
    }
    if let Some(exif) = exif {
        // The crate reads a value when it is asked for. It is not asked for all of them: thousands may
        // share the same bytes.
        let field = |tag| exif.get_field(tag, In::PRIMARY);
        let fields = SAFE
            .iter()
            .filter_map(|(tag, kind)| field(*tag).filter(|field| kind.includes(&field.value)));
        fields.for_each(|field| writer.push_field(field));
    }
    let mut out = Cursor::new(Vec::new());
    // It fails if there is nothing to write.
    writer.write(&mut out, exif.is_some_and(Exif::little_endian)).ok()?;
    Some(out.into_inner())
}

/// Reads Exif, unless it is damaged.
pub(super) fn read(exif: Vec<u8>) -> Option<Exif> {
    Reader::new().read_raw(exif).ok()
}
