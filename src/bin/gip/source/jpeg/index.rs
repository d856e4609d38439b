//! The index of a file of several JPEGs (CIPA DC-007, Multi-Picture Format).

/// What the segment APP2 with the index begins with.
pub(super) const PREFIX: &[u8] = b"MPF\0";
/// The tag of the list of pictures, and bytes of its entries.
const LIST: u32 = 0xB002;
const ENTRY: usize = 16;
/// Kinds of pictures that are smaller versions of another one.
const THUMBNAILS: std::ops::RangeInclusive<u32> = 0x01_0001..=0x01_0002;

/// How many pictures of the file there are by the index that begins at this place, without smaller
/// versions. Programs that drop all but the first often keep the index, so the others have to be there.
pub(super) fn pictures(file: &[u8], at: usize) -> Option<usize> {
    let index = file.get(at..)?;
    let is_little = index.starts_with(b"II");
    let number = |at: usize, bytes: usize| -> Option<u32> {
        let bytes = index.get(at..at.checked_add(bytes)?)?;
        let join = |number: u32, byte: &u8| number << 8 | u32::from(*byte);
        Some(if is_little { bytes.iter().rev().fold(0, join) } else { bytes.iter().fold(0, join) })
    };
    let directory = number(4, 4)? as usize;
    let count = number(directory, 2)? as usize;
    let mut tags = (0..count).map(|tag| directory.saturating_add(2 + 12 * tag));
    let list = tags.find(|&tag| number(tag, 2) == Some(LIST))?;
    let (length, first) = (number(list + 4, 4)? as usize, number(list + 8, 4)? as usize);
    let entries = (0..length / ENTRY).map(|entry| first.saturating_add(entry * ENTRY));
    let others =
        entries.skip(1).map_while(|entry| Some((number(entry, 4)?, number(entry + 8, 4)?)));
    let are_there = others.filter(|&(kind, offset)| {
        let is_jpeg =
            index.get(offset as usize..).is_some_and(|data| data.starts_with(b"\xFF\xD8"));
        is_jpeg && !THUMBNAILS.contains(&(kind & 0xFF_FFFF))
    });
    Some(1 + are_there.count())
}
