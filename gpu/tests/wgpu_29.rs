//! The renderer over `wgpu` 29, in one program with that over 30:
//! `cargo test --features wgpu-29/vulkan --test wgpu_29`.

mod common;

use common::scene::Scene;
use common::{Differences, Request, decode, renderer};
use image_gip::ColorModel;
use image_gip_gpu::wgpu_29::{GpuRenderer, wgpu};

#[test]
fn a_picture_is_close_to_the_decoder_and_the_same_as_over_30() {
    let Some(newer) = renderer() else { return };
    let instance = wgpu::Instance::default();
    let adapter = wgpu::util::initialize_adapter_from_env_or_default(&instance, None);
    let adapter = pollster::block_on(adapter).expect("`wgpu` 30 has one");
    let device = pollster::block_on(adapter.request_device(&Default::default()));
    let (device, queue) = device.expect("default limits");
    let renderer = GpuRenderer::new(device, queue).expect("enough for the shader");

    let size = (90, 70);
    let gaussians = Scene::random(3, 60, size, (0.5, 20.0));
    let file = Scene { size, color: ColorModel::Rgba, cutoff: None, gaussians }.file();
    let decoder = decode(&file);
    let picture = decoder.picture().expect("a header");
    for request in [Request::WHOLE, Request::sized(300, 200), Request::sized(11, 9)] {
        let texture = renderer.render(&picture, &request.view()).expect("small");
        let found = renderer.read(&texture).expect("a texture of the renderer");
        let other = newer.render(&picture, &request.view()).expect("small");
        assert_eq!(found, newer.read(&other).expect("as before"), "{request:?}");
        Differences::from_decoder(found, &picture, &request).assert_close(&format!("{request:?}"));
    }
}
