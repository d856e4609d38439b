//! The encoder's memory, counted as it is allocated. One test only: what others allocate at the
//! same time would count, too.

mod common;

use std::alloc::System;

use cap::Cap;
use common::memory::peak;
use image_gip::{ColorModel, Encoder, Precision, Source, Target};

#[global_allocator]
static MEMORY: Cap<System> = Cap::new(System, usize::MAX);

/// Waves of many lengths, so that any number of Gaussians finds something to show.
fn waves(width: u32, height: u32) -> Vec<u8> {
    let mut samples = Vec::new();
    for y in 0..height {
        for x in 0..width {
            let (x, y) = (x as f32, y as f32);
            let waves = (0.002 * x * y).sin() + (0.31 * x).cos() * (0.27 * y).sin();
            samples.extend([40.0, 30.0, 20.0].map(|height| (128.0 + height * waves) as u8));
        }
    }
    samples
}

#[test]
fn a_pixel_takes_16_bytes_and_a_gaussian_330() {
    let pool = rayon::ThreadPoolBuilder::new().num_threads(2).build().expect("threads");
    for (width, height, gaussians) in [(600, 400, 1_000), (400, 250, 5_000), (400, 250, 20_000)] {
        let samples = waves(width, height);
        let source = Source::new_u8(width, height, ColorModel::Rgb, &samples).expect("sizes agree");
        for precision in [Precision::Float, Precision::Packed, Precision::Entropy] {
            let encoder = Encoder::new()
                .with_effort(1)
                .with_target(Target::Gaussians(gaussians))
                .with_precision(precision);
            let (encoded, peak) = peak(&MEMORY, || pool.install(|| encoder.encode(&source)));
            let encoded = encoded.expect("a sound picture");
            let case = format!("{width}x{height}, {gaussians} Gaussians, {precision:?}");
            let found = encoded.report.gaussians;
            // Most of the others are dropped by the descent, after the peak.
            assert!(found > gaussians / 4, "{case}: only {found} are used");
            let allowed = 16 * u64::from(width * height) + 330 * u64::from(gaussians);
            assert!(peak <= allowed, "{case}: {peak} bytes held, {allowed} allowed");
            let reported = encoded.report.peak_memory as f64 / peak as f64;
            assert!((0.8..=1.2).contains(&reported), "{case}: {reported} of it reported");
        }
    }
}
