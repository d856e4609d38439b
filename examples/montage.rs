//! Renders one file with more and more of its Gaussians, side by side: a picture of what "any
//! beginning of the file is a picture" means. For pictures without alpha.
//!
//!     cargo run --release --example montage -- photo.gip montage.png

use std::error::Error;

use image::codecs::png::{CompressionType, FilterType, PngEncoder};
use image::{Rgb, RgbImage, imageops};
use image_gip::{ColorModel, Decoder, RenderOptions};

/// The shares of the Gaussians that are shown.
const SHARES: [f64; 4] = [0.02, 0.1, 0.4, 1.0];

/// Pixels between two pictures.
const GAP: u32 = 4;

fn main() -> Result<(), Box<dyn Error>> {
    let arguments: Vec<String> = std::env::args().skip(1).collect();
    let [input, output] = arguments.as_slice() else {
        return Err("usage: montage INPUT.gip OUTPUT.png".into());
    };
    let mut decoder = Decoder::new(std::fs::File::open(input)?)?;
    decoder.read_to_end()?;
    let picture = decoder.picture();
    let (width, height) = (picture.header().width, picture.header().height);

    let mut montage =
        RgbImage::from_pixel((width + GAP) * SHARES.len() as u32 - GAP, height, Rgb([255; 3]));
    for (column, share) in (0..).zip(SHARES) {
        let count = (f64::from(picture.header().gaussians) * share).ceil() as u32;
        let options = RenderOptions::new().prefix(count).color(ColorModel::Rgb);
        let mut part = RgbImage::new(width, height);
        picture.render_u8(&options, &mut part)?;
        imageops::replace(&mut montage, &part, i64::from(column * (width + GAP)), 0);
        println!("{count} Gaussians");
    }
    let file = std::fs::File::create(output)?;
    let best = PngEncoder::new_with_quality(file, CompressionType::Best, FilterType::Adaptive);
    montage.write_with_encoder(best)?;
    Ok(())
}
