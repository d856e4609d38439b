//! A push parser for the signature and the framing of chunks (spec, sections 4.1 and 4.2). It does
//! no I/O, and buffers at most eight bytes.

use byteorder::{ByteOrder, LittleEndian};

#[cfg(feature = "std")]
use crate::chunk::FRAMING;
use crate::chunk::{ChunkType, MAX_CHUNK_LENGTH, SIGNATURE};
use crate::error::DecodeError;

/// Bytes of a CRC.
const CRC_LENGTH: usize = 4;

/// What the parser has found.
#[derive(Debug)]
pub(crate) enum Event<'a> {
    /// The end of the input.
    NeedMore,
    /// The beginning of a chunk with this many bytes of payload.
    Begin(ChunkType, u32),
    /// The next bytes of the payload of the current chunk.
    Payload(&'a [u8]),
    /// The end of a chunk with this many bytes of payload and the right CRC.
    Complete(ChunkType, u32),
}

#[derive(Clone, Copy, Debug)]
enum State {
    /// Collecting the eight bytes of the signature.
    Signature,
    /// Collecting length and type.
    ChunkHeader,
    /// Passing payload on, of which this many bytes are missing.
    Payload(ChunkType, u32),
    /// Collecting the CRC.
    Crc(ChunkType),
}

/// Splits a byte stream into chunks and checks their framing.
#[derive(Debug)]
pub(crate) struct Parser {
    state: State,
    /// The bytes of the signature, of length and type, or of a CRC that have arrived.
    word: [u8; 8],
    /// The number of these bytes.
    collected: usize,
    crc: crc32fast::Hasher,
    /// Bytes of payload that the current chunk declares.
    length: u32,
}

impl Parser {
    pub(crate) fn new() -> Self {
        Self {
            state: State::Signature,
            word: [0; 8],
            collected: 0,
            crc: crc32fast::Hasher::new(),
            length: 0,
        }
    }

    /// How many bytes can be read without reading past the end of the file: at least one until
    /// then.
    #[cfg(feature = "std")]
    pub(crate) fn safe_to_read(&self) -> usize {
        let chunk_after = |chunk| if chunk == ChunkType::GEND { 0 } else { FRAMING };
        match self.state {
            State::Signature => SIGNATURE.len() - self.collected + FRAMING,
            State::ChunkHeader => FRAMING - self.collected,
            State::Payload(chunk, missing) => {
                (missing as usize).saturating_add(CRC_LENGTH + chunk_after(chunk))
            }
            State::Crc(chunk) => CRC_LENGTH - self.collected + chunk_after(chunk),
        }
    }

    /// The chunk whose payload or CRC is incomplete.
    pub(crate) fn current(&self) -> Option<ChunkType> {
        match self.state {
            State::Payload(chunk, _) | State::Crc(chunk) => Some(chunk),
            State::Signature | State::ChunkHeader => None,
        }
    }

    /// Reads up to the next event, and advances `input` past what was read. Payload is passed on
    /// without a copy.
    pub(crate) fn next<'a>(&mut self, input: &mut &'a [u8]) -> Result<Event<'a>, DecodeError> {
        loop {
            match self.state {
                State::Signature => {
                    let ready = self.collect(input, SIGNATURE.len());
                    // Other data is refused at its first wrong byte, not after eight bytes.
                    if self.word[..self.collected] != SIGNATURE[..self.collected] {
                        return Err(DecodeError::Signature);
                    }
                    if !ready {
                        return Ok(Event::NeedMore);
                    }
                    self.enter(State::ChunkHeader);
                }
                State::ChunkHeader => {
                    if !self.collect(input, 8) {
                        return Ok(Event::NeedMore);
                    }
                    let length = LittleEndian::read_u32(&self.word);
                    let chunk = ChunkType([self.word[4], self.word[5], self.word[6], self.word[7]]);
                    if !chunk.is_well_formed() {
                        return Err(DecodeError::malformed(chunk, "the type is not four letters"));
                    }
                    if length > MAX_CHUNK_LENGTH {
                        return Err(DecodeError::malformed(chunk, "the length is over 2^31 - 1"));
                    }
                    self.crc = crc32fast::Hasher::new();
                    self.crc.update(&chunk.0);
                    self.length = length;
                    self.enter(State::Payload(chunk, length));
                    return Ok(Event::Begin(chunk, length));
                }
                State::Payload(chunk, 0) => self.enter(State::Crc(chunk)),
                State::Payload(chunk, missing) => {
                    if input.is_empty() {
                        return Ok(Event::NeedMore);
                    }
                    let available = u32::try_from(input.len()).unwrap_or(u32::MAX);
                    let (payload, rest) = input.split_at(missing.min(available) as usize);
                    *input = rest;
                    self.crc.update(payload);
                    self.state = State::Payload(chunk, missing - payload.len() as u32);
                    return Ok(Event::Payload(payload));
                }
                State::Crc(chunk) => {
                    if !self.collect(input, CRC_LENGTH) {
                        return Ok(Event::NeedMore);
                    }
                    let stored = LittleEndian::read_u32(&self.word);
                    let computed = self.crc.clone().finalize();
                    // A fuzzer cannot guess checksums.
                    if stored != computed && !cfg!(fuzzing) {
                        return Err(DecodeError::malformed(chunk, "the CRC does not match"));
                    }
                    self.enter(State::ChunkHeader);
                    return Ok(Event::Complete(chunk, self.length));
                }
            }
        }
    }

    fn enter(&mut self, state: State) {
        self.state = state;
        self.collected = 0;
    }

    /// Moves bytes from `input` to `word` until it has `length`. Returns whether it has.
    fn collect(&mut self, input: &mut &[u8], length: usize) -> bool {
        let (taken, rest) = input.split_at(input.len().min(length - self.collected));
        self.word[self.collected..self.collected + taken.len()].copy_from_slice(taken);
        self.collected += taken.len();
        *input = rest;
        self.collected == length
    }
}
