//! Which splats touch each tile of a row: blocks of sixteen that stand together in the file, and so
//! mostly in the picture, with a bit for each.

use alloc::vec::Vec;
use core::ops::Range;

#[cfg(feature = "std")]
use fearless_simd::{Simd, dispatch, prelude::*, u32x16};

use super::tile_grid::Columns;
use crate::simd::{Backend, LANES};

/// Tiles in a row up to which the splats of a block are looked at together.
pub(super) const MOST_TOGETHER: u32 = 64;

/// Some splats of a block.
#[derive(Clone, Copy, Debug, Default)]
pub(crate) struct TileEntry {
    pub(super) block: u32,
    /// A bit for each of its splats, the first one lowest.
    pub(super) members: u32,
}

/// The splats of a tile, in order: blocks, and places in them.
#[derive(Clone, Copy, Debug)]
pub(crate) struct TileSplats<'a> {
    /// Those of the tile, none of them empty, and one more.
    groups: &'a [TileEntry],
    index: usize,
    /// What is left of the present one.
    rest: u32,
}

impl<'a> TileSplats<'a> {
    pub(super) fn new(groups: &'a [TileEntry]) -> Self {
        Self { groups, index: 0, rest: groups[0].members }
    }
}

impl Iterator for TileSplats<'_> {
    type Item = (usize, usize);

    #[inline(always)]
    fn next(&mut self) -> Option<(usize, usize)> {
        if self.index == self.groups.len() - 1 {
            return None;
        }
        let block = self.groups[self.index].block as usize;
        let lane = self.rest.trailing_zeros() as usize % LANES;
        // Whether a group ends is as good as random, so there is no branch to be foreseen.
        let rest = self.rest & (self.rest - 1);
        self.index += usize::from(rest == 0);
        let next = self.groups[self.index].members;
        self.rest = if rest == 0 { next } else { rest };
        Some((block, lane))
    }
}

/// The groups of each tile of a row.
#[derive(Debug, Default)]
pub(crate) struct TileLists {
    /// `groups[starts[t]..ends[t]]` are those of tile t, in order; there is one more after all.
    starts: Vec<usize>,
    ends: Vec<usize>,
    groups: Vec<TileEntry>,
}

impl TileLists {
    /// Sorts the splats of blocks by which of so many tiles they touch, in the memory of an earlier
    /// row.
    pub(crate) fn sort(&mut self, backend: Backend, columns: usize, blocks: &[Columns]) {
        match backend {
            Backend::Reference => self.sort_with(columns, blocks, touched, touching),
            #[cfg(feature = "std")]
            Backend::Simd(level) => dispatch!(level, simd => self.sort_with(
                columns,
                blocks,
                #[inline(always)]
                |block| touched_at_once(simd, block),
                #[inline(always)]
                |block, tile| touching_at_once(simd, block, tile),
            )),
        }
    }

    #[inline(always)]
    fn sort_with(
        &mut self,
        columns: usize,
        blocks: &[Columns],
        touched: impl Fn(&Columns) -> Range<u32>,
        touching: impl Fn(&Columns, u32) -> u32,
    ) {
        // First how many more groups a tile has than the one before it, then how many those before
        // it have.
        let starts = &mut self.starts;
        starts.clear();
        starts.resize(columns + 1, 0);
        for block in blocks {
            for_each_part(
                block,
                touched(block),
                #[inline(always)]
                |_, tiles: Range<u32>| {
                    starts[tiles.start as usize] = starts[tiles.start as usize].wrapping_add(1);
                    starts[tiles.end as usize] = starts[tiles.end as usize].wrapping_sub(1);
                },
            );
        }
        let (mut count, mut total) = (0_usize, 0);
        for start in &mut *starts {
            count = count.wrapping_add(*start);
            *start = total;
            total += count;
        }
        let groups = &mut self.groups;
        groups.clear();
        groups.reserve_exact(total + 1);
        groups.resize(total + 1, TileEntry::default());
        let ends = &mut self.ends;
        ends.clear();
        ends.extend_from_slice(&starts[..columns]);
        for (index, block) in (0..).zip(blocks) {
            for_each_part(
                block,
                touched(block),
                #[inline(always)]
                |part, tiles: Range<u32>| {
                    for tile in tiles {
                        let members = part & touching(block, tile);
                        let end = &mut ends[tile as usize];
                        groups[*end] = TileEntry { block: index, members };
                        *end += usize::from(members != 0);
                    }
                },
            );
        }
    }

