//! Rate-distortion curves: quality at a rate, and the mean difference in rate of two curves.

/// Quality over rate, between the points that were measured.
#[derive(Clone, Debug)]
pub(crate) struct Curve {
    /// Natural logarithms of bits per pixel, increasing.
    rates: Vec<f64>,
    /// Qualities, increasing.
    qualities: Vec<f64>,
    /// The logarithm of the largest rate that was measured. Files beyond the last of `rates` are no
    /// better than that one.
    end: f64,
}

impl Curve {
    /// A curve through points of bits per pixel and quality, in any order. A point is left out if
    /// another one of at most its rate is at least as good.
    pub(crate) fn new(points: impl IntoIterator<Item = (f64, f64)>) -> Self {
        let mut points: Vec<(f64, f64)> = points.into_iter().collect();
        points.sort_by(|a, b| a.0.total_cmp(&b.0).then(b.1.total_cmp(&a.1)));
        let (mut rates, mut qualities) = (Vec::new(), Vec::new());
        let end = points.last().map_or(f64::NEG_INFINITY, |point| point.0.ln());
        for (rate, quality) in points {
            if qualities.last().is_none_or(|&best| quality > best) {
                rates.push(rate.ln());
                qualities.push(quality);
            }
        }
        Self { rates, qualities, end }
    }

    /// Points of bits per pixel and quality, as measured.
    pub(crate) fn points(&self) -> impl Iterator<Item = (f64, f64)> {
        self.rates.iter().map(|rate| rate.exp()).zip(self.qualities.iter().copied())
    }

    /// The quality at a rate in bits per pixel: past the best file that of the best file. `None` beyond
    /// the rates that were measured.
    pub(crate) fn quality(&self, rate: f64) -> Option<f64> {
        let (first, last) = (*self.rates.first()?, *self.rates.last()?);
        let rate = rate.ln();
        let curve = || Pchip::new(&self.rates, &self.qualities).at(rate.min(last));
        (first..=self.end.max(last)).contains(&rate).then(curve)
    }

    /// The qualities from the rate `low` to the rate `high`, as far as the curve goes.
    fn qualities(&self, (low, high): (f64, f64)) -> Option<(f64, f64)> {
        let rates = (*self.rates.first()?, *self.rates.last()?);
        let (low, high) = (low.ln().max(rates.0), high.ln().min(rates.1));
        let curve = Pchip::new(&self.rates, &self.qualities);
        (low < high).then(|| (curve.at(low), curve.at(high)))
    }
}

/// The Bjøntegaard delta rate: by which share `test` is larger than `anchor`, on average over the
/// qualities that both reach within a range of bits per pixel. `None` if there are none.
pub(crate) fn bd_rate(anchor: &Curve, test: &Curve, range: (f64, f64)) -> Option<f64> {
    let (a, b) = (anchor.qualities(range)?, test.qualities(range)?);
    let (low, high) = (a.0.max(b.0), a.1.min(b.1));
    if low >= high {
        return None;
    }
    let area = |curve: &Curve| Pchip::new(&curve.qualities, &curve.rates).integral(low, high);
    Some(((area(test) - area(anchor)) / (high - low)).exp_m1())
}

/// A piecewise cubic Hermite interpolation that is monotone between monotone points (PCHIP; Fritsch
/// and Butland, 1984).
struct Pchip<'a> {
    x: &'a [f64],
    y: &'a [f64],
    slopes: Vec<f64>,
}

impl<'a> Pchip<'a> {
    /// Through points of increasing x, at least one.
    fn new(x: &'a [f64], y: &'a [f64]) -> Self {
        let steps: Vec<f64> = x.windows(2).map(|x| x[1] - x[0]).collect();
        let secants: Vec<f64> =
            y.windows(2).zip(&steps).map(|(y, step)| (y[1] - y[0]) / step).collect();
        let inner = steps.windows(2).zip(secants.windows(2)).map(|(h, d)| {
            if d[0] * d[1] <= 0.0 {
                return 0.0;
            }
            let (a, b) = (h[0] + 2.0 * h[1], 2.0 * h[0] + h[1]);
            (a + b) / (a / d[0] + b / d[1])
        });
        let end = |index: usize, next: usize| match (secants.get(index), secants.get(next)) {
            (Some(&d0), Some(&d1)) => {
                let (h0, h1) = (steps[index], steps[next]);
                let slope = ((2.0 * h0 + h1) * d0 - h0 * d1) / (h0 + h1);
                if slope * d0 <= 0.0 {
                    0.0
                } else if d0 * d1 <= 0.0 && slope.abs() > 3.0 * d0.abs() {
                    3.0 * d0
                } else {
                    slope
                }
            }
            (Some(&secant), None) => secant,
            _ => 0.0,
        };
        let last = secants.len().wrapping_sub(1);
        let mut slopes = vec![end(0, 1)];
        slopes.extend(inner);
        if x.len() > 1 {
            slopes.push(end(last, last.wrapping_sub(1)));
        }
        Self { x, y, slopes }
    }

