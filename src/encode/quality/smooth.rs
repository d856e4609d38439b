//! Areas of a picture without edges and texture: flat ones, gradients, and both with weak noise.

use fearless_simd::{Level, dispatch};
use rayon::prelude::*;

use super::light::{COLUMNS, Samples};
use super::pyramid::Shown;
use crate::encode::source::Source;

// Constants: docs/tuning.md, "What a person sees".
/// Side in pixels of the areas that are smooth as a whole, or not.
pub(super) const AREA: usize = 32;
const AREAS: usize = COLUMNS / AREA;
/// Steps of samples of 8 bits, in which all is measured.
const STEPS: f32 = 255.0;
/// The second differences of a smooth area: the largest one, and the mean of their squares. Those of a
/// ramp that is rounded to 8 bits are up to 2, and up to 1.
const LARGEST: f32 = 3.0;
const MEAN_SQUARE: f32 = 1.05;
/// The same with noise, or dither: that of camera noise with a standard deviation of 2 is 24 on average.
const LARGEST_OF_NOISE: f32 = 24.0;
const MEAN_SQUARE_OF_NOISE: f32 = 26.0;
/// The sum of a line's steps, up and down, as a factor on its range. It is 1 where the line rises or
/// falls, and up to 2 where it turns once; noise turns often.
const TURNS: f32 = 1.2;

/// The weight of even ground that is no part of a gradient. The errors there are around edges, which hide
/// them.
const EVEN_WEIGHT: f32 = 0.14;
/// The weight of the mean of noise, which hides the errors of its blocks: a shift of a quarter of a step is
/// as bad as one of 0.15 of blocks in a gradient.
const NOISE_WEIGHT: f32 = 0.36;

/// One row of a picture over a background in steps, channel by channel.
pub(super) type Line = [[f32; COLUMNS]; 3];

/// Sums over a channel of an area in one direction.
#[derive(Clone, Copy, Default)]
struct Variation {
    /// Of the squares of second differences.
    curvature: f32,
    /// Of first differences without their signs.
    steps: f32,
    /// Of the ranges of rows; those of columns are known after the last row.
    ranges: f32,
}

/// Numbers of rows in which areas are, given the first row of each.
pub(super) fn rows_of_areas(height: usize) -> impl Iterator<Item = (usize, usize)> {
    (0..height).step_by(AREA).map(move |first| (first, AREA.min(height - first)))
}

/// What there is in a smooth area.
#[derive(Clone, Copy, Debug, PartialEq)]
enum Ground {
    /// One colour, in steps.
    Even([f32; 3]),
    Gradient,
    Noise,
}

/// How much deviations count in an area.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub(super) struct Weights {
    /// Those of the means of blocks: 1 in a gradient, 0 where it is not smooth.
    pub(super) blocks: f32,
    /// That of the mean of the area.
    pub(super) whole: f32,
}

/// How much errors count in the areas of a picture over a background.
#[derive(Debug)]
pub(super) struct SmoothAreas {
    /// Areas in a row.
    columns: usize,
    /// Row by row.
    weights: Vec<Weights>,
}

impl SmoothAreas {
    pub(super) fn new<P: Samples>(shown: &Shown<'_, P>, level: Level) -> Self {
        let [width, height] = shown.size;
        let columns = width.div_ceil(AREA);
        let mut grounds = vec![None; columns * height.div_ceil(AREA)];
        grounds.par_chunks_mut(columns).enumerate().for_each(|(row, found)| {
            let y = row * AREA;
            let rows = AREA.min(height - y);
            for (x, found) in (0..width).step_by(COLUMNS).zip(found.chunks_mut(AREAS)) {
                let columns = COLUMNS.min(width - x);
                let areas = dispatch!(level, _ => smooth(shown, [x, y], [columns, rows]));
                found.copy_from_slice(&areas[..found.len()]);
            }
        });
        let weights = (0..grounds.len()).map(|at| weights(&grounds, columns, at)).collect();
        Self { columns, weights }
    }

    /// The weights in the row of areas that begins at a row of pixels.
    pub(super) fn row(&self, y: usize) -> &[Weights] {
        &self.weights[y / AREA * self.columns..][..self.columns]
    }

