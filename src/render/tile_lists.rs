//! Which splats touch each tile of a row of tiles. An entry stands for several of the sixteen
//! splats of a block, which are neighbours in the file, and so mostly in the picture as well.

use alloc::vec::Vec;
use core::ops::Range;

#[cfg(feature = "std")]
use fearless_simd::{Simd, dispatch, prelude::*, u32x16};

use super::tile_grid::Columns;
use crate::simd::{Backend, LANES};

/// If the splats of a block lie within this many tiles of a row, each of these tiles is tested for
/// all of them together.
pub(super) const MAX_BLOCK_SPAN: u32 = 64;

/// The splats of a block that touch a tile.
#[derive(Clone, Copy, Debug, Default)]
pub(crate) struct TileEntry {
    pub(super) block: u32,
    /// A bit for each splat of the block, the first one lowest.
    pub(super) members: u32,
}

/// The splats that touch a tile, in file order: the index of the block, and that of the splat in
/// it.
#[derive(Clone, Copy, Debug)]
pub(crate) struct TileSplats<'a> {
    /// The entries of the tile, none of which is empty, and one more.
    entries: &'a [TileEntry],
    index: usize,
    /// The members of the present entry that are still to come.
    rest: u32,
}

impl<'a> TileSplats<'a> {
    pub(super) fn new(entries: &'a [TileEntry]) -> Self {
        Self { entries, index: 0, rest: entries[0].members }
    }
}

impl Iterator for TileSplats<'_> {
    type Item = (usize, usize);

    #[inline(always)]
    fn next(&mut self) -> Option<(usize, usize)> {
        if self.index == self.entries.len() - 1 {
            return None;
        }
        let block = self.entries[self.index].block as usize;
        let lane = self.rest.trailing_zeros() as usize % LANES;
        // Branchless: whether an entry ends cannot be predicted.
        let rest = self.rest & (self.rest - 1);
        self.index += usize::from(rest == 0);
        let next = self.entries[self.index].members;
        self.rest = if rest == 0 { next } else { rest };
        Some((block, lane))
    }
}

/// The entries of each tile of a row.
#[derive(Debug, Default)]
pub(crate) struct TileLists {
    /// `entries[starts[t]..ends[t]]` are those of tile t, in file order. One more follows the last.
    starts: Vec<usize>,
    ends: Vec<usize>,
    entries: Vec<TileEntry>,
}

impl TileLists {
    /// Makes the lists of a row of `columns` tiles, from the tiles that the splats of each block
    /// touch. The memory of an earlier row is used again.
    pub(crate) fn fill(&mut self, backend: Backend, columns: usize, blocks: &[Columns]) {
        match backend {
            Backend::Reference(_) => self.fill_with(columns, blocks, span, touching),
            #[cfg(feature = "std")]
            Backend::Simd(level) => dispatch!(level, simd => self.fill_with(
                columns,
                blocks,
                #[inline(always)]
                |block| span_simd(simd, block),
                #[inline(always)]
                |block, tile| touching_simd(simd, block, tile),
            )),
        }
    }

    #[inline(always)]
    fn fill_with(
        &mut self,
        columns: usize,
        blocks: &[Columns],
        span: impl Fn(&Columns) -> Range<u32>,
        touching: impl Fn(&Columns, u32) -> u32,
    ) {
        // First the difference of the number of entries of each tile from that of the tile before
        // it, which wraps around; then the sum of the numbers of all tiles before it.
        let starts = &mut self.starts;
        starts.clear();
        starts.resize(columns + 1, 0);
        for block in blocks {
            for_each_span(
                block,
                span(block),
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
        let entries = &mut self.entries;
        entries.clear();
        entries.reserve_exact(total + 1);
        entries.resize(total + 1, TileEntry::default());
        let ends = &mut self.ends;
        ends.clear();
        ends.extend_from_slice(&starts[..columns]);
        for (index, block) in (0..).zip(blocks) {
            for_each_span(
                block,
                span(block),
                #[inline(always)]
                |splats, tiles: Range<u32>| {
                    for tile in tiles {
                        let members = splats & touching(block, tile);
                        let end = &mut ends[tile as usize];
                        entries[*end] = TileEntry { block: index, members };
                        *end += usize::from(members != 0);
                    }
                },
            );
        }
    }

    /// The splats that touch the tile of a column.
    pub(crate) fn splats(&self, column: usize) -> TileSplats<'_> {
        TileSplats::new(&self.entries[self.starts[column]..=self.ends[column]])
    }
}

/// Calls `each` with splats of a block, a bit for each, and the tiles that they may touch: with all
/// splats together, or one by one if they are too far from each other.
#[inline(always)]
fn for_each_span([first, end]: &Columns, span: Range<u32>, mut each: impl FnMut(u32, Range<u32>)) {
    if span.is_empty() {
        return;
    }
    if span.end - span.start <= MAX_BLOCK_SPAN {
        each(u32::MAX, span);
        return;
    }
    for lane in 0..LANES {
        if first[lane] < end[lane] {
            each(1 << lane, first[lane]..end[lane]);
        }
    }
}

/// The tiles from the first that a splat of a block touches to the last. Empty if none touches any.
fn span([first, end]: &Columns) -> Range<u32> {
    let (mut low, mut high) = (u32::MAX, 0);
    for lane in 0..LANES {
        low = low.min(if first[lane] < end[lane] { first[lane] } else { u32::MAX });
        high = high.max(end[lane]);
    }
    low..high
}

/// [`span`] with SIMD.
#[cfg(feature = "std")]
#[inline(always)]
fn span_simd<S: Simd>(simd: S, [first, end]: &Columns) -> Range<u32> {
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

/// [`touching`] with SIMD.
#[cfg(feature = "std")]
#[inline(always)]
fn touching_simd<S: Simd>(simd: S, [first, end]: &Columns, tile: u32) -> u32 {
    let [first, end] = [first, end].map(|tiles| u32x16::load_array_ref(simd, tiles));
    (first.simd_le(tile) & end.simd_gt(tile)).to_bitmask() as u32
}

#[cfg(test)]
mod tests {
    use super::*;
    use proptest::prelude::*;

    use crate::testing::config;

    /// Blocks whose splats are near each other, or anywhere in a row of tiles. Some touch no tile.
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
        fn every_tile_has_the_splats_that_touch_it_in_file_order(
            (columns, blocks) in (1_u32..300).prop_flat_map(|columns| (Just(columns), blocks(columns)))
        ) {
            let mut lists = TileLists::default();
            for backend in [Backend::reference(), Backend::fastest()] {
                lists.fill(backend, columns as usize, &blocks);
                for tile in 0..columns {
                    let found: Vec<(usize, usize)> = lists.splats(tile as usize).collect();
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
