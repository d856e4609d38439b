//! The encoder through its public interface: what it promises about files, targets and hard
//! pictures.

use std::ops::ControlFlow;

use image_gip::training::{
    ErrorNorm, GaussianFilter, LearningRateSchedule, NewColor, NewShape, Placement, Portion,
    Training,
};
use image_gip::{
    ColorModel, Decoder, EncodeError, Encoded, Encoder, Gaussian, Kernel, LimitKind, Limits,
    Metadata, MetadataError, OptionError, Parameterization, Precision, RenderOptions, Report,
    SampleDepth, Shortfall, Source, SourceError, StreamDecoder, Target, Text, Threads, Tune,
    metrics,
};

const COLORS: [ColorModel; 4] =
    [ColorModel::Gray, ColorModel::GrayAlpha, ColorModel::Rgb, ColorModel::Rgba];

/// A picture with ramps, edges and texture: no format finds it trivial.
fn scene(width: u32, height: u32, channels: usize) -> Vec<u8> {
    let mut samples = Vec::new();
    for y in 0..height {
        for x in 0..width {
            let (u, v) = (x as f32 / width as f32, y as f32 / height as f32);
            let ramp = 0.2 + 0.6 * u;
            let disc = if (u - 0.6).hypot(v - 0.4) < 0.2 { 0.5 } else { 0.0 };
            let wave = 0.15 * (40.0 * u * v).sin();
            for channel in 0..channels {
                let tint = 1.0 - 0.2 * channel as f32;
                let value = (ramp * tint + disc * (1.0 - tint) + wave) * 255.0;
                samples.push(value.clamp(0.0, 255.0) as u8);
            }
        }
    }
    samples
}

/// The scene in RGB with noise, so that a single Gaussian makes little difference.
fn textured(width: u32, height: u32) -> Vec<u8> {
    let scene = scene(width, height, 3);
    let noise = noise(scene.len());
    scene.iter().zip(noise).map(|(sample, noise)| sample.saturating_add(noise / 8)).collect()
}

/// A dark picture with faint texture and bright lamps, or a red one with a spot of fine texture: a few
/// places have nearly all of the error.
fn spotted(width: u32, height: u32, is_dark: bool) -> Vec<u8> {
    let lamps = [(30.0, 25.0, 3.0), (150.0, 40.0, 5.0), (80.0, 90.0, 4.0), (120.0, 100.0, 6.0)];
    let pixel = |x: f32, y: f32| {
        if is_dark {
            let is_lit =
                |&(left, top, radius): &(f32, f32, f32)| (x - left).hypot(y - top) < radius;
            let faint = 6.0 + 4.0 * (x / 9.0).sin() * (y / 7.0).sin();
            if lamps.iter().any(is_lit) { [255.0, 220.0, 150.0] } else { [faint; 3] }
        } else if (x - 90.0).hypot(y - 60.0) < 16.0 {
            [127.0 + 127.0 * (1.3 * x).sin() * (1.1 * y).sin(); 3]
        } else {
            [250.0, 10.0 + 5.0 * (x / 20.0).sin(), 0.0]
        }
    };
    let pixels = (0..height).flat_map(|y| (0..width).map(move |x| (x as f32, y as f32)));
    pixels.flat_map(|(x, y)| pixel(x, y)).map(|value| value.round() as u8).collect()
}

/// Pseudo-random samples.
fn noise(count: usize) -> Vec<u8> {
    let mut state = 1_u32;
    let next = || {
        state = state.wrapping_mul(1_664_525).wrapping_add(1_013_904_223);
        (state >> 24) as u8
    };
    std::iter::repeat_with(next).take(count).collect()
}

const PRECISIONS: [Precision; 3] = [Precision::Float, Precision::Packed, Precision::Entropy];

/// An encoder quick enough for tests.
fn quick(target: Target) -> Encoder {
    Encoder::new().with_effort(1).with_target(target)
}

fn decode(bytes: &[u8]) -> StreamDecoder {
    let mut stream = StreamDecoder::new().with_limits(Limits::default());
    stream.feed(bytes).expect("the decoder reads what the encoder writes");
    stream.finish().expect("the file is whole");
    stream
}

/// The picture without its texture, as the encoder judges it.
fn pixels_u8(stream: &StreamDecoder) -> Vec<u8> {
    let picture = stream.picture().expect("the header was read");
    let options = RenderOptions::new().with_texture(false);
    let mut out = vec![0; picture.output_len(&options).expect("small")];
    picture.render_u8(&options, &mut out).expect("within limits");
    out
}

fn psnr_u8(a: &[u8], b: &[u8]) -> f64 {
    metrics::psnr(a, b, 255.0)
}

/// Checks what every file must hold, and returns the decoder.
fn check(encoded: &Encoded, source: &[u8]) -> StreamDecoder {
    let stream = decode(&encoded.bytes);
    assert_eq!(stream.header().expect("read").gaussians, encoded.report.gaussians);
    assert!(stream.gaussians().iter().all(Gaussian::is_drawable), "a Gaussian is lost");
    let color = stream.header().expect("read").color;
    let [found, source] = [&pixels_u8(&stream)[..], source]
        .map(|samples| metrics::premultiplied(samples, color, 255.0));
    let (psnr, reported) = (metrics::psnr(&found, &source, 255.0), encoded.report.psnr);
    let is_reported = psnr == reported || (psnr - reported).abs() < 1e-4;
    assert!(is_reported, "the PSNR is {psnr}, but {reported} is reported");
    assert!(encoded.report.peak_memory > 0);
    stream
}

#[test]
fn reported_figures_are_those_of_the_file() {
    for color in COLORS {
        let samples = scene(61, 45, color.channels());
        let source = Source::new_u8(61, 45, color, &samples).expect("sizes agree");
        for precision in PRECISIONS {
            let encoder = quick(Target::Gaussians(120)).with_precision(precision);
            let encoded = encoder.encode(&source).expect("it encodes");
            let stream = check(&encoded, &samples);
            let report = &encoded.report;
            // Coding drops some whose bits are not worth it; else the budget is used up.
            let least = if precision == Precision::Entropy { 91 } else { 120 };
            assert!((least..=120).contains(&report.gaussians), "{}", report.gaussians);
            assert!(report.psnr > 24.0, "{color:?} {precision:?}: {} dB", report.psnr);
            // Rounding to 8 bits alone leaves 58.9 dB, and may cost 0.3 dB of 47.
            let rounded = -10.0 * (10_f64.powf(-report.psnr_float / 10.0) + 1.28e-6).log10();
            assert!((report.psnr - rounded).abs() < 0.3, "{report:?}");
            assert_eq!(report.iterations, 36);
            let bits: u32 = stream.quantizers().iter().map(|q| u32::from(q.bits())).sum();
            let channels = color.channels() as u32;
            match precision {
                Precision::Float => assert_eq!(bits, 32 * (5 + channels)),
                Precision::Packed => assert_eq!(bits, 24 + 30 + 6 * channels),
                // Their lengths differ from one Gaussian to the next.
                _ => assert_eq!(bits, 0),
            }
        }
    }
}

