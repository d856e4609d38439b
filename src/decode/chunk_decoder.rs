//! Decodes the chunks of a file one after the other: checks their order and their sizes, and keeps
//! what they contain (spec, sections 4.3 to 5).

use alloc::format;
use alloc::vec::Vec;

use super::memory::{peak_memory, reserve};
use super::pending::PendingLayers;
use crate::chunk::ChunkType;
use crate::coding::entropy::{AttributeBits, Quantization};
use crate::coding::layer_count::LayerCount;
use crate::coding::packed::{PackedLayerReader, Quantizer};
use crate::container::{Dequantizer, Header, Metadata};
use crate::error::{DecodeError, Reason, SkippedChunk};
use crate::gaussian::Gaussian;
use crate::layers::bounds::LayerBounds;
use crate::limits::Limits;
#[cfg(feature = "std")]
use crate::render::RenderOptions;
use crate::texture::Texture;
use crate::threads::Threads;

/// Most skipped chunks that are listed: there may be as many as a file has bytes.
const MAX_SKIPPED: usize = 16;

/// What the chunks of a file contain, as far as they have arrived.
#[derive(Debug, Default)]
pub(super) struct ChunkDecoder {
    pub(super) limits: Limits,
    stage: Stage,
    pub(super) header: Option<Header>,
    /// The quantizers of the packed coding, one per component.
    pub(super) quantizers: Vec<Quantizer>,
    /// The quantization grid of the entropy coding.
    pub(super) quantization: Option<Quantization>,
    /// The bounds of every layer that the header declares, if the file has them.
    bounds: Option<Vec<LayerBounds>>,
    pub(super) texture: Option<Texture>,
    /// Entropy-coded layers that have arrived and are not decoded yet.
    pending: PendingLayers,
    pub(super) metadata: Metadata,
    /// The memory of the metadata, in bytes.
    metadata_memory: u64,
    /// Chunks that broke a rule, at most [`MAX_SKIPPED`].
    pub(super) skipped: Vec<SkippedChunk>,
    /// The Gaussians that are decoded, in file order.
    pub(super) gaussians: Vec<Gaussian>,
    /// The bits of entropy-coded Gaussians, if they are to be counted.
    pub(super) statistics: Option<AttributeBits>,
    /// The number of Gaussians in each layer that has arrived.
    pub(super) layers: Vec<u32>,
}

/// What becomes of the bytes of the current chunk.
#[derive(Debug, Default)]
enum Stage {
    /// There is no current chunk.
    #[default]
    Idle,
    /// The payload is skipped: that of a type that is not known, of the end, or of a chunk that may not stand here,
    /// for this reason.
    Skip(Option<&'static str>),
    /// The payload is collected, and read as a whole.
    Collect {
        /// The bytes that have arrived.
        payload: Vec<u8>,
        /// The number of bytes that the chunk declares.
        length: usize,
    },
    /// The payload is a layer of the packed coding, whose Gaussians are decoded as they arrive. The
    /// number is that of the Gaussians before it.
    Layer(PackedLayerReader, usize),
    /// The end was read.
    Complete,
    /// There was an error.
    Failed,
}

impl Stage {
    /// Collects a payload of `length` bytes.
    fn collect(length: u32) -> Self {
        Self::Collect { payload: Vec::new(), length: length as usize }
    }
}

impl ChunkDecoder {
    /// Whether the end of the file was read.
    pub(super) fn is_complete(&self) -> bool {
        matches!(self.stage, Stage::Complete)
    }

    /// Whether there was an error.
    pub(super) fn has_failed(&self) -> bool {
        matches!(self.stage, Stage::Failed)
    }

    /// Ends decoding after an error, and drops the Gaussians of an incomplete layer.
    pub(super) fn fail(&mut self) {
        if let Stage::Layer(_, before) = self.stage {
            self.gaussians.truncate(before);
        }
        self.stage = Stage::Failed;
    }

    /// Whether a layer or the end of the file has arrived, at least in part.
    pub(super) fn has_reached_layers(&self, current: Option<ChunkType>) -> bool {
        matches!(self.stage, Stage::Layer(..) | Stage::Complete)
            || !self.layers.is_empty()
            || current == Some(ChunkType::LAYER)
    }

