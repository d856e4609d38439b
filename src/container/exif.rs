//! Exif data: a TIFF stream, whose directories are read as far as they go.

use crate::orientation::Orientation;

/// Bytes of an entry of a directory: tag, type, count and value.
const ENTRY: usize = 12;
/// The tag of the orientation, and the type of its value.
const ORIENTATION: u16 = 0x0112;
const SHORT: u16 = 3;

/// The orientation in Exif data; `None` if there is none, or none that Exif knows.
pub(super) fn orientation(exif: &[u8]) -> Option<Orientation> {
    let (at, order) = find_orientation(exif)?;
    Orientation::from_exif(u8::try_from(order.short(exif, at)?).ok()?)
}

/// Makes the orientation in Exif data upright, if there is one.
#[cfg(feature = "metadata")]
pub(super) fn reset_orientation(exif: &mut [u8]) {
    if let Some((at, order)) = find_orientation(exif) {
        exif[at..at + 2].copy_from_slice(match order {
            ByteOrder::Little => &[1, 0],
            ByteOrder::Big => &[0, 1],
        });
    }
}

/// Exif data that say an orientation and nothing else.
#[cfg(feature = "encode")]
pub(super) fn of_orientation(orientation: Orientation) -> Vec<u8> {
    // The directory stands at byte 8, has one entry with one short number, and no other one follows it.
    let directory = [1, 0, 0x12, 1, 3, 0, 1, 0, 0, 0, orientation.to_exif(), 0, 0, 0, 0, 0, 0, 0];
    [&b"II*\0\x08\0\0\0"[..], &directory].concat()
}

/// Where the value of the orientation is.
fn find_orientation(exif: &[u8]) -> Option<(usize, ByteOrder)> {
    let directory = Directory::first(exif)?;
    let mut entries = directory.entries();
    let found =
        entries.find(|entry| (entry.tag, entry.kind, entry.count) == (ORIENTATION, SHORT, 1));
    let value = found?.value;
    exif.get(value..value + 2).map(|_| (value, directory.order))
}

/// A directory of a TIFF stream.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Directory<'a> {
    stream: &'a [u8],
    pub(crate) order: ByteOrder,
    /// Where the first entry is, and how many there are said to be.
    first: usize,
    pub(crate) count: u16,
}

/// An entry of a directory. Its value is untrusted.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Entry {
    pub(crate) tag: u16,
    /// The type of the value.
    pub(crate) kind: u16,
    /// How many numbers or characters the value has.
    pub(crate) count: u32,
    /// Where the value is, or, if it has more than four bytes, the offset of it.
    value: usize,
}

impl<'a> Directory<'a> {
    /// The directory of the picture; `None` if this is no TIFF stream, or if the directory is not there.
    pub(crate) fn first(stream: &'a [u8]) -> Option<Self> {
        let order = match stream.first_chunk()? {
            b"II*\0" => ByteOrder::Little,
            b"MM\0*" => ByteOrder::Big,
            _ => return None,
        };
        Self::at(stream, order, order.long(stream, 4)?)
    }

    fn at(stream: &'a [u8], order: ByteOrder, offset: u32) -> Option<Self> {
        let at = usize::try_from(offset).ok()?;
        // Files are untrusted, so that sums may overflow.
        Some(Self { stream, order, first: at.checked_add(2)?, count: order.short(stream, at)? })
    }

    /// The entries that are there.
    pub(crate) fn entries(&self) -> impl Iterator<Item = Entry> {
        let &Self { stream, order, first, count } = self;
        (0..usize::from(count)).map_while(move |number| {
            let at = first.checked_add(number * ENTRY)?;
            stream.get(at..at.checked_add(ENTRY)?)?;
            Some(Entry {
                tag: order.short(stream, at)?,
                kind: order.short(stream, at + 2)?,
                count: order.long(stream, at + 4)?,
                value: at + 8,
            })
        })
    }
}

#[cfg(feature = "metadata")]
impl<'a> Directory<'a> {
    /// The directory that an entry refers to; `None` if it is not there.
    pub(crate) fn child(&self, entry: Entry) -> Option<Self> {
        const LONG: u16 = 4;
        const IFD: u16 = 13;
        let is_offset = matches!(entry.kind, LONG | IFD) && entry.count == 1;
        let offset = self.order.long(self.stream, entry.value).filter(|_| is_offset)?;
        Self::at(self.stream, self.order, offset)
    }

