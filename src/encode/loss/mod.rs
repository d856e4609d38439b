//! The loss, which the fit and the descent minimize: what an error is, how much it counts at its place and
//! on its scale, and its gradient. What changes the loss changes this room alone.

mod activity;
mod color_curvature;
mod error;
mod gradient;
mod perceptual_weights;
mod picture_loss;
mod placement;

pub(crate) use activity::BLOCK;
pub(crate) use color_curvature::{ColorCurvature, Matrix};
pub(crate) use error::{Distortion, RenderingError, SquaredError};
#[cfg(test)]
pub(crate) use gradient::plain_distortion;
pub(crate) use perceptual_weights::PerceptualWeights;
pub(crate) use picture_loss::{PictureLoss, residual};
pub use placement::ErrorNorm;
