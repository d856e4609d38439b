//! The decoder over any `Read` (spec, sections 4 and 11).

use std::io::{ErrorKind, Read};

use super::stream::StreamDecoder;
use crate::container::{Header, Metadata};
use crate::error::DecodeError;
use crate::gaussian::Gaussian;
use crate::limits::Limits;
use crate::render::{Picture, RenderOptions};
use crate::threads;

/// Bytes that are read at a time, at most.
const BUFFER: usize = 8192;

/// Decodes from any reader, in one pass and without seeking.
///
/// Layers are decoded on the threads of the options ([`RenderOptions::with_threads`]); for a region
/// of a large picture, those that do not show in it are left out. To show a picture while it arrives,
/// use a [`StreamDecoder`].
///
/// Not one byte is read beyond the end of the file, so that what follows can be read from
/// [`Decoder::into_reader`]. Small chunks take small reads: give it a
/// [`BufReader`](std::io::BufReader) where each read is a call of the system.
///
/// ```no_run
/// # fn main() -> Result<(), image_gip::DecodeError> {
/// let file = std::io::BufReader::new(std::fs::File::open("picture.gip")?);
/// let mut decoder = image_gip::Decoder::new(file)?;
/// let mut pixels = vec![0; decoder.output_len()?];
/// decoder.decode_into(&mut pixels)?;
/// # Ok(())
/// # }
/// ```
#[derive(Debug)]
pub struct Decoder<R> {
    reader: R,
    stream: StreamDecoder,
    options: RenderOptions,
}

impl<R: Read> Decoder<R> {
    /// Reads header and metadata, with the default limits.
    ///
    /// # Errors
    /// When reading fails, or the file is not a sound `.gip` file up to its first layer.
    pub fn new(reader: R) -> Result<Self, DecodeError> {
        Self::new_with_limits(reader, Limits::default())
    }

    /// Reads header and metadata, with the given limits.
    ///
    /// # Errors
    /// As [`Decoder::new`], and when a limit is exceeded.
    pub fn new_with_limits(reader: R, limits: Limits) -> Result<Self, DecodeError> {
        let stream = StreamDecoder::new().with_limits(limits);
        let options = RenderOptions::new();
        let mut decoder = Self { reader, stream, options };
        decoder.read_until(StreamDecoder::has_begun)?;
        Ok(decoder)
    }

    /// What the file says of its picture.
    #[must_use]
    #[expect(clippy::missing_panics_doc, reason = "no decoder exists without a header")]
    pub fn header(&self) -> &Header {
        self.stream.header().expect("`new_with_limits` read it")
    }

    /// ICC profile, Exif, XMP and texts.
    #[must_use]
    pub fn metadata(&self) -> &Metadata {
        self.stream.metadata()
    }

    /// The push decoder inside, with what was decoded so far: layers that no output has needed yet are
    /// not among its Gaussians. [`Decoder::picture`] decodes them.
    #[must_use]
    pub fn stream(&self) -> &StreamDecoder {
        &self.stream
    }

    /// The reader. After [`Decoder::read_to_end`] or a `decode_into`, it stands right behind the file.
    #[must_use]
    pub fn into_reader(self) -> R {
        self.reader
    }

    /// Replaces the limits; see [`StreamDecoder::set_limits`].
    ///
    /// # Errors
    /// As [`StreamDecoder::set_limits`].
    pub fn set_limits(&mut self, limits: Limits) -> Result<(), DecodeError> {
        self.stream.set_limits(limits)
    }

    /// Sets size, region, colour model and so on of what [`Decoder::decode_into`] writes, and
    /// whether threads are used from here on.
    pub fn set_options(&mut self, options: RenderOptions) {
        self.options = options;
    }

    /// The number of samples that [`Decoder::decode_into`] writes with these options; see
    /// [`Picture::output_len`].
    ///
    /// # Errors
    /// As [`Picture::output_len`].
    pub fn output_len(&self) -> Result<usize, DecodeError> {
        self.decoded().output_len(&self.options)
    }

    /// Reads the rest of the file.
    ///
    /// # Errors
    /// When reading fails or the file is not sound. [`Decoder::picture`] gives what had been
    /// decoded until then.
    pub fn read_to_end(&mut self) -> Result<(), DecodeError> {
        self.read_layers_until(StreamDecoder::is_complete)
    }

