//! One pass over the picture: rendering, residual and gradient, tile by tile.
//!
//! The L2 loss is a sum over pixels, so a tile goes forward and backward while it sits in the
//! first cache. Every Gaussian has a slot for its sums in every row of tiles that it touches, and
//! its slots are added up in a fixed order: no atomics, the same bits for any number of threads.

use fearless_simd::{Level, Simd, dispatch, f32x16, prelude::*};
use rayon::prelude::*;

use super::bins::{RowBins, TileRow};
use super::parameterization::GeometrySums;
use crate::encode::error::EncodeError;
use crate::encode::progress::Observer;
use crate::encode::raster::{FULL_SCALE, Raster, SamplePlane, TILE_WIDTH, TilePlane, centers};
use crate::kernel::Kernel;
use crate::region::Region;
use crate::render::simd_kernel;
use crate::render::splat::Splat;
use crate::render::tile_grid::TILE_HEIGHT;

/// Sums of a Gaussian in a row of tiles: five of the geometry, then one by channel.
type Slot = [f32; 8];

/// Pairs of a tile and a Gaussian between two polls: some milliseconds.
const WORK_PER_POLL: usize = 1 << 18;
/// What a tile costs by itself, in such pairs.
const WORK_PER_TILE: usize = 4;

/// How many slots a span takes.
const fn slots_per_span(channels: usize) -> usize {
    (5 + channels).div_ceil(size_of::<Slot>() / size_of::<f32>())
}

/// What a pass says about one Gaussian.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub(crate) struct SplatGradient {
    /// See [`GeometrySums`]; for the loss (sum of squared residuals) / 2.
    pub(crate) moments: GeometrySums,
    /// Gradient by the colour.
    pub(crate) color: [f32; 4],
}

/// The scratch memory of passes, kept from one to the next.
#[derive(Debug)]
pub(crate) struct Pass {
    level: Level,
    tiling: RowBins,
    rows: Vec<TileRow>,
    /// Sums by row of tiles, then by Gaussian.
    slots: Vec<Slot>,
    /// For each splat, where its spans end in `positions`.
    ends: Vec<u32>,
    /// Where the spans of a splat are among those of all rows, splat by splat.
    positions: Vec<u32>,
    /// Rendering minus source, in the layout of the [`Raster`].
    residuals: Vec<TilePlane>,
    /// Squared error of every row of tiles.
    row_errors: Vec<f64>,
}

impl Pass {
    pub(crate) fn new(raster: &Raster) -> Self {
        let rows = raster.height.div_ceil(TILE_HEIGHT);
        let tiles = raster.width.div_ceil(TILE_WIDTH) * rows;
        let region =
            Region { x: 0, y: 0, width: raster.width as u32, height: raster.height as u32 };
        Self {
            level: Level::new(),
            tiling: RowBins::new(region),
            rows: Vec::new(),
            slots: Vec::new(),
            ends: Vec::new(),
            positions: Vec::new(),
            residuals: vec![[[0.0; TILE_WIDTH]; TILE_HEIGHT]; tiles * raster.channels],
            row_errors: vec![0.0; rows],
        }
    }

    /// Says which splats touch which tile. Good for passes over the same splats while they change
    /// little, too: near the cut-off a splat weighs next to nothing.
    pub(crate) fn bin(&mut self, raster: &Raster, splats: &[Splat], kernel: Kernel) {
        // Slots are most of what a Gaussian takes: they make room for what is needed meanwhile.
        self.slots = Vec::new();
        self.ends.clear();
        self.ends.resize(splats.len(), 0);
        self.positions.clear();
        let (ends, positions) = (&mut self.ends, &mut self.positions);
        self.tiling.rebuild(splats, kernel.cutoff(), |splat, span| {
            positions.push(span as u32);
            ends[splat as usize] = positions.len() as u32;
        });
        let tiling = &self.tiling;
        (0..tiling.rows())
            .into_par_iter()
            .map(|row| tiling.row(row))
            .collect_into_vec(&mut self.rows);
        // A splat outside the picture has no spans: it ends where the one before ends.
        let mut last = 0;
        for end in ends {
            last = last.max(*end);
            *end = last;
        }
        self.slots = vec![Slot::default(); self.positions.len() * slots_per_span(raster.channels)];
    }

