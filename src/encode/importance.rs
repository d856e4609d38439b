//! The hook for weights of one's own.

use core::fmt::Debug;

// Constants: docs/tuning.md, "Not measured".
/// The least and the largest importance; beyond, steps of training have no sensible size.
const RANGE: (f32, f32) = (1.0 / 16.0, 16.0);

/// How much an error counts by its place in the picture, beside how visible it is: for pictures of which some part
/// matters more, and for the study of other losses than the encoder has ([`Encoder::with_importance`]).
///
/// All stages go by it: where new Gaussians go, training, and the choice of codes.
///
/// [`Encoder::with_importance`]: crate::Encoder::with_importance
pub trait Importance: Debug + Send + Sync {
    /// The factor on the squared errors of a block of 4 x 4 pixels whose centre is at (x, y) in pixels, where the
    /// centre of the first pixel is at (0.5, 0.5). Only ratios matter. It is taken to be 1/16 to 16, and 1 if it is
    /// not a number.
    fn at(&self, position: [f32; 2]) -> f32;
}

/// The importance as it counts.
pub(crate) fn within_range(importance: f32) -> f32 {
    if importance.is_nan() { 1.0 } else { importance.clamp(RANGE.0, RANGE.1) }
}
