//! Renders one file from more and more of its bytes, side by side: a picture of what "any beginning of
//! the file is a picture" means. For pictures without alpha.
//!
//!     cargo run --release --example montage -- photo.gip montage.png

use std::error::Error;

use image::codecs::png::{CompressionType, FilterType, PngEncoder};
use image::{Rgb, RgbImage, imageops};
use image_gip::{ColorModel, RenderOptions, StreamDecoder};

/// The shares of the file that are shown.
const SHARES: [f64; 3] = [0.2, 0.5, 1.0];

/// Pixels between two pictures.
const GAP: u32 = 4;

fn main() -> Result<(), Box<dyn Error>> {
    let arguments: Vec<String> = std::env::args().skip(1).collect();
    let [input, output] = arguments.as_slice() else {
        return Err("usage: montage INPUT.gip OUTPUT.png".into());
    };
    let file = std::fs::read(input)?;
    let mut stream = StreamDecoder::new();
    let mut fed = 0;
    let mut parts = Vec::new();
    for share in SHARES {
        let bytes = (share * file.len() as f64).ceil() as usize;
        stream.feed(&file[fed..bytes])?;
        fed = bytes;
        let picture = stream.picture().ok_or("too little to know the size")?;
        let mut part = RgbImage::new(picture.header().width, picture.header().height);
        picture.render_u8(&RenderOptions::new().with_color(ColorModel::Rgb), &mut part)?;
        println!("{bytes} bytes, {} Gaussians", stream.gaussians().len());
        parts.push(part);
    }

    let (width, height) = parts[0].dimensions();
    let columns = parts.len() as u32;
    let mut montage = RgbImage::from_pixel((width + GAP) * columns - GAP, height, Rgb([255; 3]));
    for (column, part) in (0..).zip(&parts) {
        imageops::replace(&mut montage, part, i64::from(column * (width + GAP)), 0);
    }
    let file = std::fs::File::create(output)?;
    let best = PngEncoder::new_with_quality(file, CompressionType::Best, FilterType::Adaptive);
    montage.write_with_encoder(best)?;
    Ok(())
}