    /// Number of areas, smooth or not.
    pub(super) fn count(&self) -> usize {
        self.weights.len()
    }
}

/// Where a picture has gradients, over any of its backgrounds.
#[derive(Debug)]
pub(crate) struct Gradients {
    /// Areas in a row.
    columns: usize,
    /// Row by row.
    areas: Vec<bool>,
}

impl Gradients {
    pub(crate) fn new(source: &Source<'_>) -> Self {
        let size = source.size();
        let columns = size[0].div_ceil(AREA);
        let mut areas = vec![false; columns * size[1].div_ceil(AREA)];
        for &background in source.backgrounds() {
            let shown = Shown { picture: source, size, background };
            let smooth = SmoothAreas::new(&shown, Level::new());
            for (area, weights) in areas.iter_mut().zip(&smooth.weights) {
                *area |= weights.blocks == 1.0;
            }
        }
        Self { columns, areas }
    }

    /// Whether a pixel is in one.
    pub(crate) fn has(&self, x: usize, y: usize) -> bool {
        self.areas[y / AREA * self.columns + x / AREA]
    }
}

/// The weights of an area, given what there is in those of the picture, row by row.
fn weights(grounds: &[Option<Ground>], columns: usize, at: usize) -> Weights {
    let ground = match grounds[at] {
        None => return Weights::default(),
        Some(Ground::Noise) => return Weights { blocks: 0.0, whole: NOISE_WEIGHT },
        Some(ground) => ground,
    };
    let around = |at: usize, count: usize| at.saturating_sub(1)..count.min(at + 2);
    let rows = around(at / columns, grounds.len() / columns);
    let mut near = rows.flat_map(|y| &grounds[y * columns..][around(at % columns, columns)]);
    let is_in_gradient = near.any(|&other| match (ground, other) {
        (Ground::Even(color), Some(Ground::Even(other))) => {
            let differences = || color.iter().zip(other).map(|(a, b)| (a - b).abs());
            color != other && differences().all(|difference| difference <= LARGEST)
        }
        (_, other) => other == Some(Ground::Gradient),
    });
    Weights { blocks: if is_in_gradient { 1.0 } else { EVEN_WEIGHT }, whole: 0.0 }
}

