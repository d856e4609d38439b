//! Textures of the program's own, with mip levels, and sampled as sRGB.

mod common;

use common::scene::{Scene, TEXTURED_SIZE, with_texture};
use common::{Differences, Request, adapter, decode, renderer};
use image_gip::{ColorModel, Region};
use image_gip_gpu::{GpuRenderer, RenderError, View};
use wgpu::{TextureFormat, TextureUsages};

/// A renderer of its own, and its device; `None` where there is no GPU.
fn device() -> Option<(wgpu::Device, wgpu::Queue, GpuRenderer)> {
    renderer()?;
    let (device, queue, _) = adapter::device().expect("there was one before");
    let renderer = GpuRenderer::new(device.clone(), queue.clone()).expect("as before");
    Some((device, queue, renderer))
}

/// A texture of the program's own.
fn texture(device: &wgpu::Device, (width, height): (u32, u32), levels: u32) -> wgpu::Texture {
    device.create_texture(&wgpu::TextureDescriptor {
        label: None,
        size: wgpu::Extent3d { width, height, depth_or_array_layers: 1 },
        mip_level_count: levels,
        sample_count: 1,
        dimension: wgpu::TextureDimension::D2,
        format: TextureFormat::Rgba8Unorm,
        usage: TextureUsages::STORAGE_BINDING
            | TextureUsages::TEXTURE_BINDING
            | TextureUsages::COPY_SRC,
        view_formats: &[TextureFormat::Rgba8UnormSrgb],
    })
}

fn file(size: (u32, u32)) -> Vec<u8> {
    let gaussians = Scene::random(5, 60, size, (0.5, 20.0));
    Scene { size, color: ColorModel::Rgba, cutoff: None, gaussians }.file()
}

#[test]
fn each_level_is_what_the_decoder_renders_at_its_size() {
    let Some((device, _, renderer)) = device() else { return };
    for (file, size) in [
        (file((64, 64)), (64, 64)),
        (file((300, 37)), (300, 37)),
        (file((3, 530)), (3, 530)),
        (file((40, 30)), (81, 60)),
        (with_texture(file(TEXTURED_SIZE)), TEXTURED_SIZE),
        (with_texture(file(TEXTURED_SIZE)), (200, 150)),
    ] {
        let decoder = decode(&file);
        let picture = decoder.picture().expect("a header");
        let uploaded = renderer.upload(&picture).expect("small");
        let levels = size.0.max(size.1).ilog2() + 1;
        let texture = texture(&device, size, levels);
        let request = |size| Request { prefix: Some(50), size: Some(size), ..Request::WHOLE };
        renderer.draw(&uploaded, &request(size).view(), &texture).expect("of the view's size");
        for level in 0..levels {
            let request = request(((size.0 >> level).max(1), (size.1 >> level).max(1)));
            let found = renderer.read_mip_level(&texture, level).expect("can be copied");
            let single = renderer.render(&picture, &request.view()).expect("small");
            assert_eq!(found, renderer.read(&single).expect("as before"), "{size:?}, {request:?}");
            Differences::from_decoder(found, &picture, &request)
                .assert_close(&format!("{size:?}, {request:?}"));
        }
        let error = renderer.read_mip_level(&texture, levels).expect_err("no such level");
        assert_eq!(error.to_string(), "unsuitable texture: without this mip level");
    }
}

