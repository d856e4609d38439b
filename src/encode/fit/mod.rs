//! The fit of Gaussians to a picture (paper, section "Methodology").

mod adam;
mod backward;
mod bins;
pub(crate) mod budget;
mod checkpoint;
mod components;
mod densify;
mod gauss_newton;
mod growth;
mod lsq;
mod parameterization;
mod parameters;
mod pass;
mod rate_term;
mod schedule;
mod state;
mod trained;
pub(crate) mod training;
mod training_loop;
mod training_tile;
pub(crate) mod vector_quantizer;

pub(crate) use trained::{Fit, Work};
