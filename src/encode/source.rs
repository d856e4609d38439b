//! The picture to encode.

use super::appearance::Curve;
use super::error::SourceError;
use super::importance::Importance;
use crate::color::{ColorModel, SampleDepth, with_channels};
use crate::container::MAX_SIDE;

/// A picture in the caller's memory: interleaved samples, rows from the top, without padding.
#[derive(Clone, Copy, Debug)]
pub struct Source<'a> {
    width: u32,
    height: u32,
    color: ColorModel,
    samples: SourceSamples<'a>,
    /// Whether colours count where alpha is 0.
    keeps_invisible: bool,
    /// What samples look like, if they are not about those of sRGB.
    curve: Option<&'static Curve>,
    /// How much errors count by their place, if not the same everywhere.
    importance: Option<PlacedImportance<'a>>,
}

/// How much errors of a picture, or of a smaller copy of it, count.
#[derive(Clone, Copy, Debug)]
struct PlacedImportance<'a> {
    of_picture: &'a dyn Importance,
    /// The size of the picture.
    size: [u32; 2],
}

/// Most pixels of a row that are read at a time.
pub(crate) const SPAN: usize = 128;

/// Samples of either depth.
#[derive(Clone, Copy, Debug)]
pub(crate) enum SourceSamples<'a> {
    Eight(&'a [u8]),
    Sixteen(&'a [u16]),
}

impl<'a> Source<'a> {
    /// A picture of 8-bit samples, 0 to 255: width x height x channels of them, pixel after pixel.
    ///
    /// # Errors
    /// [`SourceError::Size`] when a side is not 1 to 2^20 pixels long; [`SourceError::SampleCount`]
    /// when there are not width x height x channels samples.
    pub fn new_u8(
        width: u32,
        height: u32,
        color: ColorModel,
        samples: &'a [u8],
    ) -> Result<Self, SourceError> {
        check(width, height, color, samples.len())?;
        Ok(Self::of(width, height, color, SourceSamples::Eight(samples)))
    }

    /// A picture of 16-bit samples, 0 to 65535: width x height x channels of them, pixel after
    /// pixel.
    ///
    /// # Errors
    /// As [`Source::new_u8`].
    pub fn new_u16(
        width: u32,
        height: u32,
        color: ColorModel,
        samples: &'a [u16],
    ) -> Result<Self, SourceError> {
        check(width, height, color, samples.len())?;
        Ok(Self::of(width, height, color, SourceSamples::Sixteen(samples)))
    }

    fn of(width: u32, height: u32, color: ColorModel, samples: SourceSamples<'a>) -> Self {
        Self {
            width,
            height,
            color,
            samples,
            keeps_invisible: false,
            curve: None,
            importance: None,
        }
    }

    /// The same picture, where colours count under alpha 0 as well, or not.
    pub(crate) fn keeping_invisible(self, keeps_invisible: bool) -> Self {
        Self { keeps_invisible, ..self }
    }

    /// The same picture, whose samples look as a curve says.
    pub(crate) fn seen_by(self, curve: Option<&'static Curve>) -> Self {
        Self { curve, ..self }
    }

    /// The same picture, where errors count by their place.
    pub(crate) fn weighted_by<'b>(&self, importance: Option<&'b dyn Importance>) -> Source<'b>
    where
        'a: 'b,
    {
        let size = [self.width, self.height];
        let importance = importance.map(|of_picture| PlacedImportance { of_picture, size });
        Source { importance, ..*self }
    }

    /// How much errors count around a pixel, if not the same everywhere.
    pub(crate) fn importance(&self) -> Option<impl Fn([f32; 2]) -> f32> {
        let PlacedImportance { of_picture, size } = self.importance?;
        let scale = [size[0] as f32 / self.width as f32, size[1] as f32 / self.height as f32];
        Some(move |[x, y]: [f32; 2]| of_picture.at([x * scale[0], y * scale[1]]))
    }

    /// What samples look like, if they are not about those of sRGB.
    pub(crate) fn curve(&self) -> Option<&'static Curve> {
        self.curve
    }

    /// A picture of the same size, model and depth with other samples.
    pub(crate) fn with_samples<'b>(&self, samples: SourceSamples<'b>) -> Source<'b>
    where
        'a: 'b,
    {
        self.resized(self.size(), samples)
    }

    /// A picture of the same model with another size, and its samples.
    pub(crate) fn resized<'b>(&self, size: [usize; 2], samples: SourceSamples<'b>) -> Source<'b>
    where
        'a: 'b,
    {
        let [width, height] = size.map(|side| side as u32);
        Source { width, height, samples, ..*self }
    }

    /// Whether errors of a colour count as they show: times alpha.
    pub(crate) fn is_premultiplied(&self) -> bool {
        self.color.has_alpha() && !self.keeps_invisible
    }

    /// Backgrounds that the picture is judged over, where a full sample is 1.
    pub(crate) fn backgrounds(&self) -> &'static [f32] {
        if self.color.has_alpha() { &[0.0, 1.0] } else { &[0.0] }
    }

    /// Width and height in pixels.
    pub(crate) fn size(&self) -> [usize; 2] {
        [self.width as usize, self.height as usize]
    }

    /// Number of pixels.
    pub(crate) fn pixels(&self) -> usize {
        self.width as usize * self.height as usize
    }

    /// Width in pixels.
    #[must_use]
    pub fn width(&self) -> u32 {
        self.width
    }

    /// Height in pixels.
    #[must_use]
    pub fn height(&self) -> u32 {
        self.height
    }

    /// The colour model: which channels there are, and in which order.
    #[must_use]
    pub fn color(&self) -> ColorModel {
        self.color
    }

    /// Bits per sample.
    #[must_use]
    pub fn depth(&self) -> SampleDepth {
        match self.samples {
            SourceSamples::Eight(_) => SampleDepth::Eight,
            SourceSamples::Sixteen(_) => SampleDepth::Sixteen,
        }
    }

    /// All samples.
    pub(crate) fn samples(&self) -> SourceSamples<'a> {
        self.samples
    }

    /// Copies the samples of the pixels of row y from column x on, [`SPAN`] of them or as many as there
    /// are, to one plane for each channel. Returns how many pixels there are.
    ///
    /// The compiler turns the loops into code of the SIMD level that the caller is dispatched to.
    #[inline(always)]
    pub(crate) fn read(&self, x: usize, y: usize, planes: &mut [[f32; SPAN]; 4]) -> usize {
        let (width, channels) = (self.width as usize, self.color.channels());
        let (at, count) = ((y * width + x) * channels, SPAN.min(width - x));
        let range = at..at + count * channels;
        match self.samples {
            SourceSamples::Eight(samples) => deinterleave(&samples[range], channels, planes),
            SourceSamples::Sixteen(samples) => deinterleave(&samples[range], channels, planes),
        }
        count
    }

    /// The sample at an index in interleaved order, scaled to 16 bits.
    pub(crate) fn wide_sample(&self, index: usize) -> u16 {
        match self.samples {
            SourceSamples::Eight(samples) => u16::from(samples[index]) * 257,
            SourceSamples::Sixteen(samples) => samples[index],
        }
    }
}

