//! One tile of the output: splats added to a few hundred pixels that stay in the first cache.

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
