//! CRC-32 (spec, section 4.2) with the interface of the crate `crc32fast`, as far as decoder and encoder
//! use it. `Cargo.toml` puts it in the place of that crate.
//!
//! The tables of `crc32fast` are 16 kB that do not compress. A file is short, so that one byte at a
//! time is fast enough.

#![no_std]

/// The CRC of each byte.
static TABLE: [u32; 256] = {
    let mut table = [0; 256];
    let mut byte = 0;
    while byte < table.len() {
        let mut crc = byte as u32;
        let mut bit = 0;
        while bit < 8 {
            crc = if crc & 1 == 1 { (crc >> 1) ^ 0xedb8_8320 } else { crc >> 1 };
            bit += 1;
        }
        table[byte] = crc;
        byte += 1;
    }
    table
};

/// Computes a CRC from bytes that arrive in pieces.
#[derive(Clone, Debug)]
pub struct Hasher(u32);

impl Default for Hasher {
    fn default() -> Self {
        Self::new()
    }
}

impl Hasher {
    /// The CRC of no bytes.
    #[must_use]
    pub const fn new() -> Self {
        Self(u32::MAX)
    }

    /// Takes the next bytes.
    pub fn update(&mut self, bytes: &[u8]) {
        for &byte in bytes {
            self.0 = (self.0 >> 8) ^ TABLE[(self.0 as u8 ^ byte) as usize];
        }
    }

    /// The CRC.
    #[must_use]
    pub const fn finalize(self) -> u32 {
        !self.0
    }
}

/// The CRC of bytes that are there all at once.
#[must_use]
pub fn hash(bytes: &[u8]) -> u32 {
    let mut hasher = Hasher::new();
    hasher.update(bytes);
    hasher.finalize()
}