#[test]
fn sixteen_bits_are_kept() {
    let samples: Vec<u16> = (0..64 * 48).map(|i| (i % 64 * 1000 + i / 64 * 37) as u16).collect();
    let source = Source::new_u16(64, 48, ColorModel::Gray, &samples).expect("sizes agree");
    let encoder = quick(Target::Gaussians(100)).with_effort(3).with_precision(Precision::Float);
    let encoded = encoder.encode(&source).expect("it encodes");
    let stream = decode(&encoded.bytes);
    assert_eq!(stream.header().expect("read").depth, SampleDepth::Sixteen);
    let mut out = vec![0; samples.len()];
    let picture = stream.picture().expect("read");
    picture.render_u16(&RenderOptions::new(), &mut out).expect("within limits");
    let psnr = metrics::psnr(&out, &samples, 65535.0);
    assert_eq!(psnr, encoded.report.psnr);
    assert!(psnr > 40.0, "{psnr} dB");
    // A smooth ramp must not come back in steps of eight bits.
    assert!(out.iter().any(|value| value % 257 != 0));
}

#[test]
fn the_file_does_not_depend_on_threads_but_on_the_seed() {
    let samples = scene(90, 70, 3);
    let source = Source::new_u8(90, 70, ColorModel::Rgb, &samples).expect("sizes agree");
    let encode = |threads, seed| {
        let encoder = quick(Target::Gaussians(300)).with_threads(threads).with_seed(seed);
        encoder.encode(&source).expect("it encodes").bytes
    };
    let one = encode(Threads::One, 7);
    for threads in [1, 2, 5] {
        let pool = rayon::ThreadPoolBuilder::new().num_threads(threads).build().expect("threads");
        assert_eq!(one, pool.install(|| encode(Threads::Pool, 7)), "{threads}");
    }
    assert_eq!(one, encode(Threads::Pool, 7));
    assert_ne!(one, encode(Threads::One, 8));
}

#[test]
fn sizes_and_rates_are_met_within_one_percent() {
    let samples = scene(128, 96, 3);
    let source = Source::new_u8(128, 96, ColorModel::Rgb, &samples).expect("sizes agree");
    for (target, bytes) in [
        (Target::Bytes(2000), 2000.0),
        (Target::Bytes(5001), 5001.0),
        (Target::BitsPerPixel(1.5), 1.5 * 128.0 * 96.0 / 8.0),
    ] {
        let encoded = quick(target).encode(&source).expect("it encodes");
        check(&encoded, &samples);
        assert_eq!(encoded.report.shortfall, None, "{target:?}");
        let ratio = encoded.bytes.len() as f64 / bytes;
        assert!((0.99..=1.0).contains(&ratio), "{target:?}: {} bytes", encoded.bytes.len());
    }
}

#[test]
fn a_psnr_is_met_within_a_twentieth_of_a_decibel() {
    let samples = scene(96, 80, 3);
    let source = Source::new_u8(96, 80, ColorModel::Rgb, &samples).expect("sizes agree");
    for precision in PRECISIONS {
        let encoder = quick(Target::Psnr(44.0)).with_effort(3).with_precision(precision);
        let encoded = encoder.encode(&source).expect("it encodes");
        check(&encoded, &samples);
        let psnr = encoded.report.psnr;
        assert_eq!(encoded.report.shortfall, None, "{precision:?}: {psnr} dB");
        assert!((44.0..44.05).contains(&psnr), "{precision:?}: {psnr} dB");
    }
    // A few Gaussians come in few qualities, none of them less than asked for.
    let samples: Vec<u8> = (0..32 * 32 * 3).map(|i| (i / 3 % 32 * 8 + i / 96) as u8).collect();
    let source = Source::new_u8(32, 32, ColorModel::Rgb, &samples).expect("sizes agree");
    let encoded = quick(Target::Psnr(33.0)).encode(&source).expect("it encodes");
    check(&encoded, &samples);
    let (psnr, gaussians) = (encoded.report.psnr, encoded.report.gaussians);
    assert!((33.0..40.0).contains(&psnr), "{psnr} dB");
    let above = (psnr > 33.05).then_some(Shortfall::PsnrAbove { psnr, gaussians });
    assert_eq!(encoded.report.shortfall, above);
}

#[test]
fn quality_is_monotone_and_simple_pictures_get_few_gaussians() {
    let encoded = |samples: &[u8], target| {
        let source = Source::new_u8(96, 64, ColorModel::Rgb, samples).expect("sizes agree");
        quick(target).encode(&source).expect("it encodes")
    };
    let count = |samples: &[u8], target| encoded(samples, target).report.gaussians;
    let picture = textured(96, 64);
    let files = [0.0, 30.0, 60.0, 90.0].map(|q| encoded(&picture, Target::Quality(q)));
    let sizes = files.each_ref().map(|file| file.bytes.len());
    let qualities = files.each_ref().map(|file| file.report.quality);
    assert!(sizes.is_sorted_by(|a, b| a < b), "{sizes:?}");
    assert!(qualities.is_sorted_by(|a, b| a < b), "{qualities:?}");
    assert_eq!(count(&picture, Target::Auto), count(&picture, Target::Quality(75.0)));
    // Whatever is asked for, a flat picture has nothing to model.
    assert_eq!(count(&[77; 96 * 64 * 3], Target::Auto), 0);
    assert_eq!(count(&[77; 96 * 64 * 3], Target::Gaussians(5000)), 0);
    let ramp: Vec<u8> = (0..96 * 64 * 3).map(|i| (40 + i / 3 % 96) as u8).collect();
    let (simple, busy) = (count(&ramp, Target::Auto), count(&noise(96 * 64 * 3), Target::Auto));
    assert!(simple < 60 && simple * 3 < busy, "{simple} against {busy}");
}

#[test]
fn a_quality_is_met_and_estimated() {
    let (width, height) = (120, 88);
    let samples = textured(width, height);
    let source = Source::new_u8(width, height, ColorModel::Rgb, &samples).expect("sizes agree");
    for tune in [Tune::Visual, Tune::Psnr] {
        let mut sizes = Vec::new();
        for quality in [50.0, 70.0, 85.0] {
            let encoder = quick(Target::Quality(quality)).with_tune(tune).with_effort(3);
            let encoded = encoder.encode(&source).expect("it encodes");
            check(&encoded, &samples);
            let found = encoded.report.quality;
            assert_eq!(encoded.report.shortfall, None, "{tune:?}: {found} of {quality}");
            assert!((found - quality).abs() <= 1.0, "{tune:?}: {found} of {quality}");
            sizes.push(encoded.bytes.len());
        }
        assert!(sizes[0] < sizes[2], "{tune:?}: {sizes:?}");
    }
    // A picture with nothing to model has the best quality at any target.
    let flat = vec![60; samples.len()];
    let source = Source::new_u8(width, height, ColorModel::Rgb, &flat).expect("sizes agree");
    let report = quick(Target::Quality(40.0)).encode(&source).expect("it encodes").report;
    assert_eq!(report.quality, 100.0);
    let above = Shortfall::QualityAbove { quality: 100.0, gaussians: 0 };
    assert_eq!(report.shortfall, Some(above));
}

