//! The SSIMULACRA2 of a picture, for `placeholders.mjs`: both are files of 8-bit samples, red, green, blue.
//!
//!     quality WIDTH HEIGHT WANTED FOUND

use std::error::Error;

use fast_ssim2::{PixelDescriptor, PixelSlice, compute_ssimulacra2};

fn main() -> Result<(), Box<dyn Error>> {
    let arguments: Vec<String> = std::env::args().skip(1).collect();
    let [width, height, wanted, found] = arguments.as_slice() else {
        return Err("usage: quality WIDTH HEIGHT WANTED FOUND".into());
    };
    let (width, height): (u32, u32) = (width.parse()?, height.parse()?);
    let [wanted, found] = [std::fs::read(wanted)?, std::fs::read(found)?];
    let pixels = |samples| {
        let stride = width as usize * 3;
        PixelSlice::new(samples, width, height, stride, PixelDescriptor::RGB8_SRGB)
            .map_err(|error| error.to_string())
    };
    let quality = compute_ssimulacra2(&pixels(&wanted)?, &pixels(&found)?);
    println!("{}", quality.map_err(|error| error.to_string())?);
    Ok(())
}
