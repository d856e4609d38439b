//! What is held to render a picture: which Gaussians may show in which band of it, and the splats
//! of one band at a time.

use alloc::vec;
use alloc::vec::Vec;
use core::ops::Range;

#[cfg(feature = "std")]
use fearless_simd::dispatch;

use super::splat::{Block, Splat, fill};
#[cfg(feature = "std")]
use super::tile_grid::truncated_at_once;
use super::tile_grid::{Columns, Extent, TILE_PIXELS, TILE_WIDTH, TileGrid, truncated};
use super::tile_lists::{MOST_TOGETHER, TileEntry, TileLists};
use super::view::View;
use crate::error::DecodeError;
use crate::gaussian::Gaussian;
use crate::kernel::Kernel;
use crate::limits::Limits;
use crate::simd::{Backend, LANES};
use crate::threads::{self, Threads};

/// Rows of tiles in a band.
pub(crate) const BAND_ROWS: usize = 4;

/// What is drawn, and how it is looked at.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Scene<'a> {
    pub(crate) gaussians: &'a [Gaussian],
    pub(crate) view: View,
    pub(crate) kernel: Kernel,
}

/// Fewest Gaussians that are sorted by another thread.
const LEAST_APART: usize = 512;

/// Which Gaussians may show in which band.
#[derive(Debug)]
pub(crate) struct Bands {
    grid: TileGrid<TILE_WIDTH>,
    /// In file order, of some Gaussians each: one for each thread.
    parts: Vec<Part>,
}

/// Which of some Gaussians may show in which band.
#[derive(Debug)]
struct Part {
    /// `members[starts[b]..starts[b + 1]]` are those of band b, in file order.
    starts: Vec<usize>,
    members: Vec<u32>,
}

impl Bands {
    /// Sorts Gaussians by band; `held` is what the caller already holds, in bytes.
    pub(crate) fn new(
        scene: &Scene<'_>,
        backend: Backend,
        limits: &Limits,
        held: u64,
        threads: Threads,
    ) -> Result<Self, DecodeError> {
        let gaussians = scene.gaussians;
        let grid = TileGrid::new(scene.view.region);
        let count = threads.count();
        let apart = gaussians.len().div_ceil(count).max(LEAST_APART).next_multiple_of(LANES);
        let parts = gaussians.chunks(apart).map(|gaussians| Scene { gaussians, ..*scene });
        let bands = grid.rows.div_ceil(BAND_ROWS);
        let by_band = (bands as u64 + 1) * (size_of::<usize>() + size_of::<Load>()) as u64;
        let by_gaussian = gaussians.len() as u64 * size_of::<Range<u32>>() as u64;
        let held = held + by_band * parts.len() as u64 + by_gaussian;
        limits.check_memory(held)?;
        let reaches = threads::map(threads, parts, |scene| {
            Reaches::new(&scene, &grid, bands, backend, limits)
        });
        let reaches = reaches.into_iter().collect::<Result<Vec<_>, _>>()?;
        limits.check_work(reaches.iter().map(|reaches| reaches.work).sum())?;
        let mut loads = vec![Load::default(); reaches.len()];
        let (mut members, mut most) = (0, 0);
        for band in 0..bands {
            for (load, reaches) in loads.iter_mut().zip(&reaches) {
                load.add(reaches.changes[band]);
            }
            members += loads.iter().map(|load| load.members).sum::<u64>();
            most = most.max(loads.iter().map(|load| load.memory(grid.columns)).sum());
        }
        let columns = (2 * grid.columns + 1) * size_of::<usize>() + size_of::<TileEntry>();
        let per_thread = most + columns as u64;
        let memory = members * size_of::<u32>() as u64;
        limits.check_memory(held + memory + per_thread * count.min(bands) as u64)?;
        let firsts = (0..).step_by(apart);
        let parts = threads::map(threads, reaches.into_iter().zip(firsts), |(reaches, first)| {
            Part::new(&reaches, first)
        });
        Ok(Self { grid, parts })
    }

    /// The members of a band, in file order.
    fn members(&self, band: usize) -> impl Iterator<Item = &[u32]> {
        self.parts.iter().map(move |part| &part.members[part.starts[band]..part.starts[band + 1]])
    }

    /// How many Gaussians may show in a band.
    pub(crate) fn load(&self, band: usize) -> usize {
        self.members(band).map(<[u32]>::len).sum()
    }

    pub(crate) fn columns(&self) -> usize {
        self.grid.columns
    }

    pub(crate) fn count(&self) -> usize {
        self.grid.rows.div_ceil(BAND_ROWS)
    }

    /// How many rows of tiles a band has: the last one may have fewer.
    pub(crate) fn rows(&self, band: usize) -> usize {
        BAND_ROWS.min(self.grid.rows - band * BAND_ROWS)
    }
}

