//! Which splats touch which tile. A superset is harmless: the cut-off is tested per pixel.

use alloc::vec;
use alloc::vec::Vec;

use super::splat::Splat;
use super::tile::{TILE_HEIGHT, TILE_PIXELS, TILE_WIDTH};
use super::view::Region;
use crate::error::{DecodeError, LimitKind};
use crate::limits::Limits;

/// For every tile of a region, the splats that may touch it, in file order.
#[derive(Debug, Default)]
pub(crate) struct Tiling {
    grid: Grid,
    /// `indices[starts[t]..starts[t + 1]]` are the splats of tile t.
    starts: Vec<usize>,
    indices: Vec<u32>,
    /// What each splat touches, splat by splat, in pieces that were made side by side.
    spans: Vec<Vec<Span>>,
}

/// The tiles of a region.
#[derive(Clone, Copy, Debug)]
struct Grid {
    region: Region,
    columns: usize,
    rows: usize,
}

/// The tiles of one row that one splat touches.
#[derive(Clone, Copy, Debug)]
struct Span {
    splat: u32,
    first: u32,
    count: u32,
}

impl Tiling {
    /// Bins `splats`; `held` is what the caller already holds, in bytes.
    pub(crate) fn new(
        splats: &[Splat],
        cutoff: f32,
        region: Region,
        limits: &Limits,
        held: u64,
    ) -> Result<Self, DecodeError> {
        let grid = Grid::new(region);
        let tiles = grid.columns as u64 * grid.rows as u64;
        let held = held + (tiles + 1) * size_of::<usize>() as u64;
        limits.check_memory(held)?;
        // Spans number tiles in 32 bits.
        let allowed = u64::from(u32::MAX) * TILE_PIXELS as u64;
        if tiles > u64::from(u32::MAX) {
            let (kind, wanted) = (LimitKind::Pixels, region.pixels());
            return Err(DecodeError::Limit { kind, wanted, allowed });
        }
        let mut spans = Vec::new();
        let mut touched = 0_u64;
        for (index, splat) in splats.iter().enumerate() {
            // Every span counts as work, so that hostile shapes cannot keep this loop busy.
            reserve(&mut spans, grid.rows, limits, held)?;
            touched += grid.add_spans(index as u32, splat, cutoff, &mut spans);
            limits.check_work(touched * TILE_PIXELS as u64)?;
        }
        let total = spans.iter().map(|span| u64::from(span.count)).sum::<u64>();
        let bytes = (spans.capacity() * size_of::<Span>()) as u64;
        limits.check_memory(held + bytes + total * size_of::<u32>() as u64)?;
        let mut tiling = Self { grid, spans: vec![spans], ..Self::default() };
        tiling.arrange(|_, _| {});
        Ok(tiling)
    }

    /// [`Tiling::new`] for what needs no limits, on all threads and in the memory of an earlier
    /// one. `note` is told, splat by splat, where each entry of its splat stands among the entries
    /// of all tiles.
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
        self.spans.resize_with(splats.len().div_ceil(PIECE), Vec::new);
        self.spans.par_iter_mut().zip(splats.par_chunks(PIECE)).enumerate().for_each(
            |(piece, (spans, splats))| {
                spans.clear();
                for (index, splat) in (piece * PIECE..).zip(splats) {
                    grid.add_spans(index as u32, splat, cutoff, spans);
                }
            },
        );
        self.arrange(note);
    }

    /// Sorts the spans' entries by tile.
    fn arrange(&mut self, mut note: impl FnMut(u32, usize)) {
        self.starts.clear();
        self.starts.resize(self.grid.columns * self.grid.rows + 1, 0);
        for span in self.spans.iter().flatten() {
            for count in &mut self.starts[span.first as usize..][..span.count as usize] {
                *count += 1;
            }
        }
        let mut total = 0;
        for start in &mut self.starts {
            let count = *start;
            *start = total;
            total += count;
        }
        self.indices.clear();
        self.indices.resize(total, 0);
        // `starts[t]` runs through its tile's list and ends where the next begins; shift it back
        // afterwards.
        for span in self.spans.iter().flatten() {
            for start in &mut self.starts[span.first as usize..][..span.count as usize] {
                self.indices[*start] = span.splat;
                note(span.splat, *start);
                *start += 1;
            }
        }
        self.starts.rotate_right(1);
        self.starts[0] = 0;
    }

    /// The number of entries in a row of tiles.
    #[cfg(feature = "encode")]
    pub(crate) fn row_entries(&self, row: usize) -> usize {
        self.starts[(row + 1) * self.grid.columns] - self.starts[row * self.grid.columns]
    }

    pub(crate) fn columns(&self) -> usize {
        self.grid.columns
    }

    pub(crate) fn rows(&self) -> usize {
        self.grid.rows
    }

    /// The splats of a tile, in file order.
    pub(crate) fn splats(&self, column: usize, row: usize) -> &[u32] {
        let tile = row * self.grid.columns + column;
        &self.indices[self.starts[tile]..self.starts[tile + 1]]
    }

    /// Bytes held.
    #[cfg(feature = "encode")]
    pub(crate) fn memory(&self) -> usize {
        self.starts.capacity() * size_of::<usize>()
            + self.indices.capacity() * size_of::<u32>()
            + self.spans.iter().map(Vec::capacity).sum::<usize>() * size_of::<Span>()
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
    fn add_spans(&self, index: u32, splat: &Splat, cutoff: f32, spans: &mut Vec<Span>) -> u64 {
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
            let (first, count) = (row * self.columns + first, last + 1 - first);
            spans.push(Span { splat: index, first: first as u32, count: count as u32 });
        }
        touched
    }
}

/// Makes room for the spans of one more splat, one per row of tiles.
fn reserve(
    spans: &mut Vec<Span>,
    rows: usize,
    limits: &Limits,
    held: u64,
) -> Result<(), DecodeError> {
    let (length, capacity) = (spans.len(), spans.capacity());
    if capacity - length < rows {
        let wanted = (2 * capacity).max(length + rows);
        // Old and new memory exist at the same time.
        let bytes = (capacity + wanted) as u64 * size_of::<Span>() as u64;
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
