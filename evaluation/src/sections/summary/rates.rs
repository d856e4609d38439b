//! Sizes of files at equal quality, in short.

use anyhow::Result;

use crate::bench::Bench;
use crate::contents::{Contents, RENDERED};
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

/// The pictures of a set that a claim is about.
struct Part<'a> {
    comparison: &'a Comparison,
    /// Their indices.
    pictures: Vec<usize>,
}

/// Photographs, which rendered pictures among them are not, and others.
fn parted<'a>(contents: &Contents, comparisons: &'a [Comparison]) -> [Vec<Part<'a>>; 2] {
    let part = |comparison: &'a Comparison| {
        let pictures = comparison.set.pictures.iter().enumerate();
        let pictures = pictures.filter(|(_, picture)| contents.of(&picture.name) != RENDERED);
        Part { comparison, pictures: pictures.map(|(index, _)| index).collect() }
    };
    let (photographs, others): (Vec<_>, Vec<_>) =
        comparisons.iter().partition(|comparison| comparison.set.name != "screens");
    [photographs, others].map(|comparisons| comparisons.into_iter().map(part).collect())
}

/// A list of claims.
pub(super) fn claims(bench: &Bench, comparisons: &[Comparison]) -> String {
    let [photographs, others] = parted(&bench.contents, comparisons);
    let anchor = comparisons[0].best_avif().name;
    let mut text = String::new();
    for range in RANGES {
        text.push_str(&format!(
            "- **Photographs at {} rates** ({} to {} bits per pixel): {}.\n",
            range.name,
            range.rates.0,
            range.rates.1,
            by_metric(&photographs, anchor, range),
        ));
    }
    if !others.is_empty() {
        let each = RANGES.map(|range| {
            let (outcome, _) = of(&others, anchor, METRIC, range);
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
    text.push_str(&format!("- {}\n", lost(&photographs, anchor)));
    text
}

/// The table of all codecs, and two plots.
pub(super) fn pictures(bench: &Bench, comparisons: &[Comparison]) -> Result<String> {
    let [photographs, _] = parted(&bench.contents, comparisons);
    let anchor = comparisons[0].best_avif().name;
    Ok(format!(
        "\nHow much larger (+) or smaller (-) our files of photographs are at equal {}: the mean, the median, and \
         pictures won of those with a quality in common. Rendered scenes are not photographs; not every codec was \
         measured on every set, so rows with other numbers of pictures are of other pictures.\n{}\n![Quality over rate]({})\n\n![Every photograph]({})\n",
        METRIC.name(),
        table(&photographs),
        curves(bench, comparisons)?,
        every_photograph(bench, &photographs, anchor)?
    ))
}

/// The BD-rates of all pictures of some sets against the codec of a name, with their names.
fn of<'a>(
    parts: &[Part<'a>],
    name: &str,
    metric: Metric,
    range: Range,
) -> (Outcome, Vec<(&'a str, Option<f64>)>) {
    let mut all = Vec::new();
    for &Part { comparison, ref pictures } in parts {
        let Some(other) = comparison.other(name) else { continue };
        let rates = bd_rates(&comparison.ours, other, metric, range);
        let name = |index: usize| short(&comparison.set.pictures[index].name);
        all.extend(pictures.iter().map(|&index| (name(index), rates[index])));
    }
    let rates: Vec<Option<f64>> = all.iter().map(|(_, rate)| *rate).collect();
    (Outcome::of(&rates), all)
}

/// The mean, the median and the pictures won, by each metric.
fn by_metric(photographs: &[Part<'_>], anchor: &str, range: Range) -> String {
    let each = Metric::ALL.map(|metric| {
        let (outcome, _) = of(photographs, anchor, metric, range);
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
fn lost(photographs: &[Part<'_>], anchor: &str) -> String {
    let each = Metric::ALL.into_iter().flat_map(|metric| RANGES.map(|range| (metric, range)));
    let each = each.map(|(metric, range)| {
        let (_, rates) = of(photographs, anchor, metric, range);
        (metric, range, rates)
    });
    let each: Vec<_> = each.collect();
    let count = each[0].2.len();
    let middle = each.iter().filter(|(_, range, _)| range.name == MIDDLE.name);
    let is_lost =
        |index: usize, rates: &[(&str, Option<f64>)]| rates[index].1.is_some_and(|rate| rate > 0.0);
    let mut lost: Vec<usize> = (0..count).collect();
    middle.for_each(|(.., rates)| lost.retain(|&index| is_lost(index, rates)));
    let all = each.iter().flat_map(|(metric, range, rates)| {
        rates.iter().filter_map(move |(name, rate)| Some((name, metric, range, (*rate)?)))
    });
    let worst = match all.max_by(|a, b| a.3.total_cmp(&b.3)) {
        Some((name, metric, range, rate)) => format!(
            "; the largest BD-rate is {}, of {name} by {} at {} rates",
            percent(Some(rate)),
            metric.name(),
            range.name
        ),
        None => String::new(),
    };
    format!(
        "**Where we lose**: {} of {count} photographs are larger than {anchor} by all metrics at middle rates{worst}.",
        lost.len()
    )
}

/// A row for each of the other codecs, a column for each range.
fn table(photographs: &[Part<'_>]) -> String {
    let mut columns = vec![format!("{} against", gip::NAME)];
    columns.extend(RANGES.map(|range| range.title()));
    let mut table = Table::new(&columns);
    let rivals =
        photographs[0].comparison.others.iter().filter(|codec| !codec.name.starts_with(gip::NAME));
    for Codec { name, .. } in rivals {
        let mut cells = vec![(*name).to_owned()];
        cells.extend(RANGES.map(|range| {
            let (outcome, _) = of(photographs, name, METRIC, range);
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
fn every_photograph(bench: &Bench, photographs: &[Part<'_>], anchor: &str) -> Result<&'static str> {
    let series = Metric::ALL.map(|metric| {
        let of_ranges = RANGES.map(|range| of(photographs, anchor, metric, range).1);
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
