//! Where our files are larger than those of the strongest other codec, and why.

mod case;
mod kinds;
mod noise;
mod sheet;
mod source;

use anyhow::Result;

use super::comparisons::compare;
use super::ranges::{RANGES, short};
use super::rate_store::RateStore;
use crate::bench::Bench;
use crate::gip;
use crate::metric::Metric;
use crate::table::{Table, percent};
use case::{Case, cases, worst};

/// How many pictures are named for each metric.
const NAMED: usize = 6;

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
    use case::tests::case;

    #[test]
    fn the_largest_losses_have_all_ranges() {
        let cases = [case("a", "text", 0.1), case("b", "face", -0.2), case("c", "text", 0.3)];
        let text = largest(&cases);
        assert!(text.contains("| PSNR, c | Kodak | text | - | +30.0 % | +60.0 % |"), "{text}");
    }
}
