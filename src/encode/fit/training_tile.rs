//! One tile of the training pass, in SIMD code: rendering, residuals and gradient sums.
//!
//! The rendering of a block stays in registers where there are 32 of them. Products are added with a
//! single rounding, so that all machines get the same bits; those without such an instruction (x86
//! before 2013) emulate it, and take longer. Loops are over indices: closures and the functions of some
//! iterators would be called, not inlined, and compiled for the least SIMD level.

use fearless_simd::{Level, Simd, dispatch, f32x4, prelude::*};

use super::tile_block::{
    ACROSS, BLOCK_HEIGHT, BLOCK_WIDTH, BLOCKS, BlockPlane, DOWN, Line, lane_sums, next_block, place,
};
use crate::encode::loss::{PictureLoss, RenderingError};
use crate::encode::mul_add::MulAdd;
use crate::encode::sample_tile::{SampleTile, TILE_WIDTH, TilePlane, centers};
use crate::encode::tiled_source::TiledSource;
use crate::gaussian::component_count;
use crate::kernel::{Kernel, QUARTIC_RADIUS};
use crate::render::simd_kernel;
use crate::render::splat::Splat;
use crate::render::tile_grid::TILE_HEIGHT;

/// Gradient sums of a splat in a row of tiles, one for each component: five of the geometry, then one per
/// channel. With four channels, the last one is in a second slot.
pub(super) type Slot = [f32; 8];

/// Slots that the sums of one span take.
pub(super) const fn slots_per_span(channels: usize) -> usize {
    component_count(channels).div_ceil(size_of::<Slot>() / size_of::<f32>())
}

/// How much further a splat is taken to reach, as a part of the square of its reach: more than rounding.
const MARGIN: f32 = 1e-3;

/// What the backward pass needs to know of a splat in a tile.
#[repr(align(64))]
#[derive(Clone, Copy)]
pub(super) struct TileState {
    /// The state of the kernel at each pixel, in the blocks that the splat reaches.
    of_blocks: [BlockPlane; BLOCKS],
    /// These blocks, one bit each.
    reached: u32,
}

impl TileState {
    pub(super) const ZERO: Self =
        Self { of_blocks: [[[0.0; BLOCK_WIDTH]; BLOCK_HEIGHT]; BLOCKS], reached: 0 };

    /// The blocks that the splat reaches, one bit each. Where there is one, it is known when this is compiled.
    #[inline(always)]
    fn reached(&self) -> u32 {
        if BLOCKS == 1 { 1 } else { self.reached }
    }
}

/// A kernel and its derivative.
trait TrainingKernel: Copy {
    /// The factor on distances that makes the kernel's formula short.
    const SCALE: f32;
    /// The square of the distance at which it ends, times the square of that factor.
    fn squared_reach(self) -> f32;
    /// The part of the kernel that depends on u only, which all points of a column share.
    fn column<S: Simd>(self, simd: S, u: Line<S>) -> Line<S>;
    /// The state to keep per pixel for the backward pass, and the weight.
    fn forward<S: Simd>(self, simd: S, column: Line<S>, v: Line<S>) -> (Line<S>, Line<S>);
    /// The weight and the slope, -2 dweight/dq, from the state.
    fn backward<S: Simd>(self, state: Line<S>) -> (Line<S>, Line<S>);
}

impl TrainingKernel for simd_kernel::Exponential {
    const SCALE: f32 = 1.0;

    #[inline(always)]
    fn squared_reach(self) -> f32 {
        self.cutoff
    }

    #[inline(always)]
    fn column<S: Simd>(self, _: S, u: Line<S>) -> Line<S> {
        u * u
    }

    #[inline(always)]
    fn forward<S: Simd>(self, simd: S, column: Line<S>, v: Line<S>) -> (Line<S>, Line<S>) {
        let weight = self.at(simd, v.fused_mul_add(v, column));
        (weight, weight)
    }