#[test]
fn a_higher_lambda_gives_fewer_bytes() {
    let samples = scene(96, 64, 3);
    let source = Source::new_u8(96, 64, ColorModel::Rgb, &samples).expect("sizes agree");
    let sizes = [30.0, 300.0, 3000.0].map(|lambda| {
        let encoded = quick(Target::Lambda(lambda)).encode(&source).expect("it encodes");
        assert_eq!(encoded.report.shortfall, None);
        encoded.bytes.len()
    });
    assert!(sizes.is_sorted_by(|a, b| a > b), "{sizes:?}");
}

#[test]
fn each_tuning_is_the_better_one_by_its_own_measure() {
    // Strong texture on the left, faint texture on the right.
    let (width, height) = (128, 96);
    let mut rng = fastrand::Rng::with_seed(8);
    let samples: Vec<u8> = (0..width * height)
        .map(|at| {
            let reach = if at % width < width / 2 { 90 } else { 12 };
            128 - reach + rng.u8(0..=2 * reach)
        })
        .collect();
    // Texture that Gaussians can follow has some size.
    let samples: Vec<u8> = (0..width * height)
        .map(|at| {
            let (x, y) = (at % width / 4 * 4, at / width / 4 * 4);
            samples[y * width + x]
        })
        .collect();
    let source = Source::new_u8(width as u32, height as u32, ColorModel::Gray, &samples)
        .expect("sizes agree");
    let report = |tune| {
        let encoder = quick(Target::Bytes(1500)).with_tune(tune).with_effort(3);
        encoder.encode(&source).expect("it encodes").report
    };
    let (visual, psnr) = (report(Tune::Visual), report(Tune::Psnr));
    assert!(visual.quality > psnr.quality + 3.0, "{visual:?}, {psnr:?}");
    assert!(psnr.psnr > visual.psnr + 0.3, "{visual:?}, {psnr:?}");
}

#[test]
fn small_files_of_large_pictures_show_them() {
    // No side is a multiple of that of the squares that the encoder takes averages of.
    const SIZE: [u32; 2] = [330, 233];
    for color in COLORS {
        let samples = scene(SIZE[0], SIZE[1], color.channels());
        let source = Source::new_u8(SIZE[0], SIZE[1], color, &samples).expect("sizes agree");
        for tune in [Tune::Visual, Tune::Psnr] {
            let report = |bytes| {
                let encoder = quick(Target::Bytes(bytes)).with_tune(tune).with_effort(2);
                let encoded = encoder.encode(&source).expect("it encodes");
                assert!(encoded.bytes.len() as u64 <= bytes, "{color:?}, {tune:?}");
                encoded.report
            };
            let reports = [60, 120, 300, 900].map(report);
            let rises = reports.windows(2).all(|pair| pair[1].psnr > pair[0].psnr + 1.0);
            assert!(rises, "{color:?}, {tune:?}: {:?}", reports.map(|report| report.psnr));
        }
    }
}

#[test]
fn small_ramps_are_not_given_up() {
    const SIZE: u32 = 32;
    let ramps: Vec<u8> = (0..SIZE * SIZE)
        .flat_map(|at| {
            let [red, green] = [at % SIZE, at / SIZE].map(|place| (255 - 255 * place / 31) as u8);
            [red, green, (255 - red).saturating_sub(green)]
        })
        .collect();
    let source = Source::new_u8(SIZE, SIZE, ColorModel::Rgb, &ramps).expect("sizes agree");
    for quality in [25.0, 50.0, 75.0] {
        for effort in [1, 4] {
            let encoder = quick(Target::Quality(quality)).with_effort(effort);
            let encoded = encoder.encode(&source).expect("encodes");
            let found = encoded.report.quality;
            assert!(found > quality - 1.0, "quality {quality}, effort {effort}: {found}");
        }
    }
}

#[test]
fn hard_pictures_become_sound_files() {
    let checkers: Vec<u8> = (0..64 * 64).map(|i| ((i + i / 64) % 2 * 255) as u8).collect();
    let mut impulse = vec![0; 64 * 64];
    impulse[20 * 64 + 30] = 255;
    let ramp: Vec<u8> = (0..256 * 16).map(|i| (i % 256) as u8).collect();
    let text: Vec<u8> =
        (0..64 * 64).map(|i| if (i % 7 < 2) ^ (i / 64 % 5 < 1) { 0 } else { 255 }).collect();
    let binary_alpha: Vec<u8> = (0..48 * 48)
        .flat_map(|i| [200, 30, 90, if (i % 48) + i / 48 < 48 { 255 } else { 0 }])
        .collect();
    let soft_alpha: Vec<u8> = (0..48 * 48).flat_map(|i| [120, (i % 48 * 5) as u8]).collect();
    let cases: [(&str, u32, u32, ColorModel, Vec<u8>); 14] = [
        ("1x1", 1, 1, ColorModel::Rgb, vec![9, 200, 31]),
        ("2x1", 2, 1, ColorModel::Rgba, vec![0, 0, 0, 0, 255, 255, 255, 255]),
        ("1xN", 1, 300, ColorModel::Gray, noise(300)),
        ("Nx1", 300, 1, ColorModel::Gray, noise(300)),
        ("wide", 8192, 16, ColorModel::Gray, scene(8192, 16, 1)),
        ("black", 33, 17, ColorModel::Rgb, vec![0; 33 * 17 * 3]),
        ("white", 33, 17, ColorModel::Rgb, vec![255; 33 * 17 * 3]),
        ("impulse", 64, 64, ColorModel::Gray, impulse),
        ("checkers", 64, 64, ColorModel::Gray, checkers),
        ("ramp", 256, 16, ColorModel::Gray, ramp),
        ("noise", 40, 40, ColorModel::Rgb, noise(40 * 40 * 3)),
        ("text", 64, 64, ColorModel::Gray, text),
        ("binary alpha", 48, 48, ColorModel::Rgba, binary_alpha),
        ("soft alpha", 48, 48, ColorModel::GrayAlpha, soft_alpha),
    ];
    for (name, width, height, color, samples) in cases {
        let source = Source::new_u8(width, height, color, &samples).expect("sizes agree");
        let counts = [1, 50, 100_000].map(Target::Gaussians);
        for target in counts.into_iter().chain([Target::Auto]) {
            // A fit of one Gaussian per pixel takes long on all but the smallest.
            if target == Target::Gaussians(100_000) && samples.len() > 2000 {
                continue;
            }
            for precision in PRECISIONS {
                let encoder = quick(target).with_precision(precision);
                let encoded = encoder.encode(&source).expect("it encodes");
                let stream = check(&encoded, &samples);
                assert!(
                    u64::from(encoded.report.gaussians) <= u64::from(width) * u64::from(height)
                );
                let report = &encoded.report;
                let least =
                    if matches!(name, "1x1" | "black" | "white") { f64::INFINITY } else { 5.0 };
                assert!(report.psnr >= least, "{name} {target:?} {precision:?}: {}", report.psnr);
                assert_eq!(stream.header().expect("read").width, width);
            }
        }
    }
}