    /// Kernel evaluations of a pass with these bins.
    pub(crate) fn evaluations(&self) -> u64 {
        let pairs = self.rows.iter().map(TileRow::entries).sum::<usize>();
        (pairs * TILE_WIDTH * TILE_HEIGHT) as u64
    }

    /// Gives back the memory of the bins; the residuals stay.
    pub(crate) fn unbin(&mut self) {
        self.rows = Vec::new();
        self.slots = Vec::new();
        self.ends = Vec::new();
        self.positions = Vec::new();
    }

    /// Renders the `splats` that [`Pass::bin`] was told over `base`, for [`Pass::gradient`] to be
    /// asked then. Returns the sum of squared errors over all samples.
    ///
    /// # Errors
    /// Those of `observer`, which is polled every few milliseconds.
    pub(crate) fn run(
        &mut self,
        raster: &Raster,
        splats: &[Splat],
        kernel: Kernel,
        base: [f32; 4],
        observer: &mut Observer<'_>,
    ) -> Result<f64, EncodeError> {
        match raster.channels {
            1 => self.run_of::<1>(raster, splats, kernel, base, observer),
            2 => self.run_of::<2>(raster, splats, kernel, base, observer),
            3 => self.run_of::<3>(raster, splats, kernel, base, observer),
            _ => self.run_of::<4>(raster, splats, kernel, base, observer),
        }?;
        Ok(self.row_errors.iter().sum())
    }

    /// The gradient by a splat of the last pass, its slots added up in the order of its rows.
    pub(crate) fn gradient(&self, splat: usize, channels: usize) -> SplatGradient {
        let per_span = slots_per_span(channels);
        let mut sum = [Slot::default(); 2];
        for &span in self.spans_of(splat) {
            let slots = &self.slots[span as usize * per_span..][..per_span];
            for (sum, slot) in sum.iter_mut().zip(slots) {
                *sum = core::array::from_fn(|lane| sum[lane] + slot[lane]);
            }
        }
        let sum = sum.as_flattened();
        SplatGradient {
            moments: GeometrySums { first: [sum[0], sum[1]], second: [sum[2], sum[3], sum[4]] },
            color: [sum[5], sum[6], sum[7], sum[8]],
        }
    }

    /// Rendering minus source at a pixel, by channel; as large as it is visible, for output is
    /// clamped.
    pub(crate) fn residual(&self, x: usize, y: usize, channels: usize) -> [f32; 4] {
        let tile = y / TILE_HEIGHT * self.tiling.columns() + x / TILE_WIDTH;
        let mut residual = [0.0; 4];
        for (value, plane) in residual.iter_mut().zip(self.residuals(tile, channels)) {
            *value = plane[y % TILE_HEIGHT][x % TILE_WIDTH];
        }
        residual
    }

    /// Rendering minus source in a tile, by channel; 0 outside the picture.
    pub(crate) fn residuals(&self, tile: usize, channels: usize) -> &[TilePlane] {
        &self.residuals[tile * channels..][..channels]
    }

    /// Whether a splat of the last pass touched the picture.
    pub(crate) fn touches(&self, splat: usize) -> bool {
        !self.spans_of(splat).is_empty()
    }

    /// Bytes held.
    pub(crate) fn memory(&self) -> usize {
        self.tiling.memory()
            + self.rows.iter().map(TileRow::memory).sum::<usize>()
            + self.slots.capacity() * size_of::<Slot>()
            + (self.ends.capacity() + self.positions.capacity()) * size_of::<u32>()
            + size_of_val(&self.residuals[..])
    }

