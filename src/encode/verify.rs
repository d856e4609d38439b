//! What the file really shows: the encoder's figures come from its own decoder.

use super::source::Source;
use crate::color::SampleDepth;
use crate::decoder::StreamDecoder;
use crate::limits::Limits;
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
        let samples = self.samples();
        let squares: u64 = match self.source.depth() {
            SampleDepth::Eight => {
                let mut out = vec![0; samples];
                self.picture().render_u8(&options, &mut out).expect("there are no limits");
                squares(out.into_iter().map(u16::from), self.source)
            }
            SampleDepth::Sixteen => {
                let mut out = vec![0; samples];
                self.picture().render_u16(&options, &mut out).expect("there are no limits");
                squares(out.into_iter(), self.source)
            }
        };
        let peak = f64::from(self.source.depth().max_sample());
        10.0 * (peak * peak / (squares as f64 / samples as f64)).log10()
    }

    /// PSNR of the rendering before it is rounded to samples, in dB.
    pub(crate) fn float_psnr(&self) -> f64 {
        let samples = self.samples();
        let mut planes = vec![0.0; samples];
        self.picture()
            .render_planes(&RenderOptions::new(), &mut planes)
            .expect("there are no limits");
        let channels = self.source.color().channels();
        let pixels = samples / channels;
        let mut squares = 0.0;
        for (channel, plane) in planes.chunks_exact(pixels).enumerate() {
            for (pixel, value) in plane.iter().enumerate() {
                let sample = self.source.sample(pixel * channels + channel);
                squares += f64::from(value.clamp(0.0, 1.0) - sample).powi(2);
            }
        }
        10.0 * (samples as f64 / squares).log10()
    }

    fn picture(&self) -> Picture<'_> {
        self.stream.picture().expect("the header was read")
    }

    fn samples(&self) -> usize {
        let size = self.source.width() as usize * self.source.height() as usize;
        size * self.source.color().channels()
    }
}

/// The sum of squared differences from the source.
fn squares(out: impl Iterator<Item = u16>, source: &Source<'_>) -> u64 {
    out.enumerate()
        .map(|(index, value)| {
            let difference = u64::from(value.abs_diff(source.integer(index)));
            difference * difference
        })
        .sum()
}
