//! The integration with the `image` crate: hooks, [`GipDecoder`], and with the feature `encode`
//! `GipEncoder`.
//!
//! The names have a prefix because they are used next to those of `image`.

use std::io::Read;
use std::sync::OnceLock;

use ::image::error::{
    DecodingError, ImageFormatHint, LimitError, LimitErrorKind, ParameterError, ParameterErrorKind,
    UnsupportedError, UnsupportedErrorKind,
};
use ::image::hooks::{register_decoding_hook, register_format_detection_hook};
use ::image::metadata::{
    CicpColorPrimaries as Primaries, CicpTransferCharacteristics as Transfer, Orientation,
};
use ::image::{ColorType, ImageDecoder, ImageDecoderRect, ImageError, ImageResult};

use crate::chunk::MAGIC;
use crate::color::{ColorModel, SampleDepth};
use crate::container::{Cicp, Metadata};
use crate::decode::Decoder;
use crate::error::{DecodeError, LimitKind};
use crate::limits::Limits;
use crate::region::Region;
use crate::render::RenderOptions;

/// The extension of `.gip` files, in the form that `image` expects.
const EXTENSION: &str = "gip";

/// Makes `image` read `.gip` files. They are recognized by their extension, as in `image::open`,
/// and by their content, as in `ImageReader::with_guessed_format` and `image::load_from_memory`.
///
/// Call it once at the start of the program; further calls do nothing. Returns whether `image` now
/// uses this crate for `.gip`: `false` means that another decoder was registered for the extension
/// before, and remains.
///
/// `image` has no such hook for writing: use `GipEncoder` (feature `encode`) with
/// `DynamicImage::write_with_encoder`.
///
/// ```no_run
/// # fn main() -> image::ImageResult<()> {
/// image_gip::register();
/// let picture = image::open("picture.gip")?;
/// # Ok(())
/// # }
/// ```
pub fn register() -> bool {
    static REGISTERED: OnceLock<bool> = OnceLock::new();
    *REGISTERED.get_or_init(|| {
        // `image` has limits of its own for width, height and memory, which its caller sets.
        let limits = Limits {
            max_width: u32::MAX,
            max_height: u32::MAX,
            max_pixels: u64::MAX,
            ..Limits::default()
        };
        let registered = register_decoding_hook(
            EXTENSION.into(),
            Box::new(move |reader| {
                Ok(Box::new(GipDecoder::new_with_limits(reader, limits.clone())?))
            }),
        );
        if registered {
            register_format_detection_hook(EXTENSION.into(), &MAGIC, None);
        }
        registered
    })
}

/// Decodes `.gip` for `image`: an [`ImageDecoder`] and [`ImageDecoderRect`] over any reader. The
/// samples have the file's own colour model and depth, and the picture is as stored:
/// [`ImageDecoder::orientation`] tells how to turn it for display.
///
/// A file that ends too early is an error. For the picture of the Gaussians that have arrived, use
/// [`Decoder`].
#[derive(Debug)]
pub struct GipDecoder<R> {
    decoder: Decoder<R>,
    limits: Limits,
    /// Width and height of the whole output in pixels.
    size: (u32, u32),
    texture: bool,
}

impl<R: Read> GipDecoder<R> {
    /// Reads the file up to its first layer, with the default [`Limits`].
    ///
    /// # Errors
    /// As [`Decoder::new`].
    pub fn new(reader: R) -> ImageResult<Self> {
        Self::new_with_limits(reader, Limits::default())
    }

    /// Reads the file up to its first layer, with the given limits.
    ///
    /// # Errors
    /// As [`Decoder::new_with_limits`].
    pub fn new_with_limits(reader: R, limits: Limits) -> ImageResult<Self> {
        let decoder = Decoder::new_with_limits(reader, limits.clone())?;
        let size = (decoder.header().width, decoder.header().height);
        Ok(Self { decoder, limits, size, texture: true })
    }

