//! Symbols to bytes and back (spec, section 7).

pub(crate) mod account;
mod bits;
pub(crate) mod fixed;
#[cfg(all(fuzzing, feature = "encode"))]
pub mod fuzzing;
pub(crate) mod layers;
mod rans;
mod search;
pub(crate) mod set;
mod tables;
