//! Quantization-aware training with LSQ+: learnable scale and offset per component, straight-
//! through rounding (paper, section "Compression Framework"; Bhalgat et al., LSQ+, 2020).
//!
//! What training sees is what the file stores: values go through the very quantizers that are
//! written and the very function that the decoder calls.

use super::adam::{Domain, Row};
use super::parameterization;
use super::training;
use crate::coding::packed::{MAX_PARAMETER, Quantizer, UniformQuantizer};
use crate::gaussian::{Gaussian, MAX_COMPONENTS, Parameterization};

/// The quantizers of all components while they are trained.
#[derive(Clone, Debug)]
pub(crate) struct LsqQuantizers {
    components: Vec<Component>,
    parameterization: Parameterization,
    steps: i32,
}

#[derive(Clone, Copy, Debug)]
struct Component {
    steps: UniformQuantizer,
    /// The logarithm of the least value, for components that are quantized by their logarithm.
    least: Option<f32>,
    /// The offset is kept a multiple of the scale, so that zero has a code of its own.
    has_zero: bool,
    /// Adam's means and mean squares of the gradients by scale and offset.
    mean: [f32; 2],
    square: [f32; 2],
}

/// Gradients by the scale and the offset of every component.
pub(crate) type QuantizerGradients = [[f32; 2]; MAX_COMPONENTS];

impl LsqQuantizers {
    /// LsqQuantizers that cover `rows`.
    pub(crate) fn new(rows: &[Row], bounds: Domain, options: &training::Quantization) -> Self {
        let logarithmic = parameterization::logarithmic(bounds.parameterization);
        // Variances are squares of deviations.
        let power = if bounds.parameterization == Parameterization::Covariance { 2.0 } else { 1.0 };
        let least = power * parameterization::MIN_DEVIATION.ln();
        let components = (0..5 + bounds.channels).map(|index| {
            let (bits, least, has_zero) = match index {
                0 | 1 => (options.position_bits, None, false),
                2..5 => {
                    let has_zero =
                        bounds.parameterization == Parameterization::Covariance && index == 3;
                    (options.shape_bits, logarithmic[index - 2].then_some(least), has_zero)
                }
                _ => (options.color_bits, None, false),
            };
            let values = rows.iter().map(|row| domain(row[index], least));
            let (low, high) = if index < 5 { range(values) } else { bulk(values) };
            let mut component = Component {
                steps: UniformQuantizer { bits, scale: 1.0, offset: low },
                least,
                has_zero,
                mean: [0.0; 2],
                square: [0.0; 2],
            };
            component.steps.scale = (high - low) / component.steps.max_code() as f32;
            component.confine();
            component
        });
        Self {
            components: components.collect(),
            parameterization: bounds.parameterization,
            steps: 0,
        }
    }

    /// The quantizers as the file stores them.
    pub(crate) fn stored(&self) -> Vec<Quantizer> {
        self.components.iter().map(Component::stored).collect()
    }

    /// The codes of a Gaussian. Where rounding makes its shape none that is drawn, the covariance
    /// moves towards the axes until it is.
    pub(crate) fn codes(&self, row: &Row) -> [u32; MAX_COMPONENTS] {
        let mut codes = [0; MAX_COMPONENTS];
        for ((code, &value), component) in codes.iter_mut().zip(row).zip(&self.components) {
            *code = component.steps.code(domain(value, component.least));
        }
        if self.parameterization == Parameterization::Covariance && !self.is_drawable(&codes) {
            // Zero covariance is always sound; find the sound code next to the rounded one.
            let mut sound = self.components[3].steps.code(0.0);
            let mut unsound = codes[3];
            while sound.abs_diff(unsound) > 1 {
                codes[3] = u32::midpoint(sound, unsound);
                if self.is_drawable(&codes) {
                    sound = codes[3];
                } else {
                    unsound = codes[3];
                }
            }
            codes[3] = sound;
        }
        codes
    }

    /// The values that the codes of a Gaussian stand for.
    pub(crate) fn decoded(&self, codes: &[u32; MAX_COMPONENTS]) -> Row {
        let mut row = [0.0; MAX_COMPONENTS];
        for ((value, &code), component) in row.iter_mut().zip(codes).zip(&self.components) {
            *value = component.stored().value(code);
        }
        row
    }

    /// Turns the gradient by decoded values into the gradient by the trained ones, and returns
    /// the gradients by scales and offsets.
    pub(crate) fn backward(
        &self,
        row: &Row,
        decoded: &Row,
        gradient: &mut Row,
    ) -> QuantizerGradients {
        let mut by_steps = [[0.0; 2]; MAX_COMPONENTS];
        for (index, component) in self.components.iter().enumerate() {
            let UniformQuantizer { scale, offset, .. } = component.steps;
            let max = component.steps.max_code() as f32;
            let position = (domain(row[index], component.least) - offset) / scale;
            let mut by_domain = gradient[index];
            if component.least.is_some() {
                by_domain *= decoded[index];
            }
            by_steps[index] = if position < 0.0 {
                [0.0, by_domain]
            } else if position > max {
                [by_domain * max, by_domain]
            } else {
                [by_domain * (position.round_ties_even() - position), 0.0]
            };
            gradient[index] = if (0.0..=max).contains(&position) {
                by_domain / if component.least.is_some() { row[index] } else { 1.0 }
            } else {
                0.0
            };
        }
        by_steps
    }

