//! Blotches: shifts of the means of blocks where the source is smooth.
//!
//! SSIMULACRA2 hardly sees them, but people do on a dark or bright screen: a gradient that comes back
//! with other bands than it had, or as one colour. Noise, as in a photograph, hides those of a few pixels,
//! but not clouds: there, the shifts of larger areas count (`smooth.rs`).

use core::array;
use core::iter::Sum;

use super::light::{COLUMNS, Samples};
use super::pyramid::Shown;
use super::smooth::{AREA, Weights, read};

// Constants: docs/tuning.md, "What a person sees".
/// Side of the blocks whose means count.
const BLOCK: usize = 8;
const BLOCKS: usize = COLUMNS / BLOCK;
/// The deviation that is allowed at a quality of 75, in steps of 8 bits; by how much the quality must
/// fall for twice the deviation; and the least deviation that is asked for.
const ALLOWED: f64 = 0.15;
const DOUBLED_BY: f64 = 20.0;
const LEAST_ALLOWED: f64 = 0.1;

/// The mean square deviation of blocks that is allowed at a quality.
pub(super) fn allowed(quality: f64) -> f64 {
    (ALLOWED * ((75.0 - quality) / DOUBLED_BY).exp2()).max(LEAST_ALLOWED).powi(2)
}

/// The sum over areas of their mean square deviations of blocks, by weight: of the areas from row `first`
/// on, of which there are `rows` rows, given their weights.
#[inline(always)]
pub(super) fn squares<A: Samples, B: Samples>(
    source: &Shown<'_, A>,
    rendering: &Shown<'_, B>,
    weights: &[Weights],
    first: usize,
    rows: usize,
) -> f64 {
    let mut squares = 0.0;
    let width = source.size[0];
    for (x, weights) in (0..width).step_by(COLUMNS).zip(weights.chunks(COLUMNS / AREA)) {
        if weights.iter().all(|weights| *weights == Weights::default()) {
            continue;
        }
        let columns = COLUMNS.min(width - x);
        let found = deviations(source, rendering, [x, first], [columns, rows]);
        for (weights, columns) in weights.iter().zip(found.chunks_exact(AREA / BLOCK)) {
            squares += columns.iter().copied().sum::<Deviations>().weighted(weights);
        }
    }
    squares
}

/// Deviations in a column of blocks.
#[derive(Clone, Copy, Debug, Default)]
struct Deviations {
    /// Of the means of blocks: the sum of the squares over blocks and channels, and their number.
    squares: f32,
    count: f32,
    /// The sum over pixels in each channel, and the number of pixels.
    sums: [f32; 3],
    pixels: f32,
}

impl Deviations {
    /// The weighted mean square.
    fn weighted(&self, weights: &Weights) -> f64 {
        let whole = self.sums.map(|sum| (sum / self.pixels).powi(2)).iter().sum::<f32>() / 3.0;
        f64::from(weights.blocks * self.squares / self.count + weights.whole * whole)
    }
}

impl Sum for Deviations {
    fn sum<I: Iterator<Item = Self>>(all: I) -> Self {
        all.fold(Self::default(), |a, b| Self {
            squares: a.squares + b.squares,
            count: a.count + b.count,
            sums: array::from_fn(|channel| a.sums[channel] + b.sums[channel]),
            pixels: a.pixels + b.pixels,
        })
    }
}

/// The deviations in each column of blocks.
#[inline(always)]
fn deviations<A: Samples, B: Samples>(
    source: &Shown<'_, A>,
    rendering: &Shown<'_, B>,
    [x, y]: [usize; 2],
    [columns, rows]: [usize; 2],
) -> [Deviations; BLOCKS] {
    let mut found = [Deviations::default(); BLOCKS];
    let mut lines = [[[0.0; COLUMNS]; 3]; 2];
    for top in (0..rows).step_by(BLOCK) {
        let end = rows.min(top + BLOCK);
        let mut sums = [[0.0; COLUMNS]; 3];
        for row in top..end {
            read(source, [x, y + row], &mut lines[0]);
            read(rendering, [x, y + row], &mut lines[1]);
            for channel in 0..3 {
                for at in 0..columns {
                    sums[channel][at] += lines[1][channel][at] - lines[0][channel][at];
                }
            }
        }
        for (block, found) in found[..columns.div_ceil(BLOCK)].iter_mut().enumerate() {
            let range = block * BLOCK..columns.min((block + 1) * BLOCK);
            let pixels = (range.len() * (end - top)) as f32;
            for (sums, of_channel) in sums.iter().zip(&mut found.sums) {
                let sum = sums[range.clone()].iter().sum::<f32>();
                found.squares += (sum / pixels).powi(2);
                found.count += 1.0;
                *of_channel += sum;
            }
            found.pixels += pixels;
        }
    }
    found
}
