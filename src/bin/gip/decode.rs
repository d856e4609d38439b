//! `gip decode`.

use std::io::Read;

use anyhow::{Context, Result, anyhow, bail};
use image::{DynamicImage, ImageBuffer, Pixel};
use image_gip::{
    ColorModel, DecodeError, Decoder, Header, Limits, Metadata, MetadataPolicy, Orientation,
    Picture, RenderOptions, RequestError, SampleDepth, StreamDecoder,
};

use crate::args;
use crate::codec::Codec;
use crate::files::{self, Output};
use crate::picture::StillImage;

/// As many chunks that were skipped as the decoder lists at most.
const MOST_SKIPPED: usize = 16;

pub(crate) fn run(args: &args::Decode) -> Result<()> {
    let output = Output::new(&args.output)?;
    output.check_is_not(&args.input)?;
    let codec = Codec::of(&args.output, args.format.as_deref())?;
    let times = args.keep.preserve_times.then(|| output.times_of(&args.input)).transpose()?;
    let file = files::read(&args.input)?;
    let mut picture = args.threads.pool()?.install(|| match decode(args, codec, &file) {
        Err(error) if args.allow_partial => {
            let wanted = |header: &Header, metadata: &Metadata| {
                Wanted::new(render_options(args, header, metadata)?, codec, header)
            };
            let partial = partial(&file, args.limits.limits(), wanted);
            // Where the file is valid, the error is in the request.
            partial.with_context(|| files::input_name(&args.input))?.ok_or(error)
        }
        decoded => decoded,
    })?;
    finish(&mut picture, codec, Some(args.keep.policy().unwrap_or_default()));
    files::warn(&args.input, &picture.warnings);
    output.write(&codec.encode(&picture)?, times)
}

/// Decodes a valid file. Layers that are not visible in the region are skipped.
fn decode(args: &args::Decode, codec: Codec, file: &[u8]) -> Result<StillImage> {
    let context = || files::input_name(&args.input);
    let limits = args.limits.limits();
    let mut decoder = Decoder::new_with_limits(file, limits).with_context(context)?;
    let options = render_options(args, decoder.header(), decoder.metadata());
    let wanted = Wanted::new(options.with_context(context)?, codec, decoder.header());
    let wanted = wanted.with_context(|| files::output_name(&args.output))?;
    let image = wanted.decode(&mut decoder).with_context(context)?;
    // Metadata may stand after the layers.
    let metadata = decoder.metadata().clone();
    Ok(StillImage { image, metadata, warnings: skipped(decoder.stream()) })
}

/// What a user is told of chunks that were skipped.
pub(crate) fn skipped(stream: &StreamDecoder) -> Vec<String> {
    let mut lines: Vec<_> = stream.skipped().iter().map(ToString::to_string).collect();
    if lines.len() == MOST_SKIPPED {
        lines.push(format!(
            "there may be more: only the first {MOST_SKIPPED} skipped chunks are told"
        ));
    }
    lines
}

/// Decodes as many Gaussians of an invalid file as possible; `None` if the file is valid.
pub(crate) fn partial(
    file: &[u8],
    limits: Limits,
    wanted: impl FnOnce(&Header, &Metadata) -> Result<Wanted>,
) -> Result<Option<StillImage>> {
    let mut stream = StreamDecoder::new().with_limits(limits);
    let Err(error) = stream.feed(file).and_then(|_| stream.finish()) else { return Ok(None) };
    let Some(picture) = stream.picture() else { bail!(error) };
    let (shown, all) = (picture.gaussians().len(), picture.header().gaussians);
    let mut warnings = skipped(&stream);
    warnings.push(format!("{error}; showing {shown} of {all} Gaussians"));
    let metadata = stream.metadata().clone();
    let image = wanted(picture.header(), &metadata)?.render(&picture)?;
    Ok(Some(StillImage { image, metadata, warnings }))
}

/// Makes a decoded picture what is written: upright, with a profile only if it fits the samples, with such
/// alpha as the format takes, and with such metadata as was asked for and the format takes. Without a policy,
/// which is for thumbnails, it has what is safe, and of what the format does not take only colours are missed.
pub(crate) fn finish(picture: &mut StillImage, codec: Codec, policy: Option<MetadataPolicy>) {
    picture.make_upright(picture.metadata.orientation());
    picture.retain_metadata(policy.unwrap_or(MetadataPolicy::Safe));
    // Codes count before a profile, so one in whose place they are written need not fit.
    let colors = codec.drop_colors(picture.color(), &mut picture.metadata);
    picture.warnings.extend(colors);
    picture.drop_unfit_profile();
    if codec == Codec::Gif {
        picture.round_alpha();
    }
    let dropped = codec.drop_unwritable(&mut picture.metadata);
    if policy.is_some() {
        picture.warnings.extend(dropped);
    }
}

/// The options of the rendering, with the colour model and depth that the output format has.
pub(crate) struct Wanted {
    pub(crate) options: RenderOptions,
    width: u32,
    height: u32,
    color: ColorModel,
    depth: SampleDepth,
}

