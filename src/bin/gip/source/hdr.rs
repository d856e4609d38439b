//! What of a Radiance file is lost.

use std::io::Cursor;

use image::codecs::hdr::HdrDecoder;
use image_gip::Orientation;

use super::square;

/// What its header has and the picture lacks.
pub(super) fn lost(file: &[u8]) -> Vec<String> {
    let Ok(decoder) = HdrDecoder::new(Cursor::new(file)) else { return Vec::new() };
    let metadata = decoder.metadata();
    let mut attributes = metadata.custom_attributes.iter();
    let primaries = attributes.find(|(name, _)| name == "PRIMARIES").map(|(_, primaries)| {
        format!("its primaries ({}) cannot be kept, and are taken as sRGB's", primaries.trim())
    });
    // Radiance has height by width.
    let height = f64::from(metadata.pixel_aspect_ratio.unwrap_or(1.0));
    primaries.into_iter().chain(square::warning((height, 1.0), Orientation::NoTransforms)).collect()
}
