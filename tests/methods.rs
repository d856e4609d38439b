//! Methods of one's own in place of parts of the encoder.

use core::ops::ControlFlow;
use std::sync::{Arc, Mutex};

use image_gip::training::{CustomPlacement, ErrorMap, NewColor, Placement, Training};
use image_gip::{
    ColorModel, EncodeError, Encoder, Gaussian, Header, Importance, Kernel, Limits, OptionError,
    Picture, Precision, RenderOptions, SampleDepth, Samples, Source, StreamDecoder, Target, Tune,
    Writer, metrics,
};

const WIDTH: u32 = 120;
const HEIGHT: u32 = 88;

/// Blobs and noise, the same everywhere.
fn picture() -> Vec<u8> {
    let mut rng = fastrand::Rng::with_seed(3);
    let pixels = (0..HEIGHT).flat_map(|y| (0..WIDTH).map(move |x| (x as f32, y as f32)));
    let sample = |(x, y): (f32, f32)| {
        let wave = (x / 5.0).sin() * (y / 6.0).cos() + (x / 2.3 + y / 3.1).sin();
        [0, 1, 2].map(|channel| (128.0 + (40.0 - 8.0 * channel as f32) * wave) as u8)
    };
    let samples = pixels.flat_map(sample);
    samples.map(|sample| sample.saturating_add(rng.u8(..24))).collect()
}

fn source(samples: &[u8]) -> Source<'_> {
    Source::new_u8(WIDTH, HEIGHT, ColorModel::Rgb, samples).expect("the sizes agree")
}

fn decoded(file: &[u8]) -> Vec<u8> {
    match image_gip::decode(file).expect("the file is valid").samples {
        Samples::Eight(samples) => samples,
        other => panic!("the source has 8 bits: {other:?}"),
    }
}

/// The least errors of the left half, and all sizes of maps that were seen.
#[derive(Debug, Default)]
struct Left(Mutex<Vec<[usize; 3]>>);

impl CustomPlacement for Left {
    fn pixels(&self, count: usize, errors: &ErrorMap) -> Vec<u32> {
        let ErrorMap { width, height, errors, .. } = errors;
        assert!(errors.iter().all(|&error| error >= 0.0));
        self.0.lock().expect("nobody panics").push([*width, *height, errors.len()]);
        let mut pixels: Vec<u32> = (0..errors.len() as u32).collect();
        pixels.retain(|&pixel| (pixel as usize % width) < width / 2);
        pixels.sort_by(|&a, &b| errors[b as usize].total_cmp(&errors[a as usize]));
        // More than are asked for, and some that are not there.
        [vec![u32::MAX], pixels].concat().into_iter().take(count + 9).collect()
    }
}

#[test]
fn new_gaussians_are_where_a_placement_of_ones_own_puts_them() {
    let samples = picture();
    let left = Arc::new(Left::default());
    let centers = |placement: Placement| {
        let mut training = Training::fast(40);
        training.densification.placement = placement;
        training.coarse_to_fine = Some(30);
        let encoder = Encoder::new().with_precision(Precision::Float).with_training(training);
        let encoder = encoder.with_target(Target::Gaussians(120));
        let file = encoder.encode(&source(&samples)).expect("it encodes").bytes;
        let mut decoder = StreamDecoder::new();
        decoder.feed(&file).expect("the file is valid");
        decoder.gaussians().iter().map(|gaussian| gaussian.center[0]).collect::<Vec<_>>()
    };
    let share_on_the_left = |centers: Vec<f32>| {
        let left = centers.iter().filter(|&&x| x < WIDTH as f32 / 2.0 + 6.0).count();
        left as f64 / centers.len() as f64
    };
    let usual = share_on_the_left(centers(Placement::Spread));
    assert!((0.4..0.7).contains(&usual), "{usual}");
    let found = centers(Placement::Custom(left.clone()));
    assert!((100..=120).contains(&found.len()), "{}", found.len());
    let own = share_on_the_left(found);
    assert!(own > 0.9, "{own}");
    let seen = left.0.lock().expect("nobody panics");
    assert!(seen.iter().all(|&[width, height, count]| width * height == count));
    assert!(seen.contains(&[WIDTH as usize, HEIGHT as usize, (WIDTH * HEIGHT) as usize]));
}

