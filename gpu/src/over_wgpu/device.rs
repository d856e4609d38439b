//! Errors of the device as results: `wgpu` reports them to a handler, which panics by default.

use super::error::RenderError;
use super::wgpu::{self, ErrorFilter};

/// Refuses more of something than the device allows.
pub(crate) fn check(what: &'static str, wanted: u64, allowed: u64) -> Result<(), RenderError> {
    if wanted > allowed {
        return Err(RenderError::DeviceLimit { what, wanted, allowed });
    }
    Ok(())
}

/// Calls the device, and returns its first error.
pub(crate) fn checked<T>(
    device: &wgpu::Device,
    call: impl FnOnce() -> T,
) -> Result<T, RenderError> {
    let filters = [ErrorFilter::Validation, ErrorFilter::OutOfMemory, ErrorFilter::Internal];
    let scopes = filters.map(|filter| device.push_error_scope(filter));
    let result = call();
    // The scopes are a stack.
    let mut first = None;
    for scope in scopes.into_iter().rev() {
        first = pollster::block_on(scope.pop()).or(first);
    }
    first.map_or(Ok(result), |error| Err(error.into()))
}

/// A buffer, which is not mapped: mapping one fails by a panic where there is no memory left.
pub(crate) fn buffer(
    device: &wgpu::Device,
    label: &str,
    size: u64,
    usage: wgpu::BufferUsages,
) -> wgpu::Buffer {
    device.create_buffer(&wgpu::BufferDescriptor {
        label: Some(label),
        size,
        usage,
        mapped_at_creation: false,
    })
}