/// Reads a row of a picture, in which columns beyond the last one are of no use.
#[inline(always)]
pub(super) fn read<P: Samples>(shown: &Shown<'_, P>, [x, y]: [usize; 2], line: &mut Line) {
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

/// What there is in the smooth areas of some columns and rows. It looks no further once none is smooth.
#[inline(always)]
fn smooth<P: Samples>(
    shown: &Shown<'_, P>,
    [x, y]: [usize; 2],
    [columns, rows]: [usize; 2],
) -> [Option<Ground>; AREAS] {
    let mut lines = [[[0.0; COLUMNS]; 3]; 3];
    let mut bounds = [[[f32::INFINITY; COLUMNS], [f32::NEG_INFINITY; COLUMNS]]; 3];
    // Across and down.
    let mut variations = [[[Variation::default(); 2]; 3]; AREAS];
    let mut largest_bends = [0.0_f32; AREAS];
    let mut is_smooth: [bool; AREAS] = core::array::from_fn(|area| area * AREA < columns);
    for row in 0..rows {
        lines.rotate_left(1);
        read(shown, [x, y + row], &mut lines[2]);
        for area in 0..AREAS {
            if !is_smooth[area] {
                continue;
            }
            let (start, end) = (area * AREA, columns.min((area + 1) * AREA));
            let mut largest = 0.0_f32;
            for channel in 0..3 {
                let [before, middle, after] = [0, 1, 2].map(|line| &lines[line][channel]);
                let [across, down] = &mut variations[area][channel];
                let [mut least, mut most] = [after[start]; 2];
                for at in start + 1..end {
                    across.steps += (after[at] - after[at - 1]).abs();
                    least = least.min(after[at]);
                    most = most.max(after[at]);
                }
                across.ranges += most - least;
                for at in start + 1..end.max(start + 2) - 1 {
                    let bend = after[at - 1] + after[at + 1] - 2.0 * after[at];
                    largest = largest.max(bend.abs());
                    across.curvature += bend * bend;
                }
                let [least, most] = &mut bounds[channel];
                for at in start..end {
                    least[at] = least[at].min(after[at]);
                    most[at] = most[at].max(after[at]);
                }
                if row >= 1 {
                    for at in start..end {
                        down.steps += (after[at] - middle[at]).abs();
                    }
                }
                if row >= 2 {
                    for at in start..end {
                        let bend = before[at] + after[at] - 2.0 * middle[at];
                        largest = largest.max(bend.abs());
                        down.curvature += bend * bend;
                    }
                }
            }
            largest_bends[area] = largest.max(largest_bends[area]);
            is_smooth[area] = largest <= LARGEST_OF_NOISE;
        }
        if !is_smooth.contains(&true) {
            break;
        }
    }
    core::array::from_fn(|area| {
        if !is_smooth[area] {
            return None;
        }
        let (start, end) = (area * AREA, columns.min((area + 1) * AREA));
        let pixels = ((end - start) * rows) as f32;
        let (mut curvature, mut steps, mut ranges) = (0.0_f32, 0.0, 0.0);
        for ([across, down], [least, most]) in variations[area].iter().zip(&bounds) {
            curvature = curvature.max(across.curvature).max(down.curvature);
            steps += across.steps + down.steps;
            ranges += across.ranges + (start..end).map(|at| most[at] - least[at]).sum::<f32>();
        }
        if steps == 0.0 {
            return Some(Ground::Even(bounds.map(|[least, _]| least[start])));
        }
        let is_clean = largest_bends[area] <= LARGEST && curvature <= MEAN_SQUARE * pixels;
        if is_clean && steps <= TURNS * ranges {
            return Some(Ground::Gradient);
        }
        (curvature <= MEAN_SQUARE_OF_NOISE * pixels).then_some(Ground::Noise)
    })
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::color::ColorModel;
    use crate::encode::testing::source;
    use crate::testing::simd_levels;

    /// The weights of the areas of a gray picture.
    fn weights_of([width, height]: [usize; 2], sample: impl FnMut(usize) -> u8) -> Vec<Weights> {
        let samples: Vec<u8> = (0..width * height).map(sample).collect();
        let source = source([width, height], ColorModel::Gray, &samples);
        let shown = Shown { picture: &source, size: [width, height], background: 0.0 };
        let mut found = simd_levels().into_iter().map(|(_, level)| {
            let areas = SmoothAreas::new(&shown, level);
            let weights: Vec<Weights> =
                (0..height).step_by(AREA).flat_map(|y| areas.row(y).to_vec()).collect();
            assert_eq!(weights.len(), areas.count());
            weights
        });
        let first = found.next().expect("there is a level");
        assert!(found.all(|weights| weights == first));
        first
    }

    #[test]
    fn blocks_count_in_gradients_and_means_in_noise() {
        let size = [COLUMNS + 40, 50];
        let width = size[0];
        let mut rng = fastrand::Rng::with_seed(8);
        let all = |weights: Weights| vec![weights; width.div_ceil(AREA) * 2];
        let [none, gradient, even] =
            [0.0, 1.0, EVEN_WEIGHT].map(|blocks| Weights { blocks, whole: 0.0 });
        let noise = Weights { blocks: 0.0, whole: NOISE_WEIGHT };
        assert_eq!(weights_of(size, |at| (at % width / 20) as u8), all(gradient));
        assert_eq!(weights_of(size, |at| (at % width + at / width) as u8), all(gradient));
        // Steps where areas meet.
        assert_eq!(weights_of(size, |at| (at % width / AREA) as u8), all(gradient));
        for strength in [2, 6] {
            let with_noise = |at| (at % width / 20) as u8 + rng.u8(..strength);
            assert_eq!(weights_of(size, with_noise), all(noise), "{strength}");
        }
        assert_eq!(weights_of(size, |at| (at % width / 20) as u8 + rng.u8(..20)), all(none));
        assert_eq!(weights_of(size, |_| 9), all(even));
        // An edge.
        let edge = weights_of(size, |at| if at % width < 70 { 9 } else { 200 });
        let row = [even, even, none, even, even, even];
        assert_eq!(edge, [row, row].concat());
        assert_eq!(weights_of([1, 1], |_| 7), [even]);
    }
}
