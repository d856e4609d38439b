//! `gip decode`.

use anyhow::{Context, Result, anyhow};
use image::metadata::Orientation;
use image::{DynamicImage, ImageBuffer, Pixel};
use image_gip::{
    ColorModel, DecodeError, Decoder, Header, RenderOptions, SampleDepth, StreamDecoder,
};

use crate::args;
use crate::codec::Codec;
use crate::files::{self, Output};
use crate::picture::StillImage;

pub(crate) fn run(args: &args::Decode) -> Result<()> {
    let output = Output::new(&args.output)?;
    let codec = Codec::of(&args.output)?;
    let file = files::read(&args.input)?;
    let mut picture = args.threads.pool()?.install(|| match decode(args, codec, &file) {
        Err(_) if args.allow_partial => decode_partial(args, codec, &file),
        decoded => decoded,
    })?;
    let orientation = picture.metadata.exif.as_deref().and_then(Orientation::from_exif_chunk);
    picture.make_upright(orientation.unwrap_or(Orientation::NoTransforms));
    picture.drop_foreign_profile();
    output.write(&codec.encode(&picture)?)
}

/// Decodes a valid file. Layers that are not visible in the region are skipped.
fn decode(args: &args::Decode, codec: Codec, file: &[u8]) -> Result<StillImage> {
    let context = || files::input_name(&args.input);
    let mut decoder = Decoder::new(file).with_context(context)?;
    let metadata = decoder.metadata().clone();
    let wanted = Wanted::new(args, codec, decoder.header())?;
    decoder.set_options(wanted.options.clone());
    let samples = decoder.output_len()?;
    let image = match wanted.depth {
        SampleDepth::Eight => wanted.image_u8(samples, |out| decoder.decode_into(out)),
        _ => wanted.image_u16(samples, |out| decoder.decode_into_u16(out)),
    };
    Ok(StillImage { image: image.with_context(context)?, metadata })
}

/// Decodes as many Gaussians of an invalid file as possible, and prints a warning.
fn decode_partial(args: &args::Decode, codec: Codec, file: &[u8]) -> Result<StillImage> {
    let name = files::input_name(&args.input);
    let mut stream = StreamDecoder::new();
    let Err(error) = stream.feed(file).and_then(|_| stream.finish()) else {
        // The file is valid, so the error is in the request.
        return decode(args, codec, file);
    };
    let Some(picture) = stream.picture() else { return Err(error).context(name) };
    let (shown, all) = (picture.gaussians().len(), picture.header().gaussians);
    eprintln!("warning: {name}: {error}; showing {shown} of {all} Gaussians");
    let wanted = Wanted::new(args, codec, picture.header())?;
    let samples = picture.output_len(&wanted.options)?;
    let image = match wanted.depth {
        SampleDepth::Eight => {
            wanted.image_u8(samples, |out| picture.render_u8(&wanted.options, out))
        }
        _ => wanted.image_u16(samples, |out| picture.render_u16(&wanted.options, out)),
    };
    Ok(StillImage { image: image?, metadata: stream.metadata().clone() })
}

/// The options of the rendering, with the colour model and depth that the output format has.
struct Wanted {
    options: RenderOptions,
    width: u32,
    height: u32,
    color: ColorModel,
    depth: SampleDepth,
}

impl Wanted {
    fn new(args: &args::Decode, codec: Codec, header: &Header) -> Result<Self> {
        let (color, depth) = codec.choose(header.color, header.depth)?;
        let mut options = RenderOptions::new().with_color(color);
        if let Some((width, height)) = output_size(args, header) {
            options = options.with_size(width, height);
        }
        if let Some(region) = args.region {
            options = options.with_region(region);
        }
        let (width, height) = options.output_size(header);
        Ok(Self { options, width, height, color, depth })
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

/// The size of the whole output; `None` for the stored size.
fn output_size(args: &args::Decode, header: &Header) -> Option<(u32, u32)> {
    // The cast of a side that is too long saturates, and the limits refuse it.
    let scaled = |side: u32, scale: f64| (f64::from(side) * scale).round().max(1.0) as u32;
    args.size
        .or(args.scale.map(|scale| (scaled(header.width, scale), scaled(header.height, scale))))
}
