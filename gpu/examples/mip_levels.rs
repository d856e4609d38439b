//! Draws a `.gip` file with all mip levels into a texture of the program's own, and covers a floor with it
//! up to the horizon: near parts show level 0, far ones the small levels, none of which flickers. The floor
//! is sampled and drawn as sRGB, so that colours are mixed as light. As it is saved, it is a PNG.
//!
//!     cargo run --release --example mip_levels -- photo.gip floor.png

mod adapter;
mod png_file;

use std::error::Error;

use image_gip::StreamDecoder;
use image_gip_gpu::{GpuRenderer, View};
use wgpu::{TextureFormat, TextureUsages};

/// Width and height of what is saved.
const SIZE: (u32, u32) = (960, 540);

const FLOOR: &str = "
    @group(0) @binding(0) var picture: texture_2d<f32>;
    @group(0) @binding(1) var trilinear: sampler;

    struct Vertex {
        @builtin(position) position: vec4<f32>,
        @location(0) at: vec2<f32>,
    }

    // A triangle that covers everything.
    @vertex
    fn vertex(@builtin(vertex_index) index: u32) -> Vertex {
        let at = vec2(f32(index & 1u), f32(index >> 1u)) * 4.0 - 1.0;
        return Vertex(vec4(at, 0.0, 1.0), at);
    }

    // The horizon is a little above the upper edge.
    @fragment
    fn fragment(vertex: Vertex) -> @location(0) vec4<f32> {
        let distance = 2.0 / (1.02 - vertex.at.y);
        return textureSample(picture, trilinear, distance * vec2(vertex.at.x, -1.0));
    }";

fn main() -> Result<(), Box<dyn Error>> {
    let arguments: Vec<String> = std::env::args().skip(1).collect();
    let [input, output] = arguments.as_slice() else {
        return Err("usage: mip_levels INPUT.gip OUTPUT.png".into());
    };
    let mut decoder = StreamDecoder::new();
    decoder.feed(&std::fs::read(input)?)?;
    decoder.finish()?;
    let picture = decoder.picture().ok_or("there is no header")?;

    let (device, queue, name) = adapter::device()?;
    println!("on {name}");
    let renderer = GpuRenderer::new(device.clone(), queue.clone())?;
    let size = (picture.header().width, picture.header().height);
    let levels = size.0.max(size.1).ilog2() + 1;
    let usage = TextureUsages::STORAGE_BINDING | TextureUsages::TEXTURE_BINDING;
    let texture = texture(&device, size, levels, usage);
    renderer.draw(&renderer.upload(&picture)?, &View::new(), &texture)?;

    let usage = TextureUsages::RENDER_ATTACHMENT | TextureUsages::COPY_SRC;
    let floor = self::texture(&device, SIZE, 1, usage);
    let commands = draw_floor(
        &device,
        &srgb(&texture, TextureUsages::TEXTURE_BINDING),
        &srgb(&floor, TextureUsages::RENDER_ATTACHMENT),
    );
    queue.submit([commands]);
    std::fs::write(output, png_file::encode(SIZE.0, SIZE.1, &renderer.read(&floor)?)?)?;
    println!("{output}: {} x {} pixels, {levels} levels", SIZE.0, SIZE.1);
    Ok(())
}

fn texture(
    device: &wgpu::Device,
    (width, height): (u32, u32),
    mip_level_count: u32,
    usage: TextureUsages,
) -> wgpu::Texture {
    device.create_texture(&wgpu::TextureDescriptor {
        label: None,
        size: wgpu::Extent3d { width, height, depth_or_array_layers: 1 },
        mip_level_count,
        sample_count: 1,
        dimension: wgpu::TextureDimension::D2,
        format: TextureFormat::Rgba8Unorm,
        usage,
        view_formats: &[TextureFormat::Rgba8UnormSrgb],
    })
}

/// A view of all levels as sRGB. It has no storage usage, which that format lacks.
fn srgb(texture: &wgpu::Texture, usage: TextureUsages) -> wgpu::TextureView {
    texture.create_view(&wgpu::TextureViewDescriptor {
        format: Some(TextureFormat::Rgba8UnormSrgb),
        usage: Some(usage),
        ..Default::default()
    })
}

fn draw_floor(
    device: &wgpu::Device,
    picture: &wgpu::TextureView,
    floor: &wgpu::TextureView,
) -> wgpu::CommandBuffer {
    let module = device.create_shader_module(wgpu::ShaderModuleDescriptor {
        label: Some("floor"),
        source: wgpu::ShaderSource::Wgsl(FLOOR.into()),
    });
    let pipeline = device.create_render_pipeline(&wgpu::RenderPipelineDescriptor {
        label: Some("floor"),
        layout: None,
        vertex: wgpu::VertexState {
            module: &module,
            entry_point: None,
            compilation_options: Default::default(),
            buffers: &[],
        },
        fragment: Some(wgpu::FragmentState {
            module: &module,
            entry_point: None,
            compilation_options: Default::default(),
            targets: &[Some(TextureFormat::Rgba8UnormSrgb.into())],
        }),
        primitive: Default::default(),
        depth_stencil: None,
        multisample: Default::default(),
        multiview_mask: None,
        cache: None,
    });
    let trilinear = device.create_sampler(&wgpu::SamplerDescriptor {
        address_mode_u: wgpu::AddressMode::Repeat,
        address_mode_v: wgpu::AddressMode::Repeat,
        mag_filter: wgpu::FilterMode::Linear,
        min_filter: wgpu::FilterMode::Linear,
        mipmap_filter: wgpu::MipmapFilterMode::Linear,
        ..Default::default()
    });
    let entry = |binding, resource| wgpu::BindGroupEntry { binding, resource };
    let bindings = device.create_bind_group(&wgpu::BindGroupDescriptor {
        label: None,
        layout: &pipeline.get_bind_group_layout(0),
        entries: &[
            entry(0, wgpu::BindingResource::TextureView(picture)),
            entry(1, wgpu::BindingResource::Sampler(&trilinear)),
        ],
    });
    let mut encoder = device.create_command_encoder(&Default::default());
    let mut pass = encoder.begin_render_pass(&wgpu::RenderPassDescriptor {
        color_attachments: &[Some(wgpu::RenderPassColorAttachment {
            view: floor,
            depth_slice: None,
            resolve_target: None,
            ops: wgpu::Operations::default(),
        })],
        ..Default::default()
    });
    pass.set_pipeline(&pipeline);
    pass.set_bind_group(0, &bindings, &[]);
    pass.draw(0..3, 0..1);
    drop(pass);
    encoder.finish()
}
