//! Gaussians that come from elsewhere: rendered, and written to files.

use image_gip::{
    ColorModel, Decoder, Gaussian, Header, Kernel, LimitKind, Limits, Metadata, OptionError,
    Parameterization, Picture, PictureError, Precision, Quantizer, RenderOptions, SampleDepth,
    StreamDecoder, Text, Threads, UniformQuantizer, WriteError, Writer, metrics,
};
use proptest::prelude::*;

const WIDTH: u32 = 97;
const HEIGHT: u32 = 61;
const COLORS: [ColorModel; 4] =
    [ColorModel::Gray, ColorModel::GrayAlpha, ColorModel::Rgb, ColorModel::Rgba];
const PARAMETERIZATIONS: [Parameterization; 3] =
    [Parameterization::Cholesky, Parameterization::Covariance, Parameterization::RotationScale];

fn header(color: ColorModel) -> Header {
    let mut header = Header::new(WIDTH, HEIGHT, color);
    header.base_color[..color.channels()].fill(100 * 257);
    header
}

/// Gaussians of many sizes and directions, some of them partly beside the picture.
fn gaussians(count: usize, color: ColorModel) -> Vec<Gaussian> {
    let mut rng = fastrand::Rng::with_seed(count as u64);
    let mut gaussian = || {
        let size = (0.5 + 2.5 * rng.f32()).exp2();
        let mut amplitudes = [0.0; 4];
        amplitudes[..color.channels()].fill_with(|| rng.f32() - 0.5);
        Gaussian {
            center: [WIDTH as f32 * rng.f32(), HEIGHT as f32 * rng.f32()],
            cholesky: [size * (0.5 + rng.f32()), size * (rng.f32() - 0.5), size],
            color: amplitudes,
        }
    };
    (0..count).map(|_| gaussian()).collect()
}

/// The Gaussians of a file.
fn read(file: &[u8]) -> (Header, Vec<Gaussian>) {
    let mut decoder = StreamDecoder::new();
    assert_eq!(decoder.feed(file).expect("the file is valid"), file.len());
    decoder.finish().expect("it is whole");
    (decoder.header().expect("it has one").clone(), decoder.gaussians().to_vec())
}

fn render(header: &Header, gaussians: &[Gaussian]) -> Vec<u8> {
    let limits = Limits::default();
    let picture = Picture::from_gaussians(header, gaussians, &limits).expect("they are valid");
    let options = RenderOptions::new();
    let mut samples = vec![0; picture.output_len(&options).expect("it is within the limits")];
    picture.render_u8(&options, &mut samples).expect("it is within the limits");
    samples
}

#[test]
fn floats_come_back_as_they_were_the_strongest_first() {
    for color in COLORS {
        let (header, gaussians) = (header(color), gaussians(700, color));
        let file = Writer::new(header.clone()).write(&gaussians).expect("it has options of a file");
        let (of_file, read) = read(&file);
        assert_eq!((of_file.gaussians, of_file.base_color), (700, header.base_color));
        let energy = |gaussian: &Gaussian| {
            let [l11, _, l22] = gaussian.cholesky;
            gaussian.color.iter().map(|amplitude| amplitude * amplitude).sum::<f32>() * l11 * l22
        };
        assert!(read.is_sorted_by(|a, b| energy(a) >= energy(b)));
        let mut sorted = gaussians;
        sorted.sort_by(|a, b| energy(b).total_cmp(&energy(a)));
        assert_eq!(read, sorted);
        // What the decoder shows is what these Gaussians show in this order.
        let mut decoder = Decoder::new(&file[..]).expect("the header is valid");
        let mut samples = vec![0; decoder.output_len().expect("it is within the limits")];
        decoder.decode_into(&mut samples).expect("the file is valid");
        assert_eq!(samples, render(&header, &sorted));
    }
}

