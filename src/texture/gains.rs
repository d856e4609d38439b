//! What the patterns are multiplied by: the gain of each block, between those at the nodes of the map (spec,
//! section 9.7).

use alloc::vec::Vec;
use core::mem::take;

use super::arithmetic::Arithmetic;
use super::map::{
    AMPLITUDE, CHANNELS, DIRECTION, LEAST_DIRECTION, LEAST_SUM, NODE_ROWS, NodeMap, OCTAVES,
};
use super::noise::{Kind, PATTERNS, Pattern};

/// Where along an axis the gains of a pattern are.
#[derive(Clone, Copy, Debug)]
struct Places {
    /// Blocks from one node to the next.
    blocks: usize,
    /// How far in its block each of them is: in the middle, or along streaks, which change from one block to the
    /// next, where the block begins.
    offset: f32,
}

impl Pattern {
    /// What makes its standard deviation 1. The numbers of a block are integers, 1024 of which are 1, and the coarser
    /// octave becomes larger by 16 where it is enlarged.
    fn deviation(self) -> f32 {
        match (self.octave, self.kind) {
            (0, Kind::Isotropic) => 1.0 / 1024.0,
            (0, _) => 1.23 / 1024.0,
            (_, Kind::Isotropic) => 1.82 / 16384.0,
            (..) => 1.72 / 16384.0,
        }
    }

    /// Its gains along rows.
    fn across(self) -> Places {
        self.places(Kind::HorizontalStreaks)
    }

    /// Its gains along columns.
    fn down(self) -> Places {
        self.places(Kind::VerticalStreaks)
    }

    fn places(self, along: Kind) -> Places {
        Places { blocks: self.blocks(), offset: if self.kind == along { 0.0 } else { 0.5 } }
    }
}

impl Places {
    /// How far the gain of a block is on the way from one node to the next.
    fn part(self, block: usize) -> f32 {
        (block as f32 + self.offset) / self.blocks as f32
    }
}

/// The gains along some rows of nodes, each in the place that its number has by the remainder.
#[derive(Debug, Default)]
pub(super) struct NodeRows {
    /// The column of the first cell for which there are gains.
    first: i32,
    rows: [NodeRow; NODE_ROWS],
    sums: [Vec<f32>; CHANNELS],
    /// The gains at the nodes.
    gains: [Vec<f32>; PATTERNS],
}

/// The gains of all patterns along a row of nodes, at each of their blocks.
#[derive(Debug, Default)]
struct NodeRow {
    row: Option<i32>,
    shows: [bool; PATTERNS],
    gains: [Vec<f32>; PATTERNS],
}

impl NodeRows {
    /// Bytes of memory that it holds for so many cells.
    pub(super) fn memory(cells: usize) -> usize {
        let blocks: usize = Pattern::all().map(|pattern| pattern.blocks()).sum();
        (cells + 16) * (CHANNELS + PATTERNS + NODE_ROWS * blocks) * size_of::<f32>()
    }

    /// Makes some rows from row `row` on, for so many cells from column `first` on, the same in all calls. Their number
    /// is a multiple of 16.
    #[inline(always)]
    pub(super) fn prepare<A: Arithmetic>(
        &mut self,
        map: &NodeMap,
        [first, row]: [i32; 2],
        cells: usize,
        a: A,
    ) {
        self.first = first;
        for row in row..row + NODE_ROWS as i32 {
            let into = &mut self.rows[slot(row)];
            if into.row == Some(row) {
                continue;
            }
            *into =
                NodeRow { row: Some(row), shows: [false; PATTERNS], gains: take(&mut into.gains) };
            if map.shows(row) {
                for (channel, sums) in self.sums.iter_mut().enumerate() {
                    sums.resize(cells + A::LANES, 0.0);
                    map.copy_sums(channel, row, first, sums);
                }
                into.shows = at_nodes(&self.sums, map.fade(), &mut self.gains, a);
            }
            for pattern in Pattern::all() {
                let index = pattern.index();
                let gains = &mut into.gains[index];
                gains.resize(cells * pattern.blocks(), 0.0);
                if into.shows[index] {
                    between(&self.gains[index], pattern.across(), gains, a);
                } else {
                    gains.fill(0.0);
                }
            }
        }
    }

    /// Whether any of the rows has a pattern.
    pub(super) fn has(&self, pattern: Pattern) -> bool {
        self.rows.iter().any(|row| row.shows[pattern.index()])
    }

