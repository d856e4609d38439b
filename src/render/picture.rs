//! A picture, and all ways to render it.

use alloc::vec;
#[cfg(feature = "encode")]
use alloc::vec::Vec;

use super::band::RenderInput;
use super::output::Sample;
use super::strips::PreparedRender;
use super::texture_view::TextureView;
use super::view::{RenderOptions, View};
use crate::container::Header;
use crate::error::{DecodeError, LimitKind, PictureError, RequestError};
use crate::gaussian::Gaussian;
use crate::limits::Limits;
#[cfg(feature = "encode")]
use crate::region::Region;
use crate::texture::Texture;

/// Refuses Gaussians that are not drawn, and more than so many.
pub(crate) fn check(gaussians: &[Gaussian], allowed: u32) -> Result<(), PictureError> {
    if gaussians.len() > allowed as usize {
        return Err(PictureError::Count { found: gaussians.len(), allowed });
    }
    let flaw = |(index, gaussian): (usize, &Gaussian)| {
        Some(PictureError::Gaussian { index, rule: gaussian.flaw()? })
    };
    gaussians.iter().enumerate().find_map(flaw).map_or(Ok(()), Err)
}

/// A picture that can be rendered: a header and the Gaussians that have arrived, or that come from elsewhere.
///
/// Rendering evaluates the sum of the Gaussians at the centres of pixels: those of the output, at
/// the stored size or a larger one, or those that a smaller output is averaged from, for the whole
/// picture or a region, with all Gaussians or only the first ones. Where the picture has texture, noise of
/// the strength that the file says is added. The samples are specified bit for bit (spec, section 9):
/// they depend neither on the machine nor on SIMD or threads.
#[derive(Clone, Copy, Debug)]
pub struct Picture<'a> {
    header: &'a Header,
    gaussians: &'a [Gaussian],
    limits: &'a Limits,
    /// The memory that the decoder holds, in bytes.
    decoder_memory: u64,
    texture: Option<&'a Texture>,
}

impl<'a> Picture<'a> {
    pub(crate) fn new(
        header: &'a Header,
        gaussians: &'a [Gaussian],
        limits: &'a Limits,
        decoder_memory: u64,
    ) -> Self {
        Self { header, gaussians, limits, decoder_memory, texture: None }
    }

    /// A picture of Gaussians that come from elsewhere. Of the header it is size, colour model, depth, kernel
    /// and base colour that matter: see [`Header::new`].
    ///
    /// # Errors
    /// When a field of the header is out of range, when there are more Gaussians than a limit allows, and for the first Gaussian that the format would not draw:
    /// one whose covariance is not positive definite or that has a value that is not finite or too large.
    pub fn from_gaussians(
        header: &'a Header,
        gaussians: &'a [Gaussian],
        limits: &'a Limits,
    ) -> Result<Self, PictureError> {
        header.check()?;
        check(gaussians, limits.max_gaussians)?;
        Ok(Self::new(header, gaussians, limits, 0))
    }

    /// The picture with a texture.
    pub(crate) fn with_texture(self, texture: Option<&'a Texture>) -> Self {
        Self { texture, ..self }
    }

    /// The picture with other Gaussians, for which the decoder holds so much memory.
    #[cfg(feature = "std")]
    pub(crate) fn with_gaussians(self, gaussians: &'a [Gaussian], decoder_memory: u64) -> Self {
        Self { gaussians, decoder_memory, ..self }
    }

