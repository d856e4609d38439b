//! A thumbnail, a crop and a close-up of a picture, from one file that is opened once. Nothing is
//! resampled: the Gaussians are evaluated at the pixels that are asked for.
//!
//!     cargo run --release --example views -- photo.gip thumbnail.ppm crop.ppm close_up.ppm

use std::error::Error;
use std::fs::File;
use std::io::{BufReader, Read, Write};

use image_gip::{ColorModel, Decoder, Picture, Region, RenderOptions};

/// Longer side of the thumbnail.
const THUMBNAIL: u32 = 96;
/// How many times as large the close-up shows things.
const CLOSE_UP: u32 = 8;

fn main() -> Result<(), Box<dyn Error>> {
    let arguments: Vec<String> = std::env::args().skip(1).collect();
    let [input, thumbnail, crop, close_up] = arguments.as_slice() else {
        return Err("usage: views INPUT.gip THUMBNAIL.ppm CROP.ppm CLOSE_UP.ppm".into());
    };
    let mut decoder = Decoder::new(BufReader::new(File::open(input)?))?;
    let (width, height) = (decoder.header().width, decoder.header().height);

    // Few pixels need few Gaussians, and the strongest come first: the rest need not even be read.
    let longer = width.max(height);
    let side = |side: u32| (side * THUMBNAIL).div_ceil(longer);
    let small = RenderOptions::new().with_size(side(width), side(height));
    decoder.read_at_least(decoder.header().gaussians_for(side(width), side(height)))?;
    save(thumbnail, &decoder.picture()?, small)?;

    // What follows takes all of them, but of a large picture only the layers that show in the region
    // are decoded.
    let middle = Region {
        x: width / 4,
        y: height / 4,
        width: width.div_ceil(2),
        height: height.div_ceil(2),
    };
    save_region(crop, &mut decoder, RenderOptions::new().with_region(middle))?;

    // A region is given in pixels of the output.
    let enlarged = RenderOptions::new().with_size(width * CLOSE_UP, height * CLOSE_UP);
    let part = Region {
        x: (width * CLOSE_UP - width) / 2,
        y: (height * CLOSE_UP - height) / 2,
        width,
        height,
    };
    save_region(close_up, &mut decoder, enlarged.with_region(part))
}

/// Renders what has been read to a PPM file.
fn save(path: &str, picture: &Picture<'_>, options: RenderOptions) -> Result<(), Box<dyn Error>> {
    let options = options.with_color(ColorModel::Rgb);
    let mut samples = vec![0; picture.output_len(&options)?];
    picture.render_u8(&options, &mut samples)?;
    println!("{path}: from {} Gaussians", picture.gaussians().len());
    write_ppm(path, options.output_size(picture.header()), &samples)
}

/// Reads the rest of the file and renders a region of it.
fn save_region<R: Read>(
    path: &str,
    decoder: &mut Decoder<R>,
    options: RenderOptions,
) -> Result<(), Box<dyn Error>> {
    let options = options.with_color(ColorModel::Rgb);
    let size = options.output_size(decoder.header());
    decoder.set_options(options);
    let mut samples = vec![0; decoder.output_len()?];
    decoder.decode_into(&mut samples)?;
    write_ppm(path, size, &samples)
}

fn write_ppm(path: &str, (width, height): (u32, u32), rgb: &[u8]) -> Result<(), Box<dyn Error>> {
    let mut file = File::create(path)?;
    write!(file, "P6\n{width} {height}\n255\n")?;
    file.write_all(rgb)?;
    println!("{path}: {width} x {height}");
    Ok(())
}
