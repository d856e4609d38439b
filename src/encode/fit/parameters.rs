//! The trained values of all Gaussians, and the state of the optimizer that trains them.

use rayon::prelude::*;

use super::row::{Row, RowBounds};
use super::state::{Slope, States, retain};
use super::training::Optimizer;
use super::{adam, gauss_newton};

/// Gaussians that one task steps and sums up.
const CHUNK: usize = 256;

/// Trained values with their optimizer.
#[derive(Debug)]
pub(crate) struct Parameters {
    pub(crate) values: Vec<Row>,
    states: States,
}

impl Parameters {
    /// Without Gaussians.
    pub(crate) fn new(optimizer: &Optimizer) -> Self {
        Self { values: Vec::new(), states: States::new(optimizer) }
    }

    pub(crate) fn len(&self) -> usize {
        self.values.len()
    }

    /// Adds Gaussians, and allocates no memory for more.
    pub(crate) fn extend(&mut self, rows: &[Row]) {
        self.values.reserve_exact(rows.len());
        self.values.extend_from_slice(rows);
        self.states.extend(self.values.len());
    }

    /// Replaces all Gaussians by those of `values`; the optimizer starts again.
    pub(crate) fn replace(&mut self, values: Vec<Row>) {
        self.states.clear();
        self.states.extend(values.len());
        self.values = values;
    }

    /// Removes the Gaussians for whose index `keep` is false.
    pub(crate) fn retain(&mut self, keep: impl Fn(usize) -> bool) {
        retain(&mut self.values, &keep);
        self.states.retain(keep);
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
        self.states.reorder(order.iter().map(|&(_, index)| index as usize));
    }

    /// Takes one step against the gradients, which `slope` returns for an index and its row.
    /// `factor` scales all learning rates. `slope` may also add to a sum; there is one for every
    /// [`CHUNK`] Gaussians, and all of them are returned in order.
    pub(crate) fn step<Sum: Default + Send>(
        &mut self,
        bounds: RowBounds,
        factor: f32,
        slope: impl Fn(usize, &Row, &mut Sum) -> Slope + Sync,
    ) -> Vec<Sum> {
        let values = &mut self.values;
        match &mut self.states {
            States::Adam(options, states) => {
                step_all(values, states, slope, |row, state, slope| {
                    adam::step(row, state, slope, options, bounds, factor);
                })
            }
            States::GaussNewton(options, states) => {
                step_all(values, states, slope, |row, state, slope| {
                    gauss_newton::step(row, state, slope, options, bounds, factor);
                })
            }
        }
    }

    /// Size in bytes.
    pub(crate) fn memory(&self) -> usize {
        self.values.capacity() * size_of::<Row>() + self.states.memory()
    }
}

/// Takes a step for every Gaussian, and returns the sums in order.
fn step_all<State: Send, Sum: Default + Send>(
    values: &mut [Row],
    states: &mut [State],
    slope: impl Fn(usize, &Row, &mut Sum) -> Slope + Sync,
    step: impl Fn(&mut Row, &mut State, &Slope) + Sync,
) -> Vec<Sum> {
    let chunks = values.par_chunks_mut(CHUNK).zip(states.par_chunks_mut(CHUNK)).enumerate();
    let sums = chunks.map(|(chunk, (values, states))| {
        let mut sum = Sum::default();
        let rows = values.iter_mut().zip(states);
        for (index, (row, state)) in (chunk * CHUNK..).zip(rows) {
            let slope = slope(index, row, &mut sum);
            // A Gaussian whose gradient is not finite stays as it is until it is pruned.
            if slope.gradient.iter().all(|value| value.is_finite()) {
                step(row, state, &slope);
            }
        }
        sum
    });
    sums.collect()
}
