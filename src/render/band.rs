//! Which Gaussians may show in which band of the output, and the splats of one band at a time.

use alloc::vec;
use alloc::vec::Vec;
use core::ops::Range;

#[cfg(feature = "std")]
use fearless_simd::dispatch;

use super::range_lists::RangeLists;
use super::splat::{Block, Splat, fill_block};
#[cfg(feature = "std")]
use super::tile_grid::truncate_simd;
use super::tile_grid::{Columns, Extent, TILE_PIXELS, TILE_WIDTH, TileGrid, truncate};
use super::tile_lists::{MAX_BLOCK_SPAN, TileEntry, TileLists};
use super::view::View;
use crate::error::DecodeError;
use crate::gaussian::Gaussian;
use crate::kernel::Kernel;
use crate::limits::Limits;
use crate::simd::{Backend, LANES};
use crate::threads::{self, Threads};

/// Rows of tiles in a band.
pub(crate) const BAND_ROWS: usize = 4;

/// The Gaussians to render, with the view and the kernel.
#[derive(Clone, Copy, Debug)]
pub(crate) struct RenderInput<'a> {
    pub(crate) gaussians: &'a [Gaussian],
    pub(crate) view: View,
    pub(crate) kernel: Kernel,
}

/// Fewest Gaussians in a slice: fewer are not worth a thread.
const MIN_SLICE: usize = 512;

/// For each band of the output, the Gaussians that may show in it.
#[derive(Debug)]
pub(crate) struct Bands {
    grid: TileGrid<TILE_WIDTH>,
    /// The indices of the Gaussians of each band, for each slice of the Gaussians, in file order.
    slices: Vec<RangeLists>,
}

impl Bands {
    /// Finds the Gaussians of each band. They are divided into slices, one for each thread.
    /// `memory` is what is held already, in bytes.
    ///
    /// # Errors
    /// When memory or work would exceed the limits.
    pub(crate) fn new(
        input: &RenderInput<'_>,
        backend: Backend,
        limits: &Limits,
        memory: u64,
        threads: Threads,
    ) -> Result<Self, DecodeError> {
        let gaussians = input.gaussians;
        let grid = TileGrid::new(input.view.region);
        let count = threads.count();
        let length = gaussians.len().div_ceil(count).max(MIN_SLICE).next_multiple_of(LANES);
        let slices = gaussians.chunks(length).map(|gaussians| RenderInput { gaussians, ..*input });
        let bands = grid.rows.div_ceil(BAND_ROWS);
        let by_band = (bands as u64 + 1) * (size_of::<usize>() + size_of::<BandLoad>()) as u64;
        let by_gaussian = gaussians.len() as u64 * size_of::<Range<u32>>() as u64;
        let memory = memory + by_band * slices.len() as u64 + by_gaussian;
        limits.check_memory(memory)?;
        let ranges = threads::map(threads, slices, |slice| {
            BandRanges::new(&slice, &grid, bands, backend, limits)
        });
        let ranges = ranges.into_iter().collect::<Result<Vec<_>, _>>()?;
        let work = ranges.iter().map(|ranges| ranges.work).sum();
        limits.check_work(work, input.view.region.pixels())?;
        let mut loads = vec![BandLoad::default(); ranges.len()];
        let (mut members, mut most) = (0, 0);
        for band in 0..bands {
            for (load, ranges) in loads.iter_mut().zip(&ranges) {
                load.add(ranges.changes[band]);
            }
            members += loads.iter().map(|load| load.members).sum::<u64>();
            most = most.max(loads.iter().map(|load| load.memory(grid.columns)).sum());
        }
        let columns = (2 * grid.columns + 1) * size_of::<usize>() + size_of::<TileEntry>();
        let per_thread = most + columns as u64;
        let members = members * size_of::<u32>() as u64;
        limits.check_memory(memory + members + per_thread * count.min(bands) as u64)?;
        let firsts = (0..).step_by(length);
        let slices = threads::map(threads, ranges.into_iter().zip(firsts), |(ranges, first)| {
            let changes = ranges.changes.iter().map(|change| change.members as usize);
            RangeLists::new(changes, first, ranges.bands.iter().cloned())
        });
        Ok(Self { grid, slices })
    }

    /// The indices of the Gaussians that may show in a band, slice by slice, in file order.
    fn members(&self, band: usize) -> impl Iterator<Item = &[u32]> {
        self.slices.iter().map(move |slice| slice.of(band))
    }

    /// The number of Gaussians that may show in a band.
    pub(crate) fn gaussians_in(&self, band: usize) -> usize {
        self.members(band).map(<[u32]>::len).sum()
    }

    /// The number of tiles in a row.
    pub(crate) fn columns(&self) -> usize {
        self.grid.columns
    }

    /// The number of rows of tiles in a band: the last band may have fewer than the others.
    pub(crate) fn rows(&self, band: usize) -> usize {
        BAND_ROWS.min(self.grid.rows - band * BAND_ROWS)
    }
}

/// The bands in which each Gaussian of a slice may show.
#[derive(Debug)]
struct BandRanges {
    /// For each Gaussian, a range of bands.
    bands: Vec<Range<u32>>,
    /// For each band, the difference of its load from that of the band before it.
    changes: Vec<BandLoad>,
    /// An upper bound of the kernel evaluations.
    work: u64,
}

