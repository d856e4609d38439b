//! Mean differences in rate, apart for low, middle and high rates.

use super::codec_curves::Codec;
use crate::curve::bd_rate;
use crate::metric::Metric;
use crate::pictures::TestPicture;
use crate::table::{mean, median, percent};

/// Rates that are compared apart from others.
#[derive(Clone, Copy, Debug)]
pub(super) struct Range {
    pub(super) name: &'static str,
    /// In bits per pixel.
    pub(super) rates: (f64, f64),
}

pub(super) const LOW: Range = Range { name: "low", rates: (0.1, 0.4) };
pub(super) const MIDDLE: Range = Range { name: "middle", rates: (0.4, 1.0) };
pub(super) const HIGH: Range = Range { name: "high", rates: (1.0, 2.0) };
pub(super) const RANGES: [Range; 3] = [LOW, MIDDLE, HIGH];

impl Range {
    /// With its rates, for the head of a column.
    pub(super) fn title(&self) -> String {
        format!("{}, {} to {} bpp", self.name, self.rates.0, self.rates.1)
    }
}

/// For each picture the BD-rate of one codec against another; `None` where they have no quality in
/// common.
pub(super) fn bd_rates(
    test: &Codec,
    anchor: &Codec,
    metric: Metric,
    range: Range,
) -> Vec<Option<f64>> {
    let curves = anchor.curves(metric).into_iter().zip(test.curves(metric));
    curves.map(|(anchor, test)| bd_rate(&anchor, &test, range.rates)).collect()
}

/// BD-rates of many pictures in a few numbers.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct Outcome {
    pub(super) mean: Option<f64>,
    pub(super) median: Option<f64>,
    /// The index of the picture with the largest, and that BD-rate.
    pub(super) worst: Option<(usize, f64)>,
    /// How many pictures have smaller files than the anchor's.
    pub(super) won: usize,
    /// How many have a quality in common with it.
    pub(super) compared: usize,
}

impl Outcome {
    pub(super) fn of(rates: &[Option<f64>]) -> Self {
        let known = || rates.iter().enumerate().filter_map(|(i, rate)| Some((i, (*rate)?)));
        Self {
            mean: mean(known().map(|(_, rate)| rate)),
            median: median(known().map(|(_, rate)| rate)),
            worst: known().max_by(|a, b| a.1.total_cmp(&b.1)),
            won: known().filter(|(_, rate)| *rate < 0.0).count(),
            compared: known().count(),
        }
    }

    /// Mean, pictures won, and the worst picture, in a cell of a table.
    pub(super) fn cell(&self, pictures: &[TestPicture]) -> String {
        let Some((index, worst)) = self.worst else { return "-".into() };
        format!(
            "{}; {}/{}; {} {}",
            percent(self.mean),
            self.won,
            self.compared,
            short(&pictures[index].name),
            percent(Some(worst)),
        )
    }
}

/// The longest name that is written out.
const LONGEST: usize = 20;
const SHORTENED: usize = 8;

/// A picture's name as tables have it: a long one, such as a checksum, by its beginning.
pub(super) fn short(name: &str) -> &str {
    if name.len() <= LONGEST { name } else { name.get(..SHORTENED).unwrap_or(name) }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn an_outcome_is_of_the_pictures_with_a_common_quality() {
        let outcome = Outcome::of(&[Some(-0.25), None, Some(0.125), Some(-0.5)]);
        assert_eq!((outcome.won, outcome.compared), (2, 3));
        assert_eq!(outcome.worst, Some((2, 0.125)));
        let picture = |name: &str| TestPicture {
            name: name.into(),
            path: "".into(),
            width: 1,
            height: 1,
            rgb: vec![0; 3],
        };
        let pictures = ["a", "b", "0123456789abcdef01234567", "d"].map(picture);
        assert_eq!(outcome.cell(&pictures), "-20.8 %; 2/3; 01234567 +12.5 %");
        assert_eq!(Outcome::of(&[None]).cell(&pictures), "-");
    }
}