/// Stronger Gaussians would be such that show between the centres of pixels, or cancel each other: what is left of
/// them in the picture would be rounding errors.
#[test]
fn no_gaussian_is_much_stronger_than_white() {
    let checker: Vec<u8> = (0..64 * 64).map(|i| ((i % 64 + i / 64) % 2 * 255) as u8).collect();
    let source = Source::new_u8(64, 64, ColorModel::Gray, &checker).expect("a picture");
    for tune in [Tune::Visual, Tune::Psnr] {
        let encoder = quick(Target::BitsPerPixel(4.0)).with_tune(tune).with_texture(0);
        let stream = decode(&encoder.encode(&source).expect("the options are valid").bytes);
        let strongest = stream.gaussians().iter().map(|gaussian| gaussian.color[0].abs());
        let strongest = strongest.fold(0.0, f32::max);
        assert!((0.3..3.0).contains(&strongest), "{strongest}");
    }
}

#[test]
fn one_bright_pixel_is_found() {
    let mut samples = vec![20; 64 * 48];
    samples[17 * 64 + 40] = 255;
    let source = Source::new_u8(64, 48, ColorModel::Gray, &samples).expect("sizes agree");
    let encoder = quick(Target::Gaussians(8)).with_effort(4).with_precision(Precision::Float);
    let encoded = encoder.encode(&source).expect("it encodes");
    let out = pixels_u8(&check(&encoded, &samples));
    assert!(out[17 * 64 + 40] > 150, "{}", out[17 * 64 + 40]);
}

#[test]
fn more_effort_makes_no_small_picture_worse() {
    // Stripes, dots on black and noise, with few Gaussians: which fit is the better one is chance.
    let dots: Vec<u8> = noise(60 * 40).iter().map(|&value| u8::from(value > 250) * 255).collect();
    let stripes =
        (0..60 * 40).map(|at| if (at % 60 + at / 60) % 9 < 3 { 40 } else { 210 }).collect();
    for samples in [stripes, dots, noise(60 * 40)] {
        let source = Source::new_u8(60, 40, ColorModel::Gray, &samples).expect("sizes agree");
        for (tune, rate) in [(Tune::Visual, 0.6), (Tune::Psnr, 0.6), (Tune::Psnr, 2.0)] {
            let merit = [1, 2, 3, 4].map(|effort| {
                let encoder = quick(Target::BitsPerPixel(rate)).with_effort(effort).with_tune(tune);
                let Report { quality, psnr, .. } =
                    encoder.encode(&source).expect("it encodes").report;
                if tune == Tune::Visual { quality } else { psnr }
            });
            println!("{tune:?}, {rate}: {merit:?}");
            assert!(merit.is_sorted(), "{tune:?}, {rate}: {merit:?}");
        }
    }
}

#[test]
fn line_art_makes_use_of_its_size() {
    // A wave, black on white.
    let side = 96;
    let pixel = |at: u32| {
        let (x, y) = ((at % side) as f32, (at / side) as f32);
        let height = (0.37 * x + 0.2 * y).sin() * 40.0 + side as f32 / 2.0;
        if (height - y).abs() < 1.0 { 0 } else { 255 }
    };
    let samples: Vec<u8> = (0..side * side).map(pixel).collect();
    let source = Source::new_u8(side, side, ColorModel::Gray, &samples).expect("sizes agree");
    let psnr = [0.8, 1.6].map(|bits| {
        let encoder = quick(Target::BitsPerPixel(bits)).with_effort(2);
        let encoded = encoder.encode(&source).expect("it encodes");
        println!("{bits}: {} bytes, {} dB", encoded.bytes.len(), encoded.report.psnr);
        encoded.report.psnr
    });
    assert!(psnr[1] > psnr[0].max(50.0), "{psnr:?}");
}

#[test]
fn a_small_number_of_gaussians_is_used() {
    // Far more colours than Gaussians: they make hardly anything of the picture (and five, a hundredth of a
    // decibel, so that which of them are worth their bits is chance).
    let colors = noise(24 * 16 * 3);
    let blocks = (0..192 * 128).flat_map(|at| {
        let block = at % 192 / 8 + at / 192 / 8 * 24;
        colors[3 * block..][..3].to_vec()
    });
    let samples: Vec<u8> = blocks.collect();
    let source = Source::new_u8(192, 128, ColorModel::Rgb, &samples).expect("sizes agree");
    for effort in [1, 4] {
        let mut last = 0.0;
        for count in [20, 60, 150] {
            let encoder = quick(Target::Gaussians(count)).with_effort(effort);
            let encoded = encoder.encode(&source).expect("it encodes");
            let psnr = psnr_u8(&pixels_u8(&check(&encoded, &samples)), &samples);
            let found = encoded.report.gaussians;
            println!("{count}, effort {effort}: {found}, {psnr} dB");
            assert!(
                found >= count.div_ceil(3) && found <= count && psnr > last,
                "{count}: {found}"
            );
            last = psnr;
        }
    }
}

#[test]
fn many_gaussians_in_a_small_part_of_a_picture_come_to_rest() {
    const WIDTH: u32 = 640;
    const HEIGHT: u32 = 480;
    const SIDE: u32 = 40;
    let detail = scene(SIDE, SIDE, 3);
    let mut samples = vec![20; 3 * (WIDTH * HEIGHT) as usize];
    for y in 0..SIDE {
        let row = &detail[(y * SIDE * 3) as usize..][..SIDE as usize * 3];
        let first = 3 * ((y + 200) * WIDTH + 300) as usize;
        samples[first..][..row.len()].copy_from_slice(row);
    }
    let source = Source::new_u8(WIDTH, HEIGHT, ColorModel::Rgb, &samples).expect("sizes agree");
    for (effort, least) in [(1, 33.0), (2, 41.0), (3, 45.0)] {
        let encoder = quick(Target::Gaussians(1000)).with_effort(effort);
        let encoded = encoder.encode(&source).expect("it is encoded");
        let psnr = psnr_u8(&pixels_u8(&decode(&encoded.bytes)), &samples);
        assert!(psnr > least, "{psnr} dB at effort {effort}");
    }
}