    /// The number of Gaussians that have arrived, those of pending layers included.
    pub(super) fn arrived(&self) -> usize {
        self.gaussians.len() + self.pending.count()
    }

    /// The memory that is held, in bytes.
    pub(super) fn memory(&self) -> u64 {
        let gaussians = self.gaussians.capacity() as u64 * size_of::<Gaussian>() as u64;
        let layers = self.layers.capacity() as u64 * size_of::<u32>() as u64;
        self.ancillary_memory() + self.pending.memory() + gaussians + layers
    }

    /// The memory of what is no layer, in bytes: metadata, bounds and texture.
    fn ancillary_memory(&self) -> u64 {
        let bounds = self.bounds.as_ref().map_or(0, Vec::len) * size_of::<LayerBounds>();
        let texture = self.texture.as_ref().map_or(0, Texture::memory);
        self.metadata_memory + bounds as u64 + texture
    }

    /// Checks what a header declares against the limits.
    pub(super) fn check_header(&self, header: &Header) -> Result<(), DecodeError> {
        self.limits.check_size(header.width, header.height)?;
        self.limits.check_gaussians(header.gaussians)?;
        self.limits.check_memory(self.ancillary_memory() + Self::memory_of_layers(header))
    }

    /// Checks that there is memory for this much besides what has arrived and all Gaussians.
    fn check_memory(&self, bytes: u64) -> Result<(), DecodeError> {
        let layers = self.header.as_ref().map_or(0, Self::memory_of_layers);
        let held = self.ancillary_memory() + self.pending.memory() + layers;
        self.limits.check_memory(held + bytes)
    }

    /// The most memory of what the layers of a picture become, in bytes.
    fn memory_of_layers(header: &Header) -> u64 {
        peak_memory::<Gaussian>(header.gaussians) + peak_memory::<u32>(header.layers.into())
    }

    /// Begins a chunk with a payload of `length` bytes.
    pub(super) fn begin(&mut self, chunk: ChunkType, length: u32) -> Result<(), DecodeError> {
        self.stage = match self.stage_of(chunk, length) {
            Err(DecodeError::Limit { .. }) if self.pending.count() > 0 => {
                // Decoding the pending layers frees their memory.
                self.decode_pending(Threads::One)?;
                self.stage_of(chunk, length)?
            }
            stage => stage?,
        };
        Ok(())
    }

    /// Why an ancillary chunk may not stand here, as far as its type shows.
    fn flaw_of_place(&self, chunk: ChunkType) -> Option<&'static str> {
        let is_second = match chunk {
            ChunkType::BNDS => self.bounds.is_some(),
            ChunkType::TXTR => self.texture.is_some(),
            _ => self.metadata.has(chunk),
        };
        match chunk {
            _ if is_second => Some("appears twice"),
            _ if Metadata::is_of_color(chunk) => self.flaw_of_display(),
            _ => None,
        }
    }

