//! Which tiles a splat touches, or a few more: whether its weight is 0 is decided at every pixel.

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

// Constants: docs/tuning.md, "Layers and the decoder".
/// Width of a tile in pixels. Tiles of 16 pixels would take a quarter more kernel evaluations,
/// because more of them would give a weight of 0.
pub(crate) const TILE_WIDTH: usize = 8;
/// Width of a pair of tiles in pixels. The sums of a pair are converted to samples together.
pub(crate) const PAIR_WIDTH: usize = 2 * TILE_WIDTH;
/// Height of a tile in pixels.
pub(crate) const TILE_HEIGHT: usize = 8;
/// Pixels of a tile.
pub(crate) const TILE_PIXELS: usize = TILE_WIDTH * TILE_HEIGHT;

/// The tiles of a region, each with `WIDTH` x [`TILE_HEIGHT`] pixels.
#[derive(Clone, Copy, Debug)]
pub(crate) struct TileGrid<const WIDTH: usize> {
    region: Region,
    /// The number of tiles in a row.
    pub(crate) columns: usize,
    /// The number of rows of tiles.
    pub(crate) rows: usize,
}

/// Of sixteen splats, the column of the first tile of a row that each touches, and that of the tile
/// after the last. They are equal for a splat that touches none.
pub(crate) type Columns = [[u32; LANES]; 2];

impl<const WIDTH: usize> TileGrid<WIDTH> {
    /// The tiles of a region. The last ones along each axis may have fewer pixels in it.
    pub(crate) fn new(region: Region) -> Self {
        Self {
            region,
            columns: (region.width as usize).div_ceil(WIDTH),
            rows: (region.height as usize).div_ceil(TILE_HEIGHT),
        }
    }

    /// Finds the tiles that splats touch in a range of rows of tiles. For each block of splats, and
    /// each row that they may touch, calls `visit` with the index of the first splat of the block,
    /// the row and the tiles.
    #[cfg(feature = "encode")]
    pub(crate) fn columns_of(
        &self,
        level: Level,
        splats: &[Splat],
        cutoff: f32,
        rows: Range<usize>,
        mut visit: impl FnMut(usize, usize, &Columns),
    ) {
        dispatch!(level, simd => {
            for (block, splats) in splats.chunks(LANES).enumerate() {
                self.columns_with(
                    &ellipses_of(splats),
                    cutoff,
                    rows.clone(),
                    #[inline(always)]
                    |values| truncate_simd(simd, values),
                    |row, columns| visit(block * LANES, row, columns),
                );
            }
        });
    }

    /// Finds the tiles that ellipses touch in a range of rows of tiles. Calls `visit` with each row
    /// that they may touch, and the tiles.
    #[inline(always)]
    pub(super) fn columns_with(
        &self,
        ellipses: &Ellipses,
        cutoff: f32,
        rows: Range<usize>,
        truncate: impl Fn([f32; LANES]) -> [i32; LANES] + Copy,
        mut visit: impl FnMut(usize, &Columns),
    ) {
        let Region { x, y, width, height } = self.region;
        let footprints = Footprints::new(ellipses, cutoff);
        let [first_row, end_row] = tiles(footprints.rows(), y, height, TILE_HEIGHT, truncate);
        let lowest = first_row.into_iter().fold(i32::MAX, i32::min) as usize;
        let highest = end_row.into_iter().fold(0, i32::max) as usize;
        for row in rows.start.max(lowest)..rows.end.min(highest) {
            let top = y as f32 + (row * TILE_HEIGHT) as f32 + 0.5;
            let ends = footprints.columns(top, top + (TILE_HEIGHT - 1) as f32);
            let [first, end] = tiles(ends, x, width, WIDTH, truncate);
            let mut columns = [[0; LANES]; 2];
            for lane in 0..LANES {
                let touched = first_row[lane] <= row as i32 && (row as i32) < end_row[lane];
                let end = if touched { end[lane] } else { 0 };
                columns[0][lane] = first[lane].min(end) as u32;
                columns[1][lane] = end as u32;
            }
            visit(row, &columns);
        }
    }

