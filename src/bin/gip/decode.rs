//! `gip decode`.

use anyhow::{Context, Result, anyhow, bail};
use image::metadata::Orientation;
use image::{DynamicImage, ImageBuffer, Pixel};
use image_gip::{ColorModel, Header, RenderOptions, SampleDepth, StreamDecoder};
use rayon::ThreadPoolBuilder;

use crate::args;
use crate::codec::Codec;
use crate::files::{self, Output};
use crate::picture::Picture;

pub(crate) fn run(args: &args::Decode) -> Result<()> {
    let output = Output::new(&args.output)?;
    let codec = Codec::of(&args.output)?;
    let stream = read(args)?;

    let threads = args.threads.count.map_or(0, usize::from);
    let pool = ThreadPoolBuilder::new().num_threads(threads).build()?;
    let mut picture = pool.install(|| render(args, codec, &stream))?;

    let orientation = picture.metadata.exif.as_deref().and_then(Orientation::from_exif_chunk);
    picture.make_upright(orientation.unwrap_or(Orientation::NoTransforms));
    picture.drop_foreign_profile();
    output.write(&codec.encode(&picture)?)
}

/// Reads the whole file, or with `--allow-partial` as much as is sound.
fn read(args: &args::Decode) -> Result<StreamDecoder> {
    let bytes = files::read(&args.input)?;
    let mut stream = StreamDecoder::new();
    if let Err(error) = stream.feed(&bytes).and_then(|_| stream.finish()) {
        let arrived = stream.gaussians().len();
        match stream.header() {
            Some(header) if args.allow_partial => {
                let name = files::input_name(&args.input);
                let all = header.gaussians;
                eprintln!("warning: {name}: {error}; showing {arrived} of {all} Gaussians");
            }
            _ => return Err(error).with_context(|| files::input_name(&args.input)),
        }
    }
    Ok(stream)
}

/// Renders what the arguments ask for, with samples that `codec` can write.
fn render(args: &args::Decode, codec: Codec, stream: &StreamDecoder) -> Result<Picture> {
    let picture = stream.picture().ok_or_else(|| anyhow!("the file has no header"))?;
    let header = picture.header();
    let (color, depth) = codec.choose(header.color, header.depth)?;
    let mut options = RenderOptions::new().color(color);
    if let Some((width, height)) = output_size(args, header) {
        options = options.size(width, height);
    }
    if let Some(region) = args.region {
        options = options.region(region);
    }
    let (width, height) = options.output_size(header);
    let samples = picture.output_len(&options)?;
    let image = if depth == SampleDepth::Eight {
        let mut out = vec![0; samples];
        picture.render_u8(&options, &mut out)?;
        match color {
            ColorModel::Gray => buffer::<image::Luma<u8>>(width, height, out)?.into(),
            ColorModel::GrayAlpha => buffer::<image::LumaA<u8>>(width, height, out)?.into(),
            ColorModel::Rgb => buffer::<image::Rgb<u8>>(width, height, out)?.into(),
            _ => DynamicImage::from(buffer::<image::Rgba<u8>>(width, height, out)?),
        }
    } else {
        let mut out = vec![0; samples];
        picture.render_u16(&options, &mut out)?;
        match color {
            ColorModel::Gray => buffer::<image::Luma<u16>>(width, height, out)?.into(),
            ColorModel::GrayAlpha => buffer::<image::LumaA<u16>>(width, height, out)?.into(),
            ColorModel::Rgb => buffer::<image::Rgb<u16>>(width, height, out)?.into(),
            _ => DynamicImage::from(buffer::<image::Rgba<u16>>(width, height, out)?),
        }
    };
    Ok(Picture { image, metadata: stream.metadata().clone() })
}

/// The size of the whole output; `None` is the stored one.
fn output_size(args: &args::Decode, header: &Header) -> Option<(u32, u32)> {
    // A side that does not fit saturates, and the limits refuse it.
    let scaled = |side: u32, scale: f64| (f64::from(side) * scale).round().max(1.0) as u32;
    args.size
        .or(args.scale.map(|scale| (scaled(header.width, scale), scaled(header.height, scale))))
}

fn buffer<P: Pixel>(
    width: u32,
    height: u32,
    samples: Vec<P::Subpixel>,
) -> Result<ImageBuffer<P, Vec<P::Subpixel>>> {
    match ImageBuffer::from_raw(width, height, samples) {
        Some(buffer) => Ok(buffer),
        None => bail!("{width}x{height} pixels do not fit the samples rendered"),
    }
}
