//! Where the paper puts new Gaussians, and their shapes (section "Distortion Driven Densification").

use crate::encode::error::Result;
use crate::encode::progress::Observer;
use crate::encode::sample_tile::{TILE_WIDTH, TilePlane};
use crate::gaussian::Parameterization;
use crate::render::tile_grid::TILE_HEIGHT;

/// [`Placement::Top`](crate::training::Placement::Top): the `count` pixels of largest error, given those of
/// each tile of a picture of a width and height, the largest first. Of pixels with equal error, the first ones
/// are taken.
pub(in crate::encode::fit) fn top(
    count: usize,
    [width, height]: [usize; 2],
    errors: impl Fn(usize) -> TilePlane + Send + Sync,
    observer: &mut Observer<'_>,
) -> Result<Vec<u32>> {
    let mut map = vec![0.0; width * height];
    let columns = width.div_ceil(TILE_WIDTH);
    let rows = map.chunks_mut(width * TILE_HEIGHT).enumerate();
    observer.map(rows, |(row, lines)| {
        for column in 0..columns {
            let errors = errors(row * columns + column);
            for (line, values) in lines.chunks_exact_mut(width).zip(&errors) {
                let line = &mut line[column * TILE_WIDTH..];
                let length = line.len().min(TILE_WIDTH);
                line[..length].copy_from_slice(&values[..length]);
            }
        }
    })?;
    Ok(largest(count, &map))
}

/// The indices of up to `count` errors that are not 0.
fn largest(count: usize, map: &[f32]) -> Vec<u32> {
    let mut order: Vec<u32> = (0..map.len() as u32).filter(|&at| map[at as usize] > 0.0).collect();
    let descending =
        |a: &u32, b: &u32| map[*b as usize].total_cmp(&map[*a as usize]).then_with(|| a.cmp(b));
    if count < order.len() {
        order.select_nth_unstable_by(count, descending);
        order.truncate(count);
    }
    order.sort_unstable_by(descending);
    order
}

/// [`NewShape::Random`](crate::training::NewShape::Random): random shape values, plus the filter's
/// variance. In the paper's parameterization, not every draw is a covariance; an invalid one is drawn again.
pub(in crate::encode::fit) fn random_shape(
    parameterization: Parameterization,
    variance: f32,
    rng: &mut fastrand::Rng,
) -> [f32; 3] {
    loop {
        let mut shape = [(); 3].map(|()| rng.f32());
        for (value, positive) in shape.iter_mut().zip(parameterization.is_logarithmic()) {
            *value += if positive { 0.5 } else { 0.0 };
        }
        if parameterization == Parameterization::RotationScale {
            shape[2] *= core::f32::consts::TAU;
        }
        let wide = parameterization.widened(shape, variance);
        if wide.iter().all(|value| value.is_finite()) {
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
        assert_eq!(largest(3, &map), [1, 3, 5]);
        assert_eq!(largest(1, &map), [1]);
        // Exact pixels get no Gaussian, however many are asked for.
        assert_eq!(largest(10, &map), [1, 3, 5, 2]);
    }
}
