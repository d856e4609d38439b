//! Encoded pictures and random scenes, from thumbnails to close-ups.

mod common;

use std::env;
use std::fs::File;
use std::io::BufReader;
use std::path::PathBuf;

use common::scene::{Scene, TEXTURED_SIZE, with_texture};
use common::{Differences, Request, assert_close, decode, renderer};
use image_gip::training::Training;
use image_gip::{ColorModel, Encoder, Kernel, Picture, Precision, Source, Target};
use image_gip_gpu::GpuRenderer;

/// The whole picture and parts of it, at its stored size, smaller, larger, stretched and squeezed.
fn requests(picture: &Picture<'_>) -> Vec<Request> {
    let (width, height) = (picture.header().width, picture.header().height);
    let close_up = Request::sized(width * 64, height * 64);
    vec![
        Request::WHOLE,
        Request::WHOLE.region(width / 3, height / 4, width / 2, height / 3),
        Request { prefix: Some(picture.gaussians().len() as u32 / 3), ..Request::WHOLE },
        Request::sized(width.div_ceil(4), height.div_ceil(4)),
        Request::sized(1, 1),
        Request::sized(width * 2 + 1, height.div_ceil(3)),
        Request::sized(width.div_ceil(5), height + 7),
        Request::sized(width * 3, height * 3).region(width, height + 3, width + 5, height - 9),
        close_up.region(width * 20 + 3, height * 31 + 1, 257, 129),
        close_up.region(width * 64 - 40, height * 64 - 24, 40, 24),
    ]
}

fn compare(renderer: &GpuRenderer, file: &[u8], what: &str) -> Differences {
    let decoder = decode(file);
    let picture = decoder.picture().expect("a header");
    let mut all = Differences::default();
    for request in requests(&picture) {
        let differences = Differences::of(renderer, &picture, &request);
        differences.assert_close(&format!("{what}, {request:?}"));
        all.add(differences);
    }
    all
}

/// A drawing with slopes, edges and texture, the same on every machine.
fn drawing(width: u32, height: u32, channels: usize) -> Vec<u8> {
    let mut random = fastrand::Rng::with_seed(7);
    let mut samples = Vec::new();
    for y in 0..height {
        for x in 0..width {
            let (dx, dy) = (x as f32 - width as f32 * 0.4, y as f32 - height as f32 * 0.5);
            let inside = dx * dx + dy * dy < (height * height) as f32 * 0.09;
            for channel in 0..channels {
                let slope = 255 * (x + y * channel as u32) / (width + height * channels as u32);
                let stripes = (x * (channel as u32 + 1) / 5 + y / 3) % 2 * 40;
                let value = if inside { 255 - slope } else { slope / 2 + stripes };
                samples.push((value + random.u32(0..12)).min(255) as u8);
            }
        }
    }
    samples
}

#[test]
fn encoded_pictures_are_close_to_the_decoder() {
    let Some(renderer) = renderer() else { return };
    let (width, height) = (150, 100);
    for color in [ColorModel::Gray, ColorModel::GrayAlpha, ColorModel::Rgb, ColorModel::Rgba] {
        let samples = drawing(width, height, color.channels());
        let source = Source::new_u8(width, height, color, &samples).expect("enough samples");
        let encoder = Encoder::new().with_effort(1).with_target(Target::Gaussians(600));
        let mut papers = Training::fast(40);
        papers.kernel = Kernel::PAPER;
        let papers = encoder.clone().with_training(papers).with_precision(Precision::Float);
        for (name, encoder) in [("quartic", encoder), ("exponential", papers)] {
            let encoded = encoder.encode(&source).expect("sound options");
            assert!(encoded.report.gaussians > 50, "{color:?}, {name}: {:?}", encoded.report);
            let all = compare(renderer, &encoded.bytes, &format!("{color:?}, {name}"));
            println!("{color:?}, {name}: {all:?}");
        }
    }
}

#[test]
fn pictures_of_16_bits_are_rendered_with_8() {
    let Some(renderer) = renderer() else { return };
    let samples: Vec<u16> = drawing(64, 48, 3).into_iter().map(|s| u16::from(s) * 257).collect();
    let source = Source::new_u16(64, 48, ColorModel::Rgb, &samples).expect("enough samples");
    let encoder = Encoder::new().with_effort(1).with_target(Target::Gaussians(100));
    let encoded = encoder.encode(&source).expect("sound options");
    compare(renderer, &encoded.bytes, "16 bits");
}

#[test]
fn random_scenes_are_close_to_the_decoder() {
    let Some(renderer) = renderer() else { return };
    for (seed, color) in
        (0..).zip([ColorModel::Gray, ColorModel::GrayAlpha, ColorModel::Rgb, ColorModel::Rgba])
    {
        for cutoff in [None, Some(11.082_527), Some(64.0)] {
            let size = (90, 70);
            let gaussians = Scene::random(seed, 60, size, (0.2, 30.0));
            let file = Scene { size, color, cutoff, gaussians }.file();
            compare(renderer, &file, &format!("{color:?}, cut-off {cutoff:?}"));
        }
    }
}

