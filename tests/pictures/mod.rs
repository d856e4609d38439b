//! The picture and the metadata that the tests of the adapters share.

use image::{ColorType, DynamicImage};

/// An Exif block with one entry, the orientation "rotate by 90 degrees".
pub(crate) const EXIF_ROTATE_90: &[u8] =
    b"MM\0\x2a\0\0\0\x08\0\x01\x01\x12\0\x03\0\0\0\x01\0\x06\0\0\0\0\0\0";

/// A ramp with a bright spot, in any colour type; alpha is a ramp, too.
pub(crate) fn picture((width, height): (u32, u32), color: ColorType) -> DynamicImage {
    let rgba = image::Rgba32FImage::from_fn(width, height, |x, y| {
        let ramp = x as f32 / width as f32;
        let spot = if (x / 6, y / 6) == (2, 3) { 0.9 } else { 0.2 };
        image::Rgba([ramp, spot, 1.0 - ramp, y as f32 / height as f32])
    });
    let picture = DynamicImage::ImageRgba32F(rgba);
    match color {
        ColorType::L8 => picture.to_luma8().into(),
        ColorType::La8 => picture.to_luma_alpha8().into(),
        ColorType::Rgb8 => picture.to_rgb8().into(),
        ColorType::Rgba8 => picture.to_rgba8().into(),
        ColorType::L16 => picture.to_luma16().into(),
        ColorType::La16 => picture.to_luma_alpha16().into(),
        ColorType::Rgb16 => picture.to_rgb16().into(),
        ColorType::Rgba16 => picture.to_rgba16().into(),
        _ => picture,
    }
}
