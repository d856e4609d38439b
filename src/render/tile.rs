//! One tile of the output: splats added to pixels that stay in registers (spec, section 9.4).

#[cfg(feature = "std")]
use fearless_simd::{Simd, dispatch, f32x8, f32x16, prelude::*};

#[cfg(feature = "std")]
use super::simd_kernel::{Exponential, Quartic, Weight};
use super::splat::Block;
#[cfg(feature = "std")]
use super::splat::Splat;
use super::tile_grid::{PAIR_WIDTH, TILE_HEIGHT, TILE_WIDTH};
use super::tile_lists::TileSplats;
use crate::kernel::Kernel;
use crate::simd::Backend;

/// Rows that share a vector.
#[cfg(feature = "std")]
const TOGETHER: usize = 2;

/// One channel of two tiles side by side, row by row.
pub(crate) type PairPlane = [[f32; PAIR_WIDTH]; TILE_HEIGHT];

/// What a tile shows.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Tile<'a, const CHANNELS: usize> {
    /// The first pixel.
    pub(crate) origin: (u32, u32),
    pub(crate) base: [f32; CHANNELS],
    pub(crate) blocks: &'a [Block],
    /// Those of the splats that are added, in order.
    pub(crate) members: TileSplats<'a>,
    pub(crate) kernel: Kernel,
}

impl<const CHANNELS: usize> Tile<'_, CHANNELS> {
    /// Renders it as the first or the second of its pair.
    pub(crate) fn render(&self, backend: Backend, half: usize, planes: &mut [PairPlane; CHANNELS]) {
        let left = half * TILE_WIDTH;
        match (backend, self.kernel) {
            (Backend::Reference, _) => self.render_plainly(left, planes),
            #[cfg(feature = "std")]
            (Backend::Simd(level), Kernel::Exponential { cutoff }) => {
                let kernel = Exponential { cutoff };
                dispatch!(level, simd => self.render_with(simd, kernel, left, planes));
            }
            #[cfg(feature = "std")]
            (Backend::Simd(level), Kernel::Quartic) => {
                dispatch!(level, simd => self.render_with(simd, Quartic, left, planes));
            }
        }
    }

    fn render_plainly(&self, left: usize, planes: &mut [PairPlane; CHANNELS]) {
        for (plane, base) in planes.iter_mut().zip(self.base) {
            plane.iter_mut().for_each(|row| row[left..][..TILE_WIDTH].fill(base));
        }
        for (block, lane) in self.members {
            let splat = &self.blocks[block][lane];
            for row in 0..TILE_HEIGHT {
                for column in 0..TILE_WIDTH {
                    let px = (self.origin.0 as usize + column) as f32 + 0.5;
                    let py = (self.origin.1 as usize + row) as f32 + 0.5;
                    let weight = self.kernel.weight(splat.uv(px, py));
                    for (plane, color) in planes.iter_mut().zip(splat.color) {
                        plane[row][left + column] += color * weight;
                    }
                }
            }
        }
    }

    #[cfg(feature = "std")]
    #[inline(always)]
    fn render_with<S: Simd, K: Weight>(
        &self,
        simd: S,
        kernel: K,
        left: usize,
        planes: &mut [PairPlane; CHANNELS],
    ) {
        // Exact, like every sum of them here.
        const CENTERS: [f32; 8] = [0.5, 1.5, 2.5, 3.5, 4.5, 5.5, 6.5, 7.5];
        let centers = f32x8::load_array(simd, CENTERS);
        let px = centers + self.origin.0 as f32;
        let (px, py) = (px.combine(px), centers + self.origin.1 as f32);
        // In registers, where there are enough: loading and storing would be half of the work.
        let mut sums = [[f32x16::splat(simd, 0.0); TILE_HEIGHT / TOGETHER]; CHANNELS];
        for (sums, base) in sums.iter_mut().zip(self.base) {
            *sums = [f32x16::splat(simd, base); TILE_HEIGHT / TOGETHER];
        }
        let mut members = self.members;
        while let Some((block, lane)) = members.next() {
            let first = &self.blocks[block][lane];
            if let Some((block, lane)) = members.next() {
                let second = &self.blocks[block][lane];
                add(simd, kernel, (px, py), [first, second], &mut sums);
            } else {
                add(simd, kernel, (px, py), [first], &mut sums);
            }
        }
        for (sums, plane) in sums.iter().zip(planes) {
            for (sum, rows) in sums.iter().zip(plane.as_chunks_mut::<TOGETHER>().0) {
                let (upper, lower) = sum.split();
                upper.store_slice(&mut rows[0][left..][..TILE_WIDTH]);
                lower.store_slice(&mut rows[1][left..][..TILE_WIDTH]);
            }
        }
    }
}

/// Adds splats, one after the other in every pixel: several at a time, so that sums which are not in
/// registers are loaded and stored less often.
#[cfg(feature = "std")]
#[inline(always)]
fn add<S: Simd, K: Weight, const CHANNELS: usize, const SPLATS: usize>(
    simd: S,
    kernel: K,
    (px, py): (f32x16<S>, f32x8<S>),
    splats: [&Splat; SPLATS],
    sums: &mut [[f32x16<S>; TILE_HEIGHT / TOGETHER]; CHANNELS],
) {
    let (mut columns, mut slants) = ([px; SPLATS], [px; SPLATS]);
    let mut shifts = [[0.0; TILE_HEIGHT]; SPLATS];
    for (index, splat) in splats.iter().enumerate() {
        let dx = px - splat.x;
        columns[index] = kernel.column(simd, dx * splat.i11);
        slants[index] = dx * splat.w;
        shifts[index] = ((py - splat.y) * splat.i22).to_array();
    }
    for rows in 0..TILE_HEIGHT / TOGETHER {
        let mut weights = [px; SPLATS];
        for index in 0..SPLATS {
            let upper = f32x8::splat(simd, shifts[index][TOGETHER * rows]);
            let lower = f32x8::splat(simd, shifts[index][TOGETHER * rows + 1]);
            let v = slants[index] + upper.combine(lower);
            weights[index] = kernel.weight(simd, columns[index], v);
        }
        for (channel, sums) in sums.iter_mut().enumerate() {
            let mut sum = sums[rows];
            for (weight, splat) in weights.iter().zip(splats) {
                sum += *weight * splat.color[channel];
            }
            sums[rows] = sum;
        }
    }
}

