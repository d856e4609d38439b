//! What to render: output size, region, number of Gaussians (spec, section 9.1).

use crate::color::ColorModel;
use crate::container::Header;
use crate::error::{DecodeError, MAX_OUTPUT_SIDE, RequestError};
use crate::kernel::Kernel;
use crate::limits::Limits;
use crate::region::Region;
use crate::simd::Backend;
use crate::threads::Threads;

/// How to render a [`Picture`](crate::Picture). The default is the whole picture at its stored
/// size with all Gaussians, in the file's own colour model.
#[derive(Clone, Debug)]
#[must_use]
pub struct RenderOptions {
    size: Option<(u32, u32)>,
    region: Option<Region>,
    color: Option<ColorModel>,
    pub(crate) prefix: Option<u32>,
    pub(crate) threads: Threads,
    pub(super) backend: Backend,
}

impl Default for RenderOptions {
    fn default() -> Self {
        Self {
            size: None,
            region: None,
            color: None,
            prefix: None,
            threads: Threads::Pool,
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
    /// is at most 2^23; [`RenderOptions::with_region`] keeps a close-up affordable.
    pub fn with_size(mut self, width: u32, height: u32) -> Self {
        self.size = Some((width, height));
        self
    }

    /// Renders only this region of the output, in pixels of the output size. The result equals
    /// that part of the full output, bit for bit.
    pub fn with_region(mut self, region: Region) -> Self {
        self.region = Some(region);
        self
    }

    /// Renders only the first `count` Gaussians of the file, or as many as there are.
    pub fn with_prefix(mut self, count: u32) -> Self {
        self.prefix = Some(count);
        self
    }

    /// Writes the samples in another colour model, one that has all channels of the stored one:
    /// gray becomes three equal channels, missing alpha becomes opaque.
    pub fn with_color(mut self, color: ColorModel) -> Self {
        self.color = Some(color);
        self
    }

    /// The threads that render, and in a [`Decoder`](crate::Decoder) also decode entropy-coded
    /// layers. Default [`Threads::Pool`].
    pub fn with_threads(mut self, threads: Threads) -> Self {
        self.threads = threads;
        self
    }

    /// Whether to use the plain reference code in place of the fast code (default: no). The result is
    /// the same bit for bit; this is how to find out.
    ///
    /// For study: outside of what the crate promises to keep.
    pub fn with_reference(mut self, reference: bool) -> Self {
        self.backend = if reference { Backend::reference() } else { Backend::fastest() };
        self
    }

    /// Uses the code of one level of vector instructions.
    #[cfg(all(fuzzing, feature = "std"))]
    pub fn with_simd_level(mut self, level: fearless_simd::Level) -> Self {
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
            return Err(RequestError::ColorModel { from, to }.into());
        }
        Ok(color)
    }

    /// Checks the request against the picture and the limits.
    pub(crate) fn view(&self, header: &Header, limits: &Limits) -> Result<View, DecodeError> {
        let (width, height) = self.size.unwrap_or((header.width, header.height));
        let sides = 1..=MAX_OUTPUT_SIDE;
        if !sides.contains(&width) || !sides.contains(&height) {
            return Err(RequestError::OutputSize { width, height }.into());
        }
        let region = self.region.unwrap_or(Region { x: 0, y: 0, width, height });
        let inside = |at: u32, length: u32, whole: u32| {
            length > 0 && at.checked_add(length).is_some_and(|end| end <= whole)
        };
        if !inside(region.x, region.width, width) || !inside(region.y, region.height, height) {
            return Err(RequestError::Region { region, width, height }.into());
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
