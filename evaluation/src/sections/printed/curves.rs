//! Our curve on Kodak beside curves that others have printed, in the convention of papers.

use std::path::Path;
use std::slice;

use anyhow::{Context, Result};
use image_gip::Target;
use serde::Deserialize;

use crate::baselines::BASELINES;
use crate::bench::Bench;
use crate::curve::{Curve, bd_rate};
use crate::gip;
use crate::metric::Metric;
use crate::provenance::FOLDER;
use crate::sections::codec_curves::{Codec, Extent, Sweep, Variant};
use crate::sections::rate_store::RateStore;
use crate::table::{Table, decibels, median, percent};

/// Ours, in that convention: one multiplier of the rate for all pictures.
const OURS: Variant<'static> =
    Variant { name: gip::PSNR_NAME, encoder: gip::psnr_encoder, targets: LAMBDAS };
/// From about 0.1 to 2 bits per pixel.
const LAMBDAS: &[Target] = &[
    Target::Lambda(3200.0),
    Target::Lambda(1600.0),
    Target::Lambda(800.0),
    Target::Lambda(400.0),
    Target::Lambda(200.0),
    Target::Lambda(100.0),
    Target::Lambda(50.0),
    Target::Lambda(25.0),
];
/// Rates that the tables show, in bits per pixel.
const TABLE_RATES: [f64; 6] = [0.15, 0.25, 0.35, 0.5, 0.75, 1.0];
/// The range of rates for BD-rates.
const BD_RANGE: (f64, f64) = (0.15, 1.5);

/// A point of a printed curve: a row of `printed/kodak.csv`.
#[derive(Debug, Deserialize)]
struct Row {
    codec: String,
    bpp: f64,
    psnr: f64,
    ms_ssim: Option<f64>,
    encode_s: Option<f64>,
    decode_s: Option<f64>,
    source: String,
}

/// A codec as a row of the tables.
struct Printed {
    name: String,
    /// For PSNR and MS-SSIM.
    curves: [Curve; 2],
    /// Medians over the settings, in seconds.
    times: [Option<f64>; 2],
}

const METRICS: [Metric; 2] = [Metric::Psnr, Metric::MsSsim];

pub(super) fn measure(bench: &mut Bench) -> Result<String> {
    let printed = read(&Path::new(FOLDER).join("printed/kodak.csv"))?;
    let mut sources: Vec<&str> = printed.iter().map(|row| row.source.as_str()).collect();
    sources.dedup();
    let ours = measured(bench)?;
    let rows: Vec<Printed> = ours.into_iter().chain(by_codec(&printed)).collect();
    let mut text = format!(
        "The mean curve, as papers plot it: mean rate and mean quality over the pictures at each \
         setting, interpolated. Settings mean equal slope or equal quality, so difficult pictures \
         get more bits; ours are of one lambda for all pictures, and JPEG 2000's are rates. *Printed* rows are others' figures for all 24 Kodak \
         pictures, with times on their machines (learned codecs: with a GPU); the others were \
         measured here ({}). Ours is tuned for PSNR; BD-rate is ours against the row, from {} to {} bits per pixel; \
         negative: ours is smaller. Printed by: {}.\n",
        bench.pictures_used(bench.pictures.len()),
        BD_RANGE.0,
        BD_RANGE.1,
        sources.join("; "),
    );
    for (index, metric) in METRICS.into_iter().enumerate() {
        text.push_str(&format!("\n### {}, mean curve\n{}", metric.name(), table(&rows, index)));
    }
    Ok(text)
}

fn read(path: &Path) -> Result<Vec<Row>> {
    let mut reader =
        csv::Reader::from_path(path).with_context(|| format!("cannot read {}", path.display()))?;
    let rows = reader.deserialize().collect::<Result<_, _>>();
    rows.with_context(|| format!("cannot read {}", path.display()))
}

/// Ours and then the baselines, as measured on Kodak.
fn measured(bench: &mut Bench) -> Result<Vec<Printed>> {
    let mut store = RateStore::open(bench)?;
    let (pictures, extent) = (bench.pictures.clone(), Extent::new(bench.quick));
    let product = bench.product.clone();
    let mut codecs = vec![Codec::ours(&mut store, &product, &OURS, &pictures, extent)?];
    let (workers, versions) = bench.workers()?;
    let sweeps: Vec<Sweep> = BASELINES
        .iter()
        .map(|baseline| Sweep { tunings: slice::from_ref(baseline), extent })
        .collect();
    codecs.extend(Codec::baselines(&mut store, workers, &versions, &sweeps, &pictures)?);
    let row = |codec: Codec| Printed {
        name: codec.name.to_owned(),
        curves: METRICS.map(|metric| codec.mean_curve(metric)),
        times: [None; 2],
    };
    Ok(codecs.into_iter().map(row).collect())
}

/// The printed curves. The rows of a codec follow each other.
fn by_codec(rows: &[Row]) -> Vec<Printed> {
    let of_one = rows.chunk_by(|a, b| a.codec == b.codec);
    of_one
        .map(|rows| Printed {
            name: format!("*{}, printed*", rows[0].codec),
            curves: [
                Curve::new(rows.iter().map(|row| (row.bpp, row.psnr))),
                Curve::new(rows.iter().filter_map(|row| Some((row.bpp, decibels(row.ms_ssim?))))),
            ],
            times: [
                median(rows.iter().filter_map(|row| row.encode_s)),
                median(rows.iter().filter_map(|row| row.decode_s)),
            ],
        })
        .collect()
}

/// The table of one of [`METRICS`], ours first.
fn table(rows: &[Printed], metric: usize) -> String {
    let mut columns = vec![METRICS[metric].with_unit().to_owned()];
    columns.extend(TABLE_RATES.map(|rate| format!("{rate} bpp")));
    columns
        .extend(["BD-rate of ours", "encode s, printed", "decode s, printed"].map(str::to_owned));
    let mut table = Table::new(&columns);
    let ours = &rows[0].curves[metric];
    for Printed { name, curves, times } in rows {
        if curves[metric].points().next().is_none() {
            // It is not printed in this metric.
            continue;
        }
        let (curve, mut cells) = (&curves[metric], vec![name.clone()]);
        let missing = || "-".to_owned();
        cells.extend(TABLE_RATES.map(|rate| {
            curve.quality(rate).map_or_else(missing, |level| METRICS[metric].cell(level))
        }));
        cells.push(percent(bd_rate(curve, ours, BD_RANGE)));
        cells.extend(times.map(|time| time.map_or_else(missing, |time| format!("{time:.2}"))));
        table.row(&cells);
    }
    table.finish()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_printed_curves_are_those_of_the_issue() {
        let rows = read(&Path::new(FOLDER).join("printed/kodak.csv")).expect("it is in the crate");
        let codecs = by_codec(&rows);
        let names: Vec<&str> = codecs.iter().map(|codec| codec.name.as_str()).collect();
        for name in ["VTM", "HM", "BPG", "AV1", "Balle 2017", "Balle 2018", "Cheng", "ELIC", "Cool"]
        {
            let of_name = names.iter().filter(|each| each[1..].starts_with(name)).count();
            assert_eq!(of_name, 1, "{name} is one row of {names:?}");
        }
        // As CompressAI's own interpolation has it.
        let vtm = codecs[0].curves[0].quality(0.5).expect("it reaches");
        assert!((vtm - 34.36).abs() < 0.02, "{vtm}");
    }
}
