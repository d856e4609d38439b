//! What the file really shows: the encoder's figures come from its own decoder.

use super::source::{Samples, Source};
use crate::decoder::StreamDecoder;
use crate::limits::Limits;
use crate::metrics;
use crate::render::{Picture, Region, RenderOptions};

/// Rows that are compared at a time.
const STRIP: u32 = 64;

/// A file, decoded again.
#[derive(Debug)]
pub(crate) struct Verified<'a> {
    stream: StreamDecoder,
    source: &'a Source<'a>,
}

impl<'a> Verified<'a> {
    pub(crate) fn new(file: &[u8], source: &'a Source<'a>) -> Self {
        let mut stream = StreamDecoder::with_limits(Limits::none());
        stream.feed(file).expect("the decoder reads what the encoder writes");
        assert!(stream.is_complete(), "the encoder writes whole files");
        Self { stream, source }
    }

    /// Gaussians in the file.
    pub(crate) fn gaussians(&self) -> u32 {
        self.stream.gaussians().len() as u32
    }

    /// PSNR of the first `count` Gaussians at the source's depth, in dB.
    pub(crate) fn psnr(&self, count: u32) -> f64 {
        let options = RenderOptions::new().prefix(count);
        let full_scale = f64::from(self.source.depth().max_sample());
        match self.source.samples() {
            Samples::Eight(samples) => {
                let mut out = vec![0; samples.len()];
                self.picture().render_u8(&options, &mut out).expect("there are no limits");
                metrics::psnr(&out, samples, full_scale)
            }
            Samples::Sixteen(samples) => {
                let mut out = vec![0; samples.len()];
                self.picture().render_u16(&options, &mut out).expect("there are no limits");
                metrics::psnr(&out, samples, full_scale)
            }
        }
    }

    /// PSNR of the rendering before it is rounded to samples, in dB.
    pub(crate) fn float_psnr(&self) -> f64 {
        let (width, height) = (self.source.width(), self.source.height());
        let channels = self.source.color().channels();
        let mut planes = Vec::new();
        let mut squares = 0.0;
        // In strips, for floats are large.
        for y in (0..height).step_by(STRIP as usize) {
            let region = Region { x: 0, y, width, height: STRIP.min(height - y) };
            let options = RenderOptions::new().region(region);
            let pixels = region.pixels() as usize;
            planes.resize(pixels * channels, 0.0);
            self.picture().render_planes(&options, &mut planes).expect("there are no limits");
            let first = y as usize * width as usize;
            for (channel, plane) in planes.chunks_exact(pixels).enumerate() {
                for (value, pixel) in plane.iter().zip(first..) {
                    let source = self.source.sample(pixel * channels + channel);
                    squares += f64::from(value.clamp(0.0, 1.0) - source).powi(2);
                }
            }
        }
        10.0 * (self.source.len() as f64 / squares).log10()
    }

    fn picture(&self) -> Picture<'_> {
        self.stream.picture().expect("the header was read")
    }
}
