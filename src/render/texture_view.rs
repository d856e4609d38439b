//! The texture of an output: that of the stored pixels, and where the grid is finer, a cubic interpolation
//! of it (spec, section 9.7).

use alloc::vec::Vec;
use core::ops::Range;

#[cfg(all(feature = "std", not(any(target_arch = "x86", target_arch = "x86_64"))))]
use fearless_simd::dispatch;

use super::tile::TileTexture;
use super::tile_grid::{PAIR_WIDTH, TILE_HEIGHT, TILE_WIDTH};
use super::view::View;
use crate::error::DecodeError;
use crate::region::Region;
use crate::simd::Backend;
#[cfg(feature = "std")]
use crate::texture::Vectors;
use crate::texture::{Arithmetic, CELL, NodeMap, Plain, Synthesis};

/// Points of a cubic interpolation.
const TAPS: usize = 4;

/// The texture of a picture, as an output needs it.
#[derive(Debug)]
pub(super) struct TextureView {
    map: NodeMap,
    /// The columns of cells that the output needs.
    cells: Range<i32>,
    rows: Sampling,
    /// The columns of the grid, and its first row.
    grid: Range<u32>,
    top: u32,
    /// For each of them the first of its taps, counted from the first pixel of the cells, and their weights;
    /// `None` where the columns of the grid are those of the stored pixels.
    taps: Option<Vec<(u32, [f32; TAPS])>>,
}

/// How the pixels of a grid along an axis follow from the stored ones.
#[derive(Clone, Copy, Debug)]
enum Sampling {
    /// They are the same.
    Stored,
    /// There are more of them.
    Cubic(Cubic),
}

/// An interpolation. The sides are in pixels.
#[derive(Clone, Copy, Debug)]
struct Cubic {
    stored: u32,
    grid: u32,
}

impl TextureView {
    /// The texture of a view, with the sides of the picture and of its map; `None` where it does not show.
    /// `render` gives the sums of the map at some of its nodes: channels x height x width.
    ///
    /// # Errors
    /// Those of `render`.
    pub(super) fn new(
        sides: [u32; 2],
        map_sides: [u32; 2],
        view: &View,
        render: impl FnOnce(Region) -> Result<Vec<f32>, DecodeError>,
    ) -> Result<Option<Self>, DecodeError> {
        let scales = [0, 1].map(|axis| view.axes[axis].output() as f32 / sides[axis] as f32);
        let fade = (8.0 * scales[0].min(scales[1]) - 1.0).clamp(0.0, 1.0);
        if fade <= 0.0 {
            return Ok(None);
        }
        let [columns, rows] = [0, 1].map(|axis| {
            let (stored, grid) = (sides[axis], view.axes[axis].grid());
            if grid > stored { Sampling::Cubic(Cubic { stored, grid }) } else { Sampling::Stored }
        });
        let Region { x, y, width, height } = view.region;
        let grid = x..x + width;
        // The last tile may have columns that are not in the region.
        let cells = columns.cells(x..x + width.next_multiple_of(TILE_WIDTH as u32));
        let nodes = |cells: &Range<i32>, side: u32| {
            let last = side as i32 - 1;
            (cells.start - 1).clamp(0, last) as u32..(cells.end + 1).clamp(0, last) as u32 + 1
        };
        let across = nodes(&cells, map_sides[0]);
        let down = nodes(&rows.cells(y..y + height), map_sides[1]);
        let nodes = Region {
            x: across.start,
            y: down.start,
            width: across.end - across.start,
            height: down.end - down.start,
        };
        let map = NodeMap::new(nodes, render(nodes)?, fade);
        let taps = match columns {
            Sampling::Stored => None,
            Sampling::Cubic(cubic) => {
                let taps = grid.clone().map(|column| {
                    let (first, weights) = cubic.taps(column);
                    ((first - cells.start * CELL as i32) as u32, weights)
                });
                Some(taps.collect())
            }
        };
        Ok(Some(Self { map, cells, rows, grid, top: y, taps }))
    }

    /// Bytes of memory that it holds, and that each thread needs.
    pub(super) fn memory(&self) -> (u64, u64) {
        let taps = self.taps.as_ref().map_or(0, |taps| size_of_val(&taps[..]));
        let values =
            self.cell_rows() * CELL * self.width() + self.width() + TILE_HEIGHT * self.stride();
        let by_thread = values * size_of::<f32>() + Synthesis::memory(self.cells.len());
        (self.map.memory() + taps as u64, by_thread as u64)
    }