    /// Where the spans of a splat are, in the order of its rows.
    fn spans_of(&self, splat: usize) -> &[u32] {
        let start = splat.checked_sub(1).map_or(0, |before| self.ends[before]);
        &self.positions[start as usize..self.ends[splat] as usize]
    }

    fn run_of<const CHANNELS: usize>(
        &mut self,
        raster: &Raster,
        splats: &[Splat],
        kernel: Kernel,
        base: [f32; 4],
        observer: &mut Observer<'_>,
    ) -> Result<(), EncodeError> {
        let tiling = &self.tiling;
        let per_span = slots_per_span(CHANNELS);
        let mut slots = &mut self.slots[..];
        let residuals = self.residuals.chunks_exact_mut(tiling.columns() * CHANNELS);
        let rows = self.rows.iter().zip(residuals).zip(&mut self.row_errors);
        let mut jobs: Vec<_> = (rows.enumerate())
            .map(|(row, ((tiles, residuals), error))| {
                let length = tiling.spans(row).len() * per_span;
                let (taken, rest) = core::mem::take(&mut slots).split_at_mut(length);
                slots = rest;
                (row, tiles, taken, residuals, error)
            })
            .collect();
        let level = self.level;
        while !jobs.is_empty() {
            observer.poll()?;
            let mut work = 0;
            let count = jobs.iter().take_while(|(_, tiles, ..)| {
                let more = work < WORK_PER_POLL;
                work += tiles.entries() + WORK_PER_TILE * tiling.columns();
                more
            });
            let count = count.count();
            // Row by row, for the last ones to be shared fairly.
            let band = jobs.par_drain(..count).with_max_len(1);
            band.for_each(|(row, tiles, slots, residuals, error)| {
                let splats = &tiling.splats(row, splats);
                let mut states = Vec::new();
                slots.fill(Slot::default());
                *error = 0.0;
                for (column, residual) in residuals.chunks_exact_mut(CHANNELS).enumerate() {
                    let list = tiles.splats(column);
                    let tile = TrainingTile::<CHANNELS> {
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
                    let residual = residual.try_into().expect("a tile has all channels");
                    *error += tile.run(level, kernel, &mut states, slots, residual);
                }
            });
        }
        Ok(())
    }
}

/// A kernel with what the backward half needs: dweight/dq = -slope / 2.
trait TrainingKernel: Copy {
    /// The state to keep per pixel, and the weight.
    fn forward<S: Simd>(self, simd: S, q: f32x16<S>) -> (f32x16<S>, f32x16<S>);
    /// Weight and slope from the state.
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

/// One tile of the pass.
struct TrainingTile<'a, const CHANNELS: usize> {
    x: u32,
    y: u32,
    /// Columns and rows that lie inside the picture.
    columns: usize,
    rows: usize,
    target: &'a [SamplePlane; CHANNELS],
    base: [f32; 4],
    /// The splats of the row of tiles.
    splats: &'a [Splat],
    /// Those of the tile, by their places in `splats`, and in `slots` below.
    list: &'a [u32],
}

impl<const CHANNELS: usize> TrainingTile<'_, CHANNELS> {
    /// Forward, residual, backward; returns the squared error.
    fn run(
        &self,
        level: Level,
        kernel: Kernel,
        states: &mut [TilePlane],
        slots: &mut [Slot],
        planes: &mut [TilePlane; CHANNELS],
    ) -> f64 {
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
    ) -> f64 {
        let px = centers(simd, self.x);
        let py: [f32; TILE_HEIGHT] =
            core::array::from_fn(|row| (self.y as usize + row) as f32 + 0.5);
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
        for (&index, state) in self.list.iter().zip(states) {
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
            // In the order of a slot; the second half serves the fourth channel only.
            let mut all = [[zero; 8]; 2];
            all[0][..5].copy_from_slice(&[x0, s1, dx * x0, dx * s1, s2]);
            all.as_flattened_mut()[5..5 + CHANNELS].copy_from_slice(&by_color);
            let per_span = slots_per_span(CHANNELS);
            let slot = &mut slots[index as usize * per_span..][..per_span];
            for (slot, vectors) in slot.iter_mut().zip(all) {
                let sums = sums(vectors);
                *slot = core::array::from_fn(|lane| slot[lane] + sums[lane]);
            }
        }
        squared
    }

