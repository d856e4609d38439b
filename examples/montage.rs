//! Renders one file with more and more of its Gaussians, side by side: a picture of what "any
//! beginning of the file is a picture" means.
//!
//!     cargo run --release --example montage -- photo.gip montage.png

use std::error::Error;

use image::{RgbaImage, imageops};
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

    let mut montage = RgbaImage::new((width + GAP) * SHARES.len() as u32 - GAP, height);
    for (column, share) in (0..).zip(SHARES) {
        let count = (f64::from(picture.header().gaussians) * share).ceil() as u32;
        let options = RenderOptions::new().prefix(count).color(ColorModel::Rgba);
        let mut part = RgbaImage::new(width, height);
        picture.render_u8(&options, &mut part)?;
        imageops::replace(&mut montage, &part, i64::from(column * (width + GAP)), 0);
        println!("{count} Gaussians");
    }
    montage.save(output)?;
    Ok(())
}
