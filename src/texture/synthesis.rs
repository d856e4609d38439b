//! The texture of a row of cells: three octaves of noise, each multiplied by the gains of the map and added to
//! the coarser ones, which are enlarged by two (spec, section 9.7).

use core::ops::Range;

use super::map::{CELL, Gains, NodeMap, OCTAVES, PATTERNS};
use super::noise::{Lattice, Pattern};

/// Most cells that are worked on at a time: what they need then stays in the fastest memory.
const CELLS: usize = 32;
/// Nodes that these cells depend on in a row, with one cell more at each end, as coarse octaves reach into
/// the neighbours.
const NODES: usize = CELLS + 3;
/// Rows of nodes that a row of cells depends on.
const NODE_ROWS: usize = 4;
/// Points in a row of these cells and of one more at each end, in the finest lattice and in the coarser ones.
const FULL: usize = (CELLS + 2) * CELL;
const HALF: usize = FULL / 2;
const QUARTER: usize = FULL / 4;
/// Points between those that a row of values begins with and its first cell, as the hashed blocks of a
/// lattice are four points wide.
const BEFORE: usize = 4;

/// Makes the texture of cells, in memory that is used again.
#[derive(Debug)]
pub(crate) struct Synthesis {
    /// Row by row of nodes, from the row above the cells on, and from the node left of them on.
    gains: [[Gains<NODES>; OCTAVES]; NODE_ROWS],
    quarter: [[f32; QUARTER]; 4],
    half: [[f32; HALF]; 6],
    full: [[f32; FULL]; CELL],
    octave: OctaveMemory,
}

/// What the patterns of an octave are made in.
#[derive(Debug)]
struct OctaveMemory {
    /// The gains of a pattern at the points between the nodes of each row.
    gains: [[f32; FULL]; NODE_ROWS],
    lattice: Lattice<{ FULL + BEFORE }>,
}

impl Default for Synthesis {
    fn default() -> Self {
        Self {
            gains: [[[[0.0; NODES]; PATTERNS]; OCTAVES]; NODE_ROWS],
            quarter: [[0.0; QUARTER]; 4],
            half: [[0.0; HALF]; 6],
            full: [[0.0; FULL]; CELL],
            octave: OctaveMemory { gains: [[0.0; FULL]; NODE_ROWS], lattice: Lattice::default() },
        }
    }
}

impl Synthesis {
    /// Sets the texture of cells in row `row`, which are given by their columns: [`CELL`] rows of `stride`
    /// values, of which the first is that of the first cell. Returns whether any of them can be other than 0.
    #[inline(always)]
    pub(crate) fn cells(
        &mut self,
        map: &NodeMap,
        row: i32,
        cells: Range<i32>,
        out: &mut [f32],
        stride: usize,
    ) -> bool {
        out.fill(0.0);
        let mut shows = false;
        map.cells_that_show(
            row,
            cells.clone(),
            CELLS,
            #[inline(always)]
            |part| {
                shows = true;
                let x = (part.start - cells.start) as usize * CELL;
                self.part(map, row, part, &mut out[x..], stride);
            },
        );
        shows
    }

    /// That of at most [`CELLS`] cells.
    #[inline(always)]
    fn part(&mut self, map: &NodeMap, row: i32, cells: Range<i32>, out: &mut [f32], stride: usize) {
        let Self { gains, quarter, half, full, octave: memory } = self;
        let nodes = cells.len() + 3;
        for (row, gains) in (row - 1..).zip(&mut *gains) {
            map.gains(row, cells.start - 1, nodes, gains);
        }
        let width = (cells.len() + 2) * CELL;
        let part = Part { gains, nodes, row, first: cells.start - 1 };
        for line in &mut *quarter {
            line[..width / 4].fill(0.0);
        }
        part.add_octave::<2, _>(2, 2 * row - 1, quarter, memory);
        for (index, line) in half.iter_mut().enumerate() {
            // The row above the cells is the lower half of a coarser row.
            enlarge(quarter, index + 1, width / 4, line);
        }
        part.add_octave::<4, _>(1, 4 * row - 1, half, memory);
        for (index, line) in full.iter_mut().enumerate() {
            enlarge(half, index + 2, width / 2, line);
        }
        part.add_octave::<CELL, _>(0, CELL as i32 * row, full, memory);
        for (line, full) in out.chunks_mut(stride).zip(full) {
            let values = &full[CELL..width - CELL];
            line[..values.len()].copy_from_slice(values);
        }
    }
}