    /// Why a chunk that says how the picture is shown may not stand here: it may have been shown by now.
    fn flaw_of_display(&self) -> Option<&'static str> {
        (!self.layers.is_empty()).then_some("stands after the first layer")
    }

    /// Notes that a chunk is skipped, as it breaks a rule.
    fn skip(&mut self, chunk: ChunkType, reason: Reason) {
        if self.skipped.len() < MAX_SKIPPED {
            self.skipped.push(SkippedChunk { chunk, reason });
        }
    }

    /// Decides what becomes of the payload of a chunk.
    ///
    /// # Errors
    /// When a critical chunk may not stand here, or a limit is exceeded.
    fn stage_of(&self, chunk: ChunkType, length: u32) -> Result<Stage, DecodeError> {
        let malformed = |reason| Err(DecodeError::malformed(chunk, reason));
        let Some(header) = &self.header else {
            return match chunk {
                ChunkType::HEADER => {
                    Header::check_length(length)?;
                    Ok(Stage::collect(length))
                }
                _ => malformed("stands before the header"),
            };
        };
        if let Some(flaw) = self.flaw_of_place(chunk) {
            return Ok(Stage::Skip(Some(flaw)));
        }
        match chunk {
            ChunkType::HEADER => malformed("appears twice"),
            ChunkType::LAYER if self.layers.len() == usize::from(header.layers) => {
                malformed("more layers than the header declares")
            }
            ChunkType::LAYER if self.quantization.is_some() => self.collect_within_limits(length),
            ChunkType::LAYER => {
                let mut layer = PackedLayerReader::new(length, self.next_count(header));
                // Of the last layer, the length says at once whether it is right.
                layer.count(&mut &[][..], &self.quantizers)?;
                Ok(Stage::Layer(layer, self.gaussians.len()))
            }
            ChunkType::END if self.layers.len() < usize::from(header.layers) => {
                malformed("fewer layers than the header declares")
            }
            ChunkType::END if length != 0 => malformed("is not empty"),
            ChunkType::END => Ok(Stage::Skip(None)),
            ChunkType::BNDS | ChunkType::TXTR => self.collect_within_limits(length),
            _ if Metadata::includes(chunk) => self.collect_within_limits(length),
            _ if chunk.is_critical() => Err(DecodeError::unknown_critical(chunk)),
            _ => Ok(Stage::Skip(None)),
        }
    }

    /// What is known of the number of Gaussians in the next layer.
    fn next_count(&self, header: &Header) -> LayerCount {
        let left = header.gaussians - self.arrived() as u32;
        LayerCount::new(left, usize::from(header.layers) - self.layers.len() - 1)
    }

    /// Collects a payload, if there is memory for it and for all Gaussians.
    fn collect_within_limits(&self, length: u32) -> Result<Stage, DecodeError> {
        self.check_memory(peak_memory::<u8>(length))?;
        Ok(Stage::collect(length))
    }

    /// Takes the next bytes of the payload of the current chunk.
    pub(super) fn payload(&mut self, mut bytes: &[u8]) -> Result<(), DecodeError> {
        match &mut self.stage {
            Stage::Collect { payload, length } => {
                reserve(payload, bytes.len(), *length);
                payload.extend_from_slice(bytes);
            }
            Stage::Layer(layer, _) => {
                let Some(header) = &self.header else { return Ok(()) };
                if layer.count(&mut bytes, &self.quantizers)?.is_none() {
                    return Ok(());
                }
                while let Some(values) = layer.next(&mut bytes, &self.quantizers)? {
                    let values = &values[..self.quantizers.len()];
                    reserve(&mut self.gaussians, 1, header.gaussians as usize);
                    self.gaussians.push(Gaussian::from_components(values, header.parameterization));
                }
            }
            _ => {}
        }
        Ok(())
    }

    /// Ends the current chunk, whose CRC is right.
    pub(super) fn complete(&mut self, chunk: ChunkType) -> Result<(), DecodeError> {
        match (chunk, &mut self.stage) {
            (ChunkType::HEADER, Stage::Collect { payload, .. }) => {
                let (header, dequantizer) = Header::parse(payload)?;
                self.check_header(&header)?;
                self.header = Some(header);
                match dequantizer {
                    Some(Dequantizer::Packed(quantizers)) => self.quantizers = quantizers,
                    Some(Dequantizer::Entropy(steps)) => self.quantization = Some(steps),
                    None => {}
                }
            }
            (ChunkType::LAYER, Stage::Collect { payload, .. }) => {
                let payload = core::mem::take(payload);
                let Some(header) = &self.header else { return Ok(()) };
                let declared = self.next_count(header);
                let count = self.pending.push(payload, declared, self.layers.len())?;
                self.count_layer(count);
            }
            (_, Stage::Collect { payload, .. }) => {
                let payload = core::mem::take(payload);
                if let Err(reason) = self.insert(chunk, payload)? {
                    self.skip(chunk, reason);
                }
            }
            (_, Stage::Layer(layer, before)) => {
                layer.finish()?;
                let count = self.gaussians.len() - *before;
                self.count_layer(count as u32);
            }
            (ChunkType::END, _) => {
                self.stage = Stage::Complete;
                return Ok(());
            }
            (_, &mut Stage::Skip(Some(flaw))) => self.skip(chunk, flaw.into()),
            _ => {}
        }
        self.stage = Stage::Idle;
        Ok(())
    }

    /// Notes that a layer with `count` Gaussians has arrived.
    fn count_layer(&mut self, count: u32) {
        let declared = self.header.as_ref().map_or(0, |header| header.layers.into());
        reserve(&mut self.layers, 1, declared);
        self.layers.push(count);
    }

    /// Takes what an ancillary chunk has, or says which rule it breaks.
    ///
    /// # Errors
    /// When a limit is exceeded, or a layer is malformed that is decoded to free its memory.
    fn insert(
        &mut self,
        chunk: ChunkType,
        payload: Vec<u8>,
    ) -> Result<Result<(), Reason>, DecodeError> {
        let flaw = match (chunk, &self.header) {
            (ChunkType::TXTR, _) => return self.insert_texture(&payload),
            (ChunkType::BNDS, Some(header)) => {
                LayerBounds::parse_all(&payload, header).map(|bounds| self.bounds = Some(bounds))
            }
            _ => match self.flaw_of_display() {
                Some(reason) if Metadata::is_of_display(chunk, &payload) => Err(reason),
                _ => {
                    let memory = Metadata::memory_of(chunk, payload.len());
                    let added = self.metadata.insert(chunk, payload);
                    self.metadata_memory += added.map_or(0, |()| memory);
                    added
                }
            },
        };
        Ok(flaw.map_err(Reason::from))
    }

    /// Decodes the texture, if there is memory for it and for all Gaussians, or says which rule it breaks.
    fn insert_texture(&mut self, payload: &[u8]) -> Result<Result<(), Reason>, DecodeError> {
        let texture = match self.texture_of(payload) {
            Err(DecodeError::Limit { .. }) if self.pending.count() > 0 => {
                // Decoding the pending layers frees their memory.
                self.decode_pending(Threads::One)?;
                self.texture_of(payload)
            }
            texture => texture,
        };
        match texture {
            Ok(texture) => self.texture = texture,
            Err(DecodeError::Malformed { reason, .. }) => return Ok(Err(reason)),
            Err(DecodeError::Unsupported { what, .. }) => return Ok(Err(format!("{what}").into())),
            Err(error) => return Err(error),
        }
        Ok(Ok(()))
    }

    /// The texture of a payload. `None` before the header.
    fn texture_of(&self, payload: &[u8]) -> Result<Option<Texture>, DecodeError> {
        let Some(header) = &self.header else { return Ok(None) };
        let texture = Texture::parse(payload, header, |count| {
            self.limits.check_gaussians(count)?;
            let gaussians = u64::from(count) * size_of::<Gaussian>() as u64;
            self.check_memory(payload.len() as u64 + gaussians)
        })?;
        Ok(Some(texture))
    }

    /// Decodes the pending layers up to the first that is malformed.
    pub(super) fn decode_pending(&mut self, threads: Threads) -> Result<(), DecodeError> {
        let (Some(header), Some(quantization)) = (&self.header, &self.quantization) else {
            return Ok(());
        };
        let pending = core::mem::take(&mut self.pending);
        let layers = pending.select(|_| true);
        reserve(&mut self.gaussians, layers.count(), header.gaussians as usize);
        let statistics = self.statistics.as_mut();
        let decoded = layers.decode(header, quantization, statistics, threads, &mut self.gaussians);
        if decoded.is_err() {
            self.stage = Stage::Failed;
        }
        decoded
    }

    /// The Gaussians that an output needs: those that are decoded, and those of the pending layers
    /// that may show in its region. The layers remain pending.
    ///
    /// `None` if all pending layers must be decoded in any case: if no layer can be skipped, or if
    /// one that cannot be is malformed, so that its error is reported.
    #[cfg(feature = "std")]
    pub(super) fn visible_gaussians(&self, options: &RenderOptions) -> Option<Vec<Gaussian>> {
        let (header, quantization) = (self.header.as_ref()?, self.quantization.as_ref()?);
        let view = options.view(header, &self.limits).ok()?;
        let bounds = self.bounds.as_ref()?;
        let layers = self.pending.select(|number| bounds[number].may_show_in(&view, header));
        if layers.count() == self.pending.count() || options.prefix.is_some() {
            return None;
        }
        let count = self.gaussians.len() + layers.count();
        let copies = count as u64 * size_of::<Gaussian>() as u64;
        self.limits.check_memory(self.memory() + copies).ok()?;
        let mut gaussians = Vec::with_capacity(count);
        gaussians.extend_from_slice(&self.gaussians);
        layers.decode(header, quantization, None, options.threads, &mut gaussians).ok()?;
        Some(gaussians)
    }
}
