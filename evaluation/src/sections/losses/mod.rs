//! Where our files are larger than those of the strongest other codec, and why.

mod kinds;
mod noise;
mod sheet;
mod source;

use anyhow::Result;

use super::comparisons::{Comparison, compare};
use super::ranges::{MIDDLE, RANGES, bd_rates, short};
use super::rate_store::RateStore;
use crate::bench::Bench;
use crate::gip;
use crate::metric::Metric;
use crate::pictures::TestPicture;
use crate::table::{Table, percent};
use source::Source;

/// How many pictures are named for each metric.
const NAMED: usize = 6;

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
    text.push_str(&sheet::make(bench, &worst(&cases, sheet::OF_EACH))?);
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

/// For each metric so many pictures with the largest BD-rates at middle rates, the largest first.
fn worst(cases: &[Case], count: usize) -> Vec<(Metric, Vec<&Case>)> {
    let middle = RANGES.iter().position(|range| range.name == MIDDLE.name).expect("it is there");
    let of_metric = |metric: Metric| {
        let known = cases.iter().filter_map(|case| Some((case, case.rate(metric, middle)?)));
        let mut known: Vec<(&Case, f64)> = known.collect();
        known.sort_by(|a, b| b.1.total_cmp(&a.1));
        (metric, known.into_iter().take(count).map(|(case, _)| case).collect())
    };
    Metric::ALL.map(of_metric).into()
}

/// The pictures that lose most by each metric.
fn largest(cases: &[Case]) -> String {
    let mut columns = vec!["metric, picture".to_owned(), "set".to_owned(), "content".to_owned()];
    columns.extend(RANGES.map(|range| range.title()));
    let mut table = Table::new(&columns);
    for (metric, worst) in worst(cases, NAMED) {
        for case in worst {
            let name = format!("{}, {}", metric.name(), short(&case.picture.name));
            let mut cells = vec![name, case.set.to_owned(), case.content.clone()];
            cells.extend((0..RANGES.len()).map(|range| percent(case.rate(metric, range))));
            table.row(&cells);
        }
    }
    format!(
        "\nThe {NAMED} pictures of all sets with the largest BD-rates at middle rates, by metric.\n{}",
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
        let worst = worst(&cases, 2);
        assert_eq!(worst.len(), Metric::ALL.len());
        let names: Vec<&str> = worst[0].1.iter().map(|case| case.picture.name.as_str()).collect();
        assert_eq!(names, ["c", "a"]);
        let text = largest(&cases);
        assert!(text.contains("| PSNR, c | Kodak | text | - | +30.0 % | +60.0 % |"), "{text}");
    }
}
