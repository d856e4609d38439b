//! Quantization-aware training (QAT) with LSQ+: every component has a learnable scale and offset,
//! and gradients pass the rounding by the straight-through estimator (paper, section "Compression
//! Framework"; Bhalgat et al., LSQ+, 2020).
//!
//! Training renders exactly what the file will hold: the values pass through the same quantizers
//! that the file stores, and are decoded by the same function that the decoder calls.

use core::ops::Range;
use std::sync::Arc;

use super::parameterization;
use super::row::{Row, RowBounds};
use super::training;
use super::vector_quantizer::VectorQuantizer;
use crate::coding::packed::{MAX_PARAMETER, Quantizer, UniformQuantizer};
use crate::gaussian::{Gaussian, MAX_COMPONENTS, Parameterization};

/// The quantizers of all components during training.
#[derive(Clone, Debug)]
pub(crate) struct LsqQuantizers {
    components: Vec<LsqQuantizer>,
    /// What takes the place of LSQ+, and at which components.
    replacements: Vec<(Range<usize>, Arc<dyn VectorQuantizer>)>,
    parameterization: Parameterization,
    /// Steps of Adam so far.
    age: i32,
}

/// The quantizer of one component during training.
#[derive(Clone, Copy, Debug)]
struct LsqQuantizer {
    quantizer: UniformQuantizer,
    /// Whether another quantizer takes its place.
    is_replaced: bool,
    /// For a logarithmic quantizer, the logarithm of the least value.
    min_logarithm: Option<f32>,
    /// Whether the offset is kept a multiple of the scale, so that a code stands for exactly 0.
    has_zero: bool,
    /// Adam's moving averages of the gradients by scale and offset, and of their squares.
    mean: [f32; 2],
    square: [f32; 2],
}

/// The least scale, for values that are all equal.
const MIN_SCALE: f32 = 1e-9;
// Constants: docs/tuning.md, "Steps of training".
/// How many wider ranges of colour are tried than three standard deviations.
const WIDENINGS: u8 = 16;
/// What an error counts that clipping makes: training corrects it by other Gaussians, as it cannot with
/// coarse steps.
const CLIPPED: f64 = 0.2;

/// Gradients by the scale and the offset of every component's quantizer.
pub(crate) type QuantizerGradients = [[f32; 2]; MAX_COMPONENTS];

impl LsqQuantizers {
    /// Quantizers whose ranges cover `rows`, except for outliers of colour.
    pub(crate) fn new(rows: &[Row], bounds: RowBounds, options: &training::Quantization) -> Self {
        let is_logarithmic = parameterization::is_logarithmic(bounds.parameterization);
        // A variance is the square of a deviation.
        let power = if bounds.parameterization == Parameterization::Covariance { 2.0 } else { 1.0 };
        let min_logarithm = power * parameterization::MIN_DEVIATION.ln();
        let others = [(0..2, &options.center), (5..5 + bounds.channels, &options.color)];
        let replacements: Vec<_> = (others.into_iter())
            .filter_map(|(range, other)| Some((range, other.clone()?)))
            .collect();
        let area = |row: &Row| {
            let [l11, _, l22] =
                Gaussian::from_components(&row[..], bounds.parameterization).cholesky;
            f64::from(l11 * l22)
        };
        let areas: Vec<f64> = rows.iter().map(area).collect();
        let components = (0..5 + bounds.channels).map(|index| {
            let (bits, min_logarithm, has_zero) = match index {
                0 | 1 => (options.position_bits, None, false),
                2..5 => {
                    let has_zero =
                        bounds.parameterization == Parameterization::Covariance && index == 3;
                    let min_logarithm = is_logarithmic[index - 2].then_some(min_logarithm);
                    (options.shape_bits, min_logarithm, has_zero)
                }
                _ => (options.color_bits, None, false),
            };
            let values = rows.iter().map(|row| to_uniform(row[index], min_logarithm));
            let (low, high) = match index {
                ..5 => range(values),
                _ => least_error_range(&values.zip(areas.iter().copied()), bits),
            };
            let mut component = LsqQuantizer {
                quantizer: covering((low, high), bits),
                is_replaced: replacements.iter().any(|(range, _)| range.contains(&index)),
                min_logarithm,
                has_zero,
                mean: [0.0; 2],
                square: [0.0; 2],
            };
            component.clamp();
            component
        });
        let mut quantizers = Self {
            components: components.collect(),
            replacements,
            parameterization: bounds.parameterization,
            age: 0,
        };
        quantizers.adapt(rows);
        quantizers
    }