impl Wanted {
    /// `options` say size, region and threads; the format sets the rest.
    pub(crate) fn new(options: RenderOptions, codec: Codec, header: &Header) -> Result<Self> {
        let (color, depth) = codec.choose(header.color, header.depth)?;
        let options = options.with_color(color);
        let (width, height) = options.output_size(header);
        codec.check_size((width, height))?;
        Ok(Self { options, width, height, color, depth })
    }

    /// As [`Wanted::new`], with the colour model and depth of the file.
    pub(crate) fn as_stored(options: RenderOptions, header: &Header) -> Self {
        let (width, height) = options.output_size(header);
        Self { options, width, height, color: header.color, depth: header.depth }
    }

    /// The pixels of the rendering.
    pub(crate) fn pixels(&self) -> u64 {
        u64::from(self.width) * u64::from(self.height)
    }

    /// Decodes the rest of a file, and renders it.
    pub(crate) fn decode(&self, decoder: &mut Decoder<impl Read>) -> Result<DynamicImage> {
        decoder.set_options(self.options.clone());
        let samples = decoder.output_len()?;
        match self.depth {
            SampleDepth::Eight => self.image_u8(samples, |out| decoder.decode_into(out)),
            _ => self.image_u16(samples, |out| decoder.decode_into_u16(out)),
        }
    }

    /// Renders the Gaussians of a picture.
    pub(crate) fn render(&self, picture: &Picture<'_>) -> Result<DynamicImage> {
        let samples = picture.output_len(&self.options)?;
        match self.depth {
            SampleDepth::Eight => {
                self.image_u8(samples, |out| picture.render_u8(&self.options, out))
            }
            _ => self.image_u16(samples, |out| picture.render_u16(&self.options, out)),
        }
    }

    fn image_u8(
        &self,
        samples: usize,
        render: impl FnOnce(&mut [u8]) -> Result<(), DecodeError>,
    ) -> Result<DynamicImage> {
        let mut out = vec![0; samples];
        render(&mut out)?;
        Ok(match self.color {
            ColorModel::Gray => self.buffer::<image::Luma<u8>>(out)?.into(),
            ColorModel::GrayAlpha => self.buffer::<image::LumaA<u8>>(out)?.into(),
            ColorModel::Rgb => self.buffer::<image::Rgb<u8>>(out)?.into(),
            _ => self.buffer::<image::Rgba<u8>>(out)?.into(),
        })
    }

    fn image_u16(
        &self,
        samples: usize,
        render: impl FnOnce(&mut [u16]) -> Result<(), DecodeError>,
    ) -> Result<DynamicImage> {
        let mut out = vec![0; samples];
        render(&mut out)?;
        Ok(match self.color {
            ColorModel::Gray => self.buffer::<image::Luma<u16>>(out)?.into(),
            ColorModel::GrayAlpha => self.buffer::<image::LumaA<u16>>(out)?.into(),
            ColorModel::Rgb => self.buffer::<image::Rgb<u16>>(out)?.into(),
            _ => self.buffer::<image::Rgba<u16>>(out)?.into(),
        })
    }

    fn buffer<P: Pixel>(
        &self,
        samples: Vec<P::Subpixel>,
    ) -> Result<ImageBuffer<P, Vec<P::Subpixel>>> {
        let (width, height) = (self.width, self.height);
        ImageBuffer::from_raw(width, height, samples)
            .ok_or_else(|| anyhow!("{width}x{height} pixels do not fit the samples rendered"))
    }
}

/// Size and region of the rendering, which is turned upright afterwards, as the arguments are.
fn render_options(
    args: &args::Decode,
    header: &Header,
    metadata: &Metadata,
) -> Result<RenderOptions, RequestError> {
    let orientation = metadata.orientation();
    let whole = orientation.turned_size(header.width, header.height);
    // The cast of a side that is too long saturates, and the limits refuse it.
    let scaled = |side: u32, scale: f64| (f64::from(side) * scale).round().max(1.0) as u32;
    let scale = |scale| (scaled(whole.0, scale), scaled(whole.1, scale));
    let fit = |bounds| {
        let (width, height) = fitted(header, orientation, bounds);
        orientation.turned_size(width, height)
    };
    let size = args.size.or(args.scale.map(scale)).or(args.fit.map(fit));
    let (width, height) = size.unwrap_or(whole);
    let (stored_width, stored_height) = orientation.turned_size(width, height);
    let mut options =
        RenderOptions::new().with_size(stored_width, stored_height).with_texture(!args.no_texture);
    if let Some(region) = args.region {
        options = options.with_region(orientation.stored_region(region, width, height)?);
    }
    Ok(options)
}

/// The largest size, before it is turned upright, that fits into these sides and enlarges nothing.
pub(crate) fn fitted(header: &Header, orientation: Orientation, bounds: (u32, u32)) -> (u32, u32) {
    let (across, down) = orientation.turned_size(bounds.0, bounds.1);
    let (width, height) = (f64::from(header.width), f64::from(header.height));
    let scale = (f64::from(across) / width).min(f64::from(down) / height).min(1.0);
    let side = |side: f64| (side * scale).round().max(1.0) as u32;
    (side(width), side(height))
}
