//! The hook for weights of one's own.

use core::fmt::Debug;

// Constants: docs/tuning.md, "Not measured".
/// The least and the largest importance, where the mean is 1; beyond, steps of training have no sensible size.
const RANGE: (f32, f32) = (1.0 / 16.0, 16.0);

/// How much an error counts by its place in the picture, beside how visible it is: for pictures of which some part
/// matters more, and for the study of other losses than the encoder has ([`Encoder::with_importance`]).
///
/// All stages go by it: where new Gaussians go, training, and the choice of codes.
///
/// [`Encoder::with_importance`]: crate::Encoder::with_importance
pub trait Importance: Debug + Send + Sync {
    /// The factor on the squared errors of a block of 4 x 4 pixels whose centre is at (x, y) in pixels, where the
    /// centre of the first pixel is at (0.5, 0.5). Only ratios count: it is divided by its mean over the picture, and
    /// then taken to be 1/16 to 16. What is negative or not finite counts as the mean.
    fn at(&self, position: [f32; 2]) -> f32;
}

/// The importance of blocks as it counts: relative to the mean.
pub(crate) fn normalized(mut importance: Vec<f32>) -> Vec<f32> {
    let is_valid = |value: &f32| value.is_finite() && *value >= 0.0;
    let valid = importance.iter().copied().filter(is_valid);
    let (sum, count) =
        valid.fold((0.0, 0), |(sum, count), value| (sum + f64::from(value), count + 1));
    let mean = sum / f64::from(count.max(1));
    for value in &mut importance {
        let relative = (f64::from(*value) / mean) as f32;
        *value = match is_valid(value) && relative.is_finite() {
            true => relative.clamp(RANGE.0, RANGE.1),
            false => 1.0,
        };
    }
    importance
}

#[cfg(test)]
mod tests {
    use super::normalized;

    #[test]
    fn importance_is_relative_to_its_mean() {
        for scale in [1e-30, 1.0, 7.0, 1e30] {
            let found = normalized([2.0, 6.0, 4.0].map(|value| value * scale).to_vec());
            for (found, expected) in found.iter().zip([0.5, 1.5, 1.0]) {
                assert!((found - expected).abs() < 1e-6, "{scale}: {found}");
            }
        }
        assert_eq!(normalized(vec![0.0, 1.0]), [1.0 / 16.0, 2.0]);
        assert_eq!(normalized([vec![0.0; 99], vec![1.0]].concat())[98..], [1.0 / 16.0, 16.0]);
        // Nothing matters, or nothing is said.
        assert_eq!(normalized(vec![0.0; 2]), [1.0; 2]);
        assert_eq!(normalized(vec![f32::NAN, f32::INFINITY, -1.0]), [1.0; 3]);
        assert_eq!(normalized(vec![f32::NAN, 1.0, 3.0]), [1.0, 0.5, 1.5]);
    }
}
