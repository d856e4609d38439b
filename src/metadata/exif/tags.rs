//! Exif: reading its tags, and writing those anew that are asked for.

use std::io::Cursor;

use exif::experimental::Writer;
use exif::{Context, Field, In, Rational, Tag, Value};

use crate::container::{ByteOrder, Directory, Entry};

/// Types of values (TIFF 6.0; Exif 3.0, section 4.6.2).
const ASCII: u16 = 2;
const SHORT: u16 = 3;
const LONG: u16 = 4;
const RATIONAL: u16 = 5;
const UNDEFINED: u16 = 7;
const UTF8: u16 = 129;

/// The tags of the first picture of a TIFF stream, and of the directories that belong to it. They are
/// looked up when they are asked for: damage matters to those alone that are in it, and it takes no
/// memory if thousands of directories or tags share the same bytes.
#[derive(Debug)]
pub(in crate::metadata) struct Exif<'a> {
    tiff: Directory<'a>,
    exif: Option<Directory<'a>>,
    interop: Option<Directory<'a>>,
    is_damaged: bool,
}

/// A tag that is not there to be read.
#[derive(Clone, Copy, Debug)]
pub(in crate::metadata) struct Damaged;

impl<'a> Exif<'a> {
    /// `None` if there is nothing to be read.
    pub(in crate::metadata) fn read(stream: &'a [u8]) -> Option<Self> {
        let tiff = Directory::first(stream)?;
        let mut is_damaged = is_cut(&tiff);
        let mut child = |parent: Option<Directory<'a>>, pointer: Tag| {
            let parent = parent?;
            let entry = find(&parent, pointer)?;
            let child = parent.child(entry);
            is_damaged |= child.as_ref().is_none_or(is_cut);
            child
        };
        let exif = child(Some(tiff), Tag::ExifIFDPointer);
        let interop = child(exif, Tag::InteropIFDPointer);
        Some(Self { tiff, exif, interop, is_damaged })
    }

    /// Whether a directory is missing or ends too early.
    pub(in crate::metadata) fn is_damaged(&self) -> bool {
        self.is_damaged
    }

    pub(in crate::metadata) fn is_little_endian(&self) -> bool {
        matches!(self.tiff.order, ByteOrder::Little)
    }

    /// The first of a tag; `None` if its value is of a type that nothing is made of, or has none or more than
    /// `most` numbers or characters. Several texts in one are one with NULs.
    pub(in crate::metadata) fn field(&self, tag: Tag, most: u32) -> Result<Option<Field>, Damaged> {
        let directory = match tag.context() {
            Context::Tiff => Some(self.tiff),
            Context::Exif => self.exif,
            Context::Interop => self.interop,
            _ => None,
        };
        let Some(directory) = directory else { return Ok(None) };
        let Some(entry) = find(&directory, tag) else { return Ok(None) };
        if entry.count == 0 || entry.count > most {
            return Ok(None);
        }
        let value = value(&directory, entry)?;
        Ok(value.map(|value| Field { tag, ifd_num: In::PRIMARY, value }))
    }
}

fn is_cut(directory: &Directory<'_>) -> bool {
    directory.entries().count() < usize::from(directory.count)
}

fn find(directory: &Directory<'_>, tag: Tag) -> Option<Entry> {
    directory.entries().find(|entry| entry.tag == tag.number())
}

fn value(directory: &Directory<'_>, entry: Entry) -> Result<Option<Value>, Damaged> {
    let bytes = |each| directory.bytes(entry, each).ok_or(Damaged);
    let order = directory.order;
    let long = |bytes: &[u8], at| order.long(bytes, at).unwrap_or_default();
    Ok(Some(match entry.kind {
        // What has a type of its own since Exif 3.0 was written as ASCII before, and is read as such.
        ASCII | UTF8 => {
            let text = bytes(1)?;
            Value::Ascii(vec![text.strip_suffix(b"\0").unwrap_or(text).to_vec()])
        }
        SHORT => {
            let numbers = bytes(2)?.as_chunks::<2>().0;
            Value::Short(numbers.iter().map(|n| order.short(n, 0).unwrap_or_default()).collect())
        }
        LONG => Value::Long(bytes(4)?.as_chunks::<4>().0.iter().map(|n| long(n, 0)).collect()),
        RATIONAL => {
            let numbers = bytes(8)?.as_chunks::<8>().0.iter();
            let rational = |n: &[u8; 8]| Rational { num: long(n, 0), denom: long(n, 4) };
            Value::Rational(numbers.map(rational).collect())
        }
        UNDEFINED => Value::Undefined(bytes(1)?.to_vec(), 0),
        _ => return Ok(None),
    }))
}

/// Exif with nothing but these fields; `None` if there are none.
pub(in crate::metadata) fn write(fields: &[Field], little_endian: bool) -> Option<Vec<u8>> {
    let mut writer = Writer::new();
    fields.iter().for_each(|field| writer.push_field(field));
    let mut out = Cursor::new(Vec::new());
    // It fails if there is nothing to write.
    writer.write(&mut out, little_endian).ok()?;
    Some(out.into_inner())
}