#[test]
fn texture_is_close_to_the_decoder() {
    let Some(renderer) = renderer() else { return };
    let (width, height) = TEXTURED_SIZE;
    let mut all = Differences::default();
    for (seed, color) in
        (0..).zip([ColorModel::Gray, ColorModel::GrayAlpha, ColorModel::Rgb, ColorModel::Rgba])
    {
        for cutoff in [None, Some(11.082_527)] {
            let gaussians = Scene::random(seed, 30, TEXTURED_SIZE, (2.0, 30.0));
            let file = Scene { size: TEXTURED_SIZE, color, cutoff, gaussians }.file();
            let textured = with_texture(file.clone());
            all.add(compare(renderer, &textured, &format!("{color:?}, cut-off {cutoff:?}")));
            let textured = decode(&textured);
            let textured = textured.picture().expect("a header");
            // It fades between a quarter and an eighth.
            for divisor in [3, 6, 7, 8] {
                let smaller = Request::sized(width / divisor, height / divisor);
                assert_close(renderer, &textured, &smaller);
            }
            let plain = decode(&file);
            let plain = plain.picture().expect("a header");
            let samples = |picture, request: Request| {
                let texture = renderer.render(picture, &request.view()).expect("small");
                renderer.read(&texture).expect("a texture of the renderer")
            };
            for request in [Request::WHOLE, Request::sized(2 * width, 3 * height)] {
                assert_close(renderer, &textured, &request.without_texture());
                let expected = samples(&plain, request);
                assert_eq!(samples(&textured, request.without_texture()), expected, "{request:?}");
                assert_ne!(samples(&textured, request), expected, "{request:?}");
            }
        }
    }
    println!("texture: {all:?}");
}

#[test]
fn each_of_tens_of_thousands_of_gaussians_is_added_once() {
    let Some(renderer) = renderer() else { return };
    // More than the words of a bin that are read at once have bits, in a picture with several bins
    // of several tiles; and in some tiles more than are tested at once.
    let size = (300, 520);
    let mut gaussians = Scene::random(11, 20_000, size, (0.4, 4.0));
    for (index, gaussian) in gaussians.iter_mut().enumerate() {
        if index % 9 == 0 {
            gaussian[..2].copy_from_slice(&[200.0 + (index % 13) as f32, 300.0]);
        }
        // One of these that is missing or added twice changes pixels by far more than two steps.
        let amplitude = if index % 2 == 0 { 100.0 } else { -100.0 };
        if index % 9 == 0 && index < 18_000 {
            gaussian[2..].copy_from_slice(&[3.0, 0.0, 3.0, amplitude, amplitude, amplitude, 0.0]);
        }
    }
    let file = Scene { size, color: ColorModel::Rgb, cutoff: None, gaussians }.file();
    let decoder = decode(&file);
    assert_close(renderer, &decoder.picture().expect("a header"), &Request::WHOLE);
}

#[test]
fn pictures_of_all_sizes_are_drawn_to_their_edges() {
    let Some(renderer) = renderer() else { return };
    for size in [(1, 1), (15, 17), (16, 16), (256, 1), (257, 16), (3, 530), (600, 33)] {
        let gaussians = Scene::random(5, 80, size, (0.5, 20.0));
        let file = Scene { size, color: ColorModel::Rgb, cutoff: None, gaussians }.file();
        let decoder = decode(&file);
        assert_close(renderer, &decoder.picture().expect("a header"), &Request::WHOLE);
    }
}

/// The Kodak pictures, where the variable `KODAK` names their folder.
#[test]
fn kodak_is_close_to_the_decoder() {
    let Some(renderer) = renderer() else { return };
    let Some(folder) = env::var_os("KODAK").map(PathBuf::from) else {
        println!("skipped: KODAK names no folder");
        return;
    };
    let mut whole = Differences::default();
    for number in [1, 8, 23] {
        let file = File::open(folder.join(format!("kodim{number:02}.png"))).expect("a picture");
        let mut reader = png::Decoder::new(BufReader::new(file)).read_info().expect("a PNG");
        let mut samples = vec![0; reader.output_buffer_size().expect("small")];
        let info = reader.next_frame(&mut samples).expect("a PNG");
        assert_eq!(info.color_type, png::ColorType::Rgb);
        let source = Source::new_u8(info.width, info.height, ColorModel::Rgb, &samples)
            .expect("enough samples");
        let encoder = Encoder::new().with_effort(1).with_target(Target::Gaussians(5000));
        let encoded = encoder.encode(&source).expect("sound options");
        let all = compare(renderer, &encoded.bytes, &format!("kodim{number:02}"));
        println!("kodim{number:02}, {} Gaussians: {all:?}", encoded.report.gaussians);
        whole.add(all);
    }
    whole.assert_close("Kodak");
}
