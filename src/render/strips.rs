//! A rendering strip by strip, each by one thread: a band, or where the output is smaller than the
//! picture, the rows that some bands are averaged to.

use alloc::vec::Vec;
use core::ops::Range;

use super::area_average::{AreaAverage, Averaging};
use super::band::{BAND_ROWS, Band, Bands, RenderInput};
use super::output::{self, Destination, Sample};
use super::texture_view::{TextureRow, TextureView};
use super::tile::{PairPlane, Tile};
use super::tile_grid::{PAIR_WIDTH, TILE_HEIGHT, TILE_WIDTH};
use super::view::{RenderOptions, View};
use crate::color::{ColorModel, with_channels};
use crate::container::Header;
use crate::error::DecodeError;
use crate::limits::Limits;
use crate::simd::Backend;
use crate::threads::{self, Threads};

/// Rows of pixels in a band.
pub(crate) const BAND_HEIGHT: usize = BAND_ROWS * TILE_HEIGHT;
/// Most bytes that a strip takes in the list of the parts of the output.
const STRIP_MEMORY: u64 = 128;

/// A rendering whose request and limits were checked: it cannot fail any more.
pub(super) struct PreparedRender<'a> {
    pub(super) input: RenderInput<'a>,
    bands: Bands,
    texture: Option<TextureView>,
    /// For an output that is smaller than the picture.
    averaging: Option<Averaging>,
    /// The number of channels of the picture.
    channels: usize,
    /// For each channel of the output the plane that it is copied from; see [`output::sources`].
    pub(super) sources: &'static [Option<usize>],
    base: [f32; 4],
    backend: Backend,
}

impl<'a> PreparedRender<'a> {
    /// Finds the Gaussians of each band. `color` is that of the output; `memory` is what the decoder
    /// holds, in bytes.
    ///
    /// # Errors
    /// When memory or work would exceed the limits.
    pub(super) fn new(
        input: RenderInput<'a>,
        texture: Option<TextureView>,
        header: &Header,
        color: ColorModel,
        limits: &Limits,
        memory: u64,
        options: &RenderOptions,
    ) -> Result<Self, DecodeError> {
        let view = &input.view;
        let averaging = view.is_reduced().then(|| Averaging {
            axes: view.axes,
            columns: (view.output.x, view.output.width),
            channels: header.color.channels(),
            has_alpha: header.color.has_alpha(),
        });
        let strips = u64::from(view.output.height).div_ceil(strip_height(view) as u64);
        let threads = strips.min(options.threads.count() as u64);
        let averages = averaging.map_or(0, |averaging| averaging.memory()) * threads;
        let (held, by_thread) = texture.as_ref().map_or((0, 0), TextureView::memory);
        let memory = memory + strips * STRIP_MEMORY + averages + held + by_thread * threads;
        let bands = Bands::new(&input, options.backend, limits, memory, options.threads)?;
        Ok(Self {
            input,
            bands,
            texture,
            averaging,
            channels: header.color.channels(),
            sources: output::sources(header.color, color),
            base: header.base(),
            backend: options.backend,
        })
    }

    /// Rows of a strip, but for the last one.
    pub(super) fn strip_height(&self) -> usize {
        strip_height(&self.input.view)
    }

    /// The number of strips.
    pub(super) fn strips(&self) -> usize {
        (self.input.view.output.height as usize).div_ceil(self.strip_height())
    }

    /// Renders all strips to interleaved samples.
    pub(super) fn interleaved<T: Sample>(&self, threads: Threads, out: &mut [T]) {
        let stride = self.input.view.output.width as usize * self.sources.len();
        let strips = out.chunks_mut(stride * self.strip_height()).enumerate().collect();
        let cost = |&(strip, _): &(usize, _)| self.gaussians_in(strip);
        threads::for_each_by_cost(threads, strips, cost, |memory: &mut Memory, (strip, out)| {
            match &self.averaging {
                None => self.band(&mut memory.rows, strip, &mut |planes, x, y| {
                    let mut destination = Destination { x, rows: &mut out[y * stride..], stride };
                    output::write_interleaved(self.backend, planes, self.sources, &mut destination);
                }),
                Some(averaging) => self.averaged(memory, averaging, strip, &mut |y, means| {
                    output::write_means(means, self.sources, &mut out[y * stride..][..stride]);
                }),
            }
        });
    }

    /// Renders some strips to planes that hold these strips and no others.
    pub(super) fn planes(&self, strips: Range<usize>, threads: Threads, out: &mut [f32]) {
        let width = self.input.view.output.width as usize;
        let pixels = out.len() / self.sources.len();
        let mut planes: Vec<&mut [f32]> = out.chunks_exact_mut(pixels).collect();
        let mut parts = Vec::with_capacity(strips.len());
        for strip in strips {
            let length = planes[0].len().min(width * self.strip_height());
            let part = planes.iter_mut().map(|plane| {
                let (part, rest) = core::mem::take(plane).split_at_mut(length);
                *plane = rest;
                part
            });
            parts.push((strip, part.collect::<Vec<_>>()));
        }
        let cost = |&(strip, _): &(usize, _)| self.gaussians_in(strip);
        threads::for_each_by_cost(threads, parts, cost, |memory: &mut Memory, (strip, part)| {
            let mut part = part;
            match &self.averaging {
                None => self.band(&mut memory.rows, strip, &mut |planes, x, y| {
                    output::write_planes(planes, (x, y), self.sources, &mut part, width);
                }),
                Some(averaging) => self.averaged(memory, averaging, strip, &mut |y, means| {
                    output::write_mean_planes(means, y, self.sources, &mut part, width);
                }),
            }
        });
    }

