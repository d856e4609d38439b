//! The fit itself, without quantization: the paper's first table.

use anyhow::Result;
use image_gip::{Chart, Precision, Target};

use super::methods;
use crate::bench::Bench;
use crate::gip;
use crate::table::{Table, mean};

/// Numbers of Gaussians, as in the paper.
const GAUSSIANS: [u32; 2] = [5_000, 10_000];
const QUICK_GAUSSIANS: [u32; 1] = [5_000];
const QUICK_PICTURES: usize = 1;
/// Attributes of a Gaussian: two for the centre, three for the shape, three for the colour.
const PARAMETERS: f64 = 8.0;

/// Rows of the paper's table for Kodak: method, Gaussians, PSNR, MS-SSIM, GPU memory in MiB,
/// training seconds, frames per second.
const PRINTED: [(&str, u32, [f64; 5]); 6] = [
    ("GaussianImage, printed", 5_000, [29.85, 0.962, 812.0, 93.49, 2305.0]),
    ("LIG, printed", 5_000, [28.25, 0.946, 832.0, 118.40, 1394.0]),
    ("GaussianImage++, printed", 5_000, [31.83, 0.960, 856.0, 116.05, 2365.0]),
    ("GaussianImage, printed", 10_000, [32.48, 0.982, 814.0, 115.89, 2009.0]),
    ("LIG, printed", 10_000, [31.00, 0.975, 832.0, 125.37, 1331.0]),
    ("GaussianImage++, printed", 10_000, [35.41, 0.983, 876.0, 118.76, 2216.0]),
];

pub(crate) fn measure(bench: &mut Bench) -> Result<String> {
    let mut store = bench.store(
        "representation.csv",
        ["method", "iterations", "gaussians", "image"],
        ["psnr", "msssim", "used", "peak_memory", "seconds", "frames_per_second"],
    )?;
    let iterations = bench.iterations;
    let pictures = if bench.quick { QUICK_PICTURES } else { bench.pictures.len() };
    let pictures = &bench.pictures[..pictures.min(bench.pictures.len())];
    let counts: &[u32] = if bench.quick { &QUICK_GAUSSIANS } else { &GAUSSIANS };
    let without = |chart| methods::paper(iterations, chart, false, false);
    let all = [
        (gip::NAME, None),
        ("GaussianImage++", Some(methods::paper(iterations, Chart::Covariance, true, true))),
        ("the same without D3 and CAF", Some(without(Chart::Covariance))),
        ("GaussianImage (Cholesky)", Some(without(Chart::Cholesky))),
        ("GaussianImage (rotation and scale)", Some(without(Chart::RotationScale))),
    ];
    let mut text = format!(
        "Compared with: GaussianImage, GaussianImage++ and the direct covariance without its two \
         components. {} Ours is the encoder at effort {}. Attributes are 32-bit floats; PSNR is that \
         of the float rendering, as papers have it. Means; pictures: {}; all threads. Rows marked \
         as printed are the paper's own figures for all of Kodak on an NVIDIA A30, with GPU memory; \
         what our processor is worse at than that GPU is frames per second.\n",
        methods::description(iterations),
        gip::EFFORT,
        pictures.len(),
    );
    for &count in counts {
        let mut table = Table::new(&[
            "method",
            "PSNR in dB",
            "MS-SSIM",
            "parameters",
            "memory MiB",
            "training s",
            "frames/s",
        ]);
        for (method, training) in &all {
            let mut rows = Vec::new();
            for picture in pictures {
                let rounds = match training {
                    Some(training) => training.iterations.to_string(),
                    None => format!("effort {}", gip::EFFORT),
                };
                let key = [*method, &rounds, &count.to_string(), &picture.name];
                rows.push(store.get(&bench.product, key, || {
                    let mut encoder = gip::encoder(gip::EFFORT)
                        .with_target(Target::Gaussians(count))
                        .with_precision(Precision::Float);
                    if let Some(training) = training {
                        encoder = encoder.with_training(training.clone());
                    }
                    let coded = gip::code(encoder, picture, None)?;
                    let report = &coded.report;
                    Ok([
                        report.psnr_float,
                        coded.distortion.ms_ssim,
                        report.gaussians.into(),
                        report.peak_memory as f64,
                        report.seconds,
                        1.0 / coded.render_seconds()?,
                    ])
                })?);
            }
            let of = |column: usize| mean(rows.iter().map(|row| row[column])).unwrap_or(f64::NAN);
            let memory = of(3) / f64::from(1 << 20);
            let figures = [of(0), of(1), memory, of(4), of(5)];
            table.row(&cells(method, of(2), figures));
        }
        for (method, _, figures) in PRINTED.iter().filter(|(_, printed, _)| *printed == count) {
            table.row(&cells(&format!("*{method}*"), f64::from(count), *figures));
        }
        text.push_str(&format!("\n{count} Gaussians:\n{}", table.finish()));
    }
    Ok(text)
}

fn cells(method: &str, gaussians: f64, figures: [f64; 5]) -> [String; 7] {
    let [psnr, ms_ssim, memory, seconds, frames] = figures;
    [
        method.to_owned(),
        format!("{psnr:.2}"),
        format!("{ms_ssim:.4}"),
        format!("{:.0}", PARAMETERS * gaussians),
        format!("{memory:.0}"),
        format!("{seconds:.1}"),
        format!("{frames:.0}"),
    ]
}
