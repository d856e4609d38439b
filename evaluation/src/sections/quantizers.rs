//! What stores positions and colours: the paper's table of quantizers, and what rounding costs that
//! training does not know of.

use std::sync::{Arc, Mutex};

use anyhow::Result;
use half::f16;
use image_gip::training::{Optimizer, Training, VectorQuantizer};
use image_gip::{Precision, Target, Threads};

use super::float_file::FloatFile;
use super::methods;
use super::residual_vq::{self, ResidualVq};
use crate::bench::Bench;
use crate::comparison::{Better, NamedFigures, better_than};
use crate::curve::{Curve, bd_rate};
use crate::gip::{self, MeasuredFile};
use crate::parallel;
use crate::pictures::TestPicture;
use crate::table::{Table, decibels, mean, percent};

/// Bits of a coordinate: the paper's, and enough for positions that are practically exact.
const PAPER: u8 = 12;
const FINE: u8 = 16;
/// Bits of shape and colour: the paper's.
const SHAPE: u8 = 10;
const COLOR: u8 = 6;
/// Bits of an IEEE half float, and of the floats that files have in place of other quantizers'
/// codes.
const HALF: u8 = 16;
const FLOAT: f64 = 32.0;
/// BD-rates that the paper prints in its table 3: of PSNR and of MS-SSIM.
const PRINTED: [(&str, [f64; 2]); 3] = [
    ("*FP16/LSQ+, printed*", [0.2511, 0.1777]),
    ("*FP16/RVQ, printed*", [1.3888, 0.8975]),
    ("*LSQ+/RVQ, printed*", [1.4724, 0.6829]),
];

/// Iterations of Adam for each of our encoder's: it takes shorter steps.
const ADAM_ITERATIONS: u32 = 2;

/// How positions and colours are stored.
#[derive(Clone, Copy, Debug)]
enum Quantizers {
    Trained(Positions, Colors),
    /// Trained with LSQ+ and [`FINE`] bits of positions, which a function then rounds to so many
    /// bits per coordinate.
    Rounded(u8, fn(&mut FloatFile)),
}

/// What quantizes positions in training.
#[derive(Clone, Copy, Debug)]
enum Positions {
    /// LSQ+ of so many bits: [`PAPER`] or [`FINE`].
    Lsq(u8),
    /// Half floats of pixels.
    Half,
}

/// What quantizes colours in training.
#[derive(Clone, Copy, Debug)]
enum Colors {
    /// LSQ+ of [`COLOR`] bits.
    Lsq,
    Rvq,
}

/// The first is what the others are compared with.
const ALL: [(&str, Quantizers); 8] = [
    ("LSQ+/LSQ+", Quantizers::Trained(Positions::Lsq(PAPER), Colors::Lsq)),
    ("FP16/LSQ+", Quantizers::Trained(Positions::Half, Colors::Lsq)),
    ("FP16/RVQ", Quantizers::Trained(Positions::Half, Colors::Rvq)),
    ("LSQ+/RVQ", Quantizers::Trained(Positions::Lsq(PAPER), Colors::Rvq)),
    ("LSQ+ of 16 bits/LSQ+", Quantizers::Trained(Positions::Lsq(FINE), Colors::Lsq)),
    ("12 bits by rounding/LSQ+", Quantizers::Rounded(PAPER, uniform)),
    ("FP16 by rounding/LSQ+", Quantizers::Rounded(HALF, half_pixels)),
    ("FP16 before tanh by rounding/LSQ+", Quantizers::Rounded(HALF, half_before_tanh)),
];

/// Means over the pictures.
#[derive(Clone, Copy, Debug)]
struct QuantizerMeans {
    rate: f64,
    bits: f64,
    psnr: f64,
    ms_ssim: f64,
}

