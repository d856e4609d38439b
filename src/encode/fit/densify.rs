//! Distortion-driven densification, D3: the positions, shapes and colours of new Gaussians (paper,
//! section "Distortion Driven Densification"; the variance of their shapes: section "Content Aware
//! Gaussian Filters").

use super::components::{Bounds, Components};
use super::custom_placement::ErrorMap;
use super::paper;
use super::pass::{Pass, Scene};
use super::training::{Densification, GaussianFilter, NewColor, NewShape, Placement};
use crate::encode::error::Result;
use crate::encode::progress::Observer;
use crate::encode::sample_tile::{TILE_WIDTH, TilePlane};
use crate::encode::tiled_source::TiledSource;
use crate::render::tile_grid::TILE_HEIGHT;

// Constants: docs/tuning.md, "Growth".
/// Gaussians whose colour is below this magnitude in every channel, where a full sample is 1, are
/// pruned: a 16th of the quantization step of 8 bits.
pub(crate) const MIN_COLOR: f32 = 1.0 / 4096.0;
/// How much the new Gaussians of a tile may overlap, as a multiple of what they would if all were spread
/// evenly. Those that are placed at the same time see the same residuals. If too many of them overlap, their
/// steps together go too far: the error of the tile rises, and it gets most of the next Gaussians, too.
const MOST_OVERLAP: f64 = 3.0;
/// Most new Gaussians of a tile at a time, about one for ten pixels; or, where that is more,
const MOST_AT_ONCE: f64 = 12.0;
/// as a factor on the average over the tiles.
const MOST_OF_AVERAGE: f64 = 4.0;

/// The position of a new Gaussian.
#[derive(Clone, Copy, Debug, PartialEq)]
struct NewPosition {
    /// Index of the pixel that is its centre.
    pixel: u32,
    /// Its variance as a share of the filter's, in (0, 1]. Where a small part of a picture has
    /// nearly all of the error, hundreds of Gaussians with the full variance would overlap
    /// there, take steps in the same direction, and never converge.
    variance_share: f32,
    /// The negative residual of each channel ([`Pass::residuals`]); 0 with [`Placement::Top`].
    missing: [f32; 4],
}

/// The errors of a tile, by which new Gaussians are placed.
struct TileErrors {
    errors: TilePlane,
    /// One plane per channel.
    residuals: Vec<TilePlane>,
}

impl TileErrors {
    /// The negative residuals at a pixel of the tile; 0 for absent channels.
    fn missing(&self, x: usize, y: usize) -> [f32; 4] {
        core::array::from_fn(|channel| {
            self.residuals.get(channel).map_or(0.0, |plane| -plane[y][x])
        })
    }
}

/// What the positions, shapes and colours of new Gaussians depend on.
#[derive(Debug)]
pub(crate) struct Densifier<'a> {
    pub(crate) options: &'a Densification,
    pub(crate) filter: GaussianFilter,
    /// The last pass over the picture, which measured the placement errors.
    pub(crate) pass: &'a Pass,
    /// What it rendered.
    pub(crate) scene: Scene<'a>,
    pub(crate) bounds: Bounds,
    /// Number of Gaussians before, without those that new ones replace.
    pub(crate) count: usize,
}