    /// The splats of a tile.
    pub(crate) fn members(&self, column: usize) -> TileSplats<'_> {
        TileSplats::new(&self.groups[self.starts[column]..=self.ends[column]])
    }
}

/// Calls `each` with splats of a block, a bit for each, and the tiles that they may touch: all at
/// once, or one by one where they are too far from each other.
#[inline(always)]
fn for_each_part(
    [first, end]: &Columns,
    touched: Range<u32>,
    mut each: impl FnMut(u32, Range<u32>),
) {
    if touched.is_empty() {
        return;
    }
    if touched.end - touched.start <= MOST_TOGETHER {
        each(u32::MAX, touched);
        return;
    }
    for lane in 0..LANES {
        if first[lane] < end[lane] {
            each(1 << lane, first[lane]..end[lane]);
        }
    }
}

/// From the first tile that splats of a block touch to the last. Empty where none does.
fn touched([first, end]: &Columns) -> Range<u32> {
    let (mut low, mut high) = (u32::MAX, 0);
    for lane in 0..LANES {
        low = low.min(if first[lane] < end[lane] { first[lane] } else { u32::MAX });
        high = high.max(end[lane]);
    }
    low..high
}

/// [`touched`], all at once.
#[cfg(feature = "std")]
#[inline(always)]
fn touched_at_once<S: Simd>(simd: S, [first, end]: &Columns) -> Range<u32> {
    let [first, end] = [first, end].map(|tiles| u32x16::load_array_ref(simd, tiles));
    let none = u32x16::splat(simd, u32::MAX);
    first.simd_lt(end).select(first, none).reduce_min()..end.reduce_max()
}

/// The splats of a block that touch a tile, a bit for each.
fn touching([first, end]: &Columns, tile: u32) -> u32 {
    let mut members = 0;
    for lane in 0..LANES {
        let touches = first[lane] <= tile && tile < end[lane];
        members |= u32::from(touches) << lane;
    }
    members
}

/// [`touching`], all at once.
#[cfg(feature = "std")]
#[inline(always)]
fn touching_at_once<S: Simd>(simd: S, [first, end]: &Columns, tile: u32) -> u32 {
    let [first, end] = [first, end].map(|tiles| u32x16::load_array_ref(simd, tiles));
    (first.simd_le(tile) & end.simd_gt(tile)).to_bitmask() as u32
}

#[cfg(test)]
mod tests {
    use super::*;
    use proptest::prelude::*;

    use crate::testing::config;

    /// Blocks whose splats are near each other or anywhere in a row of tiles, some nowhere.
    fn blocks(columns: u32) -> impl Strategy<Value = Vec<Columns>> {
        let near = (0..columns, prop::array::uniform16((0_u32..8, 0_u32..5)));
        let far = (Just(0), prop::array::uniform16((0..columns, 0..columns)));
        let block = prop_oneof![near, far].prop_map(move |(from, spans)| {
            let first = spans.map(|(first, _)| (from + first).min(columns));
            let end = spans.map(|(first, length)| (from + first + length).min(columns));
            [first, end]
        });
        prop::collection::vec(block, 0..6)
    }

    proptest! {
        #![proptest_config(config(200))]

        #[test]
        fn every_tile_has_what_touches_it_in_order(
            (columns, blocks) in (1_u32..300).prop_flat_map(|columns| (Just(columns), blocks(columns)))
        ) {
            let mut groups = TileLists::default();
            for backend in [Backend::reference(), Backend::fastest()] {
                groups.sort(backend, columns as usize, &blocks);
                for tile in 0..columns {
                    let found: Vec<(usize, usize)> = groups.members(tile as usize).collect();
                    let expected: Vec<(usize, usize)> = (blocks.iter().enumerate())
                        .flat_map(|(block, [first, end])| {
                            let touches = move |&lane: &usize| (first[lane]..end[lane]).contains(&tile);
                            (0..LANES).filter(touches).map(move |lane| (block, lane))
                        })
                        .collect();
                    prop_assert_eq!(found, expected, "tile {}", tile);
                }
            }
        }
    }
}
