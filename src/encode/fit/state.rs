//! What a step of an optimizer takes and keeps for one Gaussian.

use super::row::Row;
use crate::gaussian::MAX_COMPONENTS;

/// The pace of a new Gaussian: it is born with others that see the same residuals, and at full pace
/// all of them would take the same step, and never come to rest.
pub(super) const FIRST_PACE: f32 = 0.4;

/// The optimizer's state for one Gaussian.
#[derive(Clone, Copy, Debug)]
pub(super) struct State {
    /// Moving average of the gradient.
    pub(super) mean: Row,
    /// Moving average of the squared gradient, for Adam.
    pub(super) square: Row,
    /// The factor on Gauss-Newton steps.
    pub(super) pace: f32,
    /// Steps since the Gaussian was added, for the bias correction.
    pub(super) age: u32,
}

impl State {
    pub(super) const NEW: Self = Self {
        mean: [0.0; MAX_COMPONENTS],
        square: [0.0; MAX_COMPONENTS],
        pace: FIRST_PACE,
        age: 0,
    };

    /// Counts a step, and returns how many there have been.
    pub(super) fn aged(&mut self) -> i32 {
        self.age += 1;
        self.age.min(i32::MAX as u32) as i32
    }
}

/// What the step of a Gaussian depends on.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Slope {
    pub(crate) gradient: Row,
    /// How much a squared error counts there.
    pub(crate) sensitivity: f32,
}
