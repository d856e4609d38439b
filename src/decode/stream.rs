//! The push decoder, which does no I/O (spec, sections 4 and 11).

use alloc::vec::Vec;

use super::pending::PendingLayers;
use crate::chunk::ChunkType;
use crate::coding::entropy::{AttributeBits, Lattice, LatticeSteps};
use crate::coding::packed::{PackedLayerReader, Quantizer};
use crate::container::{Coding, Event, Header, Metadata, Parser};
use crate::error::DecodeError;
use crate::gaussian::Gaussian;
use crate::layers::bounds::LayerBounds;
use crate::limits::Limits;
use crate::render::Picture;
#[cfg(feature = "std")]
use crate::render::RenderOptions;
use crate::threads::Threads;

/// Most bytes of a header or quantizer chunk of version 1: nine quantizers of twelve bytes.
const MAX_SMALL_CHUNK: u32 = 108;

/// Most types that [`StreamDecoder::chunks`] tells apart: types are the file's own choice.
const MAX_CHUNK_KINDS: usize = 64;

/// Decodes bytes as they arrive, in pieces of any size, and does no I/O.
///
/// After any piece it can give the [`Picture`] so far: every layer is decoded as soon as its last
/// byte has come, on the caller's thread. That suits a picture that is shown while it arrives, and
/// programs without `std`. Where the file is at hand, a `Decoder` (feature `std`) is faster: it decodes
/// layers on many threads, and for a region of a large picture leaves out those that do not show.
/// [`decode`](crate::decode()) is the short way to the whole picture.
///
/// Memory is allocated as bytes arrive, never on the word of a declared count.
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
    pub(super) limits: Limits,
    stage: Stage,
    header: Option<Header>,
    /// Of the packed coding.
    quantizers: Vec<Quantizer>,
    /// Of the entropy coding.
    lattice: Option<Lattice>,
    /// Of every layer that the header declares, where the file has them.
    bounds: Option<Vec<LayerBounds>>,
    /// Entropy-coded layers that have arrived and were not decoded yet.
    waiting: PendingLayers,
    metadata: Metadata,
    gaussians: Vec<Gaussian>,
    /// Bits of entropy-coded Gaussians, where asked for.
    statistics: Option<AttributeBits>,
    layers: u16,
    chunks: Vec<ChunkStatistics>,
}

/// How many chunks of a type a file has, and their bytes with framing.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
#[non_exhaustive]
pub struct ChunkStatistics {
    /// The type.
    pub kind: ChunkType,
    /// How many there are.
    pub count: u32,
    /// Their bytes, length, type and CRC included.
    pub bytes: u64,
}

/// What the decoder does with the current chunk.
#[derive(Debug)]
enum Stage {
    /// Between chunks.
    Idle,
    /// The payload is skipped.
    Skip,
    /// The payload is collected and read as a whole.
    Collect {
        /// What has arrived.
        payload: Vec<u8>,
        /// Bytes that the chunk declares.
        length: usize,
    },
    /// A layer, and how many Gaussians there were before it.
    Layer(PackedLayerReader, usize),
    /// `GEND` was read.
    Complete,
    /// An earlier call failed.
    Failed,
}

impl Default for StreamDecoder {
    fn default() -> Self {
        Self::new()
    }
}

impl StreamDecoder {
    /// A decoder with the default limits.
    #[must_use]
    pub fn new() -> Self {
        Self {
            parser: Parser::new(),
            limits: Limits::default(),
            stage: Stage::Idle,
            header: None,
            quantizers: Vec::new(),
            lattice: None,
            bounds: None,
            waiting: PendingLayers::default(),
            metadata: Metadata::default(),
            gaussians: Vec::new(),
            statistics: None,
            layers: 0,
            chunks: Vec::new(),
        }
    }

    /// Replaces the limits.
    #[must_use]
    pub fn with_limits(mut self, limits: Limits) -> Self {
        self.limits = limits;
        self
    }

