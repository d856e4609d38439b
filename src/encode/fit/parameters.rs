//! The trained values of all Gaussians, and the state of the optimizer that trains them.

use fearless_simd::Level;
use rayon::prelude::*;

use super::backward::Backward;
use super::components::Components;
use super::gauss_newton;
use super::paper::adam;
use super::paper::{QuantizerGradients, add};
use super::rate_term::RateTerm;
use super::state::{States, reordered, retain};
use super::training::Optimizer;
use crate::encode::error::Result;
use crate::encode::progress::Observer;
use crate::gaussian::Parameterization;
use crate::render::splat::Splat;

/// Gaussians that one task steps and sums up.
const CHUNK: usize = 256;

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

    /// Multiplies all lengths by a factor.
    pub(crate) fn scale(&mut self, factor: f32, parameterization: Parameterization) {
        for values in &mut self.values {
            values.center = values.center.map(|at| at * factor);
            values.shape = parameterization.scaled(values.shape, factor);
        }
        self.states.scale(factor);
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
    pub(crate) fn sort(&mut self, observer: &mut Observer<'_>) -> Result<()> {
        // A key with the index below it is compared at once.
        let mut keys = observer.map(self.values.iter().enumerate(), |(index, values)| {
            let [x, y] = values.center;
            u64::from(spread(x) | spread(y) << 1) << 32 | index as u64
        })?;
        keys.par_sort_unstable();
        observer.poll()?;
        // The cast leaves the index.
        let order: Vec<u32> = keys.into_iter().map(|key| key as u32).collect();
        self.values = reordered(&self.values, &order);
        observer.poll()?;
        self.states.reorder(&order);
        Ok(())
    }

    /// Takes one step against the gradients, where `factor` scales all learning rates; Adam does without
    /// the rate term. `splats`, unless it is empty, becomes those of the new values. Returns the gradient by
    /// the quantizers.
    pub(crate) fn step(
        &mut self,
        backward: &Backward<'_>,
        rate_term: Option<RateTerm>,
        factor: f32,
        splats: &mut [Splat],
        observer: &mut Observer<'_>,
    ) -> Result<QuantizerGradients> {
        let &Backward { bounds, quantizers, .. } = backward;
        let values = &mut self.values;
        let by_chunk = match &mut self.states {
            States::Adam(options, states) => {
                let chunks = chunks(values, states, splats);
                observer.map(chunks, |(first, values, states, splats)| {
                    let mut by_quantizers = QuantizerGradients::default();
                    for (index, (values, state)) in (first..).zip(values.iter_mut().zip(states)) {
                        let slope = backward.by_values(index, values, &mut by_quantizers);
                        // A Gaussian whose gradient is not finite stays as it is until it is pruned.
                        if slope.gradient.to_array().iter().all(|value| value.is_finite()) {
                            adam::step(values, state, &slope, options, bounds, factor);
                        }
                    }
                    for (splat, values) in splats.iter_mut().zip(values) {
                        *splat = values.splat(bounds.parameterization);
                    }
                    by_quantizers
                })?
            }
            States::GaussNewton(options, states) => {
                let curvature = backward.tiled.loss.relative_curvature();
                let step = gauss_newton::Step { options, bounds, factor, rate_term, curvature };
                let level = Level::new();
                let chunks = chunks(values, states, splats);
                observer.map(chunks, |(first, values, states, splats)| {
                    let mut by_quantizers = QuantizerGradients::default();
                    match quantizers {
                        None => step.run(
                            level,
                            values,
                            states,
                            splats,
                            #[inline(always)]
                            |index, values| backward.by_splat(first + index, values),
                        ),
                        Some(_) => step.run(level, values, states, splats, |index, values| {
                            backward.in_own_frame(first + index, values, &mut by_quantizers)
                        }),
                    }
                    by_quantizers
                })?
            }
        };
        // Added in the order of the Gaussians, so that the sum does not depend on the threads.
        let mut total = QuantizerGradients::default();
        by_chunk.iter().for_each(|sum| add(&mut total, sum));
        Ok(total)
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

/// Values, states, and splats if there are any, in chunks, with the index of the first of each.
fn chunks<'a, State>(
    values: &'a mut [Components],
    states: &'a mut [State],
    mut splats: &'a mut [Splat],
) -> impl ExactSizeIterator<Item = (usize, &'a mut [Components], &'a mut [State], &'a mut [Splat])>
{
    let chunks = values.chunks_mut(CHUNK).zip(states.chunks_mut(CHUNK)).enumerate();
    chunks.map(move |(chunk, (values, states))| {
        let count = splats.len().min(values.len());
        let splats = splats.split_off_mut(..count).expect("there are so many");
        (chunk * CHUNK, values, states, splats)
    })
}
