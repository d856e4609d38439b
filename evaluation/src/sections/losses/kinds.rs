//! Losses by what pictures show.

use super::case::Case;
use super::source::{EDGE, Source};
use crate::contents::RENDERED;
use crate::metric::Metric;
use crate::sections::ranges::{Outcome, RANGES, short};
use crate::table::{Table, mean, percent};

/// Classes of content with their names, and what each is likely to be to a codec of Gaussians. The
/// figures beside it are made.
pub(super) const KINDS: [(&str, &str, &str); 6] = [
    (
        "text",
        "Text",
        "A Gaussian has no edge. The rim of a stroke is a step of one pixel between two flat \
         colours, and takes several thin Gaussians that cancel each other outside of it, for every \
         stroke anew; letters that repeat cost the same each time. A codec of blocks can copy a letter \
         from where it was before and name the few colours of a block, and its cost ends with the block.",
    ),
    (
        RENDERED,
        "Rendered scenes",
        "A game's landscapes under haze and soft light: large smooth areas without the grain of a sensor, \
         between edges that are sharp and mostly straight.",
    ),
    (
        "textured",
        "Foliage, gravel, water",
        "Leaves and waves are many small shapes with nothing in common, each of which would need a \
         Gaussian or several. Below the rate at which they get them, our texture stands in for them: it \
         has their strength and size, not their places, which metrics that compare pixel by pixel \
         count as an error and the section about texture measures apart.",
    ),
    (
        "face",
        "Faces",
        "Skin is smooth, and a few large Gaussians show it without the edges of blocks; what counts are \
         eyes, lashes and hair, which are as costly as other fine detail, and the background, which is \
         often out of focus and cheap.",
    ),
    (
        "building",
        "Buildings",
        "Straight edges at any angle are what long Gaussians are good at; rows of equal windows and \
         bricks are what they cannot repeat.",
    ),
    (
        "smooth",
        "Smooth scenes",
        "Skies, haze and blurred backgrounds need few Gaussians, whatever their number of pixels.",
    ),
];

/// The cases of a class.
fn of_kind<'a>(cases: &'a [Case], kind: &str) -> Vec<&'a Case> {
    cases.iter().filter(|case| case.content == kind).collect()
}

/// The BD-rates of some cases in a few numbers.
fn outcome(cases: &[&Case], metric: Metric, range: usize) -> Outcome {
    Outcome::of(&cases.iter().map(|case| case.rate(metric, range)).collect::<Vec<_>>())
}

/// Mean figures of the sources of some cases.
fn sources(cases: &[&Case]) -> [f64; 3] {
    let of = |index: usize| mean(cases.iter().map(|case| case.source.values()[index]));
    [0, 1, 2].map(|index| of(index).unwrap_or(f64::NAN))
}

/// BD-rates by content, a table for each range, and what goes with them.
pub(super) fn tables(cases: &[Case]) -> String {
    let mut text = String::from("\n### By content\n");
    for (index, range) in RANGES.iter().enumerate() {
        let mut columns = vec![range.title(), "pictures".to_owned()];
        columns.extend(Metric::ALL.map(|metric| metric.name().to_owned()));
        let mut table = Table::new(&columns);
        for (kind, name, _) in KINDS {
            let cases = of_kind(cases, kind);
            if cases.is_empty() {
                continue;
            }
            let mut cells = vec![name.to_owned(), cases.len().to_string()];
            cells.extend(Metric::ALL.map(|metric| {
                let outcome = outcome(&cases, metric, index);
                format!("{} ({}/{})", percent(outcome.mean), outcome.won, outcome.compared)
            }));
            table.row(&cells);
        }
        text.push_str(&table.finish());
    }
    text.push_str(&correlations(cases));
    text
}

/// How the BD-rate goes with figures of the source.
fn correlations(cases: &[Case]) -> String {
    let mut columns = vec!["rank correlation of the BD-rate with".to_owned()];
    columns.extend(Source::NAMES.map(str::to_owned));
    let mut table = Table::new(&columns);
    for metric in Metric::ALL {
        let mut cells = vec![metric.name().to_owned()];
        let known = cases.iter().filter_map(|case| Some((case.telling(metric)?.1, case.source)));
        let (rates, known): (Vec<f64>, Vec<Source>) = known.unzip();
        cells.extend([0, 1, 2].map(|index| {
            let figures: Vec<f64> = known.iter().map(|source| source.values()[index]).collect();
            format!("{:+.2}", rank_correlation(&rates, &figures))
        }));
        table.row(&cells);
    }
    format!(
        "\nMean, and in brackets the pictures won. *Flat*: the share of pixels that equal their right and \
         lower neighbours; *edges*: that of pixels whose luma differs from one of these by {EDGE} levels or more; \
         *grain*: the median strength of the finest detail, in levels. Above 0: the more of it, the \
         larger our files are beside the others', at middle rates or, where there are none, at low or high \
         ones.\n{}",
        table.finish()
    )
}

