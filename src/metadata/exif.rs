//! What of Exif is safe to pass on.

use std::io::Cursor;

use exif::experimental::Writer;
use exif::{Context, Error, Field, In, Reader, Tag, Value};

use crate::orientation::Orientation;

/// The values that a tag may have. Anything else in its place is not what the tag says.
#[derive(Clone, Copy, Debug)]
enum Kind {
    /// ASCII.
    Text,
    /// Up to so many integers, rational numbers or bytes.
    Numbers(usize),
}

/// Exif 3.0, section 4.6; `Gamma` and the offsets of dates have no name in the crate or are of later
/// versions.
const SAFE: &[(Tag, Kind)] = &[
    (Tag::Orientation, Kind::Numbers(1)),
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

/// The safe tags of Exif, written anew, so that nothing else is between them; `None` if there are none.
pub(super) fn safe(exif: Vec<u8>) -> Result<Option<Vec<u8>>, Error> {
    let exif = Reader::new().read_raw(exif)?;
    // The crate reads a value when it is asked for. It is not asked for all of them: thousands may share
    // the same bytes.
    let fields = SAFE.iter().filter_map(|(tag, kind)| {
        exif.get_field(*tag, In::PRIMARY).filter(|field| kind.includes(&field.value))
    });
    write(fields, exif.little_endian())
}

/// Exif with nothing but an orientation.
pub(super) fn of_orientation(orientation: Orientation) -> Vec<u8> {
    let value = Value::Short(vec![orientation.to_exif().into()]);
    let field = Field { tag: Tag::Orientation, ifd_num: In::PRIMARY, value };
    write([&field].into_iter(), false).ok().flatten().unwrap_or_default()
}

fn write<'a>(
    fields: impl Iterator<Item = &'a Field>,
    little_endian: bool,
) -> Result<Option<Vec<u8>>, Error> {
    let (mut writer, mut is_empty) = (Writer::new(), true);
    for field in fields {
        writer.push_field(field);
        is_empty = false;
    }
    if is_empty {
        return Ok(None);
    }
    let mut out = Cursor::new(Vec::new());
    writer.write(&mut out, little_endian)?;
    Ok(Some(out.into_inner()))
}
