//! Pictures with alpha: what shows of them is as good as that of opaque ones, and what does not show
//! costs nothing and shines through nowhere.

mod metric;

use image_gip::{ColorModel, Encoder, Precision, RenderOptions, Source, StreamDecoder, Target};
use metric::ssimulacra2;

/// A picture of 8-bit RGBA.
struct Sprite {
    name: &'static str,
    size: usize,
    samples: Vec<u8>,
}

impl Sprite {
    /// From the colour and the alpha at (x, y), both from -1 to 1 with the middle at 0.
    fn new(name: &'static str, size: usize, pixel: impl Fn(f32, f32) -> [f32; 4]) -> Self {
        let at = |index: usize| (index as f32 + 0.5) / size as f32 * 2.0 - 1.0;
        let pixels = (0..size * size).map(|index| pixel(at(index % size), at(index / size)));
        let samples = pixels.flat_map(|pixel| pixel.map(|value| (value * 255.0 + 0.5) as u8));
        Self { name, size, samples: samples.collect() }
    }

    fn source(&self) -> Source<'_> {
        let size = self.size as u32;
        Source::new_u8(size, size, ColorModel::Rgba, &self.samples).expect("the sizes agree")
    }
}

/// From 1 inside to 0 outside, over a width.
fn edge(distance: f32, width: f32) -> f32 {
    (0.5 - distance / width).clamp(0.0, 1.0)
}

fn shading(x: f32, y: f32) -> [f32; 3] {
    [0.6 + 0.3 * x, 0.45 - 0.3 * y, 0.3 + 0.2 * (5.0 * x).sin() * (4.0 * y).cos()]
}

/// A disc, cut out; `hidden` is the colour where alpha is 0.
fn disc(name: &'static str, size: usize, hidden: [f32; 3]) -> Sprite {
    let pixel = 2.0 / size as f32;
    Sprite::new(name, size, |x, y| {
        let alpha = edge(x.hypot(y) - 0.7, pixel);
        let [r, g, b] = if alpha == 0.0 { hidden } else { shading(x, y) };
        [r, g, b, alpha]
    })
}

fn sprites() -> Vec<Sprite> {
    let letters = |x: f32, y: f32| {
        let stroke = (x * 9.0).sin().abs() < 0.3 && y.abs() < 0.8 || (y * 7.0).cos().abs() < 0.25;
        f32::from(u8::from(stroke && x.abs() < 0.9))
    };
    vec![
        disc("disc on black", 96, [0.0; 3]),
        disc("disc on green", 96, [0.0, 1.0, 0.0]),
        Sprite::new("soft shadow", 96, |x, y| {
            [0.0, 0.0, 0.0, 0.8 * (-4.0 * (x * x + y * y)).exp()]
        }),
        Sprite::new("vignette", 80, |x, y| {
            let [r, g, b] = shading(x, y);
            [r, g, b, (1.2 - x.hypot(y)).clamp(0.0, 1.0)]
        }),
        Sprite::new("glow, premultiplied before", 72, |x, y| {
            // Colours come from premultiplied samples, and are rough where alpha is low.
            let alpha = ((-3.0 * x.hypot(y)).exp() * 255.0).round();
            let color = [0.9, 0.7, 0.2].map(|color: f32| (color * alpha).round() / alpha.max(1.0));
            [color[0].min(1.0), color[1].min(1.0), color[2].min(1.0), alpha / 255.0]
        }),
        Sprite::new("letters", 64, |x, y| [0.1, 0.1, 0.2, letters(x, y)]),
        Sprite::new("gray letters", 64, |x, y| [0.5, 0.5, 0.5, letters(x, y)]),
        Sprite::new("half", 48, |x, y| {
            let [r, g, b] = shading(x, y);
            [r, g, b, 0.5]
        }),
        Sprite::new("hair", 64, |x, y| {
            let line = (12.0 * x + 3.0 * (3.0 * y).sin()).sin().abs();
            [0.3, 0.2, 0.1, (1.0 - 3.0 * line).clamp(0.0, 0.9)]
        }),
        Sprite::new("nothing", 40, |x, _| [f32::from(u8::from(x < 0.0)), 0.3, 0.8, 0.0]),
    ]
}

/// RGBA samples over a background, which is black, white or a checkerboard.
fn over(samples: &[u8], width: usize, background: &str) -> Vec<u8> {
    let pixels = samples.chunks_exact(4).enumerate();
    let composited = pixels.flat_map(|(at, pixel)| {
        let behind = match background {
            "black" => 0.0,
            "white" => 255.0,
            _ => [255.0, 153.0][(at % width / 8 + at / width / 8) % 2],
        };
        let alpha = f32::from(pixel[3]) / 255.0;
        [0, 1, 2]
            .map(|channel| (f32::from(pixel[channel]) * alpha + behind * (1.0 - alpha) + 0.5) as u8)
    });
    composited.collect()
}

const BACKGROUNDS: [&str; 3] = ["black", "white", "checkerboard"];

fn decoded(file: &[u8], side: usize, output: ColorModel) -> Vec<u8> {
    let mut stream = StreamDecoder::new();
    stream.feed(file).expect("the file is sound");
    let picture = stream.picture().expect("the header was read");
    let options = RenderOptions::new().with_size(side as u32, side as u32).with_color(output);
    let mut out = vec![0; picture.output_len(&options).expect("small")];
    picture.render_u8(&options, &mut out).expect("within limits");
    out
}

