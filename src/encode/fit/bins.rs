//! Binning: which splats touch which rows and tiles. The bins are rebuilt while the splats move.

use fearless_simd::Level;

use crate::encode::error::Result;
use crate::encode::progress::Observer;
use crate::encode::sample_tile::TILE_WIDTH;
use crate::region::Region;
use crate::render::range_lists::RangeLists;
use crate::render::splat::Splat;
use crate::render::tile_grid::{Columns, TileGrid};
use crate::simd::LANES;

/// Splats that one task bins.
const CHUNK: usize = 256;

/// For every row of tiles of a picture, the splats that may touch it, in their order; and for every
/// splat, where these are.
#[derive(Debug)]
pub(crate) struct RowBins {
    grid: TileGrid<TILE_WIDTH>,
    /// `spans[starts[r]..starts[r + 1]]` are the spans of row r.
    starts: Vec<usize>,
    spans: Vec<TileSpan>,
    /// The spans of every row, sorted by tile.
    tile_rows: Vec<RangeLists>,
    /// `span_indices[span_ends[s - 1]..span_ends[s]]` are the indices in `spans` of splat s.
    span_indices: Vec<u32>,
    span_ends: Vec<u32>,
}

/// The spans of the splats of a task.
struct ChunkSpans {
    /// The row of every span: splat by splat, and row by row for each.
    rows: Vec<u32>,
    /// The end of each splat in `rows`.
    ends: Vec<u32>,
    /// The spans, sorted by row.
    sorted: Vec<TileSpan>,
    /// The first row with spans, and the end of each row from there on in `sorted`.
    first_row: usize,
    row_ends: Vec<u32>,
}

/// What a thread needs memory for while it bins chunks.
#[derive(Default)]
struct Scratch {
    /// Block by block, and for each row of tiles, the tiles that the splats of the block touch.
    found: Vec<(u32, Columns)>,
    /// The end of each block in `found`.
    blocks: Vec<usize>,
    /// Spans with their rows, splat by splat.
    spans: Vec<(u32, TileSpan)>,
}

impl ChunkSpans {
    /// Sorts what the grid found for a chunk.
    fn new(first_splat: u32, splats: usize, scratch: &mut Scratch) -> Self {
        let Scratch { found, blocks, spans } = scratch;
        // Every candidate is written, and stays if it is a span: a branch would often be mispredicted.
        let candidates = found.len() * LANES + 1;
        if spans.len() < candidates {
            spans.resize(candidates, (0, TileSpan::NONE));
        }
        let mut ends = Vec::with_capacity(splats);
        let (mut count, mut start) = (0, 0);
        for &end in &*blocks {
            for lane in 0..LANES.min(splats - ends.len()) {
                let splat = first_splat + ends.len() as u32;
                for (row, [firsts, ends]) in &found[start..end] {
                    let (first, end) = (firsts[lane], ends[lane]);
                    spans[count] = (*row, TileSpan { splat, first, end });
                    count += usize::from(first < end);
                }
                ends.push(count as u32);
            }
            start = end;
        }
        let spans = &spans[..count];

        let first_row = spans.iter().map(|&(row, _)| row).min().unwrap_or(0) as usize;
        let end_row = spans.iter().map(|&(row, _)| row + 1).max().unwrap_or(0) as usize;
        let mut row_ends = vec![0; end_row - first_row];
        for (row, _) in spans {
            row_ends[*row as usize - first_row] += 1;
        }
        // The counts become starts, which move to the ends while spans are written.
        let mut total = 0;
        for count in &mut row_ends {
            total += core::mem::replace(count, total);
        }
        let mut sorted = vec![TileSpan::NONE; spans.len()];
        for (row, span) in spans {
            let at = &mut row_ends[*row as usize - first_row];
            sorted[*at as usize] = *span;
            *at += 1;
        }
        let rows = spans.iter().map(|&(row, _)| row).collect();
        Self { rows, ends, sorted, first_row, row_ends }
    }

    /// The spans of a row.
    fn row(&self, row: usize) -> &[TileSpan] {
        let Some(row) = row.checked_sub(self.first_row).filter(|&row| row < self.row_ends.len())
        else {
            return &[];
        };
        let start = row.checked_sub(1).map_or(0, |before| self.row_ends[before]);
        &self.sorted[start as usize..self.row_ends[row] as usize]
    }
}

impl RowBins {
    /// Bins without splats.
    pub(crate) fn new(region: Region) -> Self {
        Self {
            grid: TileGrid::new(region),
            starts: Vec::new(),
            spans: Vec::new(),
            tile_rows: Vec::new(),
            span_indices: Vec::new(),
            span_ends: Vec::new(),
        }
    }

