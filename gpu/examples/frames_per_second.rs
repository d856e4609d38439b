//! Measures how many frames per second the GPU draws, of a file, or of a drawing that is encoded with
//! so many Gaussians:
//!
//!     cargo run --release --example frames_per_second -- photo.gip 3840x2160
//!     cargo run --release --example frames_per_second -- 10000 768x512
//!
//! The size is that of the frames; that of a file is its own by default. A drawing has the size of
//! the frames, too, and about so many Gaussians.

mod adapter;

use std::error::Error;
use std::fs;
use std::time::Instant;

use image_gip::{ColorModel, Encoder, Precision, Source, StreamDecoder, Target, Tune};
use image_gip_gpu::{GpuPicture, GpuRenderer, View};

/// Rounds that are measured, after one that is not.
const ROUNDS: usize = 9;
/// About how long a round takes, in seconds.
const ROUND: f64 = 0.5;

fn main() -> Result<(), Box<dyn Error>> {
    let arguments: Vec<String> = std::env::args().skip(1).collect();
    let (input, size) = match arguments.as_slice() {
        [input] => (input, None),
        [input, size] => (input, Some(parse_size(size)?)),
        _ => return Err("usage: frames_per_second INPUT.gip|GAUSSIANS [SIZE]".into()),
    };
    let file = match (input.parse(), size) {
        (Ok(gaussians), Some((width, height))) => encode_drawing(gaussians, width, height)?,
        (Ok(_), None) => return Err("a drawing needs a size".into()),
        (Err(_), _) => fs::read(input)?,
    };
    let mut decoder = StreamDecoder::new();
    decoder.feed(&file)?;
    decoder.finish()?;
    let picture = decoder.picture().ok_or("there is no header")?;
    let (width, height) = size.unwrap_or((picture.header().width, picture.header().height));

    let (device, queue, name) = adapter::device()?;
    println!("adapter: {name}");
    let renderer = GpuRenderer::new(device, queue)?;
    println!("{} Gaussians, {width} x {height} pixels", picture.gaussians().len());
    let uploaded = renderer.upload(&picture)?;
    measure(&renderer, &uploaded, &View::new().with_size(width, height))
}

/// Draws rounds of frames. All frames of a round are submitted at once, so that the GPU is never idle.
fn measure(
    renderer: &GpuRenderer,
    picture: &GpuPicture,
    view: &View,
) -> Result<(), Box<dyn Error>> {
    let texture = renderer.create_texture(picture, view)?;
    let round = |frames: usize| -> Result<f64, Box<dyn Error>> {
        let start = Instant::now();
        for _ in 0..frames {
            renderer.draw(picture, view, &texture)?;
        }
        renderer.wait()?;
        Ok(start.elapsed().as_secs_f64() / frames as f64)
    };
    // The first frames take longer.
    round(2)?;
    let frames = ((ROUND / round(2)?) as usize).clamp(1, 10_000);
    let median = |mut seconds: Vec<f64>| {
        seconds.sort_by(f64::total_cmp);
        [seconds[0], seconds[seconds.len() / 2], seconds[seconds.len() - 1]]
    };
    round(frames)?;
    let rounds = (0..ROUNDS).map(|_| round(frames)).collect::<Result<Vec<_>, _>>()?;
    let [best, middle, worst] = median(rounds).map(|seconds| 1.0 / seconds);
    println!("{middle:.1} frames/s (median of {ROUNDS} x {frames}; {worst:.1} to {best:.1})");
    let singles = (0..ROUNDS).map(|_| round(1)).collect::<Result<Vec<_>, _>>()?;
    let [best, middle, worst] = median(singles).map(|seconds| seconds * 1e3);
    println!("{middle:.3} ms for one frame, waiting included ({best:.3} to {worst:.3})");
    Ok(())
}

fn parse_size(text: &str) -> Result<(u32, u32), Box<dyn Error>> {
    let (width, height) = text.split_once('x').ok_or("a size is WIDTHxHEIGHT")?;
    Ok((width.parse()?, height.parse()?))
}

/// A drawing of waves, coarse and fine, encoded with at most so many Gaussians.
fn encode_drawing(gaussians: u32, width: u32, height: u32) -> Result<Vec<u8>, Box<dyn Error>> {
    println!("encoding a drawing; at 3840x2160 this takes minutes");
    let mut samples = Vec::with_capacity(width as usize * height as usize * 3);
    for y in 0..height {
        for x in 0..width {
            let (x, y) = (x as f32, y as f32);
            let wave = |length: f32, tilt: f32| ((x + y * tilt) / length + (y / 90.0).cos()).sin();
            let soft = wave(70.0, 0.4) + wave(31.0, -1.3);
            let fine = wave(3.0, 0.8) * wave(140.0, 2.0).max(0.0);
            let edge = if wave(55.0, -0.2) > 0.3 { 0.5 } else { -0.5 };
            for tint in [0.6, 1.0, 1.4] {
                let value = 0.5 + 0.11 * (soft * tint + 1.5 * fine + edge / tint);
                samples.push((value * 255.0) as u8);
            }
        }
    }
    let source = Source::new_u8(width, height, ColorModel::Rgb, &samples)?;
    let encoder = Encoder::new()
        .with_target(Target::Gaussians(gaussians))
        .with_effort(1)
        .with_tune(Tune::Psnr)
        .with_precision(Precision::Float);
    Ok(encoder.encode(&source)?.bytes)
}
