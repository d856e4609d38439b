//! Files of several pictures, of which the first is taken.

use std::io::Cursor;

use image::ImageFormat;
use tiff::tags::Tag;

/// Bit of TIFF's `NewSubfileType`: a smaller version of another page.
const REDUCED: u32 = 1;
/// Bit of TIFF's `NewSubfileType`: a mask of another page.
const MASK: u32 = 4;

/// What is left out of a file of several pictures. A file that is damaged has those before the damage.
pub(super) fn warning(format: ImageFormat, file: &[u8]) -> Option<String> {
    let (count, unit) = match format {
        ImageFormat::Gif => (gif_frames(file)?, "frames"),
        ImageFormat::Png => return png_warning(file),
        ImageFormat::WebP => (webp_frames(file)?, "frames"),
        ImageFormat::Tiff => (tiff_pages(file)?, "pages"),
        _ => return None,
    };
    first_of(count, unit)
}

fn first_of(count: u32, unit: &str) -> Option<String> {
    (count > 1).then(|| format!("only the first of {count} {unit} is taken"))
}

fn gif_frames(file: &[u8]) -> Option<u32> {
    let mut options = gif::DecodeOptions::new();
    options.skip_frame_decoding(true);
    let mut decoder = options.read_info(file).ok()?;
    let mut count = 0;
    while let Ok(Some(_)) = decoder.next_frame_info() {
        count += 1;
    }
    Some(count)
}

/// The picture that is read may be the first of the animation, or one beside it.
fn png_warning(file: &[u8]) -> Option<String> {
    let reader = png::Decoder::new(Cursor::new(file)).read_info().ok()?;
    let count = reader.info().animation_control?.num_frames;
    if reader.info().frame_control.is_some() {
        return first_of(count, "frames");
    }
    Some(format!("the still picture is taken, and its animation of {count} frames is not"))
}

fn webp_frames(file: &[u8]) -> Option<u32> {
    let decoder = image_webp::WebPDecoder::new(Cursor::new(file)).ok()?;
    decoder.is_animated().then(|| decoder.num_frames())
}

/// Versions of a page in smaller sizes, and masks, are no pages.
fn tiff_pages(file: &[u8]) -> Option<u32> {
    let mut decoder = tiff::decoder::Decoder::new(Cursor::new(file)).ok()?;
    let mut count = 1;
    // The library ends a chain that is a circle.
    while decoder.more_images() && decoder.next_image().is_ok() {
        let kind = decoder.find_tag_unsigned(Tag::NewSubfileType).ok().flatten().unwrap_or(0);
        count += u32::from(kind & (REDUCED | MASK) == 0);
    }
    Some(count)
}
