//! Where the paper puts new Gaussians, and their shapes (section "Distortion Driven Densification").

use crate::gaussian::Parameterization;

/// [`Placement::Top`](crate::training::Placement::Top): the `count` pixels of largest error, the largest first; of
/// pixels with equal error, the first ones. Exact pixels are none of them.
pub(in crate::encode::fit) fn largest(count: usize, map: &[f32]) -> Vec<u32> {
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