#[test]
fn transparent_pictures_have_the_quality_that_they_are_said_to_have() {
    for (index, sprite) in sprites().iter().enumerate() {
        let precision = [Precision::Entropy, Precision::Packed][usize::from(index % 4 == 1)];
        let effort = 1 + index as u8 % 3;
        let encoder = Encoder::new().with_effort(effort).with_precision(precision);
        let encoded = encoder.encode(&sprite.source()).expect("it encodes");
        let found = decoded(&encoded.bytes, sprite.size, ColorModel::Rgba);
        let qualities = BACKGROUNDS.map(|background| {
            let [source, found] =
                [&sprite.samples, &found].map(|samples| over(samples, sprite.size, background));
            ssimulacra2(&source, &found, sprite.size)
        });
        let (least, said) = (qualities.into_iter().fold(100.0, f64::min), encoded.report.quality);
        println!("{}: {qualities:.1?}, said {said:.1}, {} bytes", sprite.name, encoded.bytes.len());
        assert!(least > 67.0 && said > 70.0, "{}: {qualities:.1?}, said {said}", sprite.name);
    }
}

/// The means of squares of pixels over a background.
fn scaled(sprite: &Sprite, factor: usize, background: &str) -> Vec<f32> {
    let shown = over(&sprite.samples, sprite.size, background);
    let side = sprite.size / factor;
    let mut out = vec![0.0; side * side * 3];
    for (at, &sample) in shown.iter().enumerate() {
        let (x, y) = (at / 3 % sprite.size / factor, at / 3 / sprite.size / factor);
        out[(y * side + x) * 3 + at % 3] += f32::from(sample) / (factor * factor) as f32;
    }
    out
}

fn root_mean_square(a: &[f32], b: &[u8]) -> f32 {
    let squares: f32 = a.iter().zip(b).map(|(a, &b)| (a - f32::from(b)).powi(2)).sum();
    (squares / a.len() as f32).sqrt()
}

#[test]
fn scaled_cut_outs_have_no_fringes() {
    for hidden in [[0.0; 3], [1.0; 3], [0.0, 1.0, 0.0]] {
        let sprite = disc("disc", 128, hidden);
        let encoder = Encoder::new().with_effort(2).with_target(Target::Quality(90.0));
        let file = encoder.encode(&sprite.source()).expect("it encodes").bytes;
        for background in ["black", "white"] {
            let opaque = over(&sprite.samples, sprite.size, background);
            let opaque = Source::new_u8(128, 128, ColorModel::Rgb, &opaque).expect("sizes agree");
            let opaque = encoder.encode(&opaque).expect("it encodes").bytes;
            for factor in [2, 4, 8] {
                let side = 128 / factor;
                let expected = scaled(&sprite, factor, background);
                let found = over(&decoded(&file, side, ColorModel::Rgba), side, background);
                let opaque = decoded(&opaque, side, ColorModel::Rgb);
                let of_opaque = root_mean_square(&expected, &opaque);
                let error = root_mean_square(&expected, &found);
                println!("{hidden:?} {background} 1/{factor}: {error} {of_opaque}");
                assert!(error < 1.1 * of_opaque + 0.5, "{hidden:?} {background} 1/{factor}");
            }
        }
    }
}

#[test]
fn what_does_not_show_costs_nothing() {
    let encoder = Encoder::new().with_effort(2).with_target(Target::Psnr(38.0));
    let mut rng = fastrand::Rng::with_seed(3);
    let plain = disc("disc", 96, [0.5; 3]);
    let mut noisy = disc("disc", 96, [0.5; 3]);
    for pixel in noisy.samples.chunks_exact_mut(4).filter(|pixel| pixel[3] == 0) {
        pixel[..3].fill_with(|| rng.u8(..));
    }
    let [plain, noisy_file] =
        [&plain, &noisy].map(|sprite| encoder.encode(&sprite.source()).expect("it encodes").bytes);
    assert_eq!(plain, noisy_file);
    let kept = encoder.clone().with_keep_invisible(true).encode(&noisy.source());
    let kept = kept.expect("it encodes");
    assert!(kept.bytes.len() > 3 * plain.len(), "{}, {}", kept.bytes.len(), plain.len());
}

#[test]
fn colours_under_alpha_0_are_kept_on_demand() {
    let size = 48;
    let sprite = Sprite::new("mask", size, |x, y| [0.5 + 0.4 * x, 0.5 + 0.4 * y, 0.2, 0.0]);
    for precision in [Precision::Float, Precision::Entropy] {
        let encoder = Encoder::new()
            .with_effort(2)
            .with_precision(precision)
            .with_target(Target::Psnr(38.0))
            .with_keep_invisible(true);
        let encoded = encoder.encode(&sprite.source()).expect("it encodes");
        let found = decoded(&encoded.bytes, size, ColorModel::Rgba);
        let psnr = image_gip::metrics::psnr(&found, &sprite.samples, 255.0);
        assert_eq!(psnr, encoded.report.psnr, "{precision:?}");
        assert!(psnr >= 38.0, "{precision:?}: {psnr}");
    }
}
