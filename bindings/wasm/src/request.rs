//! What to render.

use image_gip::{ColorModel, DecodeError, Header, Orientation, Region, RenderOptions};

/// The output that is wanted: the size of the whole, the part of it, how many Gaussians, and whether the
/// texture. Size and region are those after turning.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Request {
    size: (u32, u32),
    pub(crate) region: Region,
    gaussians: u32,
    texture: bool,
    pub(crate) color: ColorModel,
    /// How to turn what the decoder renders.
    pub(crate) orientation: Orientation,
}

impl Request {
    /// From the numbers that `js/core.js` sends: the sizes, the number of Gaussians, the channels,
    /// of which 0 are those of the file, whether the output is turned by the `orientation` of the file,
    /// and whether it has the texture.
    pub(crate) fn new(numbers: [u32; 10], header: &Header, orientation: Orientation) -> Self {
        let [width, height, x, y, region_width, region_height, rest @ ..] = numbers;
        let [gaussians, channels, turned, texture] = rest;
        let color = match channels {
            0 => header.color,
            1 => ColorModel::Gray,
            2 => ColorModel::GrayAlpha,
            3 => ColorModel::Rgb,
            _ => ColorModel::Rgba,
        };
        let region = Region { x, y, width: region_width, height: region_height };
        let orientation = if turned == 0 { Orientation::NoTransforms } else { orientation };
        let texture = texture != 0;
        Self { size: (width, height), region, gaussians, texture, color, orientation }
    }

    /// The number of pixels.
    pub(crate) fn pixels(&self) -> u64 {
        u64::from(self.region.width) * u64::from(self.region.height)
    }

    /// The options for all of it, before turning.
    #[inline(never)] // Once is enough of what a page loads.
    pub(crate) fn options(&self) -> Result<RenderOptions, DecodeError> {
        let (width, height) = self.size;
        let region = self.orientation.stored_region(self.region, width, height)?;
        let (width, height) = self.orientation.turned_size(width, height);
        Ok(RenderOptions::new()
            .with_size(width, height)
            .with_region(region)
            .with_prefix(self.gaussians)
            .with_texture(self.texture)
            .with_color(self.color))
    }

    /// The same for some of its rows, which must be inside.
    pub(crate) fn rows(&self, first: u32, count: u32) -> Self {
        let region = Region { y: self.region.y + first, height: count, ..self.region };
        Self { region, ..*self }
    }
}
