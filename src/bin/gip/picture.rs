//! Pictures in memory: reading them, and converting their colour model and depth.

use std::fs::File;
use std::io::{self, BufRead, BufReader, Cursor, Seek};
use std::path::Path;

use anyhow::{Context, Result};
use image::metadata::Orientation;
use image::{DynamicImage, ImageDecoder, ImageError, ImageFormat, ImageReader};
use image_gip::{ColorModel, Metadata, SampleDepth};

use crate::files;

/// Most bytes that reading a picture may take: enough for 2^30 pixels of RGB at 8 bits.
const MAX_MEMORY: u64 = 4 << 30;
/// Longest side of a .gip file, in pixels.
const MAX_SIDE: u32 = 1 << 20;

/// A picture, with its Exif orientation applied, and its metadata.
#[derive(Debug)]
pub(crate) struct StillImage {
    /// Gray or RGB, with or without alpha, 8 or 16 bits: `image` has eight variants for these.
    pub(crate) image: DynamicImage,
    pub(crate) metadata: Metadata,
}

/// The samples of a picture.
#[derive(Clone, Copy, Debug)]
pub(crate) enum SampleSlice<'a> {
    Eight(&'a [u8]),
    Sixteen(&'a [u16]),
}

impl StillImage {
    /// Reads a picture of any format that `image` reads, .gip included.
    pub(crate) fn read(path: &Path) -> Result<Self> {
        let bytes = files::read(path)?;
        let name = || files::input_name(path);
        Self::decode(reader(path, Cursor::new(bytes)).with_context(name)?).with_context(name)
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

    fn decode(reader: ImageReader<impl BufRead + Seek>) -> Result<Self> {
        let mut limits = limits();
        let mut decoder = reader.into_decoder()?;
        limits.reserve(decoder.total_bytes())?;
        decoder.set_limits(limits)?;

        let orientation = decoder.orientation()?;
        let mut metadata = Metadata::default();
        metadata.icc_profile = decoder.icc_profile()?;
        metadata.exif = decoder.exif_metadata()?.and_then(tiff_stream);
        metadata.xmp = decoder.xmp_metadata()?;
        let image = stored_samples(DynamicImage::from_decoder(decoder)?);
        let mut picture = Self { image, metadata };
        picture.make_upright(orientation);
        picture.drop_foreign_profile();
        Ok(picture)
    }

    /// Applies an orientation to the pixels, and resets the orientation in the Exif, so that it is
    /// not applied again.
    pub(crate) fn make_upright(&mut self, orientation: Orientation) {
        self.image.apply_orientation(orientation);
        if let Some(exif) = &mut self.metadata.exif {
            let _reset = Orientation::remove_from_exif_chunk(exif);
        }
    }

    /// Drops an ICC profile for another colour space than that of the samples, such as the profile
    /// of a CMYK picture that was converted to RGB.
    pub(crate) fn drop_foreign_profile(&mut self) {
        let expected: &[u8] = if self.color().channels() < 3 { b"GRAY" } else { b"RGB " };
        self.metadata.icc_profile.take_if(|profile| profile.get(16..20) != Some(expected));
    }

    /// The colour model.
    pub(crate) fn color(&self) -> ColorModel {
        match self.image.color().channel_count() {
            1 => ColorModel::Gray,
            2 => ColorModel::GrayAlpha,
            3 => ColorModel::Rgb,
            _ => ColorModel::Rgba,
        }
    }

    /// Bits per sample.
    pub(crate) fn depth(&self) -> SampleDepth {
        match self.samples() {
            SampleSlice::Eight(_) => SampleDepth::Eight,
            SampleSlice::Sixteen(_) => SampleDepth::Sixteen,
        }
    }

    /// The interleaved samples.
    pub(crate) fn samples(&self) -> SampleSlice<'_> {
        match &self.image {
            DynamicImage::ImageLuma16(image) => SampleSlice::Sixteen(image),
            DynamicImage::ImageLumaA16(image) => SampleSlice::Sixteen(image),
            DynamicImage::ImageRgb16(image) => SampleSlice::Sixteen(image),
            DynamicImage::ImageRgba16(image) => SampleSlice::Sixteen(image),
            image => SampleSlice::Eight(image.as_bytes()),
        }
    }

    /// Drops an alpha channel that is opaque everywhere.
    pub(crate) fn drop_opaque_alpha(&mut self) {
        let color = match self.color() {
            ColorModel::GrayAlpha => ColorModel::Gray,
            ColorModel::Rgba => ColorModel::Rgb,
            _ => return,
        };
        let channels = self.color().channels();
        let opaque = match self.samples() {
            SampleSlice::Eight(samples) => is_opaque(samples, channels, &u8::MAX),
            SampleSlice::Sixteen(samples) => is_opaque(samples, channels, &u16::MAX),
        };
        if opaque {
            self.convert(color, self.depth());
        }
    }

    /// Converts colour model and depth. Adding channels or increasing the depth is lossless: gray
    /// is repeated as red, green and blue, missing alpha is opaque, and 8-bit samples are scaled.
    pub(crate) fn convert(&mut self, color: ColorModel, depth: SampleDepth) {
        if (color, depth) == (self.color(), self.depth()) {
            return;
        }
        let image = &self.image;
        self.image = match (color, depth) {
            (ColorModel::Gray, SampleDepth::Eight) => image.to_luma8().into(),
            (ColorModel::GrayAlpha, SampleDepth::Eight) => image.to_luma_alpha8().into(),
            (ColorModel::Rgb, SampleDepth::Eight) => image.to_rgb8().into(),
            (_, SampleDepth::Eight) => image.to_rgba8().into(),
            (ColorModel::Gray, _) => image.to_luma16().into(),
            (ColorModel::GrayAlpha, _) => image.to_luma_alpha16().into(),
            (ColorModel::Rgb, _) => image.to_rgb16().into(),
            _ => image.to_rgba16().into(),
        };
    }
}

/// The colour model with the fewest channels that has those of both.
pub(crate) fn widest(a: ColorModel, b: ColorModel) -> ColorModel {
    match (a.channels().max(b.channels()) >= 3, a.has_alpha() || b.has_alpha()) {
        (false, false) => ColorModel::Gray,
        (false, true) => ColorModel::GrayAlpha,
        (true, false) => ColorModel::Rgb,
        (true, true) => ColorModel::Rgba,
    }
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

fn is_opaque<T: PartialEq>(samples: &[T], channels: usize, full: &T) -> bool {
    samples.iter().skip(channels - 1).step_by(channels).all(|alpha| alpha == full)
}

/// The TIFF stream of Exif metadata: some programs write the prefix of JPEG's Exif marker before
/// it. `None` for anything else.
fn tiff_stream(mut exif: Vec<u8>) -> Option<Vec<u8>> {
    if exif.starts_with(b"Exif\0\0") {
        exif.drain(..6);
    }
    (exif.starts_with(b"II") || exif.starts_with(b"MM")).then_some(exif)
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
