//! Which splats touch which tile: first by row of tiles, then, where a row is rendered, by tile. A
//! superset is harmless: the cut-off is tested per pixel.

use alloc::vec;
use alloc::vec::Vec;

use super::splat::Splat;
use super::tile::{TILE_HEIGHT, TILE_PIXELS, TILE_WIDTH};
use super::view::Region;
use crate::error::DecodeError;
use crate::limits::Limits;

/// For every row of tiles of a region, the splats that may touch it, in file order.
#[derive(Debug, Default)]
pub(crate) struct Tiling {
    grid: Grid,
    /// `spans[starts[r]..starts[r + 1]]` are the spans of row r.
    starts: Vec<usize>,
    spans: Vec<Span>,
}

/// The tiles of a region.
#[derive(Clone, Copy, Debug)]
struct Grid {
    region: Region,
    columns: usize,
    rows: usize,
}

/// Consecutive tiles of one row that one splat touches.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Span {
    splat: u32,
    first: u32,
    count: u32,
}

/// A span before it is sorted by row.
#[derive(Clone, Copy, Debug)]
struct Placed {
    row: u32,
    span: Span,
}

impl Tiling {
    /// Bins `splats`; `held` is what the caller already holds, in bytes, and `threads` how many
    /// will render.
    pub(crate) fn new(
        splats: &[Splat],
        cutoff: f32,
        region: Region,
        limits: &Limits,
        held: u64,
        threads: usize,
    ) -> Result<Self, DecodeError> {
        let grid = Grid::new(region);
        let held = held + (grid.rows as u64 + 1) * size_of::<usize>() as u64;
        limits.check_memory(held)?;
        let mut placed = Vec::new();
        let mut touched = 0_u64;
        for (index, splat) in splats.iter().enumerate() {
            // Every span counts as work, so that hostile shapes cannot keep this loop busy.
            reserve(&mut placed, grid.rows, limits, held)?;
            touched += grid.add_spans(index as u32, splat, cutoff, &mut placed);
            limits.check_work(touched * TILE_PIXELS as u64)?;
        }
        let spans = (placed.len() * size_of::<Span>()) as u64;
        limits.check_memory(held + spans + (placed.capacity() * size_of::<Placed>()) as u64)?;
        let mut tiling = Self { grid, ..Self::default() };
        tiling.arrange(&[placed], |_, _| {});
        let most = (0..grid.rows).map(|row| tiling.row_memory(row)).max().unwrap_or(0);
        limits.check_memory(held + spans + most * threads.min(grid.rows) as u64)?;
        Ok(tiling)
    }

    /// [`Tiling::new`] for what needs no limits, on all threads and in the memory of an earlier
    /// one. `note` is told, splat by splat, where each span of its splat stands among the spans of
    /// all rows.
    #[cfg(feature = "encode")]
    pub(crate) fn rebuild(
        &mut self,
        splats: &[Splat],
        cutoff: f32,
        region: Region,
        note: impl FnMut(u32, usize),
    ) {
        use rayon::prelude::*;

        const PIECE: usize = 256;
        let grid = Grid::new(region);
        self.grid = grid;
        let pieces: Vec<Vec<Placed>> = splats
            .par_chunks(PIECE)
            .enumerate()
            .map(|(piece, splats)| {
                let mut placed = Vec::new();
                for (index, splat) in (piece * PIECE..).zip(splats) {
                    grid.add_spans(index as u32, splat, cutoff, &mut placed);
                }
                placed
            })
            .collect();
        self.arrange(&pieces, note);
    }

    /// Sorts spans by row.
    fn arrange(&mut self, pieces: &[Vec<Placed>], mut note: impl FnMut(u32, usize)) {
        self.starts.clear();
        self.starts.resize(self.grid.rows + 1, 0);
        for placed in pieces.iter().flatten() {
            self.starts[placed.row as usize] += 1;
        }
        let mut total = 0;
        for start in &mut self.starts {
            let count = *start;
            *start = total;
            total += count;
        }
        self.spans.clear();
        self.spans.reserve_exact(total);
        self.spans.resize(total, Span { splat: 0, first: 0, count: 0 });
        // `starts[r]` runs through its row's spans and ends where the next begins; shift it back
        // afterwards.
        for placed in pieces.iter().flatten() {
            let start = &mut self.starts[placed.row as usize];
            self.spans[*start] = placed.span;
            note(placed.span.splat, *start);
            *start += 1;
        }
        self.starts.rotate_right(1);
        self.starts[0] = 0;
    }

    pub(crate) fn columns(&self) -> usize {
        self.grid.columns
    }

    pub(crate) fn rows(&self) -> usize {
        self.grid.rows
    }

    /// The spans of a row of tiles, in file order.
    pub(crate) fn spans(&self, row: usize) -> &[Span] {
        &self.spans[self.starts[row]..self.starts[row + 1]]
    }

    /// The splat of every span of a row; `splats` are those that were binned.
    pub(crate) fn splats(&self, row: usize, splats: &[Splat]) -> Vec<Splat> {
        self.spans(row).iter().map(|span| splats[span.splat as usize]).collect()
    }

