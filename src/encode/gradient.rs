//! One pass over the picture: rendering, residual and gradient, tile by tile.
//!
//! The L2 loss is a sum over pixels, so a tile goes forward and backward while it sits in the
//! first cache. Every (tile, Gaussian) pair has a slot of its own for its sums, gathered
//! afterwards in a fixed order: no atomics, the same bits for any number of threads.

use fearless_simd::{Level, Simd, dispatch, f32x4, f32x16, prelude::*};
use rayon::prelude::*;

use super::chart::Moments;
use super::raster::Raster;
use crate::limits::Limits;
use crate::render::{
    Kernel, Plane, Region, Splat, TILE_HEIGHT, TILE_WIDTH, Tiling, centers, kernel_simd,
};

/// Sums that a pass takes per (tile, Gaussian): s, and the residual times the weight by channel.
const SUMS: usize = 12;

/// What a pass says about one Gaussian.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub(crate) struct SplatGradient {
    /// See [`Moments`]; for the loss (sum of squared residuals) / 2.
    pub(crate) moments: Moments,
    /// Gradient by the colour.
    pub(crate) color: [f32; 4],
}

/// The scratch memory of passes, kept from one to the next.
#[derive(Debug)]
pub(crate) struct Pass {
    level: Level,
    tiling: Tiling,
    /// Sums by tile, then by Gaussian.
    slots: Vec<[f32; SUMS]>,
    /// For each splat, where its slots end in `positions`.
    ends: Vec<u32>,
    /// Where the slots of a splat are, splat by splat.
    positions: Vec<u32>,
    /// Rendering minus source, in the layout of the [`Raster`].
    residuals: Vec<Plane>,
    /// Squared error of every row of tiles.
    row_errors: Vec<f64>,
}

impl Pass {
    pub(crate) fn new(raster: &Raster) -> Self {
        let rows = raster.height.div_ceil(TILE_HEIGHT);
        let tiles = raster.width.div_ceil(TILE_WIDTH) * rows;
        Self {
            level: Level::new(),
            tiling: Tiling::default(),
            slots: Vec::new(),
            ends: Vec::new(),
            positions: Vec::new(),
            residuals: vec![[[0.0; TILE_WIDTH]; TILE_HEIGHT]; tiles * raster.channels],
            row_errors: vec![0.0; rows],
        }
    }

    /// Renders `splats` over `base`, and sets `gradients`, one per splat. Returns the sum of
    /// squared errors over all samples.
    pub(crate) fn run(
        &mut self,
        raster: &Raster,
        splats: &[Splat],
        kernel: Kernel,
        base: [f32; 4],
        gradients: &mut Vec<SplatGradient>,
    ) -> f64 {
        match raster.channels {
            1 => self.run_of::<1>(raster, splats, kernel, base),
            2 => self.run_of::<2>(raster, splats, kernel, base),
            3 => self.run_of::<3>(raster, splats, kernel, base),
            _ => self.run_of::<4>(raster, splats, kernel, base),
        }
        self.gather(gradients);
        self.row_errors.iter().sum()
    }

    /// Rendering minus source at a pixel, by channel; as large as it is visible, for output is
    /// clamped.
    pub(crate) fn residual(&self, x: usize, y: usize, channels: usize) -> [f32; 4] {
        let tile = y / TILE_HEIGHT * self.tiling.columns() + x / TILE_WIDTH;
        let mut residual = [0.0; 4];
        for (channel, value) in residual[..channels].iter_mut().enumerate() {
            *value = self.residuals[tile * channels + channel][y % TILE_HEIGHT][x % TILE_WIDTH];
        }
        residual
    }

    /// Whether a splat of the last pass touched the picture.
    pub(crate) fn touches(&self, splat: usize) -> bool {
        self.ends[splat] > splat.checked_sub(1).map_or(0, |before| self.ends[before])
    }

    /// Bytes held.
    pub(crate) fn memory(&self) -> usize {
        self.tiling.memory()
            + self.slots.capacity() * size_of::<[f32; SUMS]>()
            + (self.ends.capacity() + self.positions.capacity()) * size_of::<u32>()
            + size_of_val(&self.residuals[..])
    }

