//! Rate and distortion: curves, tables at equal rates, and mean differences in rate.

use std::fs::File;

use anyhow::{Context, Result};

use super::codec_curves::{Codec, OURS};
use super::comparisons::{Comparison, compare};
use super::ranges::{HIGH, Outcome, RANGES, bd_rates, short};
use super::rate_store::RateStore;
use super::reference::Reference;
use crate::baselines::{BEST_AVIF, DESCRIPTION, RIVALS_DESCRIPTION};
use crate::bench::Bench;
use crate::comparison::list_or_none;
use crate::curve::Curve;
use crate::gip;
use crate::metric::Metric;
use crate::plot::{Corner, Plot, Scale, Series};
use crate::table::{Table, percent};

/// Rates that the tables show, in bits per pixel.
const TABLE_RATES: [f64; 5] = [0.15, 0.25, 0.5, 1.0, 1.5];
/// Rates that the plots show.
pub(super) const PLOT_RATES: [f64; 11] =
    [0.1, 0.125, 0.15, 0.2, 0.25, 0.35, 0.5, 0.7, 1.0, 1.4, 1.9];
/// Codecs in the plots.
pub(super) const PLOTTED: [&str; 8] =
    [gip::NAME, BEST_AVIF[0].name, "AVIF", "JPEG XL", "HEIC", "WebP", "jpegli", "JPEG 2000"];
/// Codecs in the short table.
const FOREMOST: [&str; 5] = [BEST_AVIF[0].name, "AVIF", "JPEG XL", "HEIC", "WebP"];
/// How many pictures are named at either end.
const ENDS: usize = 5;
/// Every BD-rate of every picture.
const BY_PICTURE: &str = "rate-pictures.csv";

pub(crate) fn measure(bench: &mut Bench) -> Result<String> {
    let reference = bench.reference.as_deref().map(Reference::load).transpose()?;
    let mut store = RateStore::open(bench)?;
    let comparisons = compare(bench, &mut store)?;
    let mut text = introduction();
    if let Some(reference) = reference {
        let kodak = &comparisons[0];
        text.push_str(&reference.compare(&kodak.set.pictures, &kodak.others)?);
    }
    text.push_str(&format!("\n### In short\n{}", in_short(&comparisons)));
    for comparison in &comparisons {
        text.push_str(&format!("\n### Best and worst pictures: {}\n", comparison.set.name));
        text.push_str(&ends(comparison));
        for metric in Metric::ALL {
            text.push_str(&details(bench, comparison, metric)?);
        }
    }
    write_by_picture(bench, &comparisons)?;
    Ok(text)
}

fn introduction() -> String {
    format!(
        "Compared with: {DESCRIPTION} {RIVALS_DESCRIPTION} Ours ({}) is asked for: {}. SSIMULACRA2 is 100 for equal pictures; 90 \
         is hard to tell from the source, 70 is high quality, 50 medium, 30 low. Butteraugli is \
         its 3-norm at 80 nits: lower is better. Both equal what the tools of libjxl 0.11 print. \
         CVVDP is ColorVideoVDP for a monitor of 24 inches at 60 cm (standard_fhd), in JOD: 10 for \
         equal pictures; of two that are 1 apart, three in four people choose the one with more. \
         Curves run through a file for each setting (ours seven, AVIF at its best six, the others seven or nine, half \
         of them on screenshots) and end with the first file of at least {} bits per pixel. \
         BD-rate is how much larger (+) or smaller (-) our files are at equal quality, as a mean over the \
         qualities that both reach within a range of rates: {}. A picture without such a quality is left out; one is \
         won if our files are smaller. [{BY_PICTURE}]({BY_PICTURE}) has every picture's, [rate.csv](rate.csv) every \
         file.\n",
        OURS.each_ref().map(|variant| variant.name).join(", "),
        OURS[0].settings().join("; "),
        HIGH.rates.1,
        RANGES.each_ref().map(|range| range.title()).join("; "),
    )
}

