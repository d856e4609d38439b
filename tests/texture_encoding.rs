//! The texture that the encoder finds, through its public interface.

use image_gip::{
    ChunkType, ColorModel, EncodeError, Encoded, Encoder, OptionError, Picture, Precision,
    RenderOptions, Source, StreamDecoder, Target, Threads, Tune, metrics,
};

const SIDES: [u32; 2] = [256, 192];

/// A gray picture: a gradient without grains above, and one with many below.
fn beach() -> Vec<u8> {
    let mut rng = fastrand::Rng::with_seed(7);
    let [width, height] = SIDES;
    let pixels = (0..height).flat_map(|y| (0..width).map(move |x| (x, y)));
    pixels
        .map(|(x, y)| {
            let sky = 60.0 + 0.3 * x as f32 + 0.2 * y as f32;
            let grains = (0..4).map(|_| rng.f32() - 0.5).sum::<f32>();
            let shown = if y < height / 2 { sky } else { sky + 40.0 * grains };
            shown.round() as u8
        })
        .collect()
}

fn encoded(samples: &[u8], encoder: Encoder) -> Encoded {
    let [width, height] = SIDES;
    let source = Source::new_u8(width, height, ColorModel::Gray, samples).expect("the sizes agree");
    encoder.with_effort(2).encode(&source).expect("the options are valid")
}

/// What is shown with options.
fn shown(file: &[u8], options: &RenderOptions) -> Vec<u8> {
    decoded(file, |picture| {
        let mut samples = vec![0; picture.output_len(options).expect("a small picture")];
        picture.render_u8(options, &mut samples).expect("a small picture");
        samples
    })
}

