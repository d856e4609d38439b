//! Lets errors near the middle of a picture count more, and tells what that brings there at the same size.
//!
//!     cargo run --release --example own_loss -- picture.png

use std::{env, error::Error, sync::Arc};

use image_gip::{
    ColorModel, Decoder, Encoder, Importance, Region, RenderOptions, Source, Target, metrics,
};

/// Errors within a circle count eight times as much.
#[derive(Debug)]
struct Spotlight {
    center: [f32; 2],
    radius: f32,
}

impl Importance for Spotlight {
    fn at(&self, [x, y]: [f32; 2]) -> f32 {
        let distance = (x - self.center[0]).hypot(y - self.center[1]);
        if distance < self.radius { 8.0 } else { 1.0 }
    }
}

fn main() -> Result<(), Box<dyn Error>> {
    let picture = image::open(env::args().nth(1).ok_or("which picture?")?)?.to_rgb8();
    let (width, height) = picture.dimensions();
    let source = Source::new_u8(width, height, ColorModel::Rgb, &picture)?;
    let center = [width as f32 / 2.0, height as f32 / 2.0];
    let spotlight = Spotlight { center, radius: 0.2 * width.min(height) as f32 };
    let encoder = Encoder::new().with_target(Target::BitsPerPixel(0.3));
    let own = encoder.clone().with_importance(Some(Arc::new(spotlight)));
    for (name, encoder) in [("everywhere the same", encoder), ("spotlight", own)] {
        let encoded = encoder.encode(&source)?;
        // A square within the circle.
        let side = width.min(height) / 4;
        let middle =
            Region { x: (width - side) / 2, y: (height - side) / 2, width: side, height: side };
        let mut decoder = Decoder::new(encoded.bytes.as_slice())?;
        decoder.set_options(RenderOptions::new().with_region(middle));
        let mut decoded = vec![0; decoder.output_len()?];
        decoder.decode_into(&mut decoded)?;
        let Region { x, y, .. } = middle;
        let original = image::imageops::crop_imm(&picture, x, y, side, side).to_image();
        let psnr = metrics::psnr(&decoded, &original, 255.0);
        println!("{name}: {:.2} dB, {psnr:.2} dB in the middle", encoded.report.psnr);
    }
    Ok(())
}
