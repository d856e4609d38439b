//! Sizes of files at equal quality, in short.

use anyhow::Result;

use crate::bench::Bench;
use crate::contents::RENDERED;
use crate::gip;
use crate::metric::Metric;
use crate::plot::{Corner, Plot, Scale, Series};
use crate::sections::codec_curves::Codec;
use crate::sections::comparisons::Comparison;
use crate::sections::ranges::{MIDDLE, Outcome, RANGES, Range, bd_rates, short};
use crate::sections::rate;
use crate::table::{Table, mean, percent};

/// The metric of the plot and the table.
const METRIC: Metric = Metric::Ssimulacra2;
const CURVES: &str = "summary-curves.svg";
const PICTURES: &str = "summary-pictures.svg";

/// Sets of photographs, and others.
fn parted(comparisons: &[Comparison]) -> (Vec<&Comparison>, Vec<&Comparison>) {
    comparisons.iter().partition(|comparison| comparison.set.name != "screens")
}

/// A list of claims.
pub(super) fn claims(bench: &Bench, comparisons: &[Comparison]) -> String {
    let (photographs, others) = parted(comparisons);
    let anchor = comparisons[0].best_avif().name;
    let mut text = String::new();
    for range in RANGES {
        text.push_str(&format!(
            "- **Photographs at {} rates** ({} to {} bits per pixel): {}.\n",
            range.name,
            range.rates.0,
            range.rates.1,
            by_metric(bench, &photographs, anchor, range),
        ));
    }
    if !others.is_empty() {
        let each = RANGES.map(|range| {
            let (outcome, _) = of(bench, &others, anchor, METRIC, range);
            let Outcome { mean, won, compared, .. } = outcome;
            if compared == 0 {
                return format!("nothing to compare at {} rates", range.name);
            }
            format!("{} at {} rates ({won} of {compared} won)", percent(mean), range.name)
        });
        text.push_str(&format!(
            "- **Screenshots**: our files against {anchor}, at equal {}: {}.\n",
            METRIC.name(),
            each.join(", "),
        ));
    }
    text.push_str(&format!("- {}\n", lost(bench, &photographs, anchor)));
    text
}

/// The table of all codecs, and two plots.
pub(super) fn pictures(bench: &Bench, comparisons: &[Comparison]) -> Result<String> {
    let (photographs, _) = parted(comparisons);
    let anchor = comparisons[0].best_avif().name;
    Ok(format!(
        "\nHow much larger (+) or smaller (-) our files of photographs are at equal {}: the mean, the median, and \
         pictures won of those with a quality in common. Rendered scenes are not photographs; not every codec was \
         measured on every set, so rows with other numbers of pictures are of other pictures.\n{}\n![Quality over rate]({})\n\n![Every photograph]({})\n",
        METRIC.name(),
        table(bench, &photographs),
        curves(bench, comparisons)?,
        every_photograph(bench, &photographs, anchor)?
    ))
}

