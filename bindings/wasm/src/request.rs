//! What to render.

use image_gip::{ColorModel, Header, Region, RenderOptions};

/// The output that is wanted: the size of the whole, the part of it, and how many Gaussians.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Request {
    size: (u32, u32),
    pub(crate) region: Region,
    gaussians: u32,
    color: ColorModel,
}

impl Request {
    /// From the numbers that `js/core.js` sends. 0 channels are those of the file.
    pub(crate) fn new(numbers: [u32; 8], header: &Header) -> Self {
        let [width, height, x, y, region_width, region_height, gaussians, channels] = numbers;
        let color = match channels {
            0 => header.color,
            1 => ColorModel::Gray,
            2 => ColorModel::GrayAlpha,
            3 => ColorModel::Rgb,
            _ => ColorModel::Rgba,
        };
        let region = Region { x, y, width: region_width, height: region_height };
        Self { size: (width, height), region, gaussians, color }
    }

    /// The number of pixels.
    pub(crate) fn pixels(&self) -> u64 {
        u64::from(self.region.width) * u64::from(self.region.height)
    }

    /// The options for all of it.
    pub(crate) fn options(&self) -> RenderOptions {
        RenderOptions::new()
            .with_size(self.size.0, self.size.1)
            .with_region(self.region)
            .with_prefix(self.gaussians)
            .with_color(self.color)
    }

    /// The same for some of its rows, which must be inside.
    pub(crate) fn rows(&self, first: u32, count: u32) -> Self {
        let region = Region { y: self.region.y + first, height: count, ..self.region };
        Self { region, ..*self }
    }
}