    /// The quantizers as the file stores them.
    pub(crate) fn stored(&self) -> Vec<Quantizer> {
        self.components.iter().map(LsqQuantizer::stored).collect()
    }

    /// The codes of a Gaussian. If rounding makes a covariance invalid, the code of its
    /// off-diagonal entry moves towards that of 0 until the covariance is valid.
    pub(crate) fn codes(&self, row: &Row) -> [u32; MAX_COMPONENTS] {
        let mut codes = [0; MAX_COMPONENTS];
        for ((code, &value), component) in codes.iter_mut().zip(row).zip(&self.components) {
            *code = component.quantizer.code(to_uniform(value, component.min_logarithm));
        }
        for (range, quantizer) in &self.replacements {
            let mut values = *row;
            quantizer.quantize(&mut values[range.clone()]);
            for index in range.clone() {
                codes[index] = values[index].to_bits();
            }
        }
        if self.parameterization == Parameterization::Covariance && !self.is_drawable(&codes) {
            // An off-diagonal entry of 0 is always valid: bisect between its code and the rounded
            // one.
            let mut valid = self.components[3].quantizer.code(0.0);
            let mut invalid = codes[3];
            while valid.abs_diff(invalid) > 1 {
                codes[3] = u32::midpoint(valid, invalid);
                if self.is_drawable(&codes) {
                    valid = codes[3];
                } else {
                    invalid = codes[3];
                }
            }
            codes[3] = valid;
        }
        codes
    }

    /// The values that the codes of a Gaussian stand for, computed as the decoder does.
    pub(crate) fn decoded(&self, codes: &[u32; MAX_COMPONENTS]) -> Row {
        let mut row = [0.0; MAX_COMPONENTS];
        for ((value, &code), component) in row.iter_mut().zip(codes).zip(&self.components) {
            *value = component.stored().value(code);
        }
        row
    }

    /// The backward pass through the quantizers of a Gaussian, with the straight-through estimator.
    ///
    /// `row` holds the trained values and `decoded` the decoded ones. `gradient` is by the decoded
    /// values before and by the trained ones after. Returns the gradients by scales and offsets.
    pub(crate) fn backward(
        &self,
        row: &Row,
        decoded: &Row,
        gradient: &mut Row,
    ) -> QuantizerGradients {
        let mut by_quantizer = [[0.0; 2]; MAX_COMPONENTS];
        for (range, quantizer) in &self.replacements {
            quantizer.add_gradient(&row[range.clone()], &mut gradient[range.clone()]);
        }
        for (index, component) in self.components.iter().enumerate() {
            if component.is_replaced {
                continue;
            }
            let UniformQuantizer { scale, offset, .. } = component.quantizer;
            let max = component.quantizer.max_code() as f32;
            // The code before it is clamped and rounded.
            let code = (to_uniform(row[index], component.min_logarithm) - offset) / scale;
            let mut by_uniform = gradient[index];
            if component.min_logarithm.is_some() {
                by_uniform *= decoded[index];
            }
            by_quantizer[index] = if code < 0.0 {
                [0.0, by_uniform]
            } else if code > max {
                [by_uniform * max, by_uniform]
            } else {
                [by_uniform * (code.round_ties_even() - code), 0.0]
            };
            gradient[index] = if (0.0..=max).contains(&code) {
                by_uniform / if component.min_logarithm.is_some() { row[index] } else { 1.0 }
            } else {
                0.0
            };
        }
        by_quantizer
    }

