//! Renders a `.gip` file on the GPU and saves it as PNG, at any size and in any part. The picture is
//! upright, as its Exif says, and so are the size and the part.
//!
//!     cargo run --release --example gip_to_png -- photo.gip photo.png
//!     cargo run --release --example gip_to_png -- photo.gip large.png 3072x2048
//!     cargo run --release --example gip_to_png -- photo.gip part.png 30720x20480 640x480 9000,12000

mod adapter;
mod png_file;

use std::error::Error;
use std::fs;
use std::str::FromStr;

use image_gip::{Region, StreamDecoder};
use image_gip_gpu::{GpuRenderer, View};

fn main() -> Result<(), Box<dyn Error>> {
    let arguments: Vec<String> = std::env::args().skip(1).collect();
    let [input, output, rest @ ..] = arguments.as_slice() else {
        return Err("usage: gip_to_png INPUT.gip OUTPUT.png [SIZE [REGION_SIZE X,Y]]".into());
    };
    let (size, region) = match rest {
        [] => (None, None),
        [size] => (Some(pair(size, 'x')?), None),
        [size, part, at] => {
            let ((width, height), (x, y)) = (pair(part, 'x')?, pair(at, ',')?);
            (Some(pair(size, 'x')?), Some(Region { x, y, width, height }))
        }
        _ => return Err("a region is given by its size and its corner".into()),
    };

    let mut decoder = StreamDecoder::new();
    decoder.feed(&fs::read(input)?)?;
    decoder.finish()?;
    let orientation = decoder.metadata().orientation();
    let picture = decoder.picture().ok_or("there is no header")?;
    // The renderer knows the picture as stored.
    let mut view = View::new();
    if let Some((width, height)) = size {
        let (stored_width, stored_height) = orientation.turned_size(width, height);
        view = view.with_size(stored_width, stored_height);
        if let Some(region) = region {
            view = view.with_region(orientation.stored_region(region, width, height)?);
        }
    }

    let (device, queue, name) = adapter::device()?;
    println!("on {name}");
    let renderer = GpuRenderer::new(device, queue)?;
    let texture = renderer.render(&picture, &view)?;
    let samples = renderer.read(&texture)?;
    let samples = orientation.apply(&samples, texture.width() as usize, 4);
    let (width, height) = orientation.turned_size(texture.width(), texture.height());
    fs::write(output, png_file::encode(width, height, &samples)?)?;
    println!("{output}: {width} x {height} pixels");
    Ok(())
}

/// Two numbers with a separator.
fn pair(text: &str, separator: char) -> Result<(u32, u32), Box<dyn Error>> {
    let (a, b) = text.split_once(separator).ok_or_else(|| format!("no `{separator}` in {text}"))?;
    Ok((u32::from_str(a)?, u32::from_str(b)?))
}
