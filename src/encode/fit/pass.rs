//! One pass over the picture: rendering, residuals and gradients, tile by tile (paper, equations 1
//! and 2).
//!
//! The L2 loss is a sum over pixels, so the forward and the backward pass of a tile run one after
//! the other while the tile is in the first-level cache. Every splat has slots for its gradient
//! sums in every row of tiles that it touches, and its slots are added up in a fixed order. So
//! there are no atomic operations, and the result is the same, bit for bit, on any number of
//! threads.

use fearless_simd::Level;
use rayon::prelude::*;

use super::bins::{RowBins, TileRow};
use super::distortion_map;
use super::parameterization::GeometrySums;
use super::training::Distortion;
use super::training_tile::{RenderingError, Slot, TileState, TrainingTile, slots_per_span};
use crate::encode::error::EncodeError;
use crate::encode::progress::Observer;
use crate::encode::raster::{Raster, TILE_WIDTH, TilePlane};
use crate::kernel::Kernel;
use crate::region::Region;
use crate::render::splat::Splat;
use crate::render::tile_grid::TILE_HEIGHT;

/// Pairs of a tile and a splat from one poll of the observer to the next: a few milliseconds.
const WORK_PER_POLL: usize = 1 << 16;
/// The cost of a tile without splats, in such pairs.
const WORK_PER_TILE: usize = 16;
/// Nanoseconds of work to sort a span by tile.
const WORK_PER_SPAN: f64 = 50.0;

/// The gradient of the loss, half the distortion, by one splat.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub(crate) struct SplatGradient {
    /// The sums from which the gradients by centre and shape follow.
    pub(crate) geometry: GeometrySums,
    /// The gradient by the colour.
    pub(crate) color: [f32; 4],
}

/// The bins, results and scratch memory of passes, reused from one pass to the next.
#[derive(Debug)]
pub(crate) struct Pass {
    level: Level,
    bins: RowBins,
    tile_rows: Vec<TileRow>,
    /// The slots of all spans, in the order of the bins: row by row, then splat by splat.
    slots: Vec<Slot>,
    /// `span_indices[span_ends[s - 1]..span_ends[s]]` are the indices of the spans of splat s among
    /// the spans of all rows.
    span_indices: Vec<u32>,
    span_ends: Vec<u32>,
    /// The distortion of every tile, if the last pass measured it.
    distortions: Vec<f32>,
    /// The error of every row of tiles.
    row_errors: Vec<RenderingError>,
}

impl Pass {
    pub(crate) fn new(raster: &Raster) -> Self {
        let rows = raster.height.div_ceil(TILE_HEIGHT);
        let region =
            Region { x: 0, y: 0, width: raster.width as u32, height: raster.height as u32 };
        Self {
            level: Level::new(),
            bins: RowBins::new(region),
            tile_rows: Vec::new(),
            slots: Vec::new(),
            span_indices: Vec::new(),
            span_ends: Vec::new(),
            distortions: Vec::new(),
            row_errors: vec![RenderingError::default(); rows],
        }
    }

    /// Bins splats by the tiles that they touch. The bins remain valid for a few passes in which
    /// the splats change little: near the cut-off, the weight of a splat is close to 0.
    ///
    /// # Errors
    /// [`EncodeError::Cancelled`] when the caller cancels.
    pub(crate) fn bin(
        &mut self,
        raster: &Raster,
        splats: &[Splat],
        kernel: Kernel,
        observer: &mut Observer<'_>,
    ) -> Result<(), EncodeError> {
        // The slots take most of the memory. They are freed while binning needs memory of its own.
        self.slots = Vec::new();
        self.span_ends.clear();
        self.span_ends.resize(splats.len(), 0);
        self.span_indices.clear();
        let (ends, indices) = (&mut self.span_ends, &mut self.span_indices);
        self.bins.rebuild(splats, kernel.cutoff(), observer, |splat, span| {
            indices.push(span as u32);
            ends[splat as usize] = indices.len() as u32;
        })?;
        let bins = &self.bins;
        self.tile_rows = Vec::new();
        let work = WORK_PER_SPAN * self.span_indices.len() as f64 / bins.rows() as f64;
        self.tile_rows = observer.map(work, 0..bins.rows(), |row| bins.row(row))?;
        // A splat outside the picture has no spans: its end is that of the splat before.
        let mut last = 0;
        for end in ends {
            last = last.max(*end);
            *end = last;
        }
        self.slots =
            vec![Slot::default(); self.span_indices.len() * slots_per_span(raster.channels)];
        Ok(())
    }

