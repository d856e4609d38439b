//! Distortion-driven densification: where new Gaussians go and what they start as (paper, section
//! "Distortion Driven Densification").

use glam::Vec3;
use rayon::prelude::*;

use super::adam::{Domain, Row};
use super::parameterization;
use super::pass::Pass;
use super::training::{Densification, Distortion, GaussianFilter, NewColor, NewShape, Placement};
use crate::encode::raster::{Raster, TILE_WIDTH, TilePlane};
use crate::gaussian::{MAX_COMPONENTS, Parameterization};
use crate::render::tile_grid::TILE_HEIGHT;

/// Gaussians whose peak is below this share of a full sample are useless: a 16th of a step of 8
/// bits.
pub(crate) const USELESS_COLOR: f32 = 1.0 / 4096.0;

/// Where a new Gaussian goes.
#[derive(Clone, Copy, Debug, PartialEq)]
struct Spot {
    pixel: u32,
    /// The variance that it is born with, as a share of the filter's, in (0, 1]. Where a small part
    /// of a picture has all of its distortion, hundreds of Gaussians of the same size as elsewhere
    /// would lie on top of each other, take steps in the same direction, and never come to rest.
    room: f32,
}

/// Where a picture stands when Gaussians are added.
#[derive(Debug)]
pub(crate) struct Site<'a> {
    pub(crate) options: &'a Densification,
    pub(crate) filter: GaussianFilter,
    pub(crate) raster: &'a Raster,
    /// The last pass over the picture.
    pub(crate) pass: &'a Pass,
    pub(crate) bounds: Domain,
    /// Gaussians that are there already.
    pub(crate) present: usize,
}

impl Site<'_> {
    /// Up to `count` new Gaussians where the picture is worst. Fewer where there is nothing left
    /// to correct.
    pub(crate) fn newcomers(&self, count: usize, rng: &mut fastrand::Rng) -> Vec<Row> {
        let spots = match self.options.placement {
            Placement::Top => top(count, &self.map()),
            Placement::Spread => {
                spread(count, self.raster.width, self.tiles(), rng.f64(), |tile| {
                    self.distortions(tile)
                })
            }
        };
        let total = self.present + spots.len();
        let variance = self
            .filter
            .variance(self.raster.pixels(), total)
            .expect("`Training::check` accepted the filter");
        spots.into_iter().map(|spot| self.born(&spot, variance, rng)).collect()
    }

    /// A new Gaussian, of so much variance where it has all the room.
    fn born(&self, spot: &Spot, variance: f32, rng: &mut fastrand::Rng) -> Row {
        let (pixel, variance) = (spot.pixel as usize, variance * spot.room);
        let (x, y) = (pixel % self.raster.width, pixel / self.raster.width);
        let mut row = [0.0; MAX_COMPONENTS];
        row[0] = x as f32 + 0.5;
        row[1] = y as f32 + 0.5;
        let parameterization = self.bounds.parameterization;
        let shape = match self.options.shape {
            NewShape::Point => parameterization::from_cholesky(
                parameterization,
                [variance.sqrt(), 0.0, variance.sqrt()],
            ),
            NewShape::Random => random_shape(parameterization, variance, rng),
        };
        row[2..5].copy_from_slice(&shape.to_array());
        let residual = self.pass.residual(x, y, self.raster.channels);
        let source = self.raster.sample(x, y);
        for channel in 0..self.raster.channels {
            row[5 + channel] = match self.options.color {
                NewColor::Zero => 0.0,
                NewColor::Source => source[channel],
                NewColor::Residual(share) => -share * residual[channel],
            };
        }
        self.bounds.confined(row)
    }

    /// Columns and rows of tiles.
    fn tiles(&self) -> [usize; 2] {
        [self.raster.width.div_ceil(TILE_WIDTH), self.raster.height.div_ceil(TILE_HEIGHT)]
    }

    /// The distortion of every pixel, row by row.
    fn map(&self) -> Vec<f32> {
        let mut map = vec![0.0; self.raster.pixels()];
        let [columns, _] = self.tiles();
        let rows = map.par_chunks_mut(self.raster.width * TILE_HEIGHT).enumerate();
        rows.for_each(|(row, lines)| {
            for column in 0..columns {
                let distortions = self.distortions(row * columns + column);
                let lines = lines.chunks_exact_mut(self.raster.width).zip(&distortions);
                for (line, values) in lines {
                    let line = &mut line[column * TILE_WIDTH..];
                    let length = line.len().min(TILE_WIDTH);
                    line[..length].copy_from_slice(&values[..length]);
                }
            }
        });
        map
    }

    /// The distortion of every pixel of a tile; 0 where the output could not be improved.
    fn distortions(&self, tile: usize) -> TilePlane {
        let residuals = self.pass.residuals(tile, self.raster.channels);
        let measure = |measure: &dyn Fn(f32, f32) -> f32| -> TilePlane {
            let mut plane = [[0.0; TILE_WIDTH]; TILE_HEIGHT];
            for residual in residuals {
                for (value, residual) in
                    plane.as_flattened_mut().iter_mut().zip(residual.as_flattened())
                {
                    *value = measure(*value, residual.abs());
                }
            }
            plane
        };
        let mut distortions = match self.options.distortion {
            Distortion::L1 => measure(&|sum, residual| sum + residual),
            Distortion::L3 => {
                let mut plane = measure(&|sum, residual| sum + residual * residual);
                for value in plane.as_flattened_mut() {
                    *value *= value.sqrt();
                }
                plane
            }
        };
        let worst = measure(&f32::max);
        let pixels = distortions.as_flattened_mut().iter_mut().zip(worst.as_flattened());
        for (value, &worst) in pixels {
            // Less than half a step of the source's depth: exact after rounding.
            if worst < self.raster.half_step {
                *value = 0.0;
            }
        }
        distortions
    }
}

