//! Blotches: shifts of the means of blocks where the source is smooth.
//!
//! SSIMULACRA2 hardly sees them, but people do on a dark or bright screen: a gradient that comes back
//! with other bands than it had, or as one colour. Where there is any noise, as in a photograph, they do
//! not show, so that only areas without noise count.

#![expect(clippy::needless_range_loop, reason = "loops over indices are vectorized")]

use super::light::{COLUMNS, Samples};
use super::pyramid::Shown;

/// Side in pixels of the areas that are smooth as a whole, or not.
const AREA: usize = 32;
/// Side of the blocks whose means count.
const BLOCK: usize = 8;
const BLOCKS: usize = COLUMNS / BLOCK;
/// Steps of samples of 8 bits, in which errors are measured.
const STEPS: f32 = 255.0;
/// The second differences of a smooth area: the largest one, and the mean of their squares. Those of a
/// ramp that is rounded to 8 bits are up to 2, and up to 1.
const LARGEST: f32 = 3.0;
const MEAN_SQUARE: f32 = 1.05;
/// The deviation that is allowed at a quality of 75, in steps; by how much the quality must fall for
/// twice the deviation; and the least deviation that is asked for: of rounding alone there are tenths of
/// a step.
const ALLOWED: f64 = 0.4;
const DOUBLED_BY: f64 = 20.0;
const LEAST_ALLOWED: f64 = 0.3;

/// The mean square deviation of blocks that is allowed at a quality.
pub(super) fn allowed(quality: f64) -> f64 {
    (ALLOWED * ((75.0 - quality) / DOUBLED_BY).exp2()).max(LEAST_ALLOWED).powi(2)
}

/// Sums over areas.
#[derive(Clone, Copy, Debug, Default)]
pub(super) struct Blotches {
    /// Of mean squares of deviations of blocks; of those that are not smooth they are 0.
    squares: f64,
    areas: usize,
}

impl core::ops::AddAssign for Blotches {
    fn add_assign(&mut self, other: Self) {
        self.squares += other.squares;
        self.areas += other.areas;
    }
}

/// One row of a picture over a background in steps, channel by channel.
type Line = [[f32; COLUMNS]; 3];
/// Second differences of an area: the largest, and the sum of squares in each channel, across and down.
type Differences = (f32, [[f32; 2]; 3]);

impl Blotches {
    /// The mean square of deviations, over all of the picture.
    pub(super) fn mean_square(&self) -> f64 {
        self.squares / self.areas.max(1) as f64
    }

    /// Those of the areas from row `first` on, of which there are `rows` rows.
    #[inline(always)]
    pub(super) fn of_rows<A: Samples, B: Samples>(
        source: &Shown<'_, A>,
        rendering: &Shown<'_, B>,
        first: usize,
        rows: usize,
    ) -> Self {
        let mut found = Self::default();
        let width = source.size[0];
        for x in (0..width).step_by(COLUMNS) {
            let columns = COLUMNS.min(width - x);
            let is_smooth = smooth(source, [x, first], [columns, rows]);
            found.areas += columns.div_ceil(AREA);
            if is_smooth.contains(&true) {
                let blocks = deviations(source, rendering, [x, first], [columns, rows]);
                for (area, blocks) in blocks.chunks_exact(AREA / BLOCK).enumerate() {
                    let (mut sum, mut count) = (0.0, 0.0);
                    for &[square, of] in blocks {
                        sum += square;
                        count += of;
                    }
                    if is_smooth[area] {
                        found.squares += f64::from(sum / count);
                    }
                }
            }
        }
        found
    }
}

/// Numbers of rows in which areas are, given the first row of each.
pub(super) fn rows_of_areas(height: usize) -> impl Iterator<Item = (usize, usize)> {
    (0..height).step_by(AREA).map(move |first| (first, AREA.min(height - first)))
}

/// Reads a row of a picture, in which columns beyond the last one are of no use.
#[inline(always)]
fn read<P: Samples>(shown: &Shown<'_, P>, [x, y]: [usize; 2], line: &mut Line) {
    let model = shown.picture.model();
    let mut channels = [[0.0; COLUMNS]; 4];
    shown.picture.read(x, y, &mut channels);
    let colors = model.channels() - usize::from(model.has_alpha());
    for channel in 0..3 {
        let color = &channels[channel.min(colors - 1)];
        for at in 0..COLUMNS {
            line[channel][at] = color[at] * STEPS;
        }
        if model.has_alpha() {
            let alpha = &channels[colors];
            for at in 0..COLUMNS {
                let behind = shown.background * STEPS * (1.0 - alpha[at]);
                line[channel][at] = line[channel][at] * alpha[at] + behind;
            }
        }
    }
}

/// Which areas of some columns and rows are smooth. It looks no further once none is.
#[inline(always)]
fn smooth<P: Samples>(
    shown: &Shown<'_, P>,
    [x, y]: [usize; 2],
    [columns, rows]: [usize; 2],
) -> [bool; COLUMNS / AREA] {
    let mut lines = [[[0.0; COLUMNS]; 3]; 3];
    let mut differences: [Differences; COLUMNS / AREA] = [(0.0, [[0.0; 2]; 3]); COLUMNS / AREA];
    let mut is_smooth = core::array::from_fn(|area| area * AREA < columns);
    for row in 0..rows {
        lines.rotate_left(1);
        read(shown, [x, y + row], &mut lines[2]);
        for area in 0..COLUMNS / AREA {
            if !is_smooth[area] {
                continue;
            }
            let (start, end) = (area * AREA, columns.min((area + 1) * AREA));
            let (largest, sums) = &mut differences[area];
            for channel in 0..3 {
                let [before, middle, after] = [0, 1, 2].map(|line| &lines[line][channel]);
                for at in start + 1..end.max(start + 2) - 1 {
                    let across = after[at - 1] + after[at + 1] - 2.0 * after[at];
                    *largest = largest.max(across.abs());
                    sums[channel][0] += across * across;
                }
                if row >= 2 {
                    for at in start..end {
                        let down = before[at] + after[at] - 2.0 * middle[at];
                        *largest = largest.max(down.abs());
                        sums[channel][1] += down * down;
                    }
                }
            }
            is_smooth[area] = *largest <= LARGEST;
        }
        if !is_smooth.contains(&true) {
            break;
        }
    }
    for area in 0..COLUMNS / AREA {
        let pixels = (columns.saturating_sub(area * AREA).min(AREA) * rows) as f32;
        let sums = differences[area].1.as_flattened();
        is_smooth[area] &= sums.iter().all(|&sum| sum <= MEAN_SQUARE * pixels);
    }
    is_smooth
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
