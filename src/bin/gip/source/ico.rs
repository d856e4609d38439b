//! Icons, which are PNGs in some files.

/// Bytes of the header, and of an entry of the directory.
const HEADER: usize = 6;
const ENTRY: usize = 16;

/// The PNG that the largest picture of the file is; `None` if it is none.
pub(super) fn png(file: &[u8]) -> Option<&[u8]> {
    let count = u16::from_le_bytes([*file.get(4)?, *file.get(5)?]);
    let directory = file.get(HEADER..HEADER + usize::from(count) * ENTRY)?;
    // 0 is 256. As in `image`, most bits count first, and of equal ones the last.
    let side = |byte: u8| if byte == 0 { 256 } else { u32::from(byte) };
    let score =
        |entry: &[u8]| (u16::from_le_bytes([entry[6], entry[7]]), side(entry[0]) * side(entry[1]));
    let mut entries = directory.chunks_exact(ENTRY);
    let last = entries.next_back()?;
    let best =
        entries.fold(last, |best, entry| if score(entry) > score(best) { entry } else { best });
    let number = |at: usize| {
        u32::from_le_bytes([best[at], best[at + 1], best[at + 2], best[at + 3]]) as usize
    };
    let (length, offset) = (number(8), number(12));
    let data = file.get(offset..offset.saturating_add(length).min(file.len()))?;
    data.starts_with(b"\x89PNG\r\n\x1A\n").then_some(data)
}
