//! The published methods, from the parts of this crate's training.

use image_gip::Parameterization;
use image_gip::training::{GaussianFilter, LearningRateSchedule, Training};

/// Iterations of the paper.
pub(crate) const PAPER_ITERATIONS: u32 = 50_000;
/// The interval at which the paper halves its learning rates, as a share of all iterations.
const HALVING: f64 = 0.4;
/// The filter of GaussianImage: what it adds to every variance, in square pixels.
const GAUSSIAN_IMAGE_FILTER: GaussianFilter = GaussianFilter::Constant(0.5);

/// The parameterizations, as tables call them.
pub(crate) const PARAMETERIZATIONS: [(&str, Parameterization); 3] = [
    ("direct covariance", Parameterization::Covariance),
    ("Cholesky", Parameterization::Cholesky),
    ("rotation and scale", Parameterization::RotationScale),
];

/// How the published methods were run, for the text of sections.
pub(crate) fn description(iterations: u32) -> String {
    format!(
        "The published methods run for {iterations} iterations (the paper: {PAPER_ITERATIONS}) and \
         halve their learning rates each time the same share ({HALVING}) of the iterations has \
         passed; all else is as published. With fewer iterations than in the paper they are worse \
         than they can be. All run in this crate, with its renderer and optimizer, on this \
         machine's processor."
    )
}

/// GaussianImage++ with fewer iterations, with or without its two components: distortion-driven
/// densification (D3) and the context-aware filter (CAF).
pub(crate) fn paper(
    iterations: u32,
    parameterization: Parameterization,
    d3: bool,
    caf: bool,
) -> Training {
    let mut training = Training::paper();
    training.iterations = iterations;
    training.parameterization = parameterization;
    let interval = (f64::from(iterations) * HALVING).round() as u32;
    training.schedule = LearningRateSchedule::Halving(interval.max(1));
    if !d3 {
        training.densification.initial = 1.0;
    }
    if !caf {
        training.filter = GAUSSIAN_IMAGE_FILTER;
    }
    training
}

/// Our training, with bit depths of position, shape and colour.
pub(crate) fn ours(iterations: u32, [position, shape, color]: [u8; 3]) -> Training {
    let mut training = Training::fast(iterations);
    training.quantization.position_bits = position;
    training.quantization.shape_bits = shape;
    training.quantization.color_bits = color;
    training
}
