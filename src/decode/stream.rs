//! The push decoder, which does no I/O (spec, sections 4 and 11).

#[cfg(feature = "std")]
use alloc::vec::Vec;

use super::chunk_decoder::ChunkDecoder;
use super::chunk_statistics::{ChunkCounter, ChunkStatistics};
#[cfg(feature = "std")]
use crate::coding::entropy::AttributeBits;
use crate::coding::entropy::{Quantization, QuantizationSteps};
use crate::coding::packed::Quantizer;
use crate::container::{Event, Header, Metadata, Parser};
use crate::error::{DecodeError, SkippedChunk};
use crate::gaussian::Gaussian;
use crate::limits::Limits;
use crate::orientation::Orientation;
use crate::render::Picture;
#[cfg(feature = "std")]
use crate::render::RenderOptions;
use crate::threads::Threads;

/// Decodes bytes as they arrive, in pieces of any size, and does no I/O.
///
/// After each piece it can give the [`Picture`] of the Gaussians that have arrived. It decodes
/// every entropy-coded layer as soon as its last byte has arrived, on the caller's thread. That is
/// right for a picture that is shown while it arrives, and for programs without `std`. If the file
/// is at hand, a `Decoder` (feature `std`) is faster: it decodes layers in parallel, and skips
/// those that do not show in a region. [`decode`](crate::decode()) is the short way to the whole
/// picture.
///
/// No memory is allocated merely because the file declares a length or a number of Gaussians: it is
/// allocated as bytes arrive.
///
/// ```no_run
/// # fn next_piece() -> Vec<u8> { vec![] }
/// # fn main() -> Result<(), image_gip::DecodeError> {
/// use image_gip::{RenderOptions, StreamDecoder};
///
/// let mut decoder = StreamDecoder::new();
/// while !decoder.is_complete() {
///     decoder.feed(&next_piece())?;
///     if let Some(picture) = decoder.picture() {
///         let options = RenderOptions::new();
///         let mut pixels = vec![0; picture.output_len(&options)?];
///         picture.render_u8(&options, &mut pixels)?;
///     }
/// }
/// # Ok(())
/// # }
/// ```
#[derive(Debug)]
pub struct StreamDecoder {
    parser: Parser,
    chunks: ChunkDecoder,
    counter: ChunkCounter,
}

impl Default for StreamDecoder {
    fn default() -> Self {
        Self::new()
    }
}

impl StreamDecoder {
    /// A decoder with the default [`Limits`].
    #[must_use]
    pub fn new() -> Self {
        Self {
            parser: Parser::new(),
            chunks: ChunkDecoder::default(),
            counter: ChunkCounter::default(),
        }
    }

    /// Sets the limits.
    #[must_use]
    pub fn with_limits(mut self, limits: Limits) -> Self {
        self.chunks.limits = limits;
        self
    }

    /// Counts the bits of each attribute; see [`StreamDecoder::attribute_bits`]. This makes
    /// decoding slower.
    #[cfg(feature = "std")]
    #[must_use]
    pub fn with_statistics(mut self) -> Self {
        self.chunks.statistics = Some(AttributeBits::default());
        self
    }

    /// The bits of each attribute in the Gaussians that have arrived; `None` without
    /// [`StreamDecoder::with_statistics`].
    #[cfg(feature = "std")]
    #[must_use]
    pub fn attribute_bits(&self) -> Option<AttributeBits> {
        use crate::gaussian::{CENTER, SHAPE};

        let statistics = self.chunks.statistics?;
        let quantizers = self.quantizers();
        let bits_of = |components: core::ops::Range<usize>| {
            let quantizers = quantizers.get(components).unwrap_or(&[]);
            let bits = quantizers.iter().map(|quantizer| f64::from(quantizer.bits())).sum::<f64>();
            bits * self.gaussians().len() as f64
        };
        Some(AttributeBits {
            position: statistics.position + bits_of(CENTER),
            shape: statistics.shape + bits_of(SHAPE),
            color: statistics.color + bits_of(SHAPE.end..quantizers.len().max(SHAPE.end)),
            ..statistics
        })
    }

    /// Replaces the limits, for what is still to be read and for rendering.
    ///
    /// # Errors
    /// When what the header declares exceeds the new limits. They apply in any case.
    pub fn set_limits(&mut self, limits: Limits) -> Result<(), DecodeError> {
        self.chunks.limits = limits;
        self.header().map_or(Ok(()), |header| self.chunks.check_header(header))
    }

    /// Takes the next bytes of the file. Returns how many of them belong to the file: all, unless
    /// the file ends within them.
    ///
    /// # Errors
    /// When the file is malformed, requires something that this decoder does not have, or exceeds a
    /// limit. The decoder cannot continue then, but [`StreamDecoder::picture`] still gives the
    /// picture of the Gaussians before the error. Those of a layer with a wrong CRC are dropped.
    pub fn feed(&mut self, bytes: &[u8]) -> Result<usize, DecodeError> {
        self.feed_all(bytes, false)
    }

    /// Like [`StreamDecoder::feed`], but entropy-coded layers remain pending until
    /// [`StreamDecoder::decode_pending`].
    pub(super) fn feed_deferred(&mut self, bytes: &[u8]) -> Result<usize, DecodeError> {
        self.feed_all(bytes, true)
    }

