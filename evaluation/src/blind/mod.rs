//! The blind choice: people say which of two pictures is nearer to the original, and do not know
//! what they compare.
//!
//! There are only declarations here, so that no module has to import its parent.

mod binomial;
pub(crate) mod choices;
mod key;
pub(crate) mod triplets;
