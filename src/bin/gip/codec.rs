//! The formats that `gip decode` writes.

use std::io::Cursor;
use std::path::Path;

use anyhow::{Context, Result, bail};
use image::codecs::{bmp, farbfeld, gif, ico, jpeg, png, qoi, tga, tiff, webp};
use image::{DynamicImage, ImageEncoder};
use image_gip::{Cicp, ColorModel, Metadata, MetadataLoss, MetadataPolicy, SampleDepth};

use crate::cicp;
use crate::errors::WrongUsage;
use crate::files;
use crate::picture::{SampleSlice, StillImage};

/// Most bytes of Exif in a JPEG: its segment also has a length, and a prefix of 6 bytes.
const MAX_JPEG_EXIF: usize = u16::MAX as usize - 2 - 6;
/// Quality of JPEG files: high, because the picture has coding errors already.
const JPEG_QUALITY: u8 = 95;

/// The extensions of the formats, for messages.
pub(crate) const EXTENSIONS: &str =
    "png, tif, webp, jpg, bmp, tga, qoi, gif, ico, ff, pgm, ppm, pnm or pam";

/// An output format.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum Codec {
    Bmp,
    Farbfeld,
    Gif,
    Ico,
    Jpeg,
    /// Netpbm's graymap.
    Pgm,
    /// Netpbm's pixmap.
    Ppm,
    /// Netpbm's graymap or pixmap.
    Pnm,
    /// Netpbm's arbitrary map.
    Pam,
    Png,
    Qoi,
    Tga,
    Tiff,
    WebP,
}

impl Codec {
    /// The format with the extension `named`, or else with that of a path; PNG for standard output.
    pub(crate) fn of(path: &Path, named: Option<&str>) -> Result<Self> {
        if let Some(codec) = named.and_then(Self::named) {
            return Ok(codec);
        }
        if files::is_standard_stream(path) {
            return Ok(Self::Png);
        }
        let extension = path.extension().unwrap_or_default().to_string_lossy();
        Self::named(&extension).with_context(|| {
            let path = path.display();
            WrongUsage(format!(
                "{path}: the extension or --format must name the format: {EXTENSIONS}"
            ))
        })
    }

    /// The format with this extension.
    pub(crate) fn named(extension: &str) -> Option<Self> {
        Some(match &*extension.to_ascii_lowercase() {
            "bmp" => Self::Bmp,
            "ff" => Self::Farbfeld,
            "gif" => Self::Gif,
            "ico" => Self::Ico,
            "jpg" | "jpeg" => Self::Jpeg,
            "pgm" => Self::Pgm,
            "ppm" => Self::Ppm,
            "pnm" => Self::Pnm,
            "pam" => Self::Pam,
            "png" => Self::Png,
            "qoi" => Self::Qoi,
            "tga" => Self::Tga,
            "tif" | "tiff" => Self::Tiff,
            "webp" => Self::WebP,
            _ => return None,
        })
    }

