//! Blotches: shifts of the means of blocks where the source is smooth.
//!
//! SSIMULACRA2 hardly sees them, but people do on a dark or bright screen: a gradient that comes back
//! with other bands than it had, or as one colour. Where there is any noise, as in a photograph, they do
//! not show, so that only areas without noise count (`smooth.rs`).

#![expect(clippy::needless_range_loop, reason = "loops over indices are vectorized")]

use super::light::{COLUMNS, Samples};
use super::pyramid::Shown;
use super::smooth::{AREA, read};

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
    weights: &[f32],
    first: usize,
    rows: usize,
) -> f64 {
    let mut squares = 0.0;
    let width = source.size[0];
    for (x, weights) in (0..width).step_by(COLUMNS).zip(weights.chunks(COLUMNS / AREA)) {
        if weights.iter().all(|&weight| weight == 0.0) {
            continue;
        }
        let columns = COLUMNS.min(width - x);
        let blocks = deviations(source, rendering, [x, first], [columns, rows]);
        for (weight, blocks) in weights.iter().zip(blocks.chunks_exact(AREA / BLOCK)) {
            let (mut sum, mut count) = (0.0, 0.0);
            for &[square, of] in blocks {
                sum += square;
                count += of;
            }
            squares += f64::from(weight * sum / count);
        }
    }
    squares
}

/// The sum over the channels of squared mean deviations in each column of blocks, and their number.
#[inline(always)]
fn deviations<A: Samples, B: Samples>(
    source: &Shown<'_, A>,
    rendering: &Shown<'_, B>,
    [x, y]: [usize; 2],
    [columns, rows]: [usize; 2],
) -> [[f32; 2]; BLOCKS] {
    let mut found = [[0.0; 2]; BLOCKS];
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
        for block in 0..columns.div_ceil(BLOCK) {
            let range = block * BLOCK..columns.min((block + 1) * BLOCK);
            let pixels = (range.len() * (end - top)) as f32;
            for sums in &sums {
                let mean = sums[range.clone()].iter().sum::<f32>() / pixels;
                found[block][0] += mean * mean;
                found[block][1] += 1.0;
            }
        }
    }
    found
}
