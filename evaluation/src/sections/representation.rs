//! The fit itself, without quantization: the paper's first table.

use anyhow::Result;
use image_gip::training::Training;
use image_gip::{Encoder, Parameterization, Precision, Target, Threads};

use super::printed::paper::{self, PrintedFit};
use super::{methods, two_level};
use crate::bench::Bench;
use crate::comparison::{Better, NamedFigures, better_than};
use crate::gip;
use crate::parallel;
use crate::pictures::TestPicture;
use crate::store::Store;
use crate::table::{Table, mean};

/// Numbers of Gaussians, as in the paper.
const GAUSSIANS: [u32; 2] = [5_000, 10_000];
const QUICK_GAUSSIANS: [u32; 1] = [5_000];
/// The same for large pictures.
const LARGE_GAUSSIANS: [u32; 2] = [10_000, 50_000];
const QUICK_LARGE_GAUSSIANS: [u32; 1] = [10_000];
/// How many pictures of Kodak: the published methods take half a minute for each.
const PICTURES: usize = 4;
const QUICK_PICTURES: usize = 1;
/// The effort that is shown beside the default one; a higher one gains next to nothing.
const BEST_EFFORT: u8 = 6;
/// Attributes of a Gaussian: two for the centre, three for the shape, three for the colour.
const PARAMETERS: f64 = 8.0;

/// How Gaussians are fitted.
#[derive(Clone, Debug)]
enum Method {
    /// Our encoder at an effort.
    Own(u8),
    Published(Training),
    TwoLevels(Training),
}

impl Method {
    /// How long it trains, in the words of the stored measurements.
    fn rounds(&self) -> String {
        match self {
            Self::Own(effort) => format!("effort {effort}"),
            Self::Published(training) | Self::TwoLevels(training) => {
                training.iterations.to_string()
            }
        }
    }
}

/// Fits with all of the paper's iterations, of which no times are taken: they take hours, on all cores at once.
const LONG: &str = "representation-long.csv";

/// What tables compare, in the order of [`PrintedFit`]'s figures.
const CRITERIA: [(&str, Better); 5] = [
    ("PSNR", Better::Higher),
    ("MS-SSIM", Better::Higher),
    ("memory", Better::Lower),
    ("training time", Better::Lower),
    ("frames per second", Better::Higher),
];

/// Measurements of fits: PSNR, MS-SSIM, Gaussians used, peak memory in bytes, seconds, frames per
/// second.
type FitStore = Store<4, 6>;

/// What the tables of a data set have in common.
struct DataSet<'a> {
    bench: &'a Bench,
    pictures: &'a [TestPicture],
    methods: &'a [(&'static str, Method)],
    printed: &'a [PrintedFit],
}