    /// For each of at most sixteen Gaussians the rows of tiles that it may touch, and an upper
    /// bound of the number of tiles in any of these rows. There are none if it lies beside the region.
    pub(super) fn extents(
        &self,
        backend: Backend,
        gaussians: &[Gaussian],
        view: &View,
        cutoff: f32,
    ) -> [Extent; LANES] {
        match backend {
            Backend::Reference(_) => self.extents_with(gaussians, view, cutoff, truncate),
            #[cfg(feature = "std")]
            Backend::Simd(level) => dispatch!(level, simd => self.extents_with(
                gaussians,
                view,
                cutoff,
                #[inline(always)]
                |values| truncate_simd(simd, values),
            )),
        }
    }

    #[inline(always)]
    fn extents_with(
        &self,
        gaussians: &[Gaussian],
        view: &View,
        cutoff: f32,
        truncate: impl Fn([f32; LANES]) -> [i32; LANES],
    ) -> [Extent; LANES] {
        let mut ellipses = Ellipses::NOWHERE;
        for (lane, gaussian) in gaussians.iter().enumerate() {
            if gaussian.is_drawable() {
                ellipses.set(lane, gaussian, view);
            }
        }
        ellipses.widen(view);
        let footprints = Footprints::new(&ellipses, cutoff);
        let Region { x, y, width, height } = self.region;
        let [first, end] = tiles(footprints.rows(), y, height, TILE_HEIGHT, &truncate);
        let ends = footprints.columns(y as f32, (y + height) as f32);
        let [left, right] = tiles(ends, x, width, WIDTH, truncate);
        let widths = footprints.widest(TILE_HEIGHT as f32);
        let mut extents = [Extent::default(); LANES];
        for (lane, extent) in extents.iter_mut().enumerate() {
            // The cast saturates. Two tiles more than the width, since both ends may lie within a
            // tile.
            let columns = (widths[lane] * (1.0 / WIDTH as f32)) as u32;
            let within = (right[lane] - left[lane]).max(0) as u32;
            let columns = columns.saturating_add(2).min(within);
            // What lies beside the region has no rows.
            let end = if within == 0 { 0 } else { end[lane] as u32 };
            let first = first[lane] as u32;
            *extent = Extent { first: first.min(end), end, columns };
        }
        extents
    }
}

/// Bounds of the tiles that a splat touches.
#[derive(Clone, Copy, Debug, Default)]
pub(super) struct Extent {
    /// The first row of tiles, and the row after the last.
    pub(super) first: u32,
    pub(super) end: u32,
    /// An upper bound of the number of tiles in any row.
    pub(super) columns: u32,
}

/// For each lane, the tiles with pixel centres between `low` and `high` along an axis: the first,
/// and the one after the last, which is not larger if there are none. The tiles are `size` pixels
/// wide, and cover `length` pixels from `origin` on.
#[inline(always)]
fn tiles(
    [low, high]: [[f32; LANES]; 2],
    origin: u32,
    length: u32,
    size: usize,
    truncate: impl Fn([f32; LANES]) -> [i32; LANES],
) -> [[i32; LANES]; 2] {
    // The centre of pixel i is i + 0.5.
    let shift = origin as f32 + 0.5;
    let (length, one) = (length as f32, size as f32);
    // The first pixel is rounded up and the last one down. A margin of a quarter of a pixel is far
    // more than the rounding errors. The clamping leaves no tiles to a splat beyond either end.
    let mut first = low;
    let mut last = high;
    for lane in 0..LANES {
        first[lane] = smaller(larger(low[lane] - shift + 0.75, 0.0), length + one);
        last[lane] = smaller(larger(high[lane] - shift, -one), length - 1.0);
    }
    let (mut first, mut last) = (truncate(first), truncate(last));
    for lane in 0..LANES {
        first[lane] /= size as i32;
        last[lane] = last[lane].div_euclid(size as i32) + 1;
    }
    [first, last]
}

/// Converts numbers within the range of `i32` to integers, rounded towards zero.
pub(super) fn truncate(values: [f32; LANES]) -> [i32; LANES] {
    values.map(|value| value as i32)
}

/// [`truncate`] with SIMD.
#[cfg(feature = "std")]
#[inline(always)]
pub(super) fn truncate_simd<S: Simd>(simd: S, values: [f32; LANES]) -> [i32; LANES] {
    i32x16::truncate_from(f32x16::load_array(simd, values)).to_array()
}
