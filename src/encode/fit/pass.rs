//! One pass over the picture: rendering, residuals and gradients, tile by tile (paper, equations 1
//! and 2).
//!
//! The L2 loss is a sum over pixels, so the forward and the backward pass of a tile run one after
//! the other while the tile is in the first-level cache. Every splat has slots for its gradient
//! sums in every row of tiles that it touches, and its slots are added up in a fixed order. So
//! there are no atomic operations, and the result is the same, bit for bit, on any number of
//! threads.

use fearless_simd::Level;

use super::bins::RowBins;
use super::training_tile::{Slot, TileState, TrainingTile, slots_per_span};
use crate::color::with_channels;
use crate::encode::error::Result;
use crate::encode::loss::{ErrorNorm, RenderingError};
use crate::encode::own_frame::GeometrySums;
use crate::encode::progress::Observer;
use crate::encode::sample_tile::{TILE_WIDTH, TilePlane};
use crate::encode::tiled_source::TiledSource;
use crate::kernel::Kernel;
use crate::region::Region;
use crate::render::range_lists::RangeLists;
use crate::render::splat::Splat;
use crate::render::tile_grid::TILE_HEIGHT;

/// The gradient of the loss, half the distortion, by one splat.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub(crate) struct SplatGradient {
    /// The sums from which the gradients by centre and shape follow.
    pub(crate) geometry: GeometrySums,
    /// The gradient by the colour.
    pub(crate) color: [f32; 4],
}

/// What is rendered over a base colour, and compared with a source.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Scene<'a> {
    pub(crate) tiled: &'a TiledSource,
    pub(crate) splats: &'a [Splat],
    pub(crate) kernel: Kernel,
    pub(crate) base: [f32; 4],
}

/// The bins, results and scratch memory of passes, reused from one pass to the next.
#[derive(Debug)]
pub(crate) struct Pass {
    pub(super) level: Level,
    bins: RowBins,
    /// The slots of all spans, in the order of the bins: row by row, then splat by splat.
    slots: Vec<Slot>,
    /// The sum of placement errors of every tile, if the last pass measured it.
    placement_errors: Vec<f32>,
    /// What the last pass minimizes, by tile, row by row.
    tile_distortions: Vec<f32>,
    /// The error of every row of tiles.
    row_errors: Vec<RenderingError>,
}

impl Pass {
    pub(crate) fn new(tiled: &TiledSource) -> Self {
        let rows = tiled.height.div_ceil(TILE_HEIGHT);
        let region = Region { x: 0, y: 0, width: tiled.width as u32, height: tiled.height as u32 };
        Self {
            level: Level::new(),
            bins: RowBins::new(region),
            slots: Vec::new(),
            placement_errors: Vec::new(),
            tile_distortions: vec![0.0; rows * tiled.width.div_ceil(TILE_WIDTH)],
            row_errors: vec![RenderingError::default(); rows],
        }
    }

    /// Bins splats by the tiles that they touch. The bins remain valid for a few passes in which
    /// the splats change little: near the cut-off, the weight of a splat is close to 0.
    pub(crate) fn bin(&mut self, scene: &Scene<'_>, observer: &mut Observer<'_>) -> Result<()> {
        // The slots take most of the memory. They are freed while binning needs memory of its own.
        self.slots = Vec::new();
        self.bins.rebuild(scene.splats, scene.kernel.cutoff(), observer)?;
        // Memory that the system clears page by page when it is used, on all threads.
        self.slots =
            vec![Slot::default(); self.bins.span_count() * slots_per_span(scene.tiled.channels)];
        Ok(())
    }

    /// Kernel evaluations of a pass with these bins.
    pub(crate) fn evaluations(&self) -> u64 {
        (self.pairs() * TILE_WIDTH * TILE_HEIGHT) as u64
    }

    /// Pairs of a tile and a splat.
    fn pairs(&self) -> usize {
        self.bins.tile_rows().iter().map(RangeLists::len).sum()
    }

    /// Frees the memory of the bins.
    pub(crate) fn free_bins(&mut self) {
        self.bins.free();
        self.slots = Vec::new();
    }

    /// Renders the splats, which [`Pass::bin`] must have binned, and computes residuals and gradients. Returns
    /// the error of the rendering. Measures the placement errors of tiles if their norm is given.
    pub(crate) fn run(
        &mut self,
        scene: &Scene<'_>,
        norm: Option<ErrorNorm>,
        observer: &mut Observer<'_>,
    ) -> Result<RenderingError> {
        with_channels!(
            CHANNELS = scene.tiled.channels,
            self.run_of::<CHANNELS>(scene, norm, observer)
        )?;
        Ok(self.row_errors.iter().fold(RenderingError::default(), |sum, &error| sum + error))
    }

    /// The gradient of the last pass by a splat: the sum of its slots, in the order of the rows.
    #[inline(always)]
    pub(crate) fn gradient(&self, splat: usize, channels: usize) -> SplatGradient {
        let per_span = slots_per_span(channels);
        let (mut sum, mut last) = (Slot::default(), 0.0);
        for &span in self.bins.spans_of(splat) {
            let slots = &self.slots[span as usize * per_span..][..per_span];
            for lane in 0..sum.len() {
                sum[lane] += slots[0][lane];
            }
            if let Some(second) = slots.get(1) {
                last += second[0];
            }
        }
        let [x, y, xx, xy, yy, c0, c1, c2] = sum;
        SplatGradient {
            geometry: GeometrySums { first: [x, y], second: [xx, xy, yy] },
            color: [c0, c1, c2, last],
        }
    }

