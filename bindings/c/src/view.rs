//! What to render, in the words of the caller.

use image_gip::{ColorModel, Header, Region, RenderOptions, SampleDepth};

use crate::status::Failure;
use crate::structures::structure;
use crate::threads;

/// The channels of a picture, in the order of its samples. The number is that of channels. Colours are sRGB
/// unless metadata say otherwise; alpha is straight (colours are not multiplied by it) and linear.
#[repr(u32)]
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Color {
    /// Those of the file.
    File = 0,
    /// One channel.
    Gray = 1,
    /// Gray and alpha.
    GrayAlpha = 2,
    /// Red, green, blue.
    Rgb = 3,
    /// Red, green, blue, alpha.
    Rgba = 4,
}

/// The type of samples, and how they are stored. Pixels stand in rows from the top, from left to right.
/// Numbers of several bytes are those of the machine.
#[repr(u32)]
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Samples {
    /// GIP_SAMPLES_U8 or _U16, as the file says.
    File = 0,
    /// uint8_t, 0 to 255; all samples of a pixel together.
    U8 = 1,
    /// uint16_t, 0 to 65535; all samples of a pixel together.
    U16 = 2,
    /// float, where 1.0 is a full sample; all samples of a pixel together. They are neither clamped nor
    /// rounded, unless composed: in black and white parts they may be far outside of 0 to 1.
    F32 = 3,
    /// As GIP_SAMPLES_F32, but in planes: all rows of the first channel, then all of the second, and so on.
    F32Planes = 4,
}

/// For gip_view.flags: leaves out the texture of the picture, the noise in place of sand, water or leaves.
/// Without it the picture is smoother, and nearer to the source sample by sample.
pub const GIP_VIEW_NO_TEXTURE: u32 = 1;

/// What to render. 0 in every field is the whole picture as it is stored, on the thread of the caller.
///
/// Sizes and regions are of the picture as stored; gip_info.orientation tells how to turn it for display.
#[repr(C)]
#[derive(Clone, Copy, Debug)]
pub struct View {
    /// sizeof(gip_view).
    pub struct_size: usize,
    /// Width of the whole output in pixels, 1 to 2^23; 0 in both is the stored size. A larger output
    /// is evaluated at the centres of its pixels, a smaller one is the average by area: no pixels
    /// are resampled.
    pub width: u32,
    /// Height of the whole output in pixels.
    pub height: u32,
    /// First column of the region of the output to render.
    pub region_x: u32,
    /// First row of the region.
    pub region_y: u32,
    /// Width of the region in pixels; 0 in all four is the whole output. A region has the
    /// samples of the whole output, bit for bit.
    pub region_width: u32,
    /// Height of the region in pixels.
    pub region_height: u32,
    /// The channels to render, a gip_color. Gray can become RGB, and alpha can be added. If the picture has
    /// alpha and this has not, it is composed over the background. Colours do not become gray.
    pub color: u32,
    /// The type of samples, a gip_samples.
    pub samples: u32,
    /// Renders only so many Gaussians, the first of the file, which are the strongest; 0 is all. See
    /// gip_decoder_gaussians_for.
    pub gaussians: u32,
    /// 0, or GIP_VIEW_NO_TEXTURE.
    pub flags: u32,
    /// Number of threads, 0 to 1024, which end before the call does; 0 and 1 are that of the caller. The
    /// samples do not depend on it.
    pub threads: u32,
    /// Red, green and blue of the background, where 65535 is a full sample; gray takes the first. Default
    /// black. Composed are the samples that show, clamped and not linear, as in browsers.
    pub background: [u16; 3],
}

structure!(View, "gip_view", background: [u16; 3]);

/// A view of a picture, whose numbers were checked but for those that rendering checks.
#[derive(Clone, Debug)]
pub(crate) struct Request {
    /// Without threads.
    pub(crate) options: RenderOptions,
    /// Width and height in pixels of what is rendered.
    pub(crate) size: (u32, u32),
    /// The channels that are rendered, and those that the caller gets.
    pub(crate) rendered: ColorModel,
    pub(crate) returned: ColorModel,
    /// Not `Samples::File`.
    pub(crate) samples: Samples,
    /// How many Gaussians; `None` for all.
    pub(crate) gaussians: Option<u32>,
    pub(crate) threads: usize,
    pub(crate) background: [u16; 3],
}

impl View {
    pub(crate) fn request(&self, header: &Header) -> Result<Request, Failure> {
        let mut options = RenderOptions::new();
        if (self.width, self.height) != (0, 0) {
            options = options.with_size(self.width, self.height);
        }
        let Self { region_x: x, region_y: y, region_width, region_height, .. } = *self;
        let region = Region { x, y, width: region_width, height: region_height };
        if region != (Region { x: 0, y: 0, width: 0, height: 0 }) {
            options = options.with_region(region);
        }
        let returned = color_model(self.color)?.unwrap_or(header.color);
        let drops_alpha = header.color.has_alpha() && !returned.has_alpha();
        // What is composed is rendered with alpha, and widened when it is.
        let drops_color = returned.channels() < header.color.channels() - usize::from(drops_alpha);
        let rendered = if drops_alpha && !drops_color { header.color } else { returned };
        options = options.with_color(rendered);
        options.output_color(header)?;
        if self.flags & !GIP_VIEW_NO_TEXTURE != 0 {
            return Err(Failure::argument(format!("flags {}; it has others", self.flags)));
        }
        options = options.with_texture(self.flags & GIP_VIEW_NO_TEXTURE == 0);
        let gaussians = (self.gaussians > 0).then_some(self.gaussians);
        if let Some(count) = gaussians {
            options = options.with_prefix(count);
        }
        Ok(Request {
            size: options.output_size(header),
            options,
            rendered,
            returned,
            samples: samples(self.samples, header)?,
            gaussians,
            threads: threads::checked(self.threads)?,
            background: self.background,
        })
    }
}

impl Request {
    /// Whether the picture is composed over the background.
    pub(crate) fn composes(&self) -> bool {
        self.rendered.has_alpha() && !self.returned.has_alpha()
    }
}

/// The colour model of a number; `None` for that of the file.
pub(crate) fn color_model(color: u32) -> Result<Option<ColorModel>, Failure> {
    const KNOWN: [(Color, Option<ColorModel>); 5] = [
        (Color::File, None),
        (Color::Gray, Some(ColorModel::Gray)),
        (Color::GrayAlpha, Some(ColorModel::GrayAlpha)),
        (Color::Rgb, Some(ColorModel::Rgb)),
        (Color::Rgba, Some(ColorModel::Rgba)),
    ];
    let known = KNOWN.iter().find(|(known, _)| *known as u32 == color);
    known
        .map(|(_, model)| *model)
        .ok_or_else(|| Failure::argument(format!("color {color} is no gip_color")))
}

/// The type of samples of a number, for a file.
fn samples(samples: u32, header: &Header) -> Result<Samples, Failure> {
    let of_file = match header.depth {
        SampleDepth::Sixteen => Samples::U16,
        _ => Samples::U8,
    };
    let known = [Samples::U8, Samples::U16, Samples::F32, Samples::F32Planes];
    let known = known.into_iter().find(|known| *known as u32 == samples);
    known
        .or((samples == Samples::File as u32).then_some(of_file))
        .ok_or_else(|| Failure::argument(format!("samples {samples} is no gip_samples")))
}

impl Samples {
    /// Bytes of one sample.
    pub(crate) fn bytes(self) -> usize {
        match self {
            Self::File | Self::U8 => 1,
            Self::U16 => 2,
            Self::F32 | Self::F32Planes => 4,
        }
    }
}
