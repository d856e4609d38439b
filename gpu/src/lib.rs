#![doc = include_str!("../README.md")]
#![allow(clippy::duplicate_mod, reason = "`over_wgpu` is compiled for each version")]

mod view;
mod work;

/// The renderer over `wgpu` 29.
#[cfg(feature = "wgpu-29")]
#[path = "."]
pub mod wgpu_29 {
    pub use ::wgpu_29 as wgpu;

    mod over_wgpu;

    pub use over_wgpu::{GpuPicture, GpuRenderer, RenderError};

    /// The bytes of a buffer that is mapped.
    fn mapped(buffer: &wgpu::Buffer) -> Result<wgpu::BufferView, RenderError> {
        Ok(buffer.get_mapped_range(..))
    }
}

/// The renderer over `wgpu` 30, which the root of the crate has as well.
#[cfg(feature = "wgpu-30")]
#[path = "."]
pub mod wgpu_30 {
    pub use ::wgpu;

    mod over_wgpu;

    pub use over_wgpu::{GpuPicture, GpuRenderer, RenderError};

    /// The bytes of a buffer that is mapped.
    fn mapped(buffer: &wgpu::Buffer) -> Result<wgpu::BufferView, RenderError> {
        buffer.get_mapped_range(..).map_err(|error| RenderError::Read(Box::new(error)))
    }
}

pub use view::View;
#[cfg(feature = "wgpu-30")]
pub use wgpu_30::{GpuPicture, GpuRenderer, RenderError};

/// The compute shader in WGSL, whose comments say how to use it. Browsers run the same.
pub const SHADER: &str = include_str!("render.wgsl");
