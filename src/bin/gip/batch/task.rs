//! What a batch does to one file.

use core::ops::ControlFlow;
use std::fs::{self, File};
use std::io::BufReader;
use std::path::Path;
use std::time::Instant;

use anyhow::{Context, Result};
use image_gip::{
    Decoder, EncodeError, Encoder, MetadataPolicy, RenderOptions, StreamDecoder, Threads,
};
use serde::Serialize;

use super::budget::Budget;
use super::inputs::{Item, Kind};
use super::stop::Stop;
use crate::args;
use crate::codec::Codec;
use crate::decode::{self, Wanted};
use crate::encode;
use crate::errors::{WrongUsage, one_line};
use crate::picture::StillImage;
use crate::source::{Reading, is_picture, is_unread_picture};

/// What is done to every file, on one thread each.
#[derive(Debug)]
pub(crate) enum Task {
    Encode {
        encoder: Box<Encoder>,
        reading: Reading,
        policy: MetadataPolicy,
    },
    /// `bounds` are the sides that a thumbnail fits into; `None` for the whole picture. The policy is that
    /// of [`decode::finish`].
    Decode {
        extension: String,
        reading: Reading,
        options: RenderOptions,
        bounds: Option<(u32, u32)>,
        policy: Option<MetadataPolicy>,
    },
}

/// What is known about a result; `None` where it is unknown or does not apply.
#[derive(Clone, Debug, Default, Serialize)]
pub(crate) struct Facts {
    pub(crate) width: Option<u32>,
    pub(crate) height: Option<u32>,
    pub(crate) bytes: Option<u64>,
    gaussians: Option<u32>,
    psnr: Option<f64>,
    quality: Option<f64>,
    seconds: Option<f64>,
    shortfall: Option<String>,
    pub(crate) warnings: Vec<String>,
}

impl Facts {
    /// Those of a result of which no more than its size in bytes is known.
    pub(crate) fn of_size(bytes: u64) -> Self {
        Self { bytes: Some(bytes), ..Self::default() }
    }
}

impl Task {
    /// # Errors
    /// When options of the encoder exclude each other.
    pub(crate) fn new(args: &args::Batch) -> Result<Self, WrongUsage> {
        let policy = args.keep.policy();
        let limits = args.limits.limits();
        let reading = Reading { limits: limits.clone(), allow_partial: args.allow_partial };
        if args.decode || args.thumbnail.is_some() {
            let (extension, bounds) = (args.format.clone(), args.thumbnail);
            let policy =
                if bounds.is_some() { policy } else { policy.or(Some(MetadataPolicy::All)) };
            let options = RenderOptions::new().with_threads(Threads::One);
            let options = options.with_texture(!args.no_texture);
            return Ok(Self::Decode { extension, reading, options, bounds, policy });
        }
        let encoder = args.encoder.encoder()?.with_limits(limits).with_threads(Threads::One);
        let encoder = Box::new(encoder);
        Ok(Self::Encode { encoder, reading, policy: policy.unwrap_or_default() })
    }

    /// The extension of the results.
    pub(crate) fn extension(&self) -> &str {
        match self {
            Self::Encode { .. } => "gip",
            Self::Decode { extension, .. } => extension,
        }
    }

    /// How a file of a folder is taken, by its name.
    pub(crate) fn kind(&self, path: &Path) -> Kind {
        let is_taken = match self {
            Self::Encode { .. } => is_picture(path),
            Self::Decode { .. } => {
                path.extension().is_some_and(|extension| extension.eq_ignore_ascii_case("gip"))
            }
        };
        match self {
            _ if is_taken => Kind::Taken,
            Self::Encode { .. } if is_unread_picture(path) => Kind::Unread,
            _ => Kind::Other,
        }
    }

    /// Makes the bytes of a result.
    ///
    /// # Errors
    /// When the source cannot be read, and [`EncodeError::Cancelled`] when asked to stop.
    pub(crate) fn perform(
        &self,
        item: &Item,
        budget: &Budget,
        stop: &Stop,
    ) -> Result<(Vec<u8>, Facts)> {
        match self {
            Self::Encode { encoder, reading, policy } => {
                encode(encoder, reading, *policy, item, budget, stop)
            }
            Self::Decode { reading, options, bounds, policy, .. } => {
                decode(reading, options.clone(), *bounds, *policy, item, budget, stop)
            }
        }
    }