    /// The header.
    #[must_use]
    pub fn header(&self) -> &'a Header {
        self.header
    }

    /// The Gaussians that have arrived, in file order.
    #[must_use]
    pub fn gaussians(&self) -> &'a [Gaussian] {
        self.gaussians
    }

    /// The map of the texture as a picture of its own; `None` without texture. Its pixels are the map's nodes,
    /// and the planes that it renders are their sums: the strengths of two octaves, and the direction (spec,
    /// section 9.7). This is for programs that make the texture themselves, for instance on a GPU.
    #[must_use]
    pub fn texture_map(&self) -> Option<Self> {
        let texture = self.texture?;
        let (header, gaussians) = (texture.header(), texture.gaussians());
        Some(Self::new(header, gaussians, self.limits, self.decoder_memory))
    }

    /// The number of samples of the output with these options: width x height x channels of the
    /// region that is rendered. It is checked against the [`Limits`], so that it is safe to
    /// allocate.
    ///
    /// # Errors
    /// When the output size or the region is out of range, when the colour model lacks a channel of
    /// the picture, or when the size exceeds a limit.
    pub fn output_len(&self, options: &RenderOptions) -> Result<usize, DecodeError> {
        let view = options.view(self.header, self.limits)?;
        let samples = view.output.pixels() * options.output_color(self.header)?.channels() as u64;
        usize::try_from(samples).map_err(|_| DecodeError::Limit {
            kind: LimitKind::Memory,
            wanted: samples,
            allowed: usize::MAX as u64,
        })
    }

    /// Renders interleaved 8-bit samples: height x width x channels, rows from the top, without
    /// padding. Sums are clamped to [0, 1] and rounded (spec, section 9.5).
    ///
    /// # Errors
    /// As [`Picture::output_len`], when `out` does not have that length, and when the memory or the
    /// work would exceed a limit. `out` is not changed then.
    pub fn render_u8(&self, options: &RenderOptions, out: &mut [u8]) -> Result<(), DecodeError> {
        self.render(options, out)
    }

    /// Renders interleaved 16-bit samples, 0 to 65535, otherwise as [`Picture::render_u8`].
    ///
    /// # Errors
    /// As [`Picture::render_u8`].
    pub fn render_u16(&self, options: &RenderOptions, out: &mut [u16]) -> Result<(), DecodeError> {
        self.render(options, out)
    }

    /// Renders planes of `f32`, channels x height x width: all samples of the first channel, then
    /// all of the second, and so on. 1.0 is a full sample. Samples are neither clamped nor rounded:
    /// in black and white parts of a picture they may be far outside of [0, 1], because an encoder
    /// takes into account that integer samples are clamped. Those of an output that is smaller than
    /// the picture are averages of clamped values.
    ///
    /// # Errors
    /// As [`Picture::render_u8`].
    pub fn render_planes(
        &self,
        options: &RenderOptions,
        out: &mut [f32],
    ) -> Result<(), DecodeError> {
        let render = self.prepare_for(options, out.len())?;
        render.planes(0..render.strips(), options.threads, out);
        Ok(())
    }

    /// Checks the request and the limits as rendering does.
    ///
    /// # Errors
    /// As [`Picture::render_planes`].
    #[cfg(feature = "encode")]
    pub(crate) fn check(&self, options: &RenderOptions) -> Result<(), DecodeError> {
        self.prepare(options).map(|_| ())
    }

    /// Renders as [`Picture::render_planes`], but strip by strip from the top, each in the memory of the
    /// last one. At the stored size, strips have `bands` times [`BAND_HEIGHT`] rows, except the last one.
    /// Every strip is shown to `visit` with its place in the region, until that returns an error.
    ///
    /// # Errors
    /// That of `visit`.
    ///
    /// # Panics
    /// When the options or a limit forbid to render.
    #[cfg(feature = "encode")]
    pub(crate) fn render_strips<E>(
        &self,
        options: &RenderOptions,
        bands: usize,
        mut visit: impl FnMut(Region, &[f32]) -> Result<(), E>,
    ) -> Result<(), E> {
        let render = self.prepare(options).expect("nothing forbids to render");
        let whole = render.input.view.output;
        let mut planes = Vec::new();
        for first in (0..render.strips()).step_by(bands) {
            let y = first * render.strip_height();
            let height = (whole.height as usize - y).min(bands * render.strip_height());
            let region = Region { x: 0, y: y as u32, width: whole.width, height: height as u32 };
            planes.resize(region.pixels() as usize * render.sources.len(), 0.0);
            let end = render.strips().min(first + bands);
            render.planes(first..end, options.threads, &mut planes);
            visit(region, &planes)?;
        }
        Ok(())
    }

    fn render<T: Sample>(&self, options: &RenderOptions, out: &mut [T]) -> Result<(), DecodeError> {
        let render = self.prepare_for(options, out.len())?;
        render.interleaved(options.threads, out);
        Ok(())
    }

    /// As [`Picture::prepare`], where `found` is the length of the output buffer.
    fn prepare_for(
        &self,
        options: &RenderOptions,
        found: usize,
    ) -> Result<PreparedRender<'a>, DecodeError> {
        let wanted = self.output_len(options)?;
        if wanted != found {
            return Err(RequestError::BufferLength { found, wanted }.into());
        }
        self.prepare(options)
    }

    /// Checks the request and the limits, and finds the Gaussians of each band.
    fn prepare(&self, options: &RenderOptions) -> Result<PreparedRender<'a>, DecodeError> {
        let view = options.view(self.header, self.limits)?;
        let color = options.output_color(self.header)?;
        let count = options.prefix.map_or(self.gaussians.len(), |count| count as usize);
        let gaussians = &self.gaussians[..count.min(self.gaussians.len())];
        let input = RenderInput { gaussians, view, kernel: self.header.kernel };
        let texture = match self.texture_map().filter(|_| options.texture) {
            Some(map) => self.texture_view(&map, &view, options)?,
            None => None,
        };
        PreparedRender::new(
            input,
            texture,
            self.header,
            color,
            self.limits,
            self.decoder_memory,
            options,
        )
    }
    /// The texture of a view, for which the map is rendered.
    fn texture_view(
        &self,
        map: &Picture<'_>,
        view: &View,
        options: &RenderOptions,
    ) -> Result<Option<TextureView>, DecodeError> {
        // Its size follows that of the picture, which was checked.
        let (max_width, max_height, max_pixels) = (u32::MAX, u32::MAX, u64::MAX);
        let limits = Limits { max_width, max_height, max_pixels, ..self.limits.clone() };
        let sides = [self.header, map.header].map(|header| [header.width, header.height]);
        TextureView::new(sides[0], sides[1], view, |nodes| {
            let samples = nodes.pixels() * map.header.color.channels() as u64;
            let memory = self.decoder_memory + samples * size_of::<f32>() as u64;
            limits.check_memory(memory)?;
            let mut sums = vec![0.0; samples as usize];
            let map = Picture { limits: &limits, decoder_memory: memory, ..*map };
            map.render_planes(&options.for_map(nodes), &mut sums)?;
            Ok(sums)
        })
    }
}
