//! `gip encode`.

use core::ops::ControlFlow;
use std::path::Path;

use anyhow::Result;
use image_gip::{Encoded, Encoder, Progress, Source};
use indicatif::{ProgressBar, ProgressStyle};
use serde::Serialize;

use crate::args;
use crate::files::{self, Output};
use crate::picture::{SampleSlice, StillImage};
use crate::source::Reading;

/// What stands for an infinite PSNR in JSON, which has no infinity.
const INFINITE_PSNR: f64 = 999.0;
/// Steps of the progress bar.
const BAR_LENGTH: u64 = 1000;

pub(crate) fn run(args: &args::Encode) -> Result<()> {
    let output = Output::new(&args.output)?;
    if !args.force {
        output.check_name("encode")?;
    }
    let encoder = args.encoder.encoder()?;
    let times = args.keep.preserve_times.then(|| output.times_of(&args.input)).transpose()?;
    let limits = args.limits.limits();
    let reading = Reading { limits: limits.clone(), allow_partial: args.allow_partial };
    let mut picture = reading.read(&args.input)?;
    picture.retain_metadata(args.keep.policy().unwrap_or_default());
    files::warn(&args.input, &picture.warnings);
    let pool = args.threads.pool()?;
    let encoder = encoder.with_limits(limits);
    let encoded = pool.install(|| encode_with_bar(encoder, &mut picture))?;
    output.write(&encoded.bytes, times)?;

    let report = JsonReport::new(&picture, &encoded);
    let text = if args.json {
        serde_json::to_string(&report)?
    } else {
        report.to_line(&args.output, encoded.report.psnr)
    };
    files::print(&text, Some(&args.output))
}

/// Encodes with a progress bar, which is visible on a terminal only.
fn encode_with_bar(encoder: Encoder, picture: &mut StillImage) -> Result<Encoded> {
    let style = ProgressStyle::with_template("{bar:40} {percent:>3} %  {msg}  {eta} left")?;
    let bar = ProgressBar::new(BAR_LENGTH).with_style(style);
    let encoded = encode(encoder, picture, &mut |progress| {
        let position = (progress.fraction * BAR_LENGTH as f64) as u64;
        if position > bar.position() {
            bar.set_position(position);
            bar.set_message(format!("{} Gaussians, {:.2} dB", progress.gaussians, progress.psnr));
        }
        ControlFlow::Continue(())
    });
    bar.finish_and_clear();
    encoded
}

/// Encodes a picture with its metadata. An alpha channel that is opaque everywhere is dropped.
///
/// # Errors
/// Those of the encoder.
pub(crate) fn encode(
    encoder: Encoder,
    picture: &mut StillImage,
    progress: &mut (dyn FnMut(&Progress) -> ControlFlow<()> + Send),
) -> Result<Encoded> {
    picture.drop_opaque_alpha();
    let (width, height) = (picture.image.width(), picture.image.height());
    let source = match picture.samples() {
        SampleSlice::Eight(samples) => Source::new_u8(width, height, picture.color(), samples),
        SampleSlice::Sixteen(samples) => Source::new_u16(width, height, picture.color(), samples),
    }?;
    Ok(encoder.with_metadata(picture.metadata.clone()).encode_with(&source, progress)?)
}

/// What `--json` prints.
#[derive(Debug, Serialize)]
struct JsonReport {
    width: u32,
    height: u32,
    gaussians: u32,
    bytes: usize,
    bpp: f64,
    psnr: f64,
    psnr_float: f64,
    quality: f64,
    texture_gaussians: u32,
    texture_bytes: u64,
    iterations: u32,
    evaluations: u64,
    seconds: f64,
    peak_memory: u64,
    shortfall: Option<String>,
    warnings: Vec<String>,
}

impl JsonReport {
    fn new(picture: &StillImage, encoded: &Encoded) -> Self {
        let (width, height) = (picture.image.width(), picture.image.height());
        let bytes = encoded.bytes.len();
        Self {
            width,
            height,
            gaussians: encoded.report.gaussians,
            bytes,
            bpp: bits_per_pixel(bytes, width, height),
            psnr: json_psnr(encoded.report.psnr),
            psnr_float: json_psnr(encoded.report.psnr_float),
            quality: encoded.report.quality,
            texture_gaussians: encoded.report.texture_gaussians,
            texture_bytes: encoded.report.texture_bytes,
            iterations: encoded.report.iterations,
            evaluations: encoded.report.evaluations,
            seconds: encoded.report.seconds,
            peak_memory: encoded.report.peak_memory,
            shortfall: encoded.report.shortfall.map(|shortfall| shortfall.to_string()),
            warnings: picture.warnings.clone(),
        }
    }

    /// The report as text.
    fn to_line(&self, output: &Path, psnr: f64) -> String {
        let Self { width, height, gaussians, bytes, bpp, quality, seconds, .. } = self;
        let texture = match self.texture_bytes {
            0 => String::new(),
            bytes => format!(" without its texture of {bytes} bytes"),
        };
        let mut line = format!(
            "{}: {width}x{height}, {gaussians} Gaussians, {bytes} bytes, {bpp:.3} bpp, \
             {psnr:.2} dB, quality {quality:.0}{texture}, {seconds:.1} s",
            files::output_name(output)
        );
        if let Some(shortfall) = &self.shortfall {
            line.push_str("\nnote: ");
            line.push_str(shortfall);
        }
        line
    }
}

pub(crate) fn bits_per_pixel(bytes: usize, width: u32, height: u32) -> f64 {
    bytes as f64 * 8.0 / (f64::from(width) * f64::from(height))
}

/// A PSNR for JSON output.
pub(crate) fn json_psnr(psnr: f64) -> f64 {
    psnr.min(INFINITE_PSNR)
}
