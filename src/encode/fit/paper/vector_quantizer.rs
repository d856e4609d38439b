//! The hook for quantizers that take the place of LSQ+.

use core::fmt::Debug;
use std::sync::Arc;

/// A quantizer of the centres or of the colours in place of LSQ+, for the study of others.
///
/// Training renders what it stores, and gradients pass it by the straight-through estimator. The
/// file does not know it: it has the stored values as 32-bit floats.
pub trait VectorQuantizer: Debug + Send + Sync {
    /// This quantizer, adapted to the trained values of all Gaussians: called when quantization
    /// starts and after every iteration.
    fn adapted(&self, trained: &[&[f32]]) -> Arc<dyn VectorQuantizer>;

    /// Replaces the trained values of a Gaussian by the stored ones.
    fn quantize(&self, values: &mut [f32]);

    /// Adds the gradient of a loss of its own to that of half the sum of squared errors, where a
    /// full sample is 1.
    fn add_gradient(&self, _trained: &[f32], _gradient: &mut [f32]) {}
}

/// Quantizers are equal if they are the same one.
impl PartialEq for dyn VectorQuantizer {
    fn eq(&self, other: &Self) -> bool {
        core::ptr::addr_eq(self, other)
    }
}
