//! Small files that are the beginning of large ones: the first layers of a file are a picture, and so is a file of them
//! (spec, section 4.4). Nothing is decoded for it.

use alloc::borrow::Cow;
use alloc::vec::Vec;

use super::header::{Dequantizer, Header};
use super::metadata::Metadata;
use super::parser::{Event, Parser};
use super::writer::ChunkWriter;
use crate::chunk::ChunkType;
use crate::coding::layer_count::LayerCount;
use crate::error::DecodeError;

/// The file of the first layers of another one.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
#[non_exhaustive]
pub struct Prefix {
    /// How many layers it has.
    pub layers: u16,
    /// How many Gaussians these have.
    pub gaussians: u32,
    /// How many bytes the file of them has: see [`Prefixes::file`].
    pub bytes: usize,
    /// Where these layers end in the file that they are taken from.
    pub end: usize,
}

/// The files that the first layers of a file make: one for each number of layers, up to all of those that the bytes
/// at hand have completely.
///
/// A file that is cut off is no whole file, which decoders report as an error. These are: a placeholder of a few
/// hundred bytes, or a smaller picture for a slow line, from a file that is at hand, without decoding and encoding.
/// They keep what says how the picture is shown: its colour space and ICC profile, and its orientation. Texture and
/// all other metadata are left out. A file without Gaussians has one prefix, of no layers.
#[derive(Debug)]
pub struct Prefixes<'a> {
    header: Header,
    dequantizer: Option<Dequantizer>,
    /// Chunks to keep, all of which stand before the first layer.
    kept: Vec<(ChunkType, Cow<'a, [u8]>)>,
    /// The types of the chunks that may be kept once and have come, kept or not.
    seen: Vec<ChunkType>,
    layers: Vec<Layer<'a>>,
    /// Where the file ends, if that has come.
    end: Option<usize>,
}

#[derive(Debug)]
struct Layer<'a> {
    gaussians: u32,
    /// Without the number of Gaussians.
    bytes: &'a [u8],
    /// Where the layer ends in the file.
    end: usize,
    /// The Gaussians of all layers before it.
    gaussians_before: u32,
    /// The bytes of all layers before it, in a file that does not end with them.
    bytes_before: usize,
}

impl Layer<'_> {
    /// The bytes of its chunk.
    fn framed(&self, is_last: bool) -> usize {
        let count = LayerCount::written(self.gaussians, is_last);
        ChunkType::LAYER.framed(count.len() + self.bytes.len())
    }
}

impl<'a> Prefixes<'a> {
    /// The prefixes of a file, or of the beginning of one, or of one that is damaged after its first layer.
    ///
    /// # Errors
    /// When the first layer is not complete, and the header is not complete either or the file malformed or
    /// unsupported. The Gaussians themselves are not looked at.
    pub fn new(file: &'a [u8]) -> Result<Self, DecodeError> {
        let mut found = None;
        match Self::read(file, &mut found) {
            Ok(current) => found.ok_or(DecodeError::UnexpectedEnd { chunk: current }),
            Err(error) => found.filter(|found: &Self| !found.layers.is_empty()).ok_or(error),
        }
    }

    /// Reads a file as far as it goes. Returns the chunk that is incomplete.
    fn read(file: &'a [u8], found: &mut Option<Self>) -> Result<Option<ChunkType>, DecodeError> {
        let mut parser = Parser::new();
        let (mut rest, mut payload) = (file, &file[..0]);
        loop {
            match parser.next(&mut rest)? {
                Event::NeedMore => return Ok(parser.current()),
                Event::Begin(chunk, length) => {
                    if found.is_some() == (chunk == ChunkType::HEADER) {
                        let reason = "the header does not stand at the beginning, and only there";
                        return Err(DecodeError::malformed(chunk, reason));
                    }
                    if chunk == ChunkType::HEADER {
                        Header::check_length(length)?;
                    }
                    payload = &[];
                }
                // All of it is there if the chunk is complete.
                Event::Payload(bytes) => payload = bytes,
                Event::Complete(chunk, _) => match found {
                    None => *found = Some(Self::of_header(payload)?),
                    Some(found) => found.add(chunk, payload, file.len() - rest.len())?,
                },
            }
            if found.as_ref().is_some_and(|found| found.end.is_some()) {
                return Ok(None);
            }
        }
    }

    fn of_header(payload: &[u8]) -> Result<Self, DecodeError> {
        let (header, dequantizer) = Header::parse(payload)?;
        let (kept, seen, layers) = (Vec::new(), Vec::new(), Vec::new());
        Ok(Self { header, dequantizer, kept, seen, layers, end: None })
    }

