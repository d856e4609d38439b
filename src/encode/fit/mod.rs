//! The fit of Gaussians to a picture (paper, section "Methodology").

mod backward;
mod bins;
pub(crate) mod budget;
mod checkpoint;
mod components;
mod custom_placement;
mod densify;
mod gauss_newton;
mod growth;
mod paper;
mod parameterization;
mod parameters;
mod pass;
mod rate_term;
mod schedule;
mod state;
mod tile_block;
mod trained;
pub(crate) mod training;
mod training_loop;
mod training_tile;

pub(crate) use components::MOST_COLOR;
pub use custom_placement::{CustomPlacement, ErrorMap};
pub use paper::VectorQuantizer;
pub(crate) use paper::quantizers_for;
pub(crate) use trained::{Fit, Work};
