//! However a file is sliced on its way to the decoder, the outcome is the same.

#![no_main]

use std::io::{self, Read};

use arbitrary::{Arbitrary, Unstructured};
use image_gip::{ChunkStatistics, Decoder, Metadata, StreamDecoder};
use image_gip_fuzz::file::File;
use libfuzzer_sys::fuzz_target;

/// All that a caller can learn from a decoder, floats by their bits.
#[derive(Debug, PartialEq)]
struct Outcome {
    /// The error, or how many bytes were used.
    end: Result<usize, String>,
    state: State,
}

#[derive(Debug, PartialEq)]
struct State {
    complete: bool,
    description: String,
    metadata: Metadata,
    chunks: Vec<ChunkStatistics>,
    gaussians: Vec<[u32; 9]>,
}

impl State {
    fn of(decoder: &StreamDecoder) -> Self {
        let description = format!("{:?} {:?}", decoder.header(), decoder.quantizers());
        let metadata = decoder.metadata().clone();
        let chunks = decoder.chunks().to_vec();
        let gaussians = decoder
            .gaussians()
            .iter()
            .map(|g| {
                let mut bits = [0; 9];
                let values = g.center.iter().chain(&g.cholesky).chain(&g.color);
                for (bits, value) in bits.iter_mut().zip(values) {
                    *bits = value.to_bits();
                }
                bits
            })
            .collect();
        Self { complete: decoder.is_complete(), description, metadata, chunks, gaussians }
    }
}

fn outcome<'a>(pieces: impl Iterator<Item = &'a [u8]>) -> Outcome {
    let mut decoder = StreamDecoder::new().with_limits(image_gip_fuzz::limits());
    let mut used = 0;
    let mut error = None;
    for piece in pieces {
        match decoder.feed(piece) {
            Ok(count) => used += count,
            Err(failure) => {
                error = Some(failure);
                break;
            }
        }
    }
    let error = error.or_else(|| decoder.finish().err());
    let end = error.map_or(Ok(used), |error| Err(error.to_string()));
    Outcome { end, state: State::of(&decoder) }
}

/// Whether metadata begin with these others.
fn includes(metadata: &Metadata, others: &Metadata) -> bool {
    let blobs = [
        (&metadata.icc_profile, &others.icc_profile),
        (&metadata.exif, &others.exif),
        (&metadata.xmp, &others.xmp),
    ];
    blobs.iter().all(|(blob, other)| other.is_none() || blob == other)
        && metadata.texts.starts_with(&others.texts)
}

/// Pieces of 0 to 40 bytes, mostly short, from a generator that the contents seed.
struct Pieces<'a> {
    whole: &'a [u8],
    /// What is left of it.
    bytes: &'a [u8],
    /// How many bytes of it a reader has taken.
    read: usize,
    random: u32,
}

impl<'a> Pieces<'a> {
    fn of(bytes: &'a [u8]) -> Self {
        Self { whole: bytes, bytes, read: 0, random: crc32fast::hash(bytes) | 1 }
    }

    fn random(&mut self) -> u32 {
        self.random ^= self.random << 13;
        self.random ^= self.random >> 17;
        self.random ^= self.random << 5;
        self.random
    }
}

impl<'a> Iterator for Pieces<'a> {
    type Item = &'a [u8];

    fn next(&mut self) -> Option<&'a [u8]> {
        if self.bytes.is_empty() {
            return None;
        }
        let random = self.random();
        let length = (random % if random & 0x100 == 0 { 5 } else { 41 }) as usize;
        let (piece, rest) = self.bytes.split_at(length.min(self.bytes.len()));
        self.bytes = rest;
        Some(piece)
    }
}

/// The same pieces through `Read`, with interruptions in place of the empty ones.
impl Read for Pieces<'_> {
    fn read(&mut self, buffer: &mut [u8]) -> io::Result<usize> {
        match self.next() {
            None => Ok(0),
            Some([]) => Err(io::ErrorKind::Interrupted.into()),
            Some(piece) => {
                let taken = &piece[..piece.len().min(buffer.len())];
                buffer[..taken.len()].copy_from_slice(taken);
                self.read += taken.len();
                self.bytes = &self.whole[self.read..];
                Ok(taken.len())
            }
        }
    }
}

/// The bytes of a file; what does not begin as one is taken for the description of one.
fn file(input: &[u8]) -> Vec<u8> {
    if input.starts_with(&[0xC7]) {
        return input.to_vec();
    }
    let described = File::arbitrary(&mut Unstructured::new(input));
    described.map_or_else(|_| input.to_vec(), |file| file.to_bytes())
}

fuzz_target!(|input: &[u8]| {
    let bytes = &*file(input);
    let whole = outcome(std::iter::once(bytes));
    assert_eq!(outcome(bytes.chunks(1)), whole, "byte by byte");
    assert_eq!(outcome(Pieces::of(bytes)), whole, "in pieces");

    match Decoder::new_with_limits(Pieces::of(bytes), image_gip_fuzz::limits()) {
        Ok(mut decoder) => {
            let result = decoder.read_to_end();
            let complete = result.is_ok();
            assert_eq!(
                result.err().map(|error| error.to_string()),
                whole.end.clone().err(),
                "through a reader"
            );
            let mut state = State::of(decoder.stream());
            if !state.complete {
                // A layer may wait until what is behind it has arrived, and then be found damaged.
                assert!(includes(&state.metadata, &whole.state.metadata), "metadata is lost");
                state.metadata.clone_from(&whole.state.metadata);
                state.chunks.clone_from(&whole.state.chunks);
            }
            assert_eq!(state, whole.state, "through a reader");
            if complete {
                let used = decoder.into_reader().read;
                assert_eq!(Ok(used), whole.end, "read beyond the end of the file");
            }
        }
        Err(error) => assert_eq!(Some(error.to_string()), whole.end.err(), "through a reader"),
    }
});
