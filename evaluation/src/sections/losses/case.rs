//! One picture with what its files are worth beside those of the strongest other codec.

use super::source::Source;
use crate::bench::Bench;
use crate::metric::Metric;
use crate::pictures::TestPicture;
use crate::sections::comparisons::Comparison;
use crate::sections::ranges::{RANGES, bd_rates};

/// The indices of the ranges in the order in which one stands for a picture: middle, low, high.
const TELLING: [usize; RANGES.len()] = [1, 0, 2];

/// A picture with its BD-rates against the strongest other codec.
pub(super) struct Case {
    pub(super) picture: TestPicture,
    pub(super) set: &'static str,
    pub(super) content: String,
    pub(super) source: Source,
    /// By metric and range.
    rates: [[Option<f64>; RANGES.len()]; Metric::ALL.len()],
}

impl Case {
    pub(super) fn rate(&self, metric: Metric, range: usize) -> Option<f64> {
        let index = Metric::ALL.iter().position(|each| *each == metric);
        self.rates[index.expect("all metrics are there")][range]
    }

    /// The BD-rate at middle rates or, for screenshots whose files are smaller or larger, at others:
    /// the index of the range, and the BD-rate.
    pub(super) fn telling(&self, metric: Metric) -> Option<(usize, f64)> {
        TELLING.into_iter().find_map(|range| Some((range, self.rate(metric, range)?)))
    }
}

/// The pictures of a set.
pub(super) fn cases(comparison: &Comparison, bench: &Bench) -> Vec<Case> {
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
pub(super) fn worst(cases: &[Case], metric: Metric) -> Vec<&Case> {
    let known = cases.iter().filter_map(|case| Some((case, case.telling(metric)?.1)));
    let mut known: Vec<(&Case, f64)> = known.collect();
    known.sort_by(|a, b| b.1.total_cmp(&a.1));
    known.into_iter().map(|(case, _)| case).collect()
}

#[cfg(test)]
pub(crate) mod tests {
    use super::*;

    pub(crate) fn case(name: &str, content: &str, middle: f64) -> Case {
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
    }
}