/// Some cells in a row with one more at each end, and the gains of their nodes.
struct Part<'a> {
    gains: &'a [[Gains<NODES>; OCTAVES]; NODE_ROWS],
    nodes: usize,
    row: i32,
    first: i32,
}

impl Part<'_> {
    /// Adds the patterns of an octave to rows of its lattice, from row `row` on. `POINTS` are those of a cell
    /// along each axis.
    #[inline(always)]
    fn add_octave<const POINTS: usize, const WIDTH: usize>(
        &self,
        octave: usize,
        row: i32,
        lines: &mut [[f32; WIDTH]],
        memory: &mut OctaveMemory,
    ) {
        let steps: [f32; POINTS] = core::array::from_fn(|at| (at as f32 + 0.5) / POINTS as f32);
        let points = POINTS as i32;
        let width = (self.nodes - 1) * POINTS;
        let column = self.first * points;
        let before = (column & 3) as usize;
        let length = (before + width).next_multiple_of(4);
        // The row of nodes above a row of points.
        let above = |row: i32| (row.div_euclid(points) - (self.row - 1)) as usize;
        let rows = above(row)..above(row + lines.len() as i32 - 1) + 2;
        for kind in 0..PATTERNS {
            let gains = &self.gains[rows.clone()];
            // As none is negative, a gain of 0 has no bit set.
            let mut bits = 0;
            for gains in gains {
                for gain in gains[octave][kind] {
                    bits |= gain.to_bits();
                }
            }
            if bits == 0 {
                continue;
            }
            for (gains, row) in gains.iter().zip(&mut memory.gains[rows.clone()]) {
                let gains = &gains[octave][kind][..self.nodes];
                for (pair, cell) in gains.windows(2).zip(row[..width].as_chunks_mut().0) {
                    *cell = steps.map(|step| pair[0] + (pair[1] - pair[0]) * step);
                }
            }
            // What the compiler knows to be apart from the rest, it vectorizes best.
            let mut noise = [0.0; FULL + BEFORE];
            memory.lattice.begin(Pattern { kind, octave }, column - before as i32);
            for (row, line) in (row..).zip(&mut *lines) {
                memory.lattice.row(row, &mut noise[..length]);
                let down = steps[row.rem_euclid(points) as usize];
                let [above, below] = [above(row), above(row) + 1].map(|row| &memory.gains[row]);
                // With slices of one length, the compiler vectorizes the loop.
                let (line, noise) = (&mut line[..width], &noise[before..][..width]);
                let (above, below) = (&above[..width], &below[..width]);
                for at in 0..width {
                    line[at] += (above[at] + (below[at] - above[at]) * down) * noise[at];
                }
            }
        }
    }
}

/// Enlarges `width` columns of a lattice by two along both axes, and sets row `index` of the result: its values
/// are three quarters of the nearest point and one quarter of the next one, first along y, then along x. Row 0
/// would be the upper half of the first row of the lattice. The columns at both ends are not enlarged.
#[inline(always)]
fn enlarge<const WIDTH: usize>(
    lattice: &[[f32; WIDTH]],
    index: usize,
    width: usize,
    out: &mut [f32],
) {
    let near = &lattice[index / 2][..width];
    let next = if index.is_multiple_of(2) { index / 2 - 1 } else { index / 2 + 1 };
    let far = &lattice[next][..width];
    let mut mixed = [0.0; WIDTH];
    let mixed = &mut mixed[..width];
    for column in 0..width {
        mixed[column] = near[column] * 0.75 + far[column] * 0.25;
    }
    let out = &mut out.as_chunks_mut::<2>().0[1..width - 1];
    for (three, out) in mixed.windows(3).zip(out) {
        let near = three[1] * 0.75;
        *out = [near + three[0] * 0.25, near + three[2] * 0.25];
    }
}