pub(super) fn measure(
    bench: &Bench,
    pictures: &[TestPicture],
    counts: &[u32],
    iterations: u32,
) -> Result<String> {
    let mut store = bench.store(
        "ablation-quantizers.csv",
        ["quantizers", "iterations", "gaussians", "image"],
        ["bpp", "bits_per_gaussian", "psnr", "msssim"],
    )?;
    let iterations = ADAM_ITERATIONS * iterations;
    let mut rows = vec![Vec::new(); ALL.len()];
    for &count in counts {
        let settings = [iterations, count].map(|number| number.to_string());
        // For each picture the fit that all rounded positions start from.
        let fine: Vec<Mutex<Option<MeasuredFile>>> =
            pictures.iter().map(|_| Mutex::default()).collect();
        for (row, (name, quantizers)) in rows.iter_mut().zip(ALL) {
            let jobs = pictures.iter().zip(&fine).map(|(picture, fine)| {
                ([name, &settings[0], &settings[1], &picture.name], (picture, fine))
            });
            let jobs: Vec<_> = jobs.collect();
            let threads = &mut parallel::threads();
            let all = store.all(&bench.product, threads, &jobs, |(), (picture, fine)| {
                let mut fine = fine.lock().expect("no fit panics");
                stored(quantizers, count, iterations, picture, &mut fine)
            })?;
            let of = |column: usize| mean(all.iter().map(|one| one[column])).unwrap_or(f64::NAN);
            row.push(QuantizerMeans { rate: of(0), bits: of(1), psnr: of(2), ms_ssim: of(3) });
        }
    }
    Ok(format!(
        "\n### Quantizers of positions and colours\n\nCompared with: LSQ+ of {PAPER} bits for \
         positions and of {COLOR} for colours, the first row. All rows are of our encoder, \
         packed, with equal numbers of Gaussians, and with shapes of {SHAPE} bits by LSQ+; they differ \
         in what stores positions and colours, in this order. They are trained for {iterations} \
         iterations of Adam: Gauss-Newton steps know no curvature of a commitment loss. \
         The first five are trained with their quantizers. FP16: IEEE half floats of pixels, as in \
         the code of GaussianImage++. RVQ: residual vector quantization of colours as in \
         GaussianImage: two code books of eight entries, from five iterations of k-means, that \
         follow the colours as moving averages, and a commitment loss of weight 1. The others take \
         the fit of the fifth row and round its positions after training, so that nothing adapts \
         to the rounding: to a uniform grid of {PAPER} bits between the least and the largest \
         coordinate; to half floats of pixels; and to half floats of atanh(2 x / width - 1), the \
         coordinates of GaussianImage, where centres outside of the picture have no such coordinate \
         and are not rounded. Sizes are those of whole files, with the bits of the quantizers in \
         place of floats or of finer positions: without entropy coding, as in the paper, and with \
         the code books. Means; {}. Printed rows are table 3 of the paper, over its own rates.\n{}",
        bench.pictures_used(pictures.len()),
        text(counts, &rows),
    ))
}

fn text(counts: &[u32], rows: &[Vec<QuantizerMeans>]) -> String {
    let mut columns = vec!["positions/colours".to_owned(), "bits per Gaussian".to_owned()];
    columns.extend(counts.iter().map(|count| format!("{count} Gaussians")));
    columns.extend(["BD-rate, PSNR", "BD-rate, MS-SSIM"].map(str::to_owned));
    let mut table = Table::new(&columns);
    let qualities: [fn(&QuantizerMeans) -> f64; 2] = [|one| one.psnr, |one| decibels(one.ms_ssim)];
    let mut named: Vec<NamedFigures> = Vec::new();
    for ((name, _), row) in ALL.iter().zip(rows) {
        let average = |of: fn(&QuantizerMeans) -> f64| mean(row.iter().map(of)).unwrap_or(f64::NAN);
        let bits = average(|one| one.bits);
        let mut cells = vec![(*name).to_owned(), format!("{bits:.1}")];
        cells.extend(
            row.iter()
                .map(|one| format!("{:.2} dB, {:.4}, {:.3} bpp", one.psnr, one.ms_ssim, one.rate)),
        );
        cells.extend(qualities.map(|quality| {
            let curve =
                |row: &[QuantizerMeans]| Curve::new(row.iter().map(|one| (one.rate, quality(one))));
            percent(bd_rate(&curve(&rows[0]), &curve(row), (1e-3, 1e3)))
        }));
        table.row(&cells);
        let figures = vec![average(|one| one.psnr), average(|one| one.ms_ssim), bits];
        named.push(((*name).to_owned(), figures));
    }
    for (name, differences) in PRINTED {
        let mut cells = vec![name.to_owned()];
        cells.resize(2 + counts.len(), "-".to_owned());
        cells.extend(differences.map(|share| percent(Some(share))));
        table.row(&cells);
    }
    let figures = [
        ("PSNR", Better::Higher),
        ("MS-SSIM", Better::Higher),
        ("bits per Gaussian", Better::Lower),
    ];
    format!("{}{}", table.finish(), better_than(&figures, &named[0], &named[1..]))
}