    #[inline(always)]
    fn backward<S: Simd>(self, weight: Line<S>) -> (Line<S>, Line<S>) {
        (weight, weight)
    }
}

impl TrainingKernel for simd_kernel::Quartic {
    // 1 - q / 4 is then 1 - u^2 - v^2.
    const SCALE: f32 = 1.0 / QUARTIC_RADIUS;

    #[inline(always)]
    fn squared_reach(self) -> f32 {
        1.0
    }

    #[inline(always)]
    fn column<S: Simd>(self, simd: S, u: Line<S>) -> Line<S> {
        (-u).fused_mul_add(u, Line::splat(simd, 1.0))
    }

    #[inline(always)]
    fn forward<S: Simd>(self, simd: S, column: Line<S>, v: Line<S>) -> (Line<S>, Line<S>) {
        let root = simd_kernel::larger(simd, (-v).fused_mul_add(v, column), 0.0);
        (root, root * root)
    }

    #[inline(always)]
    fn backward<S: Simd>(self, root: Line<S>) -> (Line<S>, Line<S>) {
        (root * root, root)
    }
}

/// One tile of the pass.
pub(super) struct TrainingTile<'a, const CHANNELS: usize> {
    /// Column and row of its first pixel.
    x: u32,
    y: u32,
    /// Numbers of columns and rows inside the picture.
    columns: usize,
    rows: usize,
    target: SampleTile<'a, CHANNELS>,
    loss: &'a PictureLoss,
    /// The base colour.
    base: [f32; 4],
    /// The splats of the row of tiles.
    splats: &'a [Splat],
    /// The splats of the tile, by their indices in `splats`.
    indices: &'a [u32],
}

impl<'a, const CHANNELS: usize> TrainingTile<'a, CHANNELS> {
    /// The tile at a column and row of tiles.
    pub(super) fn new(
        tiled: &'a TiledSource,
        [column, row]: [usize; 2],
        base: [f32; 4],
        splats: &'a [Splat],
        indices: &'a [u32],
    ) -> Self {
        Self {
            x: (column * TILE_WIDTH) as u32,
            y: (row * TILE_HEIGHT) as u32,
            columns: TILE_WIDTH.min(tiled.width - column * TILE_WIDTH),
            rows: TILE_HEIGHT.min(tiled.height - row * TILE_HEIGHT),
            target: tiled.tile(row * tiled.width.div_ceil(TILE_WIDTH) + column),
            loss: &tiled.loss,
            base,
            splats,
            indices,
        }
    }

    /// Forward pass, residuals, and, if there are `slots`, backward pass. Returns the error.
    ///
    /// `states` is scratch memory with one plane for each splat of the tile. The gradient sums are
    /// added to `slots`, which has [`slots_per_span`] slots for each of `splats`. `planes` receives
    /// half the gradient of the distortion by the samples of the rendering.
    ///
    /// It is compiled once for all that call it.
    #[inline(never)]
    pub(super) fn run(
        &self,
        level: Level,
        kernel: Kernel,
        states: &mut [TileState],
        slots: Option<&mut [Slot]>,
        planes: &mut [TilePlane; CHANNELS],
    ) -> RenderingError {
        dispatch!(level, simd => {
            match kernel {
                Kernel::Exponential { cutoff } => {
                    self.forward(simd, simd_kernel::Exponential { cutoff }, states, planes);
                }
                Kernel::Quartic => self.forward(simd, simd_kernel::Quartic, states, planes),
            }
            let corner = [self.x as usize, self.y as usize];
            let size = [self.columns, self.rows];
            let error = self.loss.of_tile(simd, self.target, corner, size, planes);
            match (kernel, slots) {
                (_, None) => {}
                (Kernel::Exponential { cutoff }, Some(slots)) => {
                    self.backward(simd, simd_kernel::Exponential { cutoff }, states, slots, planes);
                }
                (Kernel::Quartic, Some(slots)) => {
                    self.backward(simd, simd_kernel::Quartic, states, slots, planes);
                }
            }
            error
        })
    }

