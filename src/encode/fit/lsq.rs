//! Quantization-aware training (QAT) with LSQ+: every component has a learnable scale and offset,
//! and gradients pass the rounding by the straight-through estimator (paper, section "Compression
//! Framework"; Bhalgat et al., LSQ+, 2020).
//!
//! Training renders exactly what the file will hold: the values pass through the same quantizers
//! that the file stores, and are decoded by the same function that the decoder calls.

use std::sync::Arc;

use super::components::{Bounds, Components};
use super::parameterization;
use super::training;
use super::vector_quantizer::VectorQuantizer;
use crate::coding::packed::{MAX_PARAMETER, Quantizer, UniformQuantizer};
use crate::gaussian::{MAX_COMPONENTS, Parameterization, component_count};

/// The quantizers of all components during training.
#[derive(Clone, Debug)]
pub(crate) struct LsqQuantizers {
    /// There is none where something else takes the place of LSQ+.
    components: Vec<Option<LsqQuantizer>>,
    /// What takes the place of LSQ+.
    center: Option<Arc<dyn VectorQuantizer>>,
    color: Option<Arc<dyn VectorQuantizer>>,
    bounds: Bounds,
    /// Steps of Adam so far.
    age: i32,
}

/// The quantizer of one component during training.
#[derive(Clone, Copy, Debug)]
struct LsqQuantizer {
    quantizer: UniformQuantizer,
    /// For a logarithmic quantizer, the logarithm of the least value.
    min_logarithm: Option<f32>,
    /// Whether the offset is kept a multiple of the scale, so that a code stands for exactly 0, as an
    /// off-diagonal entry of a covariance needs it.
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
    /// Quantizers whose ranges cover `values`, except for outliers of colour.
    pub(crate) fn new(
        values: &[Components],
        bounds: Bounds,
        options: &training::Quantization,
    ) -> Self {
        let is_covariance = bounds.parameterization == Parameterization::Covariance;
        let is_logarithmic = parameterization::is_logarithmic(bounds.parameterization);
        // A variance is the square of a deviation.
        let power = if is_covariance { 2.0 } else { 1.0 };
        let min_logarithm = power * parameterization::MIN_DEVIATION.ln();
        let logarithms = is_logarithmic.map(|is| is.then_some(min_logarithm));
        let no = Components::by_attribute(false, false, false);
        let min_logarithms =
            Components { shape: logarithms, ..Components::by_attribute(None, None, None) }
                .to_array();
        let has_zero = Components { shape: [false, is_covariance, false], ..no }.to_array();
        let may_clip = Components { color: [true; 4], ..no }.to_array();
        let depths = options.depths().to_array();
        let area = |components: &Components| {
            let [l11, _, l22] = components.gaussian(bounds.parameterization).cholesky;
            f64::from(l11 * l22)
        };
        let areas: Vec<f64> = values.iter().map(area).collect();
        let components = (0..component_count(bounds.channels)).map(|index| {
            let (bits, min_logarithm) = (depths[index]?, min_logarithms[index]);
            let values = values.iter().map(|values| values.to_array()[index]);
            let values = values.map(|value| to_uniform(value, min_logarithm));
            let range = if may_clip[index] {
                least_error_range(&values.zip(areas.iter().copied()), bits)
            } else {
                range(values)
            };
            let mut component = LsqQuantizer {
                quantizer: covering(range, bits),
                min_logarithm,
                has_zero: has_zero[index],
                mean: [0.0; 2],
                square: [0.0; 2],
            };
            component.clamp();
            Some(component)
        });
        let mut quantizers = Self {
            components: components.collect(),
            center: options.center.clone(),
            color: options.color.clone(),
            bounds,
            age: 0,
        };
        quantizers.adapt(values);
        quantizers
    }

    /// The quantizers as the file stores them.
    pub(crate) fn stored(&self) -> Vec<Quantizer> {
        self.components.iter().map(stored).collect()
    }

