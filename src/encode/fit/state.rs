//! What the optimizers keep for the Gaussians.

use super::training::{Adam, GaussNewton, Optimizer};
use super::{adam, gauss_newton};

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

    pub(super) fn clear(&mut self) {
        match self {
            Self::Adam(_, states) => states.clear(),
            Self::GaussNewton(_, states) => states.clear(),
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
    pub(super) fn reorder(&mut self, order: impl Iterator<Item = usize>) {
        match self {
            Self::Adam(_, states) => *states = order.map(|index| states[index]).collect(),
            Self::GaussNewton(_, states) => *states = order.map(|index| states[index]).collect(),
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

/// Removes the items for whose index `keep` is false.
pub(super) fn retain<T>(items: &mut Vec<T>, keep: impl Fn(usize) -> bool) {
    let mut index = 0..;
    items.retain(|_| keep(index.next().expect("endless")));
}
