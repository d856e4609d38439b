//! What the tags of a page say about its samples.

use std::io::Cursor;

use tiff::TiffResult;
use tiff::decoder::Decoder;
use tiff::decoder::ifd::Value;
use tiff::tags::Tag;

use crate::source::colors::is_srgb;
use crate::source::square::Density;

const TRANSFER_FUNCTION: Tag = Tag::Unknown(301);
const WHITE_POINT: Tag = Tag::Unknown(318);
const PRIMARIES: Tag = Tag::Unknown(319);
const YCBCR_COEFFICIENTS: Tag = Tag::Unknown(529);
const REFERENCE_BLACK_WHITE: Tag = Tag::Unknown(532);

/// What samples mean, as the tag `PhotometricInterpretation` says.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum Photometric {
    WhiteIsZero,
    BlackIsZero,
    Rgb,
    Palette,
    Cmyk,
    YCbCr,
    /// L* from 0 to 100, a* and b* with a sign.
    CieLab,
    /// As in ICC profiles: a* and b* from -128 on.
    IccLab,
}

/// What the first page's tags say about its samples.
#[derive(Debug)]
pub(super) struct Tags {
    pub(super) size: (u32, u32),
    pub(super) photometric: Photometric,
    pub(super) bits: u8,
    /// Samples of a pixel, all of them.
    pub(super) samples: usize,
    pub(super) alpha: Option<Alpha>,
    /// Whether the data of strips and tiles are JPEGs.
    pub(super) is_jpeg: bool,
    /// Whether the first pixel is in the lowest bits of a byte.
    pub(super) is_reversed: bool,
    pub(super) color_map: Vec<u16>,
    /// Pixels across and down that share their chroma.
    pub(super) subsampling: (u16, u16),
    /// Weights of red, green and blue in luma.
    pub(super) luma: [f32; 3],
    /// Black and white of luma, then zero and full of each chroma, as samples of 8 bits.
    pub(super) range: [f32; 6],
    /// Pixels per unit.
    pub(super) density: Option<Density>,
    /// Whether colours are described by tags that are not taken into account.
    pub(super) has_colorimetry: bool,
}

/// The alpha channel, which comes after the colours.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum Alpha {
    /// The colours were multiplied by it.
    Associated,
    Unassociated,
}

impl Photometric {
    /// `None` if it is not one of those that are read.
    fn from_code(code: u16) -> Option<Self> {
        Some(match code {
            0 => Self::WhiteIsZero,
            1 => Self::BlackIsZero,
            2 => Self::Rgb,
            3 => Self::Palette,
            5 => Self::Cmyk,
            6 => Self::YCbCr,
            8 => Self::CieLab,
            9 => Self::IccLab,
            _ => return None,
        })
    }

    /// Samples of a pixel that are colours.
    pub(super) fn colors(self) -> usize {
        match self {
            Self::WhiteIsZero | Self::BlackIsZero | Self::Palette => 1,
            Self::Rgb | Self::YCbCr | Self::CieLab | Self::IccLab => 3,
            Self::Cmyk => 4,
        }
    }
}

impl Tags {
    /// Channels that are neither colours nor alpha. That of a palette's picture is not taken.
    pub(super) fn extra_channels(&self) -> usize {
        let has_alpha = self.alpha.is_some() && self.photometric != Photometric::Palette;
        self.samples - self.photometric.colors() - usize::from(has_alpha)
    }

    /// `None` if the colours are none of those that are read.
    pub(super) fn read(decoder: &mut Decoder<Cursor<&[u8]>>) -> TiffResult<Option<Self>> {
        let size = decoder.dimensions()?;
        let one = |decoder: &mut Decoder<Cursor<&[u8]>>, tag, default: u16| {
            decoder.find_tag_unsigned::<u16>(tag).map(|value| value.unwrap_or(default))
        };
        let code = one(decoder, Tag::PhotometricInterpretation, u16::MAX)?;
        let Some(photometric) = Photometric::from_code(code) else { return Ok(None) };
        let samples = usize::from(one(decoder, Tag::SamplesPerPixel, 1)?);
        let many = |decoder: &mut Decoder<Cursor<&[u8]>>, tag| {
            decoder.find_tag_unsigned_vec::<u16>(tag).map(Option::unwrap_or_default)
        };
        let bits =
            many(decoder, Tag::BitsPerSample)?.first().map_or(1, |&bits| bits.min(255) as u8);
        let extra = many(decoder, Tag::ExtraSamples)?;
        let alpha = match extra.first() {
            _ if samples <= photometric.colors() => None,
            Some(1) => Some(Alpha::Associated),
            Some(2) => Some(Alpha::Unassociated),
            Some(_) => None,
            // Some programs leave out what the one more sample is.
            None => (samples == photometric.colors() + 1).then_some(Alpha::Unassociated),
        };
        let luma = numbers(decoder, YCBCR_COEFFICIENTS).unwrap_or([0.299, 0.587, 0.114]);
        let range = numbers(decoder, REFERENCE_BLACK_WHITE);
        let range = range.unwrap_or([0.0, 255.0, 128.0, 255.0, 128.0, 255.0]);
        let density = [Tag::XResolution, Tag::YResolution].map(|tag| numbers(decoder, tag));
        let density = density[0].zip(density[1]).map(|([across], [down])| (across, down));
        let subsampling = match many(decoder, Tag::ChromaSubsampling)?[..] {
            [across, down] => (across, down),
            _ => (2, 2),
        };
        let points = numbers(decoder, WHITE_POINT).zip(numbers(decoder, PRIMARIES));
        let points = points.map(|([x, y], [red_x, red_y, green_x, green_y, blue_x, blue_y])| {
            [(x, y), (red_x, red_y), (green_x, green_y), (blue_x, blue_y)]
        });
        let mut has = |tag| matches!(decoder.find_tag(tag), Ok(Some(_)));
        let has_colorimetry = has(TRANSFER_FUNCTION)
            || points.is_none_or(|points| !is_srgb(&points))
                && (has(WHITE_POINT) || has(PRIMARIES));
        Ok(Some(Self {
            size,
            photometric,
            bits,
            samples,
            alpha,
            is_jpeg: one(decoder, Tag::Compression, 1)? == 7,
            is_reversed: one(decoder, Tag::FillOrder, 1)? == 2,
            color_map: many(decoder, Tag::ColorMap)?,
            subsampling,
            luma: luma.map(|weight| weight as f32),
            range: range.map(|sample| sample as f32),
            density,
            has_colorimetry,
        }))
    }
}

/// The numbers of a tag; `None` if it has not so many.
fn numbers<const N: usize>(decoder: &mut Decoder<Cursor<&[u8]>>, tag: Tag) -> Option<[f64; N]> {
    let list = match decoder.find_tag(tag).ok()?? {
        Value::List(list) => list,
        one => vec![one],
    };
    let number = |value| {
        let number = match value {
            Value::Rational(numerator, denominator) => {
                f64::from(numerator) / f64::from(denominator)
            }
            Value::Float(number) => number.into(),
            Value::Double(number) => number,
            other => other.into_u32().ok()?.into(),
        };
        number.is_finite().then_some(number)
    };
    list.into_iter().map(number).collect::<Option<Vec<_>>>()?.try_into().ok()
}