    /// Whether a row of blocks can have a pattern.
    pub(super) fn has_in_row(&self, pattern: Pattern, block_row: i32) -> bool {
        self.rows_around(pattern, block_row).0.iter().any(|row| row.shows[pattern.index()])
    }

    /// The gains of a row of blocks along the rows of nodes above and below it, from a column of cells on, and how far it
    /// is on the way from one to the other.
    pub(super) fn around(
        &self,
        pattern: Pattern,
        column: i32,
        block_row: i32,
    ) -> ([&[f32]; 2], f32) {
        let (rows, part) = self.rows_around(pattern, block_row);
        let first = (column - self.first) as usize * pattern.blocks();
        (rows.map(|row| &row.gains[pattern.index()][first..]), part)
    }

    /// The rows of nodes above and below a row of blocks, and how far it is on the way from one to the other.
    #[cfg_attr(target_arch = "wasm32", inline(never))]
    fn rows_around(&self, pattern: Pattern, block_row: i32) -> ([&NodeRow; 2], f32) {
        let blocks = pattern.blocks() as i32;
        let row = block_row.div_euclid(blocks);
        let part = pattern.down().part(block_row.rem_euclid(blocks) as usize);
        // On a row of nodes, the one below it has no part, and may not be there.
        ([row, row + i32::from(part > 0.0)].map(|row| &self.rows[slot(row)]), part)
    }
}

/// The place of a row of nodes.
fn slot(row: i32) -> usize {
    row.rem_euclid(NODE_ROWS as i32) as usize
}

/// Makes the gains of all patterns at nodes with these sums, and says which patterns have any.
#[cfg_attr(not(target_arch = "wasm32"), inline(always))]
#[cfg_attr(target_arch = "wasm32", inline(never))]
fn at_nodes<A: Arithmetic>(
    sums: &[Vec<f32>; CHANNELS],
    fade: f32,
    gains: &mut [Vec<f32>; PATTERNS],
    a: A,
) -> [bool; PATTERNS] {
    let nodes = sums[0].len();
    for gains in &mut *gains {
        gains.resize(nodes, 0.0);
    }
    let mut shows = [false; PATTERNS];
    for at in (0..nodes).step_by(A::LANES) {
        let direction = a.load(&sums[OCTAVES][at..]) * a.splat(DIRECTION.0) + a.splat(DIRECTION.1);
        let least = a.splat(LEAST_DIRECTION);
        let (horizontal, vertical) = (a.unit(direction - least), a.unit(-least - direction));
        let streaks = horizontal + vertical;
        let isotropic = a.sqrt(a.splat(1.0) - streaks * streaks);
        for (octave, sums) in sums[..OCTAVES].iter().enumerate() {
            let sum = a.load(&sums[at..]) - a.splat(LEAST_SUM);
            let amplitude = a.unit(sum * a.splat(AMPLITUDE)) * a.splat(fade);
            for (pattern, weight) in
                Pattern::of(octave).into_iter().zip([isotropic, horizontal, vertical])
            {
                let (index, deviation) = (pattern.index(), pattern.deviation());
                let gain = amplitude * weight * a.splat(deviation);
                shows[index] |= !a.is_zero(gain);
                a.store(gain, &mut gains[index][at..]);
            }
        }
    }
    shows
}

/// Makes the gains of blocks from those at the nodes. There are `LANES` more nodes than cells.
#[cfg_attr(not(target_arch = "wasm32"), inline(always))]
#[cfg_attr(target_arch = "wasm32", inline(never))]
fn between<A: Arithmetic>(nodes: &[f32], places: Places, gains: &mut [f32], a: A) {
    let cells = nodes.len() - A::LANES;
    for at in (0..cells).step_by(A::LANES) {
        let left = a.load(&nodes[at..]);
        let right = a.load(&nodes[at + 1..]);
        let block = |block| a.between(left, right, places.part(block));
        let gains = &mut gains[at * places.blocks..];
        match places.blocks {
            1 => a.store(block(0), gains),
            2 => {
                let [low, high] = a.interleave(block(0), block(1));
                a.store(low, gains);
                a.store(high, &mut gains[A::LANES..]);
            }
            _ => {
                a.store_four(a.interleave_four([block(0), block(1), block(2), block(3)]), gains);
            }
        }
    }
}
