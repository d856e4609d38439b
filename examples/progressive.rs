//! Shows a picture while it arrives: feeds a file in pieces, as a slow connection would, and draws
//! what there is after each of them in the terminal.
//!
//!     cargo run --release --example progressive -- photo.gip

use std::error::Error;
use std::io::Read;
use std::time::Duration;

use image_gip::{Picture, RenderOptions, StreamDecoder};

/// Pieces that a file arrives in.
const PIECES: usize = 6;

/// Columns of the preview.
const COLUMNS: u32 = 72;

fn main() -> Result<(), Box<dyn Error>> {
    let input = std::env::args().nth(1).ok_or("usage: progressive INPUT.gip")?;
    let length = std::fs::metadata(&input)?.len() as usize;
    let mut connection = std::fs::File::open(&input)?;
    let mut piece = vec![0; length.div_ceil(PIECES).max(1)];

    let mut decoder = StreamDecoder::new();
    let mut received = 0;
    while !decoder.is_complete() {
        let count = connection.read(&mut piece)?;
        if count == 0 {
            // Says in which chunk the file broke off.
            decoder.finish()?;
        }
        decoder.feed(&piece[..count])?;
        received += count;
        // There is a picture as soon as there is a header.
        if let Some(picture) = decoder.picture() {
            let (here, all) = (picture.gaussians().len(), picture.header().gaussians);
            println!("{received} of {length} bytes, {here} of {all} Gaussians");
            println!("{}", preview(&picture)?);
        }
        std::thread::sleep(Duration::from_millis(300));
    }
    Ok(())
}

/// The picture in characters, dark to light. It is rendered at that size, not scaled down.
fn preview(picture: &Picture<'_>) -> Result<String, Box<dyn Error>> {
    const SHADES: &[u8] = b" .:-=+*#%@";
    let header = picture.header();
    // A character is about twice as high as it is wide.
    let rows = (COLUMNS * header.height / header.width / 2).clamp(1, 40);
    let options = RenderOptions::new().with_size(COLUMNS, rows);
    let channels = header.color.channels();
    let mut samples = vec![0; picture.output_len(&options)?];
    picture.render_u8(&options, &mut samples)?;

    let mut text = String::new();
    for row in samples.chunks_exact(COLUMNS as usize * channels) {
        for pixel in row.chunks_exact(channels) {
            let luma = match *pixel {
                [r, g, b, ..] => (u32::from(r) * 54 + u32::from(g) * 183 + u32::from(b) * 19) / 256,
                [gray, ..] => gray.into(),
                [] => 0,
            };
            text.push(SHADES[luma as usize * SHADES.len() / 256].into());
        }
        text.push('\n');
    }
    Ok(text)
}
