//! The formats that `image` reads.

use std::borrow::Cow;
use std::io::{BufRead, Cursor, Seek};

use anyhow::{Error, Result, bail};
use image::{ColorType, DynamicImage, ImageDecoder, ImageFormat, ImageReader, ImageResult};
use image_gip::Limits;

use super::fault::{self, Fault, SHORT};
use super::frames::{self, Others};
use super::stored::{Stored, partly};
use super::{
    bmp, clipping, colors, exr, hdr, ico, jpeg, light, metadata, png_chunks, screen, square, webp,
};
use crate::limits::check_size;
use crate::picture::DAMAGED_PROFILE;

/// Width and height in pixels.
pub(super) fn dimensions(
    format: ImageFormat,
    mut file: impl BufRead + Seek,
    limits: &Limits,
) -> Result<(u32, u32)> {
    let size = match format {
        ImageFormat::Png => png_chunks::size(&mut file).map_err(Error::from),
        _ => usual_decoder(format, &mut file, limits)
            .map(|decoder| decoder.dimensions())
            .map_err(Error::from),
    };
    let Err(error) = size else { return size };
    let mut bytes = Vec::new();
    file.rewind()?;
    file.read_to_end(&mut bytes)?;
    let mut damage = damage(format, &bytes);
    if format == ImageFormat::Jpeg {
        if let Some(size) = jpeg::dimensions(&bytes) {
            return Ok(size);
        }
        let jpeg = jpeg::survey(&bytes);
        if let Some(reason) = jpeg.unread() {
            bail!(reason);
        }
        damage = damage.or(jpeg.damage());
    }
    Err(damage.map_or(error, |damage| Fault::Damage(damage).into()))
}

pub(super) fn read(
    format: ImageFormat,
    file: &[u8],
    limits: &Limits,
    allow_partial: bool,
) -> Result<Stored> {
    let icon = (format == ImageFormat::Ico).then_some(file);
    let png = icon.and_then(ico::png).map(|png| (ImageFormat::Png, png));
    let (format, file) = png.unwrap_or((format, file));
    let damage = damage(format, file).or_else(|| ico::is_cut(icon?).then_some(SHORT));
    let (file, mut warnings) = match format {
        ImageFormat::Gif => (screen::of_first_frame(file), Vec::new()),
        ImageFormat::Png => png_chunks::without_damaged(file),
        ImageFormat::WebP if allow_partial => (webp::without_lost_metadata(file), Vec::new()),
        _ => (Cow::Borrowed(file), Vec::new()),
    };
    let jpeg = (format == ImageFormat::Jpeg).then(|| jpeg::survey(&file));
    if let Some(reason) = jpeg.as_ref().and_then(jpeg::Survey::unread) {
        bail!(reason);
    }
    let file = match &jpeg {
        Some(jpeg) if allow_partial => jpeg.closed(file),
        _ => file,
    };
    let file = &file[..];
    let png = (format == ImageFormat::Png).then(|| png_chunks::info(file)).flatten();
    let damage = damage.or_else(|| jpeg.as_ref()?.damage());
    let refused = |error| damage.map_or(error, |damage| Fault::Damage(damage).into());
    if format == ImageFormat::Png
        && let Ok(size) = png_chunks::size(Cursor::new(file))
    {
        // The decoder wants memory for rows at once, or finds the size too large for itself.
        check_size(limits, size)?;
    }
    let mut decoder = decoder(format, file, jpeg.as_ref(), limits).map_err(refused)?;
    check_size(limits, decoder.dimensions())?;
    let (metadata, losses) = metadata::read(&mut decoder, file)?;
    // The decoders of `image` know nothing of the prefix that was removed from Exif.
    let orientation = metadata.orientation();
    let others = Others::of(format, file, png.as_ref());
    warnings.extend(others.warning.or_else(|| ico::warning(icon?)));
    warnings.extend(losses.iter().map(ToString::to_string));
    if metadata.icc_profile.is_none() && jpeg.as_ref().is_some_and(|jpeg| jpeg.has_profile) {
        warnings.push(DAMAGED_PROFILE.to_owned());
    }
    if let Some(jpeg) = &jpeg {
        warnings.extend(jpeg.pictures.and_then(|count| frames::first_of(count, "pictures")));
    }
    let mut damage = damage.or(others.damage);
    if let Some(damage) = damage.filter(|_| !allow_partial) {
        bail!(Fault::Damage(damage));
    }
    let image = match DynamicImage::from_decoder(decoder) {
        Ok(image) => image,
        Err(error) => {
            damage = damage.or(fault::damage(&error));
            let is_partial = allow_partial && damage.is_some();
            let part = is_partial.then(|| partial(format, file, jpeg.as_ref(), limits));
            part.flatten().ok_or_else(|| refused(error.into()))?
        }
    };
    warnings.extend(damage.map(partly));
    warnings.extend(clipping::warning_of(&image));
    let mut stored = Stored { image: light::encoded(image), orientation, metadata, warnings };
    match format {
        ImageFormat::Jpeg => colors::of_exif(&mut stored.metadata),
        ImageFormat::Bmp => bmp::colors(file, &mut stored),
        ImageFormat::OpenExr => stored.warnings.extend(exr::lost(file)),
        ImageFormat::Hdr => stored.warnings.extend(hdr::lost(file)),
        _ => {}
    }
    if let Some(png) = &png {
        colors::of_png(png, &mut stored);
    }
    let density = match format {
        ImageFormat::Png => png.as_ref().and_then(square::of_png),
        ImageFormat::Jpeg => jpeg.as_ref().and_then(|jpeg| jpeg.density),
        ImageFormat::Gif => square::of_gif(file),
        ImageFormat::Bmp => bmp::density(file),
        _ => None,
    };
    stored.warnings.extend(density.and_then(|density| square::warning(density, orientation)));
    Ok(stored)
}

