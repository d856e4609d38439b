//! The texture of a row of cells: two octaves of noise, of which the coarser one is enlarged by two, with each
//! block of their lattices multiplied by the gains of the map (spec, section 9.7).

use alloc::vec::Vec;
use core::ops::{Add, Range};

use super::arithmetic::Arithmetic;
use super::gains::NodeRows;
use super::map::{CELL, NodeMap, OCTAVES};
use super::noise::{Kind, Pattern};

/// How far each of four points along streaks is on the way to the next block.
const ALONG: [f32; 4] = [0.125, 0.375, 0.625, 0.875];
/// Values that are marked together if any of them can be other than 0, and the most lanes that there are.
const CHUNK: usize = 16;
/// Rows of blocks with streaks that a row of cells depends on.
const BLOCK_ROWS: usize = 3;
/// Rows of the coarser lattice that a row of cells depends on.
const HALF_ROWS: usize = CELL / 2 + 1;

/// Makes the texture of rows of cells one after the other, and keeps what they have in common.
#[derive(Debug, Default)]
pub(crate) struct Synthesis {
    nodes: NodeRows,
    /// For each octave those of horizontal and of vertical streaks.
    streaks: [[BlockRows; 2]; OCTAVES],
    half: Vec<f32>,
    half_shows: Vec<bool>,
    full_shows: Vec<bool>,
}

/// The latest rows of blocks of a pattern, each in the place that its number has by the remainder.
#[derive(Debug, Default)]
struct BlockRows([BlockRow; BLOCK_ROWS]);

/// The values of a row of blocks.
#[derive(Debug, Default)]
struct BlockRow {
    row: Option<i32>,
    /// Each block's four values one after the other, or four rows of the blocks' first to fourth ones.
    values: Vec<f32>,
    /// For each chunk of blocks whether any value can be other than 0.
    shows: Vec<bool>,
}

/// Rows of a lattice.
struct Lattice<'a> {
    width: usize,
    values: &'a mut [f32],
    /// For each chunk of all rows together whether any value can be other than 0.
    shows: &'a mut [bool],
}

/// The widths of what is made for some cells, so that all vectors are full.
#[derive(Clone, Copy)]
struct Widths {
    full: usize,
    half: usize,
    /// Cells for which there are gains.
    cells: usize,
}

impl Widths {
    fn new(cells: usize) -> Self {
        let full = (cells * CELL).next_multiple_of(4 * CHUNK);
        // The coarser lattice has one more point.
        let half = (full / 2 + 1).next_multiple_of(4 * CHUNK);
        // Its streaks end at the first of the blocks after it.
        Self { full, half, cells: half / 4 + CHUNK }
    }
}

impl Synthesis {
    /// The values of a row of pixels of so many cells.
    pub(crate) fn width(cells: usize) -> usize {
        Widths::new(cells).full
    }

    /// Bytes of memory that it holds for so many cells.
    pub(crate) fn memory(cells: usize) -> usize {
        let Widths { full, half, cells } = Widths::new(cells);
        let blocks = 2 * BLOCK_ROWS * (full + half + 8 * CHUNK);
        NodeRows::memory(cells) + (HALF_ROWS * half + blocks) * size_of::<f32>() + full + half
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
        if !map.shows_around(row) {
            out.fill(0.0);
            return false;
        }
        arithmetic.run(
            #[inline(always)]
            || self.set(map, [cells.start, row], Widths::new(cells.len()), out, arithmetic),
        )
    }

    /// Sets the texture of a row of cells, of which `first` is the first: its column and its row.
    #[inline(always)]
    fn set(
        &mut self,
        map: &NodeMap,
        first: [i32; 2],
        widths: Widths,
        out: &mut [f32],
        arithmetic: impl Arithmetic,
    ) -> bool {
        let Self { nodes, streaks, half, half_shows, full_shows } = self;
        nodes.prepare(map, first, widths.cells, arithmetic);
        half.resize(HALF_ROWS * widths.half, 0.0);
        let mut half = Lattice::new(widths.half, half, half_shows);
        let has_half = Pattern::of(1).into_iter().any(|pattern| nodes.has(pattern));
        if has_half {
            half.set_octave(1, nodes, first, None, &mut streaks[1], arithmetic);
        }
        let mut full = Lattice::new(widths.full, out, full_shows);
        let half = has_half.then_some(&half);
        full.set_octave(0, nodes, first, half, &mut streaks[0], arithmetic);
        full.shows.contains(&true)
    }
}

/// Blocks of a pattern in a row.
struct Blocks<'a> {
    nodes: &'a NodeRows,
    pattern: Pattern,
    first: i32,
    count: usize,
}

