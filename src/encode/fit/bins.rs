//! Which splats touch which row of tiles, rebuilt again and again while they move.

use fearless_simd::Level;
use rayon::prelude::*;

use crate::encode::raster::TILE_WIDTH;
use crate::region::Region;
use crate::render::splat::Splat;
use crate::render::tile_grid::TileGrid;

/// Splats that one thread bins in one go.
const PIECE: usize = 256;

/// For every row of tiles of a picture, the splats that may touch it, in order.
#[derive(Debug)]
pub(crate) struct RowBins {
    grid: TileGrid<TILE_WIDTH>,
    /// `spans[starts[r]..starts[r + 1]]` are the spans of row r.
    starts: Vec<usize>,
    spans: Vec<Span>,
}

/// A span before it is sorted by row.
#[derive(Clone, Copy, Debug)]
struct Placed {
    row: u32,
    span: Span,
}

impl RowBins {
    /// Without splats.
    pub(crate) fn new(region: Region) -> Self {
        Self { grid: TileGrid::new(region), starts: Vec::new(), spans: Vec::new() }
    }

    /// Bins `splats` on all threads, in the memory of an earlier time. `note` is told, splat by
    /// splat, where each span of its splat stands among the spans of all rows.
    pub(crate) fn rebuild(&mut self, splats: &[Splat], cutoff: f32, note: impl FnMut(u32, usize)) {
        let grid = self.grid;
        let pieces: Vec<Vec<Placed>> = splats
            .par_chunks(PIECE)
            .enumerate()
            .map(|(piece, splats)| {
                let mut placed = Vec::new();
                let (level, rows) = (Level::new(), 0..grid.rows);
                grid.columns_of(level, splats, cutoff, rows, |block, row, [first, end]| {
                    let first_splat = (piece * PIECE + block) as u32;
                    for (splat, (&first, &end)) in (first_splat..).zip(first.iter().zip(end)) {
                        if first < end {
                            placed
                                .push(Placed { row: row as u32, span: Span { splat, first, end } });
                        }
                    }
                });
                // Row by row of a block until now.
                placed.sort_by_key(|placed| placed.span.splat);
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
        self.spans.resize(total, Span { splat: 0, first: 0, end: 0 });
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

    /// The spans of a row of tiles, in order.
    pub(crate) fn spans(&self, row: usize) -> &[Span] {
        &self.spans[self.starts[row]..self.starts[row + 1]]
    }

    /// The spans of each tile of a row, by their places in the row.
    pub(crate) fn row(&self, row: usize) -> TileRow {
        let mut sorted = TileRow::default();
        let spans = (0..).zip(self.spans(row));
        sorted.sort(self.grid.columns, spans.map(|(splat, span)| Span { splat, ..*span }));
        sorted
    }

    /// The splat of every span of a row; `splats` are those that were binned.
    pub(crate) fn splats(&self, row: usize, splats: &[Splat]) -> Vec<Splat> {
        self.spans(row).iter().map(|span| splats[span.splat as usize]).collect()
    }

    /// Bytes held.
    pub(crate) fn memory(&self) -> usize {
        self.starts.capacity() * size_of::<usize>() + self.spans.capacity() * size_of::<Span>()
    }
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
    pub(crate) fn entries(&self) -> usize {
        self.splats.len()
    }

    /// What touches a tile, in order.
    pub(crate) fn splats(&self, column: usize) -> &[u32] {
        &self.splats[self.starts[column]..self.starts[column + 1]]
    }

    /// Bytes held.
    pub(crate) fn memory(&self) -> usize {
        self.starts.capacity() * size_of::<usize>() + self.splats.capacity() * size_of::<u32>()
    }
}
