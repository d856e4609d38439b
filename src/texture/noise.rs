//! White noise on lattices, from a hash of the position: without memory, without period, and with the same
//! bits everywhere (spec, section 9.7).

use super::map::{CELL, OCTAVES};

/// Patterns: each octave's three.
pub(super) const PATTERNS: usize = 3 * OCTAVES;

/// How a pattern looks.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum Kind {
    Isotropic,
    HorizontalStreaks,
    VerticalStreaks,
}

/// A pattern of an octave.
#[derive(Clone, Copy, Debug)]
pub(super) struct Pattern {
    pub(super) octave: usize,
    pub(super) kind: Kind,
}

impl Pattern {
    /// All of them, from the finest octave on.
    pub(super) fn all() -> impl Iterator<Item = Self> {
        (0..OCTAVES).flat_map(Self::of)
    }

    /// Those of an octave.
    pub(super) fn of(octave: usize) -> [Self; 3] {
        [Kind::Isotropic, Kind::HorizontalStreaks, Kind::VerticalStreaks]
            .map(|kind| Self { octave, kind })
    }

    /// Points of a block along each axis.
    pub(super) fn points(self) -> usize {
        if self.kind == Kind::Isotropic { 2 } else { 4 }
    }

    /// Blocks of a cell along each axis.
    pub(super) fn blocks(self) -> usize {
        (CELL >> self.octave) / self.points()
    }

    /// Its place among all of them.
    pub(super) fn index(self) -> usize {
        3 * self.octave + self.kind as usize
    }

    /// The seed of a row of blocks.
    pub(super) fn seed(self, row: i32) -> u32 {
        // From 1 on: the hash of 0 is 0.
        let mut hash = (row as u32).wrapping_mul(8).wrapping_add(self.index() as u32 + 1);
        hash = (hash ^ (hash >> 16)).wrapping_mul(0x21F0_AAAD);
        hash = (hash ^ (hash >> 15)).wrapping_mul(0x735A_2D97);
        hash ^ (hash >> 15)
    }
}

/// What the hash of a block in a row is made with.
pub(super) const BLOCK_FACTOR: u32 = 0x9E37_79B1;
pub(super) const HASH_FACTOR: u32 = 0x2C1B_3C6D;
/// What is before a number in its highest bits, and where it ends.
pub(super) const BITS_BEFORE: u32 = 21;
pub(super) const BITS_AFTER: u32 = 11;

/// Three numbers from -1024 to 1023 for a block in a row with this seed.
#[inline(always)]
pub(super) fn numbers(block: u32, seed: u32) -> [i32; 3] {
    let mut hash = block.wrapping_mul(BLOCK_FACTOR).wrapping_add(seed);
    hash = (hash ^ (hash >> 15)).wrapping_mul(HASH_FACTOR);
    let hash = hash as i32;
    [hash, hash << BITS_AFTER, hash << BITS_BEFORE].map(|bits| bits >> BITS_BEFORE)
}