#[test]
fn a_view_as_srgb_gives_linear_light_at_all_levels() {
    let Some((device, queue, renderer)) = device() else { return };
    let decoder = decode(&file((64, 48)));
    let picture = decoder.picture().expect("a header");
    let uploaded = renderer.upload(&picture).expect("small");
    let drawn = texture(&device, (64, 48), 7);
    renderer.draw(&uploaded, &View::new(), &drawn).expect("of the view's size");

    // Copies a level of what is sampled.
    let source = "
        @group(0) @binding(0) var drawn: texture_2d<f32>;
        @group(0) @binding(1) var sampled: texture_storage_2d<rgba8unorm, write>;
        override level: u32;
        @compute @workgroup_size(1)
        fn copy(@builtin(global_invocation_id) pixel: vec3<u32>) {
            textureStore(sampled, pixel.xy, textureLoad(drawn, pixel.xy, level));
        }";
    let module = device.create_shader_module(wgpu::ShaderModuleDescriptor {
        label: None,
        source: wgpu::ShaderSource::Wgsl(source.into()),
    });
    // An sRGB texture is no storage texture, so the view leaves this usage out.
    let view = drawn.create_view(&wgpu::TextureViewDescriptor {
        format: Some(TextureFormat::Rgba8UnormSrgb),
        usage: Some(TextureUsages::TEXTURE_BINDING),
        ..Default::default()
    });
    for level in [0_u32, 1, 4] {
        let size = (64 >> level, 48 >> level);
        let sampled = texture(&device, size, 1);
        let pipeline = device.create_compute_pipeline(&wgpu::ComputePipelineDescriptor {
            label: None,
            layout: None,
            module: &module,
            entry_point: None,
            compilation_options: wgpu::PipelineCompilationOptions {
                constants: &[("level", f64::from(level))],
                ..Default::default()
            },
            cache: None,
        });
        let target = sampled.create_view(&wgpu::TextureViewDescriptor::default());
        let bindings = device.create_bind_group(&wgpu::BindGroupDescriptor {
            label: None,
            layout: &pipeline.get_bind_group_layout(0),
            entries: &[
                wgpu::BindGroupEntry {
                    binding: 0,
                    resource: wgpu::BindingResource::TextureView(&view),
                },
                wgpu::BindGroupEntry {
                    binding: 1,
                    resource: wgpu::BindingResource::TextureView(&target),
                },
            ],
        });
        let mut encoder = device.create_command_encoder(&Default::default());
        {
            let mut pass = encoder.begin_compute_pass(&Default::default());
            pass.set_pipeline(&pipeline);
            pass.set_bind_group(0, &bindings, &[]);
            pass.dispatch_workgroups(size.0, size.1, 1);
        }
        queue.submit([encoder.finish()]);

        let found = renderer.read(&sampled).expect("can be copied");
        let stored = renderer.read_mip_level(&drawn, level).expect("can be copied");
        let mut darker = 0;
        for (index, (&found, stored)) in found.iter().zip(stored).enumerate() {
            let alpha = index % 4 == 3;
            let expected = if alpha { stored } else { linear(stored) };
            assert!(found.abs_diff(expected) <= 1, "level {level}: {stored} is {found}");
            darker += usize::from(found.saturating_add(20) < stored);
        }
        assert!(darker > 0, "level {level} shows no difference");
    }
}

/// An sRGB sample as linear light with 8 bits.
fn linear(sample: u8) -> u8 {
    let value = f32::from(sample) / 255.0;
    let light = if value <= 0.04045 { value / 12.92 } else { ((value + 0.055) / 1.055).powf(2.4) };
    (light * 255.0).round() as u8
}

#[test]
fn mip_levels_are_of_the_whole_picture() {
    let Some((device, _, renderer)) = device() else { return };
    let decoder = decode(&file((64, 48)));
    let uploaded = renderer.upload(&decoder.picture().expect("a header")).expect("small");
    let texture = texture(&device, (64, 48), 3);
    let region = Region { x: 0, y: 0, width: 64, height: 48 };
    for view in [
        View::new().with_size(32, 24),
        View::new().with_size(128, 96).with_region(region),
        View::new().with_region(Region { width: 32, ..region }),
    ] {
        let error = renderer.draw(&uploaded, &view, &texture).expect_err("not the whole picture");
        assert_eq!(
            error.to_string(),
            "unsuitable texture: with mip levels, and not as large as the whole picture is drawn"
        );
        assert!(matches!(error, RenderError::Texture(_)));
    }
    let drawn = renderer.read(&texture).expect("can be copied");
    assert!(drawn.iter().all(|&sample| sample == 0), "nothing was drawn");
}