    /// Bins `splats` on all threads, in the memory of the previous bins.
    pub(crate) fn rebuild(
        &mut self,
        splats: &[Splat],
        cutoff: f32,
        observer: &mut Observer<'_>,
    ) -> Result<()> {
        let (grid, level) = (self.grid, Level::new());
        self.tile_rows = Vec::new();
        let chunks = splats.chunks(CHUNK).enumerate();
        let bin = |scratch: &mut Scratch, (chunk, splats): (usize, &[Splat])| {
            let Scratch { found, blocks, .. } = scratch;
            found.clear();
            blocks.clear();
            grid.columns_of(level, splats, cutoff, 0..grid.rows, |first, row, columns| {
                // Blocks that touch no row are passed over.
                blocks.resize(first / LANES, found.len());
                found.push((row as u32, *columns));
            });
            blocks.resize(splats.len().div_ceil(LANES), found.len());
            ChunkSpans::new((chunk * CHUNK) as u32, splats.len(), scratch)
        };
        let chunks = observer.map_with(chunks, bin)?;
        let offsets = self.count_rows(&chunks);
        self.number_spans(splats.len(), &chunks, offsets, observer)?;
        self.sort_rows(&chunks, observer)
    }

    /// Sets the index of the first span of every row of tiles. Returns, for each chunk and for each row of
    /// tiles from `first_row` on, the index of the chunk's first span in that row.
    fn count_rows(&mut self, chunks: &[ChunkSpans]) -> Vec<Vec<u32>> {
        self.starts.clear();
        self.starts.resize(self.grid.rows + 1, 0);
        let mut offsets: Vec<Vec<u32>> = (chunks.iter())
            .map(|chunk| {
                let mut start = 0;
                let counts = &mut self.starts[chunk.first_row + 1..];
                let row = |(&end, count): (&u32, &mut usize)| {
                    let before = *count as u32;
                    *count += (end - core::mem::replace(&mut start, end)) as usize;
                    before
                };
                chunk.row_ends.iter().zip(counts).map(row).collect()
            })
            .collect();
        for row in 0..self.grid.rows {
            self.starts[row + 1] += self.starts[row];
        }
        for (offsets, chunk) in offsets.iter_mut().zip(chunks) {
            for (offset, &start) in offsets.iter_mut().zip(&self.starts[chunk.first_row..]) {
                *offset += start as u32;
            }
        }
        offsets
    }

    /// Sets the indices of the spans of every splat. `offsets` are those of [`Self::count_rows`].
    fn number_spans(
        &mut self,
        splats: usize,
        chunks: &[ChunkSpans],
        offsets: Vec<Vec<u32>>,
        observer: &mut Observer<'_>,
    ) -> Result<()> {
        let total = self.starts[self.grid.rows];
        reset(&mut self.span_indices, total, 0);
        reset(&mut self.span_ends, splats, 0);
        let (mut indices, mut ends) = (&mut self.span_indices[..], &mut self.span_ends[..]);
        let mut start = 0;
        let parts = chunks.iter().zip(offsets).map(|(chunk, offsets)| {
            let indices = indices.split_off_mut(..chunk.rows.len()).expect("all are counted");
            let ends = ends.split_off_mut(..chunk.ends.len()).expect("each has an end");
            let first = start;
            start += chunk.rows.len() as u32;
            (chunk, offsets, indices, ends, first)
        });
        observer.map(parts, |(chunk, mut offsets, indices, ends, first)| {
            for (index, row) in indices.iter_mut().zip(&chunk.rows) {
                let next = &mut offsets[*row as usize - chunk.first_row];
                *index = *next;
                *next += 1;
            }
            for (end, of_chunk) in ends.iter_mut().zip(&chunk.ends) {
                *end = first + of_chunk;
            }
        })?;
        Ok(())
    }

