//! The usual case: a whole file to a whole picture.

use alloc::vec;
use alloc::vec::Vec;

use super::stream::StreamDecoder;
use crate::color::SampleDepth;
use crate::container::{Header, Metadata};
use crate::error::DecodeError;
use crate::render::RenderOptions;
use crate::threads::Threads;

/// A decoded picture.
#[derive(Clone, Debug, PartialEq)]
#[non_exhaustive]
pub struct Decoded {
    /// What the file says of its picture: size, colour model, depth.
    pub header: Header,
    /// ICC profile, Exif, XMP and texts.
    pub metadata: Metadata,
    /// Interleaved samples, rows from the top, without padding: width x height x channels of
    /// [`Header::color`].
    pub samples: Samples,
}

/// Samples of the file's own depth.
#[derive(Clone, Debug, PartialEq, Eq)]
#[non_exhaustive]
pub enum Samples {
    /// Of 8 bits.
    Eight(Vec<u8>),
    /// Of 16 bits, in the machine's byte order.
    Sixteen(Vec<u16>),
}

/// Decodes a whole file at its stored size, with the default [`Limits`](crate::Limits), on the
/// threads of the current pool.
///
/// A `Decoder` gives other sizes, regions and samples, a [`StreamDecoder`] the picture so far.
///
/// ```no_run
/// use image_gip::Samples;
///
/// # fn main() -> Result<(), Box<dyn std::error::Error>> {
/// let picture = image_gip::decode(&std::fs::read("picture.gip")?)?;
/// println!("{} x {}", picture.header.width, picture.header.height);
/// if let Samples::Eight(pixels) = picture.samples {
///     println!("{:?}", &pixels[..picture.header.color.channels()]);
/// }
/// # Ok(())
/// # }
/// ```
///
/// # Errors
/// When the file is not a sound `.gip` file, is not complete, needs something that this decoder does
/// not have, or exceeds a limit.
#[expect(clippy::missing_panics_doc, reason = "a complete file has a header")]
pub fn decode(file: &[u8]) -> Result<Decoded, DecodeError> {
    let mut stream = StreamDecoder::new();
    let read = stream.take(file, true).and_then(|_| stream.finish());
    // What is wrong with a layer comes before what is wrong behind it.
    stream.decode_waiting(Threads::Pool)?;
    read?;
    let picture = stream.picture().expect("a complete file has a header");
    let options = RenderOptions::new();
    let length = picture.output_len(&options)?;
    let header = picture.header().clone();
    let samples = match header.depth {
        SampleDepth::Eight => {
            let mut samples = vec![0; length];
            picture.render_u8(&options, &mut samples)?;
            Samples::Eight(samples)
        }
        SampleDepth::Sixteen => {
            let mut samples = vec![0; length];
            picture.render_u16(&options, &mut samples)?;
            Samples::Sixteen(samples)
        }
    };
    Ok(Decoded { header, metadata: stream.metadata().clone(), samples })
}