    fn run_of<const CHANNELS: usize>(
        &mut self,
        raster: &Raster,
        splats: &[Splat],
        kernel: Kernel,
        base: [f32; 4],
    ) {
        let region =
            Region { x: 0, y: 0, width: raster.width as u32, height: raster.height as u32 };
        self.ends.clear();
        self.ends.resize(splats.len(), 0);
        self.positions.clear();
        let (ends, positions) = (&mut self.ends, &mut self.positions);
        self.tiling
            .rebuild(splats, kernel.cutoff(), region, &Limits::none(), 0, |splat, entry| {
                positions.push(entry as u32);
                ends[splat as usize] = positions.len() as u32;
            })
            .expect("there are no limits");
        // A splat outside the picture has no slots: it ends where the one before ends.
        let mut last = 0;
        for end in ends {
            last = last.max(*end);
            *end = last;
        }
        let tiling = &self.tiling;
        self.slots.resize(positions.len(), [0.0; SUMS]);
        let mut slots = &mut self.slots[..];
        let rows: Vec<_> = (0..tiling.rows())
            .map(|row| {
                let entries = tiling.row_entries(row);
                let (taken, rest) = std::mem::take(&mut slots).split_at_mut(entries);
                slots = rest;
                (row, taken)
            })
            .collect();
        let residuals = self.residuals.par_chunks_exact_mut(tiling.columns() * CHANNELS);
        let level = self.level;
        rows.into_par_iter().zip(residuals).zip(&mut self.row_errors).for_each(
            |(((row, mut slots), residuals), row_error)| {
                let mut states = Vec::new();
                *row_error = 0.0;
                for (column, residual) in residuals.chunks_exact_mut(CHANNELS).enumerate() {
                    let residual: &mut [Plane; CHANNELS] =
                        residual.try_into().expect("a tile has all channels");
                    let list = tiling.splats(column, row);
                    let (taken, rest) = slots.split_at_mut(list.len());
                    slots = rest;
                    let tile = Tile::<CHANNELS> {
                        x: (column * TILE_WIDTH) as u32,
                        y: (row * TILE_HEIGHT) as u32,
                        columns: TILE_WIDTH.min(raster.width - column * TILE_WIDTH),
                        rows: TILE_HEIGHT.min(raster.height - row * TILE_HEIGHT),
                        target: raster.tile(row * tiling.columns() + column),
                        base,
                        splats,
                        list,
                    };
                    states.resize(list.len(), [[0.0; TILE_WIDTH]; TILE_HEIGHT]);
                    *row_error += tile.run(level, kernel, &mut states, taken, residual);
                }
            },
        );
    }

    /// Adds up the slots of every splat, in the order of its tiles.
    fn gather(&self, gradients: &mut Vec<SplatGradient>) {
        let (ends, positions, slots) = (&self.ends, &self.positions, &self.slots);
        (0..ends.len())
            .into_par_iter()
            .with_min_len(256)
            .map(|splat| {
                let start = if splat == 0 { 0 } else { ends[splat - 1] };
                let mut sum = [0.0; SUMS];
                for &position in &positions[start as usize..ends[splat] as usize] {
                    for (sum, value) in sum.iter_mut().zip(&slots[position as usize]) {
                        *sum += value;
                    }
                }
                SplatGradient {
                    moments: Moments { first: [sum[0], sum[1]], second: [sum[2], sum[3], sum[4]] },
                    color: [sum[5], sum[6], sum[7], sum[8]],
                }
            })
            .collect_into_vec(gradients);
    }
}

/// A kernel with what the backward half needs: dweight/dq = -slope / 2.
trait TrainingKernel: Copy {
    /// The state to keep per pixel, and the weight.
    fn forward<S: Simd>(self, simd: S, q: f32x16<S>) -> (f32x16<S>, f32x16<S>);
    /// Weight and slope from the state.
    fn backward<S: Simd>(self, state: f32x16<S>) -> (f32x16<S>, f32x16<S>);
}

impl TrainingKernel for kernel_simd::Exponential {
    #[inline(always)]
    fn forward<S: Simd>(self, simd: S, q: f32x16<S>) -> (f32x16<S>, f32x16<S>) {
        let weight = kernel_simd::Weight::weight(self, simd, q);
        (weight, weight)
    }

    #[inline(always)]
    fn backward<S: Simd>(self, weight: f32x16<S>) -> (f32x16<S>, f32x16<S>) {
        (weight, weight)
    }
}

impl TrainingKernel for kernel_simd::Quartic {
    #[inline(always)]
    fn forward<S: Simd>(self, simd: S, q: f32x16<S>) -> (f32x16<S>, f32x16<S>) {
        let t = (f32x16::splat(simd, 1.0) - q * 0.125).max(0.0);
        let t2 = t * t;
        (t, t2 * t2)
    }

    #[inline(always)]
    fn backward<S: Simd>(self, t: f32x16<S>) -> (f32x16<S>, f32x16<S>) {
        let t3 = t * t * t;
        (t3 * t, t3)
    }
}

/// One tile of the pass.
struct Tile<'a, const CHANNELS: usize> {
    x: u32,
    y: u32,
    /// Columns and rows that lie inside the picture.
    columns: usize,
    rows: usize,
    target: &'a [Plane; CHANNELS],
    base: [f32; 4],
    splats: &'a [Splat],
    list: &'a [u32],
}

