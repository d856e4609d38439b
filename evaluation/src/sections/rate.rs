//! Rate and distortion: curves, tables at equal rates, and mean differences in rate.

use anyhow::Result;

use super::codec_curves::{Codec, OURS};
use super::rate_store::RateStore;
use super::reference;
use crate::baselines::{BASELINES, BEST_AVIF, Baseline, DESCRIPTION};
use crate::bench::Bench;
use crate::comparison::{Better, NamedFigures, better_than, list_or_none};
use crate::curve::bd_rate;
use crate::metric::Metric;
use crate::pictures::PictureSet;
use crate::plot::{Corner, Plot, Scale, Series};
use crate::table::{Table, mean, percent};

/// Rates that the tables show, in bits per pixel.
const TABLE_RATES: [f64; 6] = [0.15, 0.25, 0.35, 0.5, 0.75, 1.0];
/// The range of rates for BD-rates and plots.
const BD_RANGE: (f64, f64) = (0.15, 1.5);

/// The pictures on which we are compared with the best that AVIF can do: half of them hard for us.
const HARD_PICTURES: [&str; 6] =
    ["kodim04", "kodim05", "kodim08", "kodim13", "city-lossless", "girl-lossless"];

/// Codecs on one set of pictures.
struct Comparison {
    set: PictureSet,
    /// [`OURS`].
    ours: Vec<Codec>,
    baselines: Vec<Codec>,
}

impl Comparison {
    /// Our default first.
    fn codecs(&self) -> Vec<&Codec> {
        self.ours.iter().chain(&self.baselines).collect()
    }
}

pub(crate) fn measure(bench: &mut Bench) -> Result<String> {
    let mut store = RateStore::open(bench)?;
    let comparisons = compare(bench, &mut store, bench.sets(), &BASELINES.each_ref())?;
    let mut text = introduction();
    if let Some(path) = &bench.reference {
        let kodak = &comparisons[0];
        text.push_str(&reference::compare(path, &kodak.set.pictures, &kodak.baselines)?);
    }
    text.push_str(&format!("\n### In short\n{}", summary(&comparisons)));
    if let Some(set) = hard_pictures(bench) {
        let mut baselines: Vec<_> =
            BASELINES.iter().filter(|baseline| baseline.name.starts_with("AVIF")).collect();
        baselines.push(&BEST_AVIF);
        let comparisons = compare(bench, &mut store, vec![set], &baselines)?;
        text.push_str(&against_best_avif(&comparisons));
    }
    for comparison in &comparisons {
        for metric in Metric::ALL {
            text.push_str(&details(bench, comparison, metric)?);
        }
    }
    Ok(text)
}

/// Those of [`HARD_PICTURES`] that are there. A quick run has no time for them.
fn hard_pictures(bench: &Bench) -> Option<PictureSet> {
    let all = bench.sets().into_iter().flat_map(|set| set.pictures);
    let hard = all.filter(|picture| HARD_PICTURES.contains(&picture.name.as_str()));
    let set = PictureSet { name: "hard pictures", pictures: hard.collect() };
    (!bench.quick && !set.pictures.is_empty()).then_some(set)
}

fn introduction() -> String {
    let ours = OURS.each_ref().map(|variant| variant.name);
    format!(
        "Compared with: {DESCRIPTION} Ours ({}) is asked for: {}. SSIMULACRA2 is 100 for equal pictures; 90 \
         is hard to tell from the source, 70 is high quality, 50 medium, 30 low. Butteraugli is \
         its 3-norm at 80 nits: lower is better. Both equal what the tools of libjxl 0.11 print. \
         CVVDP is ColorVideoVDP for a monitor of 24 inches at 60 cm (standard_fhd), in JOD: 10 for \
         equal pictures; of two that are 1 apart, three in four people choose the one with more. \
         BD-rate is from {} to {} bits per pixel: how much larger (+) or smaller (-) our files are \
         at equal quality.\n",
        ours.join(", "),
        OURS[0].settings().join("; "),
        BD_RANGE.0,
        BD_RANGE.1,
    )
}

