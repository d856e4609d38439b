//! Numbers as they are kept in files.

/// As many digits as any figure of the report can show.
const DIGITS: usize = 7;

/// A measured number with the digits that matter. Whole numbers, such as bytes, are kept as they are.
pub(crate) fn rounded(value: f64) -> f64 {
    if !value.is_finite() || value.fract() == 0.0 {
        return value;
    }
    format!("{value:.*e}", DIGITS - 1).parse().expect("it was just written")
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn whole_numbers_stay_and_others_get_seven_digits() {
        assert_eq!([181_234_567_891.0, -3.0, 0.0].map(rounded), [181_234_567_891.0, -3.0, 0.0]);
        assert_eq!(rounded(28.825_281_241_119_715).to_string(), "28.82528");
        assert_eq!(rounded(0.196_718_709).to_string(), "0.1967187");
        assert_eq!(rounded(-0.000_012_345_678_9).to_string(), "-0.00001234568");
        assert_eq!(rounded(f64::INFINITY), f64::INFINITY);
        assert!(rounded(f64::NAN).is_nan());
    }

    #[test]
    fn what_is_rounded_stays_as_it_is() {
        let value = rounded(2.0_f64.sqrt());
        assert_eq!(rounded(value), value);
    }
}