/// Spearman's: of the ranks, equal values having their mean rank. NaN if all of either are equal.
fn rank_correlation(a: &[f64], b: &[f64]) -> f64 {
    let ranks = |values: &[f64]| -> Vec<f64> {
        let rank = |value: &f64| {
            let below = values.iter().filter(|other| *other < value).count();
            let equal = values.iter().filter(|other| *other == value).count();
            below as f64 + (equal as f64 - 1.0) / 2.0
        };
        let ranks: Vec<f64> = values.iter().map(rank).collect();
        let middle = mean(ranks.iter().copied()).unwrap_or(f64::NAN);
        ranks.into_iter().map(|rank| rank - middle).collect()
    };
    let (a, b) = (ranks(a), ranks(b));
    let product = |a: &[f64], b: &[f64]| a.iter().zip(b).map(|(a, b)| a * b).sum::<f64>();
    product(&a, &b) / (product(&a, &a) * product(&b, &b)).sqrt()
}

/// A paragraph for each class of content: its figures, and what the class is to the codec.
pub(super) fn paragraphs(cases: &[Case]) -> String {
    let mut text = String::from(
        "\n### Why\n\nThe figures are measured. What follows them in a paragraph is how we explain them, and \
         was not measured apart.\n",
    );
    for (kind, name, why) in KINDS {
        let cases = of_kind(cases, kind);
        if cases.is_empty() {
            continue;
        }
        let [flat, edges, grain] = sources(&cases);
        let ranges = RANGES.iter().enumerate().filter_map(|(index, range)| {
            let of = |metric| outcome(&cases, metric, index);
            let (seen, squared) = (of(Metric::Ssimulacra2), of(Metric::Psnr));
            let found = seen.compared + squared.compared > 0;
            let figures = format!(
                "at {} rates {} by SSIMULACRA2 ({} of {} won) and {} by PSNR ({})",
                range.name,
                percent(seen.mean),
                seen.won,
                seen.compared,
                percent(squared.mean),
                squared.won,
            );
            found.then_some(figures)
        });
        let ranges: Vec<String> = ranges.collect();
        text.push_str(&format!(
            "\n**{name}** (pictures: {}; {:.0} % flat, {:.1} % edges, grain {grain:.1}): {}. {}{why}\n",
            cases.len(),
            100.0 * flat,
            100.0 * edges,
            ranges.join(", "),
            worst(&cases),
        ));
    }
    text
}

/// A sentence about the picture with the largest BD-rate of all metrics and ranges, if it is lost.
fn worst(cases: &[&Case]) -> String {
    let all = cases.iter().flat_map(|case| {
        Metric::ALL.into_iter().flat_map(move |metric| {
            let ranges = RANGES.iter().enumerate();
            ranges.filter_map(move |(index, range)| {
                Some((*case, metric, range, case.rate(metric, index)?))
            })
        })
    });
    match all.max_by(|a, b| a.3.total_cmp(&b.3)) {
        Some((case, metric, range, rate)) if rate > 0.0 => format!(
            "The largest loss is {}, {} by {} at {} rates. ",
            short(&case.picture.name),
            percent(Some(rate)),
            metric.name(),
            range.name,
        ),
        _ => "No picture is lost. ".to_owned(),
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::sections::losses::case::tests::case;

    #[test]
    fn rank_correlations_follow_the_order_alone() {
        assert_eq!(rank_correlation(&[1.0, 2.0, 9.0], &[0.1, 0.2, 0.3]), 1.0);
        assert_eq!(rank_correlation(&[1.0, 2.0, 9.0], &[3.0, 2.0, -5.0]), -1.0);
        // By hand: ranks 0, 1.5, 1.5, 3 against 0, 1, 2, 3.
        let tied = rank_correlation(&[1.0, 2.0, 2.0, 4.0], &[1.0, 2.0, 3.0, 4.0]);
        assert!((tied - 4.5 / (4.5_f64 * 5.0).sqrt()).abs() < 1e-12, "{tied}");
        assert!(rank_correlation(&[1.0, 1.0], &[1.0, 2.0]).is_nan());
    }

    #[test]
    fn a_paragraph_has_the_figures_of_its_class() {
        let cases = [case("a", "text", 0.5), case("b", "text", -0.1), case("c", "face", -0.2)];
        let text = paragraphs(&cases);
        assert!(text.contains("**Text** (pictures: 2; 100 % flat"), "{text}");
        assert!(text.contains("at middle rates +20.0 % by SSIMULACRA2 (1 of 2 won)"), "{text}");
        assert!(text.contains("The largest loss is a, +100.0 % by PSNR at high"), "{text}");
        let faces = text.split("**Faces**").nth(1).expect("it is there");
        assert!(faces.contains("No picture is lost."), "{faces}");
        assert!(!text.contains("**Rendered scenes**"), "{text}");
        assert!(tables(&cases).contains("| Text | 2 | +20.0 % (1/2) |"), "{}", tables(&cases));
    }
}