/// Ours and some baselines measured on sets. What matters most comes first, so that a run that is
/// interrupted has it: our default and the baselines on all sets.
fn compare(
    bench: &mut Bench,
    store: &mut RateStore,
    sets: Vec<PictureSet>,
    baselines: &[&Baseline],
) -> Result<Vec<Comparison>> {
    let (quick, product) = (bench.quick, bench.product.clone());
    let (worker, versions) = bench.baselines()?;
    let [default, variants @ ..] = OURS;
    let mut comparisons = Vec::new();
    for set in sets {
        let ours = vec![Codec::ours(store, &product, &default, &set.pictures, quick)?];
        let baselines = baselines.iter().map(|baseline| {
            Codec::baseline(store, worker, &versions, baseline, &set.pictures, quick)
        });
        let baselines = baselines.collect::<Result<_>>()?;
        comparisons.push(Comparison { set, ours, baselines });
    }
    for Comparison { set, ours, .. } in &mut comparisons {
        for variant in &variants {
            ours.push(Codec::ours(store, &product, variant, &set.pictures, quick)?);
        }
    }
    Ok(comparisons)
}

/// For each picture the BD-rate of one codec against another; `None` where they have no quality in
/// common.
fn bd_rates(test: &Codec, anchor: &Codec, metric: Metric) -> Vec<Option<f64>> {
    let curves = anchor.curves(metric).into_iter().zip(test.curves(metric));
    curves.map(|(anchor, test)| bd_rate(&anchor, &test, BD_RANGE)).collect()
}

/// Mean BD-rates of each of ours: a row for each metric and set, a column for each baseline. All
/// sets have the same codecs.
fn summary(comparisons: &[Comparison]) -> String {
    let mut text = String::from("\nMean BD-rate over the pictures:\n");
    for (index, ours) in OURS.iter().enumerate() {
        let mut columns = vec![ours.name.to_owned()];
        columns.extend(
            comparisons[0].baselines.iter().map(|baseline| format!("against {}", baseline.name)),
        );
        let mut table = Table::new(&columns);
        for metric in Metric::ALL {
            for Comparison { set, ours, baselines } in comparisons {
                let mut cells = vec![format!("{}, {}", metric.name(), set.name)];
                cells.extend(baselines.iter().map(|other| {
                    percent(mean(bd_rates(&ours[index], other, metric).into_iter().flatten()))
                }));
                table.row(&cells);
            }
        }
        text.push_str(&table.finish());
    }
    text
}

fn against_best_avif(comparisons: &[Comparison]) -> String {
    let pictures = comparisons[0].set.pictures.iter().map(|picture| picture.name.as_str());
    let mut text = format!(
        "\n### The best that AVIF can do\n\nSpeed 0 takes up to half a minute for a picture, so it \
         is measured on a few, of which half are hard for us: {}.\n{}",
        pictures.collect::<Vec<_>>().join(", "),
        summary(comparisons),
    );
    for metric in Metric::ALL {
        text.push_str(&bd_rate_table(&comparisons[0], metric));
    }
    text
}

/// The plot and the tables of one metric on one set.
fn details(bench: &Bench, comparison: &Comparison, metric: Metric) -> Result<String> {
    Ok(format!(
        "\n### {}, {}\n\n![{0} over rate, {1}]({})\n{}{}",
        metric.name(),
        comparison.set.name,
        plot(bench, comparison, metric)?,
        at_equal_rates(&comparison.codecs(), metric),
        bd_rate_table(comparison, metric),
    ))
}

