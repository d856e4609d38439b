//! Gaussians to samples: view, tiles, kernel, output (spec, section 9).

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

pub(crate) use output::Sample;
pub use view::RenderOptions;

use band::{BAND_ROWS, Band, Bands, Scene};
use output::Destination;
use tile::{PairPlane, Tile};
use tile_grid::{PAIR_WIDTH, TILE_HEIGHT, TILE_WIDTH};

use crate::container::Header;
use crate::error::{DecodeError, LimitKind, RequestError};
use crate::gaussian::Gaussian;
use crate::limits::Limits;
use crate::simd::Backend;
use crate::threads;

/// Rows of pixels in a band.
const BAND_HEIGHT: usize = BAND_ROWS * TILE_HEIGHT;
/// Most bytes that a band takes for slices of the output.
const STRIP: u64 = 128;

/// A picture that can be rendered: a header and the Gaussians that have arrived so far.
///
/// Rendering evaluates the continuous model at the centres of the output's pixels: at the stored
/// size, at any other size, for the whole picture or any region of it, with all Gaussians or the
/// first few. All output is bit-exact: it depends neither on the machine nor on SIMD or threads.
#[derive(Clone, Copy, Debug)]
pub struct Picture<'a> {
    header: &'a Header,
    gaussians: &'a [Gaussian],
    limits: &'a Limits,
    /// Bytes that the decoder holds.
    held: u64,
}

impl<'a> Picture<'a> {
    pub(crate) fn new(
        header: &'a Header,
        gaussians: &'a [Gaussian],
        limits: &'a Limits,
        held: u64,
    ) -> Self {
        Self { header, gaussians, limits, held }
    }

    /// What the file says of the picture.
    #[must_use]
    pub fn header(&self) -> &'a Header {
        self.header
    }

    /// The Gaussians that have arrived, in file order.
    #[must_use]
    pub fn gaussians(&self) -> &'a [Gaussian] {
        self.gaussians
    }

    /// The number of samples that rendering with these options writes, checked against the picture
    /// and the limits: safe to allocate.
    ///
    /// # Errors
    /// When the options do not fit the picture, or when a limit would be exceeded.
    pub fn output_len(&self, options: &RenderOptions) -> Result<usize, DecodeError> {
        let view = options.view(self.header, self.limits)?;
        let samples = view.region.pixels() * options.output_color(self.header)?.channels() as u64;
        usize::try_from(samples).map_err(|_| DecodeError::Limit {
            kind: LimitKind::Memory,
            wanted: samples,
            allowed: usize::MAX as u64,
        })
    }

    /// Renders interleaved 8-bit samples, rows from the top, without padding.
    ///
    /// # Errors
    /// When `out` is not [`Picture::output_len`] long, when the options do not fit the
    /// picture, or when a limit would be exceeded. `out` is untouched then.
    pub fn render_u8(&self, options: &RenderOptions, out: &mut [u8]) -> Result<(), DecodeError> {
        self.render(options, out)
    }

    /// Renders interleaved 16-bit samples in the machine's byte order.
    ///
    /// # Errors
    /// As [`Picture::render_u8`].
    pub fn render_u16(&self, options: &RenderOptions, out: &mut [u16]) -> Result<(), DecodeError> {
        self.render(options, out)
    }

    /// Renders planes of `f32`, one after the other: all of the first channel, then all of the
    /// second. 1.0 is a full sample; values are neither clamped nor rounded. Where a source is
    /// black or white they may lie far beyond: encoders know that integer samples are clamped.
    ///
    /// # Errors
    /// As [`Picture::render_u8`].
    pub fn render_planes(
        &self,
        options: &RenderOptions,
        out: &mut [f32],
    ) -> Result<(), DecodeError> {
        let job = self.prepare(options, out.len())?;
        let width = job.scene.view.region.width as usize;
        let pixels = width * job.scene.view.region.height as usize;
        let mut planes: Vec<&mut [f32]> = out.chunks_exact_mut(pixels).collect();
        let mut strips = Vec::with_capacity(job.bands.count());
        for band in 0..job.bands.count() {
            let length = planes[0].len().min(width * BAND_HEIGHT);
            let strip = planes.iter_mut().map(|plane| {
                let (strip, rest) = core::mem::take(plane).split_at_mut(length);
                *plane = rest;
                strip
            });
            strips.push((band, strip.collect::<Vec<_>>()));
        }
        job.sort(&mut strips);
        threads::for_each(options.threads, strips, |memory: &mut Band, (band, mut strip)| {
            job.band(memory, band, |planes, x, y| {
                output::write_planes(planes, (x, y), job.sources, &mut strip, width);
            });
        });
        Ok(())
    }

    fn render<T: Sample>(&self, options: &RenderOptions, out: &mut [T]) -> Result<(), DecodeError> {
        let job = self.prepare(options, out.len())?;
        let stride = job.scene.view.region.width as usize * job.sources.len();
        let mut strips: Vec<_> = out.chunks_mut(stride * BAND_HEIGHT).enumerate().collect();
        job.sort(&mut strips);
        threads::for_each(options.threads, strips, |memory: &mut Band, (band, strip)| {
            job.band(memory, band, |planes, x, y| {
                let mut destination = Destination { x, rows: &mut strip[y * stride..], stride };
                output::write_interleaved(job.backend, planes, job.sources, &mut destination);
            });
        });
        Ok(())
    }

    /// Checks everything and sorts the Gaussians by band; nothing of the output is touched before.
    fn prepare(&self, options: &RenderOptions, out: usize) -> Result<Job<'a>, DecodeError> {
        let wanted = self.output_len(options)?;
        if wanted != out {
            return Err(RequestError::BufferLength { found: out, wanted }.into());
        }
        let view = options.view(self.header, self.limits)?;
        let color = options.output_color(self.header)?;
        let count = options.prefix.map_or(self.gaussians.len(), |count| count as usize);
        let gaussians = &self.gaussians[..count.min(self.gaussians.len())];
        let strips = u64::from(view.region.height).div_ceil(BAND_HEIGHT as u64) * STRIP;
        let (held, kernel) = (self.held + strips, self.header.kernel);
        let (scene, backend) = (Scene { gaussians, view, kernel }, options.backend);
        let bands = Bands::new(&scene, backend, self.limits, held, options.threads)?;
        Ok(Job {
            scene,
            bands,
            channels: self.header.color.channels(),
            sources: output::sources(self.header.color, color),
            base: self.header.base(),
            backend,
        })
    }
}

