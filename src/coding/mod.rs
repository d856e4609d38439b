//! Symbols to bytes and back (spec, section 7).

mod bits;
pub(crate) mod fixed;
mod rans;
pub(crate) mod set;
mod tables;
