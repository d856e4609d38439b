//! A push parser for the chunk sequence. It does no I/O and holds at most one chunk header.

use byteorder::{ByteOrder, LittleEndian};

#[cfg(feature = "std")]
use crate::chunk::FRAMING;
use crate::chunk::{ChunkType, MAX_CHUNK_LENGTH, SIGNATURE};
use crate::error::DecodeError;

/// Bytes of a CRC.
const CRC_LENGTH: usize = 4;

/// What the parser found next.
#[derive(Debug)]
pub(crate) enum Event<'a> {
    /// The input is used up; feed more.
    NeedMore,
    /// A chunk begins, with this many bytes of payload.
    Begin(ChunkType, u32),
    /// The next bytes of the payload of the current chunk.
    Payload(&'a [u8]),
    /// A chunk with this many bytes of payload is complete and its CRC is right.
    Complete(ChunkType, u32),
}

#[derive(Clone, Copy, Debug)]
enum State {
    /// Collecting the eight bytes of the signature.
    Signature,
    /// Collecting length and type.
    ChunkHeader,
    /// Passing payload on; this many bytes are missing.
    Payload(ChunkType, u32),
    /// Collecting the CRC.
    Crc(ChunkType),
}

/// Splits a byte stream into chunks and checks their framing.
#[derive(Debug)]
pub(crate) struct Parser {
    state: State,
    /// Bytes collected for `Signature`, `ChunkHeader` and `Crc`.
    word: [u8; 8],
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

    /// How many of the next bytes are certain to be of this file, at least one before it ends: who
    /// reads no more of them never reads past its end.
    #[cfg(feature = "std")]
    pub(crate) fn certain(&self) -> usize {
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

    /// The chunk that is incomplete at this moment.
    pub(crate) fn current(&self) -> Option<ChunkType> {
        match self.state {
            State::Payload(chunk, _) | State::Crc(chunk) => Some(chunk),
            State::Signature | State::ChunkHeader => None,
        }
    }

    /// Advances `input` past what it used and says what it found. Payload is passed through
    /// without a copy.
    pub(crate) fn next<'a>(&mut self, input: &mut &'a [u8]) -> Result<Event<'a>, DecodeError> {
        loop {
            match self.state {
                State::Signature => {
                    let ready = self.collect(input, SIGNATURE.len());
                    // Refuse foreign data at its first wrong byte, not after eight of them.
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
                    // The fuzzer cannot guess checksums; let it get past them.
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

    /// Moves bytes to `word` until it holds `wanted`; whether it does.
    fn collect(&mut self, input: &mut &[u8], wanted: usize) -> bool {
        let (taken, rest) = input.split_at(input.len().min(wanted - self.collected));
        self.word[self.collected..self.collected + taken.len()].copy_from_slice(taken);
        self.collected += taken.len();
        *input = rest;
        self.collected == wanted
    }
}