/// Refuses a side that is out of range, and a number of samples that the sides do not give.
fn check(width: u32, height: u32, color: ColorModel, samples: usize) -> Result<(), SourceError> {
    if !(1..=MAX_SIDE).contains(&width) || !(1..=MAX_SIDE).contains(&height) {
        return Err(SourceError::Size { width, height });
    }
    let wanted = u64::from(width) * u64::from(height) * color.channels() as u64;
    if samples as u64 != wanted {
        return Err(SourceError::SampleCount { found: samples, wanted, width, height, color });
    }
    Ok(())
}

/// Divides samples among planes.
#[inline(always)]
fn deinterleave<T: Copy + Into<f32>>(
    samples: &[T],
    channels: usize,
    planes: &mut [[f32; SPAN]; 4],
) {
    with_channels!(CHANNELS = channels, deinterleave_of::<_, CHANNELS>(samples, planes));
}

#[inline(always)]
fn deinterleave_of<T: Copy + Into<f32>, const CHANNELS: usize>(
    samples: &[T],
    planes: &mut [[f32; SPAN]; 4],
) {
    let pixels = samples.as_chunks::<CHANNELS>().0;
    for channel in 0..CHANNELS {
        let plane = &mut planes[channel][..pixels.len()];
        for x in 0..plane.len() {
            plane[x] = pixels[x][channel].into();
        }
    }
}
