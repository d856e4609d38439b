//! Rate and distortion: curves, tables at equal rates, and mean differences in rate.

use std::collections::HashMap;
use std::path::Path;

use anyhow::{Context, Result, ensure};
use image_gip::{Target, Threads};

use crate::baselines::{BASELINES, Baseline, DESCRIPTION, Worker};
use crate::bench::Bench;
use crate::comparison::{Better, NamedFigures, better_than, list_or_none};
use crate::curve::{Curve, bd_rate};
use crate::gip;
use crate::pictures::TestPicture;
use crate::plot::{Corner, Plot, Scale, Series};
use crate::store::Store;
use crate::table::{Table, decibels, from_decibels, mean, percent};

/// Rates in bits per pixel at which our codec is measured.
const RATES: [f64; 9] = [0.1, 0.15, 0.2, 0.25, 0.35, 0.5, 0.75, 1.0, 1.25];
const QUICK_RATES: [f64; 5] = [0.15, 0.25, 0.5, 0.75, 1.05];
/// A quick run takes one in so many of a baseline's settings, and the last.
const QUICK_STEP: usize = 3;
/// Rates that the tables show.
const TABLE_RATES: [f64; 6] = [0.15, 0.25, 0.35, 0.5, 0.75, 1.0];
/// The range of rates for BD-rates and plots.
const BD_RANGE: (f64, f64) = (0.1, 1.25);

/// What one file contributes to a rate-distortion curve.
#[derive(Clone, Copy, Debug)]
pub(super) struct Point {
    bytes: f64,
    /// In bits per pixel.
    pub(super) rate: f64,
    psnr: f64,
    ms_ssim: f64,
}

/// Measurements of whole files at many settings, for every codec: `rate.csv`.
#[derive(Debug)]
pub(super) struct RateStore(Store<3, 4>);

impl RateStore {
    pub(super) fn open(bench: &Bench) -> Result<Self> {
        let keys = ["codec", "quality", "image"];
        Ok(Self(bench.store("rate.csv", keys, ["bytes", "bpp", "psnr", "msssim"])?))
    }

    fn ours(
        &mut self,
        version: &str,
        rate: f64,
        setting: &str,
        picture: &TestPicture,
    ) -> Result<Point> {
        self.point(version, [gip::NAME, setting, &picture.name], || {
            let encoder = gip::encoder(gip::EFFORT).with_target(Target::BitsPerPixel(rate));
            let measured = gip::encode(encoder, picture, Threads::Pool)?;
            let distortion = measured.distortion;
            Ok([measured.bytes, picture.rate(measured.bytes), distortion.psnr, distortion.ms_ssim])
        })
    }

    pub(super) fn baseline(
        &mut self,
        worker: &mut Worker,
        versions: &str,
        baseline: &Baseline,
        setting: &str,
        picture: &TestPicture,
    ) -> Result<Point> {
        self.point(versions, [baseline.id, setting, &picture.name], || {
            let trip = worker.round_trip(baseline.id, setting, picture, Some(1), [1; 2])?;
            let distortion = trip.distortion;
            Ok([trip.bytes, picture.rate(trip.bytes), distortion.psnr, distortion.ms_ssim])
        })
    }

    fn point(
        &mut self,
        version: &str,
        key: [&str; 3],
        measure: impl FnOnce() -> Result<[f64; 4]>,
    ) -> Result<Point> {
        let [bytes, rate, psnr, ms_ssim] = self.0.get(version, key, measure)?;
        Ok(Point { bytes, rate, psnr, ms_ssim })
    }
}

/// A codec with the measurements of all its files.
#[derive(Debug)]
struct Codec {
    id: &'static str,
    name: &'static str,
    settings: Vec<String>,
    /// For each picture, a point for each setting.
    points: Vec<Vec<Point>>,
}

#[derive(Clone, Copy, Debug)]
enum Metric {
    Psnr,
    MsSsim,
}

impl Metric {
    const ALL: [Self; 2] = [Self::Psnr, Self::MsSsim];