impl<const CHANNELS: usize> Tile<'_, CHANNELS> {
    /// Forward, residual, backward; returns the squared error.
    fn run(
        &self,
        level: Level,
        kernel: Kernel,
        states: &mut [Plane],
        slots: &mut [[f32; SUMS]],
        planes: &mut [Plane; CHANNELS],
    ) -> f64 {
        match kernel {
            Kernel::Exponential { cutoff } => {
                let kernel = kernel_simd::Exponential { cutoff };
                dispatch!(level, simd => self.run_with(simd, kernel, states, slots, planes))
            }
            Kernel::Quartic => {
                let kernel = kernel_simd::Quartic;
                dispatch!(level, simd => self.run_with(simd, kernel, states, slots, planes))
            }
        }
    }

    #[inline(always)]
    fn run_with<S: Simd, K: TrainingKernel>(
        &self,
        simd: S,
        kernel: K,
        states: &mut [Plane],
        slots: &mut [[f32; SUMS]],
        planes: &mut [Plane; CHANNELS],
    ) -> f64 {
        let px = centers(simd, self.x);
        let py: [f32; TILE_HEIGHT] =
            std::array::from_fn(|row| (self.y as usize + row) as f32 + 0.5);
        for (plane, base) in planes.iter_mut().zip(self.base) {
            *plane = [[base; TILE_WIDTH]; TILE_HEIGHT];
        }
        for (&index, state) in self.list.iter().zip(&mut *states) {
            let splat = &self.splats[index as usize];
            let dx = px - splat.x;
            let u = dx * splat.i11;
            let (u2, slant) = (u * u, dx * splat.w);
            for row in 0..TILE_HEIGHT {
                let v = slant + splat.i22 * (py[row] - splat.y);
                let (kept, weight) = kernel.forward(simd, u2 + v * v);
                kept.store_array(&mut state[row]);
                for (plane, color) in planes.iter_mut().zip(splat.color) {
                    let sum = f32x16::load_array_ref(simd, &plane[row]) + weight * color;
                    sum.store_array(&mut plane[row]);
                }
            }
        }
        let squared = self.residual(simd, planes);
        for ((&index, state), slot) in self.list.iter().zip(states).zip(slots) {
            let splat = &self.splats[index as usize];
            let zero = f32x16::splat(simd, 0.0);
            let (mut s0, mut s1, mut s2) = (zero, zero, zero);
            let mut by_color = [zero; CHANNELS];
            for row in 0..TILE_HEIGHT {
                let (weight, slope) = kernel.backward(f32x16::load_array_ref(simd, &state[row]));
                let mut along = zero;
                for channel in 0..CHANNELS {
                    let residual = f32x16::load_array_ref(simd, &planes[channel][row]);
                    by_color[channel] += residual * weight;
                    along += residual * splat.color[channel];
                }
                let dy = py[row] - splat.y;
                let s = along * slope;
                let t = s * dy;
                s0 += s;
                s1 += t;
                s2 += t * dy;
            }
            let dx = px - splat.x;
            let x0 = dx * s0;
            let geometry = [x0, s1, dx * x0, dx * s1];
            slot[..4].copy_from_slice(&sums(geometry));
            let mut rest = [zero; 8];
            rest[0] = s2;
            rest[1..=CHANNELS].copy_from_slice(&by_color);
            slot[4..8].copy_from_slice(&sums([rest[0], rest[1], rest[2], rest[3]]));
            if CHANNELS == 4 {
                slot[8..12].copy_from_slice(&sums([rest[4], rest[5], rest[6], rest[7]]));
            }
        }
        squared
    }

    /// Turns the rendering into residuals; returns the squared error.
    #[inline(always)]
    fn residual<S: Simd>(&self, simd: S, planes: &mut [Plane; CHANNELS]) -> f64 {
        let zero = f32x16::splat(simd, 0.0);
        let one = f32x16::splat(simd, 1.0);
        let mut inside = zero;
        inside.as_mut_array()[..self.columns].fill(1.0);
        let mut total = zero;
        for row in 0..TILE_HEIGHT {
            let inside = if row < self.rows { inside } else { zero };
            for (plane, target) in planes.iter_mut().zip(self.target) {
                let target = f32x16::load_array_ref(simd, &target[row]);
                let value = f32x16::load_array_ref(simd, &plane[row]);
                let mut residual = (value - target) * inside;
                // Output is clamped: beyond white or black where the source is so, all is well.
                residual = target.simd_ge(one).select(residual.min(zero), residual);
                residual = target.simd_le(zero).select(residual.max(zero), residual);
                residual.store_array(&mut plane[row]);
                let clamped = (value.max(zero).min(one) - target) * inside;
                total += clamped * clamped;
            }
        }
        total.to_array().iter().map(|&squared| f64::from(squared)).sum()
    }
}

/// The sums of the lanes of four vectors.
#[inline(always)]
fn sums<S: Simd>(vectors: [f32x16<S>; 4]) -> [f32; 4] {
    let quarter = |vector: f32x16<S>| -> f32x4<S> {
        let (low, high) = vector.split();
        let (low, high) = (low + high).split();
        low + high
    };
    let quarters = vectors.map(|vector| quarter(vector).to_array());
    quarters.map(|[a, b, c, d]| (a + c) + (b + d))
}
