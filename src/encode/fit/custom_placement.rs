//! The hook for placements that take the place of D3.

use core::fmt::Debug;

/// A choice of the pixels for new Gaussians, for the study of others than the encoder has
/// ([`Placement`](super::training::Placement)).
///
/// It is asked at every growth step. In the course of training the picture may be a copy of half the resolution, a
/// quarter or an eighth ([`Training::coarse_to_fine`](super::training::Training::coarse_to_fine)).
pub trait CustomPlacement: Debug + Send + Sync {
    /// The pixels that are the centres of new Gaussians, by their indices in the map, row by row: at most `count`.
    /// Further ones are not used, nor are indices outside the map, nor those that were there before.
    fn pixels(&self, count: usize, errors: &ErrorMap) -> Vec<u32>;
}

/// Placements are equal if they are the same one.
impl PartialEq for dyn CustomPlacement {
    fn eq(&self, other: &Self) -> bool {
        core::ptr::addr_eq(self, other)
    }
}

/// The errors of a picture's pixels at a growth step.
#[derive(Clone, Debug)]
#[non_exhaustive]
pub struct ErrorMap {
    /// Width in pixels.
    pub width: usize,
    /// Height in pixels.
    pub height: usize,
    /// The error of each pixel, row by row: at least 0, in the norm of
    /// [`Densification::error_norm`](super::training::Densification::error_norm), where a full sample is 1; with
    /// [`Tune::Visual`](crate::Tune::Visual), residuals are weighted by how visible they are. A pixel that is exact
    /// when it is rounded has an error of 0.
    pub errors: Vec<f32>,
    /// The negative residual of each channel.
    pub(super) missing: Vec<[f32; 4]>,
}

impl ErrorMap {
    /// The pixels that a placement chooses, without those that cannot be used.
    pub(super) fn chosen(&self, placement: &dyn CustomPlacement, count: usize) -> Vec<u32> {
        let mut is_new = vec![true; self.errors.len()];
        let mut pixels = placement.pixels(count, self);
        pixels.retain(|&pixel| is_new.get_mut(pixel as usize).is_some_and(core::mem::take));
        pixels.truncate(count);
        pixels
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn pixels_that_cannot_be_used_are_left_out() {
        #[derive(Debug)]
        struct Careless;
        impl CustomPlacement for Careless {
            fn pixels(&self, _: usize, _: &ErrorMap) -> Vec<u32> {
                vec![3, 6, 3, u32::MAX, 0, 5]
            }
        }
        let map = ErrorMap { width: 3, height: 2, errors: vec![0.0; 6], missing: Vec::new() };
        assert_eq!(map.chosen(&Careless, 9), [3, 0, 5]);
        assert_eq!(map.chosen(&Careless, 2), [3, 0]);
    }
}