    fn at(&self, x: f64) -> f64 {
        let right = self.x.partition_point(|&knot| knot < x).clamp(1, self.x.len().max(2) - 1);
        let left = right - 1;
        let Some(&end) = self.x.get(right) else { return self.y[left] };
        let step = end - self.x[left];
        let t = (x - self.x[left]) / step;
        let (a, b) = (t * t * (3.0 - 2.0 * t), t * (1.0 - t));
        let ends = self.y[left] * (1.0 - a) + self.y[right] * a;
        ends + step * b * (self.slopes[left] * (1.0 - t) - self.slopes[right] * t)
    }

    /// Over an interval within the points.
    fn integral(&self, low: f64, high: f64) -> f64 {
        let knots = self.x.iter().copied().filter(|&knot| low < knot && knot < high);
        let mut sum = 0.0;
        let mut from = low;
        for to in knots.chain([high]) {
            // Simpson's rule is exact for cubics.
            let middle = self.at(f64::midpoint(from, to));
            sum += (to - from) / 6.0 * (self.at(from) + 4.0 * middle + self.at(to));
            from = to;
        }
        sum
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    const EVERYWHERE: (f64, f64) = (1e-9, 1e9);

    fn close(value: Option<f64>, expected: f64) {
        assert!(value.is_some_and(|value| (value - expected).abs() < 1e-9), "{value:?} {expected}");
    }

    #[test]
    fn interpolates_between_the_points_and_nowhere_else() {
        // Linear in the logarithm of the rate, so every point in between is known.
        let curve = Curve::new([(1.0, 36.0), (0.25, 30.0), (0.5, 33.0)]);
        close(curve.quality(0.25), 30.0);
        close(curve.quality(0.5_f64.sqrt()), 34.5);
        close(curve.quality(1.0), 36.0);
        assert_eq!(curve.quality(0.24), None);
        assert_eq!(curve.quality(1.01), None);
        assert_eq!(Curve::new([]).quality(1.0), None);
        close(Curve::new([(1.0, 30.0)]).quality(1.0), 30.0);
    }

    #[test]
    fn follows_scipy_between_unequal_points() {
        // scipy.interpolate.PchipInterpolator over ln([0.1, 0.3, 0.7, 1.3]), [25, 30, 31, 36].
        let curve = Curve::new([(0.1, 25.0), (0.3, 30.0), (0.7, 31.0), (1.3, 36.0)]);
        close(curve.quality(0.2), 28.773_858_670_152_016);
        close(curve.quality(0.5), 30.537_413_581_917_93);
        close(curve.quality(1.0), 33.247_048_278_604_055);
    }

    #[test]
    fn worse_points_at_higher_rates_do_not_count() {
        let curve = Curve::new([(0.2, 30.0), (0.3, 29.0), (0.2, 28.0), (0.4, 31.0), (0.5, 30.5)]);
        close(curve.quality(0.45), 31.0);
        assert_eq!(curve.quality(0.51), None);
        let points: Vec<(f64, f64)> = curve.points().collect();
        assert_eq!(points.len(), 2);
        for ((rate, quality), expected) in points.into_iter().zip([(0.2, 30.0), (0.4, 31.0)]) {
            close(Some(rate), expected.0);
            close(Some(quality), expected.1);
        }
    }

    #[test]
    fn half_the_rate_at_every_quality() {
        let points = [(0.2, 28.0), (0.4, 31.0), (0.7, 33.0), (1.2, 36.5)];
        let anchor = Curve::new(points);
        let test = Curve::new(points.map(|(rate, quality)| (rate / 2.0, quality)));
        close(bd_rate(&anchor, &test, EVERYWHERE), -0.5);
        close(bd_rate(&test, &anchor, EVERYWHERE), 1.0);
        close(bd_rate(&anchor, &anchor, EVERYWHERE), 0.0);
    }

    #[test]
    fn a_case_computed_by_hand() {
        // log2 of the rate: (q - 30) / 3 - 2 against (q - 30) / 6 - 2. The common qualities are 30
        // to 33, where the second is smaller by (q - 30) / 6: 1/4 on average.
        let anchor = Curve::new([(0.25, 30.0), (0.5, 33.0)]);
        let test = Curve::new([(0.25, 30.0), (0.5, 36.0)]);
        close(bd_rate(&anchor, &test, EVERYWHERE), 0.5_f64.powf(0.25) - 1.0);
        // Up to 1.25 * 2^-2: 30 to 30 + 3 log2 1.25 for the first, which is less.
        let mean = 1.25_f64.log2() / 4.0;
        close(bd_rate(&anchor, &test, (0.1, 0.3125)), 0.5_f64.powf(mean) - 1.0);
    }

    #[test]
    fn curves_without_a_common_quality_have_no_difference() {
        let low = Curve::new([(0.1, 20.0), (0.2, 24.0)]);
        let high = Curve::new([(0.1, 30.0), (0.2, 34.0)]);
        assert_eq!(bd_rate(&low, &high, EVERYWHERE), None);
        assert_eq!(bd_rate(&low, &low, (0.3, 0.4)), None);
    }
}
