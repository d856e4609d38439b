//! Hostile files, devices with narrow limits, and requests that cannot be fulfilled: errors, never
//! panics.

mod common;

use common::scene::Scene;
use common::{Request, adapter, assert_close, decode, renderer};
use image_gip::{ColorModel, Region};
use image_gip_gpu::{GpuRenderer, RenderError, View};
use wgpu::{Limits, TextureFormat, TextureUsages};

fn scene(size: (u32, u32), gaussians: Vec<[f32; 9]>) -> Vec<u8> {
    Scene { size, color: ColorModel::Rgba, cutoff: None, gaussians }.file()
}

fn random(count: usize) -> Vec<u8> {
    scene((64, 48), Scene::random(3, count, (64, 48), (0.5, 9.0)))
}

/// A renderer of its own on a device with these limits; `None` where there is no GPU.
fn limited(limits: Limits) -> Option<(wgpu::Device, Result<GpuRenderer, RenderError>)> {
    renderer()?;
    let (adapter, _) = adapter::adapter().expect("there was one before");
    let descriptor = wgpu::DeviceDescriptor { required_limits: limits, ..Default::default() };
    let device = pollster::block_on(adapter.request_device(&descriptor));
    let (device, queue) = device.expect("narrow limits");
    Some((device.clone(), GpuRenderer::new(device, queue)))
}

#[test]
fn values_that_are_not_drawn_change_nothing() {
    let Some(renderer) = renderer() else { return };
    let mut gaussians = Scene::random(1, 40, (64, 48), (0.5, 9.0));
    // Those that are not finite are among the test vectors: a file can hold only their shapes.
    for component in 0..9 {
        for (at, value) in [(0, 1e30), (7, -1e30), (33, f32::MAX)] {
            let mut gaussian = Scene::random(2, 1, (64, 48), (0.5, 9.0))[0];
            gaussian[component] = value;
            gaussians.insert(at, gaussian);
        }
    }
    for diagonal in [0.0, -0.0, -1.0, 1.0 / 4097.0, 16_777_218.0] {
        gaussians.push([20.0, 20.0, diagonal, 0.0, 3.0, 1.0, 1.0, 1.0, 1.0]);
        gaussians.push([20.0, 20.0, 3.0, 0.0, diagonal, 1.0, 1.0, 1.0, 1.0]);
    }
    let decoder = decode(&scene((64, 48), gaussians));
    let picture = decoder.picture().expect("a header");
    for request in [Request::WHOLE, Request::sized(16, 12), Request::sized(640, 480)] {
        assert_close(renderer, &picture, &request);
    }
}

#[test]
fn the_bounds_of_what_is_drawn_are_close_to_the_decoder() {
    let Some(renderer) = renderer() else { return };
    let most = 16_777_216.0;
    let mut gaussians = Vec::new();
    for [x, y] in [[32.0, 24.0], [most, 24.0], [-most, -most], [32.0, most]] {
        for [l11, l21, l22] in [
            [most, 0.0, most],
            [most, most, most],
            [most, -most, most],
            [0.000_244_140_63, 0.0, most],
            [most, 0.0, 0.000_244_140_63],
        ] {
            gaussians.push([x, y, l11, l21, l22, 0.01, -0.02, 0.03, 0.01]);
        }
    }
    let decoder = decode(&scene((64, 48), gaussians));
    let picture = decoder.picture().expect("a header");
    for request in [
        Request::WHOLE,
        Request::sized(1, 1),
        Request::sized(1 << 23, 1 << 23).region(4_000_000, 1, 60, 50),
    ] {
        assert_close(renderer, &picture, &request);
    }
}

#[test]
fn too_much_work_is_refused() {
    let Some((_, renderer)) = limited(Limits::downlevel_defaults()) else { return };
    let renderer = renderer.expect("what every device has");
    let everywhere = [512.0, 512.0, 1e6, 0.0, 1e6, 0.001, 0.0, 0.0, 0.0];
    let file = scene((1024, 1024), vec![everywhere; 20_000]);
    let decoder = decode(&file);
    let picture = decoder.picture().expect("a header");
    let error = renderer.render(&picture, &View::new()).expect_err("2e10 evaluations");
    assert!(matches!(error, RenderError::Work { wanted, allowed } if wanted > allowed), "{error}");
    // A small output is little work.
    renderer.render(&picture, &View::new().with_size(16, 16)).expect("3e8 evaluations");
    let strict = renderer.with_max_work(1000);
    let error = strict.render(&picture, &View::new().with_size(16, 16)).expect_err("3e8");
    assert!(matches!(error, RenderError::Work { allowed: 2_098_152, .. }), "{error}");
}

#[test]
fn the_limits_that_every_device_has_are_enough() {
    let Some((_, renderer)) = limited(Limits::downlevel_defaults()) else { return };
    let decoder = decode(&random(500));
    let picture = decoder.picture().expect("a header");
    assert_close(&renderer.expect("as documented"), &picture, &Request::WHOLE);
}

