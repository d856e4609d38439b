//! Which tiles a splat touches. A superset is harmless: the cut-off is tested per pixel.

use core::ops::Range;

#[cfg(feature = "encode")]
use fearless_simd::Level;
#[cfg(feature = "std")]
use fearless_simd::{Simd, dispatch, f32x16, i32x16, prelude::*};

use super::footprint::{Ellipses, Footprints, larger, smaller};
#[cfg(feature = "encode")]
use super::splat::{Splat, ellipses_of};
use super::view::View;
use crate::gaussian::Gaussian;
use crate::region::Region;
use crate::simd::{Backend, LANES};

/// Pixels per row of a tile. Wider ones would be evaluated in vain more often, by a quarter of the
/// work.
pub(crate) const TILE_WIDTH: usize = 8;
/// Pixels per row of two tiles, which become samples together.
pub(crate) const PAIR_WIDTH: usize = 2 * TILE_WIDTH;
/// Rows of a tile.
pub(crate) const TILE_HEIGHT: usize = 8;
/// Pixels of a tile.
pub(crate) const TILE_PIXELS: usize = TILE_WIDTH * TILE_HEIGHT;

/// The tiles of a region, each of `WIDTH` pixels by [`TILE_HEIGHT`].
#[derive(Clone, Copy, Debug)]
pub(crate) struct TileGrid<const WIDTH: usize> {
    region: Region,
    pub(crate) columns: usize,
    pub(crate) rows: usize,
}

/// Of several splats, the first tile of a row that each touches, and the one after the last: the
/// same where it touches none.
pub(crate) type Columns = [[u32; LANES]; 2];

impl<const WIDTH: usize> TileGrid<WIDTH> {
    pub(crate) fn new(region: Region) -> Self {
        Self {
            region,
            columns: (region.width as usize).div_ceil(WIDTH),
            rows: (region.height as usize).div_ceil(TILE_HEIGHT),
        }
    }

    /// Tells which tiles splats touch in some rows of tiles, if any: block by block of splats, the
    /// first of the block, and row by row.
    #[cfg(feature = "encode")]
    pub(crate) fn columns_of(
        &self,
        level: Level,
        splats: &[Splat],
        cutoff: f32,
        rows: Range<usize>,
        mut tell: impl FnMut(usize, usize, &Columns),
    ) {
        dispatch!(level, simd => {
            for (block, splats) in splats.chunks(LANES).enumerate() {
                self.columns_with(
                    &ellipses_of(splats),
                    cutoff,
                    rows.clone(),
                    #[inline(always)]
                    |values| truncated_at_once(simd, values),
                    |row, columns| tell(block * LANES, row, columns),
                );
            }
        });
    }

    /// Tells which tiles ellipses touch in some rows of tiles, row by row, if any.
    #[inline(always)]
    pub(super) fn columns_with(
        &self,
        ellipses: &Ellipses,
        cutoff: f32,
        rows: Range<usize>,
        truncated: impl Fn([f32; LANES]) -> [i32; LANES] + Copy,
        mut tell: impl FnMut(usize, &Columns),
    ) {
        let Region { x, y, width, height } = self.region;
        let footprints = Footprints::new(ellipses, cutoff);
        let [first_row, end_row] = tiles(footprints.rows(), y, height, TILE_HEIGHT, truncated);
        let lowest = first_row.into_iter().fold(i32::MAX, i32::min) as usize;
        let highest = end_row.into_iter().fold(0, i32::max) as usize;
        for row in rows.start.max(lowest)..rows.end.min(highest) {
            let top = y as f32 + (row * TILE_HEIGHT) as f32 + 0.5;
            let ends = footprints.columns(top, top + (TILE_HEIGHT - 1) as f32);
            let [first, end] = tiles(ends, x, width, WIDTH, truncated);
            let mut columns = [[0; LANES]; 2];
            for lane in 0..LANES {
                let touched = first_row[lane] <= row as i32 && (row as i32) < end_row[lane];
                let end = if touched { end[lane] } else { 0 };
                columns[0][lane] = first[lane].min(end) as u32;
                columns[1][lane] = end as u32;
            }
            tell(row, &columns);
        }
    }

