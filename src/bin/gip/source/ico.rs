//! Icons: several pictures, which are PNGs in some files.

/// Bytes of the header, and of an entry of the directory.
const HEADER: usize = 6;
const ENTRY: usize = 16;

/// The PNG that the picture to take is; `None` if it is none. As in `image`, this is the one of most bits,
/// of equal ones the largest, and of these the last.
pub(super) fn png(file: &[u8]) -> Option<&[u8]> {
    // 0 is 256.
    let side = |byte: u8| if byte == 0 { 256 } else { u32::from(byte) };
    let score =
        |entry: &[u8]| (u16::from_le_bytes([entry[6], entry[7]]), side(entry[0]) * side(entry[1]));
    let mut entries = entries(file)?;
    let last = entries.next_back()?;
    let best =
        entries.fold(last, |best, entry| if score(entry) > score(best) { entry } else { best });
    let (start, end) = place(best);
    let data = file.get(start..end.min(file.len()))?;
    data.starts_with(b"\x89PNG\r\n\x1A\n").then_some(data)
}

/// What is left out of a file of several pictures.
pub(super) fn warning(file: &[u8]) -> Option<String> {
    let count = entries(file)?.len();
    (count > 1)
        .then(|| format!("of its {count} pictures, only the one of most bits and pixels is taken"))
}

/// Whether the file ends before one of its pictures does.
pub(super) fn is_cut(file: &[u8]) -> bool {
    entries(file).is_none_or(|mut entries| entries.any(|entry| place(entry).1 > file.len()))
}

fn entries(file: &[u8]) -> Option<impl DoubleEndedIterator<Item = &[u8]> + ExactSizeIterator> {
    let count = u16::from_le_bytes([*file.get(4)?, *file.get(5)?]);
    Some(file.get(HEADER..HEADER + usize::from(count) * ENTRY)?.chunks_exact(ENTRY))
}

/// Where the picture of an entry begins and ends.
fn place(entry: &[u8]) -> (usize, usize) {
    let number = |at: usize| {
        u32::from_le_bytes([entry[at], entry[at + 1], entry[at + 2], entry[at + 3]]) as usize
    };
    (number(12), number(12).saturating_add(number(8)))
}