    /// Reads until so many Gaussians have arrived, or all: enough layers for a thumbnail, with
    /// [`Header::gaussians_for`]. [`Decoder::picture`] renders what is there.
    ///
    /// # Errors
    /// As [`Decoder::read_to_end`].
    pub fn read_at_least(&mut self, gaussians: u32) -> Result<(), DecodeError> {
        let enough = gaussians as usize;
        self.read_layers_until(|stream| stream.arrived() >= enough || stream.is_complete())
    }

    /// The picture of all Gaussians that have been read: after an error of those before it, after
    /// [`Decoder::read_at_least`] of so many, otherwise of all. Layers that a region has left out are
    /// decoded now.
    ///
    /// # Errors
    /// When one of these layers is malformed. The next call gives the picture of those before it.
    pub fn picture(&mut self) -> Result<Picture<'_>, DecodeError> {
        self.decode_waiting()?;
        Ok(self.decoded())
    }

    /// Reads the rest of the file and renders interleaved 8-bit samples.
    ///
    /// For a region of a large picture, layers that do not show in it are read and their CRCs checked,
    /// but they are not decoded, and what was decoded for it is not kept. To render many regions,
    /// call [`Decoder::read_to_end`] first.
    ///
    /// # Errors
    /// As [`Decoder::read_to_end`] and [`Picture::render_u8`].
    pub fn decode_into(&mut self, out: &mut [u8]) -> Result<(), DecodeError> {
        self.render(|picture, options| picture.render_u8(options, out))
    }

    /// Reads the rest of the file and renders interleaved 16-bit samples, as
    /// [`Decoder::decode_into`] does.
    ///
    /// # Errors
    /// As [`Decoder::read_to_end`] and [`Picture::render_u16`].
    pub fn decode_into_u16(&mut self, out: &mut [u16]) -> Result<(), DecodeError> {
        self.render(|picture, options| picture.render_u16(options, out))
    }

    /// Reads the rest of the file and renders planes of `f32`, as [`Decoder::decode_into`] does; see
    /// [`Picture::render_planes`] for what they hold.
    ///
    /// # Errors
    /// As [`Decoder::read_to_end`] and [`Picture::render_planes`].
    pub fn decode_into_planes(&mut self, out: &mut [f32]) -> Result<(), DecodeError> {
        self.render(|picture, options| picture.render_planes(options, out))
    }

    /// Reads the rest of the file and renders what shows.
    fn render(
        &mut self,
        render: impl FnOnce(&Picture<'_>, &RenderOptions) -> Result<(), DecodeError>,
    ) -> Result<(), DecodeError> {
        threads::wake(self.options.threads);
        self.read_until(StreamDecoder::is_complete)?;
        if let Some(gaussians) = self.stream.showing(&self.options) {
            let held = self.stream.held() + gaussians.len() as u64 * size_of::<Gaussian>() as u64;
            let picture = Picture::new(self.header(), &gaussians, &self.stream.limits, held);
            return render(&picture, &self.options);
        }
        self.decode_waiting()?;
        render(&self.decoded(), &self.options)
    }

    /// Reads until something is reached, and decodes the layers that came.
    fn read_layers_until(
        &mut self,
        reached: impl Fn(&StreamDecoder) -> bool,
    ) -> Result<(), DecodeError> {
        threads::wake(self.options.threads);
        self.read_until(reached)?;
        self.decode_waiting()
    }

    /// Reads until something is reached.
    fn read_until(&mut self, reached: impl Fn(&StreamDecoder) -> bool) -> Result<(), DecodeError> {
        while !reached(&self.stream) {
            if let Err(error) = self.read_some() {
                // What was wrong with what came earlier is to be told.
                self.decode_waiting()?;
                return Err(error);
            }
        }
        Ok(())
    }

    /// The picture of what was decoded.
    fn decoded(&self) -> Picture<'_> {
        self.stream.picture().expect("`new_with_limits` read the header")
    }

    fn decode_waiting(&mut self) -> Result<(), DecodeError> {
        self.stream.decode_waiting(self.options.threads)
    }

    /// Takes one piece of the file.
    fn read_some(&mut self) -> Result<(), DecodeError> {
        let mut buffer = [0; BUFFER];
        let buffer = &mut buffer[..self.stream.certain().min(BUFFER)];
        loop {
            match self.reader.read(buffer) {
                Ok(0) => return self.stream.finish(),
                Ok(length) => return self.stream.take(&buffer[..length], true).map(|_| ()),
                Err(error) if error.kind() == ErrorKind::Interrupted => {}
                Err(error) => return Err(error.into()),
            }
        }
    }
}