    /// Renders the whole picture with `width` x `height` pixels instead of its stored size; see
    /// [`RenderOptions::with_size`]. Dimensions and rectangles are then in pixels of that size.
    ///
    /// # Errors
    /// When a side is zero or exceeds the limits. The size then remains as it was.
    pub fn set_size(&mut self, width: u32, height: u32) -> ImageResult<()> {
        if width == 0 || height == 0 {
            return Err(parameter(format!(
                "an output size of {width}x{height}; each side must be at least 1"
            )));
        }
        self.limits.check_size(width, height)?;
        self.size = (width, height);
        Ok(())
    }

    /// The colour space that the file says in codes, for [`DynamicImage::set_color_space`](::image::DynamicImage::set_color_space);
    /// `image` asks a decoder for an ICC profile alone. It counts before the profile. `None` if there is none, or if
    /// `image` does not know its codes.
    #[must_use]
    pub fn color_space(&self) -> Option<::image::metadata::Cicp> {
        let Cicp { primaries, transfer } = self.decoder.metadata().cicp?;
        Some(::image::metadata::Cicp {
            primaries: PRIMARIES.into_iter().find(|&code| code as u8 == primaries)?,
            transfer: TRANSFERS.into_iter().find(|&code| code as u8 == transfer)?,
            ..::image::metadata::Cicp::SRGB
        })
    }

    /// Whether the picture's texture is rendered; see [`RenderOptions::with_texture`]. Default `true`.
    pub fn set_texture(&mut self, texture: bool) {
        self.texture = texture;
    }

    /// Part of the metadata. What is not there yet may stand after the layers.
    fn metadata_with<T>(
        &mut self,
        find: impl Fn(&Metadata) -> Option<T>,
    ) -> ImageResult<Option<T>> {
        match find(self.decoder.metadata()) {
            None => Ok(find(self.decoder.read_metadata()?)),
            found => Ok(found),
        }
    }

    /// Renders a region into rows that begin `row_pitch` bytes apart.
    fn render(&mut self, region: Region, buf: &mut [u8], row_pitch: usize) -> ImageResult<()> {
        let (width, height) = self.size;
        let options = RenderOptions::new().with_size(width, height).with_region(region);
        let options = options.with_texture(self.texture);
        self.decoder.set_options(options);
        let depth = self.decoder.header().depth;
        let row = region.width as usize * usize::from(self.color_type().bytes_per_pixel());
        let samples = self.decoder.output_len()?;
        // The decoder does not know of a copy of the output, which is checked by itself.
        let copy = (samples as u64).saturating_mul(depth.bytes() as u64);
        let scratch = || self.limits.check_memory(copy);
        match depth {
            SampleDepth::Eight if row_pitch == row => {
                let length = samples.min(buf.len());
                self.decoder.decode_into(&mut buf[..length])?;
            }
            SampleDepth::Eight => {
                scratch()?;
                let mut out = vec![0; samples];
                self.decoder.decode_into(&mut out)?;
                for (to, from) in buf.chunks_mut(row_pitch).zip(out.chunks_exact(row)) {
                    to[..row].copy_from_slice(from);
                }
            }
            SampleDepth::Sixteen => {
                scratch()?;
                let mut out = vec![0_u16; samples];
                self.decoder.decode_into_u16(&mut out)?;
                for (to, from) in buf.chunks_mut(row_pitch).zip(out.chunks_exact(row / 2)) {
                    for (to, from) in to.chunks_exact_mut(2).zip(from) {
                        to.copy_from_slice(&from.to_ne_bytes());
                    }
                }
            }
        }
        Ok(())
    }
}

impl<R: Read> ImageDecoder for GipDecoder<R> {
    fn dimensions(&self) -> (u32, u32) {
        self.size
    }

    fn color_type(&self) -> ColorType {
        let header = self.decoder.header();
        match (header.color, header.depth) {
            (ColorModel::Gray, SampleDepth::Eight) => ColorType::L8,
            (ColorModel::GrayAlpha, SampleDepth::Eight) => ColorType::La8,
            (ColorModel::Rgb, SampleDepth::Eight) => ColorType::Rgb8,
            (ColorModel::Rgba, SampleDepth::Eight) => ColorType::Rgba8,
            (ColorModel::Gray, SampleDepth::Sixteen) => ColorType::L16,
            (ColorModel::GrayAlpha, SampleDepth::Sixteen) => ColorType::La16,
            (ColorModel::Rgb, SampleDepth::Sixteen) => ColorType::Rgb16,
            (ColorModel::Rgba, SampleDepth::Sixteen) => ColorType::Rgba16,
        }
    }