    /// The number of Gaussians in a strip that is a band; 0 in others.
    fn gaussians_in(&self, strip: usize) -> usize {
        if self.averaging.is_none() { self.bands.gaussians_in(strip) } else { 0 }
    }

    /// Renders one strip of a smaller output. Calls `write` with each of its rows and the means of
    /// the channels: channels x width.
    fn averaged(
        &self,
        memory: &mut Memory,
        averaging: &Averaging,
        strip: usize,
        write: &mut dyn FnMut(usize, &[f32]),
    ) {
        let View { region: grid, output, axes, .. } = self.input.view;
        let first = output.y + (strip * self.strip_height()) as u32;
        let end = (output.y + output.height).min(first + self.strip_height() as u32);
        let lines = axes[1].span(first..end);
        let (top, bottom) = ((lines.start - grid.y) as usize, (lines.end - grid.y) as usize);
        let Memory { rows, average } = memory;
        average.begin(averaging);
        let mut row = first;
        for band in top / BAND_HEIGHT..bottom.div_ceil(BAND_HEIGHT) {
            rows.band.prepare(&self.bands, band, &self.input, self.backend);
            for tiles in 0..self.bands.rows(band) {
                let y = band * BAND_HEIGHT + tiles * TILE_HEIGHT;
                let inside = y.max(top)..(y + TILE_HEIGHT).min(bottom);
                if inside.is_empty() {
                    continue;
                }
                self.row(rows, band, tiles, &mut |planes, x| average.take(averaging, planes, x));
                for line in inside {
                    let of_grid = grid.y + line as u32;
                    // A row of the grid may be in two rows of the output.
                    while row < end && axes[1].span(row..row + 1).contains(&of_grid) {
                        let Some(means) = average.add(averaging, line - y, of_grid, row) else {
                            break;
                        };
                        write((row - first) as usize, means);
                        row += 1;
                    }
                }
            }
        }
    }

    /// Renders one band in the memory of an earlier one. Calls `write` with each pair of tiles, and
    /// with its first column in the region and its first row in the band, in pixels.
    fn band(
        &self,
        memory: &mut RowMemory,
        band: usize,
        write: &mut dyn FnMut(&[PairPlane], usize, usize),
    ) {
        memory.band.prepare(&self.bands, band, &self.input, self.backend);
        for row in 0..self.bands.rows(band) {
            self.row(memory, band, row, &mut |planes, x| write(planes, x, row * TILE_HEIGHT));
        }
    }

    /// Renders one row of tiles of a band. Calls `write` with each pair of tiles, and with its first
    /// column in the region.
    fn row(
        &self,
        memory: &mut RowMemory,
        band: usize,
        row: usize,
        write: &mut dyn FnMut(&[PairPlane], usize),
    ) {
        with_channels!(CHANNELS = self.channels, self.row_of::<CHANNELS>(memory, band, row, write));
    }

    /// Renders one row of tiles of a picture with `CHANNELS` channels.
    fn row_of<const CHANNELS: usize>(
        &self,
        memory: &mut RowMemory,
        band: usize,
        row: usize,
        write: &mut dyn FnMut(&[PairPlane], usize),
    ) {
        let base: [f32; CHANNELS] = core::array::from_fn(|channel| self.base[channel]);
        let mut planes = [[[0.0; PAIR_WIDTH]; TILE_HEIGHT]; CHANNELS];
        let top = self.input.view.region.y + (band * BAND_HEIGHT + row * TILE_HEIGHT) as u32;
        let columns = self.bands.columns();
        let RowMemory { band, texture } = memory;
        let texture = match &self.texture {
            Some(view) => texture.prepare(view, self.backend, top),
            None => None,
        };
        let (lists, blocks) = band.row(self.backend, columns, row);
        for first in (0..columns).step_by(2) {
            for (half, column) in (first..columns.min(first + 2)).enumerate() {
                let x = (column * TILE_WIDTH) as u32;
                let origin = (self.input.view.region.x + x, top);
                Tile {
                    origin,
                    base,
                    texture: texture.map(|row| row.from(column * TILE_WIDTH)),
                    blocks,
                    splats: lists.splats(column),
                    kernel: self.input.kernel,
                }
                .render(self.backend, half, &mut planes);
            }
            write(&planes, first * TILE_WIDTH);
        }
    }
}

/// Rows of the output in a strip, which one thread renders at a time. Without averages it is a band. Of
/// the grid, it is some bands, as those at its ends may be prepared for its neighbours as well.
fn strip_height(view: &View) -> usize {
    if view.is_reduced() { view.axes[1].pixels_of(4 * BAND_HEIGHT) } else { BAND_HEIGHT }
}

/// What a thread renders with.
#[derive(Default)]
struct Memory {
    rows: RowMemory,
    average: AreaAverage,
}

/// What it renders a row of tiles with.
#[derive(Default)]
struct RowMemory {
    band: Band,
    texture: TextureRow,
}