#[test]
fn quantizers_that_are_fitted_or_given_round_by_half_a_step_at_most() {
    let color = ColorModel::Rgb;
    let gaussians = gaussians(300, color);
    for parameterization in PARAMETERIZATIONS {
        let mut header = header(color);
        header.parameterization = parameterization;
        header.kernel = Kernel::PAPER;
        let writer = Writer::new(header.clone()).with_precision(Precision::Packed);
        let fine = writer.clone().with_bit_depths(16, 16, 12);
        let quality = |file: &[u8]| {
            let (of_file, read) = read(file);
            assert_eq!(
                (of_file.parameterization, of_file.kernel),
                (parameterization, Kernel::PAPER)
            );
            metrics::psnr(&render(&header, &read), &render(&header, &gaussians), 255.0)
        };
        let coarse = writer.write(&gaussians).expect("it has options of a file");
        let fine = fine.write(&gaussians).expect("it has options of a file");
        assert!(coarse.len() < fine.len());
        let (coarse, fine) = (quality(&coarse), quality(&fine));
        assert!(coarse > 25.0 && fine > 50.0, "{parameterization:?}: {coarse}, {fine}");
    }

    let linear =
        |bits, scale, offset| Quantizer::Linear(UniformQuantizer::new(bits, scale, offset));
    let quantizers = vec![
        linear(10, 0.125, 0.0),
        linear(10, 0.125, 0.0),
        Quantizer::Log(UniformQuantizer::new(8, 0.02, -1.0)),
        Quantizer::Float,
        Quantizer::Log(UniformQuantizer::new(8, 0.02, -1.0)),
        linear(8, 0.005, -0.6),
        linear(8, 0.005, -0.6),
        linear(8, 0.005, -0.6),
    ];
    let writer = Writer::new(header(color)).with_precision(Precision::Packed);
    let file = writer.with_quantizers(quantizers).write(&gaussians).expect("they are valid");
    let (_, read) = read(&file);
    for gaussian in &gaussians {
        let is_near = |other: &&Gaussian| {
            let near = |a: f32, b: f32, most: f32| (a - b).abs() <= most * 1.001;
            let centers = gaussian.center.iter().zip(other.center);
            let colors = gaussian.color[..3].iter().zip(other.color);
            centers.into_iter().all(|(&a, b)| near(a, b, 0.0625))
                && colors.into_iter().all(|(&a, b)| near(a, b, 0.0025))
                && near(gaussian.cholesky[0].ln(), other.cholesky[0].ln(), 0.01)
                && gaussian.cholesky[1] == other.cholesky[1]
        };
        assert!(read.iter().any(|other| is_near(&other)), "{gaussian:?}");
    }
}

#[test]
fn the_entropy_coding_is_near_with_fine_steps_and_small_with_coarse_ones() {
    for color in COLORS {
        let (header, mut gaussians) = (header(color), gaussians(400, color));
        let expected = render(&header, &gaussians);
        // It does not show.
        gaussians.push(Gaussian { center: [900.0, -5000.0], ..gaussians[0] });
        let writer = Writer::new(header.clone()).with_precision(Precision::Entropy);
        let mut last = (usize::MAX, f64::INFINITY);
        for (step, least) in [(0.003, 48.0), (0.02, 38.0), (0.15, 22.0)] {
            let writer = writer.clone().with_color_step(step);
            let file = writer.write(&gaussians).expect("it has options of a file");
            let one = writer.with_threads(Threads::One).write(&gaussians);
            assert_eq!(one.expect("it has options of a file"), file);
            let (of_file, read) = read(&file);
            assert_eq!(of_file.gaussians, 400);
            let found = (file.len(), metrics::psnr(&render(&header, &read), &expected, 255.0));
            assert!(found.0 < last.0 && found.1 < last.1 && found.1 > least, "{step}: {found:?}");
            last = found;
        }
    }
}

#[test]
fn the_first_flaw_is_told_with_its_index() {
    let color = ColorModel::Rgb;
    let good = gaussians(5, color);
    let refused = |at: usize, flawed: Gaussian, precision: Precision| {
        let mut gaussians = good.clone();
        gaussians[at] = flawed;
        let writer = Writer::new(header(color)).with_precision(precision);
        match writer.write(&gaussians) {
            Err(WriteError::Picture(PictureError::Gaussian { index, rule })) => {
                assert_eq!(index, at);
                rule
            }
            other => panic!("{flawed:?}: {other:?}"),
        }
    };
    let [first, ..] = good[..] else { panic!("there are five") };
    for precision in [Precision::Float, Precision::Packed, Precision::Entropy] {
        let rule = refused(3, Gaussian { center: [f32::NAN, 0.0], ..first }, precision);
        assert!(rule.contains("centre"), "{rule}");
        let rule = refused(2, Gaussian { cholesky: [1.0, 0.0, 0.0], ..first }, precision);
        assert!(rule.contains("l22"), "{rule}");
        let rule = refused(4, Gaussian { color: [f32::INFINITY; 4], ..first }, precision);
        assert!(rule.contains("colour"), "{rule}");
    }
    // Drawable, but without a code.
    let far = Gaussian { center: [-4000.0, 0.0], cholesky: [3000.0, 0.0, 3000.0], ..first };
    let rule = refused(0, far, Precision::Entropy);
    assert!(rule.contains("outside"), "{rule}");
    let strong = Gaussian { color: [60_000.0; 4], ..first };
    let rule = refused(1, strong, Precision::Entropy);
    assert!(rule.contains("strong"), "{rule}");
    // Not positive definite once it is rounded.
    let mut header = header(color);
    header.parameterization = Parameterization::Covariance;
    let thin = Gaussian { cholesky: [8.0, 8.0, 0.01], ..first };
    let writer = Writer::new(header).with_precision(Precision::Packed).with_bit_depths(8, 3, 6);
    let with_thin: Vec<Gaussian> = good.iter().copied().chain([thin]).collect();
    match writer.write(&with_thin) {
        Err(WriteError::Picture(PictureError::Gaussian { rule, .. })) => {
            assert!(rule.contains("positive definite"), "{rule}");
        }
        other => panic!("{other:?}"),
    }
}