/// In which bands some Gaussians may show.
#[derive(Debug)]
struct Reaches {
    /// For each Gaussian.
    bands: Vec<Range<u32>>,
    /// By how much the load changes from one band to the next.
    changes: Vec<Load>,
    /// Most kernel evaluations.
    work: u64,
}

impl Reaches {
    fn new(
        Scene { gaussians, view, kernel }: &Scene<'_>,
        grid: &TileGrid<TILE_WIDTH>,
        bands: usize,
        backend: Backend,
        limits: &Limits,
    ) -> Result<Self, DecodeError> {
        let mut changes = vec![Load::default(); bands + 1];
        let mut reaches = Vec::with_capacity(gaussians.len());
        let mut work = 0;
        for gaussians in gaussians.chunks(LANES) {
            let extents = grid.extents(backend, gaussians, view, kernel.cutoff());
            for &Extent { first, end, columns } in &extents[..gaussians.len()] {
                work += u64::from(end - first) * u64::from(columns) * TILE_PIXELS as u64;
                // Every band counts as work, so that hostile shapes cannot keep this loop busy.
                limits.check_work(work)?;
                let reach = first / BAND_ROWS as u32..end.div_ceil(BAND_ROWS as u32);
                let reach = if first < end { reach } else { 0..0 };
                let load = Load { members: 1, entries: columns.into() };
                changes[reach.start as usize].add(load);
                changes[reach.end as usize].subtract(load);
                reaches.push(reach);
            }
        }
        Ok(Self { bands: reaches, changes, work })
    }
}

impl Part {
    /// Sorts Gaussians, the `first` of which has this index.
    fn new(reaches: &Reaches, first: u32) -> Self {
        let (mut total, mut load) = (0, Load::default());
        let starts = reaches.changes.iter().map(|&change| {
            load.add(change);
            let start = total;
            total += load.members as usize;
            start
        });
        let mut starts: Vec<usize> = starts.collect();
        let mut members = vec![0; total];
        // `starts[b]` runs through its band's members and ends where the next begins; shift it
        // back afterwards.
        for (index, reach) in (first..).zip(&reaches.bands) {
            for start in &mut starts[reach.start as usize..reach.end as usize] {
                members[*start] = index;
                *start += 1;
            }
        }
        starts.rotate_right(1);
        starts[0] = 0;
        Self { starts, members }
    }
}

/// What a band takes.
#[derive(Clone, Copy, Debug, Default)]
struct Load {
    members: u64,
    /// At most so many tiles are touched in any row.
    entries: u64,
}

impl Load {
    fn add(&mut self, other: Self) {
        self.members = self.members.wrapping_add(other.members);
        self.entries = self.entries.wrapping_add(other.entries);
    }

    fn subtract(&mut self, other: Self) {
        self.members = self.members.wrapping_sub(other.members);
        self.entries = self.entries.wrapping_sub(other.entries);
    }

    /// Bytes of a [`Band`], beside what the columns' own places take.
    fn memory(&self, columns: usize) -> u64 {
        let blocks = self.members.div_ceil(LANES as u64);
        let groups = self.entries + blocks * (columns as u64).min(MOST_TOGETHER.into());
        blocks * (size_of::<Block>() + BAND_ROWS * size_of::<Columns>()) as u64
            + groups * size_of::<TileEntry>() as u64
    }
}

/// The splats of one band, and which of them touch which tile of a row.
#[derive(Debug, Default)]
pub(crate) struct Band {
    blocks: Vec<Block>,
    /// For every row of tiles, those that each splat touches.
    columns: [Vec<Columns>; BAND_ROWS],
    groups: TileLists,
}

impl Band {
    /// Prepares the splats of a band, in the memory of an earlier one.
    pub(crate) fn fill(&mut self, bands: &Bands, band: usize, scene: &Scene<'_>, backend: Backend) {
        match backend {
            Backend::Reference => self.fill_with(bands, band, scene, truncated),
            #[cfg(feature = "std")]
            Backend::Simd(level) => dispatch!(level, simd => self.fill_with(
                bands,
                band,
                scene,
                #[inline(always)]
                |values| truncated_at_once(simd, values),
            )),
        }
    }

    #[inline(always)]
    fn fill_with(
        &mut self,
        bands: &Bands,
        band: usize,
        Scene { gaussians, view, kernel }: &Scene<'_>,
        truncated: impl Fn([f32; LANES]) -> [i32; LANES] + Copy,
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
            let ellipses = fill(block, gaussians, view, kernel.scale());
            let rows = rows.clone();
            bands.grid.columns_with(&ellipses, kernel.cutoff(), rows, truncated, |row, columns| {
                self.columns[row - first][index] = *columns;
            });
        }
    }

    /// The splats of the band, and those of each tile of one of its rows, which has so many.
    pub(crate) fn row(
        &mut self,
        backend: Backend,
        columns: usize,
        row: usize,
    ) -> (&TileLists, &[Block]) {
        self.groups.sort(backend, columns, &self.columns[row]);
        (&self.groups, &self.blocks)
    }
}