    /// Tells of each of at most so many Gaussians, in order, which rows of tiles it touches, and at
    /// least how many tiles in any of them.
    pub(super) fn extents(
        &self,
        backend: Backend,
        gaussians: &[Gaussian],
        view: &View,
        cutoff: f32,
    ) -> [Extent; LANES] {
        match backend {
            Backend::Reference => self.extents_with(gaussians, view, cutoff, truncated),
            #[cfg(feature = "std")]
            Backend::Simd(level) => dispatch!(level, simd => self.extents_with(
                gaussians,
                view,
                cutoff,
                #[inline(always)]
                |values| truncated_at_once(simd, values),
            )),
        }
    }

    #[inline(always)]
    fn extents_with(
        &self,
        gaussians: &[Gaussian],
        view: &View,
        cutoff: f32,
        truncated: impl Fn([f32; LANES]) -> [i32; LANES],
    ) -> [Extent; LANES] {
        let mut ellipses = Ellipses::NOWHERE;
        for (lane, gaussian) in gaussians.iter().enumerate() {
            if gaussian.is_drawable() {
                ellipses.set(lane, gaussian, view);
            }
        }
        ellipses.widen(view);
        let footprints = Footprints::new(&ellipses, cutoff);
        let [first, end] =
            tiles(footprints.rows(), self.region.y, self.region.height, TILE_HEIGHT, truncated);
        let widths = footprints.widest(TILE_HEIGHT as f32);
        let mut extents = [Extent::default(); LANES];
        for (lane, extent) in extents.iter_mut().enumerate() {
            // Casts saturate; both ends may lie within a tile.
            let columns = (widths[lane] * (1.0 / WIDTH as f32)) as u32;
            let columns = columns.saturating_add(2).min(self.columns as u32);
            let (first, end) = (first[lane] as u32, end[lane] as u32);
            *extent = Extent { first: first.min(end), end, columns };
        }
        extents
    }
}

/// What a splat touches.
#[derive(Clone, Copy, Debug, Default)]
pub(super) struct Extent {
    /// The first row of tiles, and the one after the last.
    pub(super) first: u32,
    pub(super) end: u32,
    /// At most so many tiles in any row.
    pub(super) columns: u32,
}

/// The tiles whose pixel centres may lie between each of `low` and `high`, out of those that cover
/// `length` pixels from `origin` on: the first, and the one after the last. None if that is not
/// larger.
#[inline(always)]
fn tiles(
    [low, high]: [[f32; LANES]; 2],
    origin: u32,
    length: u32,
    size: usize,
    truncated: impl Fn([f32; LANES]) -> [i32; LANES],
) -> [[i32; LANES]; 2] {
    // Pixel i has its centre at i + 0.5.
    let shift = origin as f32 + 0.5;
    let (length, one) = (length as f32, size as f32);
    // Rounded up, but for a quarter of a pixel, which is far more than what rounding loses; the
    // last pixel is rounded down. What lies beyond either end begins after it ends.
    let mut first = low;
    let mut last = high;
    for lane in 0..LANES {
        first[lane] = smaller(larger(low[lane] - shift + 0.75, 0.0), length + one);
        last[lane] = smaller(larger(high[lane] - shift, -one), length - 1.0);
    }
    let (mut first, mut last) = (truncated(first), truncated(last));
    for lane in 0..LANES {
        first[lane] /= size as i32;
        last[lane] = last[lane].div_euclid(size as i32) + 1;
    }
    [first, last]
}

/// Integers from numbers that are near enough to zero, rounded towards it.
pub(super) fn truncated(values: [f32; LANES]) -> [i32; LANES] {
    values.map(|value| value as i32)
}

/// [`truncated`], all at once.
#[cfg(feature = "std")]
#[inline(always)]
pub(super) fn truncated_at_once<S: Simd>(simd: S, values: [f32; LANES]) -> [i32; LANES] {
    i32x16::truncate_from(f32x16::load_array(simd, values)).to_array()
}