    /// Takes one step of Adam on scales and offsets, against gradients summed over the Gaussians
    /// whose values are now `rows`.
    pub(crate) fn step(&mut self, gradients: &QuantizerGradients, rows: &[Row], rate: f32) {
        self.age += 1;
        let unbias = [1.0 - 0.9_f32.powi(self.age), 1.0 - 0.999_f32.powi(self.age)];
        for (component, gradient) in self.components.iter_mut().zip(gradients) {
            component.step(gradient, rows.len(), rate, unbias);
        }
        self.adapt(rows);
    }

    fn adapt(&mut self, rows: &[Row]) {
        for (range, quantizer) in &mut self.replacements {
            let values: Vec<&[f32]> = rows.iter().map(|row| &row[range.clone()]).collect();
            *quantizer = quantizer.adapted(&values);
        }
    }

    /// Whether codes stand for a valid Gaussian.
    fn is_drawable(&self, codes: &[u32; MAX_COMPONENTS]) -> bool {
        let row = self.decoded(codes);
        Gaussian::from_components(&row[..self.components.len()], self.parameterization)
            .is_drawable()
    }
}

impl LsqQuantizer {
    fn stored(&self) -> Quantizer {
        match self.min_logarithm {
            _ if self.is_replaced => Quantizer::Float,
            Some(_) => Quantizer::Log(self.quantizer),
            None => Quantizer::Linear(self.quantizer),
        }
    }

    fn step(&mut self, gradient: &[f32; 2], count: usize, rate: f32, unbias: [f32; 2]) {
        // LSQ's gradient scale. It matters to plain gradient descent; Adam normalizes it away.
        let scaling = 1.0 / (count as f32 * self.quantizer.max_code() as f32).sqrt();
        let mut steps = [0.0; 2];
        for (index, gradient) in gradient.iter().enumerate() {
            let gradient = gradient * scaling;
            let (mean, square) = (&mut self.mean[index], &mut self.square[index]);
            *mean = 0.9 * *mean + 0.1 * gradient;
            *square = 0.999 * *square + 0.001 * gradient * gradient;
            let root = (*square / unbias[1]).sqrt();
            if root > 0.0 && root.is_finite() {
                steps[index] = rate * *mean / unbias[0] / root;
            }
        }
        let scale = self.quantizer.scale;
        self.quantizer.scale -= steps[0] * scale;
        self.quantizer.offset -= steps[1] * scale;
        self.clamp();
    }

    /// Clamps scale and offset to what a decoder accepts, and so that decoded values are valid.
    fn clamp(&mut self) {
        let UniformQuantizer { bits: _, scale, offset } = &mut self.quantizer;
        *scale = scale.clamp(MIN_SCALE, MAX_PARAMETER);
        *offset = offset.clamp(-MAX_PARAMETER, MAX_PARAMETER);
        if let Some(min_logarithm) = self.min_logarithm {
            *offset = offset.max(min_logarithm);
        }
        if self.has_zero {
            let zero = (-*offset / *scale).round().clamp(0.0, self.quantizer.max_code() as f32);
            self.quantizer.offset = -zero * self.quantizer.scale;
        }
    }
}

/// What the uniform quantizer is applied to: the value, or its logarithm.
fn to_uniform(value: f32, min_logarithm: Option<f32>) -> f32 {
    // A variance of the paper's parameterization can be negative before it is pruned.
    if min_logarithm.is_some() { value.max(1e-9).ln() } else { value }
}

/// The least and the largest value; (0, 0) if there is none.
fn range(values: impl Iterator<Item = f32>) -> (f32, f32) {
    values
        .fold(None, |range: Option<(f32, f32)>, value| match range {
            None => Some((value, value)),
            Some((low, high)) => Some((low.min(value), high.max(value))),
        })
        .unwrap_or_default()
}

/// The quantizer of a depth whose codes cover a range.
fn covering((low, high): (f32, f32), bits: u8) -> UniformQuantizer {
    let mut quantizer = UniformQuantizer { bits, scale: 1.0, offset: low };
    quantizer.scale = ((high - low) / quantizer.max_code() as f32).max(MIN_SCALE);
    quantizer
}

