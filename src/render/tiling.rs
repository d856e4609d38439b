//! Which tiles a splat touches. A superset is harmless: the cut-off is tested per pixel.

use alloc::vec::Vec;
use core::ops::Range;

use super::footprint::{Footprints, LANES, larger, smaller};
use super::splat::Splat;
use super::tile::{Backend, TILE_HEIGHT, TILE_WIDTH};
use super::view::Region;

/// The tiles of a region.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Grid {
    region: Region,
    pub(crate) columns: usize,
    pub(crate) rows: usize,
}

/// Of several splats, the first tile of a row that each touches, and the one after the last: the
/// same where it touches none.
pub(crate) type Columns = [[u32; LANES]; 2];

impl Grid {
    pub(crate) fn new(region: Region) -> Self {
        Self {
            region,
            columns: (region.width as usize).div_ceil(TILE_WIDTH),
            rows: (region.height as usize).div_ceil(TILE_HEIGHT),
        }
    }

    /// Tells which tiles splats touch in some rows of tiles, if any: block by block of splats, the
    /// first of the block, and row by row.
    pub(crate) fn columns_of(
        &self,
        backend: Backend,
        splats: &[Splat],
        cutoff: f32,
        rows: Range<usize>,
        tell: impl FnMut(usize, usize, &Columns),
    ) {
        backend.run(
            #[inline(always)]
            || self.columns_with(splats, cutoff, rows, tell),
        );
    }

    #[inline(always)]
    fn columns_with(
        &self,
        splats: &[Splat],
        cutoff: f32,
        rows: Range<usize>,
        mut tell: impl FnMut(usize, usize, &Columns),
    ) {
        let Region { x, y, width, height } = self.region;
        for (block, splats) in splats.chunks(LANES).enumerate() {
            let footprints = match splats.first_chunk() {
                Some(splats) => Footprints::new(splats, cutoff),
                None => {
                    let mut filled = [Splat::NOWHERE; LANES];
                    filled[..splats.len()].copy_from_slice(splats);
                    Footprints::new(&filled, cutoff)
                }
            };
            let [first_row, end_row] = tiles(footprints.rows(), y, height, TILE_HEIGHT);
            let lowest = first_row.into_iter().fold(i32::MAX, i32::min) as usize;
            let highest = end_row.into_iter().fold(0, i32::max) as usize;
            for row in rows.start.max(lowest)..rows.end.min(highest) {
                let top = y as f32 + (row * TILE_HEIGHT) as f32 + 0.5;
                let ends = footprints.columns(top, top + (TILE_HEIGHT - 1) as f32);
                let [first, end] = tiles(ends, x, width, TILE_WIDTH);
                let mut columns = [[0; LANES]; 2];
                for lane in 0..LANES {
                    let touched = first_row[lane] <= row as i32 && (row as i32) < end_row[lane];
                    let end = if touched { end[lane] } else { 0 };
                    columns[0][lane] = first[lane].min(end) as u32;
                    columns[1][lane] = end as u32;
                }
                tell(block * LANES, row, &columns);
            }
        }
    }

    /// Tells of each splat, in order, which rows of tiles it touches, and at least how many tiles
    /// in any of them.
    pub(super) fn extents(
        &self,
        backend: Backend,
        splats: &[Splat; LANES],
        cutoff: f32,
    ) -> [Extent; LANES] {
        backend.run(
            #[inline(always)]
            || self.extents_with(splats, cutoff),
        )
    }

    #[inline(always)]
    fn extents_with(&self, splats: &[Splat; LANES], cutoff: f32) -> [Extent; LANES] {
        let footprints = Footprints::new(splats, cutoff);
        let [first, end] = tiles(footprints.rows(), self.region.y, self.region.height, TILE_HEIGHT);
        let widths = footprints.widest(TILE_HEIGHT as f32);
        let mut extents = [Extent::default(); LANES];
        for (lane, extent) in extents.iter_mut().enumerate() {
            // Casts saturate; both ends may lie within a tile.
            let columns = (widths[lane] * (1.0 / TILE_WIDTH as f32)) as u32;
            let columns = columns.saturating_add(2).min(self.columns as u32);
            let (first, end) = (first[lane] as u32, end[lane] as u32);
            *extent = Extent { first: first.min(end), end, columns };
        }
        extents
    }
}

