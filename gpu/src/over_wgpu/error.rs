//! Why a picture is not rendered.

use image_gip::{DecodeError, RequestError};
use thiserror::Error;

use super::wgpu;

/// Why a picture was not rendered.
#[derive(Debug, Error)]
#[non_exhaustive]
pub enum RenderError {
    /// The view is out of range.
    #[error("invalid view: {0}")]
    View(#[from] RequestError),
    /// The device cannot take so much. Devices are created with limits, which may be lower than
    /// those of the hardware: see [`wgpu::DeviceDescriptor::required_limits`].
    #[error("{what}: {wanted} required, the device allows {allowed}")]
    DeviceLimit {
        /// What there is too much of, with its unit.
        what: &'static str,
        /// What the picture or the view requires.
        wanted: u64,
        /// What the device allows.
        allowed: u64,
    },
    /// Rendering would take more than [`GpuRenderer::with_max_work`](super::GpuRenderer::with_max_work)
    /// allows.
    #[error("{wanted} kernel evaluations required, {allowed} allowed")]
    Work {
        /// An upper bound of the kernel evaluations.
        wanted: u64,
        /// The limit.
        allowed: u64,
    },
    /// The map of the picture's texture was not rendered.
    #[error("the map of the texture: {0}")]
    Map(#[from] DecodeError),
    /// The picture has a kernel that the shader lacks.
    #[error("the shader lacks the kernel of this picture")]
    Kernel,
    /// The picture was uploaded by another renderer.
    #[error("the picture was uploaded by another renderer")]
    OtherRenderer,
    /// The texture is not one that can be drawn to or read.
    #[error("unsuitable texture: {0}")]
    Texture(&'static str),
    /// The device failed: it has no memory left, for example, or was lost.
    #[error("the GPU failed: {0}")]
    Device(#[from] wgpu::Error),
    /// The device did not finish its work.
    #[error("waiting for the GPU failed: {0}")]
    Wait(#[from] wgpu::PollError),
    /// The samples could not be read.
    #[error("reading from the GPU failed: {0}")]
    Read(#[source] Box<dyn std::error::Error + Send + Sync>),
}
