//! Verification: the distortion of a file as its decoder renders it, which is what the encoder
//! reports.

use rayon::prelude::*;

use super::error::EncodeError;
use super::progress::Observer;
use super::source::{Source, SourceSamples};
use super::strips;
use crate::decode::StreamDecoder;
use crate::limits::Limits;
use crate::render::{Picture, Sample};

/// Bytes of a file from one poll of the observer to the next.
const PIECE: usize = 1 << 12;

/// A file that was decoded for comparison with its source.
#[derive(Debug)]
pub(crate) struct Verified<'a> {
    stream: StreamDecoder,
    source: &'a Source<'a>,
}

/// The distortion of the decoded picture.
#[derive(Clone, Copy, Debug)]
pub(crate) struct FilePsnr {
    /// PSNR in dB of samples rounded to the source's depth.
    pub(crate) psnr: f64,
    /// PSNR in dB of samples that are clamped, but not rounded.
    pub(crate) psnr_float: f64,
}

impl<'a> Verified<'a> {
    /// # Errors
    /// [`EncodeError::Cancelled`] when the caller cancels.
    pub(crate) fn new(
        file: &[u8],
        source: &'a Source<'a>,
        observer: &mut Observer<'_>,
    ) -> Result<Self, EncodeError> {
        let mut stream = StreamDecoder::new().with_limits(Limits::none());
        for piece in file.chunks(PIECE) {
            observer.poll()?;
            stream.feed(piece).expect("the decoder reads what the encoder writes");
        }
        assert!(stream.is_complete(), "the encoder writes whole files");
        Ok(Self { stream, source })
    }

    /// The decoded picture.
    pub(crate) fn picture(&self) -> Picture<'_> {
        self.stream.picture().expect("the header was read")
    }

    /// Number of Gaussians in the file.
    pub(crate) fn gaussians(&self) -> u32 {
        self.stream.gaussians().len() as u32
    }

    /// The distortion of the picture that the first `count` Gaussians make, or all of them if there
    /// are fewer.
    ///
    /// # Errors
    /// [`EncodeError::Cancelled`] when the caller cancels.
    pub(crate) fn distortion(
        &self,
        count: u32,
        observer: &mut Observer<'_>,
    ) -> Result<FilePsnr, EncodeError> {
        match self.source.samples() {
            SourceSamples::Eight(samples) => self.distortion_from(samples, count, observer),
            SourceSamples::Sixteen(samples) => self.distortion_from(samples, count, observer),
        }
    }

    fn distortion_from<T: Sample + Into<f64> + Sync>(
        &self,
        samples: &[T],
        count: u32,
        observer: &mut Observer<'_>,
    ) -> Result<FilePsnr, EncodeError> {
        let width = self.source.width() as usize;
        let channels = self.source.color().channels();
        let stride = width * channels;
        let full_scale: f64 = T::OPAQUE.into();
        let (mut rounded, mut exact) = (0.0, 0.0);
        strips::render(&self.picture(), count, observer, |region, planes| {
            let pixels = region.pixels() as usize;
            let source = &samples[region.y as usize * stride..][..pixels * channels];
            let errors = source.par_chunks_exact(stride).enumerate().map(|(row, source)| {
                let mut errors = [0.0; 2];
                for (index, &source) in source.iter().enumerate() {
                    let (x, channel) = (index / channels, index % channels);
                    let value = planes[channel * pixels + row * width + x];
                    let (source, sample): (f64, f64) = (source.into(), T::from_unit(value).into());
                    errors[0] += (sample - source).powi(2);
                    let value = f64::from(value.clamp(0.0, 1.0));
                    errors[1] += (value * full_scale - source).powi(2);
                }
                errors
            });
            // Added row by row, so that the sums do not depend on the threads.
            for [by_samples, by_values] in errors.collect::<Vec<_>>() {
                rounded += by_samples;
                exact += by_values;
            }
        })?;
        let most = full_scale * full_scale * samples.len() as f64;
        Ok(FilePsnr {
            psnr: 10.0 * (most / rounded).log10(),
            psnr_float: 10.0 * (most / exact).log10(),
        })
    }
}
