//! Stores colours with a quantizer of one's own in place of LSQ+, and compares the two.
//!
//!     cargo run --release --example own_quantizer -- picture.png

use std::{env, error::Error, sync::Arc};

use image_gip::training::{Training, VectorQuantizer};
use image_gip::{ColorModel, Encoder, Precision, Source, Target, Tune};

/// Square roots in even steps: weak colours, of which there are more, are finer than strong ones.
#[derive(Debug)]
struct SquareRoots {
    step: f32,
}

impl VectorQuantizer for SquareRoots {
    fn adapted(&self, trained: &[&[f32]]) -> Arc<dyn VectorQuantizer> {
        let colors = trained.iter().flat_map(|color| color.iter());
        let largest = colors.fold(0.0_f32, |largest, value| largest.max(value.abs()));
        Arc::new(Self { step: largest.sqrt().max(1e-6) / 31.5 })
    }

    fn quantize(&self, color: &mut [f32]) {
        for value in color {
            let root = (value.abs().sqrt() / self.step).round() * self.step;
            *value = value.signum() * root * root;
        }
    }
}

fn main() -> Result<(), Box<dyn Error>> {
    let picture = image::open(env::args().nth(1).ok_or("which picture?")?)?.to_rgb8();
    let (width, height) = picture.dimensions();
    let source = Source::new_u8(width, height, ColorModel::Rgb, &picture)?;
    let own: Arc<dyn VectorQuantizer> = Arc::new(SquareRoots { step: 0.1 });
    for (name, color) in [("LSQ+", None), ("square roots", Some(own))] {
        let mut training = Training::fast(400);
        training.quantization.color = color;
        let encoder = Encoder::new().with_precision(Precision::Packed).with_training(training);
        let encoder =
            encoder.with_tune(Tune::Psnr).with_target(Target::Gaussians(width * height / 100));
        println!("{name}, 6 bits a channel: {:.2} dB", encoder.encode(&source)?.report.psnr);
    }
    Ok(())
}