pub(crate) fn measure(bench: &mut Bench) -> Result<String> {
    let bench: &Bench = bench;
    let mut store = bench.store(
        "representation.csv",
        ["method", "iterations", "gaussians", "image"],
        ["psnr", "msssim", "used", "peak_memory", "seconds", "frames_per_second"],
    )?;
    let iterations = bench.iterations;
    let pictures = bench.sample(if bench.quick { QUICK_PICTURES } else { PICTURES });
    let counts: &[u32] = if bench.quick { &QUICK_GAUSSIANS } else { &GAUSSIANS };
    let full = methods::paper(iterations, Parameterization::Covariance, true, true);
    let without = |parameterization| methods::paper(iterations, parameterization, false, false);
    let own = (gip::NAME, Method::Own(gip::EFFORT));
    let plus_plus = ("GaussianImage++", Method::Published(full));
    let cholesky =
        ("GaussianImage (Cholesky)", Method::Published(without(Parameterization::Cholesky)));
    let all = [
        own.clone(),
        ("gip, more effort", Method::Own(BEST_EFFORT)),
        plus_plus.clone(),
        ("the same without D3 and CAF", Method::Published(without(Parameterization::Covariance))),
        cholesky.clone(),
        (
            "GaussianImage (rotation and scale)",
            Method::Published(without(Parameterization::RotationScale)),
        ),
        ("two levels, like LIG", Method::TwoLevels(without(Parameterization::Covariance))),
    ];
    let names: Vec<&str> = pictures.iter().map(|picture| picture.name.as_str()).collect();
    let mut text = format!(
        "Compared with: GaussianImage; GaussianImage++, with and without its two components; and a \
         two-level method like LIG: GaussianImage++ without its components, with a fifth of the \
         Gaussians for the picture at half its size and the others for the residual at full size, \
         each trained for all iterations, without LIG's own constants. {} Ours is the encoder, \
         tuned for PSNR, at effort {}, its default, and {BEST_EFFORT}. Attributes are 32-bit floats; PSNR is that of \
         the float rendering, as in papers. Memory is the encoder's peak memory without the \
         source. Means of {} ({}); all threads; other programs that run on the machine make the times \
         longer. Rows marked as printed are from the paper's table 1, for all of Kodak on an NVIDIA A30, \
         with GPU memory and 50,000 iterations: of other pictures, which are easier in the mean, so their differences \
         from each other alone compare with ours. SIREN is a network and has no Gaussians.\n",
        methods::description(iterations),
        gip::EFFORT,
        names.join(", "),
        bench.pictures_used(pictures.len()),
    );
    let kodak = DataSet { bench, pictures: &pictures, methods: &all, printed: &paper::KODAK };
    if !bench.quick {
        text.push_str(&as_long_as_the_paper(bench, &mut store, &all[..2])?);
    }
    text.push_str(&format!("\n### {iterations} iterations\n{}", kodak.tables(&mut store, counts)?));
    let large = bench.large_sample();
    if !large.is_empty() {
        let large = DataSet {
            bench,
            pictures: &large,
            methods: &[own, plus_plus, cholesky],
            printed: &paper::DIV2K,
        };
        text.push_str(&large_pictures(&large, &mut store)?);
    }
    Ok(text)
}

