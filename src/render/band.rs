//! What is held to render a picture: which Gaussians may show in which band of it, and the splats
//! of one band at a time.

use alloc::vec;
use alloc::vec::Vec;
use core::ops::Range;

#[cfg(feature = "std")]
use fearless_simd::dispatch;

use super::footprint::LANES;
use super::groups::{Group, Groups, MOST_TOGETHER};
use super::kernel::Kernel;
use super::splat::{Block, Splat, fill};
use super::tile::{Backend, TILE_PIXELS};
#[cfg(feature = "std")]
use super::tiling::truncated_at_once;
use super::tiling::{Columns, Extent, Grid, truncated};
use super::view::View;
use crate::error::DecodeError;
use crate::gaussian::Gaussian;
use crate::limits::Limits;

/// Rows of tiles in a band.
pub(crate) const BAND_ROWS: usize = 4;

/// What is drawn, and how it is looked at.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Scene<'a> {
    pub(crate) gaussians: &'a [Gaussian],
    pub(crate) view: View,
    pub(crate) kernel: Kernel,
}

/// Which Gaussians may show in which band.
#[derive(Debug)]
pub(crate) struct Bands {
    grid: Grid,
    /// `members[starts[b]..starts[b + 1]]` are those of band b, in file order.
    starts: Vec<usize>,
    members: Vec<u32>,
}

impl Bands {
    /// Sorts Gaussians by band; `held` is what the caller already holds, in bytes, and `threads`
    /// how many will render.
    pub(crate) fn new(
        scene: &Scene<'_>,
        backend: Backend,
        limits: &Limits,
        held: u64,
        threads: usize,
    ) -> Result<Self, DecodeError> {
        let Scene { gaussians, view, kernel } = scene;
        let grid = Grid::new(view.region);
        let bands = grid.rows.div_ceil(BAND_ROWS);
        let by_band = (bands as u64 + 1) * (size_of::<usize>() + size_of::<Load>()) as u64;
        let by_gaussian = gaussians.len() as u64 * size_of::<Range<u32>>() as u64;
        let held = held + by_band + by_gaussian;
        limits.check_memory(held)?;
        let mut starts = vec![0_usize; bands + 1];
        // By how much the load changes from one band to the next.
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
        let (mut total, mut most, mut load) = (0, 0, Load::default());
        for (start, change) in starts.iter_mut().zip(changes) {
            load.add(change);
            *start = total;
            total += load.members as usize;
            most = most.max(load.memory(grid.columns));
        }
        let columns = (2 * grid.columns + 1) * size_of::<usize>() + size_of::<Group>();
        let per_thread = most + columns as u64;
        let memory = total as u64 * size_of::<u32>() as u64;
        limits.check_memory(held + memory + per_thread * threads.min(bands) as u64)?;
        let mut members = vec![0; total];
        // `starts[b]` runs through its band's members and ends where the next begins; shift it
        // back afterwards.
        for (index, reach) in (0..).zip(&reaches) {
            for start in &mut starts[reach.start as usize..reach.end as usize] {
                members[*start] = index;
                *start += 1;
            }
        }
        starts.rotate_right(1);
        starts[0] = 0;
        Ok(Self { grid, starts, members })
    }

    pub(crate) fn columns(&self) -> usize {
        self.grid.columns
    }

    pub(crate) fn count(&self) -> usize {
        self.starts.len() - 1
    }

    /// How many rows of tiles a band has: the last one may have fewer.
    pub(crate) fn rows(&self, band: usize) -> usize {
        BAND_ROWS.min(self.grid.rows - band * BAND_ROWS)
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
            + groups * size_of::<Group>() as u64
    }
}

/// The splats of one band, and which of them touch which tile of a row.
#[derive(Debug, Default)]
pub(crate) struct Band {
    blocks: Vec<Block>,
    /// For every row of tiles, those that each splat touches.
    columns: [Vec<Columns>; BAND_ROWS],
    groups: Groups,
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
        let members = &bands.members[bands.starts[band]..bands.starts[band + 1]];
        let blocks = members.len().div_ceil(LANES);
        self.blocks.clear();
        self.blocks.reserve_exact(blocks);
        self.blocks.resize(blocks, [Splat::NOWHERE; LANES]);
        for columns in &mut self.columns {
            columns.clear();
            columns.reserve_exact(blocks);
            columns.resize(blocks, [[0; LANES]; 2]);
        }
        for (index, (members, block)) in members.chunks(LANES).zip(&mut self.blocks).enumerate() {
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
    ) -> (&Groups, &[Block]) {
        self.groups.sort(backend, columns, &self.columns[row]);
        (&self.groups, &self.blocks)
    }
}
