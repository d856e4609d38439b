//! The usual case: from a whole file to a whole picture.

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
    /// The header: size, colour model, sample depth and so on.
    pub header: Header,
    /// The metadata: ICC profile, Exif, XMP and texts.
    pub metadata: Metadata,
    /// height x width x channels interleaved samples, rows from the top, without padding. The
    /// channels are those of [`Header::color`].
    pub samples: Samples,
}

/// Samples with the file's own depth, [`Header::depth`].
#[derive(Clone, Debug, PartialEq, Eq)]
#[non_exhaustive]
pub enum Samples {
    /// Samples of 8 bits: 0 to 255.
    Eight(Vec<u8>),
    /// Samples of 16 bits: 0 to 65535.
    Sixteen(Vec<u16>),
}

/// Decodes a whole file at its stored size, with the default [`Limits`](crate::Limits), on the
/// threads of the current pool.
///
/// For other sizes, regions or samples, use a `Decoder`; for a picture that is shown while it
/// arrives, a [`StreamDecoder`].
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
/// When the file is malformed or ends too early, requires something that this decoder does not
/// have, or exceeds a limit.
#[expect(clippy::missing_panics_doc, reason = "a complete file has a header")]
pub fn decode(file: &[u8]) -> Result<Decoded, DecodeError> {
    let mut stream = StreamDecoder::new();
    let read = stream.feed_deferred(file).and_then(|_| stream.finish());
    // An error in a layer comes before an error after it.
    stream.decode_pending(Threads::Pool)?;
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