#[test]
fn limits_of_the_device_are_named() {
    let narrow = Limits {
        max_texture_dimension_1d: 256,
        max_texture_dimension_2d: 256,
        max_storage_buffer_binding_size: 40_000,
        ..Limits::downlevel_defaults()
    };
    let Some((_, renderer)) = limited(narrow) else { return };
    let renderer = renderer.expect("enough for the shader");
    let decoder = decode(&random(100));
    let picture = decoder.picture().expect("a header");
    let message = |view: View| renderer.render(&picture, &view).expect_err("too large").to_string();
    assert_eq!(
        message(View::new().with_size(300, 20)),
        "pixels along a side: 300 required, the device allows 256"
    );
    assert_close(&renderer, &picture, &Request::sized(1000, 1000).region(700, 300, 256, 200));

    let decoder = decode(&random(1000));
    let picture = decoder.picture().expect("a header");
    let error = renderer.upload(&picture).expect_err("48,000 bytes");
    assert_eq!(
        error.to_string(),
        "bytes of a buffer for the Gaussians: 48000 required, the device allows 40000"
    );
}

#[test]
fn a_device_without_compute_shaders_is_refused() {
    let Some((_, renderer)) = limited(Limits::downlevel_webgl2_defaults()) else { return };
    let error = renderer.expect_err("no compute shaders");
    assert!(matches!(error, RenderError::DeviceLimit { .. }), "{error}");
}

#[test]
fn views_out_of_range_are_refused() {
    let Some(renderer) = renderer() else { return };
    let decoder = decode(&random(10));
    let picture = decoder.picture().expect("a header");
    let region = |x, y, width, height| Region { x, y, width, height };
    for view in [
        View::new().with_size(0, 10),
        View::new().with_size(10, (1 << 23) + 1),
        View::new().with_region(region(0, 0, 0, 1)),
        View::new().with_region(region(60, 0, 5, 1)),
        View::new().with_region(region(u32::MAX, 0, 5, 1)),
        View::new().with_size(16, 16).with_region(region(0, 0, 17, 1)),
    ] {
        let error = renderer.render(&picture, &view).expect_err("out of range");
        assert!(matches!(error, RenderError::View(_)), "{view:?}: {error}");
    }
}

#[test]
fn a_picture_is_drawn_many_times() {
    let Some((device, renderer)) = limited(Limits::downlevel_defaults()) else { return };
    let renderer = renderer.expect("what every device has");
    let decoder = decode(&random(500));
    let picture = decoder.picture().expect("a header");
    let uploaded = renderer.upload(&picture).expect("small");
    let large = Request::sized(640, 480).region(10, 20, 300, 200);
    let texture = renderer.create_texture(&uploaded, &large.view()).expect("small");
    // Draws each view to the corner of the large texture; the last one decides.
    for request in [Request { prefix: Some(0), ..Request::WHOLE }, large, Request::WHOLE, large] {
        renderer.draw(&uploaded, &request.view(), &texture).expect("fits");
    }
    let found = renderer.read(&texture).expect("can be read");
    let expected = renderer.render(&picture, &large.view()).expect("small");
    assert_eq!(found, renderer.read(&expected).expect("can be read"));

    let texture = |format, usage, width| {
        device.create_texture(&wgpu::TextureDescriptor {
            label: None,
            size: wgpu::Extent3d { width, height: 300, depth_or_array_layers: 1 },
            mip_level_count: 1,
            sample_count: 1,
            dimension: wgpu::TextureDimension::D2,
            format,
            usage,
            view_formats: &[],
        })
    };
    let usage = TextureUsages::STORAGE_BINDING;
    for (texture, problem) in [
        (texture(TextureFormat::Rgba8Unorm, usage, 299), "smaller than the view"),
        (texture(TextureFormat::Rgba16Float, usage, 300), "not Rgba8Unorm"),
        (
            texture(TextureFormat::Rgba8Unorm, TextureUsages::TEXTURE_BINDING, 300),
            "not a storage texture",
        ),
    ] {
        let error = renderer.draw(&uploaded, &large.view(), &texture).expect_err(problem);
        assert_eq!(error.to_string(), format!("unsuitable texture: {problem}"));
        assert!(matches!(renderer.read(&texture), Err(RenderError::Texture(_))));
    }
}

#[test]
fn pictures_of_other_renderers_and_lost_devices_are_errors() {
    let Some(other) = renderer() else { return };
    let (device, renderer) = limited(Limits::downlevel_defaults()).expect("as before");
    let renderer = renderer.expect("what every device has");
    let decoder = decode(&random(10));
    let picture = decoder.picture().expect("a header");
    let foreign = other.upload(&picture).expect("small");
    let texture = renderer.create_texture(&foreign, &View::new()).expect("small");
    let error = renderer.draw(&foreign, &View::new(), &texture).expect_err("of another renderer");
    assert!(matches!(error, RenderError::OtherRenderer), "{error}");

    device.destroy();
    let error = renderer.render(&picture, &View::new()).and_then(|texture| renderer.read(&texture));
    assert!(error.is_err());
}
