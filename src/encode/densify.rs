//! Distortion-driven densification: where new Gaussians go and what they start as (paper, section
//! "Distortion Driven Densification").

use glam::Vec3;

use super::chart;
use super::gradient::Pass;
use super::optimizer::{Bounds, Row};
use super::raster::Raster;
use super::training::{Densification, Distortion, Filter, NewColor, NewShape, Placement};
use crate::gaussian::{Chart, MAX_COMPONENTS};

/// Gaussians whose peak is below this share of a full sample are useless: a 16th of a step of 8
/// bits.
pub(crate) const USELESS_COLOR: f32 = 1.0 / 4096.0;

/// Up to `count` new Gaussians where the picture of the last pass is worst; `present` are there
/// already. Fewer where there is nothing left to correct.
pub(crate) fn newcomers(
    count: usize,
    present: usize,
    options: &Densification,
    filter: Filter,
    raster: &Raster,
    pass: &Pass,
    bounds: Bounds,
    rng: &mut fastrand::Rng,
) -> Vec<Row> {
    let pixels = match options.placement {
        Placement::Top => top(count, &distortions(options.distortion, raster, pass)),
        Placement::Sampled => sampled(count, &distortions(options.distortion, raster, pass), rng),
    };
    let variance = filter
        .variance(raster.pixels(), present + pixels.len())
        .expect("`Training::check` accepted the filter");
    let born = |pixel: u32| {
        let (x, y) = (pixel as usize % raster.width, pixel as usize / raster.width);
        let mut row = [0.0; MAX_COMPONENTS];
        row[0] = x as f32 + 0.5;
        row[1] = y as f32 + 0.5;
        let shape = match options.shape {
            NewShape::Point => {
                chart::from_cholesky(bounds.chart, [variance.sqrt(), 0.0, variance.sqrt()])
            }
            NewShape::Random => random_shape(bounds.chart, variance, rng),
        };
        row[2..5].copy_from_slice(&shape.to_array());
        let residual = pass.residual(x, y, raster.channels);
        let source = raster.sample(x, y);
        for channel in 0..raster.channels {
            row[5 + channel] = match options.color {
                NewColor::Zero => 0.0,
                NewColor::Source => source[channel],
                NewColor::Residual(share) => -share * residual[channel],
            };
        }
        bounds.confined(row)
    };
    pixels.into_iter().map(born).collect()
}

/// The distortion of every pixel, row by row; 0 where the output could not be improved.
fn distortions(distortion: Distortion, raster: &Raster, pass: &Pass) -> Vec<f32> {
    let mut map = Vec::with_capacity(raster.pixels());
    for y in 0..raster.height {
        for x in 0..raster.width {
            let residual = pass.residual(x, y, raster.channels);
            // Less than half a step of the source's depth: exact after rounding.
            let exact = residual.iter().all(|value| value.abs() < raster.half_step);
            map.push(match distortion {
                _ if exact => 0.0,
                Distortion::L1 => residual.iter().map(|value| value.abs()).sum(),
                Distortion::L2 => residual.iter().map(|value| value * value).sum(),
            });
        }
    }
    map
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
            shape.z *= std::f32::consts::TAU;
        }
        let wide = chart::widened(chart, shape, variance);
        if wide.is_finite() {
            return wide;
        }
    }
}