/// The published methods with the paper's iterations beside ours, if that is asked for or was measured before.
fn as_long_as_the_paper(
    bench: &Bench,
    store: &mut FitStore,
    ours: &[(&'static str, Method)],
) -> Result<String> {
    let training = |parameterization, has_components| {
        let iterations = methods::PAPER_ITERATIONS;
        methods::paper(iterations, parameterization, has_components, has_components)
    };
    let published = [
        ("GaussianImage++", training(Parameterization::Covariance, true)),
        ("GaussianImage (Cholesky)", training(Parameterization::Cholesky, false)),
    ];
    let pictures = bench.sample(PICTURES);
    let mut long = bench.store(LONG, ["method", "gaussians", "image"], ["psnr", "msssim"])?;
    let mut tables = String::new();
    for count in GAUSSIANS {
        let of_count = count.to_string();
        let mut table = Table::new(&["method", "PSNR in dB", "least", "largest", "MS-SSIM"]);
        let mut row = |name: &str, all: &[[f64; 2]]| {
            let of = |column: usize| all.iter().map(move |values| values[column]);
            let middle = |column| mean(of(column)).unwrap_or(f64::NAN);
            table.row(&[
                name.to_owned(),
                format!("{:.2}", middle(0)),
                format!("{:.2}", of(0).fold(f64::INFINITY, f64::min)),
                format!("{:.2}", of(0).fold(f64::NEG_INFINITY, f64::max)),
                format!("{:.4}", middle(1)),
            ]);
        };
        for (name, method) in ours {
            let mut all = Vec::new();
            for picture in &pictures {
                let key = [*name, &method.rounds(), &of_count, &picture.name];
                let [psnr, ms_ssim, ..] =
                    store.get(&bench.product, key, || fit(method, count, picture))?;
                all.push([psnr, ms_ssim]);
            }
            row(name, &all);
        }
        for (name, training) in &published {
            let jobs = pictures.iter();
            let jobs = jobs.map(|picture| ([*name, &of_count, &picture.name], picture));
            let jobs: Vec<_> = jobs.collect();
            let is_missing = |(key, _): &([&str; 3], _)| long.known(&bench.product, *key).is_none();
            if !bench.is_long && jobs.iter().any(is_missing) {
                return Ok(String::new());
            }
            let all =
                long.all(&bench.product, &mut parallel::threads(), &jobs, |(), picture| {
                    let encoder = published_encoder(training, count);
                    let measured = gip::encode(encoder, picture, Threads::One)?;
                    Ok([measured.report.psnr_float, measured.distortion.ms_ssim])
                })?;
            row(name, &all);
        }
        tables.push_str(&format!("\n{count} Gaussians:\n{}", table.finish()));
    }
    Ok(format!(
        "\n### As long as in the paper\n\nCompared with: GaussianImage and GaussianImage++ with all of the paper's {} \
         iterations; all else as above. The paper's own figures are those marked as printed below.\n{tables}",
        methods::PAPER_ITERATIONS,
    ))
}

/// An encoder that fits so many Gaussians, as floats.
fn float_encoder(effort: u8, count: u32) -> Encoder {
    let encoder = gip::psnr_encoder(effort).with_target(Target::Gaussians(count));
    encoder.with_precision(Precision::Float)
}

fn published_encoder(training: &Training, count: u32) -> Encoder {
    float_encoder(gip::EFFORT, count).with_training(training.clone())
}

/// The paper's numbers of Gaussians at its larger size.
fn large_pictures(large: &DataSet<'_>, store: &mut FitStore) -> Result<String> {
    let quick = large.bench.quick;
    let counts: &[u32] = if quick { &QUICK_LARGE_GAUSSIANS } else { &LARGE_GAUSSIANS };
    let described = large
        .pictures
        .iter()
        .map(|picture| format!("{} ({} x {})", picture.name, picture.width, picture.height));
    let described: Vec<String> = described.collect();
    Ok(format!(
        "\n### Pictures of 2K\n\nCompared with: GaussianImage and GaussianImage++ on the same \
         pictures, all else as above. In place of DIV2K, the paper's larger pictures (100 for \
         validation, 2,040 pixels on the longer side), which are for academic research alone, these \
         are compared: {}. Rows marked as printed are from the paper's table 1 for DIV2K, so of other \
         pictures again.\n{}",
        described.join(", "),
        large.tables(store, counts)?,
    ))
}

impl DataSet<'_> {
    /// One table for each number of Gaussians.
    fn tables(&self, store: &mut FitStore, counts: &[u32]) -> Result<String> {
        let mut text = String::new();
        for &count in counts {
            text.push_str(&format!("\n{count} Gaussians:\n{}", self.table(store, count)?));
        }
        Ok(text)
    }

    fn table(&self, store: &mut FitStore, count: u32) -> Result<String> {
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
        for (name, method) in self.methods {
            let mut rows = Vec::new();
            for picture in self.pictures {
                let rounds = method.rounds();
                let key = [*name, &rounds, &count.to_string(), &picture.name];
                rows.push(store.get(&self.bench.product, key, || fit(method, count, picture))?);
            }
            let of = |column: usize| mean(rows.iter().map(|row| row[column])).unwrap_or(f64::NAN);
            let memory = of(3) / f64::from(1 << 20);
            let figures = [of(0), of(1), memory, of(4), of(5)];
            table.row(&cells(name, PARAMETERS * of(2), figures));
            compared.push(((*name).to_owned(), figures.to_vec()));
        }
        for row in self.printed.iter().filter(|row| row.gaussians.is_none_or(|at| at == count)) {
            let name = format!("*{}*", row.method);
            table.row(&cells(&name, row.parameters, row.figures));
        }
        let better = better_than(&CRITERIA, &compared[0], &compared[1..]);
        Ok(format!("{}{better}", table.finish()))
    }
}

/// PSNR, MS-SSIM, Gaussians used, peak memory in bytes, seconds, frames per second.
fn fit(method: &Method, count: u32, picture: &TestPicture) -> Result<[f64; 6]> {
    let encoder = match method {
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
        Method::Published(training) => published_encoder(training, count),
        Method::Own(effort) => float_encoder(*effort, count),
    };
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

fn cells(method: &str, parameters: f64, figures: [f64; 5]) -> [String; 7] {
    let [psnr, ms_ssim, memory, seconds, frames] = figures;
    let frames = if frames.is_nan() { "-".to_owned() } else { format!("{frames:.0}") };
    [
        method.to_owned(),
        format!("{psnr:.2}"),
        format!("{ms_ssim:.4}"),
        format!("{parameters:.0}"),
        format!("{memory:.0}"),
        format!("{seconds:.1}"),
        frames,
    ]
}
