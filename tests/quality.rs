//! The visual quality that files have is the one that they are said to have, and the one that was asked
//! for, on pictures small, flat and dark as well.

mod metric;

use image_gip::{
    ColorModel, Encoded, Encoder, Precision, RenderOptions, Shortfall, Source, StreamDecoder,
    Target,
};
use metric::ssimulacra2;

/// A picture of 8-bit RGB.
struct Scene {
    name: &'static str,
    width: usize,
    samples: Vec<u8>,
}

impl Scene {
    /// From the colour at (x, y).
    fn new(
        name: &'static str,
        [width, height]: [usize; 2],
        pixel: impl Fn(usize, usize) -> [u8; 3],
    ) -> Self {
        let pixels = (0..width * height).flat_map(|at| pixel(at % width, at / width));
        Self { name, width, samples: pixels.collect() }
    }

    fn encoded(&self, encoder: &Encoder) -> Encoded {
        let height = self.samples.len() / (3 * self.width);
        let source =
            Source::new_u8(self.width as u32, height as u32, ColorModel::Rgb, &self.samples);
        encoder.encode(&source.expect("the sizes agree")).expect("it encodes")
    }
}

fn decoded(file: &[u8]) -> Vec<u8> {
    let mut stream = StreamDecoder::new();
    stream.feed(file).expect("the file is sound");
    let picture = stream.picture().expect("the header was read");
    let options = RenderOptions::new();
    let mut out = vec![0; picture.output_len(&options).expect("small")];
    picture.render_u8(&options, &mut out).expect("within limits");
    out
}

/// A figure of a few colours in cells, which is symmetric.
fn figure(x: usize, y: usize, side: usize, seed: usize) -> [u8; 3] {
    const COLORS: [[u8; 3]; 5] =
        [[24, 20, 37], [228, 59, 68], [254, 231, 97], [99, 199, 77], [192, 203, 220]];
    let x = x.min(side - 1 - x);
    let cell = (x * 7 + y * 13 + x * y * seed) % 11;
    COLORS[if x + y < side / 4 { 0 } else { cell.min(4) }]
}

/// Light from a point, from `most` down to 0 and up to 1 at the sides.
fn light(x: usize, y: usize, [width, height]: [usize; 2]) -> f32 {
    let (u, v) = (x as f32 / width as f32 - 0.4, y as f32 / height as f32 - 0.3);
    1.0 - u.hypot(v).min(1.0)
}

fn scenes() -> Vec<Scene> {
    let shade = |x, y, size, most: f32| (light(x, y, size) * most + 0.5) as u8;
    vec![
        Scene::new("8x8", [8, 8], |x, y| figure(x, y, 8, 3)),
        Scene::new("16x16", [16, 16], |x, y| figure(x, y, 16, 5)),
        Scene::new("24x32", [24, 32], |x, y| figure(x / 2, y / 2, 12, 2)),
        Scene::new("32x32", [32, 32], |x, y| figure(x, y, 32, 7)),
        Scene::new("48x48", [48, 48], |x, y| figure(x / 4, y / 4, 12, 4)),
        Scene::new("icon", [64, 64], |x, y| {
            let distance = (x as f32 - 31.5).hypot(y as f32 - 31.5);
            match distance as u32 {
                0..9 => [255, 220, 40],
                9..20 => [30, 110, 200],
                20..28 => [240, 240, 240],
                _ => [250, 250, 250],
            }
        }),
        Scene::new("saturated", [64, 48], |x, y| {
            [[255, 0, 0], [0, 255, 0], [0, 0, 255], [255, 0, 255]][(x / 16 + y / 12) % 4]
        }),
        Scene::new("dither", [64, 64], |x, y| {
            let threshold =
                [0, 8, 2, 10, 12, 4, 14, 6, 3, 11, 1, 9, 15, 7, 13, 5][x % 4 + y % 4 * 4];
            [if x / 4 > threshold { 255 } else { 0 }; 3]
        }),
        Scene::new("night", [160, 120], |x, y| {
            let size = [160, 120];
            [shade(x, y, size, 5.0), shade(x, y, size, 6.0), shade(x, y, size, 8.0)]
        }),
        Scene::new("gradient", [160, 120], |x, y| {
            let size = [160, 120];
            [shade(x, y, size, 250.0), shade(x, y, size, 180.0), 60 + shade(x, y, size, 90.0)]
        }),
        Scene::new("ramp", [256, 32], |x, _| [x as u8; 3]),
        Scene::new("dusk", [192, 64], |x, _| {
            let shade = |from: f32, to: f32| (from + (to - from) * x as f32 / 191.0 + 0.5) as u8;
            [shade(4.0, 12.0), shade(6.0, 9.0), shade(12.0, 20.0)]
        }),
        Scene::new("glow", [160, 120], |x, y| {
            let distance = (x as f32 / 160.0 - 0.5).hypot(y as f32 / 120.0 - 0.5);
            [(3.5 + 5.0 * (-6.0 * distance * distance).exp()) as u8; 3]
        }),
        Scene::new("bright", [160, 96], |x, y| {
            let shade = |most: f32| (255.0 - most * (x + y) as f32 / 254.0) as u8;
            [shade(14.0), shade(10.0), shade(20.0)]
        }),
        noise("noise 8x8", [8, 8]),
        noise("noise 16x16", [16, 16]),
        noise("noise 64x9", [64, 9]),
        soft("soft 8x8", [8, 8]),
        soft("soft 64x64", [64, 64]),
    ]
}

