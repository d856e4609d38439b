//! The trained values of all Gaussians, and the state of the optimizer that trains them.

use fearless_simd::Level;
use rayon::prelude::*;

use super::components::{Bounds, Components, Slope};
use super::gauss_newton::blocks::BlockStep;
use super::pass::SplatGradient;
use super::rate_term::RateTerm;
use super::state::{States, reordered, retain};
use super::training::Optimizer;
use super::{adam, gauss_newton};
use crate::encode::error::EncodeError;
use crate::encode::progress::Observer;
use crate::gaussian::Parameterization;
use crate::render::splat::Splat;

/// Gaussians that one task steps and sums up.
const CHUNK: usize = 256;
/// Work to step a Gaussian, alone and in a block.
const WORK: f64 = 200.0;
const WORK_IN_BLOCK: f64 = 40.0;
/// Work to find the place of a Gaussian on the Z curve.
const WORK_TO_SORT: f64 = 3.0;

/// Trained values with their optimizer.
#[derive(Debug)]
pub(crate) struct Parameters {
    pub(crate) values: Vec<Components>,
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
    pub(crate) fn extend(&mut self, values: &[Components]) {
        self.values.reserve_exact(values.len());
        self.values.extend_from_slice(values);
        self.states.extend(self.values.len());
    }

    /// Replaces all Gaussians by those of `values`; the optimizer starts again.
    pub(crate) fn replace(&mut self, values: Vec<Components>) {
        self.states.clear();
        self.states.extend(values.len());
        self.values = values;
    }

    /// Lets the Gaussians for whose values `is_slow` is true take smaller steps.
    pub(crate) fn slow_down(&mut self, is_slow: impl Fn(&Components) -> bool) {
        self.states.slow_down(|index| is_slow(&self.values[index]));
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
        let chunks = self.values.chunks(CHUNK).enumerate();
        // A key with the index below it is compared at once.
        let keys = observer.map(WORK_TO_SORT * CHUNK as f64, chunks, |(chunk, values)| {
            let key = |(index, components): (usize, &Components)| {
                let [x, y] = components.center;
                u64::from(spread(x) | spread(y) << 1) << 32 | index as u64
            };
            (chunk * CHUNK..).zip(values).map(key).collect::<Vec<u64>>()
        })?;
        let mut keys = keys.concat();
        keys.par_sort_unstable();
        observer.poll()?;
        // The cast leaves the index.
        let order: Vec<u32> = keys.into_iter().map(|key| key as u32).collect();
        self.values = reordered(&self.values, &order);
        observer.poll()?;
        self.states.reorder(&order);
        Ok(())
    }

    /// Takes one step against the gradients, which `slope` returns for an index and its values.
    /// `factor` scales all learning rates. `slope` may also add to a sum; there is one for every
    /// [`CHUNK`] Gaussians, and all of them are returned in order.
    ///
    /// # Errors
    /// [`EncodeError::Cancelled`] when the caller cancels.
    pub(crate) fn step<Sum: Default + Send>(
        &mut self,
        bounds: Bounds,
        factor: f32,
        observer: &mut Observer<'_>,
        slope: impl Fn(usize, &Components, &mut Sum) -> Slope + Send + Sync,
    ) -> Result<Vec<Sum>, EncodeError> {
        let values = &mut self.values;
        match &mut self.states {
            States::Adam(options, states) => {
                step_all(values, states, observer, slope, |components, state, slope| {
                    adam::step(components, state, slope, options, bounds, factor);
                })
            }
            States::GaussNewton(options, states) => {
                step_all(values, states, observer, slope, |components, state, slope| {
                    gauss_newton::step(components, state, slope, options, bounds, factor);
                })
            }
        }
    }

    /// Takes the steps of [`Self::step`] in blocks, if there is code for that. `slope` returns, for an
    /// index and its values, the gradient of the pass and how much a squared error counts there. `splats`,
    /// unless it is empty, becomes those of the new values. Returns whether the steps were taken.
    ///
    /// # Errors
    /// [`EncodeError::Cancelled`] when the caller cancels.
    pub(crate) fn step_in_blocks(
        &mut self,
        bounds: Bounds,
        factor: f32,
        rate_term: Option<RateTerm>,
        mut splats: &mut [Splat],
        observer: &mut Observer<'_>,
        slope: impl Fn(usize, &Components) -> (SplatGradient, f32) + Send + Sync,
    ) -> Result<bool, EncodeError> {
        let (States::GaussNewton(options, states), Parameterization::Cholesky) =
            (&mut self.states, bounds.parameterization)
        else {
            return Ok(false);
        };
        let step = BlockStep { options, bounds, factor, rate_term };
        let level = Level::new();
        let chunks = self.values.chunks_mut(CHUNK).zip(states.chunks_mut(CHUNK)).enumerate();
        let chunks = chunks.map(|(chunk, (values, states))| {
            let count = splats.len().min(values.len());
            let splats = splats.split_off_mut(..count).expect("there are so many");
            (chunk * CHUNK, values, states, splats)
        });
        observer.map(WORK_IN_BLOCK * CHUNK as f64, chunks, |(first, values, states, splats)| {
            step.run(
                level,
                values,
                states,
                splats,
                #[inline(always)]
                |index, components| slope(first + index, components),
            );
        })?;
        Ok(true)
    }

    /// Size in bytes.
    pub(crate) fn memory(&self) -> usize {
        self.values.capacity() * size_of::<Components>() + self.states.memory()
    }
}

/// A coordinate in units of four pixels, with a bit of 0 before each of its 16 bits.
fn spread(value: f32) -> u32 {
    // The cast saturates.
    let mut bits = (value / 4.0) as u32 & 0xffff;
    for (shift, mask) in [(8, 0x00ff_00ff), (4, 0x0f0f_0f0f), (2, 0x3333_3333), (1, 0x5555_5555)] {
        bits = (bits | bits << shift) & mask;
    }
    bits
}

/// Takes a step for every Gaussian, and returns the sums in order.
fn step_all<State: Send, Sum: Default + Send>(
    values: &mut [Components],
    states: &mut [State],
    observer: &mut Observer<'_>,
    slope: impl Fn(usize, &Components, &mut Sum) -> Slope + Send + Sync,
    step: impl Fn(&mut Components, &mut State, &Slope) + Send + Sync,
) -> Result<Vec<Sum>, EncodeError> {
    let chunks = values.chunks_mut(CHUNK).zip(states.chunks_mut(CHUNK)).enumerate();
    observer.map(WORK * CHUNK as f64, chunks, |(chunk, (values, states))| {
        let mut sum = Sum::default();
        let each = values.iter_mut().zip(states);
        for (index, (components, state)) in (chunk * CHUNK..).zip(each) {
            let slope = slope(index, components, &mut sum);
            // A Gaussian whose gradient is not finite stays as it is until it is pruned.
            if slope.gradient.to_array().iter().all(|value| value.is_finite()) {
                step(components, state, &slope);
            }
        }
        sum
    })
}