/// Bits per pixel, bits per Gaussian, PSNR of the float rendering, MS-SSIM. `fine` is the fit with
/// [`FINE`] bits of positions, made when it is first needed.
fn stored(
    quantizers: Quantizers,
    count: u32,
    iterations: u32,
    picture: &TestPicture,
    fine: &mut Option<MeasuredFile>,
) -> Result<[f64; 4]> {
    let fit = |positions, colors| {
        let encoder = gip::psnr_encoder(gip::EFFORT)
            .with_target(Target::Gaussians(count))
            .with_training(training(iterations, positions, colors, picture))
            .with_precision(Precision::Packed);
        gip::encode(encoder, picture, Threads::One)
    };
    let trained;
    let measured = match quantizers {
        Quantizers::Trained(Positions::Lsq(FINE), Colors::Lsq) | Quantizers::Rounded(..) => {
            match fine {
                Some(measured) => measured,
                None => fine.insert(fit(Positions::Lsq(FINE), Colors::Lsq)?),
            }
        }
        Quantizers::Trained(positions, colors) => {
            trained = fit(positions, colors)?;
            &trained
        }
    };
    let MeasuredFile { file, bytes, report, distortion, .. } = measured;
    let gaussians = f64::from(report.gaussians);
    let (psnr, ms_ssim, bytes) = match quantizers {
        Quantizers::Trained(positions, colors) => {
            let saved = gaussians * saved_bits(positions, colors) / 8.0;
            let code_books = match colors {
                Colors::Lsq => 0.0,
                Colors::Rvq => residual_vq::CODE_BOOK_BYTES,
            };
            (report.psnr_float, distortion.ms_ssim, bytes - saved + code_books)
        }
        Quantizers::Rounded(bits, round) => {
            let mut rounded = FloatFile::read(file)?;
            round(&mut rounded);
            let file = rounded.to_bytes();
            let saved = gaussians * 2.0 * f64::from(FINE - bits) / 8.0;
            let ms_ssim = gip::distortion(&file, picture)?.ms_ssim;
            (gip::psnr_float(&file, picture)?, ms_ssim, bytes - saved)
        }
    };
    Ok([picture.rate(bytes), 8.0 * bytes / gaussians, psnr, ms_ssim])
}

/// Our training with these quantizers.
fn training(
    iterations: u32,
    positions: Positions,
    colors: Colors,
    picture: &TestPicture,
) -> Training {
    let bits = match positions {
        Positions::Lsq(bits) => bits,
        Positions::Half => HALF,
    };
    let mut training = methods::ours(iterations, [bits, SHAPE, COLOR]);
    training.optimizer = adam();
    if let Positions::Half = positions {
        training.quantization.center = Some(Arc::new(HalfFloats));
    }
    if let Colors::Rvq = colors {
        training.quantization.color = Some(Arc::new(ResidualVq::new(picture.pixels())));
    }
    training
}

/// Adam with learning rates that suit our encoder's other constants.
fn adam() -> Optimizer {
    let mut optimizer = Training::paper().optimizer;
    if let Optimizer::Adam(adam) = &mut optimizer {
        (adam.center, adam.shape, adam.color, adam.beta2) = (0.1, 0.1, 0.015, 0.99);
    }
    optimizer
}

/// By how many bits these quantizers' codes of a Gaussian are shorter than what files have in their
/// place.
fn saved_bits(positions: Positions, colors: Colors) -> f64 {
    let positions = match positions {
        Positions::Lsq(_) => 0.0,
        Positions::Half => 2.0 * (FLOAT - f64::from(HALF)),
    };
    let colors = match colors {
        Colors::Lsq => 0.0,
        Colors::Rvq => 3.0 * FLOAT - residual_vq::BITS,
    };
    positions + colors
}

/// Values as half floats.
#[derive(Debug)]
struct HalfFloats;

impl VectorQuantizer for HalfFloats {
    fn adapted(&self, _trained: &[&[f32]]) -> Arc<dyn VectorQuantizer> {
        Arc::new(Self)
    }

    fn quantize(&self, values: &mut [f32]) {
        values.iter_mut().for_each(|value| *value = half(*value));
    }
}

/// Rounds to a uniform grid along each axis, with as many steps as the paper's bits give.
fn uniform(file: &mut FloatFile) {
    for axis in 0..2 {
        let values = || file.gaussians.iter().map(|row| row[axis]);
        let low = values().fold(f32::INFINITY, f32::min);
        let high = values().fold(f32::NEG_INFINITY, f32::max);
        let step = ((high - low) / f32::from((1_u16 << PAPER) - 1)).max(f32::MIN_POSITIVE);
        for row in &mut file.gaussians {
            row[axis] = low + ((row[axis] - low) / step).round() * step;
        }
    }
}