    fn icc_profile(&mut self) -> ImageResult<Option<Vec<u8>>> {
        // It comes before the first layer, up to which the file was read.
        Ok(self.decoder.metadata().icc_profile.clone())
    }

    fn exif_metadata(&mut self) -> ImageResult<Option<Vec<u8>>> {
        self.metadata_with(|metadata| metadata.exif.clone())
    }

    fn xmp_metadata(&mut self) -> ImageResult<Option<Vec<u8>>> {
        self.metadata_with(|metadata| metadata.xmp.clone())
    }

    fn orientation(&mut self) -> ImageResult<Orientation> {
        // It stands before the layers.
        let orientation = Orientation::from_exif(self.decoder.metadata().orientation().to_exif());
        Ok(orientation.unwrap_or(Orientation::NoTransforms))
    }

    /// Checks `max_image_width` and `max_image_height`, and uses `max_alloc` as the limit of all
    /// memory but the caller's buffer. The limits that `image` does not have, of the number of
    /// Gaussians and of the work of rendering, remain as they were.
    fn set_limits(&mut self, limits: ::image::Limits) -> ImageResult<()> {
        limits.check_support(&::image::LimitSupport::default())?;
        let (width, height) = self.dimensions();
        limits.check_dimensions(width, height)?;
        // The stored size is not checked: it may be larger than the requested one, which costs
        // nothing.
        self.limits.max_memory = limits.max_alloc.unwrap_or(u64::MAX);
        Ok(self.decoder.set_limits(self.limits.clone())?)
    }

    fn read_image(mut self, buf: &mut [u8]) -> ImageResult<()> {
        assert_eq!(buf.len() as u64, self.total_bytes(), "the buffer has the picture's size");
        let (width, height) = self.size;
        let row_pitch = buf.len() / height as usize;
        self.render(Region { x: 0, y: 0, width, height }, buf, row_pitch)
    }

    fn read_image_boxed(self: Box<Self>, buf: &mut [u8]) -> ImageResult<()> {
        (*self).read_image(buf)
    }
}

impl<R: Read> ImageDecoderRect for GipDecoder<R> {
    /// Renders only this rectangle, and skips layers that do not show in it, so that the cost
    /// depends on its size. It may be called any number of times. The first call reads the whole
    /// file.
    fn read_rect(
        &mut self,
        x: u32,
        y: u32,
        width: u32,
        height: u32,
        buf: &mut [u8],
        row_pitch: usize,
    ) -> ImageResult<()> {
        let row = u64::from(width) * u64::from(self.color_type().bytes_per_pixel());
        let needed = (row_pitch as u64)
            .checked_mul(u64::from(height.saturating_sub(1)))
            .and_then(|bytes| bytes.checked_add(row));
        if (row_pitch as u64) < row || needed.is_none_or(|needed| (buf.len() as u64) < needed) {
            return Err(parameter(format!(
                "a buffer of {} bytes with {row_pitch} per row is too small for {width}x{height} pixels",
                buf.len()
            )));
        }
        self.render(Region { x, y, width, height }, buf, row_pitch)
    }
}

/// All codes that `image` knows, which does not make them of numbers.
const PRIMARIES: [Primaries; 12] = [
    Primaries::SRgb,
    Primaries::Unspecified,
    Primaries::RgbM,
    Primaries::RgbB,
    Primaries::Bt601,
    Primaries::Rgb240m,
    Primaries::GenericFilm,
    Primaries::Rgb2020,
    Primaries::Xyz,
    Primaries::SmpteRp431,
    Primaries::SmpteRp432,
    Primaries::Industry22,
];
const TRANSFERS: [Transfer; 17] = [
    Transfer::Bt709,
    Transfer::Unspecified,
    Transfer::Bt470M,
    Transfer::Bt470BG,
    Transfer::Bt601,
    Transfer::Smpte240m,
    Transfer::Linear,
    Transfer::Log100,
    Transfer::LogSqrt,
    Transfer::Iec61966_2_4,
    Transfer::Bt1361,
    Transfer::SRgb,
    Transfer::Bt2020_10bit,
    Transfer::Bt2020_12bit,
    Transfer::Smpte2084,
    Transfer::Smpte428,
    Transfer::Bt2100Hlg,
];

