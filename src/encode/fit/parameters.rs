//! The trained values of all Gaussians, and the state of the optimizer that trains them.

use fearless_simd::Level;
use rayon::prelude::*;

use super::gauss_newton::blocks::BlockStep;
use super::pass::SplatGradient;
use super::row::{Row, RowBounds, Slope};
use super::state::{States, retain};
use super::training::Optimizer;
use super::{adam, gauss_newton};
use crate::encode::error::EncodeError;
use crate::encode::progress::Observer;
use crate::encode::rate_model::RateTerm;
use crate::gaussian::Parameterization;

/// Gaussians that one task steps and sums up.
const CHUNK: usize = 256;
/// Work to step a Gaussian, alone and in a block.
const WORK: f64 = 200.0;
const WORK_IN_BLOCK: f64 = 40.0;

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
        self.states.reorder(order.iter().map(|&(_, index)| index as usize));
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
        bounds: RowBounds,
        factor: f32,
        observer: &mut Observer<'_>,
        slope: impl Fn(usize, &Row, &mut Sum) -> Slope + Send + Sync,
    ) -> Result<Vec<Sum>, EncodeError> {
        let values = &mut self.values;
        match &mut self.states {
            States::Adam(options, states) => {
                step_all(values, states, observer, slope, |row, state, slope| {
                    adam::step(row, state, slope, options, bounds, factor);
                })
            }
            States::GaussNewton(options, states) => {
                step_all(values, states, observer, slope, |row, state, slope| {
                    gauss_newton::step(row, state, slope, options, bounds, factor);
                })
            }
        }
    }

    /// Takes the steps of [`Self::step`] in blocks, if there is code for that. `slope` returns, for an
    /// index and its row, the gradient of the pass and how much a squared error counts there. Returns
    /// whether the steps were taken.
    ///
    /// # Errors
    /// [`EncodeError::Cancelled`] when the caller cancels.
    pub(crate) fn step_in_blocks(
        &mut self,
        bounds: RowBounds,
        factor: f32,
        rate_term: Option<RateTerm>,
        observer: &mut Observer<'_>,
        slope: impl Fn(usize, &Row) -> (SplatGradient, f32) + Send + Sync,
    ) -> Result<bool, EncodeError> {
        let (States::GaussNewton(options, states), Parameterization::Cholesky) =
            (&mut self.states, bounds.parameterization)
        else {
            return Ok(false);
        };
        let step = BlockStep { options, bounds, factor, rate_term };
        let level = Level::new();
        let chunks = self.values.chunks_mut(CHUNK).zip(states.chunks_mut(CHUNK)).enumerate();
        observer.map(WORK_IN_BLOCK * CHUNK as f64, chunks, |(chunk, (rows, states))| {
            step.run(level, rows, states, |index, row| slope(chunk * CHUNK + index, row));
        })?;
        Ok(true)
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
    observer: &mut Observer<'_>,
    slope: impl Fn(usize, &Row, &mut Sum) -> Slope + Send + Sync,
    step: impl Fn(&mut Row, &mut State, &Slope) + Send + Sync,
) -> Result<Vec<Sum>, EncodeError> {
    let chunks = values.chunks_mut(CHUNK).zip(states.chunks_mut(CHUNK)).enumerate();
    observer.map(WORK * CHUNK as f64, chunks, |(chunk, (values, states))| {
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
    })
}
