//! Hands the Gaussians to a renderer of your own, a game engine's or a GPU's: eight 32-bit floats
//! each, as an instance buffer wants them.
//!
//!     cargo run --release --no-default-features --features decode,std --example gaussians -- \
//!         photo.gip photo.bin
//!
//! They are x, y, the conic a, b, c, and the colour. A pixel is the base colour plus, for every
//! Gaussian, its colour times `(1 - q / 4)^2` where q < 4, with
//! `q = a dx dx + 2 b dx dy + c dy dy` (spec/gip.md, section 9).

use std::error::Error;
use std::fs::File;
use std::io::{BufReader, BufWriter, Write};

use image_gip::Decoder;

fn main() -> Result<(), Box<dyn Error>> {
    let arguments: Vec<String> = std::env::args().skip(1).collect();
    let [input, output] = arguments.as_slice() else {
        return Err("usage: gaussians INPUT.gip OUTPUT.bin".into());
    };
    let mut decoder = Decoder::new(BufReader::new(File::open(input)?))?;
    decoder.read_to_end()?;
    let picture = decoder.picture()?;
    let header = picture.header();
    let mut file = BufWriter::new(File::create(output)?);
    for gaussian in picture.gaussians() {
        let [x, y] = gaussian.center;
        let [a, b, c] = gaussian.conic();
        // Gray has one channel, a colour three; what there is of alpha is left out.
        let [red, green, blue, _] = gaussian.color;
        for value in [x, y, a, b, c, red, green, blue] {
            file.write_all(&value.to_le_bytes())?;
        }
    }
    file.flush()?;
    println!(
        "{} Gaussians, {} x {} pixels, base {:?} / 65535, {:?}",
        header.gaussians,
        header.width,
        header.height,
        &header.base_color[..header.color.channels()],
        header.kernel,
    );
    Ok(())
}
