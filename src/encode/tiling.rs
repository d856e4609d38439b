//! Which splats touch which row of tiles, rebuilt again and again while they move.

use rayon::prelude::*;

use crate::render::{Backend, Grid, Region, Span, Splat, TileRow};

/// Splats that one thread bins in one go.
const PIECE: usize = 256;

/// For every row of tiles of a picture, the splats that may touch it, in order.
#[derive(Debug)]
pub(crate) struct Tiling {
    grid: Grid,
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

impl Tiling {
    /// Without splats.
    pub(crate) fn new(region: Region) -> Self {
        Self { grid: Grid::new(region), starts: Vec::new(), spans: Vec::new() }
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
                let (backend, rows) = (Backend::fastest(), 0..grid.rows);
                grid.columns_of(backend, splats, cutoff, rows, |block, row, [first, end]| {
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
