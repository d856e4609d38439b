//! Rate-distortion optimisation: Gaussians to codes of the entropy coding that meet a target.

mod code_optimizer;
mod coordinate_descent;
mod quadratic_model;
mod residuals;
mod step_search;
mod target_search;
mod window;

pub(crate) use residuals::Residuals;
pub(crate) use target_search::TargetSearch;
