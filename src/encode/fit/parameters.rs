//! The trained values of all Gaussians, and the state of the optimizer that trains them.

use rayon::prelude::*;

use super::row::{Row, RowBounds};
use super::state::{Slope, State};
use super::training::Optimizer;
use super::{adam, gauss_newton};
use crate::encode::error::EncodeError;
use crate::encode::progress::Observer;

/// Gaussians that one task steps and sums up.
const CHUNK: usize = 256;
/// Work to step a Gaussian.
const WORK: f64 = 200.0;

/// Trained values and their optimizer state, one entry of each per Gaussian.
#[derive(Debug, Default)]
pub(crate) struct Parameters {
    pub(crate) values: Vec<Row>,
    states: Vec<State>,
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
        self.states.resize(self.values.len(), State::NEW);
    }

    /// Replaces all Gaussians by those of `values`; the optimizer starts again.
    pub(crate) fn replace(&mut self, values: Vec<Row>) {
        self.states.clear();
        self.states.resize(values.len(), State::NEW);
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
    ///
    /// # Errors
    /// [`EncodeError::Cancelled`] when the caller cancels.
    pub(crate) fn sort(&mut self, observer: &mut Observer<'_>) -> Result<(), EncodeError> {
        let spread = |value: f32| {
            // The bits of the other coordinate go between those of this one.
            (0..16).fold(0, |sum, bit| sum | (value.max(0.0) as u32 >> bit & 1) << (2 * bit))
        };
        let mut order: Vec<(u32, u32)> = (0..)
            .zip(&self.values)
            .map(|(index, row)| (spread(row[0] / 4.0) | spread(row[1] / 4.0) << 1, index))
            .collect();
        observer.poll()?;
        order.par_sort_unstable();
        observer.poll()?;
        self.values = order.iter().map(|&(_, index)| self.values[index as usize]).collect();
        observer.poll()?;
        self.states = order.iter().map(|&(_, index)| self.states[index as usize]).collect();
        Ok(())
    }

    /// Takes one step against the gradients, which `slope` returns for an index and its row.
    /// `factor` scales all learning rates. `slope` may also add to a sum; there is one for every
    /// [`CHUNK`] Gaussians, and all of them are returned in order.
    ///
    /// # Errors
    /// [`EncodeError::Cancelled`] when the caller cancels.
    pub(crate) fn step<Sum: Default + Send>(
        &mut self,
        optimizer: &Optimizer,
        bounds: RowBounds,
        factor: f32,
        observer: &mut Observer<'_>,
        slope: impl Fn(usize, &Row, &mut Sum) -> Slope + Send + Sync,
    ) -> Result<Vec<Sum>, EncodeError> {
        let values = self.values.chunks_mut(CHUNK);
        let chunks = values.zip(self.states.chunks_mut(CHUNK)).enumerate();
        observer.map(WORK * CHUNK as f64, chunks, |(chunk, (values, states))| {
            let mut sum = Sum::default();
            let rows = values.iter_mut().zip(states);
            for (index, (row, state)) in (chunk * CHUNK..).zip(rows) {
                let slope = slope(index, row, &mut sum);
                // A Gaussian whose gradient is not finite stays as it is until it is pruned.
                if !slope.gradient.iter().all(|value| value.is_finite()) {
                    continue;
                }
                match optimizer {
                    Optimizer::Adam(options) => {
                        adam::step(row, state, &slope.gradient, options, bounds, factor);
                    }
                    Optimizer::GaussNewton(options) => {
                        gauss_newton::step(row, state, &slope, options, bounds, factor);
                    }
                }
            }
            sum
        })
    }

    /// Size in bytes.
    pub(crate) fn memory(&self) -> usize {
        self.values.capacity() * size_of::<Row>() + self.states.capacity() * size_of::<State>()
    }
}