#[test]
fn what_a_decoder_would_refuse_is_not_written() {
    let color = ColorModel::Rgb;
    let gaussians = gaussians(5, color);
    let mut few = Limits::default();
    few.max_gaussians = 4;
    let mut lazy = Limits::default();
    (lazy.max_work, lazy.max_memory) = (0, 1 << 20);
    let large = vec![Gaussian { cholesky: [500.0, 0.0, 500.0], ..gaussians[0] }; 80];
    for precision in [Precision::Float, Precision::Packed, Precision::Entropy] {
        let writer = Writer::new(header(color)).with_precision(precision);
        let refused = writer.clone().with_limits(few.clone()).write(&gaussians);
        let expected = WriteError::Limit { kind: LimitKind::Gaussians, wanted: 5, allowed: 4 };
        assert_eq!(refused, Err(expected), "{precision:?}");
        writer.write(&large).expect("the default limits allow that");
        let refused = writer.with_limits(lazy.clone()).write(&large);
        assert!(
            matches!(refused, Err(WriteError::Limit { kind: LimitKind::Work, .. })),
            "{refused:?}"
        );
    }
    let mut wide = Header::new(1 << 17, 1, color);
    wide.depth = SampleDepth::Sixteen;
    let writer = Writer::new(wide);
    let refused = writer.write(&gaussians);
    assert!(
        matches!(refused, Err(WriteError::Limit { kind: LimitKind::Width, .. })),
        "{refused:?}"
    );
    writer.with_limits(Limits::none()).write(&gaussians).expect("there are no limits");
}

#[test]
fn options_out_of_range_are_refused() {
    let color = ColorModel::Gray;
    let gaussians = gaussians(4, color);
    let write = |writer: Writer| writer.write(&gaussians).expect_err("it is out of range");
    let is_header = |error| matches!(error, WriteError::Picture(PictureError::Header(_)));
    let with = |change: &dyn Fn(&mut Header)| {
        let mut header = header(color);
        change(&mut header);
        Writer::new(header)
    };
    assert!(is_header(write(with(&|header| header.width = 0))));
    assert!(is_header(write(with(&|header| header.height = 1 << 21))));
    assert!(is_header(write(with(&|header| header.base_color[0] = 5))));
    let cutoff = |cutoff| Kernel::Exponential { cutoff };
    for bad in [0.0, -1.0, 65.0, f32::NAN] {
        assert!(is_header(write(with(&|header| header.kernel = cutoff(bad)))));
    }
    let entropy = |writer: Writer| writer.with_precision(Precision::Entropy);
    assert!(is_header(write(entropy(with(&|header| header.kernel = cutoff(9.0))))));
    for bad in [0.0, -1.0, f32::NAN, 1e9] {
        let writer = entropy(Writer::new(header(color))).with_color_step(bad);
        assert!(matches!(write(writer), WriteError::ColorStep(_)));
    }
    let writer = entropy(Writer::new(header(color))).with_first_layer(Some(10));
    assert!(matches!(write(writer), WriteError::Option(OptionError::FirstLayer { .. })));
    let packed = Writer::new(header(color)).with_precision(Precision::Packed);
    let is_quantizers = |error| matches!(error, WriteError::Quantizers(_));
    assert!(is_quantizers(write(packed.clone().with_bit_depths(0, 10, 6))));
    assert!(is_quantizers(write(packed.clone().with_quantizers(vec![Quantizer::Float; 5]))));
    for (bits, scale, offset) in [(17, 1.0, 0.0), (8, 0.0, 0.0), (8, 1.0, f32::NAN)] {
        let quantizer = Quantizer::Linear(UniformQuantizer::new(bits, scale, offset));
        assert!(is_quantizers(write(packed.clone().with_quantizers(vec![quantizer; 6]))));
    }
    let mut metadata = Metadata::default();
    metadata.texts.push(Text::new("", "no keyword"));
    let writer = Writer::new(header(color)).with_metadata(metadata);
    assert!(matches!(write(writer), WriteError::Option(OptionError::Metadata(_))));

    let mut limits = Limits::default();
    limits.max_gaussians = 3;
    let found = Picture::from_gaussians(&header(color), &gaussians, &limits).map(|_| ());
    assert_eq!(found, Err(PictureError::Count { found: 4, allowed: 3 }));
}

