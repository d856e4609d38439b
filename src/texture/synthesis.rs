//! The texture of a row of cells: three octaves of noise, each multiplied by the gains of the map and added to
//! the coarser ones, which are enlarged by two (spec, section 9.7).

use core::ops::Range;

use super::arithmetic::{Arithmetic, ramp, step};
use super::map::{CELL, Gains, NodeMap, OCTAVES, PATTERNS};
use super::noise::{Lattice, Pattern};

/// Most cells that are made at a time. With two more at their left end and one more at the right, whose coarse
/// octaves reach into them, they have lattices of a constant length, over which the compiler vectorizes all
/// loops.
const CELLS: usize = NODES - 4;
/// Nodes of these cells in a row.
const NODES: usize = 16;
/// Rows of nodes that a row of cells depends on.
const NODE_ROWS: usize = 4;
/// Points of the finest lattice between so many nodes, and of the coarser ones.
const FULL: usize = NODES * CELL;
const HALF: usize = FULL / 2;
const QUARTER: usize = FULL / 4;

/// Sets the texture of cells in row `row`, which are given by their columns: [`CELL`] rows of `stride`
/// values, of which the first is that of the first cell. Returns whether any of them can be other than 0.
pub(crate) fn make_cells(
    map: &NodeMap,
    row: i32,
    cells: Range<i32>,
    out: &mut [f32],
    stride: usize,
    arithmetic: impl Arithmetic,
) -> bool {
    out.fill(0.0);
    let mut shows = false;
    map.cells_that_show(row, cells.clone(), CELLS, |part| {
        shows = true;
        let x = (part.start - cells.start) as usize * CELL;
        make_part(map, row, part, &mut out[x..], stride, arithmetic);
    });
    shows
}

/// That of at most [`CELLS`] cells. Each of its steps is vectorized as a function of its own, which bounds what a
/// compiler has to make of it.
fn make_part(
    map: &NodeMap,
    row: i32,
    cells: Range<i32>,
    out: &mut [f32],
    stride: usize,
    arithmetic: impl Arithmetic,
) {
    // It is even, so that the blocks of all lattices begin there.
    let first = (cells.start - 1) & !1;
    let mut gains = [[[[0.0; NODES]; PATTERNS]; OCTAVES]; NODE_ROWS];
    arithmetic.run(
        #[inline(always)]
        || {
            for (row, gains) in (row - 1..).zip(&mut gains) {
                map.gains(row, first, gains);
            }
        },
    );
    let shows = core::array::from_fn(|octave| gains.each_ref().map(|gains| shows(&gains[octave])));
    let part = Part { gains, shows, row, first };
    let mut full = [[0.0; FULL]; CELL];
    // Fine texture without any coarser one is frequent, and most of the work is the other octaves.
    if part.has(1) || part.has(2) {
        let mut half = [[0.0; HALF]; 6];
        if part.has(2) {
            let mut quarter = [[0.0; QUARTER]; 4];
            part.add_enlarged::<2, _, _>(
                [2 * row - 1, 4 * row - 1],
                &mut quarter,
                &mut half,
                arithmetic,
            );
        }
        part.add_enlarged::<4, _, _>([4 * row - 1, 8 * row], &mut half, &mut full, arithmetic);
    }
    arithmetic.run(
        #[inline(always)]
        || {
            part.add_octave(
                8 * row,
                &mut full,
                #[inline(always)]
                |left, change| arithmetic.ramp(left, change),
            );
        },
    );
    let (x, width) = ((cells.start - first) as usize * CELL, cells.len() * CELL);
    for (line, full) in out.chunks_mut(stride).zip(&full) {
        line[..width].copy_from_slice(&full[x..x + width]);
    }
}

/// The rows of a lattice that row `index` of the lattice enlarged by two is made of: the nearest one, and the one
/// on its other side.
fn around(index: usize) -> [usize; 2] {
    let near = index / 2;
    [near, if index.is_multiple_of(2) { near - 1 } else { near + 1 }]
}

