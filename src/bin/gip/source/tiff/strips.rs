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

/// Reverses the bits of each byte of strips or tiles, but of no more bytes than the file has: those that share
/// some are damaged, and could take long.
pub(super) fn reverse_bits(file: &mut [u8], strips: &[(u64, u64)]) {
    let mut left = file.len();
    for &(start, length) in strips {
        let start = usize::try_from(start).unwrap_or(usize::MAX);
        let Some(rest) = file.get_mut(start..) else { continue };
        let length = usize::try_from(length).unwrap_or(usize::MAX).min(rest.len()).min(left);
        rest[..length].iter_mut().for_each(|byte| *byte = byte.reverse_bits());
        left -= length;
    }
}