#[test]
fn a_picture_without_gaussians_is_its_base_colour() {
    let mut header = header(ColorModel::Rgb);
    header.depth = SampleDepth::Sixteen;
    header.base_color = [1, 40_000, 65_535, 0];
    for precision in [Precision::Float, Precision::Packed, Precision::Entropy] {
        let mut metadata = Metadata::default();
        metadata.texts.push(Text::new("Title", "nothing"));
        let writer = Writer::new(header.clone()).with_precision(precision).with_metadata(metadata);
        let file = writer.write(&[]).expect("it has options of a file");
        let (of_file, read) = read(&file);
        assert_eq!((of_file.base_color, read.len()), (header.base_color, 0));
        assert_eq!(render(&header, &read)[..3], [0, 156, 255]);
    }
}

#[test]
fn the_header_of_a_file_writes_files_of_every_precision() {
    let gaussians = gaussians(80, ColorModel::Rgb);
    let writer = Writer::new(header(ColorModel::Rgb)).with_precision(Precision::Entropy);
    let file = writer.write(&gaussians).expect("it has options of a file");
    let (of_file, coded) = read(&file);
    for precision in [Precision::Float, Precision::Packed, Precision::Entropy] {
        let writer = Writer::new(of_file.clone()).with_precision(precision);
        let (_, written) = read(&writer.write(&coded).expect("they are those of a file"));
        assert_eq!(written.len(), coded.len(), "{precision:?}");
    }
}

proptest! {
    #![proptest_config(ProptestConfig::with_cases(200))]

    /// Whatever floats there are, they are refused, or the file is one that the decoder reads.
    #[test]
    fn every_file_is_valid(
        values in proptest::collection::vec(proptest::array::uniform6(any::<f32>()), 0..5),
        packed in any::<bool>(),
        step in 1e-6_f32..1e3,
        shape in 0..3_usize,
    ) {
        let gaussian = |&[x, y, l11, l21, l22, gray]: &[f32; 6]| Gaussian {
            center: [x, y],
            cholesky: [l11.abs(), l21, l22.abs()],
            color: [gray, 0.0, 0.0, 0.0],
        };
        let gaussians: Vec<Gaussian> = values.iter().map(gaussian).collect();
        let mut header = header(ColorModel::Gray);
        header.parameterization = PARAMETERIZATIONS[shape];
        let writer = Writer::new(header);
        for precision in [Precision::Float, if packed { Precision::Packed } else { Precision::Entropy }] {
            let writer = writer.clone().with_precision(precision).with_color_step(step);
            if let Ok(file) = writer.write(&gaussians) {
                let (_, read) = read(&file);
                prop_assert!(read.iter().all(Gaussian::is_drawable));
                prop_assert!(read.len() <= gaussians.len());
            }
        }
    }
}

#[test]
fn many_equal_gaussians_have_as_many_bytes_as_a_decoder_asks_for() {
    for (count, size, color) in [(5_000, [16, 16], 0.001), (16_384, [128, 128], 0.002)] {
        let header = Header::new(size[0], size[1], ColorModel::Rgb);
        let center = [size[0] as f32 / 2.0, size[1] as f32 / 2.0];
        let color = [color, color, color, 0.0];
        let gaussians = vec![Gaussian { center, cholesky: [4.0, 0.0, 4.0], color }; count];
        for step in [0.02, 0.5, 10.0] {
            let writer = Writer::new(header.clone()).with_precision(Precision::Entropy);
            let file = writer.with_color_step(step).write(&gaussians).expect("they have codes");
            let (_, found) = read(&file);
            assert_eq!(found.len(), count, "{size:?}, {step}");
            assert!(found.iter().all(|gaussian| *gaussian == found[0]));
        }
    }
}
