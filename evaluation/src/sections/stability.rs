//! Numerical stability: the decoder against f64 and against its own other paths, the encoder on
//! pictures that are hard to fit.

use anyhow::{Context, Result, ensure};
use image_gip::{
    ColorModel, Kernel, Picture, RenderOptions, SampleDepth, Source, StreamDecoder, Target, Threads,
};

use super::float_file::{COMPONENTS, FloatFile};
use super::{f64_renderer, product_tests};
use crate::bench::Bench;
use crate::comparison::list_or_none;
use crate::gip;
use crate::table::Table;

/// Size of the pictures of chosen Gaussians.
const SIZE: (u32, u32) = (96, 64);
/// Gaussians and effort for the hard pictures.
const GAUSSIANS: u32 = 500;
const EFFORT: u8 = 3;

pub(crate) fn measure(bench: &mut Bench) -> Result<String> {
    // A quick run has no time to build them.
    let tests = if bench.quick { String::new() } else { product_tests::measure()? };
    Ok(format!("{}{tests}{}", decoder(bench)?, encoder(bench)?))
}

/// Gaussians that are extreme for the arithmetic.
fn cases() -> Vec<(&'static str, Vec<[f32; COMPONENTS]>)> {
    let (width, height) = (SIZE.0 as f32, SIZE.1 as f32);
    let mut random = fastrand::Rng::with_seed(gip::SEED);
    let mut center = || [random.f32() * width, random.f32() * height];
    let mut ordinary = |colour: f32, shape: [f32; 3]| {
        let ([x, y], [l11, l21, l22]) = (center(), shape);
        [x, y, l11, l21, l22, colour, -0.5 * colour, 0.25 * colour]
    };
    let needles = (0..36).map(|step| {
        // A needle 200 pixels long and 0.02 wide, at every angle: the Cholesky factor of its
        // covariance.
        let (sin, cos) = (f64::from(step) * 5.0 + 0.5).to_radians().sin_cos();
        let (a, b) = (200.0_f64.powi(2), 0.02_f64.powi(2));
        let l11 = (a * cos * cos + b * sin * sin).sqrt();
        let l21 = (a - b) * sin * cos / l11;
        ordinary(0.5, [l11 as f32, l21 as f32, (200.0 * 0.02 / l11) as f32])
    });
    let needles = needles.collect();
    let pairs = (0..200).flat_map(|_| {
        let gaussian = ordinary(100.0, [8.0, 2.0, 6.0]);
        let mut opposite = gaussian;
        opposite[5..].iter_mut().for_each(|amplitude| *amplitude = -*amplitude);
        [gaussian, opposite]
    });
    let pairs: Vec<_> = pairs.collect();
    vec![
        ("none", vec![]),
        ("one", vec![ordinary(0.5, [5.0, 1.0, 4.0])]),
        ("ordinary, 1,000", (0..1000).map(|_| ordinary(0.2, [4.0, 1.0, 3.0])).collect()),
        ("identical, 5,000", vec![ordinary(0.001, [9.0, 3.0, 7.0]); 5000]),
        ("needles at 36 angles", needles),
        ("0.01 pixels wide", (0..500).map(|_| ordinary(1.0, [0.01, 0.0, 0.01])).collect()),
        (
            "100 times wider than the picture",
            (0..50).map(|_| ordinary(0.02, [100.0 * width, 0.0, 100.0 * width])).collect(),
        ),
        (
            "far outside",
            (1..50)
                .map(|i| [1e5 * i as f32, -1e5, 5e4 * i as f32, 1e4, 5e4, 1.0, 1.0, 1.0])
                .collect(),
        ),
        ("cancelling pairs of amplitude 100", pairs),
    ]
}

