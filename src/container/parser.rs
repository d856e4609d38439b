//! A push parser for the signature and the framing of chunks (spec, sections 4.1 and 4.2). It does
//! no I/O, and buffers at most eight bytes.

use byteorder::{ByteOrder, LittleEndian};

use super::varint;
#[cfg(feature = "std")]
use crate::chunk::LEAST_CHUNK;
use crate::chunk::{CRC_LENGTH, ChunkType, MAGIC, MAX_CHUNK_LENGTH, SIGNATURE, VERSION};
use crate::error::DecodeError;

/// What the parser has found.
#[derive(Debug)]
pub(crate) enum Event<'a> {
    /// The end of the input.
    NeedMore,
    /// The beginning of a chunk with this many bytes of payload.
    Begin(ChunkType, u32),
    /// The next bytes of the payload of the current chunk.
    Payload(&'a [u8]),
    /// The end of a chunk with the right CRC, and how many bytes it has: type, length, payload and CRC.
    Complete(ChunkType, u64),
}

#[derive(Clone, Copy, Debug)]
enum State {
    /// Collecting the bytes of the signature.
    Signature,
    /// Collecting the letters of a type.
    Type,
    /// Collecting the bytes of the length.
    Length(ChunkType, varint::Arriving),
    /// Passing payload on, of which this many bytes are missing.
    Payload(ChunkType, u32),
    /// Collecting the CRC.
    Crc(ChunkType),
}

/// Splits a byte stream into chunks and checks their framing.
#[derive(Debug)]
pub(crate) struct Parser {
    state: State,
    /// The bytes of the signature, of a type, or of a CRC that have arrived.
    word: [u8; 8],
    /// The number of these bytes.
    collected: usize,
    crc: crc32fast::Hasher,
    /// Bytes of the current chunk, as its type and length say.
    bytes: u64,
}

impl Parser {
    pub(crate) fn new() -> Self {
        Self {
            state: State::Signature,
            word: [0; 8],
            collected: 0,
            crc: crc32fast::Hasher::new(),
            bytes: 0,
        }
    }

    /// How many bytes can be read without reading past the end of the file: at least one until
    /// then.
    #[cfg(feature = "std")]
    pub(crate) fn safe_to_read(&self) -> usize {
        let chunk_after = |chunk| if chunk == ChunkType::END { 0 } else { LEAST_CHUNK };
        match self.state {
            State::Signature => SIGNATURE.len() - self.collected + LEAST_CHUNK,
            // The first letter may be that of the end.
            State::Type if self.collected == 0 => LEAST_CHUNK,
            State::Type => 4 - self.collected + 1 + CRC_LENGTH + LEAST_CHUNK,
            State::Length(chunk, _) => 1 + CRC_LENGTH + chunk_after(chunk),
            State::Payload(chunk, missing) => {
                (missing as usize).saturating_add(CRC_LENGTH + chunk_after(chunk))
            }
            State::Crc(chunk) => CRC_LENGTH - self.collected + chunk_after(chunk),
        }
    }

    /// The chunk whose length, payload or CRC is incomplete.
    pub(crate) fn current(&self) -> Option<ChunkType> {
        match self.state {
            State::Length(chunk, _) | State::Payload(chunk, _) | State::Crc(chunk) => Some(chunk),
            State::Signature | State::Type => None,
        }
    }

    /// Reads up to the next event, and advances `input` past what was read. Payload is passed on
    /// without a copy.
    pub(crate) fn next<'a>(&mut self, input: &mut &'a [u8]) -> Result<Event<'a>, DecodeError> {
        loop {
            match self.state {
                State::Signature => {
                    let ready = self.collect(input, SIGNATURE.len());
                    self.check_signature()?;
                    if !ready {
                        return Ok(Event::NeedMore);
                    }
                    self.enter(State::Type);
                }
                State::Type => {
                    if self.collected == 0 && !self.collect(input, 1) {
                        return Ok(Event::NeedMore);
                    }
                    let length = ChunkType::length_from(self.word[0]);
                    if !self.collect(input, length) {
                        return Ok(Event::NeedMore);
                    }
                    let chunk = ChunkType::from_bytes(&self.word[..length]);
                    if !chunk.is_well_formed() {
                        return Err(DecodeError::malformed(chunk, "the type is not of letters"));
                    }
                    self.crc = crc32fast::Hasher::new();
                    self.crc.update(chunk.bytes());
                    self.enter(State::Length(chunk, varint::Arriving::default()));
                }
                State::Length(chunk, mut arriving) => {
                    let before = *input;
                    let length = arriving.read(input);
                    self.crc.update(&before[..before.len() - input.len()]);
                    self.state = State::Length(chunk, arriving);
                    let malformed = |reason| DecodeError::malformed(chunk, reason);
                    let Some(length) = length.map_err(|flaw| malformed(flaw.reason()))? else {
                        return Ok(Event::NeedMore);
                    };
                    if length > MAX_CHUNK_LENGTH {
                        return Err(malformed("the length is over 2^31 - 1"));
                    }
                    let framing = chunk.bytes().len() + arriving.bytes() as usize + CRC_LENGTH;
                    self.bytes = framing as u64 + u64::from(length);
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
                    self.enter(State::Type);
                    return Ok(Event::Complete(chunk, self.bytes));
                }
            }
        }
    }

    /// Refuses other data at its first wrong byte, not after eight of them.
    fn check_signature(&self) -> Result<(), DecodeError> {
        let found = &self.word[..self.collected];
        if found == &SIGNATURE[..found.len()] {
            return Ok(());
        }
        // Another version may differ from this one in all that follows its number.
        match found.strip_prefix(&MAGIC) {
            Some([version, ..]) if *version != VERSION => {
                let version = u32::from(*version);
                Err(DecodeError::unsupported(ChunkType::HEADER, "version", version))
            }
            _ => Err(DecodeError::Signature),
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