#[test]
fn a_prefix_of_the_file_already_shows_the_picture() {
    let samples = scene(128, 96, 3);
    let source = Source::new_u8(128, 96, ColorModel::Rgb, &samples).expect("sizes agree");
    let encoder = Encoder::new().with_effort(2).with_target(Target::Gaussians(1200));
    let encoded = encoder.encode(&source).expect("it encodes");
    let shown = |bytes: usize| {
        let mut stream = StreamDecoder::new();
        stream.feed(&encoded.bytes[..bytes]).expect("a prefix is sound");
        psnr_u8(&pixels_u8(&stream), &samples)
    };
    let steps = [200, encoded.bytes.len() / 4, encoded.bytes.len() / 2, encoded.bytes.len()];
    let psnr = steps.map(shown);
    assert!(psnr[1] > psnr[0] + 3.0 && psnr[3] > psnr[2], "{psnr:?}");
    assert_eq!(psnr[3], encoded.report.psnr);
}

#[test]
fn every_published_variant_trains() {
    let samples = scene(80, 60, 3);
    let source = Source::new_u8(80, 60, ColorModel::Rgb, &samples).expect("sizes agree");
    let mut paper = Training::paper();
    paper.iterations = 400;
    paper.densification.prune_interval = 20;
    let mut trainings = vec![paper.clone()];
    for parameterization in
        [Parameterization::Covariance, Parameterization::Cholesky, Parameterization::RotationScale]
    {
        // GaussianImage: all Gaussians at once, a constant filter.
        let mut training = paper.clone();
        training.parameterization = parameterization;
        training.densification.initial = 1.0;
        training.filter = GaussianFilter::Constant(0.5);
        trainings.push(training);
        let mut training = Training::fast(100);
        training.parameterization = parameterization;
        training.kernel = Kernel::PAPER;
        trainings.push(training);
    }
    for portion in [Portion::Even, Portion::Half] {
        for placement in [Placement::Top, Placement::Spread] {
            let mut training = Training::fast(60);
            training.densification.portion = portion;
            training.densification.color = NewColor::Zero;
            training.densification.shape = NewShape::Random;
            training.densification.error_norm = ErrorNorm::L1;
            training.densification.placement = placement;
            training.schedule = LearningRateSchedule::Halving(40);
            trainings.push(training);
        }
    }
    for training in trainings {
        for precision in [Precision::Float, Precision::Packed] {
            let encoder = Encoder::new()
                .with_target(Target::Gaussians(150))
                .with_precision(precision)
                .with_training(training.clone());
            let encoded = encoder.encode(&source).expect("it encodes");
            let stream = check(&encoded, &samples);
            assert_eq!(stream.header().expect("read").parameterization, training.parameterization);
            assert!(encoded.report.psnr > 14.0, "{} dB: {training:?}", encoded.report.psnr);
        }
    }
}

#[test]
fn training_that_begins_with_copies_ends_at_the_resolution_of_the_picture() {
    // Three copies, with sides that are no multiples of each other.
    let (width, height) = (301, 223);
    let samples = scene(width, height, 3);
    let source = Source::new_u8(width, height, ColorModel::Rgb, &samples).expect("sizes agree");
    for parameterization in
        [Parameterization::Covariance, Parameterization::Cholesky, Parameterization::RotationScale]
    {
        for iterations in [1, 2, 7, 40] {
            let [plain, begun_small] = [None, Some(1)].map(|coarse_to_fine| {
                let mut training = Training::fast(iterations);
                (training.parameterization, training.coarse_to_fine) =
                    (parameterization, coarse_to_fine);
                let encoder = Encoder::new()
                    .with_target(Target::Gaussians(80))
                    .with_precision(Precision::Float)
                    .with_tune(Tune::Psnr)
                    .with_training(training);
                encoder.encode(&source).expect("it encodes").report.psnr
            });
            assert!(
                begun_small > plain - 1.0,
                "{parameterization:?}, {iterations}: {begun_small}, {plain}"
            );
        }
    }
}

#[test]
fn options_out_of_range_are_refused_with_what_is_allowed() {
    let samples = [0; 12];
    let source = Source::new_u8(2, 2, ColorModel::Rgb, &samples).expect("sizes agree");
    let refused = |encoder: Encoder| match encoder.encode(&source).expect_err("out of range") {
        EncodeError::Option(error) => error,
        error => panic!("{error}"),
    };
    for effort in [0, 8, 255] {
        let error = refused(Encoder::new().with_effort(effort));
        assert_eq!(error, OptionError::Effort(effort));
        assert!(error.to_string().contains("1 to 7"), "{error}");
    }
    for (target, found, range, what) in [
        (Target::Gaussians(0), 0.0, (1.0, 4_194_304.0), "Gaussians"),
        (Target::Gaussians(4_194_305), 4_194_305.0, (1.0, 4_194_304.0), "Gaussians"),
        (Target::Psnr(f64::NAN), f64::NAN, (1.0, 120.0), "PSNR"),
        (Target::Psnr(-3.0), -3.0, (1.0, 120.0), "PSNR"),
        (Target::Psnr(120.5), 120.5, (1.0, 120.0), "PSNR"),
        (Target::BitsPerPixel(f64::INFINITY), f64::INFINITY, (1e-6, 1e6), "bits per pixel"),
        (Target::BitsPerPixel(0.0), 0.0, (1e-6, 1e6), "bits per pixel"),
        (Target::Quality(101.0), 101.0, (0.0, 100.0), "quality"),
        (Target::Quality(-1.0), -1.0, (0.0, 100.0), "quality"),
        (Target::Bytes(0), 0.0, (1.0, 1_073_741_824.0), "size"),
    ] {
        let error = refused(Encoder::new().with_target(target));
        let OptionError::Target { name, value, least, most } = error else { panic!("{error}") };
        assert_eq!(value.to_bits(), found.to_bits(), "{target:?}");
        assert_eq!((least, most), range, "{target:?}");
        assert!(name.contains(what), "{name}");
    }
    // A size that the file would have without its metadata.
    let mut metadata = Metadata::default();
    metadata.xmp = Some(vec![b'x'; 1000]);
    let error = refused(quick(Target::Bytes(500)).with_metadata(metadata));
    let OptionError::Size { bytes: 500, least, metadata } = error else { panic!("{error}") };
    assert!(metadata > 1000 && (metadata..metadata + 200).contains(&least), "{error}");

    for (keyword, text, expected) in [
        ("k".repeat(80), "", MetadataError::Keyword("k".repeat(80))),
        (String::new(), "", MetadataError::Keyword(String::new())),
        ("a\0".into(), "", MetadataError::Nul("a\0".into())),
        ("a".into(), "b\0c", MetadataError::Nul("a".into())),
    ] {
        let mut metadata = Metadata::default();
        metadata.texts.push(Text::new(keyword, text));
        let error = refused(Encoder::new().with_metadata(metadata));
        assert_eq!(error, OptionError::Metadata(expected));
    }

    let mut training = Training::fast(10);
    training.quantization.color_bits = 17;
    let error = refused(Encoder::new().with_training(training));
    assert!(matches!(error, OptionError::Training(_)), "{error:?}");
    assert!(error.to_string().contains("1 to 16"), "{error}");
    let mut training = Training::fast(10);
    training.coarse_to_fine = Some(0);
    let error = refused(Encoder::new().with_training(training));
    assert!(error.to_string().contains("coarse_to_fine must be at least 1"), "{error}");
    let mut training = Training::fast(10);
    training.kernel = Kernel::PAPER;
    let error = refused(Encoder::new().with_training(training));
    assert!(matches!(error, OptionError::Training(_)), "{error:?}");
    assert!(error.to_string().contains("quartic"), "{error}");
}

