//! Encodes a picture in memory to `.gip` and decodes it again.
//!
//!     cargo run --release --example encode_decode

use std::error::Error;

use image_gip::{ColorModel, Decoder, Encoder, Source, Target};

fn main() -> Result<(), Box<dyn Error>> {
    // A soft blob on a ramp, 96x64 pixels of RGB.
    let (width, height) = (96_u32, 64_u32);
    let mut pixels = Vec::new();
    for y in 0..height {
        for x in 0..width {
            let (dx, dy) = (x as f32 - 60.0, y as f32 - 28.0);
            let blob = 180.0 / (1.0 + (dx * dx + dy * dy) / 200.0);
            pixels.extend([blob as u8, (x + 40) as u8, (y * 2 + 60) as u8]);
        }
    }

    let source = Source::new_u8(width, height, ColorModel::Rgb, &pixels)?;
    let encoded = Encoder::new().with_target(Target::Gaussians(150)).encode(&source)?;
    let report = &encoded.report;
    println!(
        "{} bytes of samples became {} bytes: {} Gaussians, {:.2} dB",
        pixels.len(),
        encoded.bytes.len(),
        report.gaussians,
        report.psnr
    );

    // Any `Read` will do: a file, a socket, a slice.
    let mut decoder = Decoder::new(encoded.bytes.as_slice())?;
    let mut decoded = vec![0; decoder.output_len()?];
    decoder.decode_into(&mut decoded)?;

    let errors = pixels.iter().zip(&decoded).map(|(a, b)| a.abs_diff(*b));
    println!("the largest difference of a sample is {}", errors.max().unwrap_or(0));
    Ok(())
}