    /// Rows of cells that a row of tiles may need.
    fn cell_rows(&self) -> usize {
        match self.rows {
            Sampling::Stored if self.top.is_multiple_of(CELL as u32) => 1,
            Sampling::Stored => 2,
            // Eleven rows of pixels.
            Sampling::Cubic(_) => 3,
        }
    }

    /// Whether rows of tiles are rows of cells.
    fn is_of_cells(&self) -> bool {
        self.taps.is_none() && self.cell_rows() == 1
    }

    /// Stored pixels in a row of the cells, and some more.
    fn width(&self) -> usize {
        Synthesis::width(self.cells.len())
    }

    /// Values in a row of the grid, which ends with a whole pair of tiles.
    fn stride(&self) -> usize {
        self.grid.len().next_multiple_of(PAIR_WIDTH)
    }
}

impl Sampling {
    /// The stored pixels that those of the grid need, and by them the cells.
    fn cells(self, grid: Range<u32>) -> Range<i32> {
        let pixels = self.stored(grid);
        pixels.start.div_euclid(CELL as i32)..(pixels.end - 1).div_euclid(CELL as i32) + 1
    }

    fn stored(self, grid: Range<u32>) -> Range<i32> {
        match self {
            Self::Stored => grid.start as i32..grid.end as i32,
            Self::Cubic(cubic) => {
                cubic.taps(grid.start).0..cubic.taps(grid.end - 1).0 + TAPS as i32
            }
        }
    }
}

impl Cubic {
    /// The first of the stored pixels that a pixel of the grid is interpolated from, and the weights of
    /// Catmull and Rom.
    fn taps(self, pixel: u32) -> (i32, [f32; TAPS]) {
        let (stored, grid) = (i64::from(self.stored), i64::from(self.grid));
        let place = (2 * i64::from(pixel) + 1) * stored - grid;
        let t = place.rem_euclid(2 * grid) as f32 / (2 * grid) as f32;
        let weights = [
            ((1.0 - 0.5 * t) * t - 0.5) * t,
            (1.5 * t - 2.5) * t * t + 1.0,
            ((2.0 - 1.5 * t) * t + 0.5) * t,
            (0.5 * t - 0.5) * t * t,
        ];
        (place.div_euclid(2 * grid) as i32 - 1, weights)
    }
}

/// The texture of a row of tiles, and what a thread needs to make it.
#[derive(Debug, Default)]
pub(super) struct TextureRow {
    /// Made with the first row: only pictures with texture have it.
    synthesis: Option<Synthesis>,
    /// Rows of cells, each in the place that its number has by the remainder.
    cells: Vec<CellRow>,
    /// A row of stored pixels between rows.
    mixed: Vec<f32>,
    /// [`TILE_HEIGHT`] rows of the grid, unless they are those of a row of cells.
    values: Vec<f32>,
}

/// The texture of a row of cells, as long as it is needed.
#[derive(Debug, Default)]
struct CellRow {
    row: Option<i32>,
    shows: bool,
    /// [`CELL`] rows of values.
    values: Vec<f32>,
}

