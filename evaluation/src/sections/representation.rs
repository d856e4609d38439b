//! The fit itself, without quantization: the paper's first table.

use anyhow::Result;
use image_gip::training::Training;
use image_gip::{Parameterization, Precision, Target, Threads};

use super::{methods, two_level};
use crate::bench::Bench;
use crate::comparison::{Better, NamedFigures, better_than};
use crate::gip;
use crate::pictures::TestPicture;
use crate::table::{Table, mean};

/// Numbers of Gaussians, as in the paper.
const GAUSSIANS: [u32; 2] = [5_000, 10_000];
const QUICK_GAUSSIANS: [u32; 1] = [5_000];
const QUICK_PICTURES: usize = 1;
/// The effort that is shown beside the default one; a higher one gains next to nothing.
const BEST_EFFORT: u8 = 8;
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

/// How Gaussians are fitted.
#[derive(Clone, Debug)]
enum Method {
    /// Our encoder at an effort.
    Own(u8),
    Published(Training),
    TwoLevels(Training),
}

/// What tables compare, in the order of [`PRINTED`]'s figures.
const CRITERIA: [(&str, Better); 5] = [
    ("PSNR", Better::Higher),
    ("MS-SSIM", Better::Higher),
    ("memory", Better::Lower),
    ("training time", Better::Lower),
    ("frames per second", Better::Higher),
];

pub(crate) fn measure(bench: &mut Bench) -> Result<String> {
    let mut store = bench.store(
        "representation.csv",
        ["method", "iterations", "gaussians", "image"],
        ["psnr", "msssim", "used", "peak_memory", "seconds", "frames_per_second"],
    )?;
    let iterations = bench.iterations;
    let pictures = bench.sample(if bench.quick { QUICK_PICTURES } else { usize::MAX });
    let counts: &[u32] = if bench.quick { &QUICK_GAUSSIANS } else { &GAUSSIANS };
    let full = methods::paper(iterations, Parameterization::Covariance, true, true);
    let without = |parameterization| methods::paper(iterations, parameterization, false, false);
    let all = [
        (gip::NAME, Method::Own(gip::EFFORT)),
        ("gip, more effort", Method::Own(BEST_EFFORT)),
        ("GaussianImage++", Method::Published(full)),
        ("the same without D3 and CAF", Method::Published(without(Parameterization::Covariance))),
        ("GaussianImage (Cholesky)", Method::Published(without(Parameterization::Cholesky))),
        (
            "GaussianImage (rotation and scale)",
            Method::Published(without(Parameterization::RotationScale)),
        ),
        ("two levels, like LIG", Method::TwoLevels(without(Parameterization::Covariance))),
    ];
    let mut text = format!(
        "Compared with: GaussianImage; GaussianImage++, with and without its two components; and a \
         two-level method like LIG: GaussianImage++ without its components, with a fifth of the \
         Gaussians for the picture at half its size and the others for the residual at full size, \
         each trained for all iterations, without LIG's own constants. {} Ours is the encoder at \
         effort {}, its default, and {BEST_EFFORT}. Attributes are 32-bit floats; PSNR is that of \
         the float rendering, as in papers. Memory is the encoder's peak memory without the \
         source. Means; {}; all threads. Rows marked as printed are the paper's own figures for \
         all of Kodak on an NVIDIA A30, with GPU memory.\n",
        methods::description(iterations),
        gip::EFFORT,
        bench.pictures_used(pictures.len()),
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
        let mut compared: Vec<NamedFigures> = Vec::new();
        for (name, method) in &all {
            let mut rows = Vec::new();
            for picture in &pictures {
                let rounds = match method {
                    Method::Own(effort) => format!("effort {effort}"),
                    _ => iterations.to_string(),
                };
                let key = [*name, &rounds, &count.to_string(), &picture.name];
                rows.push(store.get(&bench.product, key, || fit(method, count, picture))?);
            }
            let of = |column: usize| mean(rows.iter().map(|row| row[column])).unwrap_or(f64::NAN);
            let memory = of(3) / f64::from(1 << 20);
            let figures = [of(0), of(1), memory, of(4), of(5)];
            table.row(&cells(name, of(2), figures));
            compared.push(((*name).to_owned(), figures.to_vec()));
        }
        for (method, _, figures) in PRINTED.iter().filter(|(_, printed, _)| *printed == count) {
            table.row(&cells(&format!("*{method}*"), f64::from(count), *figures));
            compared.push((format!("*{method}*"), figures.to_vec()));
        }
        text.push_str(&format!("\n{count} Gaussians:\n{}", table.finish()));
        text.push_str(&better_than(&CRITERIA, &compared[0], &compared[1..]));
    }
    Ok(text)
}

/// PSNR, MS-SSIM, Gaussians used, peak memory in bytes, seconds, frames per second.
fn fit(method: &Method, count: u32, picture: &TestPicture) -> Result<[f64; 6]> {
    let (effort, training) = match method {
        Method::TwoLevels(training) => {
            let levels = two_level::fit(picture, count, training)?;
            let file = &levels.file;
            return Ok([
                gip::psnr_float(file, picture)?,
                gip::distortion(file, picture)?.ms_ssim,
                levels.gaussians.into(),
                levels.memory,
                levels.seconds,
                1.0 / gip::render_seconds(file)?,
            ]);
        }
        Method::Published(training) => (gip::EFFORT, Some(training)),
        Method::Own(effort) => (*effort, None),
    };
    let mut encoder =
        gip::encoder(effort).with_target(Target::Gaussians(count)).with_precision(Precision::Float);
    if let Some(training) = training {
        encoder = encoder.with_training(training.clone());
    }
    let measured = gip::encode(encoder, picture, Threads::Pool)?;
    let report = &measured.report;
    Ok([
        report.psnr_float,
        measured.distortion.ms_ssim,
        report.gaussians.into(),
        measured.memory,
        report.seconds,
        1.0 / gip::render_seconds(&measured.file)?,
    ])
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