#[test]
fn a_placement_of_ones_own_may_have_nothing_to_say() {
    #[derive(Debug)]
    struct Nowhere;
    impl CustomPlacement for Nowhere {
        fn pixels(&self, _: usize, _: &ErrorMap) -> Vec<u32> {
            Vec::new()
        }
    }
    let mut training = Training::fast(12);
    training.densification.placement = Placement::Custom(Arc::new(Nowhere));
    training.densification.color = NewColor::Zero;
    for precision in [Precision::Entropy, Precision::Packed, Precision::Float] {
        let encoder = Encoder::new().with_precision(precision).with_training(training.clone());
        let encoded = encoder.encode(&source(&picture())).expect("it encodes");
        assert_eq!(encoded.report.gaussians, 0);
    }
}

/// A factor on the right half.
#[derive(Debug)]
struct Right(f32);

impl Importance for Right {
    fn at(&self, [x, y]: [f32; 2]) -> f32 {
        assert!((0.0..WIDTH as f32 + 8.0).contains(&x) && (0.0..HEIGHT as f32 + 8.0).contains(&y));
        if x > WIDTH as f32 / 2.0 { self.0 } else { 1.0 }
    }
}

#[test]
fn what_is_important_gets_more_of_the_bytes() {
    let samples = picture();
    let encoder = Encoder::new().with_target(Target::Bytes(1800)).with_effort(2);
    let errors_of_halves = |importance: Option<f32>| {
        let importance = importance.map(|factor| Arc::new(Right(factor)) as Arc<dyn Importance>);
        let encoder = encoder.clone().with_importance(importance);
        let file = encoder.encode(&source(&samples)).expect("it encodes").bytes;
        assert!((1782..=1800).contains(&file.len()), "{}", file.len());
        let mut sums = [0.0; 2];
        for (at, (a, b)) in decoded(&file).iter().zip(&samples).enumerate() {
            let half = at / 3 % WIDTH as usize / (WIDTH as usize / 2);
            sums[half] += f64::from(a.abs_diff(*b)).powi(2);
        }
        sums
    };
    let [left, right] = errors_of_halves(None);
    let [more_left, less_right] = errors_of_halves(Some(6.0));
    assert!(less_right < 0.9 * right, "{less_right}, {right}");
    assert!(more_left > left, "{more_left}, {left}");
    // Only ratios matter, and what is no number is nothing.
    for same in [f32::NAN, 1.0] {
        assert_eq!(errors_of_halves(Some(same)), [left, right]);
    }
    for unbounded in [f32::INFINITY, 0.0, -1.0] {
        assert!(errors_of_halves(Some(unbounded)).iter().all(|&error| error > 0.0));
    }
    let encoder = encoder.with_tune(Tune::Psnr).with_importance(Some(Arc::new(Right(2.0))));
    let error = encoder.encode(&source(&samples)).expect_err("all errors count the same");
    assert!(matches!(error, EncodeError::Option(OptionError::Importance)), "{error}");
}

/// Gaussians of someone else's, and the picture that they are.
fn fitted() -> (Header, Vec<Gaussian>, Vec<u8>) {
    let mut header = Header::new(WIDTH, HEIGHT, ColorModel::Rgb);
    header.base_color[..3].fill(110 * 257);
    let mut rng = fastrand::Rng::with_seed(8);
    let mut gaussian = || {
        let (size, ratio) = ((1.0 + 2.5 * rng.f32()).exp2(), (rng.f32() - 0.5).exp2());
        let mut color = [0.0; 4];
        color[..3].fill_with(|| 0.3 * rng.f32() - 0.15);
        Gaussian {
            center: [WIDTH as f32 * rng.f32(), HEIGHT as f32 * rng.f32()],
            cholesky: [size * ratio, size * (rng.f32() - 0.5), size / ratio],
            color,
        }
    };
    let gaussians: Vec<Gaussian> = (0..260).map(|_| gaussian()).collect();
    let limits = Limits::default();
    let picture = Picture::from_gaussians(&header, &gaussians, &limits).expect("they are valid");
    let options = RenderOptions::new();
    let mut samples = vec![0; picture.output_len(&options).expect("it is within the limits")];
    picture.render_u8(&options, &mut samples).expect("it is within the limits");
    (header, gaussians, samples)
}

