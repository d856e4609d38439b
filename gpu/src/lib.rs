#![doc = include_str!("../README.md")]

mod device;
mod error;
mod picture;
mod pipelines;
mod renderer;
mod view;
mod work;

pub use error::RenderError;
pub use picture::GpuPicture;
pub use renderer::GpuRenderer;
pub use view::View;

/// The compute shader in WGSL, whose comments say how to use it. Browsers run the same.
pub const SHADER: &str = include_str!("render.wgsl");