#[test]
fn samples_that_are_no_picture_are_refused() {
    let color = ColorModel::Rgb;
    for (width, height, found, expected) in [
        (0, 1, 0, SourceError::Size { width: 0, height: 1 }),
        (1, 0, 0, SourceError::Size { width: 1, height: 0 }),
        ((1 << 20) + 1, 1, 3, SourceError::Size { width: (1 << 20) + 1, height: 1 }),
        (2, 2, 11, SourceError::SampleCount { found: 11, wanted: 12, width: 2, height: 2, color }),
        (1, 2, 7, SourceError::SampleCount { found: 7, wanted: 6, width: 1, height: 2, color }),
    ] {
        let (eight, sixteen) = (vec![0_u8; found], vec![0_u16; found]);
        let refused = [
            Source::new_u8(width, height, color, &eight).expect_err("wrong"),
            Source::new_u16(width, height, color, &sixteen).expect_err("wrong"),
        ];
        assert_eq!(refused, [expected; 2]);
        match image_gip::encode(width, height, color, &eight).expect_err("wrong") {
            EncodeError::Source(error) => assert_eq!(error, expected),
            error => panic!("{error}"),
        }
    }
}

#[test]
fn the_short_way_is_the_default_encoder() {
    for color in COLORS {
        let samples = scene(24, 16, color.channels());
        let source = Source::new_u8(24, 16, color, &samples).expect("sizes agree");
        let encoded = Encoder::new().encode(&source).expect("it encodes");
        check(&encoded, &samples);
        let file = image_gip::encode(24, 16, color, &samples).expect("it encodes");
        assert_eq!(file, encoded.bytes, "{color:?}");
    }
}

#[test]
fn what_a_target_does_not_reach_is_told() {
    let encoded = |samples: &[u8], target| {
        let source = Source::new_u8(24, 24, ColorModel::Gray, samples).expect("sizes agree");
        let encoded = quick(target).encode(&source).expect("it encodes");
        check(&encoded, samples);
        encoded
    };
    let (noise, flat) = (noise(24 * 24), [77; 24 * 24]);
    // Noise at a PSNR that nothing but a copy has.
    let below = encoded(&noise, Target::Psnr(110.0));
    let psnr = below.report.psnr;
    assert!(psnr < 110.0);
    assert_eq!(below.report.shortfall, Some(Shortfall::PsnrBelow { psnr }));
    // One colour is an exact copy without a Gaussian, at any PSNR and of any size.
    let above = encoded(&flat, Target::Psnr(30.0)).report.shortfall;
    assert_eq!(above, Some(Shortfall::PsnrAbove { psnr: f64::INFINITY, gaussians: 0 }));
    let small = encoded(&flat, Target::Bytes(5000));
    let bytes = small.bytes.len();
    assert_eq!(small.report.shortfall, Some(Shortfall::SizeBelow { bytes, gaussians: 0 }));
    // So it is with more than a fit can use that ends too soon. A smaller file was tried as well, in two runs
    // of 8 iterations, and it is not nearly as good.
    let source = Source::new_u8(24, 24, ColorModel::Gray, &noise).expect("sizes agree");
    let hasty = quick(Target::BitsPerPixel(1000.0)).with_training(Training::fast(8));
    let large = hasty.encode(&source).expect("it encodes");
    check(&large, &noise);
    let report = &large.report;
    let as_large = Shortfall::SizeUnused { bytes: large.bytes.len(), gaussians: report.gaussians };
    assert_eq!(report.shortfall, Some(as_large));
    assert_eq!(report.iterations, 16);
    // Where Gaussians bring nothing, a large file is not written.
    let wave =
        |i: i32| 128.0 + 20.0 * ((i % 64) as f32 / 9.0).sin() + 15.0 * (i as f32 / 448.0).cos();
    let waves: Vec<u8> = (0..64 * 64).map(|i| wave(i) as u8).collect();
    let source = Source::new_u8(64, 64, ColorModel::Gray, &waves).expect("sizes agree");
    let encoder = quick(Target::BitsPerPixel(12.0));
    let useless = encoder.encode(&source).expect("it encodes");
    let report = &useless.report;
    let too_large =
        Shortfall::SizeUseless { bytes: useless.bytes.len(), gaussians: report.gaussians };
    assert_eq!(report.shortfall, Some(too_large));
    assert!(useless.bytes.len() < 64 * 64 * 4 / 8, "{too_large}");
    // A number of Gaussians is a bound, not a target.
    assert_eq!(encoded(&flat, Target::Gaussians(50)).report.shortfall, None);
    assert_eq!(encoded(&noise, Target::Auto).report.shortfall, None);
    for (shortfall, said) in [
        (below.report.shortfall, format!("{psnr:.2} dB")),
        (above, "0 Gaussians".into()),
        (small.report.shortfall, format!("{bytes} bytes")),
    ] {
        let text = shortfall.expect("just seen").to_string();
        assert!(text.contains(&said), "{text}");
    }
}

#[test]
fn a_size_below_the_least_file_gives_that() {
    let samples = noise(24 * 24);
    let source = Source::new_u8(24, 24, ColorModel::Gray, &samples).expect("sizes agree");
    for precision in [Precision::Entropy, Precision::Packed, Precision::Float] {
        let encoder = |target| quick(target).with_precision(precision);
        let encoded = |target| encoder(target).encode(&source).expect("it encodes");
        let smallest = encoded(Target::Bytes(1));
        check(&smallest, &samples);
        let bytes = smallest.bytes.len();
        let shortfall = Some(Shortfall::SizeAbove { bytes, metadata: 0 });
        assert_eq!(smallest.report.gaussians, 0);
        assert_eq!(smallest.report.shortfall, shortfall);
        // A rate of less than a byte, and the size just below.
        for target in [Target::BitsPerPixel(1e-6), Target::Bytes(bytes as u64 - 1)] {
            let same = encoded(target);
            assert_eq!((same.bytes, same.report.shortfall), (smallest.bytes.clone(), shortfall));
        }
        assert_eq!(encoded(Target::Bytes(bytes as u64)).report.shortfall, None);
        // Metadata that do not matter, as the file would be too large without them.
        let mut metadata = Metadata::default();
        metadata.xmp = Some(vec![b'x'; 1000]);
        let with_metadata = encoder(Target::Bytes(20)).with_metadata(metadata);
        let shortfall = with_metadata.encode(&source).expect("it encodes").report.shortfall;
        let text = shortfall.expect("it is too large").to_string();
        assert!(text.contains("the least") && text.contains("are metadata"), "{text}");
    }
}

