//! A smaller output: the sums on a grid about as fine as the stored picture, clamped and averaged by area
//! (spec, section 9.5).

use alloc::vec::Vec;
use core::ops::Range;

use super::axis::Axis;
use super::tile::PairPlane;
use super::tile_grid::{PAIR_WIDTH, TILE_HEIGHT};

/// What the weight of a colour exceeds its alpha by, so that there is a colour where alpha is 0.
const LEAST_WEIGHT: f32 = 1.0 / 65536.0;

/// The average of one row of the output at a time, in memory that is used again.
#[derive(Debug, Default)]
pub(crate) struct AreaAverage {
    /// A row of tiles of the grid: channels x [`TILE_HEIGHT`] x width.
    tiles: Vec<f32>,
    /// What the rows of the grid add to the row of the output: channels x width of the grid.
    sums: Vec<f32>,
    /// A row of the output: channels x width.
    means: Vec<f32>,
    /// For each pixel of a row of the output, the columns of `sums` that it covers.
    spans: Vec<Range<usize>>,
    /// What is the same of each pixel of the output and of each column of its span.
    overlaps: Vec<f32>,
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

    /// The memory of an [`AreaAverage`] in bytes.
    pub(crate) fn memory(&self) -> u64 {
        let width = self.grid_columns().len() as u64;
        let pixels = u64::from(self.columns.1);
        let samples = (width * (TILE_HEIGHT as u64 + 1) + pixels) * self.channels as u64;
        // A column of the grid may be in two pixels of the output.
        let overlaps = width + pixels;
        (samples + overlaps) * size_of::<f32>() as u64 + pixels * size_of::<Range<usize>>() as u64
    }
}

impl AreaAverage {
    /// Begins with a strip of the output.
    pub(crate) fn begin(&mut self, averaging: &Averaging) {
        let width = averaging.grid_columns().len();
        self.tiles.resize(averaging.channels * TILE_HEIGHT * width, 0.0);
        self.sums.clear();
        self.sums.resize(averaging.channels * width, 0.0);
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

    /// Takes a pair of tiles whose first column is `x`: clamps the sums, and multiplies colours by
    /// alpha.
    pub(crate) fn take(&mut self, averaging: &Averaging, planes: &[PairPlane], x: usize) {
        let width = self.sums.len() / averaging.channels;
        let length = PAIR_WIDTH.min(width - x);
        for row in 0..TILE_HEIGHT {
            let mut weights = [1.0; PAIR_WIDTH];
            if averaging.has_alpha {
                let alpha = planes[averaging.channels - 1][row];
                weights = alpha.map(|alpha| alpha.clamp(0.0, 1.0) + LEAST_WEIGHT);
            }
            for (channel, plane) in planes.iter().enumerate() {
                let mut values = plane[row].map(|sum| sum.clamp(0.0, 1.0));
                if !averaging.has_alpha || channel + 1 < averaging.channels {
                    values.iter_mut().zip(&weights).for_each(|(value, weight)| *value *= weight);
                }
                let line = (channel * TILE_HEIGHT + row) * width + x;
                self.tiles[line..line + length].copy_from_slice(&values[..length]);
            }
        }
    }

    /// Adds a row of the grid that is in row `line` of the tiles, as much of it as is in a row of
    /// the output. Returns that row if it is complete: channels x width.
    pub(crate) fn add(
        &mut self,
        averaging: &Averaging,
        line: usize,
        of_grid: u32,
        row: u32,
    ) -> Option<&[f32]> {
        let rows = averaging.axes[1];
        let overlap = rows.overlap(row, of_grid);
        let width = self.sums.len() / averaging.channels;
        let lines = self.tiles.chunks_exact(width).skip(line).step_by(TILE_HEIGHT);
        for (sums, values) in self.sums.chunks_exact_mut(width).zip(lines) {
            sums.iter_mut().zip(values).for_each(|(sum, value)| *sum += overlap * value);
        }
        if of_grid + 1 < rows.span(row..row + 1).end {
            return None;
        }
        self.finish(averaging);
        Some(&self.means)
    }

    /// Averages the sums of a row along the columns, divides colours by alpha, and begins the next
    /// row.
    fn finish(&mut self, averaging: &Averaging) {
        let [columns, rows] = averaging.axes;
        let (width, of_grid) = (averaging.columns.1 as usize, averaging.grid_columns().len());
        self.sums.iter_mut().for_each(|sum| *sum /= rows.grid() as f32);
        for (means, sums) in self.means.chunks_exact_mut(width).zip(self.sums.chunks_exact(of_grid))
        {
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
        self.sums.fill(0.0);
    }
}
