//! What is held to render a picture: which Gaussians may show in which band of it, and the splats
//! of one band at a time.

use alloc::vec;
use alloc::vec::Vec;
use core::ops::Range;

use super::footprint::LANES;
use super::splat::Splat;
use super::tile::{Backend, TILE_PIXELS};
use super::tiling::{Columns, Extent, Grid, Span, TileRow};
use super::view::View;
use crate::error::DecodeError;
use crate::gaussian::Gaussian;
use crate::limits::Limits;

/// Rows of tiles in a band.
pub(crate) const BAND_ROWS: usize = 4;

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
        gaussians: &[Gaussian],
        view: &View,
        cutoff: f32,
        backend: Backend,
        limits: &Limits,
        held: u64,
        threads: usize,
    ) -> Result<Self, DecodeError> {
        let grid = Grid::new(view.region);
        let bands = grid.rows.div_ceil(BAND_ROWS);
        let by_band = (bands as u64 + 1) * (size_of::<usize>() + size_of::<Load>()) as u64;
        let by_gaussian = gaussians.len() as u64 * size_of::<Range<u32>>() as u64;
        let held = held + by_band + by_gaussian;
        limits.check_memory(held)?;
        let mut starts = vec![0_usize; bands + 1];
        let mut loads = vec![Load::default(); bands];
        let mut reaches = Vec::with_capacity(gaussians.len());
        let mut work = 0;
        for gaussians in gaussians.chunks(LANES) {
            let mut splats = [Splat::NOWHERE; LANES];
            for (splat, gaussian) in splats.iter_mut().zip(gaussians) {
                *splat = Splat::new(gaussian, view).unwrap_or(Splat::NOWHERE);
            }
            let extents = grid.extents(backend, &splats, cutoff);
            for &Extent { first, end, columns } in &extents[..gaussians.len()] {
                work += u64::from(end - first) * u64::from(columns) * TILE_PIXELS as u64;
                // Every band counts as work, so that hostile shapes cannot keep this loop busy.
                limits.check_work(work)?;
                let reach = first / BAND_ROWS as u32..end.div_ceil(BAND_ROWS as u32);
                let reach = if first < end { reach } else { 0..0 };
                for load in &mut loads[reach.start as usize..reach.end as usize] {
                    load.members += 1;
                    load.entries += u64::from(columns);
                }
                reaches.push(reach);
            }
        }
        let mut total = 0;
        for (start, load) in starts.iter_mut().zip(&loads) {
            *start = total;
            total += load.members as usize;
        }
        let most = loads.iter().map(Load::memory).max().unwrap_or(0);
        let columns = (grid.columns + 1) * size_of::<usize>();
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
    /// Bytes of a [`Band`], beside one word for each column.
    fn memory(&self) -> u64 {
        let blocks = self.members.div_ceil(LANES as u64);
        self.members * size_of::<Splat>() as u64
            + blocks * (BAND_ROWS * size_of::<Columns>()) as u64
            + self.entries * size_of::<u32>() as u64
    }
}

/// The splats of one band, and which of them touch which tile of a row.
#[derive(Debug, Default)]
pub(crate) struct Band {
    splats: Vec<Splat>,
    /// For every row of tiles, those that each splat touches, and some more at the end.
    columns: [Vec<Columns>; BAND_ROWS],
    row: TileRow,
}

impl Band {
    /// Prepares the splats of a band, in the memory of an earlier one.
    pub(crate) fn fill(
        &mut self,
        bands: &Bands,
        band: usize,
        gaussians: &[Gaussian],
        view: &View,
        cutoff: f32,
        backend: Backend,
    ) {
        let first = band * BAND_ROWS;
        let members = &bands.members[bands.starts[band]..bands.starts[band + 1]];
        self.splats.clear();
        self.splats.reserve_exact(members.len());
        for &index in members {
            let splat = Splat::new(&gaussians[index as usize], view);
            self.splats.push(splat.unwrap_or(Splat::NOWHERE));
        }
        let blocks = members.len().div_ceil(LANES);
        for columns in &mut self.columns {
            columns.clear();
            columns.reserve_exact(blocks);
            columns.resize(blocks, [[0; LANES]; 2]);
        }
        let rows = first..(first + BAND_ROWS).min(bands.grid.rows);
        bands.grid.columns_of(backend, &self.splats, cutoff, rows, |splat, row, columns| {
            self.columns[row - first][splat / LANES] = *columns;
        });
    }

    /// The splats of each tile of one of the band's rows, which has so many.
    pub(crate) fn row(&mut self, columns: usize, row: usize) -> (&TileRow, &[Splat]) {
        let blocks = self.columns[row].iter();
        let ends = blocks.flat_map(|[first, end]| first.iter().zip(end));
        let spans = (0..).zip(ends).map(|(splat, (&first, &end))| Span { splat, first, end });
        self.row.sort(columns, spans);
        (&self.row, &self.splats)
    }
}
