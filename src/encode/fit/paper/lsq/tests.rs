//! Tests of LSQ+.

use proptest::prelude::*;

use super::*;
use crate::encode::fit::training::Training;
use crate::encode::testing::PARAMETERIZATIONS;
use crate::testing::config;

impl LsqQuantizers {
    fn lsq(&self) -> impl Iterator<Item = &LsqQuantizer> {
        self.components.iter().flatten()
    }
}

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
            let factor = Parameterization::RotationScale.to_cholesky([s1, s2, number(-3.0, 3.0)]);
            let center = [number(-5.0, 305.0), number(-5.0, 205.0)];
            let shape = parameterization.shape_of(factor);
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
    let mut quantizers = LsqQuantizers::new(&values, bounds(Parameterization::Cholesky), &options);
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
    for quantizer in LsqQuantizers::new(&[], bounds(Parameterization::Cholesky), &options).stored()
    {
        assert!(quantizer.value(0).is_finite());
    }
}
