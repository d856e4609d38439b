//! The ranges with which LSQ+ starts.

use crate::coding::packed::{Quantizer, UniformQuantizer};
use crate::container::Header;
use crate::gaussian::{MAX_COMPONENTS, SHAPE};

/// The least scale, for values that are all equal.
pub(super) const MIN_SCALE: f32 = 1e-9;
// Constants: docs/tuning.md, "Steps of training".
/// How many wider ranges of colour are tried than three standard deviations.
const WIDENINGS: u8 = 16;
/// What an error counts that clipping makes: training corrects it by other Gaussians, as it cannot with
/// coarse steps.
const CLIPPED: f64 = 0.2;

/// Quantizers of some bit depths for position, shape and colour whose codes cover the values of the components of
/// Gaussians, except for outliers of colour.
pub(crate) fn quantizers_for(
    values: &[[f32; MAX_COMPONENTS]],
    header: &Header,
    [position, shape, color]: [u8; 3],
) -> Vec<Quantizer> {
    let parameterization = header.parameterization;
    let is_logarithmic = parameterization.is_logarithmic();
    let weight = |values: &[f32; MAX_COMPONENTS]| {
        let [l11, _, l22] = parameterization.to_cholesky([values[2], values[3], values[4]]);
        f64::from(l11 * l22)
    };
    let quantizer = |component: usize| {
        let values_of = values.iter().map(|values| values[component]);
        if SHAPE.contains(&component) && is_logarithmic[component - SHAPE.start] {
            return Quantizer::Log(covering(range(values_of.map(f32::ln)), shape));
        }
        if component >= SHAPE.end {
            let weighted = values.iter().map(|values| (values[component], weight(values)));
            return Quantizer::Linear(covering(least_error_range(&weighted, color), color));
        }
        let bits = if SHAPE.contains(&component) { shape } else { position };
        Quantizer::Linear(covering(range(values_of), bits))
    };
    (0..header.components()).map(quantizer).collect()
}

/// The least and the largest value; (0, 0) if there is none.
pub(super) fn range(values: impl Iterator<Item = f32>) -> (f32, f32) {
    values
        .fold(None, |range: Option<(f32, f32)>, value| match range {
            None => Some((value, value)),
            Some((low, high)) => Some((low.min(value), high.max(value))),
        })
        .unwrap_or_default()
}

/// The quantizer of a depth whose codes cover a range.
pub(super) fn covering((low, high): (f32, f32), bits: u8) -> UniformQuantizer {
    let mut quantizer = UniformQuantizer { bits, scale: 1.0, offset: low };
    quantizer.scale = ((high - low) / quantizer.max_code() as f32).max(MIN_SCALE);
    quantizer
}

/// The range with which a quantizer makes the least squared error, where each value counts by a weight:
/// between [`three_sigma_range`] and the range of all values. In smooth pictures a few large Gaussians
/// have the strongest colours, and clipping those may show more than coarse steps.
pub(super) fn least_error_range(
    weighted: &(impl Iterator<Item = (f32, f64)> + Clone),
    bits: u8,
) -> (f32, f32) {
    let values = weighted.clone().map(|(value, _)| value);
    let (inner, outer) = (three_sigma_range(values.clone()), range(values));
    let candidate = |index: u8| {
        let share = f32::from(index) / f32::from(WIDENINGS);
        let low = inner.0 + share * (outer.0 - inner.0);
        let high = inner.1 + share * (outer.1 - inner.1);
        let quantizer = covering((low, high), bits);
        let error = |(value, weight): (f32, f64)| {
            let share = if (low..=high).contains(&value) { 1.0 } else { CLIPPED };
            share * weight * f64::from(quantizer.value(quantizer.code(value)) - value).powi(2)
        };
        (weighted.clone().map(error).sum::<f64>(), (low, high))
    };
    let best = (0..=WIDENINGS).map(candidate).min_by(|a, b| a.0.total_cmp(&b.0));
    best.expect("there are candidates").1
}

/// Three standard deviations to both sides of the mean, but at most the range of the values: how
/// LSQ+ initializes quantizers of values with long tails.
fn three_sigma_range(values: impl Iterator<Item = f32> + Clone) -> (f32, f32) {
    let (low, high) = range(values.clone());
    let count = values.clone().count().max(1) as f64;
    let mean = values.clone().map(f64::from).sum::<f64>() / count;
    let variance = values.map(|value| (f64::from(value) - mean).powi(2)).sum::<f64>() / count;
    let reach = 3.0 * variance.sqrt();
    (low.max((mean - reach) as f32), high.min((mean + reach) as f32))
}
