//! A step of Adam (paper, appendix, section "Implementation Details").

use crate::encode::fit::components::{Bounds, Components, Slope};
use crate::encode::fit::training::Adam;
use crate::gaussian::{MAX_COMPONENTS, Parameterization};

/// The state for one Gaussian.
#[derive(Clone, Copy, Debug)]
pub(in crate::encode::fit) struct State {
    /// Moving average of the gradient.
    mean: Components,
    /// Moving average of the squared gradient.
    square: Components,
    /// Steps since the Gaussian was added, for the bias correction.
    age: i32,
}

impl State {
    pub(in crate::encode::fit) const NEW: Self =
        Self { mean: Components::ZERO, square: Components::ZERO, age: 0 };

    /// Makes the next steps a quarter as large. The squares forget it.
    pub(in crate::encode::fit) fn slow_down(&mut self) {
        self.square = Components::from_array(self.square.to_array().map(|square| 16.0 * square));
    }
}

/// One step for one Gaussian.
pub(in crate::encode::fit) fn step(
    components: &mut Components,
    state: &mut State,
    slope: &Slope,
    options: &Adam,
    bounds: Bounds,
    factor: f32,
) {
    let (beta1, beta2) = (options.beta1, options.beta2);
    let gradient = slope.gradient.to_array();
    state.age = state.age.saturating_add(1);
    let age = state.age;
    let rate = factor / (1.0 - beta1.powi(age));
    let unbias = 1.0 / (1.0 - beta2.powi(age));
    let Adam { center, shape, color, .. } = *options;
    let rates = Components::by_attribute(center, shape, color).to_array();
    let [mut mean, mut square] = [state.mean, state.square].map(Components::to_array);
    let mut values = components.to_array();
    // Absent channels have gradients of 0 and take part: a loop of constant length becomes SIMD
    // code.
    for index in 0..MAX_COMPONENTS {
        let (mean, square) = (&mut mean[index], &mut square[index]);
        *mean = beta1 * *mean + (1.0 - beta1) * gradient[index];
        *square = beta2 * *square + (1.0 - beta2) * (gradient[index] * gradient[index]);
        let root = (*square * unbias).sqrt() + options.epsilon;
        // The root is 0 for a parameter on which no pixel depends.
        let step = if root > 0.0 { *mean * rate / root } else { 0.0 };
        values[index] -= rates[index] * step;
    }
    [state.mean, state.square] = [mean, square].map(Components::from_array);
    *components = Components::from_array(values);
    // As in the paper, a covariance may stop being positive definite. It is pruned then.
    if bounds.parameterization == Parameterization::Covariance {
        bounds.clamp_center_and_color(components);
    } else {
        *components = bounds.clamped(*components);
    }
}