    /// The codes of a Gaussian. If rounding makes a covariance invalid, the code of its
    /// off-diagonal entry moves towards that of 0 until the covariance is valid.
    pub(crate) fn codes(&self, values: &Components) -> Components<u32> {
        let mut values = *values;
        if let Some(quantizer) = &self.center {
            quantizer.quantize(&mut values.center);
        }
        if let Some(quantizer) = &self.color {
            quantizer.quantize(&mut values.color[..self.bounds.channels]);
        }
        let mut codes = [0; MAX_COMPONENTS];
        for ((code, value), component) in
            codes.iter_mut().zip(values.to_array()).zip(&self.components)
        {
            *code = component.as_ref().map_or(value.to_bits(), |component| component.code(value));
        }
        let mut codes = Components::from_array(codes);
        let off_diagonal = self.components.iter().flatten().find(|component| component.has_zero);
        if let Some(off_diagonal) = off_diagonal
            && !self.is_drawable(&codes)
        {
            // An off-diagonal entry of 0 is always valid: bisect between its code and the rounded
            // one.
            let mut valid = off_diagonal.code(0.0);
            let mut invalid = codes.shape[1];
            while valid.abs_diff(invalid) > 1 {
                codes.shape[1] = u32::midpoint(valid, invalid);
                if self.is_drawable(&codes) {
                    valid = codes.shape[1];
                } else {
                    invalid = codes.shape[1];
                }
            }
            codes.shape[1] = valid;
        }
        codes
    }

    /// The values that the codes of a Gaussian stand for, computed as the decoder does.
    pub(crate) fn decoded(&self, codes: &Components<u32>) -> Components {
        let mut values = [0.0; MAX_COMPONENTS];
        for ((value, code), component) in
            values.iter_mut().zip(codes.to_array()).zip(&self.components)
        {
            *value = stored(component).value(code);
        }
        Components::from_array(values)
    }

    /// The backward pass through the quantizers of a Gaussian, with the straight-through estimator.
    ///
    /// `trained` are the trained values and `decoded` the decoded ones. `by_value` is the gradient by
    /// the decoded values before and by the trained ones after. Returns the gradients by scales and
    /// offsets.
    pub(crate) fn backward(
        &self,
        trained: &Components,
        decoded: &Components,
        by_value: &mut Components,
    ) -> QuantizerGradients {
        if let Some(quantizer) = &self.center {
            quantizer.add_gradient(&trained.center, &mut by_value.center);
        }
        if let Some(quantizer) = &self.color {
            let channels = ..self.bounds.channels;
            quantizer.add_gradient(&trained.color[channels], &mut by_value.color[channels]);
        }
        let mut by_quantizer = [[0.0; 2]; MAX_COMPONENTS];
        let mut gradient = by_value.to_array();
        let [trained, decoded] = [trained, decoded].map(|values| values.to_array());
        for (index, component) in self.components.iter().enumerate() {
            let Some(component) = component else { continue };
            let UniformQuantizer { scale, offset, .. } = component.quantizer;
            let max = component.quantizer.max_code() as f32;
            // The code before it is clamped and rounded.
            let code = (to_uniform(trained[index], component.min_logarithm) - offset) / scale;
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
                by_uniform / if component.min_logarithm.is_some() { trained[index] } else { 1.0 }
            } else {
                0.0
            };
        }
        *by_value = Components::from_array(gradient);
        by_quantizer
    }

    /// Takes one step of Adam on scales and offsets, against gradients summed over the Gaussians
    /// which now have these values.
    pub(crate) fn step(
        &mut self,
        gradients: &QuantizerGradients,
        values: &[Components],
        rate: f32,
    ) {
        self.age += 1;
        let unbias = [1.0 - 0.9_f32.powi(self.age), 1.0 - 0.999_f32.powi(self.age)];
        for (component, gradient) in self.components.iter_mut().zip(gradients) {
            if let Some(component) = component {
                component.step(gradient, values.len(), rate, unbias);
            }
        }
        self.adapt(values);
    }

    fn adapt(&mut self, values: &[Components]) {
        if let Some(quantizer) = &mut self.center {
            let centers: Vec<&[f32]> = values.iter().map(|values| &values.center[..]).collect();
            *quantizer = quantizer.adapted(&centers);
        }
        if let Some(quantizer) = &mut self.color {
            let channels = ..self.bounds.channels;
            let colors: Vec<&[f32]> = values.iter().map(|values| &values.color[channels]).collect();
            *quantizer = quantizer.adapted(&colors);
        }
    }

    /// Whether codes stand for a valid Gaussian.
    fn is_drawable(&self, codes: &Components<u32>) -> bool {
        self.decoded(codes).gaussian(self.bounds.parameterization).is_drawable()
    }
}

