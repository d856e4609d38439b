//! A smaller output: the sums on a grid about as fine as the stored picture, clamped and averaged by area
//! (spec, section 9.5).

use alloc::vec::Vec;
use core::array;
use core::ops::Range;

use super::axis::Axis;
use super::tile::PairPlane;
use super::tile_grid::{PAIR_WIDTH, TILE_HEIGHT};
use crate::simd::Backend;

/// What the weight of a colour exceeds its alpha by, so that there is a colour where alpha is 0.
const LEAST_WEIGHT: f32 = 1.0 / 65536.0;
/// Most rows of the output that a row of tiles is in.
const MOST_ROWS: usize = TILE_HEIGHT + 1;

/// The averages of some rows of the output, in memory that is used again.
#[derive(Debug, Default)]
pub(crate) struct AreaAverage {
    /// The rows that are not complete yet.
    rows: Range<u32>,
    /// What the present row of tiles is of these rows.
    parts: Vec<Part>,
    /// What the rows of the grid have added to each of these: [`MOST_ROWS`] x channels x width of pairs of tiles.
    sums: Vec<f32>,
    /// A row of the output: channels x width.
    means: Vec<f32>,
    /// For each pixel of a row of the output, the columns of `sums` that it covers.
    spans: Vec<Range<usize>>,
    /// What is the same of each pixel of the output and of each column of its span.
    overlaps: Vec<f32>,
}

/// The lines of a row of tiles that are in a row of the output.
#[derive(Debug)]
struct Part {
    lines: Range<usize>,
    /// How much of each line of the tiles is in it.
    overlaps: [f32; TILE_HEIGHT],
    /// Whether it has no further lines.
    is_last: bool,
}

/// How a picture is averaged: its axes, the part that is rendered, and its channels.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Averaging {
    pub(crate) axes: [Axis; 2],
    /// The columns of the output that are rendered.
    pub(crate) columns: (u32, u32),
    pub(crate) channels: usize,
    /// Whether the last channel is alpha.
    pub(crate) has_alpha: bool,
}

impl Averaging {
    fn grid_columns(&self) -> Range<u32> {
        self.axes[0].span(self.columns.0..self.columns.0 + self.columns.1)
    }

    /// The columns of all pairs of tiles.
    fn width(&self) -> usize {
        self.grid_columns().len().next_multiple_of(PAIR_WIDTH)
    }

    /// The memory of an [`AreaAverage`] in bytes.
    pub(crate) fn memory(&self) -> u64 {
        let (width, pixels) = (self.width() as u64, u64::from(self.columns.1));
        let samples = (width * MOST_ROWS as u64 + pixels) * self.channels as u64;
        // A column of the grid may be in two pixels of the output.
        let overlaps = width + pixels;
        let others =
            pixels * size_of::<Range<usize>>() as u64 + (MOST_ROWS * size_of::<Part>()) as u64;
        (samples + overlaps) * size_of::<f32>() as u64 + others
    }
}

impl AreaAverage {
    /// Begins with some rows of the output.
    pub(crate) fn begin(&mut self, averaging: &Averaging, rows: Range<u32>) {
        self.rows = rows;
        self.sums.clear();
        self.sums.resize(MOST_ROWS * averaging.channels * averaging.width(), 0.0);
        self.means.resize(averaging.channels * averaging.columns.1 as usize, 0.0);
        self.spans.clear();
        self.overlaps.clear();
        let (axis, first) = (averaging.axes[0], averaging.grid_columns().start);
        for pixel in averaging.columns.0..averaging.columns.0 + averaging.columns.1 {
            let span = axis.span(pixel..pixel + 1);
            self.spans.push((span.start - first) as usize..(span.end - first) as usize);
            self.overlaps.extend(span.map(|column| axis.overlap(pixel, column)));
        }
    }

    /// Begins with a row of tiles, whose first line is `top` in the grid, and of which these lines count.
    pub(crate) fn begin_tiles(&mut self, averaging: &Averaging, top: u32, lines: Range<u32>) {
        let axis = averaging.axes[1];
        self.parts.clear();
        for row in self.rows.clone() {
            let span = axis.span(row..row + 1);
            let common = span.start.max(lines.start)..span.end.min(lines.end);
            if common.is_empty() {
                break;
            }
            let of_tiles = (common.start - top) as usize..(common.end - top) as usize;
            let overlap = |line| {
                if of_tiles.contains(&line) { axis.overlap(row, top + line as u32) } else { 0.0 }
            };
            let overlaps = array::from_fn(overlap);
            self.parts.push(Part { lines: of_tiles, overlaps, is_last: span.end <= lines.end });
        }
    }