#[test]
fn more_bits_and_more_effort_give_no_worse_picture() {
    let (width, height) = (384, 256);
    for is_dark in [true, false] {
        let samples = spotted(width, height, is_dark);
        let source = Source::new_u8(width, height, ColorModel::Rgb, &samples).expect("sizes agree");
        for tune in [Tune::Visual, Tune::Psnr] {
            let psnr = |effort, rate| {
                let encoder = quick(Target::BitsPerPixel(rate)).with_effort(effort).with_tune(tune);
                encoder.encode(&source).expect("it encodes").report.psnr
            };
            let psnrs = [psnr(1, 0.3), psnr(1, 0.6), psnr(2, 0.6)];
            // Above this, hardly anything but the rounding to samples, 58.9 dB, is left of the error.
            let is_no_worse = |pair: &[f64]| pair[1].min(58.0) >= pair[0].min(58.0) - 0.1;
            assert!(psnrs.windows(2).all(is_no_worse), "dark: {is_dark}, {tune:?}: {psnrs:?}");
            assert!(psnrs[0] > 40.0, "dark: {is_dark}, {tune:?}: {psnrs:?}");
        }
    }
}

#[test]
fn the_surroundings_of_a_gradient_are_fitted_at_every_effort() {
    // Errors count several times as much in the gradient as beside it.
    let (width, height) = (256_usize, 160_usize);
    let pixel = |i: usize| {
        let (x, y) = (i % width, i / width);
        let is_inside = (40..200).contains(&x) && (24..136).contains(&y);
        let rise = (x / 8) as u8;
        if is_inside { [40 + rise, 60 + rise / 2, 96] } else { [200; 3] }
    };
    let samples: Vec<u8> = (0..width * height).flat_map(pixel).collect();
    let source = Source::new_u8(width as u32, height as u32, ColorModel::Rgb, &samples);
    let source = source.expect("sizes agree");
    for (effort, least) in [(1, 40.0), (2, 46.0)] {
        for rate in [0.5, 2.0] {
            let encoder = quick(Target::BitsPerPixel(rate)).with_effort(effort);
            let psnr = encoder.encode(&source).expect("it encodes").report.psnr;
            println!("effort {effort}, {rate} bpp: {psnr} dB");
            assert!(psnr > least, "effort {effort}, {rate} bpp: {psnr} dB");
        }
    }
}

#[test]
fn isolated_pixels_are_found_at_every_effort() {
    // Errors are in a few tiles, which get some Gaussians at a time.
    let (width, height) = (160, 112);
    let salt = noise(2 * width * height);
    let pixel = |pair: &[u8]| if pair[0] < 8 { 255 - pair[1] / 8 } else { 110 };
    let samples: Vec<u8> = salt.chunks(2).map(pixel).collect();
    let source =
        Source::new_u8(width as u32, height as u32, ColorModel::Gray, &samples).expect("agree");
    for effort in 1..=4 {
        let encoder = quick(Target::BitsPerPixel(3.0)).with_effort(effort).with_tune(Tune::Psnr);
        let psnr = encoder.encode(&source).expect("it encodes").report.psnr;
        println!("effort {effort}: {psnr} dB");
        assert!(psnr > 45.0, "effort {effort}: {psnr} dB");
    }
}

#[test]
fn rounding_does_not_undo_smooth_pictures() {
    let side = 96;
    let samples: Vec<u8> = (0..side * side)
        .flat_map(|i| [i % side * 2, i / side * 2, (i % side + i / side), 90 + i % side])
        .map(|value| value as u8)
        .collect();
    let side = side as u32;
    let source = Source::new_u8(side, side, ColorModel::Rgba, &samples).expect("sizes agree");
    let report = |target| {
        let encoder = quick(target).with_precision(Precision::Packed).with_effort(3);
        encoder.encode(&source).expect("it encodes").report
    };
    for psnr in [30.0, 40.0] {
        let report = report(Target::Psnr(psnr));
        assert!(report.psnr >= psnr && report.gaussians < 150, "{psnr}: {report:?}");
    }
    let psnrs = [0.5, 1.0, 2.0, 4.0].map(|rate| report(Target::BitsPerPixel(rate)).psnr);
    assert!(psnrs.iter().all(|&psnr| psnr > 42.0), "{psnrs:?}");
    let largest = psnrs.iter().copied().fold(0.0, f64::max);
    assert!(psnrs[3] > largest - 2.0, "{psnrs:?}");
}

/// Whenever it is stopped, at the start, during training or at the very end, it is not called again.
fn assert_cancellable(encoder: &Encoder, source: &Source<'_>, fractions: &[f64]) {
    for &stop in fractions {
        let mut stops = 0;
        let result = encoder.encode_with(source, &mut |progress| {
            if progress.fraction < stop {
                return ControlFlow::Continue(());
            }
            stops += 1;
            ControlFlow::Break(())
        });
        assert!(matches!(result, Err(EncodeError::Cancelled)), "{stop}");
        assert_eq!(stops, 1, "{stop}");
    }
}

#[test]
fn progress_is_told_and_may_cancel() {
    let samples = scene(64, 64, 3);
    let source = Source::new_u8(64, 64, ColorModel::Rgb, &samples).expect("sizes agree");
    let (mut seen, mut fractions) = (Vec::new(), Vec::new());
    let encoder = quick(Target::Gaussians(100));
    let encoded = encoder.encode_with(&source, &mut |progress| {
        assert!(progress.iteration < progress.iterations);
        seen.push((progress.iteration, progress.gaussians));
        fractions.push(progress.fraction);
        ControlFlow::Continue(())
    });
    let iterations = encoded.expect("it encodes").report.iterations;
    assert!(seen.is_sorted_by_key(|(iteration, _)| *iteration));
    let mut told: Vec<u32> = seen.iter().map(|(iteration, _)| *iteration).collect();
    told.dedup();
    assert_eq!(told, (0..iterations).collect::<Vec<_>>());
    assert!(seen.last().expect("not empty").1 > seen[0].1);
    assert!(fractions.is_sorted() && fractions[0] < 0.1, "{fractions:?}");
    assert!((0.8..=1.0).contains(fractions.last().expect("not empty")), "{fractions:?}");
    assert_cancellable(&encoder, &source, &[0.0, 0.1, *fractions.last().expect("not empty")]);
}