/// The values that a decoder would read for trained ones.
pub(super) fn decoded(quantizers: Option<&LsqQuantizers>, trained: &Components) -> Components {
    quantizers.map_or(*trained, |quantizers| quantizers.decoded(&quantizers.codes(trained)))
}

pub(super) fn add(sum: &mut QuantizerGradients, gradients: &QuantizerGradients) {
    for (sum, value) in sum.as_flattened_mut().iter_mut().zip(gradients.as_flattened()) {
        *sum += value;
    }
}

impl LsqQuantizer {
    fn code(&self, value: f32) -> u32 {
        self.quantizer.code(to_uniform(value, self.min_logarithm))
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

/// What the file stores: floats where something else takes the place of LSQ+.
fn stored(component: &Option<LsqQuantizer>) -> Quantizer {
    match component {
        None => Quantizer::Float,
        Some(LsqQuantizer { quantizer, min_logarithm: Some(_), .. }) => Quantizer::Log(*quantizer),
        Some(LsqQuantizer { quantizer, .. }) => Quantizer::Linear(*quantizer),
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
    use proptest::prelude::*;

    use super::*;
    use crate::encode::fit::training::Training;
    use crate::gaussian::SHAPE;
    use crate::testing::config;

    impl LsqQuantizers {
        fn lsq(&self) -> impl Iterator<Item = &LsqQuantizer> {
            self.components.iter().flatten()
        }
    }

    const PARAMETERIZATIONS: [Parameterization; 3] =
        [Parameterization::Covariance, Parameterization::Cholesky, Parameterization::RotationScale];

    fn bounds(parameterization: Parameterization) -> Bounds {
        Bounds::new(parameterization, 3, [300, 200])
    }

    /// Valid Gaussians, from tiny ones to ones as large as the picture, some of them very
    /// elongated.
    fn values(parameterization: Parameterization, count: usize, seed: u64) -> Vec<Components> {
        let mut rng = fastrand::Rng::with_seed(seed);
        let mut number = move |low: f32, high: f32| low + (high - low) * rng.f32();
        (0..count)
            .map(|_| {
                let (s1, s2) = (number(-1.5, 5.0).exp(), number(-1.5, 2.0).exp());
                let factor =
                    Parameterization::RotationScale.to_cholesky([s1, s2, number(-3.0, 3.0)]);
                let center = [number(-5.0, 305.0), number(-5.0, 205.0)];
                let shape = parameterization::from_cholesky(parameterization, factor);
                let [c0, c1, c2] = [(); 3].map(|()| number(-0.5, 1.0));
                let color = [c0, c1, c2, 0.0];
                bounds(parameterization).clamped(Components { center, shape, color })
            })
            .collect()
    }

    proptest! {
        #![proptest_config(config(24))]

        #[test]
        fn no_gaussian_is_lost_by_rounding(seed: u64, shape_bits in 2_u8..=12, drift in -30..30) {
            for parameterization in PARAMETERIZATIONS {
                let values = values(parameterization, 50, seed);
                let mut options = Training::fast(1).quantization;
                options.shape_bits = shape_bits;
                let mut quantizers = LsqQuantizers::new(&values, bounds(parameterization), &options);
                // Training moves scales and offsets.
                let gradient = [[f32::from(drift as i8), -f32::from(drift as i8)]; MAX_COMPONENTS];
                for _ in 0..5 {
                    quantizers.step(&gradient, &values, 0.05);
                }
                for values in &values {
                    let codes = quantizers.codes(values);
                    prop_assert!(quantizers.is_drawable(&codes), "{parameterization:?}: {values:?}");
                    for (code, component) in codes.to_array().iter().zip(quantizers.lsq()) {
                        prop_assert!(*code <= component.quantizer.max_code());
                    }
                }
            }
        }

        #[test]
        fn the_rounding_error_is_at_most_half_a_step(seed: u64) {
            let values = values(Parameterization::Cholesky, 40, seed);
            let options = Training::fast(1).quantization;
            let quantizers =
                LsqQuantizers::new(&values, bounds(Parameterization::Cholesky), &options);
            for values in &values {
                let decoded = quantizers.decoded(&quantizers.codes(values));
                // The ranges of position and shape are covered; outliers of colour are clipped.
                for (index, component) in quantizers.lsq().take(SHAPE.end).enumerate() {
                    let uniform = |values: &Components| {
                        to_uniform(values.to_array()[index], component.min_logarithm)
                    };
                    let error = uniform(&decoded) - uniform(values);
                    prop_assert!(error.abs() <= 0.501 * component.quantizer.scale + 1e-5);
                }
            }
        }
    }

    #[test]
    fn gradients_by_scale_and_offset_are_those_of_lsq_plus() {
        let values = values(Parameterization::Cholesky, 30, 7);
        let options = Training::fast(1).quantization;
        let quantizers = LsqQuantizers::new(&values, bounds(Parameterization::Cholesky), &options);
        // A colour inside, below and above the range.
        let of_color = quantizers.lsq().nth(SHAPE.end).expect("it is quantized").quantizer;
        let UniformQuantizer { scale, offset, .. } = of_color;
        let max = of_color.max_code() as f32;
        for (position, by_scale, by_offset, by_value) in
            [(3.25, -0.25, 0.0, 1.0), (-2.0, 0.0, 1.0, 0.0), (max + 2.0, max, 1.0, 0.0)]
        {
            let mut trained = values[0];
            trained.color[0] = offset + position * scale;
            let decoded = quantizers.decoded(&quantizers.codes(&trained));
            let mut gradient = Components::ZERO;
            gradient.color[0] = 2.0;
            let by_quantizer = quantizers.backward(&trained, &decoded, &mut gradient);
            let by_quantizer = by_quantizer[SHAPE.end];
            assert!((by_quantizer[0] - 2.0 * by_scale).abs() < 1e-3, "scale at {position}");
            assert_eq!(by_quantizer[1], 2.0 * by_offset, "offset at {position}");
            assert_eq!(gradient.color[0], 2.0 * by_value, "value at {position}");
        }
        // A logarithmic quantizer passes the gradient as if nothing were rounded in the logarithm.
        let decoded = quantizers.decoded(&quantizers.codes(&values[0]));
        let mut gradient = Components::by_attribute(1.0, 1.0, 1.0);
        quantizers.backward(&values[0], &decoded, &mut gradient);
        assert!((gradient.shape[0] - decoded.shape[0] / values[0].shape[0]).abs() < 1e-5);
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
        let values = values(Parameterization::Cholesky, 9, 5);
        let mut options = Training::fast(1).quantization;
        options.color = Some(Arc::new(Halving(1.0)));
        let mut quantizers =
            LsqQuantizers::new(&values, bounds(Parameterization::Cholesky), &options);
        assert_eq!(quantizers.stored()[SHAPE.end..], [Quantizer::Float; 3]);
        let color = [0.3125, -0.5625, 0.9375, 0.0];
        let trained = Components { center: [30.0, 20.0], shape: [2.0, 0.0, 2.0], color };
        let decoded = quantizers.decoded(&quantizers.codes(&trained));
        assert_eq!(decoded.color, [0.5, -0.5, 1.0, 0.0]);
        let mut gradient = Components::by_attribute(1.0, 1.0, 1.0);
        let by_quantizer = quantizers.backward(&trained, &decoded, &mut gradient);
        assert_eq!(gradient.color[..3], [1.3125, 0.4375, 1.9375]);
        quantizers.step(&by_quantizer, &values, 1e-3);
        let decoded = quantizers.decoded(&quantizers.codes(&trained));
        assert_eq!(decoded.color, [0.25, -0.5, 1.0, 0.0]);
    }

    #[test]
    fn equal_values_are_kept_exactly() {
        let trained = values(Parameterization::Cholesky, 1, 3)[0];
        let options = Training::fast(1).quantization;
        let quantizers =
            LsqQuantizers::new(&[trained; 9], bounds(Parameterization::Cholesky), &options);
        let decoded = quantizers.decoded(&quantizers.codes(&trained));
        for (decoded, value) in decoded.to_array().iter().zip(trained.to_array()) {
            assert!((decoded - value).abs() <= 1e-6 * value.abs());
        }
        for quantizer in
            LsqQuantizers::new(&[], bounds(Parameterization::Cholesky), &options).stored()
        {
            assert!(quantizer.value(0).is_finite());
        }
    }
}
