//! The policy about layers: how Gaussians are shared out among them, how many a small output takes,
//! and which of them show in a region.

pub(crate) mod bounds;
pub(crate) mod plan;