    /// The bytes of a value whose numbers have so many; `None` if they are not all there.
    pub(crate) fn bytes(&self, entry: Entry, each: usize) -> Option<&'a [u8]> {
        let length = usize::try_from(entry.count).ok()?.checked_mul(each)?;
        let at = match length {
            0..=4 => entry.value,
            _ => usize::try_from(self.order.long(self.stream, entry.value)?).ok()?,
        };
        self.stream.get(at..at.checked_add(length)?)
    }
}

#[derive(Clone, Copy, Debug)]
pub(crate) enum ByteOrder {
    Little,
    Big,
}

impl ByteOrder {
    pub(crate) fn short(self, bytes: &[u8], at: usize) -> Option<u16> {
        let bytes = *bytes.get(at..)?.first_chunk()?;
        Some(match self {
            Self::Little => u16::from_le_bytes(bytes),
            Self::Big => u16::from_be_bytes(bytes),
        })
    }

    pub(crate) fn long(self, bytes: &[u8], at: usize) -> Option<u32> {
        let bytes = *bytes.get(at..)?.first_chunk()?;
        Some(match self {
            Self::Little => u32::from_le_bytes(bytes),
            Self::Big => u32::from_be_bytes(bytes),
        })
    }
}

#[cfg(test)]
mod tests {
    use alloc::vec::Vec;

    use super::*;

    /// Exif data with these entries: tag, type, count and value.
    fn exif(entries: &[(u16, u16, u32, u16)], big: bool) -> Vec<u8> {
        let short = |value: u16| if big { value.to_be_bytes() } else { value.to_le_bytes() };
        let long = |value: u32| if big { value.to_be_bytes() } else { value.to_le_bytes() };
        let mut bytes = if big { b"MM\0*".to_vec() } else { b"II*\0".to_vec() };
        bytes.extend(long(10));
        bytes.extend([0; 2]);
        bytes.extend(short(entries.len() as u16));
        for &(tag, kind, count, value) in entries {
            bytes.extend([short(tag), short(kind)].concat());
            bytes.extend(long(count));
            bytes.extend([short(value), [0; 2]].concat());
        }
        bytes
    }

    #[test]
    fn all_values_in_both_byte_orders() {
        for value in 0..=300 {
            let expected = u8::try_from(value).ok().and_then(Orientation::from_exif);
            for big in [false, true] {
                let entries = [(0x010F, 2, 40, 0), (ORIENTATION, SHORT, 1, value)];
                assert_eq!(orientation(&exif(&entries, big)), expected, "{value}, {big}");
            }
        }
    }

    #[test]
    fn what_is_no_orientation() {
        let none = [(0x0112, 4, 1, 6), (0x0112, 3, 2, 6), (0x0113, 3, 1, 6)];
        assert_eq!(orientation(&exif(&none, false)), None);
        assert_eq!(orientation(b"Exif\0\0II*\0"), None);
        // The first one counts.
        let two = [(0x0112, 3, 1, 3), (0x0112, 3, 1, 6)];
        assert_eq!(orientation(&exif(&two, true)), Some(Orientation::Rotate180));
    }

    #[test]
    fn data_that_end_early_or_point_anywhere() {
        for big in [false, true] {
            let whole = exif(&[(ORIENTATION, SHORT, 1, 6)], big);
            // The last two bytes are padding.
            for length in 0..whole.len() - 2 {
                assert_eq!(orientation(&whole[..length]), None, "{length}");
            }
            for offset in [0, 1, 11, 30, 1 << 31, u32::MAX - 1, u32::MAX] {
                let mut bytes = whole.clone();
                let offset = if big { offset.to_be_bytes() } else { offset.to_le_bytes() };
                bytes[4..8].copy_from_slice(&offset);
                assert_eq!(orientation(&bytes), None);
            }
            let mut many = whole;
            many[10..12].fill(0xFF);
            many[13] ^= 1;
            many[12] ^= 1;
            assert_eq!(orientation(&many), None);
        }
    }
}
