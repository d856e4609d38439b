//! White noise on lattices, from a hash of the position: without memory, without period, and with the same
//! bits everywhere (spec, section 9.7).
//!
//! The values are integers, or eighths of integers along streaks, of magnitude below 3070. All sums of them are
//! exact, in any order.

use super::map::OCTAVES;

/// How far each of four points along streaks is on the way to the next block.
const ALONG: [f32; 4] = [0.125, 0.375, 0.625, 0.875];
/// The signs of three random numbers in the values of a block, which have the sum 0. The four points of a block
/// stand 2 x 2 in the isotropic pattern, and in a row across the streaks of the others.
const SIGNS: [[f32; 3]; 4] =
    [[1.0, 1.0, 1.0], [1.0, -1.0, -1.0], [-1.0, 1.0, -1.0], [-1.0, -1.0, 1.0]];

/// A pattern of an octave.
#[derive(Clone, Copy, Debug)]
pub(super) struct Pattern {
    /// 0: isotropic, 1: horizontal streaks, 2: vertical streaks.
    pub(super) kind: usize,
    pub(super) octave: usize,
}

/// Rows of a pattern's lattice, of at most `WIDTH` points.
#[derive(Debug)]
pub(super) struct Lattice<const WIDTH: usize> {
    pattern: Pattern,
    first: i32,
    /// The row of blocks that `numbers` are of.
    row: Option<i32>,
    /// Isotropic: the numbers of each block. Horizontal streaks: those numbers at each point. Vertical streaks:
    /// the values at each point of this row of blocks, and of the next one.
    numbers: [[f32; WIDTH]; 3],
}

impl<const WIDTH: usize> Default for Lattice<WIDTH> {
    fn default() -> Self {
        let pattern = Pattern { kind: 0, octave: 0 };
        Self { pattern, first: 0, row: None, numbers: [[0.0; WIDTH]; 3] }
    }
}

impl<const WIDTH: usize> Lattice<WIDTH> {
    /// Begins with another pattern. The first column is a multiple of four.
    pub(super) fn begin(&mut self, pattern: Pattern, first: i32) {
        (self.pattern, self.first, self.row) = (pattern, first, None);
    }

    /// The values in row `row`. Their number is a multiple of four.
    #[inline(always)]
    pub(super) fn row(&mut self, row: i32, values: &mut [f32]) {
        match self.pattern.kind {
            0 => self.isotropic(row, values),
            1 => self.horizontal(row, values),
            _ => self.vertical(row, values),
        }
    }

    #[inline(always)]
    fn isotropic(&mut self, row: i32, values: &mut [f32]) {
        let pairs = values.as_chunks_mut::<2>().0;
        // With slices of one length, the compiler leaves out the checks of indices and vectorizes the loops.
        let [a, b, c] = self.numbers.each_mut().map(|numbers| &mut numbers[..pairs.len()]);
        if self.row != Some(row >> 1) {
            self.row = Some(row >> 1);
            let (first, seed) = (self.first >> 1, self.pattern.seed(row >> 1));
            for block in 0..pairs.len() {
                [a[block], b[block], c[block]] = numbers(first + block as i32, seed);
            }
        }
        let sign = if row & 1 == 0 { 1.0 } else { -1.0 };
        for block in 0..pairs.len() {
            let (mean, difference) = (sign * a[block], b[block] + sign * c[block]);
            pairs[block] = [mean + difference, mean - difference];
        }
    }

    #[inline(always)]
    fn horizontal(&mut self, row: i32, values: &mut [f32]) {
        if self.row != Some(row >> 2) {
            self.row = Some(row >> 2);
            let seed = self.pattern.seed(row >> 2);
            let mut near = numbers(self.first >> 2, seed);
            for point in (0..values.len()).step_by(4) {
                let far = numbers((self.first + point as i32 + 4) >> 2, seed);
                for (numbers, (near, far)) in self.numbers.iter_mut().zip(near.iter().zip(far)) {
                    let along = ALONG.map(|along| near + (far - near) * along);
                    numbers[point..point + 4].copy_from_slice(&along);
                }
                near = far;
            }
        }
        let [a, b, c] = &self.numbers;
        let signs = SIGNS[(row & 3) as usize];
        for (value, ((a, b), c)) in values.iter_mut().zip(a.iter().zip(b).zip(c)) {
            *value = signs[0] * a + signs[1] * b + signs[2] * c;
        }
    }

    #[inline(always)]
    fn vertical(&mut self, row: i32, values: &mut [f32]) {
        let [near, far, _] = &mut self.numbers;
        if self.row != Some(row >> 2) {
            let (pattern, first) = (self.pattern, self.first);
            let fill = |row: i32, points: &mut [f32; WIDTH]| {
                let seed = pattern.seed(row);
                let blocks = points[..values.len()].as_chunks_mut::<4>().0;
                for (block, points) in (first >> 2..).zip(blocks) {
                    let numbers = numbers(block, seed);
                    *points = SIGNS.map(|signs| signed(numbers, signs));
                }
            };
            if self.row == Some((row >> 2) - 1) {
                core::mem::swap(near, far);
            } else {
                fill(row >> 2, near);
            }
            fill((row >> 2) + 1, far);
            self.row = Some(row >> 2);
        }
        let along = ALONG[(row & 3) as usize];
        for (value, (near, far)) in values.iter_mut().zip(near.iter().zip(far)) {
            *value = *near + (*far - *near) * along;
        }
    }
}

impl Pattern {
    /// The seed of a row of blocks.
    fn seed(self, row: i32) -> u32 {
        let pattern = self.kind * (OCTAVES + 1) + self.octave;
        let mut hash = (row as u32).wrapping_mul(16).wrapping_add(pattern as u32);
        hash = (hash ^ (hash >> 16)).wrapping_mul(0x21F0_AAAD);
        hash = (hash ^ (hash >> 15)).wrapping_mul(0x735A_2D97);
        hash ^ (hash >> 15)
    }
}

/// Three odd numbers from -1023 to 1023 for a block of a row with this seed.
#[inline(always)]
fn numbers(block: i32, seed: u32) -> [f32; 3] {
    let mut hash = (block as u32).wrapping_mul(0x9E37_79B1).wrapping_add(seed);
    hash = (hash ^ (hash >> 15)).wrapping_mul(0x2C1B_3C6D);
    [hash >> 2 & 1023, hash >> 12 & 1023, hash >> 22].map(|bits| (2 * bits as i32 - 1023) as f32)
}

#[inline(always)]
fn signed(numbers: [f32; 3], signs: [f32; 3]) -> f32 {
    signs[0] * numbers[0] + signs[1] * numbers[1] + signs[2] * numbers[2]
}