impl From<DecodeError> for ImageError {
    fn from(error: DecodeError) -> Self {
        match error {
            DecodeError::Limit { kind, .. } => {
                let kind = match kind {
                    LimitKind::Width | LimitKind::Height | LimitKind::Pixels => {
                        LimitErrorKind::DimensionError
                    }
                    // `image` knows no other kind.
                    LimitKind::Gaussians | LimitKind::Memory | LimitKind::Work => {
                        LimitErrorKind::InsufficientMemory
                    }
                };
                Self::Limits(LimitError::from_kind(kind))
            }
            DecodeError::Unsupported { .. } => {
                let kind = UnsupportedErrorKind::GenericFeature(error.to_string());
                Self::Unsupported(UnsupportedError::from_format_and_kind(hint(), kind))
            }
            DecodeError::Request(request) => parameter(request.to_string()),
            DecodeError::AlreadyFailed => {
                Self::Parameter(ParameterError::from_kind(ParameterErrorKind::FailedAlready))
            }
            DecodeError::Io(error) => Self::IoError(error),
            DecodeError::Signature
            | DecodeError::Malformed { .. }
            | DecodeError::UnexpectedEnd { .. } => {
                Self::Decoding(DecodingError::new(hint(), error))
            }
        }
    }
}

fn parameter(what: String) -> ImageError {
    ImageError::Parameter(ParameterError::from_kind(ParameterErrorKind::Generic(what)))
}

fn hint() -> ImageFormatHint {
    ImageFormatHint::Name("GIP".into())
}

#[cfg(feature = "encode")]
pub use encoder::GipEncoder;

#[cfg(feature = "encode")]
mod encoder {
    use core::fmt;
    use std::io::Write;

    use ::image::error::{EncodingError, UnsupportedError, UnsupportedErrorKind};
    use ::image::{ExtendedColorType, ImageEncoder, ImageError, ImageResult};

    use super::{hint, parameter};
    use crate::color::{ColorModel, SampleDepth};
    use crate::container::Cicp;
    use crate::encode::{EncodeError, Encoder, Source, SourceError};

    /// Encodes `.gip` for `image`: an [`ImageEncoder`] over any writer, for 8- and 16-bit gray and
    /// RGB pictures with or without alpha.
    ///
    /// The metadata are those of [`Encoder::with_metadata`], with the profile and the Exif that are set here
    /// in the place of its own. Only they can have XMP, of which `image` has no method. Nothing is filtered
    /// or reset.
    ///
    /// ```no_run
    /// # fn main() -> Result<(), Box<dyn std::error::Error>> {
    /// # let picture = image::DynamicImage::new_rgb8(64, 64);
    /// let file = std::fs::File::create("picture.gip")?;
    /// picture.write_with_encoder(image_gip::GipEncoder::new(file))?;
    /// # Ok(())
    /// # }
    /// ```
    pub struct GipEncoder<W> {
        writer: W,
        encoder: Encoder,
    }

    impl<W> GipEncoder<W> {
        /// An encoder with the default options of [`Encoder`].
        pub fn new(writer: W) -> Self {
            Self::with_encoder(writer, Encoder::new())
        }

        /// An encoder with the options of `encoder`.
        pub fn with_encoder(writer: W, encoder: Encoder) -> Self {
            Self { writer, encoder }
        }

