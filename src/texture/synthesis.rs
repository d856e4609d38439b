//! The texture of a row of cells: two octaves of noise, of which the coarser one is enlarged by two, with each
//! block of their lattices multiplied by the gains of the map (spec, section 9.7).
//!
//! Lattices are made in pairs of rows, which are rows of isotropic blocks.

use alloc::vec::Vec;
use core::ops::{Add, Range};

use super::arithmetic::Arithmetic;
use super::gains::NodeRows;
use super::map::{CELL, NodeMap, OCTAVES};
use super::noise::Pattern;

/// How far each of four points along streaks is on the way to the next block.
const ALONG: [f32; 4] = [0.125, 0.375, 0.625, 0.875];
/// Values that are marked together if any of them can be other than 0, and the most lanes that there are.
const CHUNK: usize = 16;
/// Pairs of rows of a lattice in a row of cells, and of the coarser one that this depends on.
const PAIRS: usize = CELL / 2;
const COARSE_PAIRS: usize = CELL / 4 + 2;

/// Makes the texture of rows of cells one after the other, and keeps what they have in common.
#[derive(Debug, Default)]
pub(crate) struct Synthesis {
    nodes: NodeRows,
    streaks: [Streaks; OCTAVES],
    /// Pairs of rows of the coarser lattice, each in the place that its number has by the remainder.
    coarse: [CoarsePair; COARSE_PAIRS],
    /// Such a pair before it is enlarged.
    narrow: Vec<f32>,
}

/// The latest rows of blocks with streaks of an octave.
#[derive(Debug, Default)]
struct Streaks {
    horizontal: BlockRow,
    /// Each in the place that its number has by the remainder.
    vertical: [BlockRow; 2],
}

/// The values of a row of blocks.
#[derive(Debug, Default)]
struct BlockRow {
    row: Option<i32>,
    /// Each block's four values one after the other, or four rows of the blocks' first to fourth ones.
    values: Vec<f32>,
    /// For each chunk of blocks whether any value can be other than 0.
    shows: Vec<bool>,
}

/// Two rows of the coarser lattice, enlarged along them.
#[derive(Debug, Default)]
struct CoarsePair {
    number: Option<i32>,
    values: Vec<f32>,
}

/// Two rows of a lattice.
struct Pair<'a> {
    octave: usize,
    number: i32,
    /// The column of cells in which the rows begin.
    first: i32,
    width: usize,
    values: &'a mut [f32],
}

/// The widths of what is made for some cells, so that all vectors are full.
#[derive(Clone, Copy)]
struct Widths {
    full: usize,
    coarse: usize,
    /// Cells for which there are gains.
    cells: usize,
}

impl Widths {
    fn new(cells: usize) -> Self {
        let full = (cells * CELL).next_multiple_of(4 * CHUNK);
        // It begins a cell before the full one, and has one more point after its end.
        let coarse = (CELL / 2 + full / 2 + 1).next_multiple_of(4 * CHUNK);
        // Its streaks end at the first of the blocks after it.
        Self { full, coarse, cells: coarse / 4 + CHUNK }
    }
}

impl Synthesis {
    /// The values of a row of pixels of so many cells.
    pub(crate) fn width(cells: usize) -> usize {
        Widths::new(cells).full
    }

    /// Bytes of memory that it holds for so many cells.
    pub(crate) fn memory(cells: usize) -> usize {
        let Widths { full, coarse, cells } = Widths::new(cells);
        let streaks = 3 * (full + coarse + 8 * CHUNK);
        let values = streaks + 2 * (COARSE_PAIRS * full + coarse);
        NodeRows::memory(cells) + values * size_of::<f32>()
    }

    /// Sets the texture of cells in row `row`, which are given by their columns, the same in all calls: [`CELL`]
    /// rows of [`Synthesis::width`] values. Returns whether any of them can be other than 0.
    pub(crate) fn make(
        &mut self,
        map: &NodeMap,
        row: i32,
        cells: &Range<i32>,
        out: &mut [f32],
        arithmetic: impl Arithmetic,
    ) -> bool {
        let shows = map.shows_around(row);
        if shows {
            let widths = Widths::new(cells.len());
            arithmetic.run(
                #[inline(always)]
                || self.set(map, [cells.start, row], widths, out, arithmetic),
            );
        } else {
            out.fill(0.0);
        }
        shows
    }

