//! Shares of yes among answers, and how sure they are.

/// Which share of the exact interval is beyond each of its ends.
const TAIL: f64 = 0.025;

/// The exact interval of 95 % (Clopper and Pearson) for the probability of yes, after so many of so
/// many answers.
pub(super) fn interval(yes: u32, answers: u32) -> (f64, f64) {
    // The probability with which at least `count` of the answers are yes increases with that of yes.
    let solve = |count: u32, wanted: f64| {
        let (mut low, mut high) = (0.0, 1.0);
        for _ in 0..60 {
            let middle = f64::midpoint(low, high);
            if at_least(count, answers, middle) < wanted { low = middle } else { high = middle }
        }
        low
    };
    let low = if yes == 0 { 0.0 } else { solve(yes, TAIL) };
    let high = if yes == answers { 1.0 } else { solve(yes + 1, 1.0 - TAIL) };
    (low, high)
}

/// The probability of at least `count` yes, of which each has a probability between 0 and 1.
fn at_least(count: u32, answers: u32, probability: f64) -> f64 {
    let (yes, no) = (probability.ln(), (-probability).ln_1p());
    let mut ways = 0.0;
    let mut sum = 0.0;
    for index in 0..=answers {
        if index >= count {
            sum += (ways + f64::from(index) * yes + f64::from(answers - index) * no).exp();
        }
        ways += (f64::from(answers - index) / f64::from(index + 1)).ln();
    }
    sum
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn intervals_are_exact() {
        // Computed with fractions.
        for (yes, answers, low, high) in [
            (7, 10, 0.347_547_1, 0.933_260_5),
            (0, 10, 0.0, 0.308_497_1),
            (10, 10, 0.691_502_9, 1.0),
            (75, 108, 0.598_444_9, 0.779_460_4),
        ] {
            let found = interval(yes, answers);
            assert!((found.0 - low).abs() < 1e-6, "{yes} of {answers}: {found:?}");
            assert!((found.1 - high).abs() < 1e-6, "{yes} of {answers}: {found:?}");
        }
        assert_eq!(interval(0, 0), (0.0, 1.0));
    }
}