impl Densifier<'_> {
    /// Up to `count` new Gaussians where the error is large. There are fewer where fewer
    /// pixels have any error.
    pub(crate) fn new_gaussians(
        &self,
        count: usize,
        rng: &mut fastrand::Rng,
        observer: &mut Observer<'_>,
    ) -> Result<Vec<Components>> {
        let tiled = self.scene.tiled;
        let positions = match &self.options.placement {
            Placement::Top => {
                let pixels = paper::largest(count, &self.error_map(observer)?.errors);
                let position =
                    |pixel| NewPosition { pixel, variance_share: 1.0, missing: [0.0; 4] };
                pixels.into_iter().map(position).collect()
            }
            Placement::Custom(placement) => {
                let map = self.error_map(observer)?;
                let position = |pixel: u32| {
                    let missing = map.missing[pixel as usize];
                    NewPosition { pixel, variance_share: 1.0, missing }
                };
                map.chosen(&**placement, count).into_iter().map(position).collect()
            }
            Placement::Spread => {
                let (grid, sums) = (self.tile_grid(), self.pass.placement_errors());
                let tiles = |tile| self.errors(tile);
                spread(count, tiled.width, grid, rng.f64(), sums, tiles, observer)?
            }
        };
        let total = self.count + positions.len();
        let variance = self
            .filter
            .variance(tiled.pixels(), total)
            .expect("`Training::check` accepted the filter");
        Ok(positions.iter().map(|at| self.new_gaussian(at, variance, rng)).collect())
    }

    /// A new Gaussian, where `variance` is the filter's.
    fn new_gaussian(
        &self,
        position: &NewPosition,
        variance: f32,
        rng: &mut fastrand::Rng,
    ) -> Components {
        let variance = variance * position.variance_share;
        let tiled = self.scene.tiled;
        let (x, y) = (position.pixel as usize % tiled.width, position.pixel as usize / tiled.width);
        let parameterization = self.bounds.parameterization;
        let shape = match self.options.shape {
            NewShape::Point => parameterization.shape_of([variance.sqrt(), 0.0, variance.sqrt()]),
            NewShape::Random => paper::random_shape(parameterization, variance, rng),
        };
        let center = [x as f32 + 0.5, y as f32 + 0.5];
        let color = match self.options.color {
            NewColor::Zero => [0.0; 4],
            NewColor::Residual(share) => {
                let weight = tiled.loss.weight_at(x, y);
                position.missing.map(|missing| share * missing / weight)
            }
        };
        self.bounds.clamped(Components { center, shape, color })
    }

    /// Numbers of columns and rows of tiles.
    fn tile_grid(&self) -> [usize; 2] {
        let TiledSource { width, height, .. } = self.scene.tiled;
        [width.div_ceil(TILE_WIDTH), height.div_ceil(TILE_HEIGHT)]
    }

    /// The errors of all pixels.
    fn error_map(&self, observer: &mut Observer<'_>) -> Result<ErrorMap> {
        let TiledSource { width, height, .. } = *self.scene.tiled;
        let [columns, _] = self.tile_grid();
        let (mut errors, mut missing) = (vec![0.0; width * height], vec![[0.0; 4]; width * height]);
        let lines = TILE_HEIGHT * width;
        let rows = errors.chunks_mut(lines).zip(missing.chunks_mut(lines)).enumerate();
        observer.map(rows, |(row, (errors, missing))| {
            for column in 0..columns {
                let tile = self.errors(row * columns + column);
                let left = column * TILE_WIDTH;
                for y in 0..errors.len() / width {
                    for x in 0..TILE_WIDTH.min(width - left) {
                        errors[y * width + left + x] = tile.errors[y][x];
                        missing[y * width + left + x] = tile.missing(x, y);
                    }
                }
            }
        })?;
        Ok(ErrorMap { width, height, errors, missing })
    }

    /// The error of every pixel of a tile, and the residuals.
    fn errors(&self, tile: usize) -> TileErrors {
        let [columns, _] = self.tile_grid();
        let corner = [tile % columns * TILE_WIDTH, tile / columns * TILE_HEIGHT];
        let residuals = self.pass.residuals(&self.scene, tile);
        let loss = &self.scene.tiled.loss;
        let errors =
            loss.placement_errors(self.pass.level, corner, &residuals, self.options.error_norm);
        TileErrors { errors, residuals }
    }
}

