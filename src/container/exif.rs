//! Exif data: a TIFF stream.

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

/// Where the value of the orientation is.
fn find_orientation(exif: &[u8]) -> Option<(usize, ByteOrder)> {
    let order = match exif.first_chunk()? {
        b"II*\0" => ByteOrder::Little,
        b"MM\0*" => ByteOrder::Big,
        _ => return None,
    };
    // The first directory is that of the picture. Files are untrusted, so that sums may overflow.
    let directory = usize::try_from(order.long(exif, 4)?).ok()?;
    let entries = directory.checked_add(2)?;
    for entry in 0..usize::from(order.short(exif, directory)?) {
        let at = entries.checked_add(entry * ENTRY)?;
        let head = (order.short(exif, at)?, order.short(exif, at + 2)?, order.long(exif, at + 4)?);
        let value = at + 8;
        if head == (ORIENTATION, SHORT, 1) {
            return exif.get(value..value + 2).map(|_| (value, order));
        }
    }
    None
}

#[derive(Clone, Copy, Debug)]
enum ByteOrder {
    Little,
    Big,
}

impl ByteOrder {
    fn short(self, bytes: &[u8], at: usize) -> Option<u16> {
        let bytes = *bytes.get(at..)?.first_chunk()?;
        Some(match self {
            Self::Little => u16::from_le_bytes(bytes),
            Self::Big => u16::from_be_bytes(bytes),
        })
    }

    fn long(self, bytes: &[u8], at: usize) -> Option<u32> {
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
