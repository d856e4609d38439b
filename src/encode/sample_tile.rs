//! The samples of a tile of the training pass.

use fearless_simd::{Simd, f32x16, i32x16, prelude::*, u8x16, u16x16};

use crate::render::tile_grid::TILE_HEIGHT;

/// Width in pixels of a tile of the training pass, twice that of the decoder's tiles: every splat
/// of a tile costs a reduction of its gradient sums, and wider tiles need fewer reductions.
pub(crate) const TILE_WIDTH: usize = 16;

/// One channel of a tile, row by row.
pub(crate) type TilePlane = [[f32; TILE_WIDTH]; TILE_HEIGHT];
/// One channel of the source in a tile, row by row, in the source's depth.
pub(crate) type SamplePlane<T> = [[T; TILE_WIDTH]; TILE_HEIGHT];
/// The value of a full sample, of either depth.
pub(crate) const FULL_SCALE: f32 = 65535.0;
/// The factor from 8-bit samples to that scale.
pub(crate) const OF_EIGHT: u16 = 257;

/// All channels of a tile of the source.
#[derive(Clone, Copy, Debug)]
pub(crate) enum SampleTile<'a, const CHANNELS: usize> {
    Eight(&'a [SamplePlane<u8>; CHANNELS]),
    Sixteen(&'a [SamplePlane<u16>; CHANNELS]),
}

impl<'a, const CHANNELS: usize> SampleTile<'a, CHANNELS> {
    #[inline(always)]
    pub(crate) fn line(&self, channel: usize, row: usize) -> SampleLine<'a> {
        match self {
            Self::Eight(planes) => SampleLine::Eight(&planes[channel][row]),
            Self::Sixteen(planes) => SampleLine::Sixteen(&planes[channel][row]),
        }
    }
}

/// A row of one channel of a tile of the source.
#[derive(Clone, Copy, Debug)]
pub(crate) enum SampleLine<'a> {
    Eight(&'a [u8; TILE_WIDTH]),
    Sixteen(&'a [u16; TILE_WIDTH]),
}

impl SampleLine<'_> {
    /// The samples, where a full one is [`FULL_SCALE`].
    #[inline(always)]
    pub(crate) fn load<S: Simd>(self, simd: S) -> f32x16<S> {
        match self {
            Self::Eight(samples) => {
                let (low, high) = u8x16::load_array_ref(simd, samples).widen();
                floats(low.combine(high)) * f32::from(OF_EIGHT)
            }
            Self::Sixteen(samples) => floats(u16x16::load_array_ref(simd, samples)),
        }
    }
}

#[inline(always)]
fn floats<S: Simd>(samples: u16x16<S>) -> f32x16<S> {
    let (low, high) = samples.widen();
    // Most machines convert signed integers only.
    low.combine(high).bitcast::<i32x16<S>>().to_float()
}

/// 1 in so many of the sixteen columns, which are inside the picture, and 0 in the others.
#[inline(always)]
pub(crate) fn inside<S: Simd>(simd: S, columns: usize) -> f32x16<S> {
    let (zero, one) = (f32x16::splat(simd, 0.0), f32x16::splat(simd, 1.0));
    centers(simd, 0).simd_lt(columns as f32).select(one, zero)
}

/// The pixel centres of the sixteen columns from `x` on.
#[inline(always)]
pub(crate) fn centers<S: Simd>(simd: S, x: u32) -> f32x16<S> {
    f32x16::from_fn(simd, |column| column as f32 + 0.5) + x as f32
}
