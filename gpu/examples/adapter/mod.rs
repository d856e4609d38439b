//! The GPU that the examples and tests use.

use std::error::Error;

/// A device of the default adapter, or of that whose name contains `WGPU_ADAPTER_NAME`, and a line that
/// describes the adapter.
pub(crate) fn device() -> Result<(wgpu::Device, wgpu::Queue, String), Box<dyn Error>> {
    let (adapter, name) = adapter()?;
    // All that the hardware allows: large pictures need more than the default.
    let descriptor =
        wgpu::DeviceDescriptor { required_limits: adapter.limits(), ..Default::default() };
    let (device, queue) = pollster::block_on(adapter.request_device(&descriptor))?;
    Ok((device, queue, name))
}

/// The adapter and a line that describes it.
pub(crate) fn adapter() -> Result<(wgpu::Adapter, String), Box<dyn Error>> {
    let instance = wgpu::Instance::default();
    let adapter = wgpu::util::initialize_adapter_from_env_or_default(&instance, None);
    let adapter = pollster::block_on(adapter)?;
    let wgpu::AdapterInfo { name, device_type, driver, driver_info, backend, .. } =
        adapter.get_info();
    let line = format!("{name} ({device_type:?}; {backend}; {driver}; {driver_info})");
    Ok((adapter, line))
}
