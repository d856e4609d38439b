//! A second decoder, for pictures that the one of `image` reads wrong without an error.

use std::io::Cursor;

use anyhow::{Result, bail};
use image::error::DecodingError;
use image::{ColorType, ImageDecoder, ImageError, ImageFormat, ImageResult};
use image_gip::{DecodeError, LimitKind};
use jpeg_decoder::{ColorTransform, Decoder, PixelFormat};

use super::survey::Colors;

/// Bytes for a pixel that it keeps besides the picture: its planes and all their coefficients.
const MEMORY: u64 = 12;

/// Width and height in pixels of what the usual decoder refuses; `None` if this does, too.
pub(crate) fn dimensions(file: &[u8]) -> Option<(u32, u32)> {
    let mut decoder = Decoder::new(file);
    decoder.read_info().ok()?;
    decoder.info().map(|info| (info.width.into(), info.height.into()))
}

/// A picture whose sampling, scans or colours are unusual.
pub(crate) struct Unusual<'a> {
    decoder: Decoder<Cursor<&'a [u8]>>,
    size: (u16, u16),
}

impl<'a> Unusual<'a> {
    /// Reads the header.
    pub(crate) fn new(file: &'a [u8], colors: Colors, max_memory: u64) -> Result<Self> {
        let mut decoder = Decoder::new(Cursor::new(file));
        decoder.set_color_transform(match colors {
            Colors::Rgb => ColorTransform::RGB,
            Colors::YCbCr => ColorTransform::YCbCr,
        });
        decoder.set_max_decoding_buffer_size(usize::try_from(max_memory).unwrap_or(usize::MAX));
        decoder.read_info().map_err(refused)?;
        let info = decoder.info().filter(|info| info.pixel_format == PixelFormat::RGB24);
        let info = info.ok_or_else(|| refused("its colours are not three"))?;
        let size = (info.width, info.height);
        let memory = u64::from(size.0) * u64::from(size.1) * MEMORY;
        if memory > max_memory {
            let kind = LimitKind::Memory;
            bail!(DecodeError::Limit { kind, wanted: memory, allowed: max_memory });
        }
        Ok(Self { decoder, size })
    }
}

impl ImageDecoder for Unusual<'_> {
    fn dimensions(&self) -> (u32, u32) {
        (self.size.0.into(), self.size.1.into())
    }

    fn color_type(&self) -> ColorType {
        ColorType::Rgb8
    }

    fn icc_profile(&mut self) -> ImageResult<Option<Vec<u8>>> {
        Ok(self.decoder.icc_profile())
    }

    fn exif_metadata(&mut self) -> ImageResult<Option<Vec<u8>>> {
        Ok(self.decoder.exif_data().map(<[u8]>::to_vec))
    }

    fn xmp_metadata(&mut self) -> ImageResult<Option<Vec<u8>>> {
        Ok(self.decoder.xmp_data().map(<[u8]>::to_vec))
    }

    fn read_image(mut self, buf: &mut [u8]) -> ImageResult<()> {
        let pixels = self.decoder.decode().map_err(refused)?;
        if pixels.len() != buf.len() {
            return Err(refused("it has fewer samples than pixels"));
        }
        buf.copy_from_slice(&pixels);
        Ok(())
    }

    fn read_image_boxed(self: Box<Self>, buf: &mut [u8]) -> ImageResult<()> {
        (*self).read_image(buf)
    }
}

fn refused(reason: impl Into<Box<dyn std::error::Error + Send + Sync>>) -> ImageError {
    ImageError::Decoding(DecodingError::new(ImageFormat::Jpeg.into(), reason))
}
