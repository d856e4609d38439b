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

/// Rows of a pattern's lattice, of `WIDTH` points each, which are a multiple of four.
pub(super) struct Lattice<const WIDTH: usize> {
    pattern: Pattern,
    first: i32,
    /// The row of blocks that `numbers` are of.
    row: Option<i32>,
    /// Isotropic: the numbers of each block. Horizontal streaks: those numbers at each point. Vertical streaks:
    /// the values at each point of this row of blocks, and of the next one.
    numbers: [[f32; WIDTH]; 3],
}

impl<const WIDTH: usize> Lattice<WIDTH> {
    /// Rows that begin with column `first`, a multiple of four.
    #[inline(always)]
    pub(super) fn new(pattern: Pattern, first: i32) -> Self {
        Self { pattern, first, row: None, numbers: [[0.0; WIDTH]; 3] }
    }

    /// The values in row `row`. In WebAssembly, which needs no copy of it for each SIMD level, it is called: the
    /// module is smaller by a tenth.
    #[cfg_attr(target_arch = "wasm32", inline(never))]
    #[cfg_attr(not(target_arch = "wasm32"), inline(always))]
    pub(super) fn row(&mut self, row: i32, values: &mut [f32; WIDTH]) {
        match self.pattern.kind {
            0 => self.isotropic(row, values),
            1 => self.horizontal(row, values),
            _ => self.vertical(row, values),
        }
    }

    #[inline(always)]
    fn isotropic(&mut self, row: i32, values: &mut [f32; WIDTH]) {
        let [a, b, c] = &mut self.numbers;
        if self.row != Some(row >> 1) {
            self.row = Some(row >> 1);
            let (first, seed) = (self.first >> 1, self.pattern.seed(row >> 1));
            for block in 0..WIDTH / 2 {
                [a[block], b[block], c[block]] = numbers(first + block as i32, seed);
            }
        }
        let sign = if row & 1 == 0 { 1.0 } else { -1.0 };
        for block in 0..WIDTH / 2 {
            let (mean, difference) = (sign * a[block], b[block] + sign * c[block]);
            values[2 * block] = mean + difference;
            values[2 * block + 1] = mean - difference;
        }
    }

    #[inline(always)]
    fn horizontal(&mut self, row: i32, values: &mut [f32; WIDTH]) {
        if self.row != Some(row >> 2) {
            self.row = Some(row >> 2);
            let (first, seed) = (self.first >> 2, self.pattern.seed(row >> 2));
            let mut near = numbers(first, seed);
            for block in 0..WIDTH / 4 {
                let far = numbers(first + block as i32 + 1, seed);
                for (points, (near, far)) in self.numbers.iter_mut().zip(near.iter().zip(far)) {
                    for (at, along) in ALONG.iter().enumerate() {
                        points[4 * block + at] = near + (far - near) * along;
                    }
                }
                near = far;
            }
        }
        let [a, b, c] = &self.numbers;
        let signs = SIGNS[(row & 3) as usize];
        for point in 0..WIDTH {
            values[point] = signs[0] * a[point] + signs[1] * b[point] + signs[2] * c[point];
        }
    }

    #[inline(always)]
    fn vertical(&mut self, row: i32, values: &mut [f32; WIDTH]) {
        let [near, far, _] = &mut self.numbers;
        if self.row != Some(row >> 2) {
            if self.row == Some((row >> 2) - 1) {
                *near = *far;
            } else {
                self.pattern.across(row >> 2, self.first >> 2, near);
            }
            self.pattern.across((row >> 2) + 1, self.first >> 2, far);
            self.row = Some(row >> 2);
        }
        let along = ALONG[(row & 3) as usize];
        for point in 0..WIDTH {
            values[point] = near[point] + (far[point] - near[point]) * along;
        }
    }
}

impl Pattern {
    /// The values of a row of blocks, from block `first` on, each in a row across the streaks.
    #[cfg_attr(target_arch = "wasm32", inline(never))]
    #[cfg_attr(not(target_arch = "wasm32"), inline(always))]
    fn across<const WIDTH: usize>(self, row: i32, first: i32, values: &mut [f32; WIDTH]) {
        let seed = self.seed(row);
        for block in 0..WIDTH / 4 {
            let [a, b, c] = numbers(first + block as i32, seed);
            for (at, signs) in SIGNS.iter().enumerate() {
                values[4 * block + at] = signs[0] * a + signs[1] * b + signs[2] * c;
            }
        }
    }

    /// The seed of a row of blocks.
    fn seed(self, row: i32) -> u32 {
        // From 1 on: the hash of 0 is 0.
        let pattern = self.kind * (OCTAVES + 1) + self.octave + 1;
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
    let (a, b, c) = (hash >> 2 & 1023, hash >> 12 & 1023, hash >> 22);
    [(2 * a as i32 - 1023) as f32, (2 * b as i32 - 1023) as f32, (2 * c as i32 - 1023) as f32]
}