fn decoder(bench: &Bench) -> Result<String> {
    let mut store = bench.store(
        "stability-decoder.csv",
        ["gaussians", "kernel"],
        ["count", "from_f64", "scalar_from_simd", "one_from_all_threads", "not_finite"],
    )?;
    let mut table = Table::new(&[
        "Gaussians",
        "kernel",
        "largest difference from f64",
        "scalar against SIMD",
        "one thread against all",
        "samples that are not finite",
    ]);
    let mut worst: Vec<(f64, String)> = Vec::new();
    let mut violated = Vec::new();
    for (name, gaussians) in cases() {
        for (kernel_name, kernel) in [("exponential", Kernel::PAPER), ("quartic", Kernel::Quartic)]
        {
            let [_, from_f64, simd, threads, not_finite] =
                store.get(&bench.product, [name, kernel_name], || {
                    let mut decoder = StreamDecoder::new();
                    decoder.feed(&FloatFile::new(SIZE, kernel, gaussians.clone()).to_bytes())?;
                    let picture = decoder.picture().context("the file has no picture")?;
                    ensure!(decoder.is_complete(), "the file is not complete");
                    let all = planes(&picture, &RenderOptions::new())?;
                    let one = planes(&picture, &RenderOptions::new().with_threads(Threads::One))?;
                    let scalar = planes(&picture, &RenderOptions::new().with_reference(true))?;
                    Ok([
                        gaussians.len() as f64,
                        difference(&all, &f64_renderer::render(&picture)),
                        difference(&all, &scalar),
                        difference(&all, &one),
                        not_finite(&all),
                    ])
                })?;
            table.row(&[
                name.to_owned(),
                kernel_name.to_owned(),
                format!("{from_f64:.1e}"),
                format!("{simd:e}"),
                format!("{threads:e}"),
                format!("{not_finite}"),
            ]);
            let name = format!("{name} ({kernel_name})");
            if simd != 0.0 || threads != 0.0 || not_finite != 0.0 {
                violated.push(name.clone());
            }
            worst.push((from_f64, name));
        }
    }
    // The largest first, and NaN before all.
    worst.sort_by(|a, b| b.0.total_cmp(&a.0));
    let worst = worst
        .iter()
        .take(3)
        .map(|(difference, name)| format!("{name}: {:.2} steps of 8 bits", 255.0 * difference));
    Ok(format!(
        "### Decoder\n\nCompared with: the formula of the specification in f64, on files of chosen \
         Gaussians, {} x {} pixels. A full sample is 1, an 8-bit step 3.9e-3. The exponential \
         kernel drops to zero at its cut-off, where it is 1/255; a pixel near the cut-off may lie \
         inside it in f32 and outside in f64. The quartic kernel is continuous. The last three \
         columns must be zero; SIMD is the widest level of this machine.\n{}\nLargest \
         differences: {}. Not zero where it must be: {}.\n",
        SIZE.0,
        SIZE.1,
        table.finish(),
        worst.collect::<Vec<_>>().join(", "),
        list_or_none(violated.iter().map(String::as_str)),
    ))
}

/// The samples as floats, plane after plane.
fn planes(picture: &Picture<'_>, options: &RenderOptions) -> Result<Vec<f64>> {
    let mut planes = vec![0.0; picture.output_len(options)?];
    picture.render_planes(options, &mut planes)?;
    Ok(planes.into_iter().map(f64::from).collect())
}

/// The largest difference; NaN if any sample is NaN.
fn difference(a: &[f64], b: &[f64]) -> f64 {
    let largest = |most: f64, (a, b): (&f64, &f64)| {
        let difference = if a == b { 0.0 } else { (a - b).abs() };
        // NaN stays, from either side.
        if most >= difference || most.is_nan() { most } else { difference }
    };
    a.iter().zip(b).fold(0.0, largest)
}

fn not_finite(samples: &[f64]) -> f64 {
    samples.iter().filter(|sample| !sample.is_finite()).count() as f64
}

/// A picture that is hard to fit.
struct HardPicture {
    name: &'static str,
    size: (u32, u32),
    color: ColorModel,
    depth: SampleDepth,
    /// A sample in 16 bits, of column, row and channel.
    sample: fn(u32, u32, u32) -> u16,
}

fn hard_pictures() -> Vec<HardPicture> {
    use ColorModel::{Gray, Rgb, Rgba};
    use SampleDepth::{Eight, Sixteen};
    let hard = |name, size, color, depth, sample| HardPicture { name, size, color, depth, sample };
    vec![
        hard("one pixel", (1, 1), Rgb, Eight, |_, _, c| 20_000 * c as u16),
        hard("one column", (1, 200), Gray, Eight, |_, y, _| 300 * y as u16),
        hard("8192 x 16", (8192, 16), Gray, Eight, |x, _, _| 8 * x as u16),
        hard("black", (128, 128), Rgb, Eight, |_, _, _| 0),
        hard("white", (128, 128), Rgb, Eight, |_, _, _| u16::MAX),
        hard("one bright pixel", (128, 128), Gray, Eight, |x, y, _| on(x == 64 && y == 50)),
        hard("checkers of one pixel", (128, 128), Gray, Eight, |x, y, _| on((x + y) % 2 == 0)),
        hard("ramp, 8 bits", (256, 64), Gray, Eight, |x, _, _| 257 * x as u16),
        hard("ramp, 16 bits", (256, 64), Gray, Sixteen, |x, y, _| (256 * x + 4 * y) as u16),
        hard("noise", (128, 128), Rgb, Eight, hash),
        hard("lines", (128, 128), Gray, Eight, |x, y, _| on((3 * x + 5 * y) % 41 > 3)),
        hard("binary alpha", (128, 128), Rgba, Eight, |x, y, c| {
            if c == 3 { on(x / 32 % 2 == y / 32 % 2) } else { 400 * (x + c) as u16 }
        }),
        hard("soft alpha", (128, 128), Rgba, Eight, |x, y, c| {
            if c == 3 { 512 * y as u16 } else { 400 * (x + c) as u16 }
        }),
    ]
}

