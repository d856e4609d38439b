//! Distortion-driven densification: where new Gaussians go and what they start as (paper, section
//! "Distortion Driven Densification").

use glam::Vec3;
use rayon::prelude::*;

use super::chart;
use super::gradient::Pass;
use super::optimizer::{Bounds, Row};
use super::raster::Raster;
use super::training::{Densification, Distortion, Filter, NewColor, NewShape, Placement};
use crate::gaussian::{Chart, MAX_COMPONENTS};

/// Gaussians whose peak is below this share of a full sample are useless: a 16th of a step of 8
/// bits.
pub(crate) const USELESS_COLOR: f32 = 1.0 / 4096.0;

/// Where a picture stands when Gaussians are added.
#[derive(Debug)]
pub(crate) struct Site<'a> {
    pub(crate) options: &'a Densification,
    pub(crate) filter: Filter,
    pub(crate) raster: &'a Raster,
    /// The last pass over the picture.
    pub(crate) pass: &'a Pass,
    pub(crate) bounds: Bounds,
    /// Gaussians that are there already.
    pub(crate) present: usize,
}

impl Site<'_> {
    /// Up to `count` new Gaussians where the picture is worst. Fewer where there is nothing left
    /// to correct.
    pub(crate) fn newcomers(&self, count: usize, rng: &mut fastrand::Rng) -> Vec<Row> {
        let map = self.distortions();
        let pixels = match self.options.placement {
            Placement::Top => top(count, &map),
            Placement::Spread => spread(count, &map, self.raster.width, rng.f64()),
        };
        let total = self.present + pixels.len();
        let variance = self
            .filter
            .variance(self.raster.pixels(), total)
            .expect("`Training::check` accepted the filter");
        pixels.into_iter().map(|pixel| self.born(pixel as usize, variance, rng)).collect()
    }

    /// A new Gaussian on a pixel.
    fn born(&self, pixel: usize, variance: f32, rng: &mut fastrand::Rng) -> Row {
        let (x, y) = (pixel % self.raster.width, pixel / self.raster.width);
        let mut row = [0.0; MAX_COMPONENTS];
        row[0] = x as f32 + 0.5;
        row[1] = y as f32 + 0.5;
        let chart = self.bounds.chart;
        let shape = match self.options.shape {
            NewShape::Point => chart::from_cholesky(chart, [variance.sqrt(), 0.0, variance.sqrt()]),
            NewShape::Random => random_shape(chart, variance, rng),
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

    /// The distortion of every pixel, row by row; 0 where the output could not be improved.
    fn distortions(&self) -> Vec<f32> {
        let raster = self.raster;
        let mut map = vec![0.0; raster.pixels()];
        map.par_chunks_exact_mut(raster.width).enumerate().for_each(|(y, line)| {
            for (x, value) in line.iter_mut().enumerate() {
                let residual = self.pass.residual(x, y, raster.channels);
                // Less than half a step of the source's depth: exact after rounding.
                let exact = residual.iter().all(|value| value.abs() < raster.half_step);
                *value = match self.options.distortion {
                    _ if exact => 0.0,
                    Distortion::L1 => residual.iter().map(|value| value.abs()).sum(),
                    Distortion::L3 => {
                        let squared = residual.iter().map(|value| value * value).sum::<f32>();
                        squared * squared.sqrt()
                    }
                };
            }
        });
        map
    }
}

/// The pixels of largest distortion; the first of equals.
fn top(count: usize, map: &[f32]) -> Vec<u32> {
    let mut order: Vec<u32> = (0..map.len() as u32).filter(|&at| map[at as usize] > 0.0).collect();
    let worst =
        |a: &u32, b: &u32| map[*b as usize].total_cmp(&map[*a as usize]).then_with(|| a.cmp(b));
    if count < order.len() {
        order.select_nth_unstable_by(count, worst);
        order.truncate(count);
    }
    order.sort_unstable_by(worst);
    order
}

/// Up to `count` pixels, in every part of the picture as many as it has of the distortion: at equal
/// steps of the distortion summed up along a Z curve. `phase` in [0, 1) shifts them all.
fn spread(count: usize, map: &[f32], width: usize, phase: f64) -> Vec<u32> {
    let total = map.iter().map(|&value| f64::from(value)).sum::<f64>();
    let step = total / count as f64;
    let (mut sum, mut next) = (0.0, phase * step);
    let mut pixels = Vec::new();
    if total > 0.0 {
        along_z([0, 0], [width, map.len() / width], &mut |x, y| {
            sum += f64::from(map[y * width + x]);
            if sum > next {
                pixels.push((y * width + x) as u32);
                // A pixel of more than one step gets one Gaussian.
                next += step * ((sum - next) / step).ceil();
            }
        });
    }
    pixels
}

/// Visits the pixels of a rectangle along a Z curve: neighbours follow each other closely.
fn along_z([x, y]: [usize; 2], [width, height]: [usize; 2], visit: &mut impl FnMut(usize, usize)) {
    const LEAF: usize = 4;
    if width.max(height) <= LEAF {
        for y in y..y + height {
            for x in x..x + width {
                visit(x, y);
            }
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
fn random_shape(chart: Chart, variance: f32, rng: &mut fastrand::Rng) -> Vec3 {
    loop {
        let mut shape = Vec3::new(rng.f32(), rng.f32(), rng.f32());
        for (value, positive) in shape.as_mut().iter_mut().zip(chart::logarithmic(chart)) {
            *value += if positive { 0.5 } else { 0.0 };
        }
        if chart == Chart::RotationScale {
            shape.z *= core::f32::consts::TAU;
        }
        let wide = chart::widened(chart, shape, variance);
        if wide.is_finite() {
            return wide;
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_top_are_the_largest_and_the_first_of_equals() {
        let map = [0.0, 3.0, 1.0, 3.0, 0.0, 2.0];
        assert_eq!(top(3, &map), [1, 3, 5]);
        assert_eq!(top(1, &map), [1]);
        // What is exact gets no Gaussian, however many are asked for.
        assert_eq!(top(10, &map), [1, 3, 5, 2]);
    }

    #[test]
    fn spread_pixels_follow_the_distortion() {
        // Left half: weak; right half: three times as much.
        let (width, height) = (50, 40);
        let map: Vec<f32> =
            (0..width * height).map(|at| if at % width < 25 { 1.0 } else { 3.0 }).collect();
        let pixels = spread(400, &map, width, 0.5);
        assert!((399..=400).contains(&pixels.len()));
        let mut sorted = pixels.clone();
        sorted.sort_unstable();
        sorted.dedup();
        assert_eq!(sorted.len(), pixels.len(), "each at most once");
        let right = pixels.iter().filter(|&&at| at as usize % width >= 25).count();
        assert!((295..=305).contains(&right), "{right}");
        // Evenly: every 10 x 10 block of the right half has about its 30.
        for block in 0..8 {
            let (x, y) = (30 + block % 2 * 10, block / 2 * 10);
            let inside = |at: &&u32| {
                let (px, py) = (**at as usize % width, **at as usize / width);
                (x..x + 10).contains(&px) && (y..y + 10).contains(&py)
            };
            let count = pixels.iter().filter(inside).count();
            assert!((26..=34).contains(&count), "{count}");
        }
    }

    #[test]
    fn spread_leaves_out_what_is_exact() {
        let mut map = vec![0.0; 35];
        assert!(spread(10, &map, 7, 0.0).is_empty());
        map[17] = 2.0;
        map[18] = 1e-3;
        let pixels = spread(10, &map, 7, 0.9);
        assert!(pixels == [17] || pixels == [17, 18], "{pixels:?}");
    }

    #[test]
    fn the_curve_visits_every_pixel_once() {
        for size in [[1, 1], [37, 1], [1, 9], [13, 29], [64, 32]] {
            let mut visits = vec![0; size[0] * size[1]];
            along_z([0, 0], size, &mut |x, y| visits[y * size[0] + x] += 1);
            assert!(visits.iter().all(|&count| count == 1), "{size:?}");
        }
    }
}
