//! The chunks of a WebP (RFC 9649), which has nothing else that tells damage.

use std::borrow::Cow;

use super::fault::SHORT;

/// Bytes of a chunk's name and length, and of what RIFF has before the chunks.
const NAME: usize = 8;
const BEFORE: usize = 12;
/// Bytes of a frame of an animation before its chunks.
const FRAME: usize = 16;
/// Where the flags of an extended file are, and those of Exif and XMP.
const FLAGS: usize = BEFORE + NAME;
const METADATA: [(&[u8], u8); 2] = [(b"EXIF", 8), (b"XMP ", 4)];

/// What the lengths of the file and of its chunks tell.
pub(super) fn damage(file: &[u8]) -> Option<&'static str> {
    let end = length(file)?.saturating_add(NAME);
    let Some(chunks) = file.get(BEFORE..end.max(BEFORE)) else { return Some(SHORT) };
    if !adds_up(chunks, false) {
        return Some("the lengths of its chunks do not add up");
    }
    (lost_metadata(file).1 != 0).then_some("its metadata are missing")
}

/// Whether chunks, of a file or of a frame in it, are just as long as all of them. The last one may lack
/// the byte that makes it even.
fn adds_up(mut chunks: &[u8], is_frame: bool) -> bool {
    while chunks.len() > 1 {
        let end = length(chunks).and_then(|length| length.checked_add(NAME));
        let Some(contents) = end.and_then(|end| chunks.get(NAME..end)) else { return false };
        let is_whole = |frame| adds_up(frame, true);
        let has_chunks = !is_frame && chunks.starts_with(b"ANMF");
        if has_chunks && !contents.get(FRAME..).is_some_and(is_whole) {
            return false;
        }
        chunks = chunks.get(NAME + contents.len().next_multiple_of(2)..).unwrap_or_default();
    }
    true
}

/// The length of the contents of the chunk that begins here.
fn length(chunk: &[u8]) -> Option<usize> {
    Some(u32::from_le_bytes(*chunk.get(4..NAME)?.first_chunk()?) as usize)
}

/// The file without the metadata that it promises and ends before or in: the decoder takes nothing
/// without them.
pub(super) fn without_lost_metadata(file: &[u8]) -> Cow<'_, [u8]> {
    let (end, flags) = lost_metadata(file);
    if flags == 0 {
        return file.into();
    }
    let mut file = file[..end].to_vec();
    file[FLAGS] &= !flags;
    file.into()
}

/// Where the metadata begin that the file ends in, or else its end; and the flags of those that it does
/// not have as a whole.
fn lost_metadata(file: &[u8]) -> (usize, u8) {
    let mut lost = match (file.get(BEFORE..BEFORE + 4), file.get(FLAGS)) {
        (Some(b"VP8X"), Some(flags)) => flags & (METADATA[0].1 | METADATA[1].1),
        _ => 0,
    };
    let mut at = BEFORE;
    while let Some(length) = file.get(at..).and_then(length) {
        let contents = at.saturating_add(NAME);
        if let Some((_, flag)) = METADATA.iter().find(|(name, _)| file[at..].starts_with(name)) {
            if contents.saturating_add(length) > file.len() {
                return (at, lost);
            }
            lost &= !flag;
        }
        at = contents.saturating_add(length).saturating_add(length % 2);
    }
    (file.len(), lost)
}
