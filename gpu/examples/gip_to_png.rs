//! Renders a `.gip` file on the GPU and saves it as PNG, at any size and in any part.
//!
//!     cargo run --release --example gip_to_png -- photo.gip photo.png
//!     cargo run --release --example gip_to_png -- photo.gip large.png 3072x2048
//!     cargo run --release --example gip_to_png -- photo.gip part.png 30720x20480 640x480 9000,12000

mod adapter;

use std::error::Error;
use std::fs;
use std::str::FromStr;

use image_gip::{Region, StreamDecoder};
use image_gip_gpu::View;

fn main() -> Result<(), Box<dyn Error>> {
    let arguments: Vec<String> = std::env::args().skip(1).collect();
    let [input, output, rest @ ..] = arguments.as_slice() else {
        return Err("usage: gip_to_png INPUT.gip OUTPUT.png [SIZE [REGION_SIZE X,Y]]".into());
    };
    let view = match rest {
        [] => View::new(),
        [size] => sized(size)?,
        [size, part, at] => {
            let ((width, height), (x, y)) = (pair(part, 'x')?, pair(at, ',')?);
            sized(size)?.with_region(Region { x, y, width, height })
        }
        _ => return Err("a region is given by its size and its corner".into()),
    };

    let mut decoder = StreamDecoder::new();
    decoder.feed(&fs::read(input)?)?;
    decoder.finish()?;
    let picture = decoder.picture().ok_or("there is no header")?;

    let (renderer, name) = adapter::renderer()?;
    println!("on {name}");
    let texture = renderer.render(&picture, &view)?;
    let samples = renderer.read(&texture)?;
    fs::write(output, png(texture.width(), texture.height(), &samples)?)?;
    println!("{output}: {} x {} pixels", texture.width(), texture.height());
    Ok(())
}

fn sized(size: &str) -> Result<View, Box<dyn Error>> {
    let (width, height) = pair(size, 'x')?;
    Ok(View::new().with_size(width, height))
}

/// Two numbers with a separator.
fn pair(text: &str, separator: char) -> Result<(u32, u32), Box<dyn Error>> {
    let (a, b) = text.split_once(separator).ok_or_else(|| format!("no `{separator}` in {text}"))?;
    Ok((u32::from_str(a)?, u32::from_str(b)?))
}

fn png(width: u32, height: u32, rgba: &[u8]) -> Result<Vec<u8>, png::EncodingError> {
    let mut file = Vec::new();
    let mut encoder = png::Encoder::new(&mut file, width, height);
    encoder.set_color(png::ColorType::Rgba);
    let mut writer = encoder.write_header()?;
    writer.write_image_data(rgba)?;
    writer.finish()?;
    Ok(file)
}
