//! The formats that `image` reads.

use std::borrow::Cow;
use std::io::{BufRead, Cursor, Seek};

use anyhow::{Result, bail};
use image::{ColorType, DynamicImage, ImageDecoder, ImageFormat, ImageReader, ImageResult};
use image_gip::Limits;

use super::stored::{Stored, partly};
use super::{clipping, colors, frames, ico, jpeg, light, metadata, png_chunks, screen};
use crate::limits::check_size;

/// Width and height in pixels.
pub(super) fn dimensions(
    format: ImageFormat,
    file: impl BufRead + Seek,
    limits: &Limits,
) -> Result<(u32, u32)> {
    if format == ImageFormat::Png {
        // Chunks that are damaged do not matter here.
        return Ok(png::Decoder::new(file).read_header_info()?.size());
    }
    Ok(decoder(format, file, limits)?.dimensions())
}

pub(super) fn read(
    format: ImageFormat,
    file: &[u8],
    limits: &Limits,
    allow_partial: bool,
) -> Result<Stored> {
    if format == ImageFormat::Ico
        && let Some(png) = ico::png(file)
    {
        return read(ImageFormat::Png, png, limits, allow_partial);
    }
    let (file, mut warnings) = match format {
        ImageFormat::Gif => (screen::of_first_frame(file), Vec::new()),
        ImageFormat::Png => png_chunks::without_damaged(file),
        _ => (Cow::Borrowed(file), Vec::new()),
    };
    let file = &file[..];
    let mut decoder = decoder(format, Cursor::new(file), limits)?;
    check_size(limits, decoder.dimensions())?;
    let (metadata, loss) = metadata::read(&mut decoder, file)?;
    // The decoders of `image` know nothing of the prefix that was removed from Exif.
    let orientation = metadata.orientation();
    warnings.extend(frames::warning(format, file));
    warnings.extend(loss.map(|loss| loss.to_string()));
    let mut damage = damage(format, file).map(String::from);
    if let Some(damage) = damage.as_ref().filter(|_| !allow_partial) {
        bail!("the file is damaged: {damage}");
    }
    let image = match DynamicImage::from_decoder(decoder) {
        Err(error) if allow_partial => {
            damage.get_or_insert_with(|| error.to_string());
            partial(format, file, limits).ok_or(error)?
        }
        image => image?,
    };
    warnings.extend(damage.map(partly));
    warnings.extend(clipping::warning_of(&image));
    let mut stored = Stored { image: light::encoded(image), orientation, metadata, warnings };
    match format {
        ImageFormat::Jpeg => colors::of_exif(&mut stored.metadata),
        ImageFormat::Png => colors::of_png(file, &mut stored),
        ImageFormat::OpenExr => stored.warnings.extend(colors::lost_of_exr(file)),
        ImageFormat::Hdr => stored.warnings.extend(colors::lost_of_hdr(file)),
        _ => {}
    }
    Ok(stored)
}

/// Damage that the decoder says nothing of.
fn damage(format: ImageFormat, file: &[u8]) -> Option<&'static str> {
    match format {
        ImageFormat::Jpeg => jpeg::damage(file),
        ImageFormat::WebP => {
            let length = u32::from_le_bytes(*file.get(4..)?.first_chunk()?);
            (u64::from(length) + 8 > file.len() as u64).then_some("the data end too early")
        }
        _ => None,
    }
}

/// The size of the picture has a limit of its own, so that of memory is for all else.
fn decoder<'a>(
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
fn partial(format: ImageFormat, file: &[u8], limits: &Limits) -> Option<DynamicImage> {
    let first = decoder(format, Cursor::new(file), limits).ok()?;
    let bytes = usize::try_from(first.total_bytes()).ok()?;
    let read = |decoder| {
        let image = DynamicImage::from_decoder(decoder).ok()?;
        let bytes = image.as_bytes();
        bytes.iter().any(|byte| *byte != bytes[0]).then_some(image)
    };
    let is_big_endian = format == ImageFormat::Png && has_16_bits(first.color_type());
    read(Box::new(Partial { decoder: first, is_big_endian }) as Box<dyn ImageDecoder>).or_else(
        || {
            // Some decoders take all or nothing. They get as many zeros as there are samples.
            let mut longer = file.to_vec();
            longer.resize(file.len() + bytes, 0);
            read(Box::new(decoder(format, Cursor::new(longer), limits).ok()?))
        },
    )
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
