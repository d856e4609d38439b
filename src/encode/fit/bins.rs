//! Binning: which splats touch which rows and tiles. The bins are rebuilt while the splats move.

use fearless_simd::Level;

use crate::encode::error::EncodeError;
use crate::encode::progress::Observer;
use crate::encode::raster::TILE_WIDTH;
use crate::region::Region;
use crate::render::splat::Splat;
use crate::render::tile_grid::TileGrid;

/// Splats that one task bins.
const CHUNK: usize = 256;
/// Work to bin a splat.
const WORK: f64 = 100.0;

/// For every row of tiles of a picture, the splats that may touch it, in their order.
#[derive(Debug)]
pub(crate) struct RowBins {
    grid: TileGrid<TILE_WIDTH>,
    /// `spans[starts[r]..starts[r + 1]]` are the spans of row r.
    starts: Vec<usize>,
    spans: Vec<TileSpan>,
}

/// A span with its row of tiles, before the spans are sorted by row.
#[derive(Clone, Copy, Debug)]
struct UnsortedSpan {
    row: u32,
    span: TileSpan,
}

impl RowBins {
    /// Bins without splats.
    pub(crate) fn new(region: Region) -> Self {
        Self { grid: TileGrid::new(region), starts: Vec::new(), spans: Vec::new() }
    }

    /// Bins `splats` on all threads, in the memory of the previous bins. For every span, splat by
    /// splat, `on_span` gets the splat and the index of the span among those of all rows.
    ///
    /// # Errors
    /// [`EncodeError::Cancelled`] when the caller cancels.
    pub(crate) fn rebuild(
        &mut self,
        splats: &[Splat],
        cutoff: f32,
        observer: &mut Observer<'_>,
        on_span: impl FnMut(u32, usize),
    ) -> Result<(), EncodeError> {
        let grid = self.grid;
        let chunks = splats.chunks(CHUNK).enumerate();
        let chunks = observer.map(WORK * CHUNK as f64, chunks, |(chunk, splats)| {
            let mut spans = Vec::new();
            let (level, rows) = (Level::new(), 0..grid.rows);
            grid.columns_of(level, splats, cutoff, rows, |block, row, [first, end]| {
                let first_splat = (chunk * CHUNK + block) as u32;
                for (splat, (&first, &end)) in (first_splat..).zip(first.iter().zip(end)) {
                    if first < end {
                        let span = TileSpan { splat, first, end };
                        spans.push(UnsortedSpan { row: row as u32, span });
                    }
                }
            });
            // The grid visits a block of splats row by row.
            spans.sort_by_key(|unsorted| unsorted.span.splat);
            spans
        })?;
        observer.poll()?;
        self.sort_by_row(&chunks, on_span);
        Ok(())
    }

    /// Counting sort of the spans by row.
    fn sort_by_row(&mut self, chunks: &[Vec<UnsortedSpan>], mut on_span: impl FnMut(u32, usize)) {
        self.starts.clear();
        self.starts.resize(self.grid.rows + 1, 0);
        for unsorted in chunks.iter().flatten() {
            self.starts[unsorted.row as usize] += 1;
        }
        let mut total = 0;
        for start in &mut self.starts {
            let count = *start;
            *start = total;
            total += count;
        }
        self.spans.clear();
        self.spans.reserve_exact(total);
        self.spans.resize(total, TileSpan { splat: 0, first: 0, end: 0 });
        // While spans are written, `starts[r]` moves from the start of its row to the start of the
        // next row. The rotation below moves each back to its own place.
        for unsorted in chunks.iter().flatten() {
            let start = &mut self.starts[unsorted.row as usize];
            self.spans[*start] = unsorted.span;
            on_span(unsorted.span.splat, *start);
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

    /// The spans of a row of tiles, in the order of the splats.
    pub(crate) fn spans(&self, row: usize) -> &[TileSpan] {
        &self.spans[self.starts[row]..self.starts[row + 1]]
    }

    /// For each tile of a row, the spans that contain it, by their indices in the row.
    pub(crate) fn row(&self, row: usize) -> TileRow {
        let mut sorted = TileRow::default();
        let spans = (0..).zip(self.spans(row));
        sorted.sort(self.grid.columns, spans.map(|(splat, span)| TileSpan { splat, ..*span }));
        sorted
    }

    /// The splat of every span of a row, out of the `splats` that were binned.
    pub(crate) fn splats(&self, row: usize, splats: &[Splat]) -> Vec<Splat> {
        self.spans(row).iter().map(|span| splats[span.splat as usize]).collect()
    }

    /// Size in bytes.
    pub(crate) fn memory(&self) -> usize {
        self.starts.capacity() * size_of::<usize>() + self.spans.capacity() * size_of::<TileSpan>()
    }
}

/// The tiles of a row that a splat may touch.
#[derive(Clone, Copy, Debug)]
pub(crate) struct TileSpan {
    /// Index of the splat.
    pub(crate) splat: u32,
    /// Columns of the first tile, and of the one after the last.
    pub(crate) first: u32,
    pub(crate) end: u32,
}

/// For each tile of a row, the splats that may touch it.
#[derive(Debug, Default)]
pub(crate) struct TileRow {
    /// `splats[starts[t]..starts[t + 1]]` touch tile t.
    starts: Vec<usize>,
    splats: Vec<u32>,
}

impl TileRow {
    /// Sorts the splats of `spans` by tile, in the memory of the previous row.
    pub(crate) fn sort(&mut self, columns: usize, spans: impl Iterator<Item = TileSpan> + Clone) {
        // First, `starts[t]` is the number of splats in tile t minus that in the tile before; its
        // prefix sum is the number in tile t, and the prefix sum of those is the start.
        let starts = &mut self.starts;
        starts.clear();
        starts.resize(columns + 1, 0);
        for TileSpan { first, end, .. } in spans.clone() {
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
        // While splats are written, `starts[t]` moves from the start of its tile to the start of
        // the next tile. The rotation below moves each back to its own place.
        for TileSpan { splat, first, end } in spans {
            for start in &mut starts[first as usize..end as usize] {
                self.splats[*start] = splat;
                *start += 1;
            }
        }
        starts.rotate_right(1);
        starts[0] = 0;
    }

    /// Number of pairs of a tile and a splat.
    pub(crate) fn entries(&self) -> usize {
        self.splats.len()
    }

    /// The splats of a tile, in order.
    pub(crate) fn splats(&self, column: usize) -> &[u32] {
        &self.splats[self.starts[column]..self.starts[column + 1]]
    }

    /// Size in bytes.
    pub(crate) fn memory(&self) -> usize {
        self.starts.capacity() * size_of::<usize>() + self.splats.capacity() * size_of::<u32>()
    }
}