/// [`Placement::Spread`]: up to `count` pixels, whose density is proportional to the error.
/// They lie at equal steps of the errors' sum along a Z curve of tiles; `phase`, in [0, 1),
/// shifts all of them by a part of a step.
///
/// Where a tile has r times the mean error, and r is more than 1, each new Gaussian has 1/r of
/// the area that it would have on average. Its variance is smaller by the square root of r: they
/// overlap, but they converge, up to [`MOST_OVERLAP`]. A variance smaller by r itself is too small to grow
/// in a short run.
///
/// Of a tile with more than its due, only a part counts, so there may be fewer than `count`.
fn spread(
    count: usize,
    width: usize,
    [columns, rows]: [usize; 2],
    phase: f64,
    sums: &[f32],
    errors: impl Fn(usize) -> TileErrors + Send + Sync,
    observer: &mut Observer<'_>,
) -> Result<Vec<NewPosition>> {
    let total: f64 = sums.iter().copied().map(f64::from).sum();
    let (step, mean) = (total / count as f64, total / sums.len() as f64);
    let average = count as f64 / sums.len() as f64;
    let most = step * MOST_AT_ONCE.max(MOST_OF_AVERAGE * average);
    // The part of a tile's error that counts.
    let counted = |tile: usize| (most / f64::from(sums[tile])).min(1.0);
    // The tiles that contain a step, with the sum of all tiles before, and the first step in them.
    let mut found: Vec<(usize, f64, f64)> = Vec::new();
    let mut sum = 0.0;
    along_z([0, 0], [columns, rows], &mut |column, row| {
        let tile = row * columns + column;
        let end = sum + f64::from(sums[tile]).min(most);
        let next = ((sum / step - phase).ceil() + phase) * step;
        if end > next {
            found.push((tile, sum, next));
        }
        sum = end;
    });
    let positions = observer.map(found.into_iter(), |(tile, mut sum, mut next)| {
        let ratio = (mean / f64::from(sums[tile])).min(1.0);
        let variance_share = ratio.sqrt().min(MOST_OVERLAP * ratio) as f32;
        let first = tile / columns * TILE_HEIGHT * width + tile % columns * TILE_WIDTH;
        let mut positions = Vec::new();
        let (errors, counted) = (errors(tile), counted(tile));
        for (y, line) in errors.errors.iter().enumerate() {
            let end = sum + counted * sum_of(line);
            // Few lines contain a step.
            if end > next {
                for (x, &value) in line.iter().enumerate() {
                    sum += counted * f64::from(value);
                    // Pixels that are exact or outside the picture have no error.
                    if sum > next && value > 0.0 {
                        let pixel = (first + y * width + x) as u32;
                        let missing = errors.missing(x, y);
                        positions.push(NewPosition { pixel, variance_share, missing });
                        // A pixel that contains several steps gets one Gaussian.
                        next += step * ((sum - next) / step).ceil();
                    }
                }
            }
            sum = end;
        }
        positions
    })?;
    Ok(positions.concat())
}

/// The sum of a line of a tile, in four parts that are added up at the same time.
fn sum_of(line: &[f32; TILE_WIDTH]) -> f64 {
    let mut parts = [0.0; 4];
    for values in line.as_chunks::<4>().0 {
        for (part, &value) in parts.iter_mut().zip(values) {
            *part += f64::from(value);
        }
    }
    (parts[0] + parts[1]) + (parts[2] + parts[3])
}

