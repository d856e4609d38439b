//! From Gaussians to samples (spec, section 9).
//!
//! The output is divided into bands of four rows of tiles. [`band`] finds the Gaussians that may
//! show in each band, and prepares its splats; [`tile_lists`] finds those that touch each tile;
//! [`tile`] adds them up; and [`output`] converts the sums to samples. Threads work on different
//! bands.

mod band;
mod footprint;
mod output;
#[cfg(feature = "std")]
pub(crate) mod simd_kernel;
pub(crate) mod splat;
mod tile;
pub(crate) mod tile_grid;
mod tile_lists;
pub(crate) mod view;

use alloc::vec::Vec;
use core::cmp::Reverse;
use core::ops::Range;

pub(crate) use output::Sample;
pub use view::RenderOptions;

use band::{BAND_ROWS, Band, Bands, RenderInput};
use output::Destination;
use tile::{PairPlane, Tile};
use tile_grid::{PAIR_WIDTH, TILE_HEIGHT, TILE_WIDTH};

use crate::container::Header;
use crate::error::{DecodeError, LimitKind, RequestError};
use crate::gaussian::Gaussian;
use crate::limits::Limits;
#[cfg(feature = "encode")]
use crate::region::Region;
use crate::simd::Backend;
use crate::threads::{self, Threads};

/// Rows of pixels in a band.
pub(crate) const BAND_HEIGHT: usize = BAND_ROWS * TILE_HEIGHT;
/// Most bytes that a band takes in the list of the parts of the output.
const STRIP_MEMORY: u64 = 128;

/// A picture that can be rendered: a header and the Gaussians that have arrived.
///
/// Rendering evaluates the sum of the Gaussians at the centres of the output's pixels: at the
/// stored size or any other, for the whole picture or a region, with all Gaussians or only the
/// first ones. The samples are specified bit for bit (spec, section 9): they depend neither on the
/// machine nor on SIMD or threads.
#[derive(Clone, Copy, Debug)]
pub struct Picture<'a> {
    header: &'a Header,
    gaussians: &'a [Gaussian],
    limits: &'a Limits,
    /// The memory that the decoder holds, in bytes.
    decoder_memory: u64,
}

