//! Verification: the PSNR of a file as its decoder renders it, which is what the encoder reports.

use fearless_simd::{Level, dispatch};
use rayon::prelude::*;

use super::aim::Aim;
use super::error::{EncodeError, Result, WriteError};
use super::file::FileLayout;
use super::job::Job;
use super::progress::Observer;
use super::quality::{Judge, Judgement, Verdict};
use super::source::{SPAN, Source};
use super::strips;
use crate::chunk::ChunkType;
use crate::decode::{ChunkStatistics, StreamDecoder};
use crate::error::DecodeError;
use crate::limits::Limits;
use crate::region::Region;
use crate::render::{Picture, RenderOptions};

/// Bytes of a file from one poll of the observer to the next.
const PIECE: usize = 1 << 12;
/// Samples that are compared at a time.
const LANES: usize = 8;

/// A file that was decoded for comparison with its source.
#[derive(Debug)]
pub(crate) struct Verified<'a> {
    stream: StreamDecoder,
    source: &'a Source<'a>,
}

/// The PSNR of a decoded file in dB.
#[derive(Clone, Copy, Debug)]
pub(crate) struct FilePsnr {
    /// Of samples rounded to the source's depth; colours count times alpha, unless those that
    /// do not show are to be kept.
    pub(crate) rounded: f64,
    /// Of samples that are clamped, but not rounded.
    pub(crate) exact: f64,
}

/// What the texture of a file takes.
#[derive(Clone, Copy, Debug)]
pub(crate) struct TextureCost {
    pub(crate) gaussians: u32,
    pub(crate) bytes: u64,
}

/// Refuses a picture that no file can hold within the limits, as far as this is known before the work.
///
/// # Errors
/// [`EncodeError::Limit`] when a decoder would refuse every such file.
pub(crate) fn check_limits(job: &Job<'_>) -> Result<()> {
    let Job { source, aim, training, metadata, limits, .. } = *job;
    let (kernel, parameterization) = (training.kernel, training.parameterization);
    let layout = FileLayout::new(source, [0.0; 4], kernel, parameterization, metadata)
        .with_first_layer(job.first_layer);
    layout.check_first_layer()?;
    let gaussians = if let Aim::Count(count) = aim { count } else { 0 };
    let mut stream = StreamDecoder::new().with_limits(limits.clone());
    stream.feed(&layout.start(gaussians)).map_err(refusal)?;
    Ok(())
}

/// Refuses a file of the writer that a decoder with these limits would refuse, or its rendering at full size.
pub(crate) fn check_written(file: &[u8], limits: &Limits) -> Result<(), WriteError> {
    let mut stream = StreamDecoder::new().with_limits(limits.clone());
    let picture = stream.feed(file).map(|_| stream.picture().expect("the header was read"));
    match picture.and_then(|picture| picture.check(&RenderOptions::new())) {
        Err(DecodeError::Limit { kind, wanted, allowed }) => {
            Err(WriteError::Limit { kind, wanted, allowed })
        }
        checked => {
            checked.expect("the decoder reads what the writer writes");
            Ok(())
        }
    }
}

/// The error of a decoder that refuses a file of the encoder: nothing but limits makes it do so.
fn refusal(error: DecodeError) -> EncodeError {
    match error {
        DecodeError::Limit { kind, wanted, allowed } => {
            EncodeError::Limit { kind, wanted, allowed }
        }
        error => unreachable!("the decoder reads what the encoder writes: {error}"),
    }
}

impl<'a> Verified<'a> {
    /// Decodes a file without limits, as a search does with all that it tries.
    pub(crate) fn new(
        file: &[u8],
        source: &'a Source<'a>,
        observer: &mut Observer<'_>,
    ) -> Result<Self> {
        Self::within(file, source, &Limits::none(), observer)
    }

    /// Decodes a file within limits.
    ///
    /// # Errors
    /// [`EncodeError::Limit`] when a decoder with these limits refuses it, or its rendering at full
    /// size, and [`EncodeError::Cancelled`] when the caller cancels.
    pub(crate) fn within(
        file: &[u8],
        source: &'a Source<'a>,
        limits: &Limits,
        observer: &mut Observer<'_>,
    ) -> Result<Self> {
        let mut stream = StreamDecoder::new().with_limits(limits.clone());
        for piece in file.chunks(PIECE) {
            observer.poll()?;
            stream.feed(piece).map_err(refusal)?;
        }
        assert!(stream.is_complete(), "the encoder writes whole files");
        let verified = Self { stream, source };
        verified.picture().check(&RenderOptions::new()).map_err(refusal)?;
        Ok(verified)
    }

