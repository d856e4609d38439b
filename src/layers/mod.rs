//! Decisions about layers: how an encoder divides the Gaussians among them, how many Gaussians a
//! small output needs, and which layers show in a region.

pub(crate) mod bounds;
pub(crate) mod plan;