    /// Takes a pair of tiles whose first column is `x`: clamps the sums, multiplies colours by alpha, and adds each
    /// line to the rows of the output that it is in.
    pub(crate) fn take(
        &mut self,
        backend: Backend,
        averaging: &Averaging,
        planes: &[PairPlane],
        x: usize,
    ) {
        backend.run(
            #[inline(always)]
            || self.add(averaging, planes, x),
        );
    }

    #[inline(always)]
    fn add(&mut self, averaging: &Averaging, planes: &[PairPlane], x: usize) {
        let (width, channels) = (averaging.width(), averaging.channels);
        for (channel, plane) in planes.iter().enumerate() {
            // Loops, as closures of the library's functions would not be compiled for the SIMD level.
            let mut values = *plane;
            for value in values.as_flattened_mut() {
                *value = value.clamp(0.0, 1.0);
            }
            if averaging.has_alpha && channel + 1 < channels {
                let alphas = planes[channels - 1].as_flattened();
                for (value, alpha) in values.as_flattened_mut().iter_mut().zip(alphas) {
                    *value *= alpha.clamp(0.0, 1.0) + LEAST_WEIGHT;
                }
            }
            for (row, part) in self.parts.iter().enumerate() {
                let sums = &mut self.sums[(row * channels + channel) * width + x..];
                let sums = sums.first_chunk_mut::<PAIR_WIDTH>().expect("rows have whole pairs");
                let mut new = *sums;
                let lines = values[part.lines.clone()].iter();
                for (line, overlap) in lines.zip(&part.overlaps[part.lines.clone()]) {
                    for at in 0..PAIR_WIDTH {
                        new[at] += overlap * line[at];
                    }
                }
                *sums = new;
            }
        }
    }

    /// Ends with a row of tiles. Calls `write` with each row of the output that is complete, and the means of its
    /// channels: channels x width.
    pub(crate) fn end_tiles(
        &mut self,
        backend: Backend,
        averaging: &Averaging,
        write: &mut dyn FnMut(u32, &[f32]),
    ) {
        let complete = self.parts.iter().filter(|part| part.is_last).count();
        for row in 0..complete {
            backend.run(
                #[inline(always)]
                || self.finish(averaging, row),
            );
            write(self.rows.start, &self.means);
            self.rows.start += 1;
        }
        // The next row of tiles goes on with what is not complete.
        let length = averaging.channels * averaging.width();
        let begun = complete * length..self.parts.len() * length;
        self.sums.copy_within(begun.clone(), 0);
        self.sums[begun.len()..begun.end].fill(0.0);
    }

    /// Averages the sums of a row along the columns, and divides colours by alpha.
    #[inline(always)]
    fn finish(&mut self, averaging: &Averaging, row: usize) {
        let [columns, rows] = averaging.axes;
        let (width, of_grid) = (averaging.columns.1 as usize, averaging.width());
        let length = averaging.channels * of_grid;
        let sums = &mut self.sums[row * length..][..length];
        sums.iter_mut().for_each(|sum| *sum /= rows.grid() as f32);
        for (means, sums) in self.means.chunks_exact_mut(width).zip(sums.chunks_exact(of_grid)) {
            let mut overlaps = &self.overlaps[..];
            for (mean, span) in means.iter_mut().zip(&self.spans) {
                let (of_pixel, others) = overlaps.split_at(span.len());
                let products = of_pixel.iter().zip(&sums[span.clone()]);
                let sum = products.fold(0.0, |sum, (overlap, value)| sum + overlap * value);
                *mean = sum / columns.grid() as f32;
                overlaps = others;
            }
        }
        if averaging.has_alpha {
            let (colors, alpha) = self.means.split_at_mut((averaging.channels - 1) * width);
            for plane in colors.chunks_exact_mut(width) {
                plane
                    .iter_mut()
                    .zip(&*alpha)
                    .for_each(|(color, alpha)| *color /= alpha + LEAST_WEIGHT);
            }
        }
    }
}