    /// Kernel evaluations of a pass with these bins.
    pub(crate) fn evaluations(&self) -> u64 {
        let pairs = self.tile_rows.iter().map(TileRow::entries).sum::<usize>();
        (pairs * TILE_WIDTH * TILE_HEIGHT) as u64
    }

    /// Frees the memory of the bins.
    pub(crate) fn free_bins(&mut self) {
        self.tile_rows = Vec::new();
        self.slots = Vec::new();
        self.span_indices = Vec::new();
        self.span_ends = Vec::new();
    }

    /// Renders over the base colour the `splats`, which [`Pass::bin`] must have binned, and
    /// computes residuals and gradients. Returns the error of the rendering. Measures the distortions
    /// of tiles if a measure is given.
    ///
    /// # Errors
    /// [`EncodeError::Cancelled`] when the caller cancels; `observer` is polled every few
    /// milliseconds.
    pub(crate) fn run(
        &mut self,
        raster: &Raster,
        splats: &[Splat],
        kernel: Kernel,
        base: [f32; 4],
        measure: Option<Distortion>,
        observer: &mut Observer<'_>,
    ) -> Result<RenderingError, EncodeError> {
        match raster.channels {
            1 => self.run_of::<1>(raster, splats, kernel, base, measure, observer),
            2 => self.run_of::<2>(raster, splats, kernel, base, measure, observer),
            3 => self.run_of::<3>(raster, splats, kernel, base, measure, observer),
            _ => self.run_of::<4>(raster, splats, kernel, base, measure, observer),
        }?;
        Ok(self.row_errors.iter().fold(RenderingError::default(), |sum, &error| sum + error))
    }

    /// The gradient of the last pass by a splat: the sum of its slots, in the order of the rows.
    #[inline]
    pub(crate) fn gradient(&self, splat: usize, channels: usize) -> SplatGradient {
        let per_span = slots_per_span(channels);
        let mut sum = [Slot::default(); 2];
        for &span in self.spans_of(splat) {
            let slots = &self.slots[span as usize * per_span..][..per_span];
            for (sum, slot) in sum.iter_mut().zip(slots) {
                *sum = core::array::from_fn(|lane| sum[lane] + slot[lane]);
            }
        }
        let sum = sum.as_flattened();
        SplatGradient {
            geometry: GeometrySums { first: [sum[0], sum[1]], second: [sum[2], sum[3], sum[4]] },
            color: [sum[5], sum[6], sum[7], sum[8]],
        }
    }

    /// The distortions that the last pass measured: those of all tiles, row by row.
    pub(crate) fn distortions(&self) -> &[f32] {
        &self.distortions
    }

    /// Whether a splat touches the picture, by the present bins.
    pub(crate) fn touches(&self, splat: usize) -> bool {
        !self.spans_of(splat).is_empty()
    }

    /// Size in bytes.
    pub(crate) fn memory(&self) -> usize {
        self.bins.memory()
            + self.tile_rows.iter().map(TileRow::memory).sum::<usize>()
            + self.slots.capacity() * size_of::<Slot>()
            + (self.span_ends.capacity() + self.span_indices.capacity()) * size_of::<u32>()
            + self.distortions.capacity() * size_of::<f32>()
    }

    /// The indices of the spans of a splat, in the order of the rows.
    #[inline]
    fn spans_of(&self, splat: usize) -> &[u32] {
        let start = splat.checked_sub(1).map_or(0, |before| self.span_ends[before]);
        &self.span_indices[start as usize..self.span_ends[splat] as usize]
    }

