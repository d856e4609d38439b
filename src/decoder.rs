//! The decoder: a push decoder without I/O, and an adapter over any `Read` (spec, sections 4
//! and 11).

use alloc::vec::Vec;

use crate::bounds::Bounds;
use crate::coding::account::AttributeBits;
use crate::coding::fixed::LayerReader;
use crate::coding::layers::Layers;
use crate::container::{ChunkType, Coding, Event, Header, Metadata, Parser};
use crate::error::DecodeError;
use crate::gaussian::Gaussian;
use crate::lattice::Lattice;
use crate::limits::Limits;
use crate::quantizer::Quantizer;
use crate::render::Picture;
#[cfg(feature = "std")]
use crate::render::RenderOptions;
#[cfg(feature = "std")]
use crate::threads;

/// Most bytes of a header or quantizer chunk of version 1: nine quantizers of twelve bytes.
const MAX_SMALL_CHUNK: u32 = 108;

/// Most types that [`StreamDecoder::chunks`] tells apart: types are the file's own choice.
const MAX_CHUNK_KINDS: usize = 64;

/// Decodes bytes as they arrive, in pieces of any size, on the caller's thread.
///
/// After any piece it can give the [`Picture`] so far. It allocates as bytes arrive, never on the
/// word of a declared count.
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
    limits: Limits,
    stage: Stage,
    header: Option<Header>,
    /// Of coding 0.
    quantizers: Vec<Quantizer>,
    /// Of coding 1.
    lattice: Option<Lattice>,
    /// Of every layer that the header declares, where the file has them.
    bounds: Option<Vec<Bounds>>,
    /// Layers of coding 1 that have arrived and were not decoded yet.
    waiting: Layers,
    metadata: Metadata,
    gaussians: Vec<Gaussian>,
    /// Bits of the Gaussians of coding 1, where asked for.
    account: Option<AttributeBits>,
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
    Layer(LayerReader, usize),
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
        Self::with_limits(Limits::default())
    }

    /// A decoder with the given limits.
    #[must_use]
    pub fn with_limits(limits: Limits) -> Self {
        Self {
            parser: Parser::new(),
            limits,
            stage: Stage::Idle,
            header: None,
            quantizers: Vec::new(),
            lattice: None,
            bounds: None,
            waiting: Layers::default(),
            metadata: Metadata::default(),
            gaussians: Vec::new(),
            account: None,
            layers: 0,
            chunks: Vec::new(),
        }
    }

    /// Keeps account of what bits are spent on, from here on. Takes time for every symbol.
    #[cfg(feature = "std")]
    #[must_use]
    pub fn with_account(mut self) -> Self {
        self.account = Some(AttributeBits::default());
        self
    }

    /// Bits of the Gaussians that have arrived, by attribute; `None` where the decoder was to keep
    /// no account of them ([`StreamDecoder::with_account`]).
    #[cfg(feature = "std")]
    #[must_use]
    pub fn attribute_bits(&self) -> Option<AttributeBits> {
        let account = self.account?;
        let of = |components: core::ops::Range<usize>| {
            let quantizers = self.quantizers.get(components).unwrap_or(&[]);
            let bits = quantizers.iter().map(|quantizer| f64::from(quantizer.bits())).sum::<f64>();
            bits * self.gaussians.len() as f64
        };
        Some(AttributeBits {
            position: account.position + of(0..2),
            shape: account.shape + of(2..5),
            color: account.color + of(5..self.quantizers.len().max(5)),
            ..account
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

    /// Like [`StreamDecoder::feed`], but layers of coding 1 may have to wait for
    /// [`StreamDecoder::decode_waiting`].
    fn take(&mut self, bytes: &[u8], may_wait: bool) -> Result<usize, DecodeError> {
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
    /// until that has arrived, and where Gaussians are stored as sets ([`Coding::Set`]).
    #[must_use]
    pub fn quantizers(&self) -> &[Quantizer] {
        &self.quantizers
    }

    /// The steps of [`Coding::Set`]: of position, size, ratio and slant, then of each colour axis
    /// (spec, section 7.5). Empty until they have arrived, and with [`Coding::Fixed`].
    #[must_use]
    pub fn steps(&self) -> Vec<f32> {
        self.lattice.as_ref().map_or_else(Vec::new, Lattice::steps)
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
    fn held(&self) -> u64 {
        let gaussians = self.gaussians.capacity() as u64 * size_of::<Gaussian>() as u64;
        self.described() + self.waiting.memory() + gaussians
    }

    /// Those of what stands before the Gaussians.
    fn described(&self) -> u64 {
        let bounds = self.bounds.as_ref().map_or(0, Vec::len) * size_of::<Bounds>();
        self.metadata.size() + bounds as u64
    }

    /// Whether the first layer has begun: header and metadata are complete.
    #[cfg(feature = "std")]
    fn has_begun(&self) -> bool {
        matches!(self.stage, Stage::Layer(..) | Stage::Complete)
            || self.layers > 0
            || self.parser.current() == Some(ChunkType::GAUS)
    }

    /// Reads what there is. Layers of coding 1 may wait, to be decoded side by side.
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
                            self.decode_waiting(false)?;
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
                        self.decode_waiting(false)?;
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
            ChunkType::GAUS => Ok(Stage::Layer(LayerReader::new(length), self.gaussians.len())),
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
                    self.gaussians.push(Gaussian::from_components(values, header.chart));
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
                    Coding::Fixed => {
                        self.quantizers = Quantizer::parse_all(payload, header.components())?;
                    }
                    Coding::Set => {
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
                self.bounds = Some(Bounds::parse_all(payload, header)?);
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
    fn arrived(&self) -> usize {
        self.gaussians.len() + self.waiting.count()
    }

    /// Decodes the layers that wait, up to the first that is not sound.
    fn decode_waiting(&mut self, parallel: bool) -> Result<(), DecodeError> {
        let (Some(header), Some(lattice)) = (&self.header, &self.lattice) else {
            return Ok(());
        };
        let waiting = core::mem::take(&mut self.waiting);
        let layers = waiting.select(|_| true);
        grow(&mut self.gaussians, layers.count(), header.gaussians as usize);
        let account = self.account.as_mut();
        let decoded = layers.decode(header, lattice, account, parallel, &mut self.gaussians);
        if decoded.is_err() {
            self.stage = Stage::Failed;
        }
        decoded
    }

    /// What there is for some output and what it adds of the layers that wait, which go on waiting;
    /// `None` where that is all of them, or not all is well: then they are to be decoded for good,
    /// which says what is wrong.
    #[cfg(feature = "std")]
    fn showing(&self, options: &RenderOptions) -> Option<Vec<Gaussian>> {
        let (header, lattice) = (self.header.as_ref()?, self.lattice.as_ref()?);
        let view = options.view(header, &self.limits).ok()?;
        let shows = |bounds: Bounds| bounds.meet(&view, header);
        let layers = self.waiting.select(|bounds| bounds.is_none_or(shows));
        if layers.count() == self.waiting.count() || options.prefix.is_some() {
            return None;
        }
        let count = self.gaussians.len() + layers.count();
        let places = count as u64 * size_of::<Gaussian>() as u64;
        self.limits.check_memory(self.held() + places).ok()?;
        let mut gaussians = Vec::with_capacity(count);
        gaussians.extend_from_slice(&self.gaussians);
        layers.decode(header, lattice, None, options.parallel, &mut gaussians).ok()?;
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

/// Decodes from any reader, in one pass and without seeking, on the threads that
/// [`RenderOptions::parallel`](crate::RenderOptions::parallel) allows.
///
/// ```no_run
/// # fn main() -> Result<(), image_gip::DecodeError> {
/// let file = std::fs::File::open("picture.gip")?;
/// let mut decoder = image_gip::Decoder::new(file)?;
/// let mut pixels = vec![0; decoder.output_len().expect("fits the address space")];
/// decoder.decode_into(&mut pixels)?;
/// # Ok(())
/// # }
/// ```
#[cfg(feature = "std")]
#[derive(Debug)]
pub struct Decoder<R> {
    reader: R,
    stream: StreamDecoder,
    options: RenderOptions,
}

#[cfg(feature = "std")]
impl<R: std::io::Read> Decoder<R> {
    /// Reads header and metadata, with the default limits.
    ///
    /// # Errors
    /// When reading fails, or the file is not a sound `.gip` file up to its first layer.
    pub fn new(reader: R) -> Result<Self, DecodeError> {
        Self::with_limits(reader, Limits::default())
    }

    /// Reads header and metadata, with the given limits.
    ///
    /// # Errors
    /// As [`Decoder::new`], and when a limit is exceeded.
    pub fn with_limits(reader: R, limits: Limits) -> Result<Self, DecodeError> {
        let stream = StreamDecoder::with_limits(limits);
        let options = RenderOptions::new();
        let mut decoder = Self { reader, stream, options };
        decoder.read_until(StreamDecoder::has_begun)?;
        Ok(decoder)
    }

    /// What the file says of its picture.
    #[must_use]
    #[expect(clippy::missing_panics_doc, reason = "no decoder exists without a header")]
    pub fn header(&self) -> &Header {
        self.stream.header().expect("`with_limits` read it")
    }

    /// ICC profile, Exif, XMP and texts.
    #[must_use]
    pub fn metadata(&self) -> &Metadata {
        self.stream.metadata()
    }

    /// The push decoder inside, with all that was decoded.
    #[must_use]
    pub fn stream(&self) -> &StreamDecoder {
        &self.stream
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

    /// The number of samples that [`Decoder::decode_into`] writes.
    #[must_use]
    pub fn output_len(&self) -> Option<usize> {
        self.options.output_len(self.header())
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

    /// The picture so far.
    #[must_use]
    #[expect(clippy::missing_panics_doc, reason = "no decoder exists without a header")]
    pub fn picture(&self) -> Picture<'_> {
        self.stream.picture().expect("`with_limits` read the header")
    }

    /// Reads the rest of the file and renders interleaved 8-bit samples.
    ///
    /// For a region of a large picture, layers that do not show in it are checked but not decoded,
    /// and what was decoded for it is not kept: who renders many regions calls
    /// [`Decoder::read_to_end`] first.
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

    /// Reads the rest of the file and renders what shows.
    fn render(
        &mut self,
        render: impl FnOnce(&Picture<'_>, &RenderOptions) -> Result<(), DecodeError>,
    ) -> Result<(), DecodeError> {
        threads::wake(self.options.parallel);
        self.read_until(StreamDecoder::is_complete)?;
        if let Some(gaussians) = self.stream.showing(&self.options) {
            let held = self.stream.held() + gaussians.len() as u64 * size_of::<Gaussian>() as u64;
            let picture = Picture::new(self.header(), &gaussians, &self.stream.limits, held);
            return render(&picture, &self.options);
        }
        self.decode_waiting()?;
        render(&self.picture(), &self.options)
    }

    /// Reads until something is reached, and decodes the layers that came.
    fn read_layers_until(
        &mut self,
        reached: impl Fn(&StreamDecoder) -> bool,
    ) -> Result<(), DecodeError> {
        threads::wake(self.options.parallel);
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

    fn decode_waiting(&mut self) -> Result<(), DecodeError> {
        self.stream.decode_waiting(self.options.parallel)
    }

    /// Takes one piece of the file.
    fn read_some(&mut self) -> Result<(), DecodeError> {
        let mut buffer = [0; 8192];
        loop {
            match self.reader.read(&mut buffer) {
                Ok(0) => return self.stream.finish(),
                Ok(length) => return self.stream.take(&buffer[..length], true).map(|_| ()),
                Err(error) if error.kind() == std::io::ErrorKind::Interrupted => {}
                Err(error) => return Err(error.into()),
            }
        }
    }
}