fn half_pixels(file: &mut FloatFile) {
    for row in &mut file.gaussians {
        row[..2].iter_mut().for_each(|value| *value = half(*value));
    }
}

fn half_before_tanh(file: &mut FloatFile) {
    let (width, height) = file.size;
    for row in &mut file.gaussians {
        for (value, side) in row.iter_mut().zip([width as f32, height as f32]) {
            let relative = 2.0 * *value / side - 1.0;
            if relative.abs() < 1.0 {
                *value = 0.5 * side * (half(relative.atanh()).tanh() + 1.0);
            }
        }
    }
}

fn half(value: f32) -> f32 {
    f16::from_f32(value).to_f32()
}

#[cfg(test)]
mod tests {
    use super::*;
    use image_gip::Kernel;

    /// The largest distance that a rounding moves centres along x, in a picture of 768 x 512.
    fn largest_move(round: fn(&mut FloatFile)) -> f32 {
        let xs = (0..7680).map(|i| 0.05 + 0.1 * i as f32);
        let rows = xs.map(|x| [x, 100.0, 1.0, 0.0, 1.0, 0.1, 0.1, 0.1]).collect();
        let mut file = FloatFile::new((768, 512), Kernel::Quartic, rows);
        let before = file.gaussians.clone();
        round(&mut file);
        let pairs = file.gaussians.iter().zip(&before);
        let moves = pairs.map(|(after, before)| {
            assert_eq!(after[2..], before[2..]);
            (after[0] - before[0]).abs()
        });
        moves.fold(0.0, f32::max)
    }

    #[test]
    fn files_have_what_the_quantizers_store() {
        let (width, height) = (48, 32);
        let rgb = (0..width * height).flat_map(|i| {
            let (x, y) = ((i % 48) as u8, (i / 48) as u8);
            [5 * x, if x + y < 40 { 30 } else { 220 }, 7 * y]
        });
        let picture =
            TestPicture { name: String::new(), path: "".into(), width, height, rgb: rgb.collect() };
        let fit = |positions, colors| {
            let training = training(90, positions, colors, &picture);
            let encoder = gip::psnr_encoder(1).with_target(Target::Gaussians(150));
            let encoder = encoder.with_training(training).with_precision(Precision::Packed);
            let measured = gip::encode(encoder, &picture, Threads::Pool).expect("a small picture");
            let saved = saved_bits(positions, colors) * f64::from(measured.report.gaussians);
            (FloatFile::read(&measured.file).expect("it is RGB"), 8.0 * measured.bytes - saved)
        };
        let (file, bits) = fit(Positions::Half, Colors::Rvq);
        let positions = file.gaussians.iter().flat_map(|row| &row[..2]);
        assert!(positions.clone().all(|&value| value == half(value)));
        let mut colors: Vec<_> = file.gaussians.iter().map(|row| &row[5..]).collect();
        colors.sort_by(|a, b| a.partial_cmp(b).expect("finite"));
        colors.dedup();
        assert!((9..=64).contains(&colors.len()), "{}", colors.len());
        // 2 x 16 + 3 x 10 + 6 bits each, and the same for the rest of the file, but for scale and offset of
        // five components.
        let (lsq_file, lsq_bits) = fit(Positions::Lsq(PAPER), Colors::Lsq);
        let overhead = bits - 68.0 * file.gaussians.len() as f64;
        let lsq_overhead = lsq_bits - 72.0 * lsq_file.gaussians.len() as f64;
        let difference = lsq_overhead - overhead - 5.0 * 64.0;
        assert!(difference.abs() <= 16.0, "{overhead}, {lsq_overhead}");
    }

    #[test]
    fn positions_move_by_half_a_step_at_most() {
        // A half float has steps of 1/2 from 512 on.
        assert!((0.2..=0.25).contains(&largest_move(half_pixels)));
        // 768 / 4095 / 2.
        assert!((0.08..=0.095).contains(&largest_move(uniform)));
        // Steps of 2^-11 before tanh up to 1/2 and of 2^-10 from 1 on, times 384 and the slope.
        assert!((0.05..=0.1).contains(&largest_move(half_before_tanh)));
    }

    #[test]
    fn centres_outside_stay() {
        let row = [-3.3, 777.7, 1.0, 0.0, 1.0, 0.1, 0.1, 0.1];
        let mut file = FloatFile::new((768, 512), Kernel::Quartic, vec![row]);
        half_before_tanh(&mut file);
        assert_eq!(file.gaussians, [row]);
    }
}
