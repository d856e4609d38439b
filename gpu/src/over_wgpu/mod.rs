//! All that calls `wgpu`: that of the module which this one is in.

mod device;
mod error;
mod picture;
mod pipelines;
mod renderer;

pub use error::RenderError;
pub use picture::GpuPicture;
pub use renderer::GpuRenderer;

use super::{mapped, wgpu};
