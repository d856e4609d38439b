//! One tile of the training pass, in SIMD code: rendering, residuals and gradient sums.

use fearless_simd::{Level, Simd, dispatch, f32x16, prelude::*};

use crate::encode::distortion::differentiate;
use crate::encode::raster::{FULL_SCALE, SamplePlane, TILE_WIDTH, TilePlane, centers};
use crate::encode::sensitivity::Sensitivity;
use crate::kernel::Kernel;
use crate::render::simd_kernel;
use crate::render::splat::Splat;
use crate::render::tile_grid::TILE_HEIGHT;

/// Gradient sums of a splat in a row of tiles: five of the geometry, then one per channel. With
/// four channels, the last one is in a second slot.
pub(super) type Slot = [f32; 8];

/// Slots that the sums of one span take.
pub(super) const fn slots_per_span(channels: usize) -> usize {
    (5 + channels).div_ceil(size_of::<Slot>() / size_of::<f32>())
}

/// A kernel and its derivative.
trait TrainingKernel: Copy {
    /// The state to keep per pixel for the backward pass, and the weight.
    fn forward<S: Simd>(self, simd: S, q: f32x16<S>) -> (f32x16<S>, f32x16<S>);
    /// The weight and the slope, -2 dweight/dq, from the state.
    fn backward<S: Simd>(self, state: f32x16<S>) -> (f32x16<S>, f32x16<S>);
}

impl TrainingKernel for simd_kernel::Exponential {
    #[inline(always)]
    fn forward<S: Simd>(self, simd: S, q: f32x16<S>) -> (f32x16<S>, f32x16<S>) {
        let weight = self.at(simd, q);
        (weight, weight)
    }

    #[inline(always)]
    fn backward<S: Simd>(self, weight: f32x16<S>) -> (f32x16<S>, f32x16<S>) {
        (weight, weight)
    }
}

impl TrainingKernel for simd_kernel::Quartic {
    #[inline(always)]
    fn forward<S: Simd>(self, simd: S, q: f32x16<S>) -> (f32x16<S>, f32x16<S>) {
        let t = self.root(simd, q);
        (t, t * t)
    }

    #[inline(always)]
    fn backward<S: Simd>(self, t: f32x16<S>) -> (f32x16<S>, f32x16<S>) {
        (t * t, t)
    }
}

/// The error of a rendering, where a full sample is 1.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub(crate) struct RenderingError {
    /// The sum of squared errors over all samples, clamped as in the output.
    pub(crate) squared: f64,
    /// What training minimizes: the sum of squared errors, weighted by the eye's sensitivity if the
    /// encoder is tuned for it.
    pub(crate) distortion: f64,
}

impl core::ops::Add for RenderingError {
    type Output = Self;

    fn add(self, other: Self) -> Self {
        Self {
            squared: self.squared + other.squared,
            distortion: self.distortion + other.distortion,
        }
    }
}

/// One tile of the pass.
pub(super) struct TrainingTile<'a, const CHANNELS: usize> {
    /// Column and row of its first pixel.
    pub(super) x: u32,
    pub(super) y: u32,
    /// Numbers of columns and rows inside the picture.
    pub(super) columns: usize,
    pub(super) rows: usize,
    pub(super) target: &'a [SamplePlane; CHANNELS],
    /// How much errors count; `None` if all count the same.
    pub(super) sensitivity: Option<&'a Sensitivity>,
    /// The base colour.
    pub(super) base: [f32; 4],
    /// The splats of the row of tiles.
    pub(super) splats: &'a [Splat],
    /// The splats of the tile, by their indices in `splats`.
    pub(super) indices: &'a [u32],
}

impl<const CHANNELS: usize> TrainingTile<'_, CHANNELS> {
    /// Forward pass, residuals, backward pass. Returns the error.
    ///
    /// `states` is scratch memory with one plane for each splat of the tile. The gradient sums are
    /// added to `slots`, which has [`slots_per_span`] slots for each of `splats`. `planes` receives
    /// half the gradient of the distortion by the samples of the rendering.
    pub(super) fn run(
        &self,
        level: Level,
        kernel: Kernel,
        states: &mut [TilePlane],
        slots: &mut [Slot],
        planes: &mut [TilePlane; CHANNELS],
    ) -> RenderingError {
        match kernel {
            Kernel::Exponential { cutoff } => {
                let kernel = simd_kernel::Exponential { cutoff };
                dispatch!(level, simd => self.run_with(simd, kernel, states, slots, planes))
            }
            Kernel::Quartic => {
                let kernel = simd_kernel::Quartic;
                dispatch!(level, simd => self.run_with(simd, kernel, states, slots, planes))
            }
        }
    }

    #[inline(always)]
    fn run_with<S: Simd, K: TrainingKernel>(
        &self,
        simd: S,
        kernel: K,
        states: &mut [TilePlane],
        slots: &mut [Slot],
        planes: &mut [TilePlane; CHANNELS],
    ) -> RenderingError {
        let px = centers(simd, self.x);
        let py: [f32; TILE_HEIGHT] =
            core::array::from_fn(|row| (self.y as usize + row) as f32 + 0.5);
        for (plane, base) in planes.iter_mut().zip(self.base) {
            *plane = [[base; TILE_WIDTH]; TILE_HEIGHT];
        }
        for (&index, state) in self.indices.iter().zip(&mut *states) {
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
        let distortion = self.sensitivity.map_or(squared, |sensitivity| {
            let corner = [self.x as usize, self.y as usize];
            differentiate(sensitivity, corner, [self.columns, self.rows], planes)
        });
        for (&index, state) in self.indices.iter().zip(states) {
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
            // In the order of the slots; the second slot is for the fourth channel only.
            let mut all = [[zero; 8]; 2];
            all[0][..5].copy_from_slice(&[x0, s1, dx * x0, dx * s1, s2]);
            all.as_flattened_mut()[5..5 + CHANNELS].copy_from_slice(&by_color);
            let per_span = slots_per_span(CHANNELS);
            let slot = &mut slots[index as usize * per_span..][..per_span];
            for (slot, vectors) in slot.iter_mut().zip(all) {
                let sums = lane_sums(vectors);
                *slot = core::array::from_fn(|lane| slot[lane] + sums[lane]);
            }
        }
        RenderingError { squared, distortion }
    }

    /// Turns the rendering in `planes` into residuals; returns the sum of squared errors.
    #[inline(always)]
    fn residual<S: Simd>(&self, simd: S, planes: &mut [TilePlane; CHANNELS]) -> f64 {
        let zero = f32x16::splat(simd, 0.0);
        let one = f32x16::splat(simd, 1.0);
        let mut inside = zero;
        inside.as_mut_array()[..self.columns].fill(1.0);
        let mut total = zero;
        for row in 0..TILE_HEIGHT {
            let inside = if row < self.rows { inside } else { zero };
            for (plane, target) in planes.iter_mut().zip(self.target) {
                let target =
                    f32x16::from_fn(simd, |column| f32::from(target[row][column])) / FULL_SCALE;
                let value = f32x16::load_array_ref(simd, &plane[row]);
                let mut residual = (value - target) * inside;
                // The output is clamped: where the source is white, a rendering above white is no
                // error, and below black where the source is black.
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

/// The sums of pairs of neighbouring lanes: those of `a` in the low half, of `b` in the high half.
#[inline(always)]
fn folded<S: Simd>(a: f32x16<S>, b: f32x16<S>) -> f32x16<S> {
    a.unzip_low(b) + a.unzip_high(b)
}