#[test]
fn every_stage_polls_often_and_can_be_cancelled() {
    // Large enough for every stage to take several polls.
    let (width, height) = (1024, 256);
    let samples = scene(width, height, 3);
    let source = Source::new_u8(width, height, ColorModel::Rgb, &samples).expect("sizes agree");
    for (target, tune, precision) in [
        (Target::Gaussians(500), Tune::Visual, Precision::Entropy),
        (Target::BitsPerPixel(0.05), Tune::Psnr, Precision::Entropy),
        (Target::Gaussians(500), Tune::Visual, Precision::Packed),
    ] {
        let encoder = Encoder::new()
            .with_effort(1)
            .with_target(target)
            .with_tune(tune)
            .with_precision(precision)
            .with_training(Training::fast(2))
            .with_threads(Threads::One);
        // Polls before training, in each iteration, and in the last one with all that follows.
        let mut polls: Vec<u32> = Vec::new();
        let mut last = 0.0;
        let encoded = encoder.encode_with(&source, &mut |progress| {
            let is_training = progress.gaussians > 0;
            polls.resize(progress.iteration as usize + usize::from(is_training) + 1, 0);
            *polls.last_mut().expect("not empty") += 1;
            last = progress.fraction;
            ControlFlow::Continue(())
        });
        let case = format!("{target:?} {precision:?}: {polls:?}");
        let iterations = encoded.expect("it encodes").report.iterations as usize;
        assert_eq!(polls.len(), iterations + 1, "{case}");
        let megapixels = f64::from(width * height) / 1e6;
        for (stage, &polls) in polls.iter().enumerate() {
            // Polls for each megapixel: of preparation, of the passes over the picture that code and
            // verify, and of a pass of training.
            let least = match stage {
                0 => 16.0,
                _ if stage == iterations => 32.0,
                _ => 4.0,
            };
            assert!(f64::from(polls) >= least * megapixels, "stage {stage} of {case}");
        }
        assert_cancellable(&encoder, &source, &[0.25, 0.5, 0.75, 1.0].map(|part| part * last));
    }
}

#[test]
fn metadata_is_carried() {
    let samples = scene(16, 16, 3);
    let source = Source::new_u8(16, 16, ColorModel::Rgb, &samples).expect("sizes agree");
    let mut metadata = Metadata::default();
    metadata.icc_profile = Some(vec![1, 2, 3]);
    metadata.exif = Some(b"II*\0".to_vec());
    metadata.xmp = Some(b"<x/>".to_vec());
    metadata.texts.push(Text::new("Title", "Gr\u{fc}n"));
    metadata.texts.push(Text::new("Title", ""));
    let encoder = quick(Target::Gaussians(10)).with_metadata(metadata.clone());
    let encoded = encoder.encode(&source).expect("it encodes");
    assert_eq!(decode(&encoded.bytes).metadata(), &metadata);
}

#[test]
fn what_the_decoder_would_refuse_is_not_encoded() {
    let pixels: Vec<u8> = (0..40 * 30).map(|at| (at * 7 % 251) as u8).collect();
    let source = Source::new_u8(40, 30, ColorModel::Gray, &pixels).expect("the sizes agree");
    let encode = |set: fn(&mut Limits), target| {
        let mut limits = Limits::default();
        set(&mut limits);
        let mut metadata = Metadata::default();
        metadata.exif = Some(vec![7; 1000]);
        let encoder = Encoder::new().with_effort(1).with_target(target).with_metadata(metadata);
        let mut calls = 0;
        let encoded = encoder.with_limits(limits.clone()).encode_with(&source, &mut |_| {
            calls += 1;
            ControlFlow::Continue(())
        });
        if let Ok(encoded) = &encoded {
            let mut decoder = Decoder::new_with_limits(&encoded.bytes[..], limits)
                .expect("the limits are those of the encoder");
            let mut out = vec![0; pixels.len()];
            decoder.decode_into(&mut out).expect("the limits are those of the encoder");
        }
        match encoded {
            Ok(_) => None,
            Err(EncodeError::Limit { kind, wanted, allowed }) => {
                assert!(wanted > allowed, "{kind}");
                Some((kind, calls == 0))
            }
            Err(error) => panic!("{error}"),
        }
    };
    let (few, more) = (Target::Gaussians(50), Target::Quality(70.0));
    for target in [few, more] {
        assert_eq!(encode(|_| {}, target), None);
        // Before any work.
        let refused = |kind| Some((kind, true));
        assert_eq!(encode(|limits| limits.max_width = 39, target), refused(LimitKind::Width));
        assert_eq!(encode(|limits| limits.max_height = 29, target), refused(LimitKind::Height));
        assert_eq!(encode(|limits| limits.max_pixels = 1199, target), refused(LimitKind::Pixels));
        assert_eq!(encode(|limits| limits.max_memory = 1500, target), refused(LimitKind::Memory));
    }
    let few_gaussians = |limits: &mut Limits| limits.max_gaussians = 49;
    assert_eq!(encode(few_gaussians, few), Some((LimitKind::Gaussians, true)));

    // Only the Gaussians tell. Of a narrow picture, whole tiles count.
    let source = Source::new_u8(1, 1200, ColorModel::Gray, &pixels).expect("the sizes agree");
    let encoder = quick(Target::Gaussians(1000));
    let mut limits = Limits::default();
    limits.max_work = 2000;
    let error = encoder.clone().with_limits(limits.clone()).encode(&source).expect_err("work");
    let EncodeError::Limit { kind: LimitKind::Work, wanted, allowed } = error else {
        panic!("{error}")
    };
    assert_eq!(allowed, 64 * 1200 + 2000);
    limits.max_work = wanted;
    assert!(encoder.with_limits(limits).encode(&source).is_ok());

    // By default those of every decoder.
    let samples = vec![0; 65_537];
    let error = image_gip::encode(1, 65_537, ColorModel::Gray, &samples).expect_err("too high");
    assert!(error.to_string().contains("height: 65537 required, 65536 allowed"), "{error}");
    let source = Source::new_u8(1, 65_537, ColorModel::Gray, &samples).expect("sizes agree");
    let raised = Encoder::new().with_effort(1).with_limits(Limits::none()).encode(&source);
    assert!(raised.is_ok_and(|encoded| encoded.report.psnr > 99.0));
}

#[test]
fn few_bytes_of_a_simple_picture_show_more_than_a_small_copy() {
    // A dark window with a thin light frame, and some lines of equal length.
    let (width, height) = (400, 300);
    let is_light = |x: u32, y: u32| {
        let is_frame = (40..360).contains(&x) && (30..32).contains(&y);
        let is_line = (60..200).contains(&x) && y > 60 && y < 200 && y % 40 < 2;
        is_frame || is_line
    };
    let places = (0..height).flat_map(|y| (0..width).map(move |x| (x, y)));
    let samples: Vec<u8> = places.map(|(x, y)| if is_light(x, y) { 230 } else { 40 }).collect();
    let source = Source::new_u8(width, height, ColorModel::Gray, &samples).expect("it fits");
    let encoder = Encoder::new().with_effort(2).with_target(Target::Bytes(500));
    let encoded = encoder.encode(&source).expect("the options are valid");
    assert!(encoded.bytes.len() <= 500);
    assert!(encoded.report.quality > 60.0, "{:?}", encoded.report);
}