/// A table with one row per codec and one column per rate, followed by the codecs that are better
/// than ours and at which rates.
fn at_equal_rates(codecs: &[&Codec], metric: Metric) -> String {
    let names = TABLE_RATES.map(|rate| format!("{rate} bpp"));
    let mut columns = vec![metric.with_unit().to_owned()];
    columns.extend(names.clone());
    let mut table = Table::new(&columns);
    let mut compared: Vec<NamedFigures> = Vec::new();
    for codec in codecs {
        let curves = codec.curves(metric);
        let (mut cells, mut levels) = (vec![codec.name.to_owned()], Vec::new());
        for rate in TABLE_RATES {
            let reached: Vec<f64> = curves.iter().filter_map(|curve| curve.quality(rate)).collect();
            let all = reached.len() == curves.len();
            let level = metric.mean(reached.iter().copied()).filter(|_| all);
            let missing = || format!("({}/{} reach)", reached.len(), curves.len());
            cells.push(level.map_or_else(missing, |level| metric.cell(level)));
            levels.push(level.unwrap_or(f64::NAN));
        }
        table.row(&cells);
        compared.push((codec.name.to_owned(), levels));
    }
    let figures = names.each_ref().map(|name| (name.as_str(), Better::Higher));
    format!(
        "\nMean over the pictures at equal rates: the curve of each picture is interpolated at \
         exactly this rate. There is no mean where the curves of some pictures do not reach the \
         rate.\n{}{}",
        table.finish(),
        better_than(&figures, &compared[0], &compared[1..])
    )
}

/// BD-rates of ours against all others, for each picture and on average.
fn bd_rate_table(comparison: &Comparison, metric: Metric) -> String {
    let codecs = comparison.codecs();
    let (ours, others) = (codecs[0], &codecs[1..]);
    let mut columns = vec!["picture"];
    columns.extend(others.iter().map(|codec| codec.name));
    let mut table = Table::new(&columns);
    let all: Vec<_> = others.iter().map(|other| bd_rates(ours, other, metric)).collect();
    for (index, picture) in comparison.set.pictures.iter().enumerate() {
        let mut cells = vec![picture.name.clone()];
        cells.extend(all.iter().map(|rates| percent(rates[index])));
        table.row(&cells);
    }
    let means: Vec<_> = all.iter().map(|rates| mean(rates.iter().copied().flatten())).collect();
    let mut cells = vec!["**mean**".to_owned()];
    cells.extend(means.iter().map(|&mean| percent(mean)));
    table.row(&cells);
    let mut cells = vec!["**of the mean curves**".to_owned()];
    cells.extend(others.iter().map(|other| {
        percent(bd_rate(&other.mean_curve(metric), &ours.mean_curve(metric), BD_RANGE))
    }));
    table.row(&cells);

    let named = |worse: bool| {
        let means = others.iter().zip(&means);
        let of_kind = means.filter(move |(_, mean)| mean.is_some_and(|m| (m > 0.0) == worse));
        list_or_none(of_kind.map(|(codec, _)| codec.name))
    };
    format!(
        "\nBD-rate of {} at equal {}:\n{}\nIt is worse than: {}. It is better than: {}.\n",
        ours.name,
        metric.name(),
        table.finish(),
        named(true),
        named(false),
    )
}

fn plot(bench: &Bench, comparison: &Comparison, metric: Metric) -> Result<String> {
    let set = &comparison.set;
    let name = format!("rate-{}-{}.svg", set.name, metric.name()).to_lowercase();
    let series: Vec<Series> = comparison
        .codecs()
        .into_iter()
        .map(|codec| Series {
            name: codec.name.to_owned(),
            points: codec
                .mean_curve(metric)
                .points()
                .filter(|(rate, _)| (BD_RANGE.0 * 0.8..=BD_RANGE.1 * 1.2).contains(rate))
                .map(|(rate, level)| (rate, metric.shown(level)))
                .collect(),
        })
        .collect();
    let plot = Plot {
        title: &format!(
            "{}, mean over {} pictures: {}",
            metric.name(),
            set.pictures.len(),
            set.name
        ),
        x: ("bits per pixel", Scale::Linear),
        y: (metric.with_unit(), Scale::Linear),
        legend: if metric.lower_is_better() { Corner::UpperRight } else { Corner::LowerRight },
    };
    plot.write(&bench.path(&name), &series)?;
    Ok(name)
}