    /// Turns the rendering into residuals; returns the squared error.
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

/// The sums of the lanes of each of eight vectors, in the low eight lanes; added as a tree whose
/// order no SIMD level changes.
#[inline(always)]
fn sums<S: Simd>([a, b, c, d, e, f, g, h]: [f32x16<S>; 8]) -> Slot {
    let abcd = folded(folded(a, b), folded(c, d));
    let efgh = folded(folded(e, f), folded(g, h));
    let all = folded(abcd, efgh);
    let (low, _) = folded(all, all).split();
    low.to_array()
}

/// The sums of neighbouring lanes: of `a` in the low half, of `b` in the high one.
#[inline(always)]
fn folded<S: Simd>(a: f32x16<S>, b: f32x16<S>) -> f32x16<S> {
    a.unzip_low(b) + a.unzip_high(b)
}

#[cfg(test)]
mod tests {
    use core::ops::ControlFlow;

    use glam::Vec3;

    use super::*;
    use crate::color::ColorModel;
    use crate::encode::source::Source;
    use crate::gaussian::{Gaussian, MAX_COMPONENTS, Parameterization};
    use crate::testing::simd_levels;

    const WIDTH: u32 = 37;
    const HEIGHT: u32 = 21;
    const BASE: [f32; 4] = [0.4, 0.5, 0.45, 0.55];
    const PARAMETERIZATIONS: [Parameterization; 3] =
        [Parameterization::Covariance, Parameterization::Cholesky, Parameterization::RotationScale];

    /// A pass that nobody watches.
    fn run(
        pass: &mut Pass,
        raster: &Raster,
        splats: &[Splat],
        kernel: Kernel,
        base: [f32; 4],
    ) -> f64 {
        let mut silent = |_: &_| ControlFlow::Continue(());
        let mut observer = Observer::new(&mut silent, 0);
        pass.bin(raster, splats, kernel);
        pass.run(raster, splats, kernel, base, &mut observer).expect("not cancelled")
    }

    /// Half the sum of squared residuals, straight from the formulas, in f64.
    fn loss(
        rows: &[[f64; MAX_COMPONENTS]],
        parameterization: Parameterization,
        kernel: Kernel,
        source: &Source<'_>,
    ) -> f64 {
        let channels = source.color().channels();
        let mut loss = 0.0;
        for y in 0..HEIGHT {
            for x in 0..WIDTH {
                let mut sums = BASE.map(f64::from);
                for row in rows {
                    let [a, b, c] = [row[2], row[3], row[4]];
                    let (xx, xy, yy) = match parameterization {
                        Parameterization::Covariance => (a, b, c),
                        Parameterization::Cholesky => (a * a, a * b, b * b + c * c),
                        Parameterization::RotationScale => {
                            let (sin, cos) = c.sin_cos();
                            let (a, b) = (a * a, b * b);
                            (
                                cos * cos * a + sin * sin * b,
                                cos * sin * (a - b),
                                sin * sin * a + cos * cos * b,
                            )
                        }
                    };
                    let (dx, dy) = (f64::from(x) + 0.5 - row[0], f64::from(y) + 0.5 - row[1]);
                    let determinant = xx * yy - xy * xy;
                    let q = (yy * dx * dx - 2.0 * xy * dx * dy + xx * dy * dy) / determinant;
                    let weight = match kernel {
                        Kernel::Quartic => (1.0 - q / 4.0).max(0.0).powi(2),
                        Kernel::Exponential { cutoff } if q <= f64::from(cutoff) => {
                            (-q / 2.0).exp()
                        }
                        Kernel::Exponential { .. } => 0.0,
                    };
                    for (sum, color) in sums.iter_mut().zip(&row[5..]) {
                        *sum += color * weight;
                    }
                }
                for (channel, sum) in sums[..channels].iter().enumerate() {
                    let index = (y * WIDTH + x) as usize * channels + channel;
                    let sample = f64::from(source.wide_sample(index)) / 65535.0;
                    loss += 0.5 * (sum - sample).powi(2);
                }
            }
        }
        loss
    }

