//! From a TIFF to a picture.

use std::io::{BufRead, Cursor, Seek};

use anyhow::{Context, Result, bail};
use image_gip::{Limits, Metadata, MetadataLoss, Orientation};
use tiff::decoder::Decoder;
use tiff::decoder::ifd::Value;
use tiff::tags::Tag;

use super::tags::{Photometric, Tags};
use super::{colors, pages, samples, strips};
use crate::limits::check_size;
use crate::picture::DAMAGED_PROFILE;
use crate::source::fault::{Fault, SHORT};
use crate::source::frames::Others;
use crate::source::stored::{Stored, left_out, partly};
use crate::source::{jpeg, square};

const XMP: Tag = Tag::Unknown(700);

/// Width and height in pixels.
pub(crate) fn dimensions(file: impl BufRead + Seek) -> Result<(u32, u32)> {
    Ok(Decoder::new(file)?.dimensions()?)
}

pub(crate) fn read(file: &[u8], limits: &Limits, allow_partial: bool) -> Result<Stored> {
    let mut decoder = Decoder::new(Cursor::new(file))?;
    check_size(limits, decoder.dimensions()?)?;
    let tags = Tags::read(&mut decoder)?.context("its colour model is not read")?;
    if tags.samples < tags.photometric.colors() {
        bail!("it has fewer channels than its colours need");
    }
    if tags.photometric == Photometric::YCbCr && !tags.is_jpeg && tags.subsampling != (1, 1) {
        bail!("YCbCr with fewer samples of chroma is read only from JPEG data");
    }
    let mut metadata = Metadata::default();
    let mut lost = Vec::new();
    let mut bytes = |tag, damaged: &str| {
        let bytes = |value| match value {
            Value::Ascii(text) => Ok(text.into_bytes()),
            other => other.into_u8_vec(),
        };
        let value = decoder.find_tag(tag).and_then(|value| value.map(bytes).transpose());
        value.unwrap_or_else(|_| {
            lost.push(damaged.to_owned());
            None
        })
    };
    metadata.icc_profile = bytes(Tag::IccProfile, DAMAGED_PROFILE);
    metadata.xmp = bytes(XMP, &MetadataLoss::DamagedXmp.to_string());
    metadata.set_exif_of_tiff(file);
    let orientation = decoder.find_tag_unsigned::<u16>(Tag::Orientation)?;
    let orientation = orientation
        .and_then(|code| Orientation::from_exif(code.min(255) as u8))
        .unwrap_or_default();

    let others = Others::after_first("pages", pages::pages(file));
    let mut warnings: Vec<_> = others.warning.into_iter().collect();
    warnings.extend(lost);
    warnings.extend(left_out(tags.extra_channels(), tags.samples));
    let mut damage = others.damage;
    if tags.is_jpeg {
        let jpegs = samples::jpegs(&mut decoder, file)?;
        damage = jpegs.iter().find_map(|data| jpeg::survey(data).damage()).or(damage);
    }
    if let Some(damage) = damage.filter(|_| !allow_partial) {
        bail!(Fault::Damage(damage));
    }
    // What decoders say of compressed data that end is that they are invalid.
    let cut = strips::is_cut(&mut decoder, file).then_some(SHORT);
    let read = samples::read(file, &tags, limits.max_memory, allow_partial);
    let (samples, stop, clipped) =
        read.map_err(|error| cut.map_or(error, |cut| Fault::Damage(cut).into()))?;
    warnings.extend(damage.or(stop.and(cut)).or(stop).map(partly));
    warnings.extend(clipped);
    if matches!(tags.photometric, Photometric::CieLab | Photometric::IccLab) {
        warnings.push("its CIELAB colours are turned to sRGB; what sRGB lacks is clipped".into());
    } else if tags.has_colorimetry && metadata.icc_profile.is_none() {
        warnings.push("its white point, primaries or transfer function cannot be kept".into());
    }
    warnings.extend(tags.density.and_then(|density| square::warning(density, orientation)));
    let image = colors::picture(samples, &tags).context("it has too few samples")?;
    Ok(Stored { image, orientation, metadata, warnings })
}