/// A rendering that was checked and can no longer fail.
struct Job<'a> {
    scene: Scene<'a>,
    bands: Bands,
    channels: usize,
    /// See [`output::sources`].
    sources: &'static [Option<usize>],
    base: [f32; 4],
    backend: Backend,
}

impl Job<'_> {
    /// Puts the bands with the most Gaussians first, so that threads end at the same time.
    fn sort<T>(&self, strips: &mut [(usize, T)]) {
        strips.sort_by_cached_key(|&(band, _)| Reverse(self.bands.load(band)));
    }

    /// Renders one band in the memory of an earlier one, and hands each pair of tiles over with its
    /// first column in the region and its first row in the band.
    fn band(&self, memory: &mut Band, band: usize, write: impl FnMut(&[PairPlane], usize, usize)) {
        memory.fill(&self.bands, band, &self.scene, self.backend);
        match self.channels {
            1 => self.band_of::<1>(memory, band, write),
            2 => self.band_of::<2>(memory, band, write),
            3 => self.band_of::<3>(memory, band, write),
            _ => self.band_of::<4>(memory, band, write),
        }
    }

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
            let top = self.scene.view.region.y + (band * BAND_HEIGHT + y) as u32;
            let (groups, blocks) = memory.row(self.backend, self.bands.columns(), row);
            let columns = self.bands.columns();
            for first in (0..columns).step_by(2) {
                for (half, column) in (first..columns.min(first + 2)).enumerate() {
                    let x = (column * TILE_WIDTH) as u32;
                    let origin = (self.scene.view.region.x + x, top);
                    let members = groups.members(column);
                    Tile { origin, base, blocks, members, kernel: self.scene.kernel }.render(
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
