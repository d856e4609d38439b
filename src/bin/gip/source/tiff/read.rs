//! From a TIFF to a picture.

use std::io::{BufRead, Cursor, Seek};

use anyhow::{Context, Result, bail};
use image::ImageFormat;
use image_gip::{Limits, Metadata, Orientation};
use tiff::TiffResult;
use tiff::decoder::Decoder;
use tiff::tags::Tag;

use super::tags::{Photometric, Tags};
use super::{colors, samples};
use crate::limits::check_size;
use crate::picture::DAMAGED_PROFILE;
use crate::source::stored::{Stored, partly};
use crate::source::{frames, jpeg};

/// Width and height in pixels.
pub(crate) fn dimensions(file: impl BufRead + Seek) -> TiffResult<(u32, u32)> {
    Decoder::new(file)?.dimensions()
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
    metadata.icc_profile = decoder.get_tag_u8_vec(Tag::IccProfile).ok();
    let has_profile = matches!(decoder.find_tag(Tag::IccProfile), Err(_) | Ok(Some(_)));
    metadata.set_exif_of_tiff(file);
    metadata.xmp = decoder.get_tag_u8_vec(Tag::Unknown(700)).ok();
    let orientation = decoder.find_tag_unsigned::<u16>(Tag::Orientation)?;
    let orientation = orientation.and_then(|code| Orientation::from_exif(code.min(255) as u8));

    let mut warnings: Vec<_> = frames::warning(ImageFormat::Tiff, file).into_iter().collect();
    if has_profile && metadata.icc_profile.is_none() {
        warnings.push(DAMAGED_PROFILE.to_owned());
    }
    if tags.is_jpeg {
        let jpegs = samples::jpegs(&mut decoder, file)?;
        if let Some(damage) = jpegs.iter().find_map(|data| jpeg::survey(data).damage()) {
            if !allow_partial {
                bail!("the file is damaged: {damage}");
            }
            warnings.push(partly(damage));
        }
    }
    let memory = samples::limits(limits.max_memory, &tags);
    let (samples, damage, clipped) = samples::read(file, &tags, memory, allow_partial)?;
    warnings.extend(damage.map(partly));
    warnings.extend(clipped);
    if matches!(tags.photometric, Photometric::CieLab | Photometric::IccLab) {
        warnings.push("its CIELAB colours are turned to sRGB; what sRGB lacks is clipped".into());
    } else if tags.has_colorimetry && metadata.icc_profile.is_none() {
        warnings.push("its white point, primaries or transfer function cannot be kept".into());
    }
    let image = colors::picture(samples, &tags).context("it has too few samples")?;
    let orientation = orientation.unwrap_or_default();
    Ok(Stored { image, orientation, metadata, warnings })
}
