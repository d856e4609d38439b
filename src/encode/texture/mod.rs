//! The texture of a picture: what its source has of fine, irregular detail that the Gaussians do not show, as
//! amplitudes of the patterns that every decoder has.
//!
//! `cells` compares the source with a rendering, by the `bands` of both; `strengths` tells what is missing at
//! each node of the map, and `fit` codes the map.

mod bands;
mod cells;
mod fit;
mod strengths;

pub(crate) use fit::{STEP, USUAL_STRENGTH, payload};
