//! The shader, compiled for a device.

use super::device::{check, checked};
use super::error::RenderError;
use super::wgpu::{
    self, BindGroupLayoutEntry, BindingType, BufferBindingType, ShaderStages, StorageTextureAccess,
    TextureFormat, TextureViewDimension,
};
use crate::SHADER;

/// The format of the textures.
pub(crate) const FORMAT: TextureFormat = TextureFormat::Rgba8Unorm;
/// Invocations of a workgroup of either entry point.
const INVOCATIONS: u32 = 256;
/// Bytes of the memory that a workgroup of `render` shares.
const SHARED_BYTES: u32 = 14_800;

/// The entry points of the shader and their bindings.
#[derive(Debug)]
pub(crate) struct Pipelines {
    pub(crate) layout: wgpu::BindGroupLayout,
    pub(crate) prepare: wgpu::ComputePipeline,
    pub(crate) render: wgpu::ComputePipeline,
}

impl Pipelines {
    /// Compiles the shader.
    pub(crate) fn new(device: &wgpu::Device) -> Result<Self, RenderError> {
        let limits = device.limits();
        let invocations =
            limits.max_compute_invocations_per_workgroup.min(limits.max_compute_workgroup_size_x);
        let needed = [
            ("invocations of a workgroup", INVOCATIONS, invocations),
            ("bytes of workgroup memory", SHARED_BYTES, limits.max_compute_workgroup_storage_size),
            ("storage buffers", 4, limits.max_storage_buffers_per_shader_stage),
            ("storage textures", 1, limits.max_storage_textures_per_shader_stage),
        ];
        for (what, wanted, allowed) in needed {
            check(what, wanted.into(), allowed.into())?;
        }
        checked(device, || {
            let layout = layout(device);
            let [prepare, render] = pipelines(device, &layout);
            Self { layout, prepare, render }
        })
    }
}

/// The bindings of the shader.
fn layout(device: &wgpu::Device) -> wgpu::BindGroupLayout {
    let entry = |binding, ty| BindGroupLayoutEntry {
        binding,
        visibility: ShaderStages::COMPUTE,
        ty,
        count: None,
    };
    let buffer = |binding, ty| {
        entry(
            binding,
            BindingType::Buffer { ty, has_dynamic_offset: false, min_binding_size: None },
        )
    };
    let output = BindingType::StorageTexture {
        access: StorageTextureAccess::WriteOnly,
        format: FORMAT,
        view_dimension: TextureViewDimension::D2,
    };
    device.create_bind_group_layout(&wgpu::BindGroupLayoutDescriptor {
        label: Some("gip bindings"),
        entries: &[
            buffer(0, BufferBindingType::Uniform),
            buffer(1, BufferBindingType::Storage { read_only: true }),
            buffer(2, BufferBindingType::Storage { read_only: false }),
            buffer(3, BufferBindingType::Storage { read_only: false }),
            entry(4, output),
            buffer(5, BufferBindingType::Storage { read_only: true }),
        ],
    })
}

/// The pipelines of `prepare` and `render`.
fn pipelines(device: &wgpu::Device, layout: &wgpu::BindGroupLayout) -> [wgpu::ComputePipeline; 2] {
    let module = device.create_shader_module(wgpu::ShaderModuleDescriptor {
        label: Some("gip"),
        source: wgpu::ShaderSource::Wgsl(SHADER.into()),
    });
    let layout = device.create_pipeline_layout(&wgpu::PipelineLayoutDescriptor {
        label: Some("gip"),
        bind_group_layouts: &[Some(layout)],
        ..Default::default()
    });
    ["prepare", "render"].map(|name| {
        device.create_compute_pipeline(&wgpu::ComputePipelineDescriptor {
            label: Some(name),
            layout: Some(&layout),
            module: &module,
            entry_point: Some(name),
            compilation_options: wgpu::PipelineCompilationOptions::default(),
            cache: None,
        })
    })
}
