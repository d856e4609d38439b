//! Which splats touch which tile. A superset is harmless: the cut-off is tested per pixel.

use alloc::vec::Vec;

use super::splat::Splat;
use super::tile::{TILE_HEIGHT, TILE_PIXELS, TILE_WIDTH};
use super::view::Region;
use crate::error::{DecodeError, LimitKind};
use crate::limits::Limits;

/// For every tile of a region, the splats that may touch it, in file order.
#[derive(Debug, Default)]
pub(crate) struct Tiling {
    region: Option<Region>,
    columns: usize,
    rows: usize,
    /// `indices[starts[t]..starts[t + 1]]` are the splats of tile t.
    starts: Vec<usize>,
    indices: Vec<u32>,
    spans: Vec<Span>,
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
        let mut tiling = Self::default();
        tiling.rebuild(splats, cutoff, region, limits, held, |_, _| {})?;
        Ok(tiling)
    }

    /// [`Tiling::new`] in the memory of an earlier one. `note` is told, splat by splat, where each
    /// entry of its splat stands among the entries of all tiles.
    pub(crate) fn rebuild(
        &mut self,
        splats: &[Splat],
        cutoff: f32,
        region: Region,
        limits: &Limits,
        held: u64,
        mut note: impl FnMut(u32, usize),
    ) -> Result<(), DecodeError> {
        self.region = Some(region);
        self.columns = (region.width as usize).div_ceil(TILE_WIDTH);
        self.rows = (region.height as usize).div_ceil(TILE_HEIGHT);
        let tiles = self.columns as u64 * self.rows as u64;
        let held = held + (tiles + 1) * size_of::<usize>() as u64;
        limits.check_memory(held)?;
        // Spans number tiles in 32 bits.
        let allowed = u64::from(u32::MAX) * TILE_PIXELS as u64;
        if tiles > u64::from(u32::MAX) {
            let (kind, wanted) = (LimitKind::Pixels, region.pixels());
            return Err(DecodeError::Limit { kind, wanted, allowed });
        }
        let tiles = tiles as usize;
        self.starts.clear();
        self.starts.resize(tiles + 1, 0);
        self.spans.clear();
        let mut touched = 0_u64;
        for (index, splat) in splats.iter().enumerate() {
            // Every span counts as work, so that hostile shapes cannot keep this loop busy.
            self.reserve_spans(limits, held)?;
            touched += self.add_spans(index as u32, splat, cutoff, region);
            limits.check_work(touched * TILE_PIXELS as u64)?;
        }
        let mut total = 0;
        for start in &mut self.starts {
            let count = *start;
            *start = total;
            total += count;
        }
        let spans = self.spans.capacity() * size_of::<Span>();
        limits.check_memory(held + spans as u64 + total as u64 * size_of::<u32>() as u64)?;
        self.indices.clear();
        self.indices.resize(total, 0);
        // `starts[t]` runs through its tile's list and ends where the next begins; shift it back
        // afterwards.
        for span in &self.spans {
            for start in &mut self.starts[span.first as usize..][..span.count as usize] {
                self.indices[*start] = span.splat;
                note(span.splat, *start);
                *start += 1;
            }
        }
        self.starts.rotate_right(1);
        self.starts[0] = 0;
        Ok(())
    }

    /// Makes room for the spans of one more splat, one per row of tiles.
    fn reserve_spans(&mut self, limits: &Limits, held: u64) -> Result<(), DecodeError> {
        let (length, capacity) = (self.spans.len(), self.spans.capacity());
        if capacity - length < self.rows {
            let wanted = (2 * capacity).max(length + self.rows);
            // Old and new memory exist at the same time.
            let bytes = (capacity + wanted) as u64 * size_of::<Span>() as u64;
            limits.check_memory(held + bytes)?;
            self.spans.reserve_exact(wanted - length);
        }
        Ok(())
    }

    /// Notes the tiles that one splat touches; how many, at least one per row that it spans.
    fn add_spans(&mut self, index: u32, splat: &Splat, cutoff: f32, region: Region) -> u64 {
        let footprint = splat.footprint(cutoff);
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
            let first = row * self.columns + first;
            let count = last + row * self.columns + 1 - first;
            self.spans.push(Span { splat: index, first: first as u32, count: count as u32 });
            for start in &mut self.starts[first..][..count] {
                *start += 1;
            }
        }
        touched
    }

    /// The number of entries in a row of tiles.
    #[cfg(feature = "encode")]
    pub(crate) fn row_entries(&self, row: usize) -> usize {
        self.starts[(row + 1) * self.columns] - self.starts[row * self.columns]
    }

    pub(crate) fn columns(&self) -> usize {
        self.columns
    }

    pub(crate) fn rows(&self) -> usize {
        self.rows
    }

    /// The splats of a tile, in file order.
    pub(crate) fn splats(&self, column: usize, row: usize) -> &[u32] {
        let tile = row * self.columns + column;
        &self.indices[self.starts[tile]..self.starts[tile + 1]]
    }

    /// Bytes held.
    #[cfg(feature = "encode")]
    pub(crate) fn memory(&self) -> usize {
        self.starts.capacity() * size_of::<usize>()
            + self.indices.capacity() * size_of::<u32>()
            + self.spans.capacity() * size_of::<Span>()
    }
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