    /// Sets the texture of a row of cells, of which the first is given by its column and its row.
    #[inline(always)]
    fn set(
        &mut self,
        map: &NodeMap,
        [column, row]: [i32; 2],
        widths: Widths,
        out: &mut [f32],
        arithmetic: impl Arithmetic,
    ) {
        let Self { nodes, streaks, coarse, narrow } = self;
        nodes.prepare(map, [column - 1, row - 1], widths.cells, arithmetic);
        let has_coarse = Pattern::of(1).into_iter().any(|pattern| nodes.has(pattern));
        let first = row * PAIRS as i32;
        if has_coarse {
            for number in first / 2 - 1..first / 2 - 1 + COARSE_PAIRS as i32 {
                let made = &mut coarse[coarse_place(number)];
                if made.number.replace(number) == Some(number) {
                    continue;
                }
                let (width, first) = (widths.coarse, column - 1);
                narrow.resize(2 * width, 0.0);
                Pair { octave: 1, number, first, width, values: narrow }.set(
                    nodes,
                    None,
                    &mut streaks[1],
                    arithmetic,
                );
                made.enlarge(narrow, widths.full, arithmetic);
            }
        }
        let width = widths.full;
        for (number, values) in (first..).zip(out.chunks_exact_mut(2 * width)) {
            let rows = has_coarse.then(|| coarse_rows(number, coarse));
            let pair = Pair { octave: 0, number, first: column, width, values };
            pair.set(nodes, rows, &mut streaks[0], arithmetic);
        }
    }
}

impl CoarsePair {
    /// Takes in two rows that begin a cell before these: of two points in place of one, the first is three times the one
    /// point and the one before it, and the second is three times the one point and the one after it.
    #[cfg_attr(not(target_arch = "wasm32"), inline(always))]
    #[cfg_attr(target_arch = "wasm32", inline(never))]
    fn enlarge<A: Arithmetic>(&mut self, narrow: &[f32], width: usize, a: A) {
        self.values.resize(2 * width, 0.0);
        let rows = narrow.chunks_exact(narrow.len() / 2);
        for (row, wide) in rows.zip(self.values.chunks_exact_mut(width)) {
            let row = &row[CELL / 2 - 1..];
            let [before, points, after] = [0, 1, 2].map(|at| row[at..].chunks_exact(A::LANES));
            let wide = wide.chunks_exact_mut(2 * A::LANES);
            for (((before, points), after), wide) in before.zip(points).zip(after).zip(wide) {
                let near = a.load(points) * a.splat(3.0);
                let pairs = a.interleave(near + a.load(before), near + a.load(after));
                a.store_two(pairs, wide);
            }
        }
    }
}

/// The place of a pair of rows of the coarser lattice.
fn coarse_place(number: i32) -> usize {
    number.rem_euclid(COARSE_PAIRS as i32) as usize
}

/// Rows of the coarser lattice, and what they are made of: the one that has the number of the pair of rows, and its
/// neighbours.
fn coarse_rows(number: i32, pairs: &[CoarsePair; COARSE_PAIRS]) -> [&[f32]; 3] {
    [number - 1, number, number + 1].map(|row| {
        let values = &pairs[coarse_place(row >> 1)].values;
        let (upper, lower) = values.split_at(values.len() / 2);
        if row & 1 == 0 { upper } else { lower }
    })
}

#[inline(always)]
fn sums<V: Add<Output = V>>([a, b]: [V; 2], [c, d]: [V; 2]) -> [V; 2] {
    [a + c, b + d]
}

