//! Decodes a file again and again as a native program, for `run.mjs`: for each line of standard input, it
//! decodes once, on one thread, and prints the nanoseconds that it took.
//!
//!     native picture.gip

use std::error::Error;
use std::hint::black_box;
use std::io::{BufRead, Write};
use std::time::Instant;

use image_gip::{ColorModel, Decoder, RenderOptions, Threads};

fn main() -> Result<(), Box<dyn Error>> {
    let name = std::env::args().nth(1).ok_or("usage: native FILE")?;
    let file = std::fs::read(name)?;
    let mut stdout = std::io::stdout();
    for line in std::io::stdin().lock().lines() {
        line?;
        let start = Instant::now();
        let mut decoder = Decoder::new(file.as_slice())?;
        let options = RenderOptions::new().with_threads(Threads::One);
        decoder.set_options(options.with_color(ColorModel::Rgba));
        let mut samples = vec![0; decoder.output_len()?];
        decoder.decode_into(&mut samples)?;
        black_box(samples);
        writeln!(stdout, "{}", start.elapsed().as_nanos())?;
        stdout.flush()?;
    }
    Ok(())
}
