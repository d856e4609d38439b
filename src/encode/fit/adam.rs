//! The trained values of all Gaussians, and Adam, the optimizer that trains them.

use glam::Vec2;
use rayon::prelude::*;

use super::parameterization::StepFrame;
use super::row::{Row, RowBounds, shape_of};
use super::training;
use crate::gaussian::{MAX_COMPONENTS, Parameterization};

/// Gaussians that one task steps and sums up.
const CHUNK: usize = 256;

/// Adam's state for one Gaussian.
#[derive(Clone, Copy, Debug)]
struct AdamState {
    /// Moving averages of the gradient and of its square.
    mean: Row,
    square: Row,
    /// Steps since the Gaussian was added, for the bias correction.
    age: u32,
}

impl AdamState {
    const NEW: Self = Self { mean: [0.0; MAX_COMPONENTS], square: [0.0; MAX_COMPONENTS], age: 0 };
}

/// Trained values and their optimizer state, one entry of each per Gaussian.
#[derive(Debug, Default)]
pub(crate) struct Parameters {
    pub(crate) values: Vec<Row>,
    states: Vec<AdamState>,
}

impl Parameters {
    pub(crate) fn len(&self) -> usize {
        self.values.len()
    }

    /// Adds Gaussians, and allocates no memory for more.
    pub(crate) fn extend(&mut self, rows: &[Row]) {
        self.values.reserve_exact(rows.len());
        self.values.extend_from_slice(rows);
        self.states.reserve_exact(rows.len());
        self.states.resize(self.values.len(), AdamState::NEW);
    }

    /// Replaces all Gaussians by those of `values`; Adam starts again.
    pub(crate) fn replace(&mut self, values: Vec<Row>) {
        self.states.clear();
        self.states.resize(values.len(), AdamState::NEW);
        self.values = values;
    }

    /// Removes the Gaussians for whose index `keep` is false.
    pub(crate) fn retain(&mut self, keep: impl Fn(usize) -> bool) {
        let mut index = 0..;
        self.values.retain(|_| keep(index.next().expect("endless")));
        let mut index = 0..;
        self.states.retain(|_| keep(index.next().expect("endless")));
    }

    /// Sorts the Gaussians along a Z curve, so that neighbours in the picture are neighbours in
    /// memory.
    pub(crate) fn sort(&mut self) {
        let spread = |value: f32| {
            // The bits of the other coordinate go between those of this one.
            (0..16).fold(0, |sum, bit| sum | (value.max(0.0) as u32 >> bit & 1) << (2 * bit))
        };
        let mut order: Vec<(u32, u32)> = (0..)
            .zip(&self.values)
            .map(|(index, row)| (spread(row[0] / 4.0) | spread(row[1] / 4.0) << 1, index))
            .collect();
        order.par_sort_unstable();
        self.values = order.iter().map(|&(_, index)| self.values[index as usize]).collect();
        self.states = order.iter().map(|&(_, index)| self.states[index as usize]).collect();
    }

    /// Takes one step against the gradients, which `gradient` returns for an index and its row.
    /// `factor` scales all learning rates. `gradient` may also add to a sum; there is one for every
    /// [`CHUNK`] Gaussians, and all of them are returned in order.
    pub(crate) fn step<Sum: Default + Send>(
        &mut self,
        options: &training::Optimizer,
        bounds: RowBounds,
        factor: f32,
        gradient: impl Fn(usize, &Row, &mut Sum) -> Row + Sync,
    ) -> Vec<Sum> {
        let values = self.values.par_chunks_mut(CHUNK);
        let chunks = values.zip(self.states.par_chunks_mut(CHUNK)).enumerate();
        let sums = chunks.map(|(chunk, (values, states))| {
            let mut sum = Sum::default();
            let rows = values.iter_mut().zip(states);
            for (index, (row, state)) in (chunk * CHUNK..).zip(rows) {
                let gradient = gradient(index, row, &mut sum);
                // A Gaussian whose gradient is not finite stays as it is until it is pruned.
                if gradient.iter().all(|value| value.is_finite()) {
                    step(row, state, &gradient, options, bounds, factor);
                }
            }
            sum
        });
        sums.collect()
    }

    /// Size in bytes.
    pub(crate) fn memory(&self) -> usize {
        self.values.capacity() * size_of::<Row>() + self.states.capacity() * size_of::<AdamState>()
    }
}

/// One step of Adam for one Gaussian.
fn step(
    row: &mut Row,
    state: &mut AdamState,
    gradient: &Row,
    options: &training::Optimizer,
    bounds: RowBounds,
    factor: f32,
) {
    let is_relative = options.units == training::Units::Relative;
    let frame = if is_relative {
        StepFrame::relative(bounds.parameterization, shape_of(row))
    } else {
        StepFrame::ABSOLUTE
    };
    let mut gradient = *gradient;
    let center = frame.center.transpose() * Vec2::from_slice(&gradient);
    let shape = frame.shape.transpose() * shape_of(&gradient);
    gradient[..2].copy_from_slice(&center.to_array());
    gradient[2..5].copy_from_slice(&shape.to_array());

    let (beta1, beta2) = (options.beta1, options.beta2);
    state.age += 1;
    let age = state.age.min(i32::MAX as u32) as i32;
    let rate = factor / (1.0 - beta1.powi(age));
    let unbias = 1.0 / (1.0 - beta2.powi(age));
    let mut steps = [0.0; MAX_COMPONENTS];
    // Absent channels have gradients of 0 and take part: a loop of constant length becomes SIMD
    // code.
    for index in 0..MAX_COMPONENTS {
        let (mean, square) = (&mut state.mean[index], &mut state.square[index]);
        *mean = beta1 * *mean + (1.0 - beta1) * gradient[index];
        *square = beta2 * *square + (1.0 - beta2) * (gradient[index] * gradient[index]);
        let root = (*square * unbias).sqrt() + options.epsilon;
        // The root is 0 for a parameter on which no pixel depends.
        steps[index] = if root > 0.0 { *mean * rate / root } else { 0.0 };
    }
    let center = frame.center * Vec2::from_slice(&steps) * options.center;
    let shape = shape_of(row) - frame.shape * shape_of(&steps) * options.shape;
    row[0] -= center.x;
    row[1] -= center.y;
    row[2..5].copy_from_slice(&shape.to_array());
    for (value, step) in row[5..].iter_mut().zip(&steps[5..]) {
        *value -= options.color * step;
    }
    // As in the paper, a covariance that is trained in absolute units may stop being positive
    // definite. It is pruned then.
    if is_relative || bounds.parameterization != Parameterization::Covariance {
        *row = bounds.clamped(*row);
    } else {
        bounds.clamp_position_and_color(row);
    }
}