    /// The colour models that the format has, those with the fewest channels first.
    fn colors(self) -> &'static [ColorModel] {
        use ColorModel::{Gray, GrayAlpha, Rgb, Rgba};
        match self {
            Self::Png | Self::Tga | Self::Pam => &[Gray, GrayAlpha, Rgb, Rgba],
            Self::Tiff | Self::Bmp => &[Gray, Rgb, Rgba],
            Self::Jpeg | Self::Pnm => &[Gray, Rgb],
            // The encoder of WebP takes gray, but what it writes is RGB, and so must be its profile.
            Self::WebP | Self::Qoi | Self::Gif => &[Rgb, Rgba],
            Self::Ico | Self::Farbfeld => &[Rgba],
            Self::Pgm => &[Gray],
            Self::Ppm => &[Rgb],
        }
    }

    /// The depths that the format has.
    fn depths(self) -> &'static [SampleDepth] {
        match self {
            Self::Png | Self::Tiff | Self::Pgm | Self::Ppm | Self::Pnm | Self::Pam => {
                &[SampleDepth::Eight, SampleDepth::Sixteen]
            }
            Self::Farbfeld => &[SampleDepth::Sixteen],
            _ => &[SampleDepth::Eight],
        }
    }

    /// The format's colour model with the fewest channels that holds all channels of a picture, and
    /// the picture's depth, or the format's if it lacks that one.
    pub(crate) fn choose(
        self,
        color: ColorModel,
        depth: SampleDepth,
    ) -> Result<(ColorModel, SampleDepth)> {
        let holds = |candidate: &&ColorModel| {
            (candidate.has_alpha() || !color.has_alpha())
                && (candidate.channels() >= 3 || color.channels() < 3)
        };
        let Some(&chosen) = self.colors().iter().find(holds) else {
            let missing = if self.colors().iter().any(|c| c.has_alpha()) || !color.has_alpha() {
                "colour"
            } else {
                "alpha"
            };
            bail!("{self:?} has no {missing}, and the picture has: choose png, tif or webp");
        };
        let depths = self.depths();
        Ok((chosen, if depths.contains(&depth) { depth } else { depths[0] }))
    }

    /// Refuses a picture that is larger than the format has.
    pub(crate) fn check_size(self, (width, height): (u32, u32)) -> Result<()> {
        let most = match self {
            Self::Ico => 256,
            Self::WebP => 1 << 14,
            Self::Gif | Self::Jpeg | Self::Tga => u16::MAX.into(),
            _ => u32::MAX,
        };
        if width.max(height) > most {
            bail!(
                "{self:?} has at most {most}x{most} pixels, and the picture has {width}x{height}"
            );
        }
        Ok(())
    }

    /// Drops the colour space that the format has no place for. Returns what of it is missed: the colours are
    /// shown as others. Codes become a profile where the format has only profiles, and there is one.
    pub(crate) fn drop_colors(self, color: ColorModel, metadata: &mut Metadata) -> Vec<String> {
        let takes_profile = matches!(self, Self::Png | Self::Jpeg | Self::WebP | Self::Tiff);
        let mut dropped = Vec::new();
        if let Some(codes) = metadata.cicp.take_if(|_| self != Self::Png) {
            let profile = cicp::profile(codes, color.channels() < 3);
            if let Some(profile) = profile.filter(|_| takes_profile) {
                metadata.icc_profile = Some(profile);
            } else if codes != Cicp::SRGB {
                dropped.push(format!("colour space ({})", cicp::name(codes)));
            }
        }
        if metadata.icc_profile.take_if(|_| !takes_profile).is_some_and(is_missed) {
            dropped.push("colour profile".into());
        }
        self.not_written(dropped)
    }

    /// Drops all other metadata that the format has no place for, or that is not written to it. Returns what it
    /// was.
    pub(crate) fn drop_unwritable(self, metadata: &mut Metadata) -> Vec<String> {
        let takes_exif = |exif: &Vec<u8>| match self {
            Self::Png | Self::WebP => true,
            Self::Jpeg => exif.len() <= MAX_JPEG_EXIF,
            _ => false,
        };
        let mut dropped = Vec::new();
        if self != Self::Png {
            let display = metadata.mastering_display.take().map(drop);
            if display.or(metadata.content_light.take().map(drop)).is_some() {
                dropped.push("mastering display or content light level".into());
            }
        }
        if metadata.exif.take_if(|exif| !takes_exif(exif)).is_some() {
            dropped.push("Exif".into());
        }
        if metadata.xmp.take().is_some() {
            dropped.push("XMP".into());
        }
        if !std::mem::take(&mut metadata.texts).is_empty() {
            dropped.push("text".into());
        }
        self.not_written(dropped)
    }

    /// The warnings of what was dropped.
    fn not_written(self, dropped: Vec<String>) -> Vec<String> {
        let warn = |what: String| format!("the {what} is not written to {self:?}");
        dropped.into_iter().map(warn).collect()
    }

    /// Encodes a picture of the colour model and depth that [`Codec::choose`] returned.
    pub(crate) fn encode(self, picture: &StillImage) -> Result<Vec<u8>> {
        let mut out = Cursor::new(Vec::new());
        match self {
            Self::Bmp => write(bmp::BmpEncoder::new(&mut out), picture),
            Self::Farbfeld => write(farbfeld::FarbfeldEncoder::new(&mut out), picture),
            Self::Gif => write(gif::GifEncoder::new(&mut out), picture),
            Self::Ico => write(ico::IcoEncoder::new(&mut out), picture),
            Self::Jpeg => {
                write(jpeg::JpegEncoder::new_with_quality(&mut out, JPEG_QUALITY), picture)
            }
            Self::Pgm | Self::Ppm | Self::Pnm | Self::Pam => return Ok(self.netpbm(picture)),
            Self::Png => write(png::PngEncoder::new(&mut out), picture),
            Self::Qoi => write(qoi::QoiEncoder::new(&mut out), picture),
            Self::Tga => write(tga::TgaEncoder::new(&mut out), picture),
            Self::Tiff => write(tiff::TiffEncoder::new(&mut out), picture),
            Self::WebP => write(webp::WebPEncoder::new_lossless(&mut out), picture),
        }?;
        let out = out.into_inner();
        Ok(if self == Self::Png { cicp::with_chunks(out, &picture.metadata) } else { out })
    }

    /// Encodes a Netpbm format; `image` does not write all of them with 16 bits.
    fn netpbm(self, picture: &StillImage) -> Vec<u8> {
        let (width, height) = (picture.image.width(), picture.image.height());
        let (color, full) = (picture.color(), (1_u32 << picture.depth().bits()) - 1);
        let header = if self == Self::Pam {
            let kind = match color {
                ColorModel::Gray => "GRAYSCALE",
                ColorModel::GrayAlpha => "GRAYSCALE_ALPHA",
                ColorModel::Rgb => "RGB",
                _ => "RGB_ALPHA",
            };
            let depth = color.channels();
            format!(
                "P7\nWIDTH {width}\nHEIGHT {height}\nDEPTH {depth}\nMAXVAL {full}\nTUPLTYPE \
                 {kind}\nENDHDR\n"
            )
        } else {
            let magic = if color == ColorModel::Gray { "P5" } else { "P6" };
            format!("{magic}\n{width} {height}\n{full}\n")
        };
        let mut out = header.into_bytes();
        match picture.samples() {
            SampleSlice::Eight(samples) => out.extend_from_slice(samples),
            SampleSlice::Sixteen(samples) => {
                out.extend(samples.iter().flat_map(|s| s.to_be_bytes()));
            }
        }
        out
    }
}

/// Whether colours are shown as others without this profile. Without any, they are taken for sRGB.
fn is_missed(profile: Vec<u8>) -> bool {
    let mut metadata = Metadata::default();
    metadata.icc_profile = Some(profile);
    metadata.retain(MetadataPolicy::None).contains(&MetadataLoss::ColorProfile)
}

fn write(mut encoder: impl ImageEncoder, picture: &StillImage) -> Result<()> {
    // What the format does not take has been dropped.
    if let Some(profile) = &picture.metadata.icc_profile {
        encoder.set_icc_profile(profile.clone())?;
    }
    if let Some(exif) = &picture.metadata.exif {
        encoder.set_exif_metadata(exif.clone())?;
    }
    Ok(DynamicImage::write_with_encoder(&picture.image, encoder)?)
}
