//! What to render: output size, region, colour model, number of Gaussians (spec, sections 9.1 and
//! 9.2).

use super::axis::Axis;
use crate::color::ColorModel;
use crate::container::Header;
use crate::error::{DecodeError, RequestError};
use crate::kernel::Kernel;
use crate::limits::Limits;
use crate::region::{MAX_OUTPUT_SIDE, Region};
use crate::simd::Backend;
use crate::threads::Threads;

/// How to render a [`Picture`](crate::Picture) (spec, section 9.1). The default is the whole
/// picture at its stored size with all Gaussians, in the file's own colour model, on the threads of
/// the current `rayon` pool.
#[derive(Clone, Debug)]
#[must_use]
pub struct RenderOptions {
    size: Option<(u32, u32)>,
    region: Option<Region>,
    color: Option<ColorModel>,
    pub(crate) prefix: Option<u32>,
    pub(super) texture: bool,
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
            texture: true,
            threads: Threads::Pool,
            backend: Backend::fastest(),
        }
    }
}

impl RenderOptions {
    /// Largest width and height of an output in pixels, 2^23.
    pub const MAX_OUTPUT_SIDE: u32 = MAX_OUTPUT_SIDE;

    /// The default options.
    pub fn new() -> Self {
        Self::default()
    }

    /// Renders the whole picture with `width` x `height` pixels, each 1 to
    /// [`RenderOptions::MAX_OUTPUT_SIDE`]. A larger output is evaluated at the centres of its
    /// pixels; nothing is resampled. A smaller one is the average by area of the picture at its
    /// stored size, in which colours count times their alpha; below an eighth, of the picture at a
    /// half of its stored size, a quarter, and so on, with Gaussians widened by the variance of the
    /// larger pixels (spec, section 9.2). For a detail of a very large output, add
    /// [`RenderOptions::with_region`].
    pub fn with_size(mut self, width: u32, height: u32) -> Self {
        self.size = Some((width, height));
        self
    }

    /// Renders only this region, in pixels of the output size, inside of which it must be. The
    /// samples are those of the whole output, bit for bit.
    pub fn with_region(mut self, region: Region) -> Self {
        self.region = Some(region);
        self
    }

    /// Renders only the first `count` Gaussians of the file, or all if there are fewer.
    pub fn with_prefix(mut self, count: u32) -> Self {
        self.prefix = Some(count);
        self
    }

    /// Whether the picture's texture is rendered: noise in place of what the file has no samples of, such as
    /// sand, water and leaves (spec, section 9.7). Default `true`. Without it the picture is smoother, and
    /// nearer to the source sample by sample.
    pub fn with_texture(mut self, texture: bool) -> Self {
        self.texture = texture;
        self
    }

    /// Writes the samples in another colour model, which must have all channels of the file's own:
    /// gray is repeated as red, green and blue, and an alpha channel that is missing is opaque
    /// (spec, section 9.6).
    pub fn with_color(mut self, color: ColorModel) -> Self {
        self.color = Some(color);
        self
    }

    /// Sets the threads that render, and that in a [`Decoder`](crate::Decoder) also decode
    /// entropy-coded layers. Default [`Threads::Pool`].
    pub fn with_threads(mut self, threads: Threads) -> Self {
        self.threads = threads;
        self
    }

    /// Whether the scalar reference code renders in place of SIMD code. Default `false`. The
    /// samples are the same bit for bit, which this is there to check. WebAssembly with vectors has SIMD code alone.
    ///
    /// This is for study, and may change in any release.
    pub fn with_reference(mut self, reference: bool) -> Self {
        self.backend = if reference { Backend::reference() } else { Backend::fastest() };
        self
    }

    /// Those of the nodes of a texture's map that the output needs.
    pub(super) fn for_map(&self, nodes: Region) -> Self {
        let Self { threads, backend, .. } = *self;
        Self { region: Some(nodes), threads, backend, ..Self::default() }
    }

    /// Renders with the code for a SIMD level.
    #[cfg(all(fuzzing, feature = "std"))]
    pub fn with_simd_level(mut self, level: fearless_simd::Level) -> Self {
        self.backend = Backend::Simd(level);
        self
    }

    /// The width and height in pixels of what is rendered: of the region, or of the whole output.
    #[must_use]
    pub fn output_size(&self, header: &Header) -> (u32, u32) {
        match (self.region, self.size) {
            (Some(region), _) => (region.width, region.height),
            (None, Some(size)) => size,
            (None, None) => (header.width, header.height),
        }
    }

    /// The colour model of the samples.
    ///
    /// # Errors
    /// When the colour model of these options lacks a channel of the picture.
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

    /// The view of a picture, after checks of the output size, the region and the limits.
    pub(crate) fn view(&self, header: &Header, limits: &Limits) -> Result<View, DecodeError> {
        let (width, height) = self.size.unwrap_or((header.width, header.height));
        let sides = 1..=MAX_OUTPUT_SIDE;
        if !sides.contains(&width) || !sides.contains(&height) {
            return Err(RequestError::OutputSize { width, height }.into());
        }
        let region = self.region.unwrap_or(Region { x: 0, y: 0, width, height });
        if !region.is_inside(width, height) {
            return Err(RequestError::Region { region, width, height }.into());
        }
        limits.check_size(region.width, region.height)?;
        let view = View::new((header.width, header.height), (width, height), region, header.kernel);
        limits.check_pixels(view.region.pixels())?;
        Ok(view)
    }
}

/// Where Gaussians are evaluated.
#[derive(Clone, Copy, Debug)]
pub(crate) struct View {
    /// Pixels of the grid per stored pixel, along x and y.
    pub(crate) scale: [f32; 2],
    /// (fx, fy): what minification adds to the covariance along x and y, in square pixels
    /// of the grid (spec, section 9.2).
    pub(crate) filter: [f32; 2],
    /// The part of the grid that is rendered.
    pub(crate) region: Region,
    /// The part of the output that is rendered.
    pub(crate) output: Region,
    /// The whole output along x and y.
    pub(super) axes: [Axis; 2],
}

impl View {
    /// The view of a region, with the stored size and the output size in pixels.
    pub(crate) fn new(
        stored: (u32, u32),
        output: (u32, u32),
        region: Region,
        kernel: Kernel,
    ) -> Self {
        let axes = [Axis::new(stored.0, output.0), Axis::new(stored.1, output.1)];
        let scale =
            [axes[0].grid() as f32 / stored.0 as f32, axes[1].grid() as f32 / stored.1 as f32];
        // The variance of a pixel of the grid is 1/12. That of a stored pixel is in the Gaussians
        // already.
        let divisor = 12.0 * kernel.variance();
        let filter = scale.map(|s| if s < 1.0 { (1.0 - s * s) / divisor } else { 0.0 });
        let columns = axes[0].span(region.x..region.x + region.width);
        let rows = axes[1].span(region.y..region.y + region.height);
        let of_grid = Region {
            x: columns.start,
            y: rows.start,
            width: columns.end - columns.start,
            height: rows.end - rows.start,
        };
        Self { scale, filter, region: of_grid, output: region, axes }
    }

    /// Whether the output is smaller than the stored picture along an axis, and averaged from the
    /// grid.
    pub(super) fn is_reduced(&self) -> bool {
        self.axes.iter().any(|axis| axis.is_reduced())
    }
}