#[test]
fn gaussians_of_ones_own_get_the_codes_of_the_encoder() {
    let (header, gaussians, samples) = fitted();
    let limits = Limits::default();
    let picture = Picture::from_gaussians(&header, &gaussians, &limits).expect("they are valid");
    let source = source(&samples);
    let encoder = Encoder::new().with_tune(Tune::Psnr);
    // Better than rounding, at the same size.
    let writer =
        Writer::new(header.clone()).with_precision(Precision::Entropy).with_color_step(0.5);
    let rounded = writer.write(&gaussians).expect("they have codes");
    let psnr_of = |file: &[u8]| metrics::psnr(&decoded(file), &samples, 255.0);
    let size = Target::Bytes(rounded.len() as u64);
    let encoded = encoder.clone().with_target(size).encode_fitted(&source, &picture);
    let encoded = encoded.expect("it encodes");
    assert!(encoded.bytes.len() <= rounded.len());
    let (own, of_rounded) = (psnr_of(&encoded.bytes), psnr_of(&rounded));
    assert!(own > of_rounded + 1.0, "{own} dB, {of_rounded} dB by rounding");
    assert!((encoded.report.psnr - own).abs() < 1e-6);
    // Nothing is trained, but there are Gaussians from the beginning.
    let mut last = None;
    let told =
        encoder.clone().with_target(size).encode_fitted_with(&source, &picture, &mut |progress| {
            assert_eq!(progress.iteration, 0);
            last = Some(*progress);
            ControlFlow::Continue(())
        });
    assert_eq!(told.expect("it encodes").bytes, encoded.bytes);
    let last = last.expect("there are reports");
    assert!(last.gaussians >= encoded.report.gaussians && last.iterations == 0, "{last:?}");
    assert!(last.fraction > 0.9 && last.psnr > 20.0, "{last:?}");
    // Every kind of target.
    let encode = |target| {
        let encoded = encoder.clone().with_target(target).encode_fitted(&source, &picture);
        encoded.expect("it encodes").report
    };
    let by_psnr = encode(Target::Psnr(42.0));
    assert!((42.0..42.5).contains(&by_psnr.psnr), "{}", by_psnr.psnr);
    let by_quality = encode(Target::Quality(80.0));
    assert!((by_quality.quality - 80.0).abs() < 3.0, "{}", by_quality.quality);
    let by_count = encode(Target::Gaussians(300));
    assert!((200..=260).contains(&by_count.gaussians), "{}", by_count.gaussians);
    assert!(encode(Target::Lambda(1.0)).psnr > encode(Target::Lambda(200.0)).psnr + 3.0);
    let out_of_reach = encode(Target::Psnr(90.0));
    assert!(out_of_reach.shortfall.is_some() && out_of_reach.psnr > 45.0, "{out_of_reach:?}");
}

#[test]
fn a_target_gets_the_gaussians_that_it_needs() {
    let (header, gaussians, samples) = fitted();
    let (source, limits) = (source(&samples), Limits::default());
    let encode = |gaussians: &[Gaussian], target| {
        let picture = Picture::from_gaussians(&header, gaussians, &limits).expect("valid");
        let encoded = Encoder::new().with_target(target).encode_fitted(&source, &picture);
        encoded.expect("it encodes")
    };
    // Much of a fit that is too good for the target is left out.
    let by_psnr = [24.0, 28.0, 32.0, 36.0, 40.0].map(|psnr| {
        let encoded = encode(&gaussians, Target::Psnr(psnr));
        assert!((psnr..psnr + 0.5).contains(&encoded.report.psnr), "{psnr}: {:?}", encoded.report);
        encoded.bytes.len()
    });
    let by_quality = [10.0, 40.0, 70.0, 90.0]
        .map(|quality| encode(&gaussians, Target::Quality(quality)).bytes.len());
    for sizes in [&by_psnr[..], &by_quality] {
        let grows = |pair: &[usize]| 20 * pair[1] > 21 * pair[0];
        assert!(sizes.windows(2).all(grows), "{sizes:?}");
    }
    let of_psnr = encode(&gaussians, Target::Psnr(24.0)).report.psnr;
    for bytes in by_psnr {
        let of_size = encode(&gaussians, Target::Bytes(bytes as u64)).report.psnr;
        assert!(of_size > of_psnr - 1.0, "{bytes} bytes: {of_size} dB, {of_psnr} dB");
    }
    // What is out of reach comes as near as a smaller file does.
    let mut noise = fastrand::Rng::with_seed(1);
    let noisy: Vec<Gaussian> = gaussians
        .iter()
        .map(|gaussian| {
            let color = gaussian.color.map(|value| value + 0.4 * (noise.f32() - 0.5));
            Gaussian { color, ..*gaussian }
        })
        .collect();
    let of_size = encode(&noisy, Target::Bytes(800)).report;
    let of_psnr = encode(&noisy, Target::Psnr(60.0)).report;
    assert!(
        of_psnr.shortfall.is_some() && of_psnr.psnr > of_size.psnr - 0.5,
        "{of_psnr:?}, {of_size:?}"
    );
}