    /// Bytes that a [`TileRow`] and the splats of a row take.
    fn row_memory(&self, row: usize) -> u64 {
        let spans = self.spans(row);
        let entries = spans.iter().map(|span| u64::from(span.count)).sum::<u64>();
        ((self.grid.columns + 1) * size_of::<usize>()) as u64
            + (spans.len() * size_of::<Splat>()) as u64
            + entries * size_of::<u32>() as u64
    }

    /// Bytes held.
    #[cfg(feature = "encode")]
    pub(crate) fn memory(&self) -> usize {
        self.starts.capacity() * size_of::<usize>() + self.spans.capacity() * size_of::<Span>()
    }
}

/// One row of tiles: which of its spans touch each.
#[derive(Debug)]
pub(crate) struct TileRow {
    /// `indices[starts[t]..starts[t + 1]]` are the spans that touch tile t.
    starts: Vec<usize>,
    indices: Vec<u32>,
}

impl TileRow {
    /// Sorts a row of `tiling` by tile.
    pub(crate) fn new(tiling: &Tiling, row: usize) -> Self {
        let spans = tiling.spans(row);
        // First how many more touch a tile than the one before it, then how many touch those
        // before it.
        let mut starts = vec![0_usize; tiling.columns() + 1];
        for span in spans {
            let last = &mut starts[(span.first + span.count) as usize];
            *last = last.wrapping_sub(1);
            starts[span.first as usize] = starts[span.first as usize].wrapping_add(1);
        }
        let (mut count, mut total) = (0_usize, 0);
        for start in &mut starts {
            count = count.wrapping_add(*start);
            *start = total;
            total += count;
        }
        let mut indices = vec![0; total];
        // As in `Tiling::arrange`.
        for (index, span) in (0..).zip(spans) {
            for start in &mut starts[span.first as usize..][..span.count as usize] {
                indices[*start] = index;
                *start += 1;
            }
        }
        starts.rotate_right(1);
        starts[0] = 0;
        Self { starts, indices }
    }

    /// Pairs of a tile and a span.
    #[cfg(feature = "encode")]
    pub(crate) fn entries(&self) -> usize {
        self.indices.len()
    }

    /// The spans that touch a tile, in file order.
    pub(crate) fn spans(&self, column: usize) -> &[u32] {
        &self.indices[self.starts[column]..self.starts[column + 1]]
    }

    /// Bytes held.
    #[cfg(feature = "encode")]
    pub(crate) fn memory(&self) -> usize {
        self.starts.capacity() * size_of::<usize>() + self.indices.capacity() * size_of::<u32>()
    }
}

impl Default for Grid {
    fn default() -> Self {
        Self::new(Region { x: 0, y: 0, width: 0, height: 0 })
    }
}

impl Grid {
    fn new(region: Region) -> Self {
        Self {
            region,
            columns: (region.width as usize).div_ceil(TILE_WIDTH),
            rows: (region.height as usize).div_ceil(TILE_HEIGHT),
        }
    }

    /// Notes the tiles that one splat touches; how many, at least one per row that it spans.
    fn add_spans(&self, index: u32, splat: &Splat, cutoff: f32, spans: &mut Vec<Placed>) -> u64 {
        let (region, footprint) = (self.region, splat.footprint(cutoff));
        let (top, bottom) = footprint.rows();
        let Some((first_row, last_row)) = tiles(top, bottom, region.y, region.height, TILE_HEIGHT)
        else {
            return 0;
        };
        let mut touched = 0;
        for row in first_row..=last_row {
            let y = region.y as f32 + (row * TILE_HEIGHT) as f32;
            let (left, right) = footprint.columns(y + 0.5, y + TILE_HEIGHT as f32 - 0.5);
            touched += 1;
            let Some((first, last)) = tiles(left, right, region.x, region.width, TILE_WIDTH) else {
                continue;
            };
            touched += (last - first) as u64;
            let count = (last + 1 - first) as u32;
            let span = Span { splat: index, first: first as u32, count };
            spans.push(Placed { row: row as u32, span });
        }
        touched
    }
}

/// Makes room for the spans of one more splat, one per row of tiles.
fn reserve(
    spans: &mut Vec<Placed>,
    rows: usize,
    limits: &Limits,
    held: u64,
) -> Result<(), DecodeError> {
    let (length, capacity) = (spans.len(), spans.capacity());
    if capacity - length < rows {
        let wanted = (2 * capacity).max(length + rows);
        // Old and new memory exist at the same time.
        let bytes = (capacity + wanted) as u64 * size_of::<Placed>() as u64;
        limits.check_memory(held + bytes)?;
        spans.reserve_exact(wanted - length);
    }
    Ok(())
}

/// The first and the last tile whose pixel centres may lie in [low, high], out of those that
/// cover `length` pixels from `origin` on.
fn tiles(low: f32, high: f32, origin: u32, length: u32, size: usize) -> Option<(usize, usize)> {
    // Pixel i has its centre at i + 0.5. Casts saturate and round towards zero, so far-away splats
    // clamp and the first pixel is at most one too early.
    let last = high - 0.5 - origin as f32;
    let first = (low - 0.5 - origin as f32).max(0.0) as usize;
    if last.is_nan() || last < 0.0 || first >= length as usize {
        return None;
    }
    let last = (last as usize).min(length as usize - 1);
    (first <= last).then(|| (first / size, last / size))
}