    fn name(self) -> &'static str {
        match self {
            Self::Psnr => "PSNR",
            Self::MsSsim => "MS-SSIM",
        }
    }

    /// Of a file, in dB.
    fn of(self, point: &Point) -> f64 {
        match self {
            Self::Psnr => point.psnr,
            Self::MsSsim => decibels(point.ms_ssim),
        }
    }

    /// The mean over pictures in dB, of qualities in dB.
    fn average(self, qualities: &[f64]) -> Option<f64> {
        match self {
            Self::Psnr => mean(qualities.iter().copied()),
            Self::MsSsim => {
                mean(qualities.iter().map(|&quality| from_decibels(quality))).map(decibels)
            }
        }
    }

    /// That mean, formatted for a table.
    fn mean_cell(self, qualities: &[f64]) -> Option<String> {
        self.average(qualities).map(|quality| match self {
            Self::Psnr => format!("{quality:.2}"),
            Self::MsSsim => format!("{:.4} ({quality:.2})", from_decibels(quality)),
        })
    }
}

impl Codec {
    fn curve(&self, picture: usize, metric: Metric) -> Curve {
        Curve::new(self.points[picture].iter().map(|point| (point.rate, metric.of(point))))
    }

    fn curves(&self, metric: Metric) -> Vec<Curve> {
        (0..self.points.len()).map(|picture| self.curve(picture, metric)).collect()
    }

    /// Mean rate against mean quality at every setting.
    fn mean_curve(&self, metric: Metric) -> Curve {
        let average = |of: &dyn Fn(&Point) -> f64, setting: usize| {
            mean(self.points.iter().map(|points| of(&points[setting]))).unwrap_or(f64::NAN)
        };
        Curve::new((0..self.settings.len()).map(|setting| {
            let quality = match metric {
                Metric::Psnr => average(&|point| point.psnr, setting),
                Metric::MsSsim => decibels(average(&|point| point.ms_ssim, setting)),
            };
            (average(&|point| point.rate, setting), quality)
        }))
    }
}

pub(crate) fn measure(bench: &mut Bench) -> Result<String> {
    let codecs = codecs(bench)?;
    let mut text = format!(
        "Compared with: {DESCRIPTION} Means; {}. Ours is at effort {}, asked for {} bits per \
         pixel.\n",
        bench.pictures_used(bench.pictures.len()),
        gip::EFFORT,
        rates(bench.quick).iter().map(f64::to_string).collect::<Vec<_>>().join(", "),
    );
    if let Some(path) = &bench.reference {
        text.push_str(&against_reference(path, bench, &codecs)?);
    }
    for metric in Metric::ALL {
        let plot = plot(bench, &codecs, metric)?;
        text.push_str(&format!(
            "\n### {}\n\n![{0} over rate]({plot})\n{}{}{}",
            metric.name(),
            at_equal_rates(&codecs, metric),
            mean_curves(&codecs, metric),
            bd_rates(bench, &codecs, metric),
        ));
    }
    Ok(text)
}

fn rates(quick: bool) -> &'static [f64] {
    if quick { &QUICK_RATES } else { &RATES }
}

/// All codecs measured on all pictures, ours first.
fn codecs(bench: &mut Bench) -> Result<Vec<Codec>> {
    let mut store = RateStore::open(bench)?;
    let pictures = bench.pictures.clone();
    let (quick, product) = (bench.quick, bench.product.clone());
    let (worker, versions) = bench.baselines()?;

    let mut ours = Codec { id: gip::NAME, name: gip::NAME, settings: vec![], points: vec![] };
    ours.settings =
        rates(quick).iter().map(|rate| format!("{rate} bpp, effort {}", gip::EFFORT)).collect();
    for picture in &pictures {
        let mut points = Vec::new();
        for (rate, setting) in rates(quick).iter().zip(&ours.settings) {
            points.push(store.ours(&product, *rate, setting, picture)?);
        }
        ours.points.push(points);
    }

    let mut codecs = vec![ours];
    for baseline in &BASELINES {
        let step = if quick { QUICK_STEP } else { 1 };
        let last = baseline.settings.len() - 1;
        let chosen = baseline.settings.iter().enumerate();
        let settings: Vec<String> = chosen
            .filter(|&(index, _)| index % step == 0 || index == last)
            .map(|(_, setting)| (*setting).to_owned())
            .collect();
        let mut all = Vec::new();
        for picture in &pictures {
            let mut points = Vec::new();
            for setting in &settings {
                points.push(store.baseline(worker, &versions, baseline, setting, picture)?);
            }
            all.push(points);
        }
        codecs.push(Codec { id: baseline.id, name: baseline.name, settings, points: all });
    }
    Ok(codecs)
}