    /// The decoded picture.
    pub(crate) fn picture(&self) -> Picture<'_> {
        self.stream.picture().expect("the header was read")
    }

    /// Number of Gaussians in the file.
    pub(crate) fn gaussians(&self) -> u32 {
        self.stream.gaussians().len() as u32
    }

    /// What its texture takes.
    pub(crate) fn texture(&self) -> TextureCost {
        let of_texture = |chunk: &&ChunkStatistics| chunk.kind == ChunkType::TXTR;
        let chunks = self.stream.chunks().iter().find(of_texture);
        let map = self.picture().texture_map();
        TextureCost {
            gaussians: map.map_or(0, |map| map.gaussians().len() as u32),
            bytes: chunks.map_or(0, |chunks| chunks.bytes),
        }
    }

    /// The PSNR in dB, at the source's depth, of the picture that the first `count` Gaussians make, or all
    /// of them if there are fewer.
    pub(crate) fn psnr(&self, count: u32, observer: &mut Observer<'_>) -> Result<f64> {
        let errors = Errors::of(&self.picture(), self.source, count, observer)?;
        Ok(errors.psnr(self.source).rounded)
    }

    /// The PSNR of the decoded picture, and how it differs from the source to the eye.
    pub(crate) fn judged(
        &self,
        judge: &Judge<'_>,
        observer: &mut Observer<'_>,
    ) -> Result<(FilePsnr, Verdict)> {
        let (mut errors, mut judgement) = (Errors::default(), Judgement::new(judge));
        strips::render(&self.picture(), u32::MAX, observer, |region, planes| {
            errors.add(self.source, region, planes);
            judgement.see(region, planes);
        })?;
        Ok((errors.psnr(self.source), judgement.verdict()))
    }
}

/// The squared error of a picture without limits, over all samples, which are clamped but not rounded. A full sample
/// is 1.
pub(crate) fn squared_error(
    picture: &Picture<'_>,
    source: &Source<'_>,
    observer: &mut Observer<'_>,
) -> Result<f64> {
    let errors = Errors::of(picture, source, u32::MAX, observer)?;
    Ok(errors.exact / f64::from(source.depth().max_sample()).powi(2))
}

/// Sums of squared errors of a rendering, which comes in strips.
#[derive(Clone, Copy, Debug, Default)]
struct Errors {
    /// Of samples rounded to the source's depth, in its quantization steps.
    rounded: f64,
    /// Of samples that are clamped, but not rounded.
    exact: f64,
}

impl Errors {
    /// Those of the first `count` Gaussians of a picture.
    fn of(
        picture: &Picture<'_>,
        source: &Source<'_>,
        count: u32,
        observer: &mut Observer<'_>,
    ) -> Result<Self> {
        let mut errors = Self::default();
        strips::render(picture, count, observer, |region, planes| {
            errors.add(source, region, planes);
        })?;
        Ok(errors)
    }

    /// Adds those of a strip: float samples, plane after plane.
    fn add(&mut self, source: &Source<'_>, region: Region, planes: &[f32]) {
        let level = Level::new();
        let rows = (0..region.height as usize).into_par_iter();
        let errors =
            rows.map(|row| dispatch!(level, _ => Self::of_row(source, region, planes, row)));
        // Added row by row, so that the sums do not depend on the threads.
        for row in errors.collect::<Vec<_>>() {
            self.rounded += row.rounded;
            self.exact += row.exact;
        }
    }

    /// Those of a row of a strip. The compiler turns the loops into code of the SIMD level.
    #[inline(always)]
    fn of_row(source: &Source<'_>, region: Region, planes: &[f32], row: usize) -> Self {
        let (width, pixels) = (region.width as usize, region.pixels() as usize);
        let full_scale = f32::from(source.depth().max_sample());
        let channels = source.color().channels();
        let mut samples = [[0.0; SPAN]; 4];
        let (mut values, mut integers) = (samples, samples);
        let (mut rounded, mut exact) = ([0.0; LANES], [0.0; LANES]);
        for first in (0..width).step_by(SPAN) {
            let count = source.read(first, region.y as usize + row, &mut samples);
            for (channel, plane) in planes.chunks_exact(pixels).enumerate() {
                let (values, integers) = (&mut values[channel], &mut integers[channel]);
                values[..count].copy_from_slice(&plane[row * width + first..][..count]);
                for at in 0..SPAN {
                    values[at] = values[at].clamp(0.0, 1.0) * full_scale;
                    integers[at] = (values[at] + 0.5).floor();
                }
            }
            if source.is_premultiplied() {
                for planes in [&mut samples, &mut values, &mut integers] {
                    premultiply(&mut planes[..channels], full_scale);
                }
            }
            for channel in 0..channels {
                for planes in [&mut samples, &mut values, &mut integers] {
                    planes[channel][count..].fill(0.0);
                }
                for at in (0..count).step_by(LANES) {
                    for lane in 0..LANES {
                        let sample = f64::from(samples[channel][at + lane]);
                        let error = f64::from(integers[channel][at + lane]) - sample;
                        rounded[lane] += error * error;
                        let error = f64::from(values[channel][at + lane]) - sample;
                        exact[lane] += error * error;
                    }
                }
            }
        }
        Self { rounded: rounded.iter().sum(), exact: exact.iter().sum() }
    }

    /// The PSNR with these errors over all samples.
    fn psnr(&self, source: &Source<'_>) -> FilePsnr {
        let full_scale = f64::from(source.depth().max_sample());
        let samples = f64::from(source.width()) * f64::from(source.height());
        let most = full_scale * full_scale * samples * source.color().channels() as f64;
        FilePsnr {
            rounded: 10.0 * (most / self.rounded).log10(),
            exact: 10.0 * (most / self.exact).log10(),
        }
    }
}

/// Multiplies colours by their alpha, the last of the planes.
#[inline(always)]
fn premultiply(planes: &mut [[f32; SPAN]], full_scale: f32) {
    let Some((alpha, colors)) = planes.split_last_mut() else { return };
    for color in colors {
        for at in 0..SPAN {
            color[at] *= alpha[at] * (1.0 / full_scale);
        }
    }
}