/// Colours by chance.
fn noise(name: &'static str, size: [usize; 2]) -> Scene {
    let rng = std::cell::RefCell::new(fastrand::Rng::with_seed(9));
    Scene::new(name, size, |_, _| [(); 3].map(|()| rng.borrow_mut().u8(..)))
}

/// Gentle shapes, as in a small part of a photograph.
fn soft(name: &'static str, size: [usize; 2]) -> Scene {
    Scene::new(name, size, |x, y| {
        let (x, y) = (x as f32, y as f32);
        let wave = (x * 0.21 + (y * 0.13).sin() * 2.0).sin() + 0.5 * (y * 0.3).cos();
        [120.0 + 30.0 * wave, 100.0 + 20.0 * wave + y * 0.5, 80.0 + 15.0 * wave + x * 0.4]
            .map(|shade| shade as u8)
    })
}

#[test]
fn the_quality_is_that_of_an_independent_metric() {
    for (index, scene) in scenes().iter().enumerate() {
        for precision in [Precision::Entropy, Precision::Packed] {
            let effort = if precision == Precision::Packed { 2 } else { 1 + index as u8 % 4 };
            let encoder = Encoder::new().with_effort(effort).with_precision(precision);
            let encoded = scene.encoded(&encoder);
            let found = ssimulacra2(&scene.samples, &decoded(&encoded.bytes), scene.width);
            let (name, said) = (scene.name, encoded.report.quality);
            let case =
                format!("{name}, {precision:?}, effort {effort}: {found:.1}, said {said:.1}");
            println!(
                "{case}, {} Gaussians, {} bytes",
                encoded.report.gaussians,
                encoded.bytes.len()
            );
            assert!((found.max(0.0) - said).abs() < 2.0, "{case}");
            // Six bits for a colour are too few for smooth gradients.
            assert!(precision == Precision::Packed || found > 67.0, "{case}");
        }
    }
}

/// The root mean square of the deviations of the means of square blocks, in the rows that are given.
fn deviation(scene: &Scene, found: &[u8], side: usize) -> f32 {
    let height = found.len() / (3 * scene.width);
    let mut squares = (0.0, 0.0);
    for (top, left) in (0..height)
        .step_by(side)
        .flat_map(|top| (0..scene.width).step_by(side).map(move |left| (top, left)))
    {
        let pixels = side * side;
        for channel in 0..3 {
            let mut sum = 0.0;
            for at in (0..pixels).map(|at| (top + at / side) * scene.width + left + at % side) {
                let at = 3 * at + channel;
                sum += f32::from(found[at]) - f32::from(scene.samples[at]);
            }
            squares.0 += (sum / pixels as f32).powi(2);
            squares.1 += 1.0;
        }
    }
    (squares.0 / squares.1).sqrt()
}

#[test]
fn gradients_come_back_without_blotches() {
    let names = ["night", "gradient", "ramp", "dusk", "glow", "bright"];
    for scene in scenes().iter().filter(|scene| names.contains(&scene.name)) {
        for effort in 1..=3 {
            let encoder = Encoder::new().with_effort(effort);
            let found = decoded(&scene.encoded(&encoder).bytes);
            let deviation = deviation(scene, &found, 8);
            println!("{}, effort {effort}: {deviation}", scene.name);
            assert!(deviation < 0.2, "{}, effort {effort}: {deviation}", scene.name);
        }
    }
}

#[test]
fn ordered_dither_has_its_quality() {
    // With few more Gaussians, a bad copy is an exact one.
    const THRESHOLDS: [[u32; 4]; 4] =
        [[0, 8, 2, 10], [12, 4, 14, 6], [3, 11, 1, 9], [15, 7, 13, 5]];
    let (width, height) = (240, 160);
    let pixel = |at: u32| {
        let (x, y) = (at % width, at / width);
        let is_white =
            32 * (x + y) > (width + height) * (2 * THRESHOLDS[y as usize % 4][x as usize % 4] + 1);
        u8::from(is_white) * 255
    };
    let samples: Vec<u8> = (0..width * height).map(pixel).collect();
    let source = Source::new_u8(width, height, ColorModel::Gray, &samples).expect("sizes agree");
    let encoded = Encoder::new().encode(&source).expect("it encodes");
    let quality = encoded.report.quality;
    println!("quality {quality}, {} bytes", encoded.bytes.len());
    assert!((73.0..77.0).contains(&quality) && encoded.bytes.len() < 50_000, "{quality}");
}

