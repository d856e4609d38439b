//! Puts new Gaussians where a rule of one's own says, and compares it with the encoder's rule and the paper's.
//!
//!     cargo run --release --example own_placement -- picture.png

use std::{env, error::Error, sync::Arc};

use image_gip::training::{CustomPlacement, ErrorMap, NewColor, Placement, Training};
use image_gip::{ColorModel, Encoder, Precision, Source, Target, Tune};

/// The worst pixel of each of `count` squares.
#[derive(Debug)]
struct WorstOfSquares;

impl CustomPlacement for WorstOfSquares {
    fn pixels(&self, count: usize, map: &ErrorMap) -> Vec<u32> {
        let side = ((map.errors.len() as f64 / count as f64).sqrt().ceil() as usize).max(1);
        let columns = map.width.div_ceil(side);
        let mut worst = vec![(0.0, 0); columns * map.height.div_ceil(side)];
        for (pixel, &error) in map.errors.iter().enumerate() {
            let (x, y) = (pixel % map.width, pixel / map.width);
            let square = &mut worst[y / side * columns + x / side];
            if error > square.0 {
                *square = (error, pixel as u32);
            }
        }
        worst.into_iter().filter(|&(error, _)| error > 0.0).map(|(_, pixel)| pixel).collect()
    }
}

fn main() -> Result<(), Box<dyn Error>> {
    let picture = image::open(env::args().nth(1).ok_or("which picture?")?)?.to_rgb8();
    let (width, height) = picture.dimensions();
    let source = Source::new_u8(width, height, ColorModel::Rgb, &picture)?;
    let own = Placement::Custom(Arc::new(WorstOfSquares));
    for placement in [Placement::Spread, Placement::Top, own] {
        let mut training = Training::fast(200);
        training.densification.color = match placement {
            Placement::Top => NewColor::Zero,
            _ => training.densification.color,
        };
        training.densification.placement = placement.clone();
        let encoder = Encoder::new().with_precision(Precision::Float).with_training(training);
        let encoder =
            encoder.with_tune(Tune::Psnr).with_target(Target::Gaussians(width * height / 100));
        println!("{placement:?}: {:.2} dB", encoder.encode(&source)?.report.psnr_float);
    }
    Ok(())
}
