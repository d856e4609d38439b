//! Where in the file each layer is, so that a part of a file can be told by its length.

use image_gip::ChunkType;

/// Bytes of the signature (spec, section 4.1).
const SIGNATURE: u64 = 8;
/// Bytes of a chunk's length and type, and of its CRC (spec, section 4.2).
const LENGTH_AND_TYPE: usize = 8;
const CRC: u64 = 4;

/// Follows the chunks of a file whose bytes arrive in pieces.
#[derive(Debug)]
pub(crate) struct LayerExtents {
    /// The bytes that have arrived.
    position: u64,
    /// Where the next chunk begins.
    next: u64,
    /// The length and the type of the chunk that begins there, and how many bytes of them have
    /// arrived.
    word: [u8; LENGTH_AND_TYPE],
    collected: usize,
    extents: Vec<(f64, f64)>,
}

impl Default for LayerExtents {
    fn default() -> Self {
        Self { position: 0, next: SIGNATURE, word: [0; _], collected: 0, extents: Vec::new() }
    }
}

impl LayerExtents {
    /// Takes the next bytes of a file that the decoder has accepted.
    pub(crate) fn feed(&mut self, bytes: &[u8]) {
        let mut rest = bytes;
        while let Some((&first, after)) = rest.split_first() {
            if self.position < self.next {
                let skipped = (self.next - self.position).min(rest.len() as u64);
                self.position += skipped;
                rest = &rest[skipped as usize..];
                continue;
            }
            self.word[self.collected] = first;
            self.collected += 1;
            self.position += 1;
            rest = after;
            if self.collected < LENGTH_AND_TYPE {
                self.next = self.position;
                continue;
            }
            let [a, b, c, d, kind @ ..] = self.word;
            self.collected = 0;
            self.next = self.position + u64::from(u32::from_le_bytes([a, b, c, d])) + CRC;
            if kind == ChunkType::GAUS.0 {
                self.extents
                    .push(((self.position - LENGTH_AND_TYPE as u64) as f64, self.next as f64));
            }
        }
    }

    /// For each layer that has begun, where its chunk begins and ends, in bytes of the file.
    pub(crate) fn extents(&self) -> &[(f64, f64)] {
        &self.extents
    }
}