/// Visits the points of a rectangle along a Z curve, on which neighbours follow each other closely.
fn along_z([x, y]: [usize; 2], [width, height]: [usize; 2], visit: &mut impl FnMut(usize, usize)) {
    if width.max(height) <= 1 {
        if width.min(height) == 1 {
            visit(x, y);
        }
    } else if width > height {
        let half = width / 2;
        along_z([x, y], [half, height], visit);
        along_z([x + half, y], [width - half, height], visit);
    } else {
        let half = height / 2;
        along_z([x, y], [width, half], visit);
        along_z([x, y + half], [width, height - half], visit);
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::encode::progress::unobserved;

    fn pixels(positions: &[NewPosition]) -> Vec<u32> {
        positions.iter().map(|position| position.pixel).collect()
    }

    /// [`super::spread`], with the sums that it needs.
    fn spread(
        count: usize,
        width: usize,
        grid: [usize; 2],
        phase: f64,
        tiles: impl Fn(usize) -> TilePlane + Send + Sync,
    ) -> Vec<NewPosition> {
        let sum_of = |tile| tiles(tile).as_flattened().iter().sum();
        let sums: Vec<f32> = (0..grid[0] * grid[1]).map(sum_of).collect();
        let errors = |tile| TileErrors { errors: tiles(tile), residuals: Vec::new() };
        unobserved(|observer| super::spread(count, width, grid, phase, &sums, errors, observer))
    }

    /// A tile whose errors depend on the picture's column alone.
    fn tile_of(column: usize, value: impl Fn(usize) -> f32) -> TilePlane {
        [core::array::from_fn(|x| value(column * TILE_WIDTH + x)); TILE_HEIGHT]
    }

    #[test]
    fn spread_pixels_follow_the_errors() {
        // The right half has three times the error of the left one.
        let width = 50;
        let errors = |tile| {
            tile_of(tile % 4, |x| match x {
                0..25 => 1.0,
                25..50 => 3.0,
                _ => 0.0,
            })
        };
        let positions = spread(397, width, [4, 5], 0.5, errors);
        let pixels = pixels(&positions);
        assert!((396..=397).contains(&pixels.len()));
        let mut sorted = pixels.clone();
        sorted.sort_unstable();
        sorted.dedup();
        assert_eq!(sorted.len(), pixels.len(), "each at most once");
        let right = pixels.iter().filter(|&&at| at as usize % width >= 25).count();
        assert!((290..=305).contains(&right), "{right}");
        // Every tile has its share.
        for (column, share) in [(0, 12.7), (2, 38.1)] {
            for row in 0..5 {
                let inside = |at: &&u32| {
                    let (x, y) = (**at as usize % width, **at as usize / width);
                    x / TILE_WIDTH == column && y / TILE_HEIGHT == row
                };
                let count = pixels.iter().filter(inside).count() as f64;
                assert!((count - share).abs() < 1.0, "{count} of {share}");
            }
        }
        // A tile has an error of 200 on average; the third column of tiles has 384 in each.
        for position in &positions {
            let share = position.variance_share;
            match position.pixel as usize % width {
                0..16 => assert_eq!(share, 1.0),
                32..48 => assert!((share.powi(2) - 200.0 / 384.0).abs() < 1e-6, "{position:?}"),
                _ => assert!(share > 0.0 && share <= 1.0, "{position:?}"),
            }
        }
    }

    #[test]
    fn a_tile_gets_few_at_once() {
        // One of 400 tiles has nearly all of the error.
        let tiles = |tile| tile_of(0, |_| if tile == 21 { 1e6 } else { 1.0 });
        let in_tile = |count: usize| {
            let pixels = pixels(&spread(count, 20 * TILE_WIDTH, [20, 20], 0.5, tiles));
            let inside = |pixel: &&u32| {
                let (x, y) =
                    (**pixel as usize % (20 * TILE_WIDTH), **pixel as usize / (20 * TILE_WIDTH));
                [x / TILE_WIDTH, y / TILE_HEIGHT] == [1, 1]
            };
            pixels.iter().filter(inside).count()
        };
        assert_eq!(in_tile(5), 5);
        assert_eq!(in_tile(400), MOST_AT_ONCE as usize);
        assert_eq!(in_tile(4000), 10 * MOST_OF_AVERAGE as usize);
    }

    #[test]
    fn spread_skips_exact_pixels() {
        let exact = [[0.0; TILE_WIDTH]; TILE_HEIGHT];
        let spread = |phase: f64, tile: TilePlane| spread(10, 7, [1, 1], phase, |_| tile);
        assert!(spread(0.0, exact).is_empty());
        let mut map = exact;
        (map[2][3], map[2][4]) = (2.0, 1e-3);
        let pixels = pixels(&spread(0.9, map));
        assert!(pixels == [17] || pixels == [17, 18], "{pixels:?}");
    }

    #[test]
    fn the_curve_visits_every_pixel_once() {
        for size in [[1, 1], [37, 1], [1, 9], [13, 29], [64, 32], [0, 3], [0, 0]] {
            let mut visits = vec![0; size[0] * size[1]];
            along_z([0, 0], size, &mut |x, y| visits[y * size[0] + x] += 1);
            assert!(visits.iter().all(|&count| count == 1), "{size:?}");
        }
    }
}
