//! One tile of the output: splats added to a few hundred pixels that stay in the first cache
//! (spec, section 9.4).

use super::kernel::Kernel;
use super::splat::Splat;

/// Pixels per row of a tile: one AVX-512 register.
pub(crate) const TILE_WIDTH: usize = 16;
/// Rows of a tile.
pub(crate) const TILE_HEIGHT: usize = 8;
/// Pixels of a tile.
pub(crate) const TILE_PIXELS: usize = TILE_WIDTH * TILE_HEIGHT;

/// One channel of a tile, row by row.
pub(crate) type Plane = [[f32; TILE_WIDTH]; TILE_HEIGHT];

/// Which code adds splats to tiles. All give the same bits.
#[derive(Clone, Copy, Debug)]
pub(crate) enum Backend {
    /// Plain loops: the oracle, and all there is without `std`.
    Reference,
    /// Vector code at one of the levels that this machine has.
    #[cfg(feature = "std")]
    Simd(fearless_simd::Level),
}

impl Backend {
    pub(crate) fn reference() -> Self {
        Self::Reference
    }

    /// The best that this machine has.
    pub(crate) fn fastest() -> Self {
        #[cfg(feature = "std")]
        return Self::Simd(fearless_simd::Level::new());
        #[cfg(not(feature = "std"))]
        return Self::Reference;
    }

    /// Adds the listed splats, in order, to the planes of the tile whose first pixel is (x, y).
    pub(crate) fn add<const CHANNELS: usize>(
        self,
        planes: &mut [Plane; CHANNELS],
        (x, y): (u32, u32),
        splats: &[Splat],
        list: &[u32],
        kernel: Kernel,
    ) {
        match self {
            Self::Reference => add_reference(planes, (x, y), splats, list, kernel),
            #[cfg(feature = "std")]
            Self::Simd(level) => simd::add(level, planes, (x, y), splats, list, kernel),
        }
    }
}

fn add_reference<const CHANNELS: usize>(
    planes: &mut [Plane; CHANNELS],
    (x, y): (u32, u32),
    splats: &[Splat],
    list: &[u32],
    kernel: Kernel,
) {
    for &index in list {
        let splat = &splats[index as usize];
        for row in 0..TILE_HEIGHT {
            for column in 0..TILE_WIDTH {
                let px = (x as usize + column) as f32 + 0.5;
                let py = (y as usize + row) as f32 + 0.5;
                let weight = kernel.weight(splat.q(px, py));
                for (plane, color) in planes.iter_mut().zip(splat.color) {
                    plane[row][column] += color * weight;
                }
            }
        }
    }
}

#[cfg(feature = "encode")]
pub(crate) use simd::centers;

#[cfg(feature = "std")]
mod simd {
    use fearless_simd::{Level, Simd, dispatch, f32x16, prelude::*};

    use super::{Plane, TILE_HEIGHT};
    use crate::render::kernel::Kernel;
    use crate::render::kernel::simd::{Exponential, Quartic, Weight};
    use crate::render::splat::Splat;

    pub(super) fn add<const CHANNELS: usize>(
        level: Level,
        planes: &mut [Plane; CHANNELS],
        origin: (u32, u32),
        splats: &[Splat],
        list: &[u32],
        kernel: Kernel,
    ) {
        match kernel {
            Kernel::Exponential { cutoff } => {
                let kernel = Exponential { cutoff };
                dispatch!(level, simd => add_with(simd, planes, origin, splats, list, kernel));
            }
            Kernel::Quartic => {
                dispatch!(level, simd => add_with(simd, planes, origin, splats, list, Quartic));
            }
        }
    }

    /// The pixel centres of the sixteen columns from `x` on.
    #[inline(always)]
    pub(crate) fn centers<S: Simd>(simd: S, x: u32) -> f32x16<S> {
        f32x16::from_fn(simd, |column| (x as usize + column) as f32 + 0.5)
    }

    #[inline(always)]
    fn add_with<S: Simd, K: Weight, const CHANNELS: usize>(
        simd: S,
        planes: &mut [Plane; CHANNELS],
        (x, y): (u32, u32),
        splats: &[Splat],
        list: &[u32],
        kernel: K,
    ) {
        let px = centers(simd, x);
        let py: [f32; TILE_HEIGHT] = core::array::from_fn(|row| (y as usize + row) as f32 + 0.5);
        for &index in list {
            let splat = &splats[index as usize];
            let dx = px - splat.x;
            let u = dx * splat.i11;
            let (u2, slant) = (u * u, dx * splat.w);
            for row in 0..TILE_HEIGHT {
                let v = slant + splat.i22 * (py[row] - splat.y);
                let weight = kernel.weight(simd, u2 + v * v);
                for (plane, color) in planes.iter_mut().zip(splat.color) {
                    let sum = f32x16::load_array_ref(simd, &plane[row]) + weight * color;
                    sum.store_array(&mut plane[row]);
                }
            }
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
    use crate::render::view::{Region, View};
    use crate::testing::{config, simd_levels};

    /// How many values at a level have other bits than the reference's, and of how many.
    fn differing<const CHANNELS: usize>(
        level: Level,
        splats: &[Splat],
        origin: (u32, u32),
        kernel: Kernel,
    ) -> [usize; 2] {
        let list: Vec<u32> = (0..splats.len() as u32).collect();
        let render = |backend: Backend| {
            let mut planes = [[[0.5; TILE_WIDTH]; TILE_HEIGHT]; CHANNELS];
            backend.add(&mut planes, origin, splats, &list, kernel);
            planes.into_iter().flatten().flatten().map(f32::to_bits)
        };
        let pairs = render(Backend::Reference).zip(render(Backend::Simd(level)));
        [pairs.filter(|(a, b)| a != b).count(), CHANNELS * TILE_PIXELS]
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
            let region = Region { x: 0, y: 0, width: 64, height: 64 };
            let view = View::new((64, 64), (64, 64), region);
            let splats = shapes.into_iter().filter_map(|([x, y], l11, l21, l22, color)| {
                let center = [x + far as f32, y];
                Splat::new(&Gaussian { center, cholesky: [l11, l21, l22], color }, &view)
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