    /// The sums of placement errors that the last pass measured: those of all tiles, row by row.
    pub(crate) fn placement_errors(&self) -> &[f32] {
        &self.placement_errors
    }

    /// What the last pass minimizes, the distortion of every tile, row by row.
    pub(crate) fn tile_distortions(&self) -> &[f32] {
        &self.tile_distortions
    }

    /// The index of the tile at a position in pixels, or of the nearest one inside the picture.
    pub(crate) fn tile_near(&self, [x, y]: [f32; 2]) -> usize {
        // Casts saturate.
        let (column, row) = (x as usize / TILE_WIDTH, y as usize / TILE_HEIGHT);
        let (columns, rows) = (self.bins.columns(), self.bins.rows());
        row.min(rows - 1) * columns + column.min(columns - 1)
    }

    /// Whether a splat touches the picture, by the present bins.
    pub(crate) fn touches(&self, splat: usize) -> bool {
        !self.bins.spans_of(splat).is_empty()
    }

    /// Size in bytes.
    pub(crate) fn memory(&self) -> usize {
        self.bins.memory()
            + self.slots.capacity() * size_of::<Slot>()
            + (self.placement_errors.capacity() + self.tile_distortions.len()) * size_of::<f32>()
    }

    fn run_of<const CHANNELS: usize>(
        &mut self,
        scene: &Scene<'_>,
        norm: Option<ErrorNorm>,
        observer: &mut Observer<'_>,
    ) -> Result<()> {
        let Scene { tiled, splats, kernel, base } = *scene;
        let tiles = self.bins.columns() * self.bins.rows();
        let bins = &self.bins;
        let per_span = slots_per_span(CHANNELS);
        self.placement_errors.resize(if norm.is_some() { tiles } else { 0 }, 0.0);
        let mut slots = &mut self.slots[..];
        let mut placement_errors = &mut self.placement_errors[..];
        let by_tile = self.tile_distortions.chunks_exact_mut(bins.columns());
        let rows = bins.tile_rows().iter().zip(&mut self.row_errors).zip(by_tile).enumerate();
        let rows = rows.map(|(row, ((tiles, error), by_tile))| {
            let slots = slots
                .split_off_mut(..bins.spans(row).len() * per_span)
                .expect("there are slots for all rows");
            let of_row = if norm.is_some() { bins.columns() } else { 0 };
            let placement_errors =
                placement_errors.split_off_mut(..of_row).expect("there is one for each tile");
            (row, tiles, slots, placement_errors, by_tile, error)
        });
        let level = self.level;
        type Scratch = (Vec<Splat>, Vec<TileState>);
        observer.map_with(rows, |(of_row, states): &mut Scratch, item| {
            let (row, tiles, slots, placement_errors, by_tile, error) = item;
            of_row.clear();
            of_row.extend(bins.spans(row).iter().map(|span| splats[span.splat as usize]));
            let mut planes = [[[0.0; TILE_WIDTH]; TILE_HEIGHT]; CHANNELS];
            slots.fill(Slot::default());
            *error = RenderingError::default();
            for (column, by_tile) in by_tile.iter_mut().enumerate() {
                let indices = tiles.of(column);
                let tile = TrainingTile::new(tiled, [column, row], base, of_row, indices);
                if states.len() < indices.len() {
                    states.resize(indices.len(), TileState::ZERO);
                }
                let states = &mut states[..indices.len()];
                let of_tile = tile.run(level, kernel, states, Some(slots), &mut planes);
                *by_tile = of_tile.distortion.0 as f32;
                *error = *error + of_tile;
                if let (Some(norm), Some(sum)) = (norm, placement_errors.get_mut(column)) {
                    let corner = [column * TILE_WIDTH, row * TILE_HEIGHT];
                    let plane = tiled.loss.placement_errors(level, corner, &planes, norm);
                    *sum = plane.as_flattened().iter().sum();
                }
            }
        })?;
        Ok(())
    }

    /// Half the gradient of the distortion by the samples of the rendering of a tile, one plane per
    /// channel: where nothing but squared error counts, rendering minus source. It is 0 where the
    /// source is black or white and the rendering lies beyond it, because the output is clamped, and
    /// outside the picture.
    pub(crate) fn residuals(&self, scene: &Scene<'_>, tile: usize) -> Vec<TilePlane> {
        with_channels!(CHANNELS = scene.tiled.channels, self.residuals_of::<CHANNELS>(scene, tile))
    }

    fn residuals_of<const CHANNELS: usize>(
        &self,
        scene: &Scene<'_>,
        tile: usize,
    ) -> Vec<TilePlane> {
        let Self { level, bins, .. } = self;
        let (row, column) = (tile / bins.columns(), tile % bins.columns());
        let spans = bins.spans(row);
        let of_tile = bins.tile_rows()[row].of(column);
        let splat = |&span: &u32| scene.splats[spans[span as usize].splat as usize];
        let splats: Vec<Splat> = of_tile.iter().map(splat).collect();
        let indices: Vec<u32> = (0..splats.len() as u32).collect();
        let tile = TrainingTile::new(scene.tiled, [column, row], scene.base, &splats, &indices);
        let mut states = vec![TileState::ZERO; splats.len()];
        let mut planes = [[[0.0; TILE_WIDTH]; TILE_HEIGHT]; CHANNELS];
        tile.run(*level, scene.kernel, &mut states, None, &mut planes);
        planes.to_vec()
    }
}

#[cfg(test)]
mod tests;
