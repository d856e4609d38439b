//! Positions as half floats against LSQ+: the paper's table of quantizers.

use anyhow::Result;
use half::f16;
use image_gip::{Precision, Target, Threads};

use super::float_file::FloatFile;
use super::methods;
use crate::bench::Bench;
use crate::comparison::{Better, NamedFigures, better_than};
use crate::curve::{Curve, bd_rate};
use crate::gip::{self, MeasuredFile};
use crate::pictures::TestPicture;
use crate::table::{Table, decibels, mean, percent};

/// Bits of a coordinate: the paper's, and enough for positions that are practically exact.
const PAPER: u8 = 12;
const FINE: u8 = 16;
/// Bits of shape and colour: the paper's.
const SHAPE: u8 = 10;
const COLOR: u8 = 6;
/// BD-rates that the paper prints for half floats: of PSNR and of MS-SSIM.
const PRINTED: [f64; 2] = [0.2511, 0.1777];

/// How positions are stored.
#[derive(Clone, Copy, Debug)]
enum PositionFormat {
    /// Trained with LSQ+ quantizers of so many bits: [`PAPER`] or [`FINE`].
    Trained(u8),
    /// Trained with [`FINE`] bits and then rounded by a function to so many bits per coordinate.
    Rounded(u8, fn(&mut FloatFile)),
}

const FORMATS: [(&str, PositionFormat); 5] = [
    ("LSQ+ of 12 bits", PositionFormat::Trained(PAPER)),
    ("LSQ+ of 16 bits", PositionFormat::Trained(FINE)),
    ("12 bits by rounding afterwards", PositionFormat::Rounded(PAPER, uniform)),
    ("half floats of pixels", PositionFormat::Rounded(16, half_pixels)),
    ("half floats before tanh", PositionFormat::Rounded(16, half_before_tanh)),
];

/// Means over the pictures.
#[derive(Clone, Copy, Debug)]
struct FormatMeans {
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
        "ablation-positions.csv",
        ["positions", "iterations", "gaussians", "image"],
        ["bpp", "bits_per_gaussian", "psnr", "msssim"],
    )?;
    let mut rows = vec![Vec::new(); FORMATS.len()];
    for &count in counts {
        let mut all = vec![Vec::new(); FORMATS.len()];
        for picture in pictures {
            // The fit that all rounded formats start from.
            let mut fine = None;
            for ((name, format), all) in FORMATS.iter().zip(&mut all) {
                let key = [*name, &iterations.to_string(), &count.to_string(), &picture.name];
                all.push(store.get(&bench.product, key, || {
                    stored(*format, count, iterations, picture, &mut fine)
                })?);
            }
        }
        for (row, all) in rows.iter_mut().zip(all) {
            let of = |column: usize| mean(all.iter().map(|one| one[column])).unwrap_or(f64::NAN);
            row.push(FormatMeans { rate: of(0), bits: of(1), psnr: of(2), ms_ssim: of(3) });
        }
    }
    Ok(format!(
        "\n### Positions as half floats\n\nCompared with: positions by LSQ+. All rows are of our \
         encoder at {iterations} iterations, packed, with equal numbers of Gaussians, and with \
         shapes of {SHAPE} bits and colours of {COLOR} bits by LSQ+; they differ in the positions. \
         The first two rows are trained with their quantizers. The others take the fit of the \
         second row and round its positions after training, so that nothing adapts to the \
         rounding: to a uniform grid of {PAPER} bits between the least and the largest \
         coordinate; to IEEE half floats of pixels, the coordinates of GaussianImage++; and to \
         half floats of atanh(2 x / width - 1), the coordinates of GaussianImage, where centres \
         outside of the picture have no such coordinate and are not rounded. Sizes are those of \
         whole files; for rounded rows, the second row's minus the bits saved. Means; {}. The \
         printed row is the paper's, over its own rates.\n{}",
        bench.pictures_used(pictures.len()),
        text(counts, &rows),
    ))
}

fn text(counts: &[u32], rows: &[Vec<FormatMeans>]) -> String {
    let mut columns = vec!["positions".to_owned(), "bits per Gaussian".to_owned()];
    columns.extend(counts.iter().map(|count| format!("{count} Gaussians")));
    columns.extend(["BD-rate, PSNR", "BD-rate, MS-SSIM"].map(str::to_owned));
    let mut table = Table::new(&columns);
    let qualities: [fn(&FormatMeans) -> f64; 2] = [|one| one.psnr, |one| decibels(one.ms_ssim)];
    let mut named: Vec<NamedFigures> = Vec::new();
    for ((name, _), row) in FORMATS.iter().zip(rows) {
        let average = |of: fn(&FormatMeans) -> f64| mean(row.iter().map(of)).unwrap_or(f64::NAN);
        let bits = average(|one| one.bits);
        let mut cells = vec![(*name).to_owned(), format!("{bits:.1}")];
        cells.extend(
            row.iter()
                .map(|one| format!("{:.2} dB, {:.4}, {:.3} bpp", one.psnr, one.ms_ssim, one.rate)),
        );
        cells.extend(qualities.map(|quality| {
            let curve =
                |row: &[FormatMeans]| Curve::new(row.iter().map(|one| (one.rate, quality(one))));
            percent(bd_rate(&curve(&rows[0]), &curve(row), (1e-3, 1e3)))
        }));
        table.row(&cells);
        let figures = vec![average(|one| one.psnr), average(|one| one.ms_ssim), bits];
        named.push(((*name).to_owned(), figures));
    }
    let mut cells = vec!["*FP16, printed*".to_owned()];
    cells.resize(2 + counts.len(), "-".to_owned());
    cells.extend(PRINTED.map(|share| percent(Some(share))));
    table.row(&cells);
    let figures = [
        ("PSNR", Better::Higher),
        ("MS-SSIM", Better::Higher),
        ("bits per Gaussian", Better::Lower),
    ];
    format!("{}{}", table.finish(), better_than(&figures, &named[0], &named[1..]))
}

/// Bits per pixel, bits per Gaussian, PSNR of the float rendering, MS-SSIM. `fine` is the fit with
/// [`FINE`] bits, made when it is first needed.
fn stored(
    format: PositionFormat,
    count: u32,
    iterations: u32,
    picture: &TestPicture,
    fine: &mut Option<MeasuredFile>,
) -> Result<[f64; 4]> {
    let fit = |bits: u8| {
        let training = methods::ours(iterations, [bits, SHAPE, COLOR]);
        let encoder = gip::encoder(gip::EFFORT).with_target(Target::Gaussians(count));
        let encoder = encoder.with_training(training).with_precision(Precision::Packed);
        gip::encode(encoder, picture, Threads::Pool)
    };
    let paper;
    let measured = match format {
        PositionFormat::Trained(PAPER) => {
            paper = fit(PAPER)?;
            &paper
        }
        _ => match fine {
            Some(measured) => measured,
            None => fine.insert(fit(FINE)?),
        },
    };
    let MeasuredFile { file, bytes, report, distortion, .. } = measured;
    let gaussians = f64::from(report.gaussians);
    let (psnr, ms_ssim, bytes) = match format {
        PositionFormat::Trained(_) => (report.psnr_float, distortion.ms_ssim, *bytes),
        PositionFormat::Rounded(bits, round) => {
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