    /// Keeps statistics of what bits are spent on. Takes time for every symbol.
    #[cfg(feature = "std")]
    #[must_use]
    pub fn with_statistics(mut self) -> Self {
        self.statistics = Some(AttributeBits::default());
        self
    }

    /// Bits of the Gaussians that have arrived, by attribute; `None` where the decoder was to keep
    /// no statistics of them ([`StreamDecoder::with_statistics`]).
    #[cfg(feature = "std")]
    #[must_use]
    pub fn attribute_bits(&self) -> Option<AttributeBits> {
        let statistics = self.statistics?;
        let of = |components: core::ops::Range<usize>| {
            let quantizers = self.quantizers.get(components).unwrap_or(&[]);
            let bits = quantizers.iter().map(|quantizer| f64::from(quantizer.bits())).sum::<f64>();
            bits * self.gaussians.len() as f64
        };
        Some(AttributeBits {
            position: statistics.position + of(0..2),
            shape: statistics.shape + of(2..5),
            color: statistics.color + of(5..self.quantizers.len().max(5)),
            ..statistics
        })
    }

    /// Replaces the limits, for what is still to be read and for rendering.
    ///
    /// # Errors
    /// When what the file has declared so far exceeds the new limits. They hold in any case.
    pub fn set_limits(&mut self, limits: Limits) -> Result<(), DecodeError> {
        self.limits = limits;
        self.header.as_ref().map_or(Ok(()), |header| self.check_header(header))
    }

    /// Takes the next bytes of the file. Returns how many were used: all of them, unless the file
    /// ends within them.
    ///
    /// # Errors
    /// When the file is not a sound `.gip` file, needs something that this decoder does not have,
    /// or exceeds a limit. The decoder cannot go on then, but [`StreamDecoder::picture`] still
    /// gives what had been decoded; Gaussians of a layer whose CRC is wrong are dropped.
    pub fn feed(&mut self, bytes: &[u8]) -> Result<usize, DecodeError> {
        self.take(bytes, false)
    }

    /// Like [`StreamDecoder::feed`], but entropy-coded layers wait for
    /// [`StreamDecoder::decode_waiting`].
    pub(super) fn take(&mut self, bytes: &[u8], may_wait: bool) -> Result<usize, DecodeError> {
        let mut input = bytes;
        match self.advance(&mut input, may_wait) {
            Ok(()) => Ok(bytes.len() - input.len()),
            Err(error) => {
                if let Stage::Layer(_, before) = self.stage {
                    self.gaussians.truncate(before);
                }
                self.stage = Stage::Failed;
                Err(error)
            }
        }
    }

    /// Says that no more bytes will come.
    ///
    /// # Errors
    /// When the file is not complete.
    pub fn finish(&self) -> Result<(), DecodeError> {
        match self.stage {
            Stage::Complete => Ok(()),
            Stage::Failed => Err(DecodeError::AlreadyFailed),
            _ => Err(DecodeError::UnexpectedEnd { chunk: self.parser.current() }),
        }
    }

    /// Whether the whole file has been read.
    #[must_use]
    pub fn is_complete(&self) -> bool {
        matches!(self.stage, Stage::Complete)
    }

    /// What the file says of its picture, once that has arrived.
    #[must_use]
    pub fn header(&self) -> Option<&Header> {
        self.header.as_ref()
    }

    /// How each component is stored: two of position, three of shape, one per channel. Empty
    /// until that has arrived, and with [`Coding::Entropy`].
    #[must_use]
    pub fn quantizers(&self) -> &[Quantizer] {
        &self.quantizers
    }

    /// The steps of [`Coding::Entropy`]; `None` until they have arrived, and with
    /// [`Coding::Packed`].
    #[must_use]
    pub fn lattice_steps(&self) -> Option<LatticeSteps> {
        self.lattice.as_ref().map(Lattice::steps)
    }

    /// The metadata that has arrived. All of it stands before the first Gaussian.
    #[must_use]
    pub fn metadata(&self) -> &Metadata {
        &self.metadata
    }

