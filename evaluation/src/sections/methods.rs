//! The published methods, from the parts of this crate's training.

use std::sync::Arc;

use image_gip::Parameterization;
use image_gip::training::{
    CustomPlacement, ErrorMap, GaussianFilter, LearningRateSchedule, NewColor, Placement, Training,
};

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
         passed; all else is as published. All run in this crate, with its renderer and optimizer, on this \
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

/// Our training with other places for new Gaussians, as the table of them calls them. A placement of one's own gets
/// its row here (docs/methods.md).
pub(crate) fn placements(iterations: u32) -> Vec<(&'static str, Training)> {
    let placed = |placement, color| {
        let mut training = Training::fast(iterations);
        training.densification.placement = placement;
        training.densification.color = color;
        training
    };
    let usual = Training::fast(iterations);
    let color = usual.densification.color;
    let worst = Placement::Custom(Arc::new(WorstOfSquares));
    vec![
        ("spread by the error", usual),
        ("largest errors", placed(Placement::Top, NewColor::Zero)),
        ("worst of squares", placed(worst, color)),
    ]
}

/// The worst pixel of each of as many squares as there are to be new Gaussians.
#[derive(Debug)]
struct WorstOfSquares;

impl CustomPlacement for WorstOfSquares {
    fn pixels(&self, count: usize, map: &ErrorMap) -> Vec<u32> {
        let side = ((map.errors.len() as f64 / count as f64).sqrt().ceil() as usize).max(1);
        let columns = map.width.div_ceil(side);
        let mut worst = vec![(0.0, 0); columns * map.height.div_ceil(side)];
        for (pixel, &error) in map.errors.iter().enumerate() {
            let (x, y) = (pixel % map.width, pixel / map.width);
            let square = &mut worst[y / side * columns + x / side];
            if error > square.0 {
                *square = (error, pixel as u32);
            }
        }
        worst.into_iter().filter(|&(error, _)| error > 0.0).map(|(_, pixel)| pixel).collect()
    }
}

/// Our training, with bit depths of position, shape and colour.
pub(crate) fn ours(iterations: u32, [position, shape, color]: [u8; 3]) -> Training {
    let mut training = Training::fast(iterations);
    training.quantization.position_bits = position;
    training.quantization.shape_bits = shape;
    training.quantization.color_bits = color;
    training
}