    /// The pixel centres of the columns of blocks side by side.
    #[inline(always)]
    #[expect(clippy::needless_range_loop, reason = "see the top of the file")]
    fn columns<S: Simd>(&self, simd: S) -> [Line<S>; ACROSS] {
        let centers = centers(simd, self.x).to_array();
        let mut columns = [Line::splat(simd, 0.0); ACROSS];
        for across in 0..ACROSS {
            columns[across] = Line::load_array_ref(simd, block_line(&centers, across));
        }
        columns
    }

    /// The pixel centre of the first row of a block with so many above it.
    #[inline(always)]
    fn top(&self, down: usize) -> f32 {
        (self.y as usize + down * BLOCK_HEIGHT) as f32 + 0.5
    }

    /// The blocks in which a splat may have weights over 0, one bit each.
    #[inline(always)]
    fn reached<S: Simd, K: TrainingKernel>(&self, simd: S, kernel: K, splat: &Splat) -> u32 {
        if BLOCKS == 1 {
            // Tiles that it does not reach do not have it.
            return 1;
        }
        let [i11, w, i22] = [splat.i11, splat.w, splat.i22].map(|entry| entry * K::SCALE);
        // From the centre of a block to those of the pixels at its corners, and to what they are in the
        // splat's own frame.
        let [half_width, half_height] =
            [BLOCK_WIDTH, BLOCK_HEIGHT].map(|side| (side - 1) as f32 / 2.0);
        let [by_u, by_v] = [half_width * i11, half_width * w.abs() + half_height * i22];
        let middle = f32x4::from_fn(simd, |across| (across * BLOCK_WIDTH) as f32);
        let dx = middle + (self.x as f32 + 0.5 + half_width - splat.x);
        let least_u = simd_kernel::larger(simd, (dx * i11).abs() - by_u, 0.0);
        let mut reached = 0;
        for down in 0..DOWN {
            let dy = self.top(down) + half_height - splat.y;
            let v = dx * w + dy * i22;
            let least_v = simd_kernel::larger(simd, v.abs() - by_v, 0.0);
            let squared = least_u * least_u + least_v * least_v;
            let within = squared.simd_le(kernel.squared_reach() * (1.0 + MARGIN));
            reached |= (within.to_bitmask() as u32) << (down * ACROSS);
        }
        reached
    }

    #[inline(always)]
    #[expect(clippy::needless_range_loop, reason = "see the top of the file")]
    fn forward<S: Simd, K: TrainingKernel>(
        &self,
        simd: S,
        kernel: K,
        states: &mut [TileState],
        planes: &mut [TilePlane; CHANNELS],
    ) {
        let columns = self.columns(simd);
        let zero = Line::splat(simd, 0.0);
        let mut rendering = [[[zero; BLOCK_HEIGHT]; CHANNELS]; BLOCKS];
        for block in 0..BLOCKS {
            for channel in 0..CHANNELS {
                rendering[block][channel] = [Line::splat(simd, self.base[channel]); BLOCK_HEIGHT];
            }
        }
        for (entry, state) in states.iter_mut().enumerate() {
            let splat = &self.splats[self.indices[entry] as usize];
            state.reached = self.reached(simd, kernel, splat);
            let rise = Line::splat(simd, splat.i22 * K::SCALE);
            let mut left = state.reached();
            while left != 0 {
                let block = next_block(&mut left);
                let [across, down] = place(block);
                let (dx, dy) = (columns[across] - splat.x, self.top(down) - splat.y);
                let column = kernel.column(simd, dx * (splat.i11 * K::SCALE));
                let mut v = dx * (splat.w * K::SCALE) + rise * dy;
                for row in 0..BLOCK_HEIGHT {
                    let (kept, weight) = kernel.forward(simd, column, v);
                    kept.store_array(&mut state.of_blocks[block][row]);
                    for channel in 0..CHANNELS {
                        let sum = &mut rendering[block][channel][row];
                        *sum = weight.fused_mul_add(splat.color[channel], *sum);
                    }
                    v += rise;
                }
            }
        }
        for block in 0..BLOCKS {
            let [across, down] = place(block);
            for channel in 0..CHANNELS {
                for row in 0..BLOCK_HEIGHT {
                    let line = &mut planes[channel][down * BLOCK_HEIGHT + row];
                    let line = &mut line.as_chunks_mut().0[across];
                    rendering[block][channel][row].store_array(line);
                }
            }
        }
    }