/// The range with which a quantizer makes the least squared error, where each value counts by a weight:
/// between [`three_sigma_range`] and the range of all values. In smooth pictures a few large Gaussians
/// have the strongest colours, and clipping those may show more than coarse steps.
fn least_error_range(
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

#[cfg(test)]
mod tests {
    use glam::Vec2;
    use proptest::prelude::*;

    use super::*;
    use crate::encode::fit::training::Training;
    use crate::testing::config;

    const PARAMETERIZATIONS: [Parameterization; 3] =
        [Parameterization::Covariance, Parameterization::Cholesky, Parameterization::RotationScale];

    fn bounds(parameterization: Parameterization) -> RowBounds {
        RowBounds { parameterization, channels: 3, size: Vec2::new(300.0, 200.0) }
    }

    /// Valid Gaussians, from tiny ones to ones as large as the picture, some of them very
    /// elongated.
    fn rows(parameterization: Parameterization, count: usize, seed: u64) -> Vec<Row> {
        let mut rng = fastrand::Rng::with_seed(seed);
        let mut number = move |low: f32, high: f32| low + (high - low) * rng.f32();
        (0..count)
            .map(|_| {
                let (s1, s2) = (number(-1.5, 5.0).exp(), number(-1.5, 2.0).exp());
                let factor =
                    Parameterization::RotationScale.to_cholesky([s1, s2, number(-3.0, 3.0)]);
                let mut row = [0.0; MAX_COMPONENTS];
                row[0] = number(-5.0, 305.0);
                row[1] = number(-5.0, 205.0);
                row[2..5].copy_from_slice(
                    &parameterization::from_cholesky(parameterization, factor).to_array(),
                );
                for value in &mut row[5..8] {
                    *value = number(-0.5, 1.0);
                }
                bounds(parameterization).clamped(row)
            })
            .collect()
    }

    proptest! {
        #![proptest_config(config(24))]

        #[test]
        fn no_gaussian_is_lost_by_rounding(seed: u64, shape_bits in 2_u8..=12, drift in -30..30) {
            for parameterization in PARAMETERIZATIONS {
                let rows = rows(parameterization, 50, seed);
                let mut options = Training::fast(1).quantization;
                options.shape_bits = shape_bits;
                let mut quantizers = LsqQuantizers::new(&rows, bounds(parameterization), &options);
                // Training moves scales and offsets.
                let gradient = [[f32::from(drift as i8), -f32::from(drift as i8)]; MAX_COMPONENTS];
                for _ in 0..5 {
                    quantizers.step(&gradient, &rows, 0.05);
                }
                for row in &rows {
                    let codes = quantizers.codes(row);
                    prop_assert!(quantizers.is_drawable(&codes), "{parameterization:?}: {row:?}");
                    for (code, component) in codes.iter().zip(&quantizers.components) {
                        prop_assert!(*code <= component.quantizer.max_code());
                    }
                }
            }
        }

        #[test]
        fn the_rounding_error_is_at_most_half_a_step(seed: u64) {
            let rows = rows(Parameterization::Cholesky, 40, seed);
            let options = Training::fast(1).quantization;
            let quantizers = LsqQuantizers::new(&rows, bounds(Parameterization::Cholesky), &options);
            for row in &rows {
                let decoded = quantizers.decoded(&quantizers.codes(row));
                // The ranges of position and shape are covered; outliers of colour are clipped.
                for (index, component) in quantizers.components.iter().enumerate().take(5) {
                    let uniform = |row: &Row| to_uniform(row[index], component.min_logarithm);
                    let error = uniform(&decoded) - uniform(row);
                    prop_assert!(error.abs() <= 0.501 * component.quantizer.scale + 1e-5);
                }
            }
        }
    }

    #[test]
    fn gradients_by_scale_and_offset_are_those_of_lsq_plus() {
        let rows = rows(Parameterization::Cholesky, 30, 7);
        let options = Training::fast(1).quantization;
        let quantizers = LsqQuantizers::new(&rows, bounds(Parameterization::Cholesky), &options);
        // A colour inside, below and above the range.
        let UniformQuantizer { scale, offset, .. } = quantizers.components[5].quantizer;
        let max = quantizers.components[5].quantizer.max_code() as f32;
        for (position, by_scale, by_offset, by_value) in
            [(3.25, -0.25, 0.0, 1.0), (-2.0, 0.0, 1.0, 0.0), (max + 2.0, max, 1.0, 0.0)]
        {
            let mut row = rows[0];
            row[5] = offset + position * scale;
            let decoded = quantizers.decoded(&quantizers.codes(&row));
            let mut gradient = [0.0; MAX_COMPONENTS];
            gradient[5] = 2.0;
            let by_quantizer = quantizers.backward(&row, &decoded, &mut gradient);
            assert!((by_quantizer[5][0] - 2.0 * by_scale).abs() < 1e-3, "scale at {position}");
            assert_eq!(by_quantizer[5][1], 2.0 * by_offset, "offset at {position}");
            assert_eq!(gradient[5], 2.0 * by_value, "value at {position}");
        }
        // A logarithmic quantizer passes the gradient as if nothing were rounded in the logarithm.
        let decoded = quantizers.decoded(&quantizers.codes(&rows[0]));
        let mut gradient = [1.0; MAX_COMPONENTS];
        quantizers.backward(&rows[0], &decoded, &mut gradient);
        assert!((gradient[2] - decoded[2] / rows[0][2]).abs() < 1e-5);
    }

    /// Rounds to multiples of a step that each adaptation halves, and pulls values down.
    #[derive(Debug)]
    struct Halving(f32);

    impl VectorQuantizer for Halving {
        fn adapted(&self, trained: &[&[f32]]) -> Arc<dyn VectorQuantizer> {
            assert!(trained.iter().all(|values| values.len() == 3));
            Arc::new(Self(self.0 / 2.0))
        }

        fn quantize(&self, values: &mut [f32]) {
            values.iter_mut().for_each(|value| *value = (*value / self.0).round() * self.0);
        }

        fn add_gradient(&self, trained: &[f32], gradient: &mut [f32]) {
            gradient.iter_mut().zip(trained).for_each(|(sum, value)| *sum += value);
        }
    }

    #[test]
    fn another_quantizer_takes_the_place_of_lsq_plus() {
        let rows = rows(Parameterization::Cholesky, 9, 5);
        let mut options = Training::fast(1).quantization;
        options.color = Some(Arc::new(Halving(1.0)));
        let mut quantizers =
            LsqQuantizers::new(&rows, bounds(Parameterization::Cholesky), &options);
        assert_eq!(quantizers.stored()[5..], [Quantizer::Float; 3]);
        let row = [30.0, 20.0, 2.0, 0.0, 2.0, 0.3125, -0.5625, 0.9375, 0.0];
        assert_eq!(quantizers.decoded(&quantizers.codes(&row))[5..], [0.5, -0.5, 1.0, 0.0]);
        let decoded = quantizers.decoded(&quantizers.codes(&row));
        let mut gradient = [1.0; MAX_COMPONENTS];
        let by_quantizer = quantizers.backward(&row, &decoded, &mut gradient);
        assert_eq!(gradient[5..8], [1.3125, 0.4375, 1.9375]);
        quantizers.step(&by_quantizer, &rows, 1e-3);
        assert_eq!(quantizers.decoded(&quantizers.codes(&row))[5..], [0.25, -0.5, 1.0, 0.0]);
    }

    #[test]
    fn equal_values_are_kept_exactly() {
        let row = rows(Parameterization::Cholesky, 1, 3)[0];
        let options = Training::fast(1).quantization;
        let quantizers =
            LsqQuantizers::new(&[row; 9], bounds(Parameterization::Cholesky), &options);
        let decoded = quantizers.decoded(&quantizers.codes(&row));
        for (decoded, value) in decoded.iter().zip(row) {
            assert!((decoded - value).abs() <= 1e-6 * value.abs());
        }
        for quantizer in
            LsqQuantizers::new(&[], bounds(Parameterization::Cholesky), &options).stored()
        {
            assert!(quantizer.value(0).is_finite());
        }
    }
}
