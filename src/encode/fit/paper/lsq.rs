//! Quantization-aware training (QAT) with LSQ+: every component has a learnable scale and offset,
//! and gradients pass the rounding by the straight-through estimator (paper, section "Compression
//! Framework"; Bhalgat et al., LSQ+, 2020).
//!
//! Training renders exactly what the file will hold: the values pass through the same quantizers
//! that the file stores, and are decoded by the same function that the decoder calls.

use core::ops::Range;
use std::sync::Arc;

use super::ranges::{MIN_SCALE, covering, least_error_range, range};
use super::vector_quantizer::VectorQuantizer;
use crate::coding::packed::{MAX_PARAMETER, Quantizer, UniformQuantizer};
use crate::encode::fit::components::{Bounds, Components};
use crate::encode::fit::{parameterization, training};
use crate::gaussian::{CENTER, MAX_COMPONENTS, Parameterization, SHAPE, component_count};

/// The quantizers of all components during training.
#[derive(Clone, Debug)]
pub(crate) struct LsqQuantizers {
    /// There is none where something else takes the place of LSQ+.
    components: Vec<Option<LsqQuantizer>>,
    /// What takes the place of LSQ+, with the components that it quantizes.
    others: Vec<(Range<usize>, Arc<dyn VectorQuantizer>)>,
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
        let is_logarithmic = bounds.parameterization.is_logarithmic();
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
        let center = options.center.clone().map(|other| (CENTER, other));
        let color = SHAPE.end..component_count(bounds.channels);
        let color = options.color.clone().map(|other| (color, other));
        let others = center.into_iter().chain(color).collect();
        let mut quantizers = Self { components: components.collect(), others, bounds, age: 0 };
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
        let mut values = values.to_array();
        for (range, other) in &self.others {
            other.quantize(&mut values[range.clone()]);
        }
        let mut codes = [0; MAX_COMPONENTS];
        for ((code, value), component) in codes.iter_mut().zip(values).zip(&self.components) {
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
        let mut by_quantizer = [[0.0; 2]; MAX_COMPONENTS];
        let mut gradient = by_value.to_array();
        let [trained, decoded] = [trained, decoded].map(|values| values.to_array());
        for (range, other) in &self.others {
            other.add_gradient(&trained[range.clone()], &mut gradient[range.clone()]);
        }
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
        for (range, other) in &mut self.others {
            let values: Vec<_> = values.iter().map(|values| values.to_array()).collect();
            let values: Vec<_> = values.iter().map(|values| &values[range.clone()]).collect();
            *other = other.adapted(&values);
        }
    }

    /// Whether codes stand for a valid Gaussian.
    fn is_drawable(&self, codes: &Components<u32>) -> bool {
        self.decoded(codes).gaussian(self.bounds.parameterization).is_drawable()
    }
}

/// The values that a decoder would read for trained ones.
pub(in crate::encode::fit) fn decoded(
    quantizers: Option<&LsqQuantizers>,
    trained: &Components,
) -> Components {
    quantizers.map_or(*trained, |quantizers| quantizers.decoded(&quantizers.codes(trained)))
}

pub(in crate::encode::fit) fn add(sum: &mut QuantizerGradients, gradients: &QuantizerGradients) {
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

#[cfg(test)]
mod tests;