    /// The Gaussians that have arrived, in file order.
    #[must_use]
    pub fn gaussians(&self) -> &[Gaussian] {
        &self.gaussians
    }

    /// The chunks that are complete, by type, in order of first appearance.
    #[must_use]
    pub fn chunks(&self) -> &[ChunkStatistics] {
        &self.chunks
    }

    /// The picture so far; `None` until the header has arrived.
    #[must_use]
    pub fn picture(&self) -> Option<Picture<'_>> {
        let header = self.header.as_ref()?;
        Some(Picture::new(header, &self.gaussians, &self.limits, self.held()))
    }

    /// Bytes that are held.
    pub(super) fn held(&self) -> u64 {
        let gaussians = self.gaussians.capacity() as u64 * size_of::<Gaussian>() as u64;
        self.described() + self.waiting.memory() + gaussians
    }

    /// Those of what stands before the Gaussians.
    fn described(&self) -> u64 {
        let bounds = self.bounds.as_ref().map_or(0, Vec::len) * size_of::<LayerBounds>();
        self.metadata.size() + bounds as u64
    }

    /// How many of the next bytes are certain to be of this file; see [`Parser::certain`].
    #[cfg(feature = "std")]
    pub(super) fn certain(&self) -> usize {
        self.parser.certain()
    }

    /// Whether the first layer has begun: header and metadata are complete.
    #[cfg(feature = "std")]
    pub(super) fn has_begun(&self) -> bool {
        matches!(self.stage, Stage::Layer(..) | Stage::Complete)
            || self.layers > 0
            || self.parser.current() == Some(ChunkType::GAUS)
    }

    /// Reads what there is. Entropy-coded layers may wait, to be decoded side by side.
    fn advance(&mut self, input: &mut &[u8], may_wait: bool) -> Result<(), DecodeError> {
        match self.stage {
            Stage::Failed => return Err(DecodeError::AlreadyFailed),
            Stage::Complete => return Ok(()),
            _ => {}
        }
        loop {
            match self.parser.next(input)? {
                Event::NeedMore => return Ok(()),
                Event::Begin(chunk, length) => {
                    let stage = match self.begin(chunk, length) {
                        Err(DecodeError::Limit { .. }) if self.waiting.count() > 0 => {
                            // What waits need not take memory any longer.
                            self.decode_waiting(Threads::One)?;
                            self.begin(chunk, length)
                        }
                        stage => stage,
                    };
                    self.stage = stage?;
                }
                Event::Payload(payload) => self.payload(payload)?,
                Event::Complete(chunk, length) => {
                    self.complete(chunk)?;
                    if !may_wait {
                        self.decode_waiting(Threads::One)?;
                    }
                    self.count(chunk, length);
                    if matches!(self.stage, Stage::Complete) {
                        return Ok(());
                    }
                }
            }
        }
    }

    /// Checks that a chunk may stand here, and says what becomes of its payload.
    fn begin(&self, chunk: ChunkType, length: u32) -> Result<Stage, DecodeError> {
        let misplaced = |reason| Err(DecodeError::malformed(chunk, reason));
        if self.header.is_none() && chunk != ChunkType::GHDR {
            return misplaced("stands before the header");
        }
        match chunk {
            ChunkType::GHDR if self.header.is_some() => misplaced("appears twice"),
            ChunkType::QNTZ if self.is_quantized() => misplaced("appears twice"),
            ChunkType::GHDR | ChunkType::QNTZ if length > MAX_SMALL_CHUNK => {
                misplaced("is too long")
            }
            ChunkType::GAUS if !self.is_quantized() => misplaced("stands before QNTZ"),
            ChunkType::GAUS if Some(self.layers) == self.header.as_ref().map(|h| h.layers) => {
                misplaced("more layers than the header declares")
            }
            ChunkType::GAUS if self.lattice.is_some() => self.collected(length),
            ChunkType::GAUS => {
                Ok(Stage::Layer(PackedLayerReader::new(length), self.gaussians.len()))
            }
            ChunkType::GEND if length != 0 => misplaced("is not empty"),
            ChunkType::BNDS if self.layers == 0 && self.bounds.is_some() => {
                misplaced("appears twice")
            }
            // A later version may add to these; version 1 reads them before any layer only.
            ChunkType::BNDS if self.layers == 0 => self.collected(length),
            _ if Metadata::knows(chunk) && self.layers == 0 => self.collected(length),
            ChunkType::GHDR | ChunkType::QNTZ => Ok(collect(length)),
            ChunkType::GEND => Ok(Stage::Skip),
            _ if chunk.is_critical() => Err(DecodeError::unknown_critical(chunk)),
            _ => Ok(Stage::Skip),
        }
    }

    /// Whether `QNTZ` was read.
    fn is_quantized(&self) -> bool {
        self.lattice.is_some() || !self.quantizers.is_empty()
    }

    /// The stage that collects a chunk of any length.
    fn collected(&self, length: u32) -> Result<Stage, DecodeError> {
        let gaussians = self.header.as_ref().map_or(0, |header| header.gaussians);
        let declared = growing::<Gaussian>(gaussians) + growing::<u8>(length);
        self.limits.check_memory(self.described() + self.waiting.memory() + declared)?;
        Ok(collect(length))
    }

    fn payload(&mut self, mut payload: &[u8]) -> Result<(), DecodeError> {
        match &mut self.stage {
            Stage::Collect { payload: bytes, length } => {
                grow(bytes, payload.len(), *length);
                bytes.extend_from_slice(payload);
            }
            Stage::Layer(layer, _) => {
                let Some(header) = &self.header else { return Ok(()) };
                let allowed = header.gaussians - self.gaussians.len() as u32;
                if layer.count(&mut payload, &self.quantizers, allowed)?.is_none() {
                    return Ok(());
                }
                while let Some(values) = layer.next(&mut payload, &self.quantizers)? {
                    let values = &values[..self.quantizers.len()];
                    grow(&mut self.gaussians, 1, header.gaussians as usize);
                    self.gaussians.push(Gaussian::from_components(values, header.parameterization));
                }
            }
            _ => {}
        }
        Ok(())
    }

    /// Reads a chunk whose CRC was right.
    fn complete(&mut self, chunk: ChunkType) -> Result<(), DecodeError> {
        match (chunk, &mut self.stage) {
            (ChunkType::GHDR, Stage::Collect { payload, .. }) => {
                let header = Header::parse(payload)?;
                self.check_header(&header)?;
                self.header = Some(header);
            }
            (ChunkType::QNTZ, Stage::Collect { payload, .. }) => {
                let Some(header) = &self.header else { return Ok(()) };
                match header.coding {
                    Coding::Packed => {
                        self.quantizers = Quantizer::parse_all(payload, header.components())?;
                    }
                    Coding::Entropy => {
                        let lattice = Lattice::parse(payload, header.color.channels())?;
                        self.lattice = Some(lattice);
                    }
                }
            }
            (ChunkType::GAUS, Stage::Collect { payload, .. }) => {
                let payload = core::mem::take(payload);
                let declared = self.header.as_ref().map_or(0, |header| header.gaussians);
                let allowed = declared - self.arrived() as u32;
                let number = usize::from(self.layers);
                let bounds = self.bounds.as_ref().and_then(|bounds| bounds.get(number).copied());
                self.waiting.push(payload, bounds, allowed)?;
                self.layers += 1;
            }
            (ChunkType::BNDS, Stage::Collect { payload, .. }) => {
                let Some(header) = &self.header else { return Ok(()) };
                self.bounds = Some(LayerBounds::parse_all(payload, header)?);
            }
            (_, Stage::Collect { payload, .. }) => {
                let payload = core::mem::take(payload);
                self.metadata.take(chunk, payload)?;
            }
            (_, Stage::Layer(layer, _)) => {
                layer.finish()?;
                self.layers += 1;
            }
            (ChunkType::GEND, _) => {
                let declared = self.header.as_ref().map(|h| (h.layers, h.gaussians as usize));
                if declared != Some((self.layers, self.arrived())) {
                    let reason = "fewer layers or Gaussians than the header declares";
                    return Err(DecodeError::malformed(chunk, reason));
                }
                self.stage = Stage::Complete;
                return Ok(());
            }
            _ => {}
        }
        self.stage = Stage::Idle;
        Ok(())
    }

    /// How many Gaussians have arrived, decoded or not.
    pub(super) fn arrived(&self) -> usize {
        self.gaussians.len() + self.waiting.count()
    }

    /// Decodes the layers that wait, up to the first that is not sound.
    pub(super) fn decode_waiting(&mut self, threads: Threads) -> Result<(), DecodeError> {
        let (Some(header), Some(lattice)) = (&self.header, &self.lattice) else {
            return Ok(());
        };
        let waiting = core::mem::take(&mut self.waiting);
        let layers = waiting.select(|_| true);
        grow(&mut self.gaussians, layers.count(), header.gaussians as usize);
        let statistics = self.statistics.as_mut();
        let decoded = layers.decode(header, lattice, statistics, threads, &mut self.gaussians);
        if decoded.is_err() {
            self.stage = Stage::Failed;
        }
        decoded
    }

    /// The Gaussians for a region: those that were decoded, and those of the waiting layers that show in
    /// it. The layers go on waiting. `None` where the region leaves out no layer, and where one is not
    /// sound: then all are to be decoded for good, which says what is wrong.
    #[cfg(feature = "std")]
    pub(super) fn showing(&self, options: &RenderOptions) -> Option<Vec<Gaussian>> {
        let (header, lattice) = (self.header.as_ref()?, self.lattice.as_ref()?);
        let view = options.view(header, &self.limits).ok()?;
        let shows = |bounds: LayerBounds| bounds.show_in(&view, header);
        let layers = self.waiting.select(|bounds| bounds.is_none_or(shows));
        if layers.count() == self.waiting.count() || options.prefix.is_some() {
            return None;
        }
        let count = self.gaussians.len() + layers.count();
        let places = count as u64 * size_of::<Gaussian>() as u64;
        self.limits.check_memory(self.held() + places).ok()?;
        let mut gaussians = Vec::with_capacity(count);
        gaussians.extend_from_slice(&self.gaussians);
        layers.decode(header, lattice, None, options.threads, &mut gaussians).ok()?;
        Some(gaussians)
    }

    /// Checks what a header declares against the limits.
    fn check_header(&self, header: &Header) -> Result<(), DecodeError> {
        self.limits.check_size(header.width, header.height)?;
        self.limits.check_gaussians(header.gaussians)?;
        self.limits.check_memory(self.described() + growing::<Gaussian>(header.gaussians))
    }

    fn count(&mut self, kind: ChunkType, length: u32) {
        let bytes = u64::from(length) + 12;
        if let Some(known) = self.chunks.iter_mut().find(|known| known.kind == kind) {
            known.count = known.count.saturating_add(1);
            known.bytes += bytes;
        } else if self.chunks.len() < MAX_CHUNK_KINDS {
            self.chunks.push(ChunkStatistics { kind, count: 1, bytes });
        }
    }
}

/// The stage that collects a chunk of `length` bytes.
fn collect(length: u32) -> Stage {
    Stage::Collect { payload: Vec::new(), length: length as usize }
}

/// Most bytes that a vector holds which [`grow`]s to `length` items: the last time that it moves,
/// its old and its new memory exist at the same time.
fn growing<T>(length: u32) -> u64 {
    2 * u64::from(length) * size_of::<T>() as u64
}

/// Makes room for `additional` items: by doubling, as they arrive, but never for more than the
/// `declared` number in all.
fn grow<T>(items: &mut Vec<T>, additional: usize, declared: usize) {
    let length = items.len();
    if items.capacity() - length < additional {
        items.reserve_exact(additional.max(length.min(declared.saturating_sub(length))));
    }
}
