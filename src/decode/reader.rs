//! The decoder that reads from any `Read` (spec, sections 4 and 11).

use std::io::{ErrorKind, Read};

use super::stream::StreamDecoder;
use crate::container::{Header, Metadata};
use crate::error::DecodeError;
use crate::gaussian::Gaussian;
use crate::limits::Limits;
use crate::render::{Picture, RenderOptions};
use crate::threads;

/// Most bytes in one read.
const BUFFER: usize = 8192;

/// Decodes from any reader, in one pass and without seeking.
///
/// Layers are decoded in parallel on the threads of [`RenderOptions::with_threads`]. For a region,
/// layers that do not show in it are skipped. To show a picture while it arrives, use a
/// [`StreamDecoder`].
///
/// No byte after the end of the file is read: the reader that [`Decoder::into_reader`] returns is
/// at the first of them. For the same reason, small chunks are read with small reads. Use a
/// [`BufReader`](std::io::BufReader) if each read is a system call.
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
    /// Reads the file up to its first layer, with the default [`Limits`].
    ///
    /// # Errors
    /// When reading fails, or when the file up to its first layer is malformed, requires something
    /// that this decoder does not have, or exceeds a limit.
    pub fn new(reader: R) -> Result<Self, DecodeError> {
        Self::new_with_limits(reader, Limits::default())
    }

    /// Reads the file up to its first layer, with the given limits.
    ///
    /// # Errors
    /// As [`Decoder::new`].
    pub fn new_with_limits(reader: R, limits: Limits) -> Result<Self, DecodeError> {
        let stream = StreamDecoder::new().with_limits(limits);
        let options = RenderOptions::new();
        let mut decoder = Self { reader, stream, options };
        decoder.read_until(StreamDecoder::has_reached_layers)?;
        Ok(decoder)
    }

    /// The header.
    #[must_use]
    #[expect(clippy::missing_panics_doc, reason = "no decoder exists without a header")]
    pub fn header(&self) -> &Header {
        self.stream.header().expect("`new_with_limits` read it")
    }

    /// The metadata that was read. What says how the picture is shown is always there: its colours and its
    /// orientation. The rest may stand after layers, so that all of it is known after [`Decoder::read_metadata`] or a
    /// `decode_into`, and as far as it was read if the file is damaged.
    #[must_use]
    pub fn metadata(&self) -> &Metadata {
        self.stream.metadata()
    }

    /// The push decoder inside, for its statistics and quantizers. Its Gaussians are those that
    /// were decoded: they lack layers that no output has needed so far, which [`Decoder::picture`]
    /// decodes.
    #[must_use]
    pub fn stream(&self) -> &StreamDecoder {
        &self.stream
    }

    /// The reader. After [`Decoder::read_to_end`] or a `decode_into`, it is at the first byte after
    /// the file.
    #[must_use]
    pub fn into_reader(self) -> R {
        self.reader
    }

    /// Replaces the limits, for what is still to be read and for rendering.
    ///
    /// # Errors
    /// As [`StreamDecoder::set_limits`].
    pub fn set_limits(&mut self, limits: Limits) -> Result<(), DecodeError> {
        self.stream.set_limits(limits)
    }

    /// Sets the options of what [`Decoder::decode_into`] writes: size, region, colour model and so
    /// on, and the threads of all that follows. Default [`RenderOptions::new`].
    pub fn set_options(&mut self, options: RenderOptions) {
        self.options = options;
    }

    /// The number of samples that [`Decoder::decode_into`] writes with the present options; see
    /// [`Picture::output_len`].
    ///
    /// # Errors
    /// As [`Picture::output_len`].
    pub fn output_len(&self) -> Result<usize, DecodeError> {
        self.decoded().output_len(&self.options)
    }

    /// Reads the rest of the file, and gives all of its metadata. Layers are left to be decoded when they are
    /// needed.
    ///
    /// # Errors
    /// As [`Decoder::read_to_end`].
    pub fn read_metadata(&mut self) -> Result<&Metadata, DecodeError> {
        self.read_until(StreamDecoder::is_complete)?;
        Ok(self.metadata())
    }

    /// Reads the rest of the file.
    ///
    /// # Errors
    /// When reading fails, or when the file is malformed, requires something that this decoder does
    /// not have, or exceeds a limit. [`Decoder::picture`] still gives the picture of the Gaussians
    /// before the error.
    pub fn read_to_end(&mut self) -> Result<(), DecodeError> {
        self.read_layers_until(StreamDecoder::is_complete)
    }

    /// Reads layers until at least this many Gaussians have arrived, or all. With
    /// [`Header::gaussians_for`], they are enough for a thumbnail, which [`Decoder::picture`]
    /// renders.
    ///
    /// # Errors
    /// As [`Decoder::read_to_end`].
    pub fn read_at_least(&mut self, gaussians: u32) -> Result<(), DecodeError> {
        let least = gaussians as usize;
        self.read_layers_until(|stream| stream.arrived() >= least || stream.is_complete())
    }

    /// The picture of all Gaussians that have been read: those of the whole file after a
    /// `decode_into` or [`Decoder::read_to_end`], the first ones after [`Decoder::read_at_least`],
    /// and those before an error. Layers that were skipped for a region are decoded now.
    ///
    /// # Errors
    /// When one of these layers is malformed. The next call gives the picture of the layers before
    /// it.
    pub fn picture(&mut self) -> Result<Picture<'_>, DecodeError> {
        self.decode_pending()?;
        Ok(self.decoded())
    }

    /// Reads the rest of the file and renders interleaved 8-bit samples, as [`Picture::render_u8`]
    /// describes them. `out` must have [`Decoder::output_len`] elements.
    ///
    /// For a region, layers that do not show in it are read and their CRCs checked, but they are
    /// not decoded. Those that were decoded for the region are not kept: to render many regions,
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

    /// Reads the rest of the file and renders planes of `f32`, as [`Picture::render_planes`]
    /// describes them; otherwise as [`Decoder::decode_into`].
    ///
    /// # Errors
    /// As [`Decoder::read_to_end`] and [`Picture::render_planes`].
    pub fn decode_into_planes(&mut self, out: &mut [f32]) -> Result<(), DecodeError> {
        self.render(|picture, options| picture.render_planes(options, out))
    }

    /// Reads the rest of the file, and renders the Gaussians that the output needs.
    fn render(
        &mut self,
        render: impl FnOnce(&Picture<'_>, &RenderOptions) -> Result<(), DecodeError>,
    ) -> Result<(), DecodeError> {
        threads::wake(self.options.threads);
        self.read_until(StreamDecoder::is_complete)?;
        if let Some(gaussians) = self.stream.visible_gaussians(&self.options) {
            let copies = gaussians.len() as u64 * size_of::<Gaussian>() as u64;
            let memory = self.stream.memory() + copies;
            let picture = self.decoded().with_gaussians(&gaussians, memory);
            return render(&picture, &self.options);
        }
        self.decode_pending()?;
        render(&self.decoded(), &self.options)
    }

    /// Reads until a condition holds, and decodes the layers that have arrived.
    fn read_layers_until(
        &mut self,
        holds: impl Fn(&StreamDecoder) -> bool,
    ) -> Result<(), DecodeError> {
        threads::wake(self.options.threads);
        self.read_until(holds)?;
        self.decode_pending()
    }

    /// Reads until a condition holds.
    fn read_until(&mut self, holds: impl Fn(&StreamDecoder) -> bool) -> Result<(), DecodeError> {
        while !holds(&self.stream) {
            if let Err(error) = self.read_some() {
                // An error in an earlier layer comes first.
                self.decode_pending()?;
                return Err(error);
            }
        }
        Ok(())
    }

    /// The picture of the Gaussians that were decoded.
    fn decoded(&self) -> Picture<'_> {
        self.stream.picture().expect("`new_with_limits` read the header")
    }

    /// Decodes the layers that have arrived and are not decoded yet.
    fn decode_pending(&mut self) -> Result<(), DecodeError> {
        self.stream.decode_pending(self.options.threads)
    }

    /// Reads one piece of the file.
    fn read_some(&mut self) -> Result<(), DecodeError> {
        let mut buffer = [0; BUFFER];
        let buffer = &mut buffer[..self.stream.safe_to_read().min(BUFFER)];
        loop {
            match self.reader.read(buffer) {
                Ok(0) => return self.stream.finish(),
                Ok(length) => return self.stream.feed_deferred(&buffer[..length]).map(|_| ()),
                Err(error) if error.kind() == ErrorKind::Interrupted => {}
                Err(error) => return Err(error.into()),
            }
        }
    }
}