    fn run_of<const CHANNELS: usize>(
        &mut self,
        raster: &Raster,
        splats: &[Splat],
        kernel: Kernel,
        base: [f32; 4],
        measure: Option<Distortion>,
        observer: &mut Observer<'_>,
    ) -> Result<(), EncodeError> {
        let bins = &self.bins;
        let per_span = slots_per_span(CHANNELS);
        let tiles = if measure.is_some() { bins.columns() * bins.rows() } else { 0 };
        self.distortions.resize(tiles, 0.0);
        let mut slots = &mut self.slots[..];
        let mut distortions = &mut self.distortions[..];
        let rows = self.tile_rows.iter().zip(&mut self.row_errors);
        let mut jobs: Vec<_> = (rows.enumerate())
            .map(|(row, (tiles, error))| {
                let slots = slots
                    .split_off_mut(..bins.spans(row).len() * per_span)
                    .expect("there are slots for all rows");
                let of_row = if measure.is_some() { bins.columns() } else { 0 };
                let distortions =
                    distortions.split_off_mut(..of_row).expect("there is one for each tile");
                (row, tiles, slots, distortions, error)
            })
            .collect();
        let level = self.level;
        while !jobs.is_empty() {
            observer.poll()?;
            let mut work = 0;
            let count = jobs.iter().take_while(|(_, tiles, ..)| {
                let more = work < WORK_PER_POLL;
                work += tiles.entries() + WORK_PER_TILE * bins.columns();
                more
            });
            let count = count.count();
            // One row per task, so that the last rows are shared by all threads.
            let band = jobs.par_drain(..count).with_max_len(1);
            band.for_each(|(row, tiles, slots, distortions, error)| {
                let splats = &bins.splats(row, splats);
                let mut states = Vec::new();
                let mut planes = [[[0.0; TILE_WIDTH]; TILE_HEIGHT]; CHANNELS];
                slots.fill(Slot::default());
                *error = RenderingError::default();
                for column in 0..bins.columns() {
                    let indices = tiles.splats(column);
                    let tile = TrainingTile::new(raster, [column, row], base, splats, indices);
                    states.resize(indices.len(), TileState::ZERO);
                    *error = *error + tile.run(level, kernel, &mut states, slots, &mut planes);
                    if let (Some(measure), Some(sum)) = (measure, distortions.get_mut(column)) {
                        let corner = [column * TILE_WIDTH, row * TILE_HEIGHT];
                        let plane = distortion_map::of_tile(raster, corner, &planes, measure);
                        *sum = plane.as_flattened().iter().sum();
                    }
                }
            });
        }
        Ok(())
    }
}

/// A pass with what it rendered, from which it can render tiles again.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Rendered<'a> {
    pub(crate) pass: &'a Pass,
    pub(crate) raster: &'a Raster,
    pub(crate) splats: &'a [Splat],
    pub(crate) kernel: Kernel,
    pub(crate) base: [f32; 4],
}

impl Rendered<'_> {
    /// Half the gradient of the distortion by the samples of the rendering of a tile, one plane per
    /// channel: where nothing but squared error counts, rendering minus source. It is 0 where the
    /// source is black or white and the rendering lies beyond it, because the output is clamped, and
    /// outside the picture.
    pub(crate) fn residuals(&self, tile: usize) -> Vec<TilePlane> {
        match self.raster.channels {
            1 => self.residuals_of::<1>(tile),
            2 => self.residuals_of::<2>(tile),
            3 => self.residuals_of::<3>(tile),
            _ => self.residuals_of::<4>(tile),
        }
    }

    fn residuals_of<const CHANNELS: usize>(&self, tile: usize) -> Vec<TilePlane> {
        let Pass { level, bins, tile_rows, .. } = self.pass;
        let (row, column) = (tile / bins.columns(), tile % bins.columns());
        let spans = bins.spans(row);
        let of_tile = tile_rows[row].splats(column);
        let splat = |&span: &u32| self.splats[spans[span as usize].splat as usize];
        let splats: Vec<Splat> = of_tile.iter().map(splat).collect();
        let indices: Vec<u32> = (0..splats.len() as u32).collect();
        let tile = TrainingTile::new(self.raster, [column, row], self.base, &splats, &indices);
        let mut states = vec![TileState::ZERO; splats.len()];
        let mut planes = [[[0.0; TILE_WIDTH]; TILE_HEIGHT]; CHANNELS];
        tile.residuals(*level, self.kernel, &mut states, &mut planes);
        planes.to_vec()
    }
}

#[cfg(test)]
mod tests;