    /// Checks that an earlier result is whole, and returns what it tells about itself.
    pub(crate) fn inspect(&self, output: &Path, budget: &Budget) -> Result<Facts> {
        let (width, height, gaussians) = match self {
            Self::Encode { reading, .. } => {
                let mut stream = StreamDecoder::new().with_limits(reading.limits.clone());
                stream.feed(&fs::read(output)?)?;
                stream.finish()?;
                let header = stream.header().context("no header")?;
                (header.width, header.height, Some(header.gaussians))
            }
            Self::Decode { reading, .. } => {
                let (width, height) = reading.dimensions(output)?;
                let _permit = budget.wait_for(pixels(width, height));
                reading.read(output)?;
                (width, height, None)
            }
        };
        Ok(Facts {
            width: Some(width),
            height: Some(height),
            bytes: Some(fs::metadata(output)?.len()),
            gaussians,
            ..Facts::default()
        })
    }
}

fn encode(
    encoder: &Encoder,
    reading: &Reading,
    policy: MetadataPolicy,
    item: &Item,
    budget: &Budget,
    stop: &Stop,
) -> Result<(Vec<u8>, Facts)> {
    let (width, height) = reading.dimensions(&item.source)?;
    let _permit = budget.wait_for(pixels(width, height));
    check(stop)?;
    let start = Instant::now();
    let mut picture = reading.read(&item.source)?;
    picture.retain_metadata(policy);
    let encoded = encode::encode(encoder.clone(), &mut picture, &mut |_| match check(stop) {
        Ok(()) => ControlFlow::Continue(()),
        Err(_) => ControlFlow::Break(()),
    });
    let encoded = encoded.with_context(|| item.source.display().to_string())?;
    let facts = Facts {
        width: Some(picture.image.width()),
        height: Some(picture.image.height()),
        bytes: Some(encoded.bytes.len() as u64),
        gaussians: Some(encoded.report.gaussians),
        psnr: Some(encode::json_psnr(encoded.report.psnr)),
        quality: Some(encoded.report.quality),
        seconds: Some(start.elapsed().as_secs_f64()),
        shortfall: encoded.report.shortfall.map(|shortfall| shortfall.to_string()),
        warnings: picture.warnings,
    };
    Ok((encoded.bytes, facts))
}

fn decode(
    reading: &Reading,
    mut options: RenderOptions,
    bounds: Option<(u32, u32)>,
    policy: Option<MetadataPolicy>,
    item: &Item,
    budget: &Budget,
    stop: &Stop,
) -> Result<(Vec<u8>, Facts)> {
    let context = || item.source.display().to_string();
    let codec = Codec::of(&item.output, None)?;
    let file = BufReader::new(File::open(&item.source).with_context(context)?);
    let mut decoder =
        Decoder::new_with_limits(file, reading.limits.clone()).with_context(context)?;
    if let Some(bounds) = bounds {
        let orientation = decoder.metadata().orientation();
        let (width, height) = decode::fitted(decoder.header(), orientation, bounds);
        options = options.with_size(width, height);
    }
    let wanted = Wanted::new(options, codec, decoder.header()).with_context(context)?;
    let _permit = budget.wait_for(wanted.pixels());
    check(stop)?;
    let start = Instant::now();
    let mut warnings = Vec::new();
    let image = match wanted.decode(&mut decoder) {
        Err(error) if reading.allow_partial => {
            // An error in a layer that was not decoded yet comes now, and then the layers before it.
            let _ = decoder.picture();
            let picture = decoder.picture().with_context(context)?;
            let (shown, all) = (picture.gaussians().len(), picture.header().gaussians);
            warnings.push(format!("{}; showing {shown} of {all} Gaussians", one_line(&error)));
            wanted.render(&picture)
        }
        image => image,
    };
    let gaussians = match warnings[..] {
        [] => decoder.header().gaussians,
        _ => decoder.stream().gaussians().len() as u32,
    };
    let image = image.with_context(context)?;
    // Metadata may stand after the layers.
    let metadata = decoder.metadata().clone();
    warnings.extend(decode::skipped(decoder.stream()));
    let mut picture = StillImage { image, metadata, warnings };
    decode::finish(&mut picture, codec, policy);
    let bytes = codec.encode(&picture).with_context(context)?;
    let facts = Facts {
        width: Some(picture.image.width()),
        height: Some(picture.image.height()),
        bytes: Some(bytes.len() as u64),
        gaussians: Some(gaussians),
        seconds: Some(start.elapsed().as_secs_f64()),
        warnings: picture.warnings,
        ..Facts::default()
    };
    Ok((bytes, facts))
}

fn pixels(width: u32, height: u32) -> u64 {
    u64::from(width) * u64::from(height)
}

/// # Errors
/// When asked to stop.
fn check(stop: &Stop) -> Result<(), EncodeError> {
    if stop.is_asked_for() { Err(EncodeError::Cancelled) } else { Ok(()) }
}