impl Pair<'_> {
    /// Sets the rows to the patterns of their octave, and to the coarser octaves.
    #[cfg_attr(not(target_arch = "wasm32"), inline(always))]
    #[cfg_attr(target_arch = "wasm32", inline(never))]
    fn set<A: Arithmetic>(
        mut self,
        nodes: &NodeRows,
        coarse: Option<[&[f32]; 3]>,
        streaks: &mut Streaks,
        a: A,
    ) {
        let [isotropic, horizontal, vertical] = Pattern::of(self.octave);
        self.set_isotropic(&self.blocks(isotropic, nodes), coarse, a);
        let row = self.number >> 1;
        if nodes.has_in_row(horizontal, row) {
            self.add_horizontal(&self.blocks(horizontal, nodes), &mut streaks.horizontal, a);
        }
        if nodes.has_in_row(vertical, row) || nodes.has_in_row(vertical, row + 1) {
            self.add_vertical(&self.blocks(vertical, nodes), &mut streaks.vertical, a);
        }
    }

    /// The blocks of a pattern in a row.
    fn blocks<'a>(&self, pattern: Pattern, nodes: &'a NodeRows) -> Blocks<'a> {
        Blocks { nodes, pattern, column: self.first, count: self.width / pattern.points() }
    }

    /// Sets the rows to the isotropic pattern and, between the coarse rows, to three times the nearer one and the other.
    #[inline(always)]
    fn set_isotropic<A: Arithmetic>(
        &mut self,
        blocks: &Blocks<'_>,
        coarse: Option<[&[f32]; 3]>,
        a: A,
    ) {
        let twice = 2 * A::LANES;
        let (upper, lower) = self.values.split_at_mut(self.width);
        let points = upper.chunks_exact_mut(twice).zip(lower.chunks_exact_mut(twice));
        let Some(coarse) = coarse else {
            blocks.visit(
                self.number,
                points,
                a,
                #[inline(always)]
                |points, block| set_points(points, [[a.splat(0.0); 2]; 2], block, a),
            );
            return;
        };
        let [above, near, below] = coarse.map(|row| row.chunks_exact(twice));
        blocks.visit(
            self.number,
            points.zip(above.zip(near).zip(below)),
            a,
            #[inline(always)]
            |(points, ((above, near), below)), block| {
                let [above, near, below] = [a.load_two(above), a.load_two(near), a.load_two(below)];
                let near = [near[0] * a.splat(3.0), near[1] * a.splat(3.0)];
                set_points(points, [sums(near, above), sums(near, below)], block, a);
            },
        );
    }

    #[inline(always)]
    fn add_horizontal<A: Arithmetic>(&mut self, blocks: &Blocks<'_>, made: &mut BlockRow, a: A) {
        let row = self.number >> 1;
        if made.row.replace(row) != Some(row) {
            made.make_rows(blocks, row, a);
        }
        let lines = self.values.split_at_mut(self.width);
        let width = blocks.count + CHUNK;
        let (values, _) = made.values[(self.number & 1) as usize * 2 * width..].split_at(2 * width);
        let values = values.split_at(width);
        for at in (0..blocks.count).step_by(A::LANES) {
            if !made.shows[at / CHUNK] && !made.shows[(at + A::LANES) / CHUNK] {
                continue;
            }
            add_along(&values.0[at..], &mut lines.0[4 * at..], a);
            add_along(&values.1[at..], &mut lines.1[4 * at..], a);
        }
    }

    #[inline(always)]
    fn add_vertical<A: Arithmetic>(&mut self, blocks: &Blocks<'_>, made: &mut [BlockRow; 2], a: A) {
        let row = self.number >> 1;
        for row in [row, row + 1] {
            let made = &mut made[(row & 1) as usize];
            if made.row.replace(row) != Some(row) {
                made.make_blocks(blocks, row, a);
            }
        }
        let [this, next] = [row, row + 1].map(|row| &made[(row & 1) as usize]);
        let (upper, lower) = self.values.split_at_mut(self.width);
        let along = (self.number & 1) as usize * 2;
        for at in (0..blocks.count).step_by(CHUNK) {
            if !this.shows[at / CHUNK] && !next.shows[at / CHUNK] {
                continue;
            }
            for at in (4 * at..4 * (at + CHUNK)).step_by(A::LANES) {
                let (this, next) = (a.load(&this.values[at..]), a.load(&next.values[at..]));
                if a.is_zero(this) && a.is_zero(next) {
                    continue;
                }
                add(&mut upper[at..], a.between(this, next, ALONG[along]), a);
                add(&mut lower[at..], a.between(this, next, ALONG[along + 1]), a);
            }
        }
    }
}

/// Sets the points of blocks to their values, which are added to others.
#[inline(always)]
fn set_points<A: Arithmetic>(
    (upper, lower): (&mut [f32], &mut [f32]),
    [mut first, mut second]: [[A::Values; 2]; 2],
    block: Option<[A::Values; 4]>,
    a: A,
) {
    if let Some(block) = block {
        first = sums(first, a.interleave(block[0], block[1]));
        second = sums(second, a.interleave(block[2], block[3]));
    }
    a.store_two(first, upper);
    a.store_two(second, lower);
}