    /// Gaussians of many shapes: round, slanted both ways, needles, over the border.
    fn scene(
        parameterization: Parameterization,
        channels: usize,
        rng: &mut fastrand::Rng,
    ) -> Vec<[f32; MAX_COMPONENTS]> {
        (0..12)
            .map(|index| {
                let (s1, s2) = match index % 3 {
                    0 => (2.0 + 3.0 * rng.f32(), 2.0 + 3.0 * rng.f32()),
                    1 => (6.0, 1.0 + rng.f32()),
                    _ => (12.0, 0.8),
                };
                let angle = rng.f32() * 6.0 - 3.0;
                let factor = Parameterization::RotationScale.to_cholesky([s1, s2, angle]);
                let shape = match parameterization {
                    Parameterization::RotationScale => Vec3::new(s1, s2, angle),
                    _ => crate::encode::fit::parameterization::from_cholesky(
                        parameterization,
                        factor,
                    ),
                };
                let mut row = [0.0; MAX_COMPONENTS];
                row[0] = rng.f32() * 45.0 - 4.0;
                row[1] = rng.f32() * 27.0 - 3.0;
                row[2..5].copy_from_slice(&shape.to_array());
                for value in &mut row[5..5 + channels] {
                    *value = rng.f32() * 0.4 - 0.2;
                }
                row
            })
            .collect()
    }

    fn gradients(
        rows: &[[f32; MAX_COMPONENTS]],
        parameterization: Parameterization,
        kernel: Kernel,
        raster: &Raster,
    ) -> Vec<[f32; MAX_COMPONENTS]> {
        let splats: Vec<_> = rows
            .iter()
            .map(|row| {
                let gaussian =
                    Gaussian::from_components(&row[..5 + raster.channels], parameterization);
                Splat::new(&gaussian).expect("the scene is sound")
            })
            .collect();
        let mut pass = Pass::new(raster);
        run(&mut pass, raster, &splats, kernel, BASE);
        let by_row = rows.iter().enumerate().map(|(index, row)| {
            let gradient = pass.gradient(index, raster.channels);
            let (center, shape) =
                gradient.moments.gradients(parameterization, Vec3::from_slice(&row[2..5]));
            let mut out = [0.0; MAX_COMPONENTS];
            out[..2].copy_from_slice(&center.to_array());
            out[2..5].copy_from_slice(&shape.to_array());
            out[5..].copy_from_slice(&gradient.color);
            out
        });
        by_row.collect()
    }

