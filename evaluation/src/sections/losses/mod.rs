//! Where our files are larger than those of the strongest other codec, and why.

mod kinds;
mod noise;
mod sheet;
mod source;

use anyhow::Result;

use super::comparisons::{Comparison, compare};
use super::ranges::{RANGES, bd_rates, short};
use super::rate_store::RateStore;
use crate::bench::Bench;
use crate::gip;
use crate::metric::Metric;
use crate::pictures::TestPicture;
use crate::table::{Table, percent};
use source::Source;

/// How many pictures are named for each metric.
const NAMED: usize = 6;

/// The indices of the ranges in the order in which one stands for a picture: middle, low, high.
const TELLING: [usize; RANGES.len()] = [1, 0, 2];

/// A picture with its BD-rates against the strongest other codec.
struct Case {
    picture: TestPicture,
    set: &'static str,
    content: String,
    source: Source,
    /// By metric and range.
    rates: [[Option<f64>; RANGES.len()]; Metric::ALL.len()],
}

impl Case {
    fn rate(&self, metric: Metric, range: usize) -> Option<f64> {
        let index = Metric::ALL.iter().position(|each| *each == metric);
        self.rates[index.expect("all metrics are there")][range]
    }

    /// The BD-rate at middle rates or, for screenshots whose files are smaller or larger, at others:
    /// the index of the range, and the BD-rate.
    fn telling(&self, metric: Metric) -> Option<(usize, f64)> {
        TELLING.into_iter().find_map(|range| Some((range, self.rate(metric, range)?)))
    }
}

pub(crate) fn measure(bench: &mut Bench) -> Result<String> {
    let mut store = RateStore::open(bench)?;
    let comparisons = compare(bench, &mut store)?;
    let anchor = comparisons[0].best_avif().name;
    let cases: Vec<Case> =
        comparisons.iter().flat_map(|comparison| cases(comparison, bench)).collect();
    let mut text = format!(
        "BD-rate of {} against {anchor} (the section about rate says what that is): above 0 our files are \
         larger. All sets, by what fills most of each picture.\n",
        gip::NAME,
    );
    text.push_str(&kinds::tables(&cases));
    text.push_str(&kinds::paragraphs(&cases));
    text.push_str(&noise::measure(bench, &mut store)?);
    text.push_str(&format!("\n### The largest losses\n{}", largest(&cases)));
    text.push_str(&sheet::make(bench, &cases)?);
    Ok(text)
}

fn cases(comparison: &Comparison, bench: &Bench) -> Vec<Case> {
    let (ours, anchor) = (&comparison.ours, comparison.best_avif());
    let rates = Metric::ALL.map(|metric| RANGES.map(|range| bd_rates(ours, anchor, metric, range)));
    let pictures = comparison.set.pictures.iter().enumerate();
    pictures
        .map(|(index, picture)| Case {
            set: comparison.set.name,
            content: bench.contents.of(&picture.name).to_owned(),
            source: Source::of(picture),
            rates: rates.each_ref().map(|of| of.each_ref().map(|rates| rates[index])),
            picture: picture.clone(),
        })
        .collect()
}

/// The pictures with the largest BD-rates by a metric, the largest first.
fn worst(cases: &[Case], metric: Metric) -> Vec<&Case> {
    let known = cases.iter().filter_map(|case| Some((case, case.telling(metric)?.1)));
    let mut known: Vec<(&Case, f64)> = known.collect();
    known.sort_by(|a, b| b.1.total_cmp(&a.1));
    known.into_iter().map(|(case, _)| case).collect()
}

/// The pictures that lose most by each metric.
fn largest(cases: &[Case]) -> String {
    let mut columns = vec!["metric, picture".to_owned(), "set".to_owned(), "content".to_owned()];
    columns.extend(RANGES.map(|range| range.title()));
    let mut table = Table::new(&columns);
    for metric in Metric::ALL {
        for case in worst(cases, metric).into_iter().take(NAMED) {
            let name = format!("{}, {}", metric.name(), short(&case.picture.name));
            let mut cells = vec![name, case.set.to_owned(), case.content.clone()];
            cells.extend((0..RANGES.len()).map(|range| percent(case.rate(metric, range))));
            table.row(&cells);
        }
    }
    format!(
        "\nThe {NAMED} pictures of all sets with the largest BD-rates by each metric, at middle rates or, where \
         there are none, at low or high ones.\n{}",
        table.finish()
    )
}

#[cfg(test)]
mod tests {
    use super::*;

    pub(super) fn case(name: &str, content: &str, middle: f64) -> Case {
        let rgb = vec![9; 3 * 64];
        let picture = TestPicture { name: name.into(), path: "".into(), width: 8, height: 8, rgb };
        let rates = Metric::ALL.map(|_| [None, Some(middle), Some(2.0 * middle)]);
        let source = Source::of(&picture);
        Case { picture, set: "Kodak", content: content.into(), source, rates }
    }

    #[test]
    fn the_worst_come_first() {
        let cases = [case("a", "text", 0.1), case("b", "face", -0.2), case("c", "text", 0.3)];
        let worst = worst(&cases, Metric::Cvvdp);
        let names: Vec<&str> = worst.iter().map(|case| case.picture.name.as_str()).collect();
        assert_eq!(names, ["c", "a", "b"]);
        assert_eq!(TELLING.map(|range| RANGES[range].name), ["middle", "low", "high"]);
        let mut high_alone = case("d", "text", 0.1);
        high_alone.rates = Metric::ALL.map(|_| [None, None, Some(0.7)]);
        assert_eq!(high_alone.telling(Metric::Psnr), Some((2, 0.7)));
        let text = largest(&cases);
        assert!(text.contains("| PSNR, c | Kodak | text | - | +30.0 % | +60.0 % |"), "{text}");
    }
}