/// Cells in a row, and the gains of their nodes.
struct Part {
    /// Row by row of nodes, from the row above the cells on.
    gains: [[Gains<NODES>; OCTAVES]; NODE_ROWS],
    /// Whether a pattern of an octave has a gain in a row of nodes.
    shows: [[[bool; PATTERNS]; NODE_ROWS]; OCTAVES],
    row: i32,
    /// The first column of cells, and of nodes.
    first: i32,
}

/// Whether each pattern has a gain other than 0.
#[inline(always)]
fn shows(gains: &Gains<NODES>) -> [bool; PATTERNS] {
    // As none is negative, a gain of 0 has no bit set.
    gains.each_ref().map(|gains| gains.iter().fold(0, |bits, gain| bits | gain.to_bits()) != 0)
}

impl Part {
    /// Whether there is any texture of an octave.
    fn has(&self, octave: usize) -> bool {
        self.shows[octave].iter().flatten().any(|&shows| shows)
    }

    /// Adds the patterns of an octave to rows of its lattice, and enlarges these to rows of the next finer one. The
    /// first rows of both are given; the rest is as for [`Part::add_octave`].
    fn add_enlarged<const POINTS: usize, const WIDTH: usize, const TWICE: usize>(
        &self,
        [row, finer_row]: [i32; 2],
        lines: &mut [[f32; WIDTH]],
        finer: &mut [[f32; TWICE]],
        arithmetic: impl Arithmetic,
    ) {
        arithmetic.run(
            #[inline(always)]
            || {
                self.add_octave(row, lines, ramp::<POINTS>);
                // Rows before the first ones are not needed.
                let skipped = (finer_row - 2 * row) as usize;
                for (index, line) in finer.iter_mut().enumerate() {
                    let [near, far] = around(skipped + index);
                    arithmetic.enlarge(&lines[near], &lines[far], line);
                }
            },
        );
    }

    /// Adds the patterns of an octave to rows of its lattice, from row `row` on. `POINTS` are those of a cell
    /// along each axis; `ramp` has the values at these points, from the one at the node before them and its
    /// change up to the next node.
    #[inline(always)]
    fn add_octave<const POINTS: usize, const WIDTH: usize>(
        &self,
        row: i32,
        lines: &mut [[f32; WIDTH]],
        ramp: impl Fn(f32, f32) -> [f32; POINTS],
    ) {
        let (octave, points) = ((CELL / POINTS).ilog2() as usize, POINTS as i32);
        // The row of nodes above a row of points.
        let above = |row: i32| (row.div_euclid(points) - (self.row - 1)) as usize;
        let rows = above(row)..above(row + lines.len() as i32 - 1) + 2;
        for kind in 0..PATTERNS {
            if !self.shows[octave][rows.clone()].iter().any(|shows| shows[kind]) {
                continue;
            }
            let gains = &self.gains[rows.clone()];
            // The gains at the points between the nodes of each row.
            let mut between = [[0.0; WIDTH]; NODE_ROWS];
            for (gains, between) in gains.iter().zip(&mut between[rows.clone()]) {
                let gains = &gains[octave][kind];
                for (pair, cell) in gains.windows(2).zip(between.as_chunks_mut().0) {
                    *cell = ramp(pair[0], pair[1] - pair[0]);
                }
            }
            let mut lattice = Lattice::<WIDTH>::new(Pattern { kind, octave }, self.first * points);
            let mut noise = [0.0; WIDTH];
            for (row, line) in (row..).zip(&mut *lines) {
                lattice.row(row, &mut noise);
                let down = step::<POINTS>(row.rem_euclid(points) as usize);
                let [above, below] = [above(row), above(row) + 1].map(|row| &between[row]);
                for at in 0..WIDTH {
                    line[at] += (above[at] + (below[at] - above[at]) * down) * noise[at];
                }
            }
        }
    }
}