/// The BD-rates of all pictures of some sets, but those that are rendered, against the codec of a name,
/// with their names.
fn of<'a>(
    bench: &Bench,
    comparisons: &[&'a Comparison],
    name: &str,
    metric: Metric,
    range: Range,
) -> (Outcome, Vec<(&'a str, Option<f64>)>) {
    let mut all = Vec::new();
    for comparison in comparisons {
        let Some(other) = comparison.other(name) else { continue };
        let rates = bd_rates(&comparison.ours, other, metric, range);
        let names = comparison.set.pictures.iter().map(|picture| short(&picture.name));
        let named = names.zip(rates).zip(&comparison.set.pictures);
        let photographs = named.filter(|(_, picture)| bench.contents.of(&picture.name) != RENDERED);
        all.extend(photographs.map(|(named, _)| named));
    }
    let rates: Vec<Option<f64>> = all.iter().map(|(_, rate)| *rate).collect();
    (Outcome::of(&rates), all)
}

/// The mean, the median and the pictures won, by each metric.
fn by_metric(bench: &Bench, photographs: &[&Comparison], anchor: &str, range: Range) -> String {
    let each = Metric::ALL.map(|metric| {
        let (outcome, _) = of(bench, photographs, anchor, metric, range);
        let Outcome { mean, median, won, compared, .. } = outcome;
        format!(
            "{} {} (median {}, {won} of {compared} won)",
            metric.name(),
            percent(mean),
            percent(median),
        )
    });
    format!("our files against {anchor}, at equal quality: {}", each.join(", "))
}

/// The photographs that are lost by all metrics at middle rates, and the largest loss at any rates.
fn lost(bench: &Bench, photographs: &[&Comparison], anchor: &str) -> String {
    let all = Metric::ALL.map(|metric| of(bench, photographs, anchor, metric, MIDDLE).1);
    let lost = |index: usize| all.iter().all(|of| of[index].1.is_some_and(|rate| rate > 0.0));
    let count = (0..all[0].len()).filter(|&index| lost(index)).count();
    let mut worst: Option<(f64, String)> = None;
    for (metric, range) in Metric::ALL.into_iter().flat_map(|m| RANGES.map(|range| (m, range))) {
        for (name, rate) in of(bench, photographs, anchor, metric, range).1 {
            let Some(rate) = rate else { continue };
            if worst.as_ref().is_none_or(|(largest, _)| rate > *largest) {
                let what = format!("of {name} by {} at {} rates", metric.name(), range.name);
                worst = Some((rate, what));
            }
        }
    }
    let worst = worst.map_or_else(String::new, |(rate, what)| {
        format!("; the largest BD-rate is {}, {what}", percent(Some(rate)))
    });
    format!(
        "**Where we lose**: {count} of {} photographs are larger than {anchor} by all metrics at middle rates{worst}.",
        all[0].len()
    )
}

/// A row for each of the other codecs, a column for each range.
fn table(bench: &Bench, photographs: &[&Comparison]) -> String {
    let mut columns = vec![format!("{} against", gip::NAME)];
    columns.extend(RANGES.map(|range| range.title()));
    let mut table = Table::new(&columns);
    let rivals = photographs[0].others.iter().filter(|codec| !codec.name.starts_with(gip::NAME));
    for Codec { name, .. } in rivals {
        let mut cells = vec![(*name).to_owned()];
        cells.extend(RANGES.map(|range| {
            let (outcome, _) = of(bench, photographs, name, METRIC, range);
            let [mean, median] = [outcome.mean, outcome.median].map(percent);
            format!("{mean}; {median}; {}/{}", outcome.won, outcome.compared)
        }));
        table.row(&cells);
    }
    table.finish()
}

/// The curves of the first set.
fn curves(bench: &Bench, comparisons: &[Comparison]) -> Result<&'static str> {
    let first = &comparisons[0];
    let plot = Plot {
        title: &format!(
            "{}, {}: mean over {} pictures",
            METRIC.name(),
            first.set.name,
            first.set.pictures.len()
        ),
        x: ("bits per pixel", Scale::Logarithmic),
        y: (METRIC.with_unit(), Scale::Linear),
        legend: Corner::LowerRight,
    };
    plot.write(&bench.path(CURVES), &rate::series(first, METRIC))?;
    Ok(CURVES)
}

/// The mean BD-rate over all ranges of every photograph, in order, by each metric.
fn every_photograph(
    bench: &Bench,
    photographs: &[&Comparison],
    anchor: &str,
) -> Result<&'static str> {
    let series = Metric::ALL.map(|metric| {
        let of_ranges = RANGES.map(|range| of(bench, photographs, anchor, metric, range).1);
        let of_picture = |index: usize| mean(of_ranges.iter().filter_map(|of| of[index].1));
        let mut rates: Vec<f64> = (0..of_ranges[0].len()).filter_map(of_picture).collect();
        rates.sort_by(f64::total_cmp);
        let points = rates.iter().enumerate();
        let points = points.map(|(index, rate)| ((index + 1) as f64, 100.0 * rate)).collect();
        Series { name: metric.name().to_owned(), points }
    });
    let plot = Plot {
        title: &format!(
            "Every photograph against {anchor}, from best to worst: mean over all rates"
        ),
        x: ("photographs", Scale::Linear),
        y: ("BD-rate in %", Scale::Linear),
        legend: Corner::UpperLeft,
    };
    plot.write(&bench.path(PICTURES), &series)?;
    Ok(PICTURES)
}
