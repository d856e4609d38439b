//! Reading a picture of any format.

use std::fs::File;
use std::io::{self, BufRead, BufReader, Cursor, Seek};
use std::path::Path;

use anyhow::{Context, Result};
use image::{DynamicImage, ImageDecoder, ImageError, ImageFormat, ImageReader};

use super::{frames, metadata};
use crate::files;
use crate::picture::StillImage;

/// Most bytes that reading a picture may take: enough for 2^30 pixels of RGB at 8 bits.
const MAX_MEMORY: u64 = 4 << 30;
/// Longest side of a .gip file, in pixels.
const MAX_SIDE: u32 = 1 << 20;

/// Reads a picture of any format that `image` reads, .gip included.
pub(crate) fn read(path: &Path) -> Result<StillImage> {
    let bytes = files::read(path)?;
    decode(path, &bytes).with_context(|| files::input_name(path))
}

/// Width and height in pixels as they are stored, before the orientation is applied.
pub(crate) fn dimensions(path: &Path) -> Result<(u32, u32)> {
    let name = || files::input_name(path);
    let file = BufReader::new(File::open(path).with_context(name)?);
    reader(path, file)
        .map_err(ImageError::from)
        .and_then(ImageReader::into_dimensions)
        .with_context(name)
}

fn decode(path: &Path, file: &[u8]) -> Result<StillImage> {
    let reader = reader(path, Cursor::new(file))?;
    let format = reader.format();
    let warnings = format.and_then(|format| frames::warning(format, file));
    let mut limits = limits();
    let mut decoder = reader.into_decoder()?;
    limits.reserve(decoder.total_bytes())?;
    decoder.set_limits(limits)?;

    let (metadata, loss) = metadata::read(&mut decoder, format, file)?;
    let orientation = metadata::orientation(&mut decoder, format, &metadata)?;
    let image = stored_samples(DynamicImage::from_decoder(decoder)?);
    let warnings = warnings.into_iter().chain(loss.map(|loss| loss.to_string())).collect();
    let mut picture = StillImage { image, metadata, warnings };
    picture.make_upright(orientation);
    picture.drop_foreign_profile();
    Ok(picture)
}

/// A reader of the picture at `path`, which has these contents.
fn reader<R: BufRead + Seek>(path: &Path, contents: R) -> io::Result<ImageReader<R>> {
    let mut reader = ImageReader::new(contents);
    // A format without a signature is recognized by its extension.
    if let Ok(format) = ImageFormat::from_path(path) {
        reader.set_format(format);
    }
    reader.limits(limits());
    reader.with_guessed_format()
}

fn limits() -> image::Limits {
    let mut limits = image::Limits::default();
    limits.max_image_width = Some(MAX_SIDE);
    limits.max_image_height = Some(MAX_SIDE);
    limits.max_alloc = Some(MAX_MEMORY);
    limits
}

/// The picture with samples that a .gip file can hold: floats are taken as linear light, encoded as
/// sRGB, and clipped and rounded to 16 bits.
fn stored_samples(image: DynamicImage) -> DynamicImage {
    let encode = |linear: f32| match linear {
        0.003_130_8.. => 1.055 * linear.powf(1.0 / 2.4) - 0.055,
        0.0.. => linear * 12.92,
        // Negative, or not a number.
        _ => 0.0,
    };
    match image {
        DynamicImage::ImageRgb32F(mut image) => {
            for pixel in image.pixels_mut() {
                pixel.0 = pixel.0.map(encode);
            }
            DynamicImage::from(image).to_rgb16().into()
        }
        DynamicImage::ImageRgba32F(mut image) => {
            for pixel in image.pixels_mut() {
                let [r, g, b, a] = pixel.0;
                pixel.0 = [encode(r), encode(g), encode(b), a];
            }
            DynamicImage::from(image).to_rgba16().into()
        }
        image => image,
    }
}
