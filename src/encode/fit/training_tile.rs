//! One tile of the training pass, in SIMD code: rendering, residuals and gradient sums.
//!
//! The rendering of a tile stays in registers where there are 32 of them. Products are added with a
//! single rounding, so that all machines get the same bits; those without such an instruction (x86
//! before 2013) emulate it, and take longer. Loops are over indices: closures and the functions of some
//! iterators would be called, not inlined, and compiled for the least SIMD level.

use fearless_simd::{Level, Simd, dispatch, f32x16, prelude::*};

use crate::encode::loss::{PictureLoss, RenderingError};
use crate::encode::mul_add::MulAdd;
use crate::encode::pairs::folded;
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

/// What the backward pass needs to know of a splat at each pixel of a tile.
#[repr(align(64))]
#[derive(Clone, Copy)]
pub(super) struct TileState(TilePlane);

impl TileState {
    pub(super) const ZERO: Self = Self([[0.0; TILE_WIDTH]; TILE_HEIGHT]);
}

/// A kernel and its derivative.
trait TrainingKernel: Copy {
    /// The factor on distances that makes the kernel's formula short.
    const SCALE: f32;
    /// The part of the kernel that depends on u only, which all points of a column share.
    fn column<S: Simd>(self, simd: S, u: f32x16<S>) -> f32x16<S>;
    /// The state to keep per pixel for the backward pass, and the weight.
    fn forward<S: Simd>(self, simd: S, column: f32x16<S>, v: f32x16<S>) -> (f32x16<S>, f32x16<S>);
    /// The weight and the slope, -2 dweight/dq, from the state.
    fn backward<S: Simd>(self, state: f32x16<S>) -> (f32x16<S>, f32x16<S>);
}

impl TrainingKernel for simd_kernel::Exponential {
    const SCALE: f32 = 1.0;

    #[inline(always)]
    fn column<S: Simd>(self, _: S, u: f32x16<S>) -> f32x16<S> {
        u * u
    }

    #[inline(always)]
    fn forward<S: Simd>(self, simd: S, column: f32x16<S>, v: f32x16<S>) -> (f32x16<S>, f32x16<S>) {
        let weight = self.at(simd, v.fused_mul_add(v, column));
        (weight, weight)
    }

    #[inline(always)]
    fn backward<S: Simd>(self, weight: f32x16<S>) -> (f32x16<S>, f32x16<S>) {
        (weight, weight)
    }
}

impl TrainingKernel for simd_kernel::Quartic {
    // 1 - q / 4 is then 1 - u^2 - v^2.
    const SCALE: f32 = 1.0 / QUARTIC_RADIUS;

    #[inline(always)]
    fn column<S: Simd>(self, simd: S, u: f32x16<S>) -> f32x16<S> {
        (-u).fused_mul_add(u, f32x16::splat(simd, 1.0))
    }

    #[inline(always)]
    fn forward<S: Simd>(self, simd: S, column: f32x16<S>, v: f32x16<S>) -> (f32x16<S>, f32x16<S>) {
        let root = simd_kernel::larger(simd, (-v).fused_mul_add(v, column), 0.0);
        (root, root * root)
    }

