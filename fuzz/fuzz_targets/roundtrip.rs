//! What the encoder reports is what the decoder finds.

#![no_main]

use arbitrary::Arbitrary;
use image_gip::{
    ColorModel, DecodeError, EncodeError, Encoder, Picture, Precision, RenderOptions, SampleDepth,
    Source, StreamDecoder, Target, Threads, metrics,
};
use libfuzzer_sys::fuzz_target;

#[derive(Arbitrary, Debug)]
struct Case {
    width: u8,
    height: u8,
    color: u8,
    sixteen_bit: bool,
    /// Repeated until the picture is full.
    samples: Vec<u16>,
    target: AnyTarget,
    effort: u8,
    float: bool,
    seed: u64,
}

#[derive(Arbitrary, Debug)]
enum AnyTarget {
    Auto,
    Gaussians(u8),
    Bytes(u16),
    BitsPerPixel(u8),
    Psnr(u8),
    Quality(u8),
}

impl AnyTarget {
    /// In range, and no more work than a small picture is worth.
    fn target(&self) -> Target {
        match *self {
            Self::Auto => Target::Auto,
            Self::Gaussians(count) => Target::Gaussians(u32::from(1 + count % 32)),
            Self::Bytes(bytes) => Target::Bytes(1 + u64::from(bytes % 1024)),
            Self::BitsPerPixel(rate) => Target::BitsPerPixel((f64::from(rate) + 1.0) / 16.0),
            Self::Psnr(psnr) => Target::Psnr(f64::from(10 + psnr % 30)),
            Self::Quality(quality) => Target::Quality(f64::from(quality % 101)),
        }
    }
}

fuzz_target!(|case: Case| {
    const COLORS: [ColorModel; 4] =
        [ColorModel::Gray, ColorModel::GrayAlpha, ColorModel::Rgb, ColorModel::Rgba];
    let color = COLORS[usize::from(case.color) % COLORS.len()];
    let keep_invisible = case.color & 4 != 0;
    let (width, height) = (u32::from(1 + case.width % 24), u32::from(1 + case.height % 24));
    let count = (width * height) as usize * color.channels();
    let wide: Vec<u16> = case.samples.iter().copied().chain([0]).cycle().take(count).collect();
    let narrow: Vec<u8> = wide.iter().map(|&sample| sample as u8).collect();
    let source = if case.sixteen_bit {
        Source::new_u16(width, height, color, &wide)
    } else {
        Source::new_u8(width, height, color, &narrow)
    }
    .expect("a picture of this size fits");

    let target = case.target.target();
    let encoded = match Encoder::new()
        .with_target(target)
        .with_effort(1 + case.effort % 3)
        .with_precision(match (case.float, case.effort & 4) {
            (true, _) => Precision::Float,
            (false, 0) => Precision::Entropy,
            (false, _) => Precision::Packed,
        })
        .with_seed(case.seed)
        .with_keep_invisible(keep_invisible)
        .with_threads(Threads::One)
        .encode(&source)
    {
        Ok(encoded) => encoded,
        // No file is that small.
        Err(EncodeError::Option(_))
            if matches!(target, Target::Bytes(_) | Target::BitsPerPixel(_)) =>
        {
            return;
        }
        Err(error) => panic!("all options are in range: {error}"),
    };

    let mut decoder = StreamDecoder::new();
    let used = decoder.feed(&encoded.bytes).expect("the encoder writes sound files");
    assert!(decoder.is_complete() && used == encoded.bytes.len());
    let picture = decoder.picture().expect("the file is complete");
    let header = picture.header();
    assert_eq!((header.width, header.height), (width, height));
    assert_eq!(header.color, color);
    assert_eq!(header.gaussians, encoded.report.gaussians);
    assert!(picture.gaussians().iter().all(image_gip::Gaussian::is_drawable));

    let is_premultiplied = color.has_alpha() && !keep_invisible;
    let psnr = if header.depth == SampleDepth::Sixteen {
        psnr(&wide, &rendered(&picture, Picture::render_u16), color, is_premultiplied, 65535.0)
    } else {
        psnr(&narrow, &rendered(&picture, Picture::render_u8), color, is_premultiplied, 255.0)
    };
    if is_premultiplied {
        // The encoder multiplies by alpha in 32 bits. These are root mean square errors.
        let [found, reported] = [psnr, encoded.report.psnr].map(|psnr| 10_f64.powf(-psnr / 20.0));
        assert!((found - reported).abs() < 4e-7, "{psnr} dB, reported {}", encoded.report.psnr);
    } else {
        assert_eq!(encoded.report.psnr, psnr, "the reported and the decoded PSNR");
    }
});

/// The PSNR in dB, of colours times alpha if asked for.
fn psnr<T: Copy + Into<f64>>(
    a: &[T],
    b: &[T],
    color: ColorModel,
    is_premultiplied: bool,
    full: f64,
) -> f64 {
    let shown = |samples: &[T]| match is_premultiplied {
        true => metrics::premultiplied(samples, color, full),
        false => samples.iter().map(|&sample| sample.into()).collect(),
    };
    metrics::psnr(&shown(a), &shown(b), full)
}

fn rendered<'a, T: Clone + Default>(
    picture: &Picture<'a>,
    render: impl Fn(&Picture<'a>, &RenderOptions, &mut [T]) -> Result<(), DecodeError>,
) -> Vec<T> {
    // The report is of the picture without texture.
    let options = RenderOptions::new().with_texture(false);
    let mut samples = vec![T::default(); picture.output_len(&options).expect("small")];
    render(picture, &options, &mut samples).expect("within the default limits");
    samples
}