/// What a splat touches.
#[derive(Clone, Copy, Debug, Default)]
pub(super) struct Extent {
    /// The first row of tiles, and the one after the last.
    pub(super) first: u32,
    pub(super) end: u32,
    /// At most so many tiles in any row.
    pub(super) columns: u32,
}

/// Tiles of a row that something touches.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Span {
    pub(crate) splat: u32,
    /// The first tile, and the one after the last.
    pub(crate) first: u32,
    pub(crate) end: u32,
}

/// One row of tiles: which splats touch each.
#[derive(Debug, Default)]
pub(crate) struct TileRow {
    /// `splats[starts[t]..starts[t + 1]]` are those that touch tile t.
    starts: Vec<usize>,
    splats: Vec<u32>,
}

impl TileRow {
    /// Sorts splats by tile, in the memory of an earlier row: for each what stands for it, and
    /// which of so many tiles it touches.
    pub(crate) fn sort(&mut self, columns: usize, spans: impl Iterator<Item = Span> + Clone) {
        // First how many more touch a tile than the one before it, then how many touch those
        // before it.
        let starts = &mut self.starts;
        starts.clear();
        starts.resize(columns + 1, 0);
        for Span { first, end, .. } in spans.clone() {
            starts[end as usize] = starts[end as usize].wrapping_sub(1);
            starts[first as usize] = starts[first as usize].wrapping_add(1);
        }
        let (mut count, mut total) = (0_usize, 0);
        for start in &mut *starts {
            count = count.wrapping_add(*start);
            *start = total;
            total += count;
        }
        self.splats.clear();
        self.splats.reserve_exact(total);
        self.splats.resize(total, 0);
        // `starts[t]` runs through its tile's splats and ends where the next begins; shift it back
        // afterwards.
        for Span { splat, first, end } in spans {
            for start in &mut starts[first as usize..end as usize] {
                self.splats[*start] = splat;
                *start += 1;
            }
        }
        starts.rotate_right(1);
        starts[0] = 0;
    }

    /// Pairs of a tile and a splat.
    #[cfg(feature = "encode")]
    pub(crate) fn entries(&self) -> usize {
        self.splats.len()
    }

    /// What touches a tile, in order.
    pub(crate) fn splats(&self, column: usize) -> &[u32] {
        &self.splats[self.starts[column]..self.starts[column + 1]]
    }

    /// Bytes held.
    #[cfg(feature = "encode")]
    pub(crate) fn memory(&self) -> usize {
        self.starts.capacity() * size_of::<usize>() + self.splats.capacity() * size_of::<u32>()
    }
}

/// The tiles whose pixel centres may lie between each of `low` and `high`, out of those that cover
/// `length` pixels from `origin` on: the first, and the one after the last. None if that is not
/// larger.
#[inline(always)]
fn tiles(
    [low, high]: [[f32; LANES]; 2],
    origin: u32,
    length: u32,
    size: usize,
) -> [[i32; LANES]; 2] {
    // Pixel i has its centre at i + 0.5.
    let shift = origin as f32 + 0.5;
    let (length, one) = (length as f32, size as f32);
    let mut ends = [[0; LANES]; 2];
    for lane in 0..LANES {
        // Casts round towards zero, so the first pixel is at most one too early. What lies beyond
        // either end begins after it ends.
        let first = smaller(larger(low[lane] - shift, 0.0), length + one) as i32;
        let last = smaller(larger(high[lane] - shift, -one), length - 1.0) as i32;
        ends[0][lane] = first / size as i32;
        ends[1][lane] = last.div_euclid(size as i32) + 1;
    }
    ends
}
