//! What to draw of a picture (spec, section 9.1).

use image_gip::{Header, Region, RequestError};

/// Largest width and height of an output in pixels: every pixel centre is exact in `f32`.
const MAX_OUTPUT_SIDE: u32 = 1 << 23;

/// What to draw of a picture: its scale and a region (spec, section 9.1). The default is the whole
/// picture at its stored size, with all Gaussians.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
#[must_use]
pub struct View {
    size: Option<(u32, u32)>,
    region: Option<Region>,
    prefix: Option<u32>,
}

impl View {
    /// The whole picture at its stored size, with all Gaussians.
    pub fn new() -> Self {
        Self::default()
    }

    /// Draws the whole picture with `width` x `height` pixels, each 1 to 2^23. For a detail of a
    /// very large output, add [`View::with_region`].
    pub fn with_size(mut self, width: u32, height: u32) -> Self {
        self.size = Some((width, height));
        self
    }

    /// Draws only this region, in pixels of the output size, inside of which it must be.
    pub fn with_region(mut self, region: Region) -> Self {
        self.region = Some(region);
        self
    }

    /// Draws only the first `count` Gaussians of the file, or all if there are fewer.
    pub fn with_prefix(mut self, count: u32) -> Self {
        self.prefix = Some(count);
        self
    }

    /// The scale, region and Gaussians for a picture.
    pub(crate) fn resolve(self, header: &Header, gaussians: u32) -> Result<Frame, RequestError> {
        let (width, height) = self.size.unwrap_or((header.width, header.height));
        let sides = 1..=MAX_OUTPUT_SIDE;
        if !sides.contains(&width) || !sides.contains(&height) {
            return Err(RequestError::OutputSize { width, height });
        }
        let region = self.region.unwrap_or(Region { x: 0, y: 0, width, height });
        let inside = |at: u32, length: u32, whole: u32| {
            length > 0 && at.checked_add(length).is_some_and(|end| end <= whole)
        };
        if !inside(region.x, region.width, width) || !inside(region.y, region.height, height) {
            return Err(RequestError::Region { region, width, height });
        }
        let scale = [width as f32 / header.width as f32, height as f32 / header.height as f32];
        let gaussians = self.prefix.map_or(gaussians, |count| count.min(gaussians));
        Ok(Frame { scale, region, gaussians })
    }
}

/// Width and height of a tile in pixels: the constant `TILE` of the shader.
pub(crate) const TILE: u32 = 16;
/// Most bins along each axis.
pub(crate) const MAX_BINS: u32 = 16;

/// A view of a picture whose request was checked.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Frame {
    /// Pixels of the output for one stored pixel, along x and y.
    pub(crate) scale: [f32; 2],
    /// What is drawn, in pixels of the output.
    pub(crate) region: Region,
    /// How many Gaussians are drawn.
    pub(crate) gaussians: u32,
}

impl Frame {
    /// Columns and rows of tiles.
    pub(crate) fn tiles(&self) -> [u32; 2] {
        [self.region.width, self.region.height].map(|side| side.div_ceil(TILE))
    }

    /// Width and height of a bin in tiles.
    pub(crate) fn bin_tiles(&self) -> u32 {
        let [columns, rows] = self.tiles();
        columns.max(rows).div_ceil(MAX_BINS)
    }

    /// Columns and rows of bins.
    pub(crate) fn bins(&self) -> [u32; 2] {
        self.tiles().map(|tiles| tiles.div_ceil(self.bin_tiles()))
    }
}