/// Adds the points of a row along streaks, four for each block.
#[inline(always)]
fn add_along<A: Arithmetic>(blocks: &[f32], row: &mut [f32], a: A) {
    let (this, next) = (a.load(blocks), a.load(&blocks[1..]));
    let [first, second, third, fourth] = a.interleave_four([
        a.between(this, next, ALONG[0]),
        a.between(this, next, ALONG[1]),
        a.between(this, next, ALONG[2]),
        a.between(this, next, ALONG[3]),
    ]);
    add(row, first, a);
    add(&mut row[A::LANES..], second, a);
    add(&mut row[2 * A::LANES..], third, a);
    add(&mut row[3 * A::LANES..], fourth, a);
}

#[inline(always)]
fn add<A: Arithmetic>(row: &mut [f32], values: A::Values, a: A) {
    a.store(a.load(row) + values, row);
}

/// Blocks of a pattern in a row.
struct Blocks<'a> {
    nodes: &'a NodeRows,
    pattern: Pattern,
    /// The column of cells in which they begin.
    column: i32,
    count: usize,
}

impl Blocks<'_> {
    /// Finds the four values of each block of a row, multiplied by its gain, of `LANES` blocks for each place: `None` if
    /// these are all 0.
    #[inline(always)]
    fn visit<A: Arithmetic, P>(
        &self,
        row: i32,
        places: impl Iterator<Item = P>,
        a: A,
        mut visit: impl FnMut(P, Option<[A::Values; 4]>),
    ) {
        let ([above, below], part) = self.nodes.around(self.pattern, self.column, row);
        let gains = above.chunks_exact(A::LANES).zip(below.chunks_exact(A::LANES));
        let mut first = (self.column * self.pattern.blocks() as i32) as u32;
        let seed = self.pattern.seed(row);
        for (place, (above, below)) in places.zip(gains) {
            let gain = a.between(a.load(above), a.load(below), part);
            let values = if a.is_zero(gain) {
                None
            } else {
                let [x, y, z] = a.numbers(first, seed);
                let (x, y, z) = (x * gain, y * gain, z * gain);
                let (sum, difference) = (y + z, y - z);
                Some([x + sum, x - sum, difference - x, -(difference + x)])
            };
            first = first.wrapping_add(A::LANES as u32);
            visit(place, values);
        }
    }
}

impl BlockRow {
    /// Makes a row of blocks in four rows of values.
    #[inline(always)]
    fn make_rows<A: Arithmetic>(&mut self, blocks: &Blocks<'_>, row: i32, a: A) {
        let width = blocks.count + CHUNK;
        self.resize(width);
        let Self { values, shows, .. } = self;
        blocks.visit(
            row,
            (0..width).step_by(A::LANES),
            a,
            #[inline(always)]
            |at, block| {
                shows[at / CHUNK] |= block.is_some();
                let [first, second, third, fourth] = block.unwrap_or([a.splat(0.0); 4]);
                a.store(first, &mut values[at..]);
                a.store(second, &mut values[width + at..]);
                a.store(third, &mut values[2 * width + at..]);
                a.store(fourth, &mut values[3 * width + at..]);
            },
        );
    }

    /// Makes a row of blocks, each block's values one after the other.
    #[inline(always)]
    fn make_blocks<A: Arithmetic>(&mut self, blocks: &Blocks<'_>, row: i32, a: A) {
        self.resize(blocks.count);
        let Self { values, shows, .. } = self;
        blocks.visit(
            row,
            (0..blocks.count).step_by(A::LANES),
            a,
            #[inline(always)]
            |at, block| {
                shows[at / CHUNK] |= block.is_some();
                let values = &mut values[4 * at..];
                match block {
                    Some(block) => a.store_four(a.interleave_four(block), values),
                    None => a.store_four([a.splat(0.0); 4], values),
                }
            },
        );
    }

    fn resize(&mut self, blocks: usize) {
        self.values.resize(4 * blocks, 0.0);
        self.shows.clear();
        self.shows.resize(blocks.div_ceil(CHUNK), false);
    }
}