impl Blocks<'_> {
    /// Finds the four values of each block of a row, multiplied by its gain: of `LANES` blocks at a time, or `None` if
    /// these are all 0.
    #[inline(always)]
    fn visit<A: Arithmetic>(
        &self,
        row: i32,
        count: usize,
        a: A,
        mut visit: impl FnMut(usize, Option<[A::Values; 4]>),
    ) {
        let gains = self.nodes.around(self.pattern, row);
        let seed = self.pattern.seed(row);
        for at in (0..count).step_by(A::LANES) {
            let gain = match gains {
                Some(([above, below], part)) => {
                    a.between(a.load(&above[at..]), a.load(&below[at..]), part)
                }
                None => a.splat(0.0),
            };
            let values = if a.is_zero(gain) {
                None
            } else {
                let [x, y, z] = a.numbers((self.first + at as i32) as u32, seed);
                let (x, y, z) = (x * gain, y * gain, z * gain);
                let (sum, difference) = (y + z, y - z);
                Some([x + sum, x - sum, difference - x, -(difference + x)])
            };
            visit(at, values);
        }
    }
}

impl BlockRows {
    /// The place of a row that is still to be made.
    fn missing(&mut self, row: i32) -> Option<&mut BlockRow> {
        let place = &mut self.0[row.rem_euclid(BLOCK_ROWS as i32) as usize];
        (place.row.replace(row) != Some(row)).then_some(place)
    }

    fn get(&self, row: i32) -> &BlockRow {
        &self.0[row.rem_euclid(BLOCK_ROWS as i32) as usize]
    }
}

