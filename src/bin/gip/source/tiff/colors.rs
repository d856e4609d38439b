//! From the samples of a TIFF to gray or RGB.

use image::{DynamicImage, ImageBuffer, Luma, LumaA, Pixel, Primitive, Rgb, Rgba};

use super::samples::Samples;
use super::tags::{Alpha, Photometric, Tags};
use crate::source::light::srgb;

/// A sample of 8 or 16 bits.
trait Sample: Primitive {
    const FULL: u32;
    fn get(self) -> u32;
    /// `value` is at most [`Sample::FULL`].
    fn new(value: u32) -> Self;
}

impl Sample for u8 {
    const FULL: u32 = 255;
    fn get(self) -> u32 {
        self.into()
    }
    fn new(value: u32) -> Self {
        value as Self
    }
}

impl Sample for u16 {
    const FULL: u32 = 65535;
    fn get(self) -> u32 {
        self.into()
    }
    fn new(value: u32) -> Self {
        value as Self
    }
}

/// `None` if there are fewer samples than the size of the picture needs.
pub(super) fn picture(samples: Samples, tags: &Tags) -> Option<DynamicImage> {
    match samples {
        _ if tags.photometric == Photometric::Palette => from_palette(&samples, tags),
        Samples::Eight(samples) => Some(match channels(samples, tags)? {
            Channels::Gray(samples) => buffer::<Luma<u8>>(samples, tags)?.into(),
            Channels::GrayAlpha(samples) => buffer::<LumaA<u8>>(samples, tags)?.into(),
            Channels::Rgb(samples) => buffer::<Rgb<u8>>(samples, tags)?.into(),
            Channels::Rgba(samples) => buffer::<Rgba<u8>>(samples, tags)?.into(),
        }),
        Samples::Sixteen(samples) => Some(match channels(samples, tags)? {
            Channels::Gray(samples) => buffer::<Luma<u16>>(samples, tags)?.into(),
            Channels::GrayAlpha(samples) => buffer::<LumaA<u16>>(samples, tags)?.into(),
            Channels::Rgb(samples) => buffer::<Rgb<u16>>(samples, tags)?.into(),
            Channels::Rgba(samples) => buffer::<Rgba<u16>>(samples, tags)?.into(),
        }),
    }
}

fn buffer<P: Pixel>(
    samples: Vec<P::Subpixel>,
    tags: &Tags,
) -> Option<ImageBuffer<P, Vec<P::Subpixel>>> {
    ImageBuffer::from_raw(tags.size.0, tags.size.1, samples)
}

enum Channels<T> {
    Gray(Vec<T>),
    GrayAlpha(Vec<T>),
    Rgb(Vec<T>),
    Rgba(Vec<T>),
}

fn channels<T: Sample>(samples: Vec<T>, tags: &Tags) -> Option<Channels<T>> {
    let count = tags.photometric.colors();
    let is_plain = tags.samples == count && tags.bits >= 8;
    if is_plain && tags.photometric == Photometric::BlackIsZero {
        return Some(Channels::Gray(samples));
    }
    if is_plain && tags.photometric == Photometric::Rgb {
        return Some(Channels::Rgb(samples));
    }
    let stored_full = if tags.bits < 8 { (1 << tags.bits) - 1 } else { T::FULL };
    let gray = count == 1;
    let channels = if gray { 1 } else { 3 } + usize::from(tags.alpha.is_some());
    let pixels = samples.chunks_exact(tags.samples);
    let mut out = Vec::new();
    out.try_reserve_exact(pixels.len() * channels).ok()?;
    for pixel in pixels {
        let mut value = [0; 5];
        for (value, sample) in value.iter_mut().zip(pixel) {
            *value = sample.get() * T::FULL / stored_full;
        }
        let alpha = value[count.min(4)];
        if tags.alpha == Some(Alpha::Associated) {
            for color in &mut value[..count] {
                let whole = u64::from(*color) * u64::from(T::FULL) + u64::from(alpha / 2);
                *color = whole.checked_div(alpha.into()).unwrap_or(0).min(T::FULL.into()) as u32;
            }
        }
        let colors = match tags.photometric {
            Photometric::WhiteIsZero => [T::FULL - value[0], 0, 0],
            Photometric::Cmyk => from_cmyk::<T>(value),
            Photometric::YCbCr => from_ycbcr::<T>(value, tags),
            Photometric::CieLab | Photometric::IccLab => from_lab::<T>(value, tags.photometric),
            _ => [value[0], value[1], value[2]],
        };
        out.extend(colors[..if gray { 1 } else { 3 }].iter().map(|&color| T::new(color)));
        if tags.alpha.is_some() {
            out.push(T::new(alpha));
        }
    }
    Some(match channels {
        1 => Channels::Gray(out),
        2 => Channels::GrayAlpha(out),
        3 => Channels::Rgb(out),
        _ => Channels::Rgba(out),
    })
}