    #[test]
    fn every_gradient_equals_its_finite_difference() {
        let mut rng = fastrand::Rng::with_seed(1);
        // Away from black and white, where the residual saturates on purpose. A cut-off so far out
        // that the jump there is below what f32 resolves.
        let kernels = [Kernel::Quartic, Kernel::Exponential { cutoff: 40.0 }];
        let colors = [ColorModel::Gray, ColorModel::GrayAlpha, ColorModel::Rgb, ColorModel::Rgba];
        for (parameterization, kernel) in
            PARAMETERIZATIONS.into_iter().flat_map(|c| kernels.map(|k| (c, k)))
        {
            for color in colors {
                let mut worst = 0.0_f64;
                let channels = color.channels();
                let samples: Vec<u8> = (0..WIDTH as usize * HEIGHT as usize * channels)
                    .map(|_| rng.u8(1..255))
                    .collect();
                let source = Source::new_u8(WIDTH, HEIGHT, color, &samples).expect("sizes agree");
                let rows = scene(parameterization, channels, &mut rng);
                let exact = rows.iter().map(|row| row.map(f64::from)).collect::<Vec<_>>();
                let found = gradients(&rows, parameterization, kernel, &Raster::new(&source));
                for (index, found) in found.iter().enumerate() {
                    for component in 0..5 + channels {
                        let step = 1e-5 * exact[index][component].abs().max(1.0);
                        let moved = |by: f64| {
                            let mut rows = exact.clone();
                            rows[index][component] += by;
                            loss(&rows, parameterization, kernel, &source)
                        };
                        let expected = (moved(step) - moved(-step)) / (2.0 * step);
                        let error = (f64::from(found[component]) - expected).abs();
                        // Relative, but for gradients near zero, which are sums that cancel.
                        let error = error / (expected.abs() + 0.1);
                        worst = worst.max(error);
                        assert!(
                            error <= 2e-3,
                            "{parameterization:?} {kernel:?} {color:?}, Gaussian {index}, component \
                             {component}: {} against {expected}",
                            found[component]
                        );
                    }
                }
                // For the evaluation's report.
                let kernel = match kernel {
                    Kernel::Quartic => "quartic",
                    Kernel::Exponential { .. } => "exponential",
                };
                println!("figure: gradient {parameterization:?} {kernel} {color:?} {worst:e}");
            }
        }
    }

    #[test]
    fn every_simd_level_gives_the_same_bits() {
        let mut rng = fastrand::Rng::with_seed(2);
        let samples: Vec<u8> = (0..WIDTH * HEIGHT * 3).map(|_| rng.u8(..)).collect();
        let source = Source::new_u8(WIDTH, HEIGHT, ColorModel::Rgb, &samples).expect("sizes agree");
        let raster = Raster::new(&source);
        let rows = scene(Parameterization::Cholesky, 3, &mut rng);
        let splats: Vec<_> = rows
            .iter()
            .filter_map(|row| {
                Splat::new(&Gaussian::from_components(&row[..8], Parameterization::Cholesky))
            })
            .collect();
        let run = |level| {
            let mut pass = Pass { level, ..Pass::new(&raster) };
            let error = run(&mut pass, &raster, &splats, Kernel::Quartic, BASE);
            let gradients = (0..splats.len()).map(|splat| pass.gradient(splat, 3));
            (error, gradients.collect())
        };
        let bits = |(error, gradients): (f64, Vec<SplatGradient>)| -> Vec<u64> {
            let gradients = gradients.iter().flat_map(|gradient| {
                let GeometrySums { first, second } = gradient.moments;
                first.into_iter().chain(second).chain(gradient.color).map(f32::to_bits)
            });
            gradients.map(u64::from).chain([error.to_bits()]).collect()
        };
        let expected = run(Level::baseline());
        assert!(expected.0 > 0.0);
        let expected = bits(expected);
        for (name, level) in simd_levels() {
            let found = bits(run(level));
            let differing = found.iter().zip(&expected).filter(|(a, b)| a != b).count();
            // For the evaluation's report.
            println!("figure: simd gradients {name} {differing} {}", expected.len());
            assert_eq!(found.len(), expected.len(), "{name}");
            assert_eq!(differing, 0, "{name}");
        }
    }

    #[test]
    fn what_lies_outside_the_picture_or_beyond_white_is_no_error() {
        let white = [255; 5 * 3 * 3];
        let source = Source::new_u8(5, 3, ColorModel::Rgb, &white).expect("sizes agree");
        let raster = Raster::new(&source);
        let gaussian =
            Gaussian { center: [4.0, 2.0], cholesky: [9.0, 1.0, 7.0], color: [3.0, 3.0, 3.0, 0.0] };
        let splat = Splat::new(&gaussian).expect("it is sound");
        let mut pass = Pass::new(&raster);
        let error = run(&mut pass, &raster, &[splat], Kernel::Quartic, [0.9; 4]);
        assert_eq!(error, 0.0);
        assert_eq!(pass.gradient(0, 3), SplatGradient::default());
    }
}