impl TextureRow {
    /// Makes the texture of the row of tiles whose first row of the grid is `top`; `None` if there is none.
    pub(super) fn prepare<'a>(
        &'a mut self,
        view: &TextureView,
        backend: Backend,
        top: u32,
    ) -> Option<TileTexture<'a>> {
        match backend {
            // The code is long, so it is compiled for few levels: the others of x86 are near to the plain code.
            #[cfg(all(feature = "std", any(target_arch = "x86", target_arch = "x86_64")))]
            Backend::Simd(level) => match (level.as_avx512(), level.as_avx2()) {
                (Some(avx512), _) => self.prepare_with(view, top, Vectors(avx512)),
                (_, Some(avx2)) => self.prepare_with(view, top, Vectors(avx2)),
                _ => self.prepare_with(view, top, Plain),
            },
            #[cfg(all(feature = "std", not(any(target_arch = "x86", target_arch = "x86_64"))))]
            Backend::Simd(level) => {
                dispatch!(level, simd => self.prepare_with(view, top, Vectors(simd)))
            }
            Backend::Reference(_) => self.prepare_with(view, top, Plain),
        }
    }

    fn prepare_with<'a>(
        &'a mut self,
        view: &TextureView,
        top: u32,
        arithmetic: impl Arithmetic,
    ) -> Option<TileTexture<'a>> {
        let grid = top..top + TILE_HEIGHT as u32;
        let width = view.width();
        self.cells.resize_with(view.cell_rows(), CellRow::default);
        let place = |row: i32| row.rem_euclid(view.cell_rows() as i32) as usize;
        let synthesis = self.synthesis.get_or_insert_default();
        let mut shows = false;
        for row in view.rows.cells(grid.clone()) {
            let cells = &mut self.cells[place(row)];
            if cells.row != Some(row) {
                cells.row = Some(row);
                cells.values.resize(width * CELL, 0.0);
                let values = &mut cells.values;
                cells.shows = synthesis.make(&view.map, row, &view.cells, values, arithmetic);
            }
            shows |= cells.shows;
        }
        if !shows {
            return None;
        }
        let first = (view.grid.start as i32 - view.cells.start * CELL as i32) as usize;
        if view.is_of_cells() {
            let values = &self.cells[place((top / CELL as u32) as i32)].values[first..];
            return Some(TileTexture { values, stride: width });
        }
        let stride = view.stride();
        self.values.resize(stride * TILE_HEIGHT, 0.0);
        self.mixed.resize(width, 0.0);
        let stored = |row: i32| {
            let cells = &self.cells[place(row.div_euclid(CELL as i32))];
            &cells.values[row.rem_euclid(CELL as i32) as usize * width..][..width]
        };
        for (row, line) in grid.zip(self.values.chunks_exact_mut(stride)) {
            let values = match view.rows {
                Sampling::Stored => stored(row as i32),
                Sampling::Cubic(cubic) => {
                    let (first, weights) = cubic.taps(row);
                    let rows = [0, 1, 2, 3].map(|tap| stored(first + tap));
                    for (column, mixed) in self.mixed.iter_mut().enumerate() {
                        *mixed = interpolated(rows.map(|row| row[column]), weights);
                    }
                    &self.mixed[..]
                }
            };
            let line = &mut line[..view.grid.len()];
            match &view.taps {
                None => line.copy_from_slice(&values[first..][..view.grid.len()]),
                Some(taps) => {
                    for (value, &(first, weights)) in line.iter_mut().zip(taps) {
                        let taps = values[first as usize..].first_chunk();
                        *value = interpolated(*taps.expect("the cells hold all taps"), weights);
                    }
                }
            }
        }
        Some(TileTexture { values: &self.values, stride })
    }
}

#[inline(always)]
fn interpolated(values: [f32; TAPS], weights: [f32; TAPS]) -> f32 {
    let [a, b, c, d] = core::array::from_fn(|tap| values[tap] * weights[tap]);
    ((a + b) + c) + d
}

#[cfg(all(test, feature = "std"))]
mod tests {
    use proptest::prelude::*;

    use super::*;
    use crate::kernel::Kernel;
    use crate::testing::{config, simd_levels};

    /// A picture's sides, those of an output, and a region of it.
    fn outputs() -> impl Strategy<Value = ((u32, u32), (u32, u32), Region)> {
        let sides = |most: u32| (1..most, 1..most);
        (sides(300), sides(400)).prop_flat_map(|(stored, output)| {
            let part = |side: u32| (0..side).prop_flat_map(move |at| (Just(at), 1..=side - at));
            (part(output.0), part(output.1)).prop_map(move |((x, width), (y, height))| {
                (stored, output, Region { x, y, width, height })
            })
        })
    }

    proptest! {
        #![proptest_config(config(60))]

        #[test]
        fn every_simd_level_gives_the_bits_of_the_scalar_code(
            (stored, output, region) in outputs(),
            values in prop::collection::vec(0.0_f32..1.0, 97),
        ) {
            let view = View::new(stored, output, region, Kernel::Quartic);
            let map_sides = [stored.0, stored.1].map(|side| side.div_ceil(CELL as u32) + 1);
            let texture = TextureView::new([stored.0, stored.1], map_sides, &view, |nodes| {
                // A node in four has texture, and directions have all values.
                let count = nodes.pixels() as usize;
                let sums = (0..4 * count).zip(values.iter().cycle()).map(|(at, value)| {
                    if at < 3 * count { (4.0 * value - 3.0) * 0.3 } else { *value }
                });
                Ok(sums.collect())
            });
            if let Some(texture) = texture.expect("the map has no limits") {
                for top in (view.region.y..view.region.y + view.region.height).step_by(TILE_HEIGHT) {
                    let bits = |backend| {
                        let mut row = TextureRow::default();
                        let tiles = row.prepare(&texture, backend, top)?;
                        let values = tiles.values.chunks(tiles.stride).take(TILE_HEIGHT);
                        let width = view.region.width as usize;
                        let values = values.flat_map(|line| &line[..width.min(line.len())]);
                        Some(values.map(|value| value.to_bits()).collect::<Vec<_>>())
                    };
                    let expected = bits(Backend::reference());
                    for (name, level) in simd_levels() {
                        prop_assert_eq!(bits(Backend::Simd(level)), expected.clone(), "{}", name);
                    }
                }
            }
        }
    }
}