fn decoded<T>(file: &[u8], of: impl FnOnce(&Picture<'_>) -> T) -> T {
    let mut stream = StreamDecoder::new();
    stream.feed(file).expect("a sound file");
    assert!(stream.is_complete());
    of(&stream.picture().expect("the header was read"))
}

/// The number of Gaussians of the texture, and the bytes of its chunk.
fn texture(file: &[u8]) -> (u32, u64) {
    let mut stream = StreamDecoder::new();
    stream.feed(file).expect("a sound file");
    let chunk = stream.chunks().iter().find(|chunk| chunk.kind == ChunkType::TXTR);
    let map = stream.picture().and_then(|picture| picture.texture_map());
    let gaussians = map.map_or(0, |map| map.gaussians().len() as u32);
    (gaussians, chunk.map_or(0, |chunk| chunk.bytes))
}

/// The deviation of the differences of neighbours in some rows.
fn grain(samples: &[u8], rows: std::ops::Range<u32>) -> f64 {
    let width = SIDES[0] as usize;
    let differences = rows.flat_map(|y| {
        let row = &samples[y as usize * width..][..width];
        row.windows(2).map(|pair| (f64::from(pair[0]) - f64::from(pair[1])).powi(2))
    });
    let (sum, count) = differences.fold((0.0, 0), |(sum, count), d| (sum + d, count + 1));
    (sum / f64::from(count)).sqrt()
}

#[test]
fn grains_come_back_where_they_were_and_nowhere_else() {
    let source = beach();
    let file = encoded(&source, Encoder::new().with_target(Target::BitsPerPixel(0.2)));
    let report = &file.report;
    assert_eq!(texture(&file.bytes), (report.texture_gaussians, report.texture_bytes));
    assert!(report.texture_gaussians > 0 && report.texture_bytes < file.bytes.len() as u64 / 10);
    let plain = shown(&file.bytes, &RenderOptions::new().with_texture(false));
    let textured = shown(&file.bytes, &RenderOptions::new());
    let sand = 112..SIDES[1];
    let [wanted, without, with] =
        [&source, &plain, &textured].map(|samples| grain(samples, sand.clone()));
    let is_like = without < 0.5 * wanted && with > 0.7 * wanted && with < 1.3 * wanted;
    assert!(is_like, "{wanted}: {without}, {with}");
    let sky = 0..80 * SIDES[0] as usize;
    let differences = plain[sky.clone()].iter().zip(&textured[sky]).map(|(a, b)| a.abs_diff(*b));
    assert!(differences.clone().filter(|&difference| difference > 1).count() < 50);
    assert!(differences.max() < Some(10));
}

#[test]
fn psnr_and_quality_are_those_of_the_picture_without_texture() {
    let source = beach();
    for target in [Target::Quality(20.0), Target::Psnr(24.0), Target::Gaussians(200)] {
        let [with, without] = [50, 0].map(|strength| {
            encoded(&source, Encoder::new().with_target(target).with_texture(strength))
        });
        assert_eq!(texture(&without.bytes), (0, 0));
        assert!(with.report.texture_bytes > 0, "{target:?}");
        // All else is the same.
        assert_eq!(with.report.psnr, without.report.psnr, "{target:?}");
        assert_eq!(with.report.quality, without.report.quality, "{target:?}");
        let texture_bytes = with.report.texture_bytes as usize;
        assert_eq!(with.bytes.len(), without.bytes.len() + texture_bytes, "{target:?}");
        let plain = RenderOptions::new().with_texture(false);
        let shown = [&with, &without].map(|encoded| shown(&encoded.bytes, &plain));
        assert_eq!(shown[0], shown[1], "{target:?}");
        let psnr = metrics::psnr(&source, &shown[0], 255.0);
        assert!((psnr - with.report.psnr).abs() < 1e-9, "{target:?}");
    }
}

#[test]
fn a_size_counts_the_texture() {
    let source = beach();
    for bytes in [300, 1000, 3000] {
        let file = encoded(&source, Encoder::new().with_target(Target::Bytes(bytes)));
        let size = file.bytes.len() as u64;
        // Few Gaussians have coarse steps.
        let least = if bytes < 2000 { 70 } else { 99 };
        assert!(size <= bytes && 100 * size >= least * bytes, "{size} of {bytes}");
        assert!(file.report.texture_bytes <= bytes / 10);
    }
}

#[test]
fn a_small_file_has_no_texture() {
    let of = |bytes| encoded(&beach(), Encoder::new().with_target(Target::Bytes(bytes)));
    for bytes in [150, 1000] {
        let report = of(bytes).report;
        assert_eq!((report.texture_gaussians, report.texture_bytes), (0, 0), "{bytes}");
    }
    assert!(of(1200).report.texture_gaussians > 0);
}

#[test]
fn the_strength_is_that_of_the_grains() {
    let source = beach();
    let grains = [0, 25, 50, 100].map(|strength| {
        let target = Target::Gaussians(150);
        let encoder = Encoder::new().with_target(target).with_texture(strength);
        grain(&shown(&encoded(&source, encoder).bytes, &RenderOptions::new()), 112..SIDES[1])
    });
    assert!(grains.is_sorted() && grains[3] > 1.5 * grains[2], "{grains:?}");
    assert!(grains[2] > 1.5 * grains[1], "{grains:?}");
}

#[test]
fn there_is_none_where_there_is_nothing_to_add() {
    let target = Target::BitsPerPixel(0.5);
    let [width, height] = SIDES;
    let pixels = || (0..height).flat_map(|y| (0..width).map(move |x| (x, y)));
    let gradient: Vec<u8> = pixels().map(|(x, y)| ((x + 2 * y) / 3) as u8).collect();
    // A drawing: edges alone.
    let drawing: Vec<u8> =
        pixels().map(|(x, y)| if (x / 37 + y / 23) % 2 == 0 { 30 } else { 220 }).collect();
    for (name, samples) in
        [("flat", vec![90; gradient.len()]), ("gradient", gradient), ("drawing", drawing)]
    {
        let file = encoded(&samples, Encoder::new().with_target(target));
        assert_eq!(file.report.texture_bytes, 0, "{name}");
    }
    for encoder in [
        Encoder::new().with_tune(Tune::Psnr),
        Encoder::new().with_precision(Precision::Packed),
        Encoder::new().with_precision(Precision::Float),
    ] {
        let file = encoded(&beach(), encoder.with_target(Target::Gaussians(100)));
        assert_eq!(file.report.texture_bytes, 0);
    }
}

#[test]
fn invisible_pixels_have_no_texture() {
    let grains = beach();
    let [width, height] = SIDES;
    let below = |at: usize| at >= grains.len() / 2;
    // The grains do not show.
    let samples: Vec<u8> = grains
        .iter()
        .enumerate()
        .flat_map(|(at, &sample)| [sample, if below(at) { 0 } else { 255 }])
        .collect();
    let source = Source::new_u8(width, height, ColorModel::GrayAlpha, &samples);
    let source = source.expect("the sizes agree");
    let encoder = Encoder::new().with_effort(1).with_target(Target::Gaussians(200));
    let found = |encoder: &Encoder| encoder.encode(&source).expect("valid").report.texture_bytes;
    assert_eq!(found(&encoder), 0);
    assert!(found(&encoder.with_keep_invisible(true)) > 0);
}

#[test]
fn threads_do_not_matter() {
    let source = beach();
    let encoder = Encoder::new().with_target(Target::BitsPerPixel(0.2));
    let one = encoded(&source, encoder.clone().with_threads(Threads::One));
    assert!(one.report.texture_bytes > 0);
    let pool = rayon::ThreadPoolBuilder::new().num_threads(3).build().expect("threads");
    assert!(pool.install(|| encoded(&source, encoder)).bytes == one.bytes);
}

#[test]
fn a_strength_beyond_100_is_refused() {
    let source = Source::new_u8(1, 1, ColorModel::Gray, &[0]).expect("the sizes agree");
    let error = Encoder::new().with_texture(101).encode(&source).expect_err("101");
    assert!(matches!(error, EncodeError::Option(OptionError::Texture(101))), "{error}");
}
