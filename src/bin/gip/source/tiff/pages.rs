//! The pages of a file, of which the first is taken.

use std::io::Cursor;

use tiff::decoder::Decoder;
use tiff::tags::Tag;

use super::strips;
use crate::source::fault::{self, SHORT};

/// Bit of `NewSubfileType`: a smaller version of another page.
const REDUCED: u32 = 1;
/// Bit of `NewSubfileType`: a mask of another page.
const MASK: u32 = 4;

/// How many there are, and whether the file ends before one after the first does. Versions of a page in
/// smaller sizes, and masks, are no pages.
pub(super) fn pages(file: &[u8]) -> (usize, Option<&'static str>) {
    let Ok(mut decoder) = Decoder::new(Cursor::new(file)) else { return (0, None) };
    let (mut count, mut damage) = (1, None);
    // The library ends a chain that is a circle.
    while decoder.more_images() {
        if let Err(error) = decoder.next_image() {
            // Others are pages of a kind that is not read.
            return (count, damage.or(fault::damage(&error).filter(|damage| *damage == SHORT)));
        }
        damage = damage.or(strips::is_cut(&mut decoder, file).then_some(SHORT));
        let kind = decoder.find_tag_unsigned(Tag::NewSubfileType).ok().flatten().unwrap_or(0);
        count += usize::from(kind & (REDUCED | MASK) == 0);
    }
    (count, damage)
}
