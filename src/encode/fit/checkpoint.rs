//! The best state since Gaussians were last added or removed, to which training returns after a setback.
//!
//! Steps are taken by all Gaussians at the same time, and each knows only its own curvature. Where many
//! overlap they may go too far together, and farther with every step.

use super::components::Components;
use super::paper::LsqQuantizers;
use crate::encode::loss::{Distortion, RenderingError, SquaredError};

// Constants: docs/tuning.md, "Steps of training".
/// The distortion of a setback, as a multiple of the least one: of the picture, and of the tiles that
/// are to blame: half a decibel. Short runs get over smaller ones, and sooner without a pause.
const SETBACK: f64 = 1.12;
/// Mean squared error that is no setback, where a full sample is 1: nothing of it shows at 16 bits.
const NEGLIGIBLE: f64 = 1e-10;

/// A state of training that can be written to a file.
#[derive(Clone, Debug)]
pub(super) struct Checkpoint {
    pub(super) error: RenderingError,
    pub(super) values: Vec<Components>,
    pub(super) quantizers: Option<LsqQuantizers>,
    /// The distortion of every tile, row by row.
    tiles: Vec<f32>,
    /// Whether training has returned to this state.
    was_returned_to: bool,
}

impl Checkpoint {
    /// Without Gaussians, and worse than any state.
    pub(super) fn new() -> Self {
        let (squared, distortion) = (SquaredError(f64::INFINITY), Distortion(f64::INFINITY));
        let error = RenderingError { squared, distortion };
        let (values, tiles) = (Vec::new(), Vec::new());
        Self { error, values, quantizers: None, tiles, was_returned_to: false }
    }

    /// Becomes a copy of a state.
    pub(super) fn set(
        &mut self,
        error: RenderingError,
        tiles: &[f32],
        values: &[Components],
        quantizers: Option<&LsqQuantizers>,
    ) {
        self.error = error;
        copy(&mut self.tiles, tiles);
        copy(&mut self.values, values);
        self.quantizers = quantizers.cloned();
        self.was_returned_to = false;
    }

    /// Whether a state of so many samples with this error has lost what this one has.
    pub(super) fn is_lost(&self, error: RenderingError, samples: usize) -> bool {
        let most = SETBACK * self.error.distortion.0 + NEGLIGIBLE * samples as f64;
        error.distortion.0.total_cmp(&most).is_gt()
    }

    /// The tiles that are to blame for a setback, by the distortions that they have then: all of them when
    /// training returns for another time, because a Gaussian may do harm far from its centre.
    pub(super) fn blamed(&mut self, tiles: &[f32]) -> Vec<bool> {
        let is_blamed = |(&after, &before): (&f32, &f32)| {
            let most = SETBACK as f32 * before;
            self.was_returned_to || after.total_cmp(&most).is_gt()
        };
        let blamed = tiles.iter().zip(&self.tiles).map(is_blamed).collect();
        self.was_returned_to = true;
        blamed
    }
}

/// Copies items, without more memory than they need.
fn copy<T: Copy>(items: &mut Vec<T>, from: &[T]) {
    items.clear();
    items.reserve_exact(from.len());
    items.extend_from_slice(from);
}

#[cfg(test)]
mod tests {
    use super::*;

    fn error(distortion: f64) -> RenderingError {
        RenderingError { squared: SquaredError(1.0), distortion: Distortion(distortion) }
    }

    #[test]
    fn what_is_much_worse_is_a_setback() {
        let mut best = Checkpoint::new();
        assert!(!best.is_lost(error(1e9), 1));
        best.set(error(100.0), &[50.0, 30.0, 20.0], &[Components::ZERO], None);
        assert!([99.0, 110.0].iter().all(|&distortion| !best.is_lost(error(distortion), 1)));
        assert!([114.0, f64::NAN].iter().all(|&distortion| best.is_lost(error(distortion), 1)));
        // Where all is exact, rounding errors are no setback.
        best.set(error(0.0), &[0.0; 3], &[], None);
        assert!(!best.is_lost(error(1e-8), 1000) && best.is_lost(error(1e-6), 1000));
    }

    #[test]
    fn at_first_the_tiles_that_lost_are_blamed_and_then_all() {
        let mut best = Checkpoint::new();
        best.set(error(100.0), &[50.0, 30.0, 20.0], &[], None);
        assert_eq!(best.blamed(&[70.0, 31.0, 19.0]), [true, false, false]);
        assert_eq!(best.blamed(&[70.0, 31.0, 19.0]), [true; 3]);
        best.set(error(90.0), &[40.0, 30.0, 20.0], &[], None);
        assert_eq!(best.blamed(&[40.0, 30.0, f32::NAN]), [false, false, true]);
    }
}
