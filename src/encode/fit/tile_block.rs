//! The part of a tile of the training pass that is processed at once.
//!
//! Where there are wide vectors and many registers, it is the whole tile. WebAssembly has vectors of four
//! lanes, and no more than sixteen of them are in registers: there it is a small block, and a splat costs
//! time in the blocks that it reaches alone. What is left out would add 0; but the gradient sums of a tile are added
//! in another order.

#[cfg(target_arch = "wasm32")]
use fearless_simd::f32x4;
#[cfg(not(target_arch = "wasm32"))]
use fearless_simd::f32x16;
use fearless_simd::{Simd, prelude::*};

use crate::encode::pairs::folded;
use crate::encode::sample_tile::TILE_WIDTH;
use crate::render::tile_grid::TILE_HEIGHT;

/// A row of a block.
#[cfg(target_arch = "wasm32")]
pub(super) type Line<S> = f32x4<S>;
/// A row of a block.
#[cfg(not(target_arch = "wasm32"))]
pub(super) type Line<S> = f32x16<S>;

/// Columns of a block.
pub(super) const BLOCK_WIDTH: usize = if cfg!(target_arch = "wasm32") { 4 } else { TILE_WIDTH };
/// Rows of a block.
pub(super) const BLOCK_HEIGHT: usize = if cfg!(target_arch = "wasm32") { 4 } else { TILE_HEIGHT };
/// Blocks side by side in a tile.
pub(super) const ACROSS: usize = TILE_WIDTH / BLOCK_WIDTH;
/// Blocks one below the other.
pub(super) const DOWN: usize = TILE_HEIGHT / BLOCK_HEIGHT;
/// Blocks of a tile, row by row.
pub(super) const BLOCKS: usize = ACROSS * DOWN;

/// One value for each pixel of a block, row by row.
pub(super) type BlockPlane = [[f32; BLOCK_WIDTH]; BLOCK_HEIGHT];

/// How many blocks are left of a block, and above it.
#[inline(always)]
pub(super) fn place(block: usize) -> [usize; 2] {
    let down = block / ACROSS;
    [block - down * ACROSS, down]
}

/// The first of the blocks that are left, one bit each, which is left no longer.
#[inline(always)]
pub(super) fn next_block(left: &mut u32) -> usize {
    let block = left.trailing_zeros() as usize;
    *left &= *left - 1;
    block
}

/// The sums of the lanes of each of eight lines. The order of the additions is a tree that is the same at
/// every SIMD level.
#[inline(always)]
pub(super) fn lane_sums<S: Simd>([a, b, c, d, e, f, g, h]: [Line<S>; 8]) -> [f32; 8] {
    let abcd = folded(folded(a, b), folded(c, d));
    let efgh = folded(folded(e, f), folded(g, h));
    #[cfg(target_arch = "wasm32")]
    let sums = abcd.combine(efgh);
    #[cfg(not(target_arch = "wasm32"))]
    let sums = {
        let all = folded(abcd, efgh);
        folded(all, all).split().0
    };
    sums.to_array()
}
