//! From linear light and powers of it to the curve of sRGB.

use image::DynamicImage;

/// The sRGB value of linear light, from 0 to 1; 0 of what is no number.
pub(super) fn srgb(linear: f32) -> f32 {
    match linear {
        1.0.. => 1.0,
        0.003_130_8.. => 1.055 * linear.powf(1.0 / 2.4) - 0.055,
        0.0.. => linear * 12.92,
        // Negative, or not a number.
        _ => 0.0,
    }
}

/// The picture with samples that a .gip file can hold: floats are taken as linear light, encoded as
/// sRGB, and clipped and rounded to 16 bits.
pub(super) fn encoded(image: DynamicImage) -> DynamicImage {
    match image {
        DynamicImage::ImageRgb32F(mut image) => {
            for pixel in image.pixels_mut() {
                pixel.0 = pixel.0.map(srgb);
            }
            DynamicImage::from(image).to_rgb16().into()
        }
        DynamicImage::ImageRgba32F(mut image) => {
            for pixel in image.pixels_mut() {
                let [r, g, b, a] = pixel.0;
                pixel.0 = [srgb(r), srgb(g), srgb(b), a];
            }
            DynamicImage::from(image).to_rgba16().into()
        }
        image => image,
    }
}

/// Turns samples whose `exponent`-th power is linear light to those of sRGB, alpha excepted.
pub(super) fn from_power(image: &mut DynamicImage, exponent: f64) {
    let value = |sample: f64| f64::from(srgb(sample.powf(exponent) as f32));
    let eight: Vec<u8> =
        (0..=u8::MAX).map(|s| (value(f64::from(s) / 255.0) * 255.0).round() as u8).collect();
    let eight = |sample: &mut u8| *sample = eight[usize::from(*sample)];
    let sixteen: Vec<u16> =
        (0..=u16::MAX).map(|s| (value(f64::from(s) / 65535.0) * 65535.0).round() as u16).collect();
    let sixteen = |sample: &mut u16| *sample = sixteen[usize::from(*sample)];
    match image {
        DynamicImage::ImageLuma8(image) => image.iter_mut().for_each(eight),
        DynamicImage::ImageRgb8(image) => image.iter_mut().for_each(eight),
        DynamicImage::ImageLumaA8(image) => image.pixels_mut().for_each(|p| eight(&mut p.0[0])),
        DynamicImage::ImageRgba8(image) => {
            image.pixels_mut().for_each(|p| p.0[..3].iter_mut().for_each(eight));
        }
        DynamicImage::ImageLuma16(image) => image.iter_mut().for_each(sixteen),
        DynamicImage::ImageRgb16(image) => image.iter_mut().for_each(sixteen),
        DynamicImage::ImageLumaA16(image) => {
            image.pixels_mut().for_each(|p| sixteen(&mut p.0[0]));
        }
        DynamicImage::ImageRgba16(image) => {
            image.pixels_mut().for_each(|p| p.0[..3].iter_mut().for_each(sixteen));
        }
        _ => {}
    }
}
