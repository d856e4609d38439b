//! Decodes a `.gip` file to a PAM file with nothing but the decoder: no encoder, no `image`.
//!
//!     cargo run --release --no-default-features --features decode,std --example decode_only -- \
//!         photo.gip photo.pam

use std::error::Error;
use std::fs::File;
use std::io::{BufReader, Write};

use image_gip::{Decoder, SampleDepth};

fn main() -> Result<(), Box<dyn Error>> {
    let arguments: Vec<String> = std::env::args().skip(1).collect();
    let [input, output] = arguments.as_slice() else {
        return Err("usage: decode_only INPUT.gip OUTPUT.pam".into());
    };
    // The library reads its input once, in order, and never beyond the end of the .gip file: in small
    // pieces, which a buffer joins.
    let mut decoder = Decoder::new(BufReader::new(File::open(input)?))?;
    let header = decoder.header().clone();
    let count = decoder.output_len()?;
    let samples = match header.depth {
        SampleDepth::Sixteen => {
            let mut samples = vec![0; count];
            decoder.decode_into_u16(&mut samples)?;
            samples.into_iter().flat_map(u16::to_be_bytes).collect()
        }
        _ => {
            let mut samples = vec![0; count];
            decoder.decode_into(&mut samples)?;
            samples
        }
    };

    let mut file = File::create(output)?;
    write!(
        file,
        "P7\nWIDTH {}\nHEIGHT {}\nDEPTH {}\nMAXVAL {}\nTUPLTYPE {}\nENDHDR\n",
        header.width,
        header.height,
        header.color.channels(),
        (1_u32 << header.depth.bits()) - 1,
        ["GRAYSCALE", "GRAYSCALE_ALPHA", "RGB", "RGB_ALPHA"][header.color.channels() - 1],
    )?;
    file.write_all(&samples)?;
    Ok(())
}
