//! Where the samples of a page are in the file.

use std::io::Cursor;

use tiff::TiffResult;
use tiff::decoder::Decoder;
use tiff::tags::Tag;

/// Whether the file ends before a strip or tile does.
pub(super) fn is_cut(decoder: &mut Decoder<Cursor<&[u8]>>, file: &[u8]) -> bool {
    let end = |(start, length): (u64, u64)| start.saturating_add(length);
    strips(decoder).is_ok_and(|strips| strips.into_iter().map(end).max() > Some(file.len() as u64))
}

/// Where each strip or tile begins, and its bytes.
pub(super) fn strips(decoder: &mut Decoder<Cursor<&[u8]>>) -> TiffResult<Vec<(u64, u64)>> {
    let mut numbers = |tags: [Tag; 2]| -> TiffResult<Vec<u64>> {
        for tag in tags {
            if let Some(numbers) = decoder.find_tag_unsigned_vec(tag)? {
                return Ok(numbers);
            }
        }
        Ok(Vec::new())
    };
    let offsets = numbers([Tag::StripOffsets, Tag::TileOffsets])?;
    let lengths = numbers([Tag::StripByteCounts, Tag::TileByteCounts])?;
    Ok(offsets.into_iter().zip(lengths).collect())
}
