//! How fast pictures are decoded and encoded.
//!
//!     cargo bench --manifest-path benches/Cargo.toml

use criterion::{Criterion, Throughput, criterion_group, criterion_main};
use image_gip::{
    ColorModel, Encoded, Encoder, Picture, RenderOptions, Source, StreamDecoder, Target, Threads,
};

const WIDTH: u32 = 256;
const HEIGHT: u32 = 192;
const GAUSSIANS: u32 = 1000;

/// Ramps, rings and a checkered corner: something soft, something regular, something sharp.
fn pixels() -> Vec<u8> {
    let mut pixels = Vec::with_capacity((WIDTH * HEIGHT * 3) as usize);
    for y in 0..HEIGHT {
        for x in 0..WIDTH {
            let (dx, dy) = (x.abs_diff(90), y.abs_diff(70));
            let rings = ((dx * dx + dy * dy) / 24 % 256) as u8;
            let checkers = if x > 190 && y > 130 { ((x / 7 + y / 7) % 2 * 200) as u8 } else { 40 };
            pixels.extend([rings, (x / 2 + y / 2) as u8, checkers]);
        }
    }
    pixels
}

fn encode(pixels: &[u8]) -> Encoded {
    let source = Source::new_u8(WIDTH, HEIGHT, ColorModel::Rgb, pixels).expect("it fits");
    let encoder = Encoder::new().with_target(Target::Gaussians(GAUSSIANS)).with_effort(1);
    encoder.encode(&source).expect("the options are in range")
}

fn render(picture: &Picture<'_>, options: &RenderOptions, out: &mut Vec<u8>) {
    out.resize(picture.output_len(options).expect("small"), 0);
    picture.render_u8(options, out).expect("within the limits");
}

fn decoding(criterion: &mut Criterion) {
    let file = encode(&pixels()).bytes;
    let mut decoder = StreamDecoder::new();
    decoder.feed(&file).expect("the file is sound");
    let picture = decoder.picture().expect("the file is complete");
    let mut out = Vec::new();

    let mut group = criterion.benchmark_group("decode");
    group.throughput(Throughput::Elements(GAUSSIANS.into()));
    group.bench_function("parse", |bencher| {
        bencher.iter(|| StreamDecoder::new().feed(&file));
    });
    group.throughput(Throughput::Elements(u64::from(WIDTH * HEIGHT)));
    let serial = RenderOptions::new().with_threads(Threads::One);
    for (name, options) in [
        ("render", RenderOptions::new()),
        ("render, one thread", serial.clone()),
        ("render, reference code", serial.clone().with_reference(true)),
        ("render, quarter size", serial.with_size(WIDTH / 4, HEIGHT / 4)),
    ] {
        group.bench_function(name, |bencher| {
            bencher.iter(|| render(&picture, &options, &mut out));
        });
    }
    group.finish();
}

fn encoding(criterion: &mut Criterion) {
    let pixels = pixels();
    let mut group = criterion.benchmark_group("encode");
    group.sample_size(10).throughput(Throughput::Elements(u64::from(WIDTH * HEIGHT)));
    group.bench_function("effort 1", |bencher| bencher.iter(|| encode(&pixels)));
    group.finish();
}

criterion_group!(benches, decoding, encoding);
criterion_main!(benches);