impl BandRanges {
    fn new(
        RenderInput { gaussians, view, kernel }: &RenderInput<'_>,
        grid: &TileGrid<TILE_WIDTH>,
        bands: usize,
        backend: Backend,
        limits: &Limits,
    ) -> Result<Self, DecodeError> {
        let mut changes = vec![BandLoad::default(); bands + 1];
        let mut ranges = Vec::with_capacity(gaussians.len());
        let mut work = 0;
        for gaussians in gaussians.chunks(LANES) {
            let extents = grid.extents(backend, gaussians, view, kernel.cutoff());
            for &Extent { first, end, columns } in &extents[..gaussians.len()] {
                work += u64::from(end - first) * u64::from(columns) * TILE_PIXELS as u64;
                // Each band counts as work, which bounds the time that hostile shapes take here and
                // in `RangeLists::new`.
                limits.check_work(work, view.region.pixels())?;
                let range = first / BAND_ROWS as u32..end.div_ceil(BAND_ROWS as u32);
                let range = if first < end { range } else { 0..0 };
                let load = BandLoad { members: 1, entries: columns.into() };
                changes[range.start as usize].add(load);
                changes[range.end as usize].subtract(load);
                ranges.push(range);
            }
        }
        Ok(Self { bands: ranges, changes, work })
    }
}

/// How much there is in a band. Differences wrap around.
#[derive(Clone, Copy, Debug, Default)]
struct BandLoad {
    /// The number of Gaussians.
    members: u64,
    /// An upper bound of the pairs of a Gaussian and a tile in any of the band's rows.
    entries: u64,
}

impl BandLoad {
    fn add(&mut self, other: Self) {
        self.members = self.members.wrapping_add(other.members);
        self.entries = self.entries.wrapping_add(other.entries);
    }

    fn subtract(&mut self, other: Self) {
        self.members = self.members.wrapping_sub(other.members);
        self.entries = self.entries.wrapping_sub(other.entries);
    }

    /// The memory of a [`Band`] in bytes, without what its tiles take whether or not splats touch
    /// them.
    fn memory(&self, columns: usize) -> u64 {
        let blocks = self.members.div_ceil(LANES as u64);
        let entries = self.entries + blocks * (columns as u64).min(MAX_BLOCK_SPAN.into());
        blocks * (size_of::<Block>() + BAND_ROWS * size_of::<Columns>()) as u64
            + entries * size_of::<TileEntry>() as u64
    }
}

/// The splats of one band, and those that touch each tile of one of its rows.
#[derive(Debug, Default)]
pub(crate) struct Band {
    blocks: Vec<Block>,
    /// For each row of tiles, the tiles that each splat touches.
    columns: [Vec<Columns>; BAND_ROWS],
    lists: TileLists,
}

impl Band {
    /// Prepares the splats of a band, in the memory of an earlier one.
    pub(crate) fn prepare(
        &mut self,
        bands: &Bands,
        band: usize,
        input: &RenderInput<'_>,
        backend: Backend,
    ) {
        match backend {
            Backend::Reference(_) => self.prepare_with(bands, band, input, truncate),
            #[cfg(feature = "std")]
            Backend::Simd(level) => dispatch!(level, simd => self.prepare_with(
                bands,
                band,
                input,
                #[inline(always)]
                |values| truncate_simd(simd, values),
            )),
        }
    }

    #[inline(always)]
    fn prepare_with(
        &mut self,
        bands: &Bands,
        band: usize,
        RenderInput { gaussians, view, kernel }: &RenderInput<'_>,
        truncate: impl Fn([f32; LANES]) -> [i32; LANES] + Copy,
    ) {
        let first = band * BAND_ROWS;
        let rows = first..(first + BAND_ROWS).min(bands.grid.rows);
        let blocks = bands.members(band).map(|members| members.len().div_ceil(LANES)).sum();
        self.blocks.clear();
        self.blocks.reserve_exact(blocks);
        self.blocks.resize(blocks, [Splat::NOWHERE; LANES]);
        for columns in &mut self.columns {
            columns.clear();
            columns.reserve_exact(blocks);
            columns.resize(blocks, [[0; LANES]; 2]);
        }
        let members = bands.members(band).flat_map(|members| members.chunks(LANES));
        for (index, (members, block)) in members.zip(&mut self.blocks).enumerate() {
            let gaussians = members.iter().map(|&index| &gaussians[index as usize]);
            let ellipses = fill_block(block, gaussians, view, kernel.scale());
            let rows = rows.clone();
            bands.grid.columns_with(&ellipses, kernel.cutoff(), rows, truncate, |row, columns| {
                self.columns[row - first][index] = *columns;
            });
        }
    }

    /// The splats that touch each of the `columns` tiles of a row of the band, and all splats of
    /// the band.
    pub(crate) fn row(
        &mut self,
        backend: Backend,
        columns: usize,
        row: usize,
    ) -> (&TileLists, &[Block]) {
        self.lists.fill(backend, columns, &self.columns[row]);
        (&self.lists, &self.blocks)
    }
}