#[test]
fn gaussians_beyond_the_bounds_are_brought_within() {
    let (header, mut gaussians, samples) = fitted();
    gaussians[0].color = [50.0, -50.0, 1.0, 0.0];
    gaussians[1].center = [1e5, -1e5];
    gaussians[2].cholesky = [1e5, 1e4, 1e-3];
    let limits = Limits::default();
    let picture = Picture::from_gaussians(&header, &gaussians, &limits).expect("they are valid");
    let encoder = Encoder::new().with_target(Target::Bytes(1500));
    let encoded = encoder.encode_fitted(&source(&samples), &picture).expect("it encodes");
    assert_eq!(decoded(&encoded.bytes).len(), samples.len());
    let none = Picture::from_gaussians(&header, &[], &limits).expect("it is valid");
    let encoded = encoder.encode_fitted(&source(&samples), &none).expect("it encodes");
    assert_eq!(encoded.report.gaussians, 0);
}

#[test]
fn gaussians_of_ones_own_must_suit_the_source_and_the_coding() {
    let (header, gaussians, samples) = fitted();
    let limits = Limits::default();
    let refused = |encoder: &Encoder, change: &dyn Fn(&mut Header)| {
        let mut header = header.clone();
        change(&mut header);
        let picture = Picture::from_gaussians(&header, &gaussians, &limits).expect("valid");
        let error = encoder.encode_fitted(&source(&samples), &picture).expect_err("it is refused");
        assert!(matches!(error, EncodeError::Option(OptionError::Fitted(_))), "{error}");
    };
    let encoder = Encoder::new();
    refused(&encoder, &|header| header.width += 1);
    refused(&encoder, &|header| header.depth = SampleDepth::Sixteen);
    refused(&encoder, &|header| {
        header.color = ColorModel::Gray;
        header.base_color = [0; 4];
    });
    refused(&encoder, &|header| header.kernel = Kernel::PAPER);
    refused(&encoder.with_precision(Precision::Float), &|_| ());
}

#[test]
fn far_too_many_gaussians_are_no_worse_than_enough() {
    // Each of them in twenty parts.
    let (header, gaussians, samples) = fitted();
    let parts: Vec<Gaussian> = gaussians
        .iter()
        .flat_map(|gaussian| {
            let color = gaussian.color.map(|value| value / 20.0);
            [Gaussian { color, ..*gaussian }; 20]
        })
        .collect();
    let limits = Limits::default();
    let encoder = Encoder::new().with_tune(Tune::Psnr);
    let encode = |gaussians: &[Gaussian], target| {
        let picture = Picture::from_gaussians(&header, gaussians, &limits).expect("valid");
        let encoder = encoder.clone().with_target(target);
        encoder.encode_fitted(&source(&samples), &picture).expect("it encodes")
    };
    let psnr = |gaussians, bytes| encode(gaussians, Target::Bytes(bytes)).report.psnr;
    assert!(psnr(&gaussians, 1200) > psnr(&gaussians, 600) + 1.0);
    let encoded = encode(&parts, Target::Bytes(1200));
    assert!((1100..=1200).contains(&encoded.bytes.len()), "{}", encoded.bytes.len());
    assert_eq!(decoded(&encoded.bytes).len(), samples.len());
    for count in [1, 40] {
        let found = encode(&gaussians, Target::Gaussians(count)).report.gaussians;
        assert!((1..=count).contains(&found), "{found} of {count}");
    }
    // A picture that they do not resemble, and as many at one place.
    let one = vec![Gaussian { color: [0.01, 0.0, 0.0, 0.0], ..gaussians[0] }; 3000];
    for target in [Target::Psnr(50.0), Target::Quality(90.0), Target::Bytes(900)] {
        let encoded = encode(&one, target);
        assert!(encoded.report.shortfall.is_some() || matches!(target, Target::Bytes(_)));
        assert_eq!(decoded(&encoded.bytes).len(), samples.len());
    }
}