    #[inline(always)]
    fn backward<S: Simd>(self, root: f32x16<S>) -> (f32x16<S>, f32x16<S>) {
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
    pub(super) fn run(
        &self,
        level: Level,
        kernel: Kernel,
        states: &mut [TileState],
        slots: Option<&mut [Slot]>,
        planes: &mut [TilePlane; CHANNELS],
    ) -> RenderingError {
        match kernel {
            Kernel::Exponential { cutoff } => {
                let kernel = simd_kernel::Exponential { cutoff };
                self.run_with(level, kernel, states, slots, planes)
            }
            Kernel::Quartic => self.run_with(level, simd_kernel::Quartic, states, slots, planes),
        }
    }

    fn run_with<K: TrainingKernel>(
        &self,
        level: Level,
        kernel: K,
        states: &mut [TileState],
        slots: Option<&mut [Slot]>,
        planes: &mut [TilePlane; CHANNELS],
    ) -> RenderingError {
        dispatch!(level, simd => {
            let error = self.forward(simd, kernel, states, planes);
            if let Some(slots) = slots {
                self.backward(simd, kernel, states, slots, planes);
            }
            error
        })
    }

    #[inline(always)]
    #[expect(clippy::needless_range_loop, reason = "see the top of the file")]
    fn forward<S: Simd, K: TrainingKernel>(
        &self,
        simd: S,
        kernel: K,
        states: &mut [TileState],
        planes: &mut [TilePlane; CHANNELS],
    ) -> RenderingError {
        let px = centers(simd, self.x);
        let top = self.y as f32 + 0.5;
        let zero = f32x16::splat(simd, 0.0);
        let mut rendering = [[zero; TILE_HEIGHT]; CHANNELS];
        for channel in 0..CHANNELS {
            rendering[channel] = [f32x16::splat(simd, self.base[channel]); TILE_HEIGHT];
        }
        for (entry, state) in states.iter_mut().enumerate() {
            let splat = &self.splats[self.indices[entry] as usize];
            let dx = px - splat.x;
            let column = kernel.column(simd, dx * (splat.i11 * K::SCALE));
            let rise = f32x16::splat(simd, splat.i22 * K::SCALE);
            let mut v = dx * (splat.w * K::SCALE) + rise * (top - splat.y);
            for row in 0..TILE_HEIGHT {
                let (kept, weight) = kernel.forward(simd, column, v);
                kept.store_array(&mut state.0[row]);
                for channel in 0..CHANNELS {
                    let sum = &mut rendering[channel][row];
                    *sum = weight.fused_mul_add(splat.color[channel], *sum);
                }
                v += rise;
            }
        }
        let corner = [self.x as usize, self.y as usize];
        let size = [self.columns, self.rows];
        self.loss.of_tile(simd, &rendering, self.target, corner, size, planes)
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
        let px = centers(simd, self.x);
        let top = self.y as f32 + 0.5;
        let zero = f32x16::splat(simd, 0.0);
        let mut residuals = [[zero; TILE_HEIGHT]; CHANNELS];
        for channel in 0..CHANNELS {
            for row in 0..TILE_HEIGHT {
                residuals[channel][row] = f32x16::load_array_ref(simd, &planes[channel][row]);
            }
        }
        for (entry, state) in states.iter().enumerate() {
            let index = self.indices[entry] as usize;
            let splat = &self.splats[index];
            let (mut s0, mut s1, mut s2) = (zero, zero, zero);
            let mut by_color = [zero; 4];
            for row in 0..TILE_HEIGHT {
                let (weight, slope) = kernel.backward(f32x16::load_array_ref(simd, &state.0[row]));
                let mut along = zero;
                for channel in 0..CHANNELS {
                    let residual = residuals[channel][row];
                    by_color[channel] = residual.fused_mul_add(weight, by_color[channel]);
                    along = residual.fused_mul_add(splat.color[channel], along);
                }
                let s = along * slope;
                let y = row as f32;
                s0 += s;
                s1 = s.fused_mul_add(y, s1);
                s2 = s.fused_mul_add(y * y, s2);
            }
            // From the distance to the first row to that from the centre.
            let dy = top - splat.y;
            let (t1, t2) = (s1 + s0 * dy, s2 + (s1 * 2.0 + s0 * dy) * dy);
            let dx = px - splat.x;
            let x0 = dx * s0;
            let [c0, c1, c2, c3] = by_color;
            let first = index * slots_per_span(CHANNELS);
            add(&mut slots[first], lane_sums([x0, t1, dx * x0, dx * t1, t2, c0, c1, c2]));
            if CHANNELS == 4 {
                add(
                    &mut slots[first + 1],
                    lane_sums([c3, zero, zero, zero, zero, zero, zero, zero]),
                );
            }
        }
    }
}

#[inline(always)]
fn add(slot: &mut Slot, sums: Slot) {
    for lane in 0..sums.len() {
        slot[lane] += sums[lane];
    }
}

/// The sums of the lanes of each of eight vectors. The order of the additions is a tree that is the
/// same at every SIMD level.
#[inline(always)]
fn lane_sums<S: Simd>([a, b, c, d, e, f, g, h]: [f32x16<S>; 8]) -> Slot {
    let abcd = folded(folded(a, b), folded(c, d));
    let efgh = folded(folded(e, f), folded(g, h));
    let all = folded(abcd, efgh);
    let (low, _) = folded(all, all).split();
    low.to_array()
}
