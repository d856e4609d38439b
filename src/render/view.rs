//! What to render: output size, region, number of Gaussians (spec, section 9.1).

use alloc::format;

use super::kernel::Kernel;
use super::tile::Backend;
use crate::color::ColorModel;
use crate::container::Header;
use crate::error::DecodeError;
use crate::limits::Limits;

/// Largest width and height of an output. Up to here every pixel centre is exact in `f32`.
const MAX_OUTPUT_SIDE: u32 = 1 << 23;

/// A rectangle of output pixels: from (x, y), which is included, `width` to the right and
/// `height` down.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash)]
pub struct Region {
    /// Left edge in pixels.
    pub x: u32,
    /// Top edge in pixels.
    pub y: u32,
    /// Width in pixels, at least 1.
    pub width: u32,
    /// Height in pixels, at least 1.
    pub height: u32,
}

impl Region {
    pub(crate) fn pixels(self) -> u64 {
        u64::from(self.width) * u64::from(self.height)
    }
}

/// How to render a [`Picture`](crate::Picture). The default is the whole picture at its stored
/// size with all Gaussians, in the file's own colour model.
#[derive(Clone, Debug)]
#[must_use]
pub struct RenderOptions {
    size: Option<(u32, u32)>,
    region: Option<Region>,
    color: Option<ColorModel>,
    pub(crate) prefix: Option<u32>,
    pub(crate) parallel: bool,
    pub(super) backend: Backend,
}

impl Default for RenderOptions {
    fn default() -> Self {
        Self {
            size: None,
            region: None,
            color: None,
            prefix: None,
            parallel: true,
            backend: Backend::fastest(),
        }
    }
}

impl RenderOptions {
    /// The whole picture at its stored size.
    pub fn new() -> Self {
        Self::default()
    }

    /// Renders the whole picture `width` by `height` pixels large. The continuous model is
    /// evaluated there; nothing is resampled. Where that is smaller than the stored size, each
    /// Gaussian is first widened by the pixels' own footprint, so that nothing aliases. Each side
    /// is at most 2^23; [`RenderOptions::region`] keeps a close-up affordable.
    pub fn size(mut self, width: u32, height: u32) -> Self {
        self.size = Some((width, height));
        self
    }

    /// Renders only this region of the output, in pixels of the output size. The result equals
    /// that part of the full output, bit for bit.
    pub fn region(mut self, region: Region) -> Self {
        self.region = Some(region);
        self
    }

    /// Renders only the first `count` Gaussians of the file, or as many as there are.
    pub fn prefix(mut self, count: u32) -> Self {
        self.prefix = Some(count);
        self
    }

    /// Writes the samples in another colour model, one that has all channels of the stored one:
    /// gray becomes three equal channels, missing alpha becomes opaque.
    pub fn color(mut self, color: ColorModel) -> Self {
        self.color = Some(color);
        self
    }

    /// Whether to use the threads of the current `rayon` pool (default: yes), for rendering and in
    /// a [`Decoder`](crate::Decoder) for layers of [`Coding::Set`](crate::Coding::Set) too.
    /// Without the feature `rayon` there is one thread in any case. The result is the same bit for
    /// bit.
    pub fn parallel(mut self, parallel: bool) -> Self {
        self.parallel = parallel;
        self
    }

    /// Whether to use the plain reference code in place of the fast code (default: no). The
    /// result is the same bit for bit; this is how to find out.
    pub fn reference(mut self, reference: bool) -> Self {
        self.backend = if reference { Backend::reference() } else { Backend::fastest() };
        self
    }

    /// Uses the code of one level of vector instructions.
    #[cfg(all(fuzzing, feature = "std"))]
    pub fn simd_level(mut self, level: fearless_simd::Level) -> Self {
        self.backend = Backend::Simd(level);
        self
    }

    /// Width and height of what will be written, in pixels.
    #[must_use]
    pub fn output_size(&self, header: &Header) -> (u32, u32) {
        match (self.region, self.size) {
            (Some(region), _) => (region.width, region.height),
            (None, Some(size)) => size,
            (None, None) => (header.width, header.height),
        }
    }

    /// The colour model of what will be written.
    ///
    /// # Errors
    /// When the colour model asked for lacks a channel that the picture has.
    pub fn output_color(&self, header: &Header) -> Result<ColorModel, DecodeError> {
        let color = self.color.unwrap_or(header.color);
        let (from, to) = (header.color, color);
        let loses_alpha = from.has_alpha() && !to.has_alpha();
        let loses_color = from.channels() >= 3 && to.channels() < 3;
        if loses_alpha || loses_color {
            return Err(DecodeError::Request(format!("{from:?} cannot be written as {to:?}")));
        }
        Ok(color)
    }

    /// The number of samples that will be written: width x height x channels. `None` when that
    /// does not fit a `usize`.
    #[must_use]
    pub fn output_len(&self, header: &Header) -> Option<usize> {
        let (width, height) = self.output_size(header);
        let channels = self.color.unwrap_or(header.color).channels();
        usize::try_from(width).ok()?.checked_mul(height as usize)?.checked_mul(channels)
    }

    /// Checks the request against the picture and the limits.
    pub(crate) fn view(&self, header: &Header, limits: &Limits) -> Result<View, DecodeError> {
        let (width, height) = self.size.unwrap_or((header.width, header.height));
        let sides = 1..=MAX_OUTPUT_SIDE;
        if !sides.contains(&width) || !sides.contains(&height) {
            return Err(DecodeError::Request(format!(
                "an output of {width}x{height} pixels; each side must be 1 to {MAX_OUTPUT_SIDE}"
            )));
        }
        let region = self.region.unwrap_or(Region { x: 0, y: 0, width, height });
        let inside = |at: u32, length: u32, whole: u32| {
            length > 0 && at.checked_add(length).is_some_and(|end| end <= whole)
        };
        if !inside(region.x, region.width, width) || !inside(region.y, region.height, height) {
            let Region { x, y, width: w, height: h } = region;
            return Err(DecodeError::Request(format!(
                "the region {w}x{h} at ({x}, {y}) is empty or not inside the {width}x{height} output"
            )));
        }
        limits.check_size(region.width, region.height)?;
        Ok(View::new((header.width, header.height), (width, height), region, header.kernel))
    }
}

/// Where the model is evaluated: a scale, the filter that goes with it, and a region.
#[derive(Clone, Copy, Debug)]
pub(crate) struct View {
    /// Output pixels per stored pixel, along x and y.
    pub(crate) scale: [f32; 2],
    /// Covariance that minification adds, in square output pixels (spec, section 9.2).
    pub(crate) filter: [f32; 2],
    pub(crate) region: Region,
}

impl View {
    pub(crate) fn new(
        stored: (u32, u32),
        output: (u32, u32),
        region: Region,
        kernel: Kernel,
    ) -> Self {
        let scale = [output.0 as f32 / stored.0 as f32, output.1 as f32 / stored.1 as f32];
        // A box of one output pixel has variance 1/12, of which the stored pixels' own share is
        // already in the model.
        let share = 12.0 * kernel.variance();
        let filter = scale.map(|s| if s < 1.0 { (1.0 - s * s) / share } else { 0.0 });
        Self { scale, filter, region }
    }
}