    /// Sorts the spans of all chunks by row, and those of each row by tile.
    fn sort_rows(&mut self, chunks: &[ChunkSpans], observer: &mut Observer<'_>) -> Result<()> {
        let (rows, columns) = (self.grid.rows, self.grid.columns);
        let total = self.starts[rows];
        reset(&mut self.spans, total, TileSpan::NONE);
        let (mut spans, starts) = (&mut self.spans[..], &self.starts);
        let parts = (0..rows).map(|row| {
            let count = starts[row + 1] - starts[row];
            (row, spans.split_off_mut(..count).expect("all are counted"))
        });
        self.tile_rows = observer.map(parts, |(row, spans)| {
            let mut rest = &mut *spans;
            for chunk in chunks {
                let found = chunk.row(row);
                rest.split_off_mut(..found.len()).expect("all are counted").copy_from_slice(found);
            }
            by_tile(columns, spans)
        })?;
        Ok(())
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

    /// The spans of every row, sorted by tile.
    pub(crate) fn tile_rows(&self) -> &[RangeLists] {
        &self.tile_rows
    }

    /// The indices of the spans of a splat among those of all rows, in the order of the rows.
    #[inline(always)]
    pub(crate) fn spans_of(&self, splat: usize) -> &[u32] {
        let start = splat.checked_sub(1).map_or(0, |before| self.span_ends[before]);
        &self.span_indices[start as usize..self.span_ends[splat] as usize]
    }

    /// The number of all spans.
    pub(crate) fn span_count(&self) -> usize {
        self.span_indices.len()
    }

    /// Frees most of the memory. There are no bins until they are rebuilt.
    pub(crate) fn free(&mut self) {
        self.tile_rows = Vec::new();
        self.span_indices = Vec::new();
        self.span_ends = Vec::new();
    }

    /// Size in bytes.
    pub(crate) fn memory(&self) -> usize {
        self.starts.capacity() * size_of::<usize>()
            + self.spans.capacity() * size_of::<TileSpan>()
            + self.tile_rows.iter().map(RangeLists::memory).sum::<usize>()
            + (self.span_ends.capacity() + self.span_indices.capacity()) * size_of::<u32>()
    }
}

/// Makes `items` so many copies of a value, without more memory than that.
pub(super) fn reset<T: Copy>(items: &mut Vec<T>, count: usize, value: T) {
    items.clear();
    items.reserve_exact(count);
    items.resize(count, value);
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

impl TileSpan {
    const NONE: Self = Self { splat: 0, first: 0, end: 0 };
}

/// For each tile of a row, the spans that contain it, by their indices in the row.
fn by_tile(columns: usize, row: &[TileSpan]) -> RangeLists {
    let mut changes = vec![0_usize; columns + 1];
    for &TileSpan { first, end, .. } in row {
        changes[end as usize] = changes[end as usize].wrapping_sub(1);
        changes[first as usize] = changes[first as usize].wrapping_add(1);
    }
    RangeLists::new(changes, 0, row.iter().map(|span| span.first..span.end))
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::encode::progress::unobserved;
    use crate::kernel::QUARTIC_CUTOFF;

    #[test]
    fn rows_and_splats_have_all_spans_in_order() {
        let mut rng = fastrand::Rng::with_seed(8);
        // Several chunks, and splats that touch nothing, in between and at the end.
        let count = 2 * CHUNK + 37;
        let splats: Vec<Splat> = (0..count)
            .map(|index| {
                if index % 50 >= 46 || index + 3 > count {
                    return Splat::NOWHERE;
                }
                let [i11, i22] = [(); 2].map(|()| 0.05 + 0.5 * rng.f32());
                let (x, y) = (340.0 * rng.f32() - 20.0, 240.0 * rng.f32() - 20.0);
                Splat { x, y, i11, w: 0.2 * rng.f32() - 0.1, i22, color: [1.0; 4] }
            })
            .collect();
        let region = Region { x: 0, y: 0, width: 300, height: 200 };
        let mut bins = RowBins::new(region);
        unobserved(|observer| bins.rebuild(&splats, QUARTIC_CUTOFF, observer));
        let grid = TileGrid::<TILE_WIDTH>::new(region);
        let mut expected = Vec::new();
        for (index, splat) in splats.iter().enumerate() {
            let of_splat = core::slice::from_ref(splat);
            grid.columns_of(Level::new(), of_splat, QUARTIC_CUTOFF, 0..grid.rows, |_, row, at| {
                if at[0][0] < at[1][0] {
                    expected.push((index as u32, row, at[0][0], at[1][0]));
                }
            });
        }
        assert!(expected.len() > count && bins.span_count() == expected.len());

        let row_of = |span: usize| bins.starts.partition_point(|&start| start <= span) - 1;
        let by_splat = (0..count).flat_map(|splat| bins.spans_of(splat)).map(|&index| {
            let TileSpan { splat, first, end } = bins.spans[index as usize];
            (splat, row_of(index as usize), first, end)
        });
        assert!(by_splat.eq(expected.iter().copied()));
        for (row, tiles) in bins.tile_rows().iter().enumerate() {
            let spans = bins.spans(row);
            assert!(spans.is_sorted_by_key(|span| span.splat));
            for column in 0..bins.columns() {
                let with_tile = |span: &TileSpan| (span.first..span.end).contains(&(column as u32));
                let with_tile = (0..).zip(spans).filter(|(_, span)| with_tile(span));
                assert!(with_tile.map(|(index, _)| index).eq(tiles.of(column).iter().copied()));
            }
        }
    }
}