/// The pixels of largest distortion, the first of equals, with all the room, as the paper has it.
fn top(count: usize, map: &[f32]) -> Vec<Spot> {
    let mut order: Vec<u32> = (0..map.len() as u32).filter(|&at| map[at as usize] > 0.0).collect();
    let worst =
        |a: &u32, b: &u32| map[*b as usize].total_cmp(&map[*a as usize]).then_with(|| a.cmp(b));
    if count < order.len() {
        order.select_nth_unstable_by(count, worst);
        order.truncate(count);
    }
    order.sort_unstable_by(worst);
    order.into_iter().map(|pixel| Spot { pixel, room: 1.0 }).collect()
}

/// Up to `count` pixels, in every part of the picture as many as it has of the distortion: at equal
/// steps of the distortion summed up along a Z curve of tiles. `phase` in [0, 1) shifts them all.
///
/// A tile with more than the mean of the distortion has that much less room for each. Born with the
/// root of it, they overlap but can come to rest: as small as their room, short runs do not get them
/// to grow in time (0.5 dB less at effort 2).
fn spread(
    count: usize,
    width: usize,
    [columns, rows]: [usize; 2],
    phase: f64,
    distortions: impl Fn(usize) -> TilePlane + Sync,
) -> Vec<Spot> {
    // Summed up by tile first, on all threads; only tiles with a step in them are looked into.
    let sum_of =
        |tile| distortions(tile).as_flattened().iter().map(|&value| f64::from(value)).sum();
    let sums: Vec<f64> = (0..columns * rows).into_par_iter().map(sum_of).collect();
    let total: f64 = sums.iter().sum();
    let (step, mean) = (total / count as f64, total / sums.len() as f64);
    let (mut sum, mut next) = (0.0, phase * step);
    let mut spots = Vec::new();
    along_z([0, 0], [columns, rows], &mut |column, row| {
        let tile = row * columns + column;
        let end = sum + sums[tile];
        if end > next {
            let room = (mean / sums[tile]).sqrt().min(1.0) as f32;
            let first = row * TILE_HEIGHT * width + column * TILE_WIDTH;
            for (y, line) in distortions(tile).iter().enumerate() {
                for (x, &value) in line.iter().enumerate() {
                    sum += f64::from(value);
                    // What is not to be improved, or not of the picture, is never chosen.
                    if sum > next && value > 0.0 {
                        spots.push(Spot { pixel: (first + y * width + x) as u32, room });
                        // A pixel of more than one step gets one Gaussian.
                        next += step * ((sum - next) / step).ceil();
                    }
                }
            }
        }
        sum = end;
    });
    spots
}