        /// Stores a colour space in codes, such as
        /// [`DynamicImage::color_space`](::image::DynamicImage::color_space), which `image` does not hand to an
        /// encoder. That of sRGB is what a file without codes is in, and is left out.
        ///
        /// # Errors
        /// When samples are transformed by a matrix, or are not of full range.
        pub fn with_color_space(
            mut self,
            color_space: ::image::metadata::Cicp,
        ) -> ImageResult<Self> {
            let ::image::metadata::Cicp { primaries, transfer, matrix, full_range } = color_space;
            let srgb = ::image::metadata::Cicp::SRGB;
            if (matrix, full_range) != (srgb.matrix, srgb.full_range) {
                let what = format!("colour space of {matrix:?} and {full_range:?}");
                let kind = UnsupportedErrorKind::GenericFeature(what);
                let error = UnsupportedError::from_format_and_kind(hint(), kind);
                return Err(ImageError::Unsupported(error));
            }
            let cicp = Cicp::new(primaries as u8, transfer as u8);
            self.encoder.metadata.cicp = Some(cicp).filter(|cicp| *cicp != Cicp::SRGB);
            Ok(self)
        }
    }

    // Not derived, because a writer need not have `Debug`.
    impl<W> fmt::Debug for GipEncoder<W> {
        fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
            f.debug_struct("GipEncoder").field("encoder", &self.encoder).finish_non_exhaustive()
        }
    }

    impl<W: Write> ImageEncoder for GipEncoder<W> {
        fn write_image(
            mut self,
            buf: &[u8],
            width: u32,
            height: u32,
            color_type: ExtendedColorType,
        ) -> ImageResult<()> {
            let (color, depth) = match color_type {
                ExtendedColorType::L8 => (ColorModel::Gray, SampleDepth::Eight),
                ExtendedColorType::La8 => (ColorModel::GrayAlpha, SampleDepth::Eight),
                ExtendedColorType::Rgb8 => (ColorModel::Rgb, SampleDepth::Eight),
                ExtendedColorType::Rgba8 => (ColorModel::Rgba, SampleDepth::Eight),
                ExtendedColorType::L16 => (ColorModel::Gray, SampleDepth::Sixteen),
                ExtendedColorType::La16 => (ColorModel::GrayAlpha, SampleDepth::Sixteen),
                ExtendedColorType::Rgb16 => (ColorModel::Rgb, SampleDepth::Sixteen),
                ExtendedColorType::Rgba16 => (ColorModel::Rgba, SampleDepth::Sixteen),
                _ => {
                    let kind = UnsupportedErrorKind::Color(color_type);
                    let error = UnsupportedError::from_format_and_kind(hint(), kind);
                    return Err(ImageError::Unsupported(error));
                }
            };
            let encoded = match depth {
                SampleDepth::Eight => {
                    self.encoder.encode(&Source::new_u8(width, height, color, buf)?)
                }
                SampleDepth::Sixteen => {
                    let (samples, rest) = buf.as_chunks();
                    if !rest.is_empty() {
                        return Err(parameter("the buffer ends within a 16-bit sample".into()));
                    }
                    let samples: Vec<_> = samples.iter().copied().map(u16::from_ne_bytes).collect();
                    self.encoder.encode(&Source::new_u16(width, height, color, &samples)?)
                }
            }?;
            self.writer.write_all(&encoded.bytes)?;
            Ok(self.writer.flush()?)
        }

        fn set_icc_profile(&mut self, icc_profile: Vec<u8>) -> Result<(), UnsupportedError> {
            self.encoder.metadata.icc_profile = Some(icc_profile);
            Ok(())
        }

        fn set_exif_metadata(&mut self, exif: Vec<u8>) -> Result<(), UnsupportedError> {
            self.encoder.metadata.exif = Some(exif);
            Ok(())
        }
    }

    impl From<SourceError> for ImageError {
        fn from(error: SourceError) -> Self {
            EncodeError::from(error).into()
        }
    }

    impl From<EncodeError> for ImageError {
        fn from(error: EncodeError) -> Self {
            match error {
                EncodeError::Source(_) | EncodeError::Option(_) | EncodeError::Limit { .. } => {
                    parameter(error.to_string())
                }
                EncodeError::Cancelled => Self::Encoding(EncodingError::new(hint(), error)),
            }
        }
    }
}
