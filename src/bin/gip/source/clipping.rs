//! Floats that have no place between black and white.

use std::ops::RangeInclusive;

use image::DynamicImage;

/// From 0 to 1, and half a step of 8 bits around, which nobody misses.
const KEPT: RangeInclusive<f32> = -1.0 / 512.0..=1.0 + 1.0 / 512.0;
/// The share of samples that may be clipped without a word.
const FEW: f64 = 0.001;

/// What is lost of these floats, of which those from 0 to 1 are kept.
pub(super) fn warning(samples: impl Iterator<Item = f32>) -> Option<String> {
    let (mut all, mut clipped, mut invalid) = (0_u64, 0_u64, 0_u64);
    let (mut least, mut most) = (f32::INFINITY, f32::NEG_INFINITY);
    for sample in samples {
        all += 1;
        invalid += u64::from(sample.is_nan());
        clipped += u64::from(!sample.is_nan() && !KEPT.contains(&sample));
        (least, most) = (least.min(sample), most.max(sample));
    }
    let percent = |count: u64| format!("{:.2} %", count as f64 * 100.0 / all as f64);
    let clipped = (clipped as f64 > all as f64 * FEW).then(|| {
        let percent = percent(clipped);
        format!("{percent} of its samples, which are from {least} to {most}, are clipped to 0 to 1")
    });
    let invalid = (invalid > 0).then(|| {
        let percent = percent(invalid);
        format!("{percent} of its samples are not a number (NaN), and are taken as 0")
    });
    let both: Vec<_> = clipped.into_iter().chain(invalid).collect();
    (!both.is_empty()).then(|| both.join("; "))
}

/// [`warning`] of a picture, if it has floats.
pub(super) fn warning_of(image: &DynamicImage) -> Option<String> {
    match image {
        DynamicImage::ImageRgb32F(image) => warning(image.iter().copied()),
        DynamicImage::ImageRgba32F(image) => warning(image.iter().copied()),
        _ => None,
    }
}