impl<'a> Picture<'a> {
    pub(crate) fn new(
        header: &'a Header,
        gaussians: &'a [Gaussian],
        limits: &'a Limits,
        decoder_memory: u64,
    ) -> Self {
        Self { header, gaussians, limits, decoder_memory }
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

    /// The number of samples of the output with these options: width x height x channels of the
    /// region that is rendered. It is checked against the [`Limits`], so that it is safe to
    /// allocate.
    ///
    /// # Errors
    /// When the output size or the region is out of range, when the colour model lacks a channel of
    /// the picture, or when the size exceeds a limit.
    pub fn output_len(&self, options: &RenderOptions) -> Result<usize, DecodeError> {
        let view = options.view(self.header, self.limits)?;
        let samples = view.region.pixels() * options.output_color(self.header)?.channels() as u64;
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
    /// takes into account that integer samples are clamped.
    ///
    /// # Errors
    /// As [`Picture::render_u8`].
    pub fn render_planes(
        &self,
        options: &RenderOptions,
        out: &mut [f32],
    ) -> Result<(), DecodeError> {
        let render = self.prepare_for(options, out.len())?;
        render.planes(0..render.bands.count(), options.threads, out);
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
    /// last one. Strips have `bands` times [`BAND_HEIGHT`] rows, except the last one. Every strip is
    /// shown to `visit` with its place in the region, until that returns an error.
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
        let whole = render.input.view.region;
        let mut planes = Vec::new();
        for first in (0..render.bands.count()).step_by(bands) {
            let y = first * BAND_HEIGHT;
            let height = (whole.height as usize - y).min(bands * BAND_HEIGHT);
            let region = Region { x: 0, y: y as u32, width: whole.width, height: height as u32 };
            planes.resize(region.pixels() as usize * render.sources.len(), 0.0);
            let end = render.bands.count().min(first + bands);
            render.planes(first..end, options.threads, &mut planes);
            visit(region, &planes)?;
        }
        Ok(())
    }

    fn render<T: Sample>(&self, options: &RenderOptions, out: &mut [T]) -> Result<(), DecodeError> {
        let render = self.prepare_for(options, out.len())?;
        let stride = render.input.view.region.width as usize * render.sources.len();
        let mut strips: Vec<_> = out.chunks_mut(stride * BAND_HEIGHT).enumerate().collect();
        render.sort(&mut strips);
        threads::for_each(options.threads, strips, |memory: &mut Band, (band, strip)| {
            render.band(memory, band, |planes, x, y| {
                let mut destination = Destination { x, rows: &mut strip[y * stride..], stride };
                output::write_interleaved(render.backend, planes, render.sources, &mut destination);
            });
        });
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
        let strips = u64::from(view.region.height).div_ceil(BAND_HEIGHT as u64) * STRIP_MEMORY;
        let (memory, kernel) = (self.decoder_memory + strips, self.header.kernel);
        let (input, backend) = (RenderInput { gaussians, view, kernel }, options.backend);
        let bands = Bands::new(&input, backend, self.limits, memory, options.threads)?;
        Ok(PreparedRender {
            input,
            bands,
            channels: self.header.color.channels(),
            sources: output::sources(self.header.color, color),
            base: self.header.base(),
            backend,
        })
    }
}

/// A rendering whose request and limits were checked: it cannot fail any more.
struct PreparedRender<'a> {
    input: RenderInput<'a>,
    bands: Bands,
    /// The number of channels of the picture.
    channels: usize,
    /// For each channel of the output the plane that it is copied from; see [`output::sources`].
    sources: &'static [Option<usize>],
    base: [f32; 4],
    backend: Backend,
}

impl PreparedRender<'_> {
    /// Renders some bands to planes that hold these bands and no others.
    fn planes(&self, bands: Range<usize>, threads: Threads, out: &mut [f32]) {
        let width = self.input.view.region.width as usize;
        let pixels = out.len() / self.sources.len();
        let mut planes: Vec<&mut [f32]> = out.chunks_exact_mut(pixels).collect();
        let mut strips = Vec::with_capacity(bands.len());
        for band in bands {
            let length = planes[0].len().min(width * BAND_HEIGHT);
            let strip = planes.iter_mut().map(|plane| {
                let (strip, rest) = core::mem::take(plane).split_at_mut(length);
                *plane = rest;
                strip
            });
            strips.push((band, strip.collect::<Vec<_>>()));
        }
        self.sort(&mut strips);
        threads::for_each(threads, strips, |memory: &mut Band, (band, mut strip)| {
            self.band(memory, band, |planes, x, y| {
                output::write_planes(planes, (x, y), self.sources, &mut strip, width);
            });
        });
    }

    /// Puts the bands with the most Gaussians first, so that at the end no thread waits for one of
    /// them.
    fn sort<T>(&self, strips: &mut [(usize, T)]) {
        strips.sort_by_cached_key(|&(band, _)| Reverse(self.bands.gaussians_in(band)));
    }

    /// Renders one band in the memory of an earlier one. Calls `write` with each pair of tiles, and
    /// with its first column in the region and its first row in the band, in pixels.
    fn band(&self, memory: &mut Band, band: usize, write: impl FnMut(&[PairPlane], usize, usize)) {
        memory.prepare(&self.bands, band, &self.input, self.backend);
        match self.channels {
            1 => self.band_of::<1>(memory, band, write),
            2 => self.band_of::<2>(memory, band, write),
            3 => self.band_of::<3>(memory, band, write),
            _ => self.band_of::<4>(memory, band, write),
        }
    }

    /// Renders one band of a picture with `CHANNELS` channels.
    fn band_of<const CHANNELS: usize>(
        &self,
        memory: &mut Band,
        band: usize,
        mut write: impl FnMut(&[PairPlane], usize, usize),
    ) {
        let base: [f32; CHANNELS] = core::array::from_fn(|channel| self.base[channel]);
        let mut planes = [[[0.0; PAIR_WIDTH]; TILE_HEIGHT]; CHANNELS];
        for row in 0..self.bands.rows(band) {
            let y = row * TILE_HEIGHT;
            let top = self.input.view.region.y + (band * BAND_HEIGHT + y) as u32;
            let (lists, blocks) = memory.row(self.backend, self.bands.columns(), row);
            let columns = self.bands.columns();
            for first in (0..columns).step_by(2) {
                for (half, column) in (first..columns.min(first + 2)).enumerate() {
                    let x = (column * TILE_WIDTH) as u32;
                    let origin = (self.input.view.region.x + x, top);
                    let splats = lists.splats(column);
                    Tile { origin, base, blocks, splats, kernel: self.input.kernel }.render(
                        self.backend,
                        half,
                        &mut planes,
                    );
                }
                write(&planes, first * TILE_WIDTH, y);
            }
        }
    }
}