impl BlockRow {
    /// Makes a row of blocks in four rows of values.
    #[inline(always)]
    fn make_rows<A: Arithmetic>(&mut self, blocks: &Blocks<'_>, row: i32, a: A) {
        let width = blocks.count + CHUNK;
        self.resize(width);
        let values = &mut self.values;
        let shows = &mut self.shows;
        blocks.visit(
            row,
            blocks.count + A::LANES,
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
        let values = &mut self.values;
        let shows = &mut self.shows;
        blocks.visit(
            row,
            blocks.count,
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

impl<'a> Lattice<'a> {
    fn new(width: usize, values: &'a mut [f32], shows: &'a mut Vec<bool>) -> Self {
        shows.clear();
        shows.resize(width / CHUNK, false);
        Self { width, values, shows }
    }

    /// Adds to a row.
    #[inline(always)]
    fn add<A: Arithmetic>(row: &mut [f32], values: A::Values, a: A) {
        let sum = a.load(row) + values;
        a.store(sum, row);
    }

    /// Adds four vectors to a row.
    #[inline(always)]
    fn add_four<A: Arithmetic>(row: &mut [f32], values: [A::Values; 4], a: A) {
        let [first, second, third, fourth] = values;
        Self::add(row, first, a);
        Self::add(&mut row[A::LANES..], second, a);
        Self::add(&mut row[2 * A::LANES..], third, a);
        Self::add(&mut row[3 * A::LANES..], fourth, a);
    }

    /// Sets the rows to the patterns of an octave, from these cells on, and to the coarser octaves.
    #[inline(always)]
    fn set_octave<A: Arithmetic>(
        &mut self,
        octave: usize,
        nodes: &NodeRows,
        first: [i32; 2],
        coarser: Option<&Lattice<'_>>,
        [horizontal, vertical]: &mut [BlockRows; 2],
        a: A,
    ) {
        for pattern in Pattern::of(octave) {
            let [column, row] = first.map(|cell| cell * pattern.blocks() as i32);
            let count = self.width / pattern.points();
            let blocks = Blocks { nodes, pattern, first: column, count };
            match pattern.kind {
                Kind::Isotropic => self.set_isotropic(row, &blocks, coarser, a),
                _ if !nodes.has(pattern) => {}
                Kind::HorizontalStreaks => self.add_horizontal(row, &blocks, horizontal, a),
                Kind::VerticalStreaks => self.add_vertical(row, &blocks, vertical, a),
            }
        }
    }

    /// Sets the rows to the isotropic pattern and to a coarser lattice, which is enlarged by two: three quarters of the
    /// nearer point and one quarter of the other, between the rows and then along them.
    #[inline(always)]
    fn set_isotropic<A: Arithmetic>(
        &mut self,
        first: i32,
        blocks: &Blocks<'_>,
        coarser: Option<&Lattice<'_>>,
        a: A,
    ) {
        let (width, shows) = (self.width, &mut *self.shows);
        for (pair, lines) in self.values.chunks_mut(2 * width).enumerate() {
            let coarser = coarser.map(|coarser| {
                let rows = &coarser.values[pair * coarser.width..][..2 * coarser.width];
                (&*coarser.shows, rows.split_at(coarser.width))
            });
            blocks.visit(
                first + pair as i32,
                blocks.count,
                a,
                #[inline(always)]
                |at, block| {
                    let coarser = coarser
                        .filter(|(shows, _)| shows[at / CHUNK] || shows[(at + A::LANES) / CHUNK]);
                    let points = 2 * at..2 * (at + A::LANES);
                    if block.is_some() || coarser.is_some() {
                        mark::<2, A>(shows, points.start);
                    }
                    let [mut upper, mut lower] = [[a.splat(0.0); 2]; 2];
                    if let Some((_, (above, below))) = coarser {
                        let this = [a.load(&above[at..]), a.load(&below[at..])];
                        let next = [a.load(&above[at + 1..]), a.load(&below[at + 1..])];
                        upper = enlarged(this, next, [0.75, 0.25], a);
                        lower = enlarged(this, next, [0.25, 0.75], a);
                    }
                    if let Some([first, second, third, fourth]) = block {
                        upper = sums(upper, a.interleave(first, second));
                        lower = sums(lower, a.interleave(third, fourth));
                    }
                    let (line, below) = lines.split_at_mut(width);
                    a.store(upper[0], &mut line[points.start..]);
                    a.store(upper[1], &mut line[points.start + A::LANES..]);
                    if !below.is_empty() {
                        a.store(lower[0], &mut below[points.start..]);
                        a.store(lower[1], &mut below[points.start + A::LANES..]);
                    }
                },
            );
        }
    }

    #[inline(always)]
    fn add_horizontal<A: Arithmetic>(
        &mut self,
        first: i32,
        blocks: &Blocks<'_>,
        made: &mut BlockRows,
        a: A,
    ) {
        for (row, lines) in (first..).zip(self.values.chunks_mut(4 * self.width)) {
            if let Some(made) = made.missing(row) {
                made.make_rows(blocks, row, a);
            }
            let (made, rows) = (made.get(row), lines.len() / self.width);
            for at in (0..blocks.count).step_by(A::LANES) {
                if !made.shows[at / CHUNK] && !made.shows[(at + A::LANES) / CHUNK] {
                    continue;
                }
                let points = 4 * at..4 * (at + A::LANES);
                mark::<4, A>(self.shows, points.start);
                for row in 0..rows {
                    let line = &mut lines[row * self.width + points.start..];
                    let values = &made.values[row * (blocks.count + CHUNK) + at..];
                    let (this, next) = (a.load(values), a.load(&values[1..]));
                    let points = a.interleave_four([
                        a.between(this, next, ALONG[0]),
                        a.between(this, next, ALONG[1]),
                        a.between(this, next, ALONG[2]),
                        a.between(this, next, ALONG[3]),
                    ]);
                    Self::add_four(line, points, a);
                }
            }
        }
    }

    #[inline(always)]
    fn add_vertical<A: Arithmetic>(
        &mut self,
        first: i32,
        blocks: &Blocks<'_>,
        made: &mut BlockRows,
        a: A,
    ) {
        for (row, lines) in (first..).zip(self.values.chunks_mut(4 * self.width)) {
            for row in [row, row + 1] {
                if let Some(made) = made.missing(row) {
                    made.make_blocks(blocks, row, a);
                }
            }
            let [this, next] = [made.get(row), made.get(row + 1)];
            let rows = lines.len() / self.width;
            for at in (0..blocks.count).step_by(CHUNK) {
                if !this.shows[at / CHUNK] && !next.shows[at / CHUNK] {
                    continue;
                }
                for at in (4 * at..4 * (at + CHUNK)).step_by(A::LANES) {
                    let (this, next) = (a.load(&this.values[at..]), a.load(&next.values[at..]));
                    if a.is_zero(this) && a.is_zero(next) {
                        continue;
                    }
                    self.shows[at / CHUNK] = true;
                    for (row, part) in ALONG.into_iter().enumerate().take(rows) {
                        let line = &mut lines[row * self.width + at..];
                        Self::add(line, a.between(this, next, part), a);
                    }
                }
            }
        }
    }
}

/// Marks the chunks of so many vectors from a point on.
#[inline(always)]
fn mark<const VECTORS: usize, A: Arithmetic>(shows: &mut [bool], point: usize) {
    for vector in 0..VECTORS {
        shows[(point + vector * A::LANES) / CHUNK] = true;
    }
}

/// Points of a row between two rows of a coarser lattice, of which it has these parts.
#[inline(always)]
fn enlarged<A: Arithmetic>(
    this: [A::Values; 2],
    next: [A::Values; 2],
    [above, below]: [f32; 2],
    a: A,
) -> [A::Values; 2] {
    let (this, next) = (mix(this, above, below, a), mix(next, above, below, a));
    a.interleave(mix([this, next], 0.75, 0.25, a), mix([this, next], 0.25, 0.75, a))
}

#[inline(always)]
fn mix<A: Arithmetic>([first, second]: [A::Values; 2], p: f32, q: f32, a: A) -> A::Values {
    first * a.splat(p) + second * a.splat(q)
}

#[inline(always)]
fn sums<V: Add<Output = V>>([a, b]: [V; 2], [c, d]: [V; 2]) -> [V; 2] {
    [a + c, b + d]
}
