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
            Placement::Sampled => sampled(count, &map, rng),
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
                    Distortion::L2 => residual.iter().map(|value| value * value).sum(),
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

/// Pixels drawn in proportion to their distortion, each at most once.
fn sampled(count: usize, map: &[f32], rng: &mut fastrand::Rng) -> Vec<u32> {
    let mut total = 0.0;
    let sums: Vec<f64> = map
        .iter()
        .map(|&value| {
            total += f64::from(value);
            total
        })
        .collect();
    if total <= 0.0 {
        return Vec::new();
    }
    let mut pixels: Vec<u32> = (0..count)
        .map(|_| {
            let at = rng.f64() * total;
            sums.partition_point(|&sum| sum <= at).min(map.len() - 1) as u32
        })
        .collect();
    pixels.sort_unstable();
    pixels.dedup();
    pixels
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
    fn samples_follow_the_distortion() {
        let mut rng = fastrand::Rng::with_seed(5);
        // One large block of small distortion, one small block of large distortion.
        let mut map = vec![0.0; 1000];
        map[100..900].fill(1.0);
        map[900..950].fill(16.0);
        let pixels = sampled(400, &map, &mut rng);
        assert!(pixels.is_sorted_by(|a, b| a < b), "each at most once");
        assert!(pixels.iter().all(|&pixel| map[pixel as usize] > 0.0));
        // Half of the distortion lies in each, but the small one is soon full.
        let (large, small) = pixels.split_at(pixels.partition_point(|&pixel| pixel < 900));
        assert!(small.len() >= 45 && (120..240).contains(&large.len()), "{}", large.len());
        assert!(sampled(10, &[0.0; 50], &mut rng).is_empty());
    }
}