    #[inline(always)]
    #[expect(clippy::needless_range_loop, reason = "see the top of the file")]
    fn backward<S: Simd, K: TrainingKernel>(
        &self,
        simd: S,
        kernel: K,
        states: &[TileState],
        slots: &mut [Slot],
        planes: &[TilePlane; CHANNELS],
    ) {
        let columns = self.columns(simd);
        let zero = Line::splat(simd, 0.0);
        let mut residuals = [[[zero; BLOCK_HEIGHT]; CHANNELS]; BLOCKS];
        for block in 0..BLOCKS {
            let [across, down] = place(block);
            for channel in 0..CHANNELS {
                for row in 0..BLOCK_HEIGHT {
                    let line = block_line(&planes[channel][down * BLOCK_HEIGHT + row], across);
                    residuals[block][channel][row] = Line::load_array_ref(simd, line);
                }
            }
        }
        for (entry, state) in states.iter().enumerate() {
            let index = self.indices[entry] as usize;
            let splat = &self.splats[index];
            let (mut by_point, mut by_color) = ([zero; 5], [zero; 4]);
            let mut left = state.reached();
            while left != 0 {
                let block = next_block(&mut left);
                let (mut s0, mut s1, mut s2) = (zero, zero, zero);
                for row in 0..BLOCK_HEIGHT {
                    let kept = Line::load_array_ref(simd, &state.of_blocks[block][row]);
                    let (weight, slope) = kernel.backward(kept);
                    let mut along = residuals[block][0][row] * splat.color[0];
                    for channel in 0..CHANNELS {
                        let residual = residuals[block][channel][row];
                        by_color[channel] = residual.fused_mul_add(weight, by_color[channel]);
                        if channel > 0 {
                            along = residual.fused_mul_add(splat.color[channel], along);
                        }
                    }
                    let s = along * slope;
                    let y = row as f32;
                    s0 += s;
                    s1 = s.fused_mul_add(y, s1);
                    s2 = s.fused_mul_add(y * y, s2);
                }
                // From the distance to the first row to that from the centre.
                let [across, down] = place(block);
                let (dx, dy) = (columns[across] - splat.x, self.top(down) - splat.y);
                let (t1, t2) = (s1 + s0 * dy, s2 + (s1 * 2.0 + s0 * dy) * dy);
                let x0 = dx * s0;
                by_point[0] += x0;
                by_point[1] += t1;
                by_point[2] = dx.fused_mul_add(x0, by_point[2]);
                by_point[3] = dx.fused_mul_add(t1, by_point[3]);
                by_point[4] += t2;
            }
            let ([x, y, xx, xy, yy], [c0, c1, c2, c3]) = (by_point, by_color);
            let first = index * slots_per_span(CHANNELS);
            add(&mut slots[first], lane_sums([x, y, xx, xy, yy, c0, c1, c2]));
            if CHANNELS == 4 {
                add(
                    &mut slots[first + 1],
                    lane_sums([c3, zero, zero, zero, zero, zero, zero, zero]),
                );
            }
        }
    }
}

/// The part of a row of a tile that a block has.
#[inline(always)]
fn block_line(line: &[f32; TILE_WIDTH], across: usize) -> &[f32; BLOCK_WIDTH] {
    &line.as_chunks().0[across]
}

#[inline(always)]
fn add(slot: &mut Slot, sums: Slot) {
    for lane in 0..sums.len() {
        slot[lane] += sums[lane];
    }
}