    /// Takes the payload of a chunk that ends at this place in the file.
    fn add(&mut self, chunk: ChunkType, payload: &'a [u8], end: usize) -> Result<(), DecodeError> {
        match chunk {
            ChunkType::LAYER => {
                let declared = usize::from(self.header.layers);
                if self.layers.len() == declared {
                    let reason = "more layers than the header declares";
                    return Err(DecodeError::malformed(chunk, reason));
                }
                let (gaussians_before, bytes_before) = self.so_far();
                let later = declared - self.layers.len() - 1;
                let mut bytes = payload;
                let declared = LayerCount::new(self.header.gaussians - gaussians_before, later);
                let gaussians = declared.take(&mut bytes)?;
                self.layers.push(Layer { gaussians, bytes, end, gaussians_before, bytes_before });
            }
            ChunkType::END => self.end = Some(end),
            // Others of them break a rule: decoders skip them.
            _ if Metadata::may_be_of_display(chunk) => {
                if self.layers.is_empty() && !self.seen.contains(&chunk) {
                    self.keep(chunk, payload);
                }
            }
            _ if !chunk.is_critical() => {}
            _ => return Err(DecodeError::unknown_critical(chunk)),
        }
        Ok(())
    }

    /// Keeps the first sound chunk of a type, as far as it says how the picture is shown.
    fn keep(&mut self, chunk: ChunkType, payload: &'a [u8]) {
        let kept = Metadata::for_placeholder(chunk, payload);
        if kept.is_some() || chunk == ChunkType::EXIF {
            self.seen.push(chunk);
        }
        self.kept.extend(kept.map(|payload| (chunk, payload)));
    }

    /// The Gaussians and the bytes of all layers so far.
    fn so_far(&self) -> (u32, usize) {
        let of = |last: &Layer<'_>| {
            (last.gaussians_before + last.gaussians, last.bytes_before + last.framed(false))
        };
        self.layers.last().map_or((0, 0), of)
    }

    /// All prefixes: first that of the first layer.
    pub fn iter(&self) -> impl ExactSizeIterator<Item = Prefix> + '_ {
        let is_empty = self.header.layers == 0;
        let count = if is_empty { self.end.iter().len() } else { self.layers.len() };
        (0..count).map(move |number| {
            let layers = if is_empty { 0 } else { number + 1 };
            let last = self.layers.get(number);
            let end = last.map_or(self.end, |last| Some(last.end)).unwrap_or_default();
            let gaussians = last.map_or(0, |last| last.gaussians_before + last.gaussians);
            Prefix {
                layers: layers as u16,
                gaussians,
                bytes: self.length(last, layers, gaussians),
                end,
            }
        })
    }

    /// The number of layers that the whole file has.
    #[must_use]
    pub fn layers(&self) -> u16 {
        self.header.layers
    }

    /// The longest prefix of at most so many bytes. `None` if the first layer takes more.
    #[must_use]
    pub fn within(&self, bytes: usize) -> Option<Prefix> {
        // A prefix of more layers has more bytes.
        self.iter().take_while(|prefix| prefix.bytes <= bytes).last()
    }

    /// The file of a prefix.
    #[must_use]
    pub fn file(&self, prefix: Prefix) -> Vec<u8> {
        let layers = &self.layers[..self.layers.len().min(prefix.layers.into())];
        let gaussians = layers.iter().map(|layer| layer.gaussians).sum();
        let mut file = ChunkWriter::new();
        file.chunk(ChunkType::HEADER, &[&self.header(layers.len(), gaussians)]);
        for (kind, payload) in &self.kept {
            file.chunk(*kind, &[&payload[..]]);
        }
        for (number, layer) in layers.iter().enumerate() {
            let count = LayerCount::written(layer.gaussians, number + 1 == layers.len());
            file.chunk(ChunkType::LAYER, &[&count, layer.bytes]);
        }
        file.finish()
    }

    /// The length of the file of so many layers and Gaussians, of which this layer is the last.
    fn length(&self, last: Option<&Layer<'_>>, layers: usize, gaussians: u32) -> usize {
        let kept = self.kept.iter().map(|(kind, payload)| kind.framed(payload.len()));
        let bytes = last.map_or(0, |last| last.bytes_before + last.framed(true));
        ChunkWriter::length(self.header(layers, gaussians).len(), kept.sum::<usize>() + bytes)
    }

    /// The payload of the header of so many layers and Gaussians.
    fn header(&self, layers: usize, gaussians: u32) -> Vec<u8> {
        let header = Header { layers: layers as u16, gaussians, ..self.header.clone() };
        header.to_payload(self.dequantizer.as_ref())
    }
}
