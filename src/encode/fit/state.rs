//! What the optimizers keep for the Gaussians.

use rayon::prelude::*;

use super::gauss_newton;
use super::paper::adam;
use super::training::{Adam, GaussNewton, Optimizer};

/// The fewest items that another thread is asked to copy.
const LEAST_COPIES: usize = 1 << 11;

/// An optimizer with its states, one for each Gaussian.
#[derive(Debug)]
pub(super) enum States {
    Adam(Adam, Vec<adam::State>),
    GaussNewton(GaussNewton, Vec<gauss_newton::State>),
}

impl States {
    /// Without Gaussians.
    pub(super) fn new(optimizer: &Optimizer) -> Self {
        match optimizer {
            Optimizer::Adam(options) => Self::Adam(options.clone(), Vec::new()),
            Optimizer::GaussNewton(options) => Self::GaussNewton(options.clone(), Vec::new()),
        }
    }

    /// Adds states of new Gaussians, so that there are `count`, and allocates no memory for more.
    pub(super) fn extend(&mut self, count: usize) {
        match self {
            Self::Adam(_, states) => extend(states, count, adam::State::NEW),
            Self::GaussNewton(_, states) => extend(states, count, gauss_newton::State::NEW),
        }
    }

    /// Goes on where all lengths are larger by a factor, and sums over pixels by its square.
    pub(super) fn scale(&mut self, factor: f32) {
        match self {
            // Its averages are those of gradients by the trained values, which begin anew.
            Self::Adam(_, states) => states.fill(adam::State::NEW),
            Self::GaussNewton(_, states) => {
                states.iter_mut().for_each(|state| state.scale(factor * factor));
            }
        }
    }

    pub(super) fn clear(&mut self) {
        match self {
            Self::Adam(_, states) => states.clear(),
            Self::GaussNewton(_, states) => states.clear(),
        }
    }

    /// Makes the steps smaller of Gaussians for whose index `is_slow` is true.
    pub(super) fn slow_down(&mut self, is_slow: impl Fn(usize) -> bool) {
        match self {
            Self::Adam(_, states) => slow_down(states, is_slow, adam::State::slow_down),
            Self::GaussNewton(_, states) => {
                slow_down(states, is_slow, gauss_newton::State::slow_down);
            }
        }
    }

    /// Removes the states for whose index `keep` is false.
    pub(super) fn retain(&mut self, keep: impl Fn(usize) -> bool) {
        match self {
            Self::Adam(_, states) => retain(states, keep),
            Self::GaussNewton(_, states) => retain(states, keep),
        }
    }

    /// Puts the states at these indices in this order.
    pub(super) fn reorder(&mut self, order: &[u32]) {
        match self {
            Self::Adam(_, states) => *states = reordered(states, order),
            Self::GaussNewton(_, states) => *states = reordered(states, order),
        }
    }

    /// Size in bytes.
    pub(super) fn memory(&self) -> usize {
        match self {
            Self::Adam(_, states) => states.capacity() * size_of::<adam::State>(),
            Self::GaussNewton(_, states) => states.capacity() * size_of::<gauss_newton::State>(),
        }
    }
}

fn extend<T: Copy>(states: &mut Vec<T>, count: usize, new: T) {
    states.reserve_exact(count.saturating_sub(states.len()));
    states.resize(count, new);
}

fn slow_down<T>(states: &mut [T], is_slow: impl Fn(usize) -> bool, slow_down: impl Fn(&mut T)) {
    let slow = states.iter_mut().enumerate().filter(|(index, _)| is_slow(*index));
    slow.for_each(|(_, state)| slow_down(state));
}

/// The items at these indices in this order.
pub(super) fn reordered<T: Copy + Send + Sync>(items: &[T], order: &[u32]) -> Vec<T> {
    let items = order.par_iter().with_min_len(LEAST_COPIES).map(|&index| items[index as usize]);
    items.collect()
}

/// Removes the items for whose index `keep` is false.
pub(super) fn retain<T>(items: &mut Vec<T>, keep: impl Fn(usize) -> bool) {
    let mut index = 0..;
    items.retain(|_| keep(index.next().expect("endless")));
}