/// Damage that the decoder says nothing of.
fn damage(format: ImageFormat, file: &[u8]) -> Option<&'static str> {
    match format {
        ImageFormat::Png => png_chunks::is_cut(file).then_some(SHORT),
        ImageFormat::WebP => webp::damage(file),
        _ => None,
    }
}

/// The decoder that reads the file right.
fn decoder<'a>(
    format: ImageFormat,
    file: &'a [u8],
    jpeg: Option<&jpeg::Survey>,
    limits: &Limits,
) -> Result<Box<dyn ImageDecoder + 'a>> {
    Ok(match jpeg.and_then(jpeg::Survey::unusual) {
        Some(colors) => Box::new(jpeg::Unusual::new(file, colors, limits.max_memory)?),
        None => Box::new(usual_decoder(format, Cursor::new(file), limits)?),
    })
}

/// The size of the picture has a limit of its own, so that of memory is for all else.
fn usual_decoder<'a>(
    format: ImageFormat,
    file: impl BufRead + Seek + 'a,
    limits: &Limits,
) -> ImageResult<impl ImageDecoder + 'a> {
    let mut memory = image::Limits::no_limits();
    memory.max_alloc = Some(limits.max_memory);
    let mut reader = ImageReader::with_format(file, format);
    reader.limits(memory);
    reader.into_decoder()
}

/// What can be read before an error; `None` if that is nothing.
fn partial(
    format: ImageFormat,
    file: &[u8],
    jpeg: Option<&jpeg::Survey>,
    limits: &Limits,
) -> Option<DynamicImage> {
    let first = decoder(format, file, jpeg, limits).ok()?;
    let bytes = usize::try_from(first.total_bytes()).ok()?;
    let read = |decoder: Box<dyn ImageDecoder + '_>| {
        let image = DynamicImage::from_decoder(decoder).ok()?;
        let bytes = image.as_bytes();
        bytes.iter().any(|byte| *byte != bytes[0]).then_some(image)
    };
    let is_big_endian = format == ImageFormat::Png && has_16_bits(first.color_type());
    read(Box::new(Partial { decoder: first, is_big_endian })).or_else(|| {
        // Some decoders take all or nothing. They get as many zeros as there are samples.
        let mut longer = file.to_vec();
        longer.resize(file.len() + bytes, 0);
        read(decoder(format, &longer, jpeg, limits).ok()?)
    })
}

/// A decoder that takes the samples before an error for all of them.
struct Partial<D> {
    decoder: D,
    /// Whether samples are turned to those of the machine at the end, which an error leaves out.
    is_big_endian: bool,
}

impl<D: ImageDecoder> ImageDecoder for Partial<D> {
    fn dimensions(&self) -> (u32, u32) {
        self.decoder.dimensions()
    }

    fn color_type(&self) -> ColorType {
        self.decoder.color_type()
    }

    fn read_image(self, buf: &mut [u8]) -> ImageResult<()> {
        if self.decoder.read_image(buf).is_err() && self.is_big_endian {
            for sample in buf.as_chunks_mut::<2>().0 {
                *sample = u16::from_be_bytes(*sample).to_ne_bytes();
            }
        }
        Ok(())
    }

    fn read_image_boxed(self: Box<Self>, buf: &mut [u8]) -> ImageResult<()> {
        (*self).read_image(buf)
    }
}

fn has_16_bits(color: ColorType) -> bool {
    matches!(color, ColorType::L16 | ColorType::La16 | ColorType::Rgb16 | ColorType::Rgba16)
}
