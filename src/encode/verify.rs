//! What the file really shows: the encoder's figures come from its own decoder.

use super::source::{Samples, Source};
use crate::decoder::StreamDecoder;
use crate::limits::Limits;
use crate::metrics;
use crate::render::{Picture, RenderOptions};

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
        let (channels, samples) = (self.source.color().channels(), self.source.len());
        let mut planes = vec![0.0; samples];
        let options = RenderOptions::new();
        self.picture().render_planes(&options, &mut planes).expect("there are no limits");
        // Plane by plane on one side, interleaved on the other.
        let mut source = Vec::with_capacity(samples);
        for channel in 0..channels {
            source.extend((channel..samples).step_by(channels).map(|at| self.source.sample(at)));
        }
        for value in &mut planes {
            *value = value.clamp(0.0, 1.0);
        }
        metrics::psnr(&planes, &source, 1.0)
    }

    fn picture(&self) -> Picture<'_> {
        self.stream.picture().expect("the header was read")
    }
}
