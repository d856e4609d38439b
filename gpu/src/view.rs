//! What to draw of a picture (spec, section 9.1).

use image_gip::{Header, Region, RenderOptions, RequestError};

/// What to draw of a picture: its scale and a region (spec, section 9.1). The default is the whole
/// picture at its stored size, with all Gaussians and its texture.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
#[must_use]
pub struct View {
    size: Option<(u32, u32)>,
    region: Option<Region>,
    prefix: Option<u32>,
    texture: bool,
}

impl Default for View {
    fn default() -> Self {
        Self { size: None, region: None, prefix: None, texture: true }
    }
}

impl View {
    /// The whole picture at its stored size, with all Gaussians and its texture.
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

    /// Whether the picture's texture is drawn. Default `true`.
    pub fn with_texture(mut self, texture: bool) -> Self {
        self.texture = texture;
        self
    }

    /// The view for a mip level of the texture that this one is for, whose sides are halved and rounded
    /// down. That of level 0 is this one; further levels show the whole picture.
    pub(crate) fn mip_level(self, header: &Header, level: u32) -> Self {
        if level == 0 {
            return self;
        }
        let (width, height) = self.size.unwrap_or((header.width, header.height));
        Self {
            size: Some(((width >> level).max(1), (height >> level).max(1))),
            region: None,
            ..self
        }
    }

    /// Whether the view shows the whole picture, in all pixels of a texture of this size.
    pub(crate) fn fills(&self, header: &Header, texture: (u32, u32)) -> bool {
        self.region.is_none() && self.size.unwrap_or((header.width, header.height)) == texture
    }

    /// The scale, region and Gaussians for a picture.
    pub(crate) fn resolve(self, header: &Header, gaussians: u32) -> Result<Frame, RequestError> {
        let (width, height) = self.size.unwrap_or((header.width, header.height));
        let sides = 1..=RenderOptions::MAX_OUTPUT_SIDE;
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
        let gaussians = self.prefix.map_or(gaussians, |count| count.min(gaussians));
        let columns = Axis::new(header.width, width, (region.x, region.width));
        let rows = Axis::new(header.height, height, (region.y, region.height));
        let grid =
            Region { x: columns.first, y: rows.first, width: columns.length, height: rows.length };
        Ok(Frame {
            scale: [columns.scale, rows.scale],
            grid,
            region,
            ratio: [columns.ratio, rows.ratio],
            offset: [columns.offset, rows.offset],
            gaussians,
            fade: if self.texture { fade(header, (width, height)) } else { 0.0 },
        })
    }
}

/// What the strength of a picture's texture is multiplied by for a whole output of this size (spec, section 9.7).
fn fade(header: &Header, (width, height): (u32, u32)) -> f32 {
    let columns = width as f32 / header.width as f32;
    let rows = height as f32 / header.height as f32;
    (8.0 * columns.min(rows) - 1.0).clamp(0.0, 1.0)
}

/// Most pixels of the grid for one output pixel along an axis.
const MOST_PER_PIXEL: u64 = 8;

/// One axis of a frame: see [`Frame`].
struct Axis {
    scale: f32,
    first: u32,
    length: u32,
    ratio: f32,
    offset: f32,
}

impl Axis {
    /// The axis with the sides of the stored picture and of the output, and the first pixel and the
    /// number of pixels of the region in the output (spec, sections 9.2 and 9.5).
    fn new(stored: u32, output: u32, (start, length): (u32, u32)) -> Self {
        let mut divisor = 1;
        while MOST_PER_PIXEL * (u64::from(output) + 1) * divisor < stored.into() {
            divisor *= 2;
        }
        let grid = u64::from(stored).div_ceil(divisor).max(output.into());
        let (from, to) = (u64::from(start) * grid, u64::from(start + length) * grid);
        let side = u64::from(output);
        let first = from / side;
        Self {
            scale: grid as f32 / stored as f32,
            first: first as u32,
            length: (to.div_ceil(side) - first) as u32,
            ratio: (grid as f64 / side as f64) as f32,
            offset: ((from % side) as f64 / side as f64) as f32,
        }
    }
}

/// Width and height of a tile in pixels: the constant `TILE` of the shader.
pub(crate) const TILE: u32 = 16;
/// Most bins along each axis.
pub(crate) const MAX_BINS: u32 = 16;

/// A view of a picture whose request was checked.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Frame {
    /// Pixels of the grid for one stored pixel, along x and y. The grid is what is evaluated: the
    /// output, or what a smaller output is the average of.
    pub(crate) scale: [f32; 2],
    /// What is evaluated, in pixels of the grid.
    pub(crate) grid: Region,
    /// What is drawn, in pixels of the output.
    pub(crate) region: Region,
    /// Pixels of the grid for one of the output.
    pub(crate) ratio: [f32; 2],
    /// Where `region` begins, in pixels of the grid from the corner of `grid`.
    pub(crate) offset: [f32; 2],
    /// How many Gaussians are drawn.
    pub(crate) gaussians: u32,
    /// What the strength of the picture's texture is multiplied by.
    pub(crate) fade: f32,
}

impl Frame {
    /// Columns and rows of tiles of the grid.
    pub(crate) fn tiles(&self) -> [u32; 2] {
        [self.grid.width, self.grid.height].map(|side| side.div_ceil(TILE))
    }

    /// Columns and rows of workgroups: tiles of the output.
    pub(crate) fn workgroups(&self) -> [u32; 2] {
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
