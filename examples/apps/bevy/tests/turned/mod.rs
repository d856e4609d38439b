//! The file of the tests, and what it shows.

use image_gip::{ColorModel, Decoder, RenderOptions};

/// The test vector `rgb8`, of 40 x 24 pixels, with Exif by which it is to be turned by 90 degrees.
pub const FILE: &[u8] = include_bytes!("turned.gip");

/// What the decoder gives, upright and of this upright size.
pub fn decoded(width: u32, height: u32) -> Vec<u8> {
    let mut decoder = Decoder::new(FILE).expect("a valid file");
    let orientation = decoder.metadata().orientation();
    let (width, height) = orientation.turned_size(width, height);
    let options = RenderOptions::new().with_size(width, height);
    decoder.set_options(options.with_color(ColorModel::Rgba));
    let mut samples = vec![0; decoder.output_len().expect("a sound size")];
    decoder.decode_into(&mut samples).expect("a valid file");
    orientation.apply(&samples, width as usize, 4)
}
