//! Markdown tables, and the numbers in them.

use std::fmt::Write;

/// A table whose first column is text and whose others are numbers.
#[derive(Debug)]
pub(crate) struct Table {
    text: String,
}

impl Table {
    pub(crate) fn new<T: AsRef<str>>(columns: &[T]) -> Self {
        let mut table = Self { text: String::new() };
        table.row(columns);
        let rules: Vec<&str> =
            columns.iter().enumerate().map(|(i, _)| if i == 0 { "---" } else { "---:" }).collect();
        table.row(&rules);
        table
    }

    pub(crate) fn row<T: AsRef<str>>(&mut self, cells: &[T]) {
        for cell in cells {
            let _ = write!(self.text, "| {} ", without_nan(cell.as_ref()));
        }
        self.text.push_str("|\n");
    }

    /// The table after a blank line.
    pub(crate) fn finish(&self) -> String {
        format!("\n{}", self.text)
    }
}

/// A cell in which numbers that are not defined, of pictures without a structure for example, are dashes.
fn without_nan(cell: &str) -> String {
    let shown = |word: &str| match word.trim_matches(|sign: char| "+-±()".contains(sign)) {
        "NaN" => word.replace("NaN", "-").replace(['+', '±'], ""),
        "inf" => word.replace("inf", "∞"),
        _ => word.to_owned(),
    };
    cell.split(' ').map(shown).collect::<Vec<_>>().join(" ")
}

/// A share as a signed percentage.
pub(crate) fn percent(share: Option<f64>) -> String {
    share.map_or_else(|| "-".into(), |share| format!("{:+.1} %", 100.0 * share))
}

/// The median (of an even number of values the mean of the two in the middle), `None` of nothing.
pub(crate) fn median(values: impl IntoIterator<Item = f64>) -> Option<f64> {
    let mut values: Vec<f64> = values.into_iter().collect();
    values.sort_by(f64::total_cmp);
    let upper = *values.get(values.len() / 2)?;
    let lower = values[(values.len() - 1) / 2];
    Some(f64::midpoint(lower, upper))
}

/// The mean, `None` of nothing.
pub(crate) fn mean(values: impl IntoIterator<Item = f64>) -> Option<f64> {
    let (mut sum, mut count) = (0.0, 0.0);
    for value in values {
        sum += value;
        count += 1.0;
    }
    (count > 0.0).then(|| sum / count)
}

/// MS-SSIM in decibels: `-10 log10(1 - MS-SSIM)`.
pub(crate) fn decibels(ms_ssim: f64) -> f64 {
    -10.0 * (1.0 - ms_ssim).log10()
}

/// The reverse of [`decibels`].
pub(crate) fn from_decibels(decibels: f64) -> f64 {
    1.0 - 10_f64.powf(-decibels / 10.0)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_table_is_markdown() {
        let mut table = Table::new(&["codec", "bpp"]);
        table.row(&["gip", "0.5"]);
        assert_eq!(table.finish(), "\n| codec | bpp |\n| --- | ---: |\n| gip | 0.5 |\n");
    }

    #[test]
    fn numbers_that_are_not_defined_are_dashes() {
        let cells = ["NaN", "±NaN", "0.9000 (inf)", "-inf dB", "NaN dB", "NaNa of info"];
        assert_eq!(
            cells.map(without_nan),
            ["-", "-", "0.9000 (∞)", "-∞ dB", "- dB", "NaNa of info"]
        );
    }

    #[test]
    fn statistics() {
        assert_eq!(median([3.0, 9.0, 1.0]), Some(3.0));
        assert_eq!(median([4.0, 1.0, 3.0, 2.0]), Some(2.5));
        assert_eq!(mean([3.0, 9.0, 0.0]), Some(4.0));
        assert_eq!((median([]), mean([])), (None, None));
        assert_eq!(percent(Some(-0.125)), "-12.5 %");
        assert_eq!(percent(Some(0.5)), "+50.0 %");
        assert_eq!(percent(None), "-");
    }

    #[test]
    fn decibels_of_ms_ssim() {
        assert!((decibels(0.99) - 20.0).abs() < 1e-9);
        assert!((from_decibels(20.0) - 0.99).abs() < 1e-9);
    }
}
