//! The walk over the k-d tree of cells, in the order of the file (spec, section 7.4).

use core::ops::Range;

use super::cells::{Cell, CenterGrid, Split};
use super::contexts::{self, SMALL_COUNT};
use super::numbers::plain;
use super::rans::{Attribute, SymbolCoder};
use super::symbol::SYMBOLS;

/// Most cells on the stack of a walk. Each split leaves its second part there, and each of the two
/// sides, which are shorter than 2^32 units, is halved at most 32 times.
const MAX_STACK: usize = 2 * 32 + 2;

/// The Gaussians of a layer. Those that were coded are in the order of the tree.
pub(super) trait TreeGaussians {
    /// Moves the Gaussians in `range` whose centre lies before `middle` along an axis to the front
    /// of the range. Returns how many they are. A decoder, which does not know the Gaussians yet,
    /// returns any number.
    fn partition(&mut self, range: Range<usize>, axis: usize, middle: u32) -> usize;

    /// Codes a Gaussian that lies in `cell`. The indices are 0, 1, 2 and so on.
    fn code(&mut self, coder: &mut impl SymbolCoder, index: usize, cell: &Cell);
}

/// Codes `count` Gaussians: how many of them lie in each cell, and each one in its cell.
#[inline(always)]
pub(super) fn walk(
    coder: &mut impl SymbolCoder,
    grid: &CenterGrid,
    count: usize,
    gaussians: &mut impl TreeGaussians,
) {
    coder.begin(Attribute::Position);
    // Blocks of roots that are still to be coded, with their numbers of Gaussians.
    let mut stack = [(grid.whole(), count as u32); MAX_STACK];
    let (mut length, mut done) = (1, 0);
    while length > 0 {
        length -= 1;
        let (roots, count) = stack[length];
        match grid.split(&roots) {
            Ok(split) => {
                let counts = code_counts(coder, gaussians, &split, done, count);
                // The first part is taken from the stack first.
                for part in [1, 0] {
                    stack[length] = (split.parts[part], counts[part]);
                    length += usize::from(counts[part] > 0);
                }
            }
            Err(root) => done = walk_root(coder, root, count, done, gaussians),
        }
    }
}

/// Codes the `count` Gaussians of a root, which follow `done` others. Returns how many are done
/// then.
#[inline(always)]
fn walk_root(
    coder: &mut impl SymbolCoder,
    root: Cell,
    count: u32,
    mut done: usize,
    gaussians: &mut impl TreeGaussians,
) -> usize {
    let mut stack = [(root, 0); MAX_STACK];
    let mut length = 0;
    let (mut cell, mut count) = (root, count);
    loop {
        while count > 1
            && let Some(split) = cell.split()
        {
            let counts = code_counts(coder, gaussians, &split, done, count);
            // Branchless: whether a part is empty cannot be predicted.
            let next = usize::from(counts[0] == 0);
            stack[length] = (split.parts[1], counts[1]);
            length += usize::from(counts[0] > 0 && counts[1] > 0);
            (cell, count) = (split.parts[next], counts[next]);
        }
        for _ in 0..count {
            gaussians.code(coder, done, &cell);
            done += 1;
        }
        if length == 0 {
            return done;
        }
        length -= 1;
        (cell, count) = stack[length];
    }
}

/// Codes how many of a cell's `count` Gaussians, which follow `done` others, lie in each of its
/// parts.
#[inline(always)]
fn code_counts<T>(
    coder: &mut impl SymbolCoder,
    gaussians: &mut impl TreeGaussians,
    split: &Split<T>,
    done: usize,
    count: u32,
) -> [u32; 2] {
    let first = gaussians.partition(done..done + count as usize, split.axis, split.middle);
    let first = code_first_count(coder, count, first as u32);
    [first, count - first]
}

/// Codes how many of a cell's `count` Gaussians lie in its first part.
#[inline(always)]
fn code_first_count(coder: &mut impl SymbolCoder, count: u32, first: u32) -> u32 {
    /// Ranges that the numbers from 0 to a large `count` are divided into: one for each symbol.
    const RANGES: u64 = SYMBOLS as u64;

    if count < SMALL_COUNT as u32 {
        let coded = coder.symbol(contexts::SMALL_SPLIT + count as usize, first);
        if coded > count {
            coder.refuse();
            return 0;
        }
        return coded;
    }
    let numbers = u64::from(count) + 1;
    let range = (u64::from(first) * RANGES / numbers) as u32;
    let range = coder.symbol(contexts::LARGE_SPLIT + count.ilog2() as usize, range).into();
    let start_of = |range: u64| (range * numbers).div_ceil(RANGES) as u32;
    let (low, high) = (start_of(range), start_of(range + 1) - 1);
    let rest = plain(coder, (high - low + 1).next_power_of_two().ilog2(), first.wrapping_sub(low));
    if rest > high - low {
        coder.refuse();
        return low;
    }
    low + rest
}
