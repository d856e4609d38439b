//! A step of Adam (paper, appendix, section "Implementation Details").

use super::row::{Row, RowBounds, Slope};
use super::training::Adam;
use crate::gaussian::{MAX_COMPONENTS, Parameterization};

/// The state for one Gaussian.
#[derive(Clone, Copy, Debug)]
pub(super) struct State {
    /// Moving average of the gradient.
    mean: Row,
    /// Moving average of the squared gradient.
    square: Row,
    /// Steps since the Gaussian was added, for the bias correction.
    age: i32,
}

impl State {
    pub(super) const NEW: Self =
        Self { mean: [0.0; MAX_COMPONENTS], square: [0.0; MAX_COMPONENTS], age: 0 };

    /// Makes the next steps a quarter as large. The squares forget it.
    pub(super) fn slow_down(&mut self) {
        self.square = self.square.map(|square| 16.0 * square);
    }
}

/// One step for one Gaussian.
pub(super) fn step(
    row: &mut Row,
    state: &mut State,
    slope: &Slope,
    options: &Adam,
    bounds: RowBounds,
    factor: f32,
) {
    let (beta1, beta2) = (options.beta1, options.beta2);
    let gradient = &slope.gradient;
    state.age = state.age.saturating_add(1);
    let age = state.age;
    let rate = factor / (1.0 - beta1.powi(age));
    let unbias = 1.0 / (1.0 - beta2.powi(age));
    let Adam { center, shape, color, .. } = *options;
    let rates: Row = [center, center, shape, shape, shape, color, color, color, color];
    // Absent channels have gradients of 0 and take part: a loop of constant length becomes SIMD
    // code.
    for index in 0..MAX_COMPONENTS {
        let (mean, square) = (&mut state.mean[index], &mut state.square[index]);
        *mean = beta1 * *mean + (1.0 - beta1) * gradient[index];
        *square = beta2 * *square + (1.0 - beta2) * (gradient[index] * gradient[index]);
        let root = (*square * unbias).sqrt() + options.epsilon;
        // The root is 0 for a parameter on which no pixel depends.
        let step = if root > 0.0 { *mean * rate / root } else { 0.0 };
        row[index] -= rates[index] * step;
    }
    // As in the paper, a covariance may stop being positive definite. It is pruned then.
    if bounds.parameterization == Parameterization::Covariance {
        bounds.clamp_position_and_color(row);
    } else {
        *row = bounds.clamped(*row);
    }
}
