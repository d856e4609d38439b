//! The crate without the C library, for `compare.py`, beside `library.c`, which does the same: encodes a
//! picture, then for each line of standard input decodes the file or encodes again, and prints the
//! nanoseconds that it took.
//!
//!     native PICTURE.ppm

use std::error::Error;
use std::hint::black_box;
use std::io::{BufRead, Write};
use std::time::Instant;

use image_gip::{ColorModel, Decoder, Encoder, RenderOptions, Source, Target, Threads};

fn main() -> Result<(), Box<dyn Error>> {
    let name = std::env::args().nth(1).ok_or("usage: native PICTURE.ppm")?;
    let picture = std::fs::read(name)?;
    let (width, height, pixels) = parse(&picture).ok_or("not a PPM file of 8 bits")?;
    let source = Source::new_u8(width, height, ColorModel::Rgb, pixels)?;
    let encoder = Encoder::new().with_target(Target::BitsPerPixel(0.5)).with_effort(1);
    let encoder = encoder.with_threads(Threads::One);
    let file = encoder.encode(&source)?.bytes;
    let mut stdout = std::io::stdout();
    for line in std::io::stdin().lock().lines() {
        let is_decode = line? == "decode";
        let start = Instant::now();
        if is_decode {
            let mut decoder = Decoder::new(file.as_slice())?;
            decoder.set_options(RenderOptions::new().with_threads(Threads::One));
            let mut samples = vec![0; decoder.output_len()?];
            decoder.decode_into(&mut samples)?;
            black_box(samples);
        } else {
            black_box(encoder.encode(&source)?.bytes);
        }
        writeln!(stdout, "{}", start.elapsed().as_nanos())?;
        stdout.flush()?;
    }
    Ok(())
}

/// Width, height and samples of a PPM file without comments.
fn parse(file: &[u8]) -> Option<(u32, u32, &[u8])> {
    let mut fields = file.splitn(4, u8::is_ascii_whitespace);
    let mut next = || std::str::from_utf8(fields.next()?).ok();
    if next()? != "P6" {
        return None;
    }
    let (width, height) = (next()?.parse().ok()?, next()?.parse().ok()?);
    Some((width, height, fields.next()?.strip_prefix(b"255\n")?))
}
