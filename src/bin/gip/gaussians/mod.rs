//! Gaussians in the formats of other programs: `gip export` and `gip import`.

mod export;
mod format;
mod import;
mod json;
mod model;
mod npy;
mod npz;
mod ply;
mod svg;
mod zip;

pub(crate) use export::run as export;
pub(crate) use import::run as import;