/// Mean BD-rates of ours against the foremost of the others at low, middle and high rates.
fn in_short(comparisons: &[Comparison]) -> String {
    let mut columns = vec![format!("{}: low / middle / high rates", gip::NAME)];
    columns.extend(FOREMOST.map(|name| format!("against {name}")));
    let mut table = Table::new(&columns);
    for metric in Metric::ALL {
        for comparison in comparisons {
            let mut cells = vec![format!("{}, {}", metric.name(), comparison.set.name)];
            for name in FOREMOST {
                let means = RANGES.map(|range| {
                    let other = comparison.other(name)?;
                    Outcome::of(&bd_rates(&comparison.ours, other, metric, range)).mean
                });
                cells.push(means.map(percent).join(" / "));
            }
            table.row(&cells);
        }
    }
    format!("\nMean BD-rate over the pictures:\n{}", table.finish())
}

/// The pictures of a set that are worst and best for us, by metric and range.
fn ends(comparison: &Comparison) -> String {
    let anchor = comparison.best_avif();
    let mut table = Table::new(&["metric, rates", "worst for gip", "best for gip"]);
    for metric in Metric::ALL {
        for range in RANGES {
            let rates = bd_rates(&comparison.ours, anchor, metric, range);
            let names = comparison.set.pictures.iter().map(|picture| short(&picture.name));
            let mut known: Vec<(&str, f64)> =
                names.zip(rates).filter_map(|(name, rate)| Some((name, rate?))).collect();
            known.sort_by(|a, b| b.1.total_cmp(&a.1));
            // No picture is at both ends.
            let worst = known.len().div_ceil(2).min(ENDS);
            let best = (known.len() - worst).min(ENDS);
            let list = |of: &[(&str, f64)]| {
                let each = of.iter().map(|(name, rate)| format!("{name} {}", percent(Some(*rate))));
                each.collect::<Vec<_>>().join(", ")
            };
            table.row(&[
                format!("{}, {}", metric.name(), range.name),
                list(&known[..worst]),
                list(&known.iter().rev().take(best).copied().collect::<Vec<_>>()),
            ]);
        }
    }
    format!("\nBD-rate of {} against {}:\n{}", gip::NAME, anchor.name, table.finish())
}

/// The plot and the table of one metric on one set.
fn details(bench: &Bench, comparison: &Comparison, metric: Metric) -> Result<String> {
    Ok(format!(
        "\n### {}, {}\n\n![{0} over rate, {1}]({})\n{}",
        metric.name(),
        comparison.set.name,
        plot(bench, comparison, metric)?,
        table(bench, comparison, metric),
    ))
}

/// The mean level of a codec at a rate, or else how many pictures reach it.
fn mean_at(curves: &[Curve], rate: f64, metric: Metric) -> Result<f64, usize> {
    let reached: Vec<f64> = curves.iter().filter_map(|curve| curve.quality(rate)).collect();
    let all = reached.len() == curves.len();
    metric.mean(reached.iter().copied()).filter(|_| all).ok_or(reached.len())
}

/// Means over the pictures at exact rates, by interpolation of each picture's curve, as far as all
/// pictures reach.
pub(super) fn mean_levels(codec: &Codec, metric: Metric) -> Vec<(f64, f64)> {
    let curves = codec.curves(metric);
    let at = |&rate: &f64| Some((rate, mean_at(&curves, rate, metric).ok()?));
    PLOT_RATES.iter().filter_map(at).collect()
}

