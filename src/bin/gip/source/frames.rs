//! Files of several pictures, of which one is taken.

use std::io::Cursor;

use image::ImageFormat;
use image::codecs::pnm::{PnmDecoder, PnmHeader, PnmSubtype, SampleEncoding};
use png::Info;

use super::fault::{self, SHORT};

/// What a file has beside the picture that is taken.
#[derive(Debug, Default)]
pub(super) struct Others {
    /// What is left out. A file that is damaged has those before the damage.
    pub(super) warning: Option<String>,
    /// What is damaged among them, if the picture that is taken may be whole.
    pub(super) damage: Option<&'static str>,
}

impl Others {
    /// `png`: the header, if it is a PNG.
    pub(super) fn of(format: ImageFormat, file: &[u8], png: Option<&Info<'_>>) -> Self {
        let warning = match format {
            ImageFormat::Gif => return Self::after_first("frames", gif_frames(file)),
            ImageFormat::Pnm => return Self::after_first("pictures", pnm_pictures(file)),
            ImageFormat::Png => png.and_then(png_warning),
            ImageFormat::WebP => webp_frames(file).and_then(|count| first_of(count, "frames")),
            _ => None,
        };
        Self { warning, damage: None }
    }

    /// Of a file of so many pictures, which may be damaged after the first.
    pub(super) fn after_first(unit: &str, (count, damage): (usize, Option<&'static str>)) -> Self {
        Self { warning: first_of(count, unit), damage }
    }
}

/// The warning of a file of so many pictures.
pub(super) fn first_of(count: usize, unit: &str) -> Option<String> {
    (count > 1).then(|| format!("only the first of {count} {unit} is taken"))
}

/// How many there are, and what is damaged on the way to the last block.
fn gif_frames(file: &[u8]) -> (usize, Option<&'static str>) {
    let mut options = gif::DecodeOptions::new();
    options.skip_frame_decoding(true);
    let Ok(mut decoder) = options.read_info(file) else { return (0, None) };
    let mut count = 0;
    loop {
        match decoder.next_frame_info() {
            Ok(Some(_)) => count += 1,
            Ok(None) => return (count, None),
            Err(error) => return (count, fault::damage(&error)),
        }
    }
}

/// The picture that is read may be the first of the animation, or one beside it.
fn png_warning(info: &Info<'_>) -> Option<String> {
    let count = info.animation_control?.num_frames;
    if info.frame_control.is_some() {
        return first_of(count as usize, "frames");
    }
    Some(format!("the still picture is taken, and its animation of {count} frames is not"))
}

fn webp_frames(file: &[u8]) -> Option<usize> {
    let decoder = image_webp::WebPDecoder::new(Cursor::new(file)).ok()?;
    decoder.is_animated().then(|| decoder.num_frames() as usize)
}

/// Pictures that follow each other. One of plain text is alone.
fn pnm_pictures(file: &[u8]) -> (usize, Option<&'static str>) {
    let (mut rest, mut count) = (file, 0);
    while let Ok(decoder) = PnmDecoder::new(&mut rest) {
        count += 1;
        let Some(length) = raster(decoder.header()) else { break };
        match usize::try_from(length).ok().and_then(|length| rest.get(length..)) {
            Some(next) => rest = next,
            None => return (count, Some(SHORT)),
        }
    }
    (count, None)
}

/// Bytes of the samples of a Netpbm picture; `None` if they are text.
fn raster(header: &PnmHeader) -> Option<u64> {
    let (width, height) = (u64::from(header.width()), u64::from(header.height()));
    let bytes = if header.maximal_sample() > 255 { 2 } else { 1 };
    let channels = match header.subtype() {
        PnmSubtype::Bitmap(SampleEncoding::Binary) => return Some(width.div_ceil(8) * height),
        PnmSubtype::Graymap(SampleEncoding::Binary) => 1,
        PnmSubtype::Pixmap(SampleEncoding::Binary) => 3,
        PnmSubtype::ArbitraryMap => header.as_arbitrary()?.depth.into(),
        _ => return None,
    };
    (width * height).checked_mul(channels * bytes)
}