fn on(on: bool) -> u16 {
    if on { u16::MAX } else { 0 }
}

/// Noise by hashing the coordinates.
fn hash(x: u32, y: u32, c: u32) -> u16 {
    let seed = u64::from(x) << 40 | u64::from(y) << 16 | u64::from(c);
    fastrand::Rng::with_seed(seed).u16(..)
}

fn encoder(bench: &Bench) -> Result<String> {
    let mut store = bench.store(
        "stability-encoder.csv",
        ["picture", "gaussians", "effort"],
        ["used", "bytes", "psnr", "not_finite", "differs_by_threads", "seconds"],
    )?;
    let mut table = Table::new(&[
        "picture",
        "Gaussians",
        "bytes",
        "PSNR in dB",
        "values that are not finite",
        "differs by threads",
        "encode s",
    ]);
    let (mut worst, mut violated) = ((f64::INFINITY, "none"), Vec::new());
    for hard in hard_pictures() {
        let key = [hard.name, &GAUSSIANS.to_string(), &EFFORT.to_string()];
        let [used, bytes, psnr, not_finite, differs, seconds] =
            store.get(&bench.product, key, || fit(&hard))?;
        table.row(&[
            hard.name.to_owned(),
            used.to_string(),
            bytes.to_string(),
            format!("{psnr:.2}"),
            not_finite.to_string(),
            if differs == 0.0 { "no" } else { "**yes**" }.to_owned(),
            format!("{seconds:.2}"),
        ]);
        if psnr < worst.0 {
            worst = (psnr, hard.name);
        }
        if not_finite != 0.0 || differs != 0.0 {
            violated.push(hard.name);
        }
    }
    Ok(format!(
        "\n### Encoder\n\nCompared with each other: pictures that are hard to fit, with at most \
         {GAUSSIANS} Gaussians at effort {EFFORT}. Values are those of all the \
         file's Gaussians and of its samples as floats. The file must not depend on the number of \
         threads.\n{}\nLowest PSNR: {} ({:.2} dB). With values that are not finite, or with a file \
         that depends on threads: {}.\n",
        table.finish(),
        worst.1,
        worst.0,
        list_or_none(violated.into_iter()),
    ))
}

fn fit(hard: &HardPicture) -> Result<[f64; 6]> {
    let (width, height) = hard.size;
    let channels = hard.color.channels() as u32;
    let indices = 0..width * height * channels;
    let samples: Vec<u16> = indices
        .map(|i| (hard.sample)(i / channels % width, i / channels / width, i % channels))
        .collect();
    let bytes: Vec<u8> = samples.iter().map(|sample| (sample >> 8) as u8).collect();
    let source = match hard.depth {
        SampleDepth::Eight => Source::new_u8(width, height, hard.color, &bytes),
        _ => Source::new_u16(width, height, hard.color, &samples),
    }?;
    let encoder = gip::encoder(EFFORT).with_target(Target::Gaussians(GAUSSIANS));
    let encoded = encoder.clone().encode(&source)?;
    let alone = encoder.with_threads(Threads::One).encode(&source)?;
    let mut decoder = StreamDecoder::new();
    decoder.feed(&encoded.bytes)?;
    let picture = decoder.picture().context("the file has no picture")?;
    let mut values = planes(&picture, &RenderOptions::new())?;
    for gaussian in picture.gaussians() {
        let all = gaussian.center.iter().chain(&gaussian.cholesky).chain(&gaussian.color);
        values.extend(all.map(|&value| f64::from(value)));
    }
    Ok([
        encoded.report.gaussians.into(),
        encoded.bytes.len() as f64,
        encoded.report.psnr,
        not_finite(&values),
        f64::from(u8::from(encoded.bytes != alone.bytes)),
        encoded.report.seconds,
    ])
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn nan_is_never_hidden() {
        assert_eq!(difference(&[1.0, 5.0], &[1.0, 2.0]), 3.0);
        assert_eq!(difference(&[f64::INFINITY], &[f64::INFINITY]), 0.0);
        assert!(difference(&[f64::NAN, 7.0], &[1.0, 5.0]).is_nan());
        assert!(difference(&[7.0, f64::NAN], &[5.0, 1.0]).is_nan());
        assert_eq!(not_finite(&[f64::NAN, f64::INFINITY, 0.0]), 2.0);
    }
}
