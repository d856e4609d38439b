//! Rate-distortion optimization: turns Gaussians into codes of the entropy coding that meet a
//! target.
//!
//! `target_search` searches for the quantization step and the Lagrange multiplier with which a file
//! meets its target. `code_optimizer` rounds Gaussians to the quantization grid of a step and improves their
//! codes by passes of coordinate descent, in the order of `rounds`.

mod code_optimizer;
mod coordinate_descent;
mod kernel_weights;
mod residuals;
mod rounds;
mod search_work;
mod step_search;
mod target_search;
mod window;

pub(crate) use residuals::is_seen;
pub(crate) use search_work::SearchWork;
pub(crate) use target_search::TargetSearch;