/// Visits the points of a rectangle along a Z curve: neighbours follow each other closely.
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

/// The paper's random covariance plus the filter's variance. Three random numbers need not be a
/// covariance; those that are none are drawn again.
fn random_shape(
    parameterization: Parameterization,
    variance: f32,
    rng: &mut fastrand::Rng,
) -> Vec3 {
    loop {
        let mut shape = Vec3::new(rng.f32(), rng.f32(), rng.f32());
        for (value, positive) in
            shape.as_mut().iter_mut().zip(parameterization::logarithmic(parameterization))
        {
            *value += if positive { 0.5 } else { 0.0 };
        }
        if parameterization == Parameterization::RotationScale {
            shape.z *= core::f32::consts::TAU;
        }
        let wide = parameterization::widened(parameterization, shape, variance);
        if wide.is_finite() {
            return wide;
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn pixels(spots: &[Spot]) -> Vec<u32> {
        spots.iter().map(|spot| spot.pixel).collect()
    }

    #[test]
    fn the_top_are_the_largest_and_the_first_of_equals() {
        let map = [0.0, 3.0, 1.0, 3.0, 0.0, 2.0];
        assert_eq!(pixels(&top(3, &map)), [1, 3, 5]);
        assert_eq!(pixels(&top(1, &map)), [1]);
        // What is exact gets no Gaussian, however many are asked for.
        assert_eq!(pixels(&top(10, &map)), [1, 3, 5, 2]);
    }

    /// A tile whose distortions depend on the picture's column alone.
    fn tile_of(column: usize, value: impl Fn(usize) -> f32) -> TilePlane {
        [core::array::from_fn(|x| value(column * TILE_WIDTH + x)); TILE_HEIGHT]
    }

    #[test]
    fn spread_pixels_follow_the_distortion() {
        // Left half: weak; right half: three times as much.
        let width = 50;
        let spots = spread(397, width, [4, 5], 0.5, |tile| {
            tile_of(tile % 4, |x| match x {
                0..25 => 1.0,
                25..50 => 3.0,
                _ => 0.0,
            })
        });
        let pixels = pixels(&spots);
        assert!((396..=397).contains(&pixels.len()));
        let mut sorted = pixels.clone();
        sorted.sort_unstable();
        sorted.dedup();
        assert_eq!(sorted.len(), pixels.len(), "each at most once");
        let right = pixels.iter().filter(|&&at| at as usize % width >= 25).count();
        assert!((290..=305).contains(&right), "{right}");
        // Evenly: every tile has its share.
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
        // A tile has a distortion of 200 on average; the third column of tiles has 384 in each.
        for spot in &spots {
            match spot.pixel as usize % width {
                0..16 => assert_eq!(spot.room, 1.0),
                32..48 => assert!((spot.room.powi(2) - 200.0 / 384.0).abs() < 1e-6, "{spot:?}"),
                _ => assert!(spot.room > 0.0 && spot.room <= 1.0, "{spot:?}"),
            }
        }
    }

    #[test]
    fn spread_leaves_out_what_is_exact() {
        let exact = [[0.0; TILE_WIDTH]; TILE_HEIGHT];
        assert!(spread(10, 7, [1, 1], 0.0, |_| exact).is_empty());
        let mut map = exact;
        (map[2][3], map[2][4]) = (2.0, 1e-3);
        let pixels = pixels(&spread(10, 7, [1, 1], 0.9, |_| map));
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