#[cfg(all(test, feature = "std"))]
mod tests {
    use core::cell::RefCell;

    use fearless_simd::Level;
    use proptest::prelude::*;
    use proptest::test_runner::TestRunner;

    use super::*;
    use crate::gaussian::Gaussian;
    use crate::render::splat::Splat;
    use crate::render::tile_grid::TILE_PIXELS;
    use crate::render::tile_lists::TileEntry;
    use crate::simd::LANES;
    use crate::testing::{config, simd_levels};

    /// How many values at a level have other bits than the reference's, and of how many.
    fn differing<const CHANNELS: usize>(
        level: Level,
        splats: &[Splat],
        origin: (u32, u32),
        kernel: Kernel,
    ) -> [usize; 2] {
        let blocks: Vec<Block> = (splats.chunks(LANES))
            .map(|splats| {
                let mut block = [Splat::NOWHERE; LANES];
                block[..splats.len()].copy_from_slice(splats);
                block
            })
            .collect();
        let groups: Vec<TileEntry> =
            (0..=blocks.len() as u32).map(|block| TileEntry { block, members: 0xffff }).collect();
        let members = TileSplats::new(&groups);
        let render = |backend: Backend| {
            let base = [0.5; CHANNELS];
            let mut planes = [[[0.0; PAIR_WIDTH]; TILE_HEIGHT]; CHANNELS];
            for half in 0..2 {
                let origin = (origin.0 + (half * TILE_WIDTH) as u32, origin.1);
                let tile = Tile { origin, base, blocks: &blocks, members, kernel };
                tile.render(backend, half, &mut planes);
            }
            planes.into_iter().flatten().flatten().map(f32::to_bits)
        };
        let pairs = render(Backend::Reference).zip(render(Backend::Simd(level)));
        [pairs.filter(|(a, b)| a != b).count(), 2 * CHANNELS * TILE_PIXELS]
    }

    /// Positive numbers from 2^low to 2^high, every power of two as likely.
    fn magnitude(low: i32, high: i32) -> impl Strategy<Value = f32> {
        (low..high, 1.0_f32..2.0).prop_map(|(exponent, part)| part * 2_f32.powi(exponent))
    }

    /// Splats of all shapes, the first pixel of a tile among or far from them, and a cut-off.
    fn scenes() -> impl Strategy<Value = (Vec<Splat>, (u32, u32), f32)> {
        let shapes = prop::collection::vec(
            (
                [-40.0_f32..80.0, -40.0_f32..80.0],
                magnitude(-12, 24),
                prop_oneof![Just(0.0), magnitude(-12, 24), magnitude(-12, 24).prop_map(|v| -v)],
                magnitude(-12, 24),
                prop::array::uniform4(-100.0_f32..100.0),
            ),
            1..12,
        );
        let cutoff = prop_oneof![Just(64.0_f32), Just(11.082_527), 0.001_f32..64.0];
        let far = prop_oneof![Just(0_u32), Just(1 << 22)];
        (shapes, (0_u32..4, 0_u32..8), far, cutoff).prop_map(|(shapes, tile, far, cutoff)| {
            let splats = shapes.into_iter().filter_map(|([x, y], l11, l21, l22, color)| {
                let center = [x + far as f32, y];
                let gaussian = Gaussian { center, cholesky: [l11, l21, l22], color };
                Splat::new(&gaussian)
            });
            let origin = (far + tile.0 * TILE_WIDTH as u32, tile.1 * TILE_HEIGHT as u32);
            (splats.collect(), origin, cutoff)
        })
    }

    #[test]
    fn every_simd_level_gives_the_bits_of_the_reference() {
        let levels = simd_levels();
        let totals = RefCell::new(vec![[0; 2]; levels.len()]);
        let outcome = TestRunner::new(config(200)).run(&scenes(), |(splats, origin, cutoff)| {
            for ((name, level), total) in levels.iter().zip(&mut *totals.borrow_mut()) {
                for kernel in [Kernel::Quartic, Kernel::Exponential { cutoff }] {
                    let counts = [
                        differing::<1>(*level, &splats, origin, kernel),
                        differing::<2>(*level, &splats, origin, kernel),
                        differing::<3>(*level, &splats, origin, kernel),
                        differing::<4>(*level, &splats, origin, kernel),
                    ];
                    for [differing, all] in counts {
                        total[0] += differing;
                        total[1] += all;
                        prop_assert_eq!(differing, 0, "{}, {:?}", name, kernel);
                    }
                }
            }
            Ok(())
        });
        // For the evaluation's report.
        for ((name, _), [differing, all]) in levels.iter().zip(totals.into_inner()) {
            println!("figure: simd rendering {name} {differing} {all}");
        }
        if let Err(error) = outcome {
            panic!("{error}");
        }
    }
}