    /// Takes one step of Adam on scales and offsets.
    pub(crate) fn step(&mut self, gradients: &QuantizerGradients, count: usize, rate: f32) {
        self.steps += 1;
        let unbias = [1.0 - 0.9_f32.powi(self.steps), 1.0 - 0.999_f32.powi(self.steps)];
        for (component, gradient) in self.components.iter_mut().zip(gradients) {
            component.step(gradient, count, rate, unbias);
        }
    }

    fn is_drawable(&self, codes: &[u32; MAX_COMPONENTS]) -> bool {
        let row = self.decoded(codes);
        Gaussian::from_components(&row[..self.components.len()], self.parameterization)
            .is_drawable()
    }
}

impl Component {
    fn stored(&self) -> Quantizer {
        match self.least {
            Some(_) => Quantizer::Log(self.steps),
            None => Quantizer::Linear(self.steps),
        }
    }

    fn step(&mut self, gradient: &[f32; 2], count: usize, rate: f32, unbias: [f32; 2]) {
        // LSQ's scaling of the gradient, which keeps the steps of a plain optimizer in proportion
        // to those of the weights; Adam normalizes it away.
        let scaling = 1.0 / (count as f32 * self.steps.max_code() as f32).sqrt();
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
        let scale = self.steps.scale;
        self.steps.scale -= steps[0] * scale;
        self.steps.offset -= steps[1] * scale;
        self.confine();
    }

    /// Keeps scale and offset within what a decoder accepts, and decoded values within what it
    /// draws.
    fn confine(&mut self) {
        let UniformQuantizer { bits: _, scale, offset } = &mut self.steps;
        *scale = scale.clamp(1e-9, MAX_PARAMETER);
        *offset = offset.clamp(-MAX_PARAMETER, MAX_PARAMETER);
        if let Some(least) = self.least {
            *offset = offset.max(least);
        }
        if self.has_zero {
            let zero = (-*offset / *scale).round().clamp(0.0, self.steps.max_code() as f32);
            self.steps.offset = -zero * self.steps.scale;
        }
    }
}

/// A value in the domain in which it is quantized uniformly.
fn domain(value: f32, least: Option<f32>) -> f32 {
    // The bound serves the paper's covariance on its way out of the positive definite ones.
    if least.is_some() { value.max(1e-9).ln() } else { value }
}

/// The least and the largest value; [0, 0] of none.
fn range(values: impl Iterator<Item = f32>) -> (f32, f32) {
    values
        .fold(None, |range: Option<(f32, f32)>, value| match range {
            None => Some((value, value)),
            Some((low, high)) => Some((low.min(value), high.max(value))),
        })
        .unwrap_or_default()
}

/// Three standard deviations to both sides of the mean, inside the range: LSQ+'s start for values
/// with long tails.
fn bulk(values: impl Iterator<Item = f32> + Clone) -> (f32, f32) {
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

    fn bounds(parameterization: Parameterization) -> Domain {
        Domain { parameterization, channels: 3, size: Vec2::new(300.0, 200.0) }
    }

    /// Sound Gaussians, from tiny to as large as the picture, needles among them.
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
                bounds(parameterization).confined(row)
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
                // Scales and offsets as training may have moved them.
                let gradient = [[f32::from(drift as i8), -f32::from(drift as i8)]; MAX_COMPONENTS];
                for _ in 0..5 {
                    quantizers.step(&gradient, rows.len(), 0.05);
                }
                for row in &rows {
                    let codes = quantizers.codes(row);
                    prop_assert!(quantizers.is_drawable(&codes), "{parameterization:?}: {row:?}");
                    for (code, component) in codes.iter().zip(&quantizers.components) {
                        prop_assert!(*code <= component.steps.max_code());
                    }
                }
            }
        }

        #[test]
        fn rounding_errs_by_half_a_step(seed: u64) {
            let rows = rows(Parameterization::Cholesky, 40, seed);
            let options = Training::fast(1).quantization;
            let quantizers = LsqQuantizers::new(&rows, bounds(Parameterization::Cholesky), &options);
            for row in &rows {
                let decoded = quantizers.decoded(&quantizers.codes(row));
                // Position and shape cover their whole range; colours are clipped on purpose.
                for (index, component) in quantizers.components.iter().enumerate().take(5) {
                    let least = component.least;
                    let error = domain(decoded[index], least) - domain(row[index], least);
                    prop_assert!(error.abs() <= 0.501 * component.steps.scale + 1e-5);
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
        let UniformQuantizer { scale, offset, .. } = quantizers.components[5].steps;
        let max = quantizers.components[5].steps.max_code() as f32;
        for (position, by_scale, by_offset, passes) in
            [(3.25, -0.25, 0.0, 1.0), (-2.0, 0.0, 1.0, 0.0), (max + 2.0, max, 1.0, 0.0)]
        {
            let mut row = rows[0];
            row[5] = offset + position * scale;
            let decoded = quantizers.decoded(&quantizers.codes(&row));
            let mut gradient = [0.0; MAX_COMPONENTS];
            gradient[5] = 2.0;
            let by_steps = quantizers.backward(&row, &decoded, &mut gradient);
            assert!((by_steps[5][0] - 2.0 * by_scale).abs() < 1e-3, "scale at {position}");
            assert_eq!(by_steps[5][1], 2.0 * by_offset, "offset at {position}");
            assert_eq!(gradient[5], 2.0 * passes, "value at {position}");
        }
        // Through the logarithm the gradient passes as if nothing had been rounded.
        let decoded = quantizers.decoded(&quantizers.codes(&rows[0]));
        let mut gradient = [1.0; MAX_COMPONENTS];
        quantizers.backward(&rows[0], &decoded, &mut gradient);
        assert!((gradient[2] - decoded[2] / rows[0][2]).abs() < 1e-5);
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