/// A table with one row per codec and one column per rate, followed by the codecs that are better
/// than ours and at which rates. `quality` is in dB, `None` where there is nothing to compare.
fn by_rate(
    codecs: &[Codec],
    metric: Metric,
    quality: impl Fn(&Codec, f64) -> Option<f64>,
    cell: impl Fn(&Codec, f64) -> String,
) -> String {
    let names = TABLE_RATES.map(|rate| format!("{rate} bpp"));
    let mut columns = vec!["codec".to_owned()];
    columns.extend(names.clone());
    let mut table = Table::new(&columns);
    let mut compared: Vec<NamedFigures> = Vec::new();
    for codec in codecs {
        let mut cells = vec![codec.name.to_owned()];
        cells.extend(TABLE_RATES.map(|rate| cell(codec, rate)));
        table.row(&cells);
        let qualities = TABLE_RATES.map(|rate| quality(codec, rate).unwrap_or(f64::NAN));
        compared.push((codec.name.to_owned(), qualities.to_vec()));
    }
    let figures = names.map(|name| format!("{} at {name}", metric.name()));
    let figures = figures.each_ref().map(|figure| (figure.as_str(), Better::Higher));
    format!("{}{}", table.finish(), better_than(&figures, &compared[0], &compared[1..]))
}

fn at_equal_rates(codecs: &[Codec], metric: Metric) -> String {
    let reached = |codec: &Codec, rate: f64| -> Vec<f64> {
        codec.curves(metric).iter().filter_map(|curve| curve.quality(rate)).collect()
    };
    let all = |codec: &Codec, rate: f64| {
        Some(reached(codec, rate)).filter(|reached| reached.len() == codec.points.len())
    };
    let table = by_rate(
        codecs,
        metric,
        |codec, rate| metric.average(&all(codec, rate)?),
        |codec, rate| {
            let shown = all(codec, rate).and_then(|all| metric.mean_cell(&all));
            shown.unwrap_or_else(|| {
                format!("({}/{} reach)", reached(codec, rate).len(), codec.points.len())
            })
        },
    );
    format!(
        "\nMean over the pictures at equal rates: the curve of each picture is interpolated at \
         exactly this rate. There is no mean where the curves of some pictures do not reach the \
         rate.\n{table}"
    )
}

fn mean_curves(codecs: &[Codec], metric: Metric) -> String {
    let quality = |codec: &Codec, rate: f64| codec.mean_curve(metric).quality(rate);
    let table = by_rate(codecs, metric, quality, |codec, rate| {
        let shown = quality(codec, rate).and_then(|quality| metric.mean_cell(&[quality]));
        shown.unwrap_or_else(|| "-".into())
    });
    format!(
        "\nThe mean curve, as papers plot it: mean rate and mean quality over the pictures at each \
         setting, interpolated. Settings that mean equal quality spend more bits on difficult \
         pictures; our settings mean equal rate.\n{table}"
    )
}

/// BD-rates, for each picture and on average.
fn bd_rates(bench: &Bench, codecs: &[Codec], metric: Metric) -> String {
    let [ours, others @ ..] = codecs else { return String::new() };
    let mut columns = vec!["picture"];
    columns.extend(others.iter().map(|codec| codec.name));
    let mut table = Table::new(&columns);
    let mut all = vec![Vec::new(); others.len()];
    for (index, picture) in bench.pictures.iter().enumerate() {
        let mut cells = vec![picture.name.clone()];
        for (codec, all) in others.iter().zip(&mut all) {
            let difference =
                bd_rate(&codec.curve(index, metric), &ours.curve(index, metric), BD_RANGE);
            all.extend(difference);
            cells.push(percent(difference));
        }
        table.row(&cells);
    }
    let means: Vec<Option<f64>> = all.iter().map(|all| mean(all.iter().copied())).collect();
    let mut cells = vec!["**mean**".to_owned()];
    cells.extend(means.iter().map(|&mean| percent(mean)));
    table.row(&cells);
    let curves = others.iter().map(|codec| {
        percent(bd_rate(&codec.mean_curve(metric), &ours.mean_curve(metric), BD_RANGE))
    });
    let mut cells = vec!["**of the mean curves**".to_owned()];
    cells.extend(curves);
    table.row(&cells);

    let named = |worse: bool| {
        let means = others.iter().zip(&means);
        let of_kind = means.filter(move |(_, mean)| mean.is_some_and(|m| (m > 0.0) == worse));
        list_or_none(of_kind.map(|(codec, _)| codec.name))
    };
    format!(
        "\nBD-rate of our codec against each of the others, from {} to {} bits per pixel: how much \
         larger (+) or smaller (-) our files are at equal {}.\n{}\nOurs is worse than: {}. It is \
         better than: {}.\n",
        BD_RANGE.0,
        BD_RANGE.1,
        metric.name(),
        table.finish(),
        named(true),
        named(false),
    )
}