/// Means at equal rates and BD-rates by range, a row for each codec, and as figures for other texts.
fn table(bench: &Bench, comparison: &Comparison, metric: Metric) -> String {
    let set = comparison.set.name;
    let mut columns = vec![metric.with_unit().to_owned()];
    columns.extend(TABLE_RATES.map(|rate| format!("{rate} bpp")));
    columns.extend(RANGES.map(|range| format!("BD-rate of {}, {}", gip::NAME, range.title())));
    let mut table = Table::new(&columns);
    let mut ahead = RANGES.map(|_| Vec::new());
    for codec in comparison.codecs() {
        let (curves, mut cells) = (codec.curves(metric), vec![codec.name.to_owned()]);
        cells.extend(TABLE_RATES.map(|rate| match mean_at(&curves, rate, metric) {
            Ok(level) => {
                let figure = format!("{set}/{}/{}/{rate} bpp", metric.name(), codec.name);
                bench.figure(figure, metric.shown(level), "");
                metric.cell(level)
            }
            Err(reached) => format!("({reached}/{} reach)", curves.len()),
        }));
        for (range, ahead) in RANGES.into_iter().zip(&mut ahead) {
            if codec.id == comparison.ours.id {
                cells.push(String::new());
                continue;
            }
            let outcome = Outcome::of(&bd_rates(&comparison.ours, codec, metric, range));
            let figure = format!("{set}/BD/{}/{}/{}", metric.name(), codec.name, range.name);
            bench.figure(figure, 100.0 * outcome.mean.unwrap_or(f64::NAN), "%");
            if outcome.mean.is_some_and(|mean| mean > 0.0) {
                ahead.push(codec.name);
            }
            cells.push(outcome.cell(&comparison.set.pictures));
        }
        table.row(&cells);
    }
    let ahead = RANGES.iter().zip(&ahead).map(|(range, names)| {
        format!("at {} rates: {}", range.name, list_or_none(names.iter().copied()))
    });
    format!(
        "\nMean over the pictures at exactly these rates, by interpolation of each picture's curve, and \
         BD-rate: mean; pictures won; the worst picture.\n{}\nSmaller files than {} {}.\n",
        table.finish(),
        gip::NAME,
        ahead.collect::<Vec<_>>().join("; "),
    )
}

fn plot(bench: &Bench, comparison: &Comparison, metric: Metric) -> Result<String> {
    let set = &comparison.set;
    let name = format!("rate-{}-{}.svg", set.name, metric.name()).to_lowercase();
    let series = series(comparison, metric);
    let plot = Plot {
        title: &format!(
            "{}, mean over {} pictures: {}",
            metric.name(),
            set.pictures.len(),
            set.name
        ),
        x: ("bits per pixel", Scale::Logarithmic),
        y: (metric.with_unit(), Scale::Linear),
        legend: if metric.lower_is_better() { Corner::UpperRight } else { Corner::LowerRight },
    };
    plot.write(&bench.path(&name), &series)?;
    Ok(name)
}

/// The mean curves of the codecs that plots show: none of a codec of which no rate is reached by all
/// pictures. Each has its place and so its colour in the plots of all sets.
pub(super) fn series(comparison: &Comparison, metric: Metric) -> Vec<Series> {
    let series = PLOTTED.map(|name| {
        let codec = comparison.codecs().find(|codec| codec.name == name);
        let levels = codec.map_or_else(Vec::new, |codec| mean_levels(codec, metric));
        let points = levels.into_iter().map(|(rate, level)| (rate, metric.shown(level)));
        Series { name: name.to_owned(), points: points.collect() }
    });
    series.into()
}

/// Writes the BD-rates of each picture, in a CSV with a column for each other codec: those of the
/// first set, which has them all.
fn write_by_picture(bench: &Bench, comparisons: &[Comparison]) -> Result<()> {
    let path = bench.path(BY_PICTURE);
    let file = File::create(&path).with_context(|| format!("cannot write {}", path.display()))?;
    let mut csv = csv::Writer::from_writer(file);
    let others: Vec<&str> = comparisons[0].others.iter().map(|codec| codec.name).collect();
    csv.write_record(["set", "picture", "metric", "rates"].iter().chain(&others))?;
    for comparison in comparisons {
        for metric in Metric::ALL {
            for range in RANGES {
                let all = others.iter().map(|name| {
                    let other = comparison.other(name)?;
                    Some(bd_rates(&comparison.ours, other, metric, range))
                });
                let all: Vec<Option<Vec<Option<f64>>>> = all.collect();
                for (index, picture) in comparison.set.pictures.iter().enumerate() {
                    let key = [comparison.set.name, &picture.name, metric.name(), range.name];
                    let rates = all.iter().map(|rates| {
                        let rate = rates.as_ref().and_then(|rates| rates[index]);
                        rate.map_or_else(String::new, |rate| format!("{rate:.3}"))
                    });
                    csv.write_record(key.into_iter().map(str::to_owned).chain(rates))?;
                }
            }
        }
    }
    csv.flush()?;
    Ok(())
}
