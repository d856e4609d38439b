//! Where in the file each layer is, so that a part of a file can be told by its length.

/// Bytes of the signature (spec, section 4.1).
const SIGNATURE: u64 = 8;
/// Bytes of a chunk's CRC (spec, section 4.2).
pub(crate) const CRC: u64 = 4;

/// Follows the chunks of a file whose bytes arrive in pieces.
#[derive(Debug)]
pub(crate) struct LayerExtents {
    /// The bytes that have arrived.
    position: u64,
    /// How many more come before the next one that counts.
    skip: u64,
    /// Where the current chunk begins, and whether it is a layer.
    start: u64,
    is_layer: bool,
    /// The bits of the current chunk's length that have arrived, and their number; `None` before its type.
    length: Option<(u64, u32)>,
    extents: Vec<(f64, f64)>,
}

impl Default for LayerExtents {
    fn default() -> Self {
        let (skip, extents) = (SIGNATURE, Vec::new());
        Self { position: 0, skip, start: 0, is_layer: false, length: None, extents }
    }
}

impl LayerExtents {
    /// Takes the next bytes of a file that the decoder has accepted.
    pub(crate) fn feed(&mut self, bytes: &[u8]) {
        let mut rest = bytes;
        loop {
            let skipped = self.skip.min(rest.len() as u64);
            self.skip -= skipped;
            self.position += skipped;
            let Some((&byte, after)) = rest[skipped as usize..].split_first() else { return };
            rest = after;
            self.position += 1;
            let Some((bits, count)) = self.length else {
                self.start = self.position - 1;
                self.is_layer = byte == b'L';
                self.skip = if byte.is_ascii_lowercase() { 3 } else { 0 };
                self.length = Some((0, 0));
                continue;
            };
            let bits = bits | u64::from(byte & 0x7F) << count;
            if byte >= 0x80 {
                self.length = Some((bits, count + 7));
                continue;
            }
            self.length = None;
            self.skip = bits + CRC;
            if self.is_layer {
                self.extents.push((self.start as f64, (self.position + self.skip) as f64));
            }
        }
    }

    /// For each layer that has begun, where its chunk begins and ends, in bytes of the file.
    pub(crate) fn extents(&self) -> &[(f64, f64)] {
        &self.extents
    }
}