    fn feed_all(&mut self, bytes: &[u8], defer: bool) -> Result<usize, DecodeError> {
        let mut input = bytes;
        match self.advance(&mut input, defer) {
            Ok(()) => Ok(bytes.len() - input.len()),
            Err(error) => {
                self.chunks.fail();
                Err(error)
            }
        }
    }

    /// Reads all of the input, or up to the end of the file. `defer` leaves entropy-coded layers
    /// pending.
    fn advance(&mut self, input: &mut &[u8], defer: bool) -> Result<(), DecodeError> {
        if self.chunks.has_failed() {
            return Err(DecodeError::AlreadyFailed);
        }
        while !self.is_complete() {
            match self.parser.next(input)? {
                Event::NeedMore => return Ok(()),
                Event::Begin(chunk, length) => self.chunks.begin(chunk, length)?,
                Event::Payload(payload) => self.chunks.payload(payload)?,
                Event::Complete(chunk, bytes) => {
                    self.chunks.complete(chunk)?;
                    if !defer {
                        self.decode_pending(Threads::One)?;
                    }
                    self.counter.add(chunk, bytes);
                }
            }
        }
        Ok(())
    }

    /// Says that the input has ended.
    ///
    /// # Errors
    /// When the file is not complete.
    pub fn finish(&self) -> Result<(), DecodeError> {
        if self.is_complete() {
            return Ok(());
        }
        if self.chunks.has_failed() {
            return Err(DecodeError::AlreadyFailed);
        }
        Err(DecodeError::UnexpectedEnd { chunk: self.parser.current() })
    }

    /// Whether the whole file has been read.
    #[must_use]
    pub fn is_complete(&self) -> bool {
        self.chunks.is_complete()
    }

    /// The header, once it has arrived.
    #[must_use]
    pub fn header(&self) -> Option<&Header> {
        self.chunks.header.as_ref()
    }

    /// The quantizers of [`Coding::Packed`](crate::Coding), one per component: two of position,
    /// three of shape, one per channel. Empty until they have arrived, and with
    /// [`Coding::Entropy`](crate::Coding).
    #[must_use]
    pub fn quantizers(&self) -> &[Quantizer] {
        &self.chunks.quantizers
    }

    /// The steps of [`Coding::Entropy`](crate::Coding); `None` until they have arrived, and with
    /// [`Coding::Packed`](crate::Coding).
    #[must_use]
    pub fn quantization_steps(&self) -> Option<QuantizationSteps> {
        self.chunks.quantization.as_ref().map(Quantization::steps)
    }

    /// The metadata that has arrived. It is complete when the whole file has arrived.
    #[must_use]
    pub fn metadata(&self) -> &Metadata {
        &self.chunks.metadata
    }

    /// Chunks that break a rule, and so are not in the other results: a picture is shown without them (spec, section
    /// 4.3). At most 16 are listed.
    #[must_use]
    pub fn skipped(&self) -> &[SkippedChunk] {
        &self.chunks.skipped
    }

    /// How the picture is to be turned for display; `None` until it is known: until the Exif data or
    /// a layer has arrived, or the end of a file without both.
    #[must_use]
    pub fn orientation(&self) -> Option<Orientation> {
        let metadata = self.metadata();
        (metadata.exif.is_some() || self.has_reached_layers()).then(|| metadata.orientation())
    }

    /// The Gaussians that have arrived, in file order.
    #[must_use]
    pub fn gaussians(&self) -> &[Gaussian] {
        &self.chunks.gaussians
    }

    /// The number of Gaussians in each layer that has arrived, in file order.
    #[must_use]
    pub fn layers(&self) -> &[u32] {
        &self.chunks.layers
    }

    /// The chunks that are complete: for each type their number and size, in the order in which the
    /// types have appeared. At most 64 types are listed.
    #[must_use]
    pub fn chunks(&self) -> &[ChunkStatistics] {
        self.counter.types()
    }

    /// The picture of the Gaussians that have arrived; `None` until the header has arrived.
    #[must_use]
    pub fn picture(&self) -> Option<Picture<'_>> {
        let chunks = &self.chunks;
        let header = chunks.header.as_ref()?;
        let picture = Picture::new(header, &chunks.gaussians, &chunks.limits, chunks.memory());
        Some(picture.with_texture(chunks.texture.as_ref()))
    }

    /// Whether header and orientation are known, since a layer or the end of the file has arrived, at least in
    /// part.
    pub(super) fn has_reached_layers(&self) -> bool {
        self.chunks.has_reached_layers(self.parser.current())
    }

    /// Decodes the pending layers up to the first that is malformed.
    pub(super) fn decode_pending(&mut self, threads: Threads) -> Result<(), DecodeError> {
        self.chunks.decode_pending(threads)
    }
}

/// For a `Decoder`.
#[cfg(feature = "std")]
impl StreamDecoder {
    /// The number of Gaussians that have arrived, those of pending layers included.
    pub(super) fn arrived(&self) -> usize {
        self.chunks.arrived()
    }

    /// The memory that is held, in bytes.
    pub(super) fn memory(&self) -> u64 {
        self.chunks.memory()
    }

    /// See [`ChunkDecoder::visible_gaussians`].
    pub(super) fn visible_gaussians(&self, options: &RenderOptions) -> Option<Vec<Gaussian>> {
        self.chunks.visible_gaussians(options)
    }

    /// See [`Parser::safe_to_read`].
    pub(super) fn safe_to_read(&self) -> usize {
        self.parser.safe_to_read()
    }
}