/// Without a profile: as if inks covered the paper like filters.
fn from_cmyk<T: Sample>([c, m, y, k, _]: [u32; 5]) -> [u32; 3] {
    [c, m, y].map(|ink| {
        let light = u64::from(T::FULL - ink) * u64::from(T::FULL - k);
        ((light + u64::from(T::FULL / 2)) / u64::from(T::FULL)) as u32
    })
}

fn from_ycbcr<T: Sample>([y, cb, cr, ..]: [u32; 5], tags: &Tags) -> [u32; 3] {
    let [black, white, zero_b, full_b, zero_r, full_r] = tags.range;
    let unit = 255.0 / T::FULL as f32;
    // Luma from 0 to 1, and chroma from -1 to 1.
    let luma = (y as f32 * unit - black) / (white - black);
    let blue = (cb as f32 * unit - zero_b) / (full_b - zero_b);
    let red = (cr as f32 * unit - zero_r) / (full_r - zero_r);
    let [of_red, of_green, of_blue] = tags.luma;
    let r = luma + red * (1.0 - of_red);
    let b = luma + blue * (1.0 - of_blue);
    let g = (luma - of_red * r - of_blue * b) / of_green;
    [r, g, b].map(|value| (value.clamp(0.0, 1.0) * T::FULL as f32).round() as u32)
}

/// CIE 1976 L*a*b* of the white D50, adapted to that of sRGB.
fn from_lab<T: Sample>([l, a, b, ..]: [u32; 5], photometric: Photometric) -> [u32; 3] {
    let steps = (T::FULL + 1) as f32 / 256.0;
    let chroma = |sample: u32| match photometric {
        Photometric::IccLab => sample as f32 / steps - 128.0,
        _ if sample > T::FULL / 2 => (sample as f32 - (T::FULL + 1) as f32) / steps,
        _ => sample as f32 / steps,
    };
    // In profiles, the full lightness of 16 bits is FF00.
    let full = if photometric == Photometric::IccLab { 255.0 * steps } else { T::FULL as f32 };
    let y = (l as f32 / full * 100.0 + 16.0) / 116.0;
    let xyz = [y + chroma(a) / 500.0, y, y - chroma(b) / 200.0].map(|t| {
        const KNEE: f32 = 6.0 / 29.0;
        if t > KNEE { t * t * t } else { 3.0 * KNEE * KNEE * (t - 4.0 / 29.0) }
    });
    // With the white as [1, 1, 1]: Bradford's adaptation and the primaries of sRGB.
    const TO_RGB: [[f32; 3]; 3] = [
        [3.021_982, -1.617_209, -0.404_774],
        [-0.943_709, 1.916_13, 0.027_579],
        [0.069_388, -0.228_994, 1.159_606],
    ];
    TO_RGB.map(|row| {
        let linear = row.iter().zip(xyz).map(|(weight, value)| weight * value).sum();
        (srgb(linear) * T::FULL as f32).round() as u32
    })
}

/// Maps have 16 bits, but most of them are those of a picture with 8.
fn from_palette(samples: &Samples, tags: &Tags) -> Option<DynamicImage> {
    let map = &tags.color_map;
    let length = map.len() / 3;
    if length == 0 {
        return None;
    }
    // Some programs write 8 bits as they are, and others repeat or shift them.
    let is_small = map.iter().all(|&value| value < 256);
    let is_eight = is_small
        || map.iter().all(|&value| value & 0xFF == value >> 8)
        || map.iter().all(|&value| value & 0xFF == 0);
    let indices: Box<dyn Iterator<Item = usize>> = match samples {
        Samples::Eight(samples) => Box::new(samples.iter().map(|&sample| sample.into())),
        Samples::Sixteen(samples) => Box::new(samples.iter().map(|&sample| sample.into())),
    };
    let colors = indices.step_by(tags.samples).flat_map(|index| {
        let index = index.min(length - 1);
        [map[index], map[length + index], map[2 * length + index]]
    });
    Some(if is_eight {
        let shift = if is_small { 0 } else { 8 };
        buffer::<Rgb<u8>>(colors.map(|value| (value >> shift) as u8).collect(), tags)?.into()
    } else {
        buffer::<Rgb<u16>>(colors.collect(), tags)?.into()
    })
}