#[test]
fn a_small_checkerboard_has_its_quality() {
    // Its fit has long Gaussians, some of them with centres beside the picture.
    for side in [128, 160] {
        let pixel = |at: u32| ((at % side + at / side) % 2 * 255) as u8;
        let samples: Vec<u8> = (0..side * side).map(pixel).collect();
        let source = Source::new_u8(side, side, ColorModel::Gray, &samples).expect("sizes agree");
        let encoded = Encoder::new().with_effort(1).encode(&source).expect("it encodes");
        let quality = encoded.report.quality;
        println!("{side}: quality {quality}, {} bytes", encoded.bytes.len());
        // A single step of the search changes such a picture by points.
        assert!((73.0..78.0).contains(&quality), "{side}: {quality}");
    }
}

#[test]
fn noise_does_not_hide_clouds() {
    let size = [256, 160];
    for strength in [0.5, 3.0] {
        let rng = std::cell::RefCell::new(fastrand::Rng::with_seed(10));
        let scene = Scene::new("sky", size, |x, y| {
            let noise = || 2.0 * strength * (rng.borrow_mut().f32() - 0.5);
            let sky = 60.0 + 90.0 * light(x, y, size);
            [sky, sky + 30.0, sky + 70.0].map(|sample| (sample + noise()).round() as u8)
        });
        for effort in 1..=3 {
            let found = decoded(&scene.encoded(&Encoder::new().with_effort(effort)).bytes);
            let deviation = deviation(&scene, &found, 32);
            println!("{strength}, effort {effort}: {deviation}");
            assert!(deviation < 0.4, "{strength}, effort {effort}: {deviation}");
        }
    }
}

#[test]
fn a_gradient_does_not_make_the_rest_expensive() {
    let size = [256, 192];
    let rng = std::cell::RefCell::new(fastrand::Rng::with_seed(11));
    let scene = |is_clean: bool| {
        Scene::new("ground", size, |_, y| {
            let mut noise = 100.0 * (rng.borrow_mut().f32() - 0.5);
            let shade = if y < 96 { 200.0 - 0.7 * y as f32 } else { 110.0 };
            if y < 96 {
                noise = if is_clean { 0.0 } else { 0.02 * noise };
            }
            [(shade + noise).round() as u8; 3]
        })
    };
    let [clean, noisy] = [true, false].map(|is_clean| {
        let scene = scene(is_clean);
        let encoded = scene.encoded(&Encoder::new().with_effort(2));
        let above = &decoded(&encoded.bytes)[..3 * 256 * 80];
        (encoded.bytes.len(), deviation(&scene, above, 8))
    });
    println!("{clean:?} {noisy:?}");
    assert!(clean.1 < 0.4, "{clean:?}");
    assert!((clean.0 as f64) < 1.3 * noisy.0 as f64, "{clean:?}, {noisy:?}");
}

#[test]
fn a_quality_that_is_not_aimed_at_is_reported() {
    let scene = Scene::new("16x16", [16, 16], |x, y| {
        [(8 * x + 3 * y) as u8, (100 + 5 * y) as u8, (x * y / 2) as u8]
    });
    let report = scene.encoded(&Encoder::new().with_target(Target::Quality(100.0))).report;
    let shortfall = report.shortfall.expect("97 is the most");
    assert!(
        matches!(shortfall, Shortfall::QualityCapped { quality } | Shortfall::QualityBelow { quality }
            if quality == report.quality),
        "{shortfall:?}"
    );
}

/// A metric for large pictures takes nearly anything for a good copy of a small one.
#[test]
fn small_pictures_look_like_their_sources() {
    let tiny = [("3x5", [3, 5]), ("1x40", [1, 40]), ("40x1", [40, 1]), ("2x2", [2, 2])];
    let tiny = tiny.map(|(name, size)| noise(name, size));
    let scenes = scenes().into_iter().filter(|scene| scene.samples.len() < 3 * 113 * 113);
    for scene in scenes.chain(tiny) {
        let encoded = scene.encoded(&Encoder::new());
        let (psnr, quality) = (encoded.report.psnr, encoded.report.quality);
        println!("{}: {psnr:.1} dB, quality {quality:.1}", scene.name);
        assert!(psnr > if scene.name.starts_with("soft") { 32.0 } else { 15.0 }, "{}", scene.name);
        assert!(quality > 73.0, "{}: {quality}", scene.name);
    }
}