fn plot(bench: &Bench, codecs: &[Codec], metric: Metric) -> Result<String> {
    let name = format!("rate-{}.svg", metric.name().to_lowercase());
    let series: Vec<Series> = codecs
        .iter()
        .map(|codec| Series {
            name: codec.name.to_owned(),
            points: codec
                .mean_curve(metric)
                .points()
                .filter(|(rate, _)| (BD_RANGE.0 * 0.8..=BD_RANGE.1 * 1.2).contains(rate))
                .collect(),
        })
        .collect();
    let plot = Plot {
        title: &format!("{}, mean over {} pictures", metric.name(), bench.pictures.len()),
        x: ("bits per pixel", Scale::Linear),
        y: (&format!("{} in dB", metric.name()), Scale::Linear),
        legend: Corner::LowerRight,
    };
    plot.write(&bench.path(&name), &series)?;
    Ok(name)
}

/// Compares our measurements of the baselines with those of a CSV, at equal settings.
fn against_reference(path: &Path, bench: &Bench, codecs: &[Codec]) -> Result<String> {
    let columns = ["codec", "quality", "image", "bytes", "psnr", "msssim"];
    let mut reader =
        csv::Reader::from_path(path).with_context(|| format!("cannot read {}", path.display()))?;
    let header = reader.headers()?.clone();
    let column = |name: &str| {
        let index = header.iter().position(|column| column == name);
        index.with_context(|| format!("{} has no column `{name}`", path.display()))
    };
    let columns = columns.into_iter().map(column).collect::<Result<Vec<_>>>()?;
    let mut known = HashMap::new();
    for row in reader.records() {
        let row = row?;
        let cell = |index: usize| row.get(columns[index]).unwrap_or_default();
        let number = |index: usize| {
            cell(index).parse::<f64>().with_context(|| format!("{}: {row:?}", path.display()))
        };
        let image = cell(2).trim_end_matches(".png").to_owned();
        // By value: "0.50" and "0.5" are one setting.
        let key = (cell(0).to_owned(), number(1)?.to_bits(), image);
        known.insert(key, [number(3)?, number(4)?, number(5)?]);
    }

    let columns = ["codec", "files", "of equal size", "largest difference in PSNR", "in MS-SSIM"];
    let mut table = Table::new(&columns);
    let mut compared = 0;
    for codec in &codecs[1..] {
        let (mut files, mut equal, mut psnr, mut ms_ssim) = (0, 0, 0.0_f64, 0.0_f64);
        for (picture, points) in bench.pictures.iter().zip(&codec.points) {
            for (setting, point) in codec.settings.iter().zip(points) {
                let key =
                    (codec.id.to_owned(), setting.parse::<f64>()?.to_bits(), picture.name.clone());
                let Some(other) = known.get(&key) else { continue };
                files += 1;
                equal += i32::from(other[0] == point.bytes);
                psnr = psnr.max((other[1] - point.psnr).abs());
                ms_ssim = ms_ssim.max((other[2] - point.ms_ssim).abs());
            }
        }
        compared += files;
        table.row(&[
            codec.name.to_owned(),
            files.to_string(),
            equal.to_string(),
            format!("{psnr:.4} dB"),
            format!("{ms_ssim:.6}"),
        ]);
    }
    ensure!(compared > 0, "{} has none of these files", path.display());
    Ok(format!(
        "\nOur measurements of the baselines against those in {}, which were made by other \
         programs:\n{}",
        path.file_name().unwrap_or_default().to_string_lossy(),
        table.finish()
    ))
}
