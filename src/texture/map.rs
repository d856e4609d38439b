//! The map of a texture: a small picture whose pixels are the nodes between which strength and direction
//! are interpolated (spec, section 9.7).

use alloc::vec;
use alloc::vec::Vec;

use crate::color::{ColorModel, SampleDepth};
use crate::container::{Coding, Header};
use crate::gaussian::Parameterization;
use crate::kernel::Kernel;
use crate::region::Region;

/// Pixels of the picture between two nodes, along each axis.
pub(crate) const CELL: usize = 8;
/// Octaves. Their lattices have a pitch of 1 and 2 pixels.
pub(crate) const OCTAVES: usize = 2;
/// Rows of nodes that a row of cells depends on, from the one above it on.
pub(super) const NODE_ROWS: usize = 4;
/// The channels of the map: an amplitude for each octave, and the direction.
pub(super) const CHANNELS: usize = OCTAVES + 1;

/// What does not count as amplitude and as direction, since the Gaussians of the map do not end exactly where
/// texture and streaks do.
pub(super) const LEAST_SUM: f32 = 1.0 / 128.0;
pub(super) const LEAST_DIRECTION: f32 = 0.375;
/// Amplitude per sum.
pub(super) const AMPLITUDE: f32 = 0.5;
/// Direction per sum, and the direction of a sum of zero.
pub(super) const DIRECTION: (f32, f32) = (4.0, -2.0);

/// Whether there is an amplitude where the map has this sum.
pub(crate) fn has_amplitude(sum: f32) -> bool {
    sum > LEAST_SUM
}

// Constants: docs/tuning.md, "Texture".
/// The sum for an amplitude. A small one becomes smaller, so that there is nothing where it is next to invisible.
#[cfg(feature = "encode")]
pub(crate) fn amplitude_sum(amplitude: f32) -> f32 {
    let sum = amplitude / AMPLITUDE;
    // Below `LEAST_SUM` it stays what it is, which has no effect.
    sum.max((sum + LEAST_SUM).min(1.5 * sum - 0.5 * LEAST_SUM)).min(1.0)
}

/// The sum for a direction, of which [`LEAST_DIRECTION`] does not count.
#[cfg(feature = "encode")]
pub(crate) fn direction_sum(direction: f32) -> f32 {
    (direction - DIRECTION.1) / DIRECTION.0
}

/// The header of a picture's map: that of a picture of its own.
pub(super) fn header(picture: &Header) -> Header {
    let nodes = |side: u32| side.div_ceil(CELL as u32) + 1;
    Header {
        version: picture.version,
        coding: Coding::Entropy,
        width: nodes(picture.width),
        height: nodes(picture.height),
        color: ColorModel::Rgb,
        depth: SampleDepth::Sixteen,
        gaussians: 0,
        layers: 0,
        kernel: Kernel::Quartic,
        parameterization: Parameterization::Cholesky,
        base_color: [0, 0, 1 << 15, 0],
    }
}

/// The nodes of a part of a map.
#[derive(Debug)]
pub(crate) struct NodeMap {
    /// Which nodes these are.
    region: Region,
    /// Their sums: channels x height x width.
    sums: Vec<f32>,
    /// For each row whether any of its nodes has an amplitude.
    shows: Vec<bool>,
    /// What all amplitudes are multiplied by, 0 to 1.
    fade: f32,
}

impl NodeMap {
    pub(crate) fn new(region: Region, sums: Vec<f32>, fade: f32) -> Self {
        let mut shows = vec![false; region.height as usize];
        for plane in sums.chunks_exact(region.pixels() as usize).take(OCTAVES) {
            for (shows, row) in shows.iter_mut().zip(plane.chunks_exact(region.width as usize)) {
                *shows |= row.iter().copied().any(has_amplitude);
            }
        }
        Self { region, sums, shows, fade }
    }

    /// Bytes of memory that it holds.
    pub(crate) fn memory(&self) -> u64 {
        (self.sums.len() * size_of::<f32>() + self.shows.len()) as u64
    }

    pub(super) fn fade(&self) -> f32 {
        self.fade
    }

    /// Whether any node of a row has an amplitude.
    pub(super) fn shows(&self, row: i32) -> bool {
        self.shows[self.place(row)]
    }

    /// Whether a row of cells can have texture.
    pub(super) fn shows_around(&self, row: i32) -> bool {
        (row - 1..row - 1 + NODE_ROWS as i32).any(|row| self.shows(row))
    }

    /// Copies the sums of a channel at nodes in a row, from column `first` on.
    pub(super) fn copy_sums(&self, channel: usize, row: i32, first: i32, sums: &mut [f32]) {
        let Region { x, width, height, .. } = self.region;
        let width = width as usize;
        let line = (channel * height as usize + self.place(row)) * width;
        let line = &self.sums[line..][..width];
        let ahead = (x as i32 - first).max(0) as usize;
        let skipped = (first - x as i32).max(0) as usize;
        let (before, sums) = sums.split_at_mut(ahead.min(sums.len()));
        before.fill(line[0]);
        let inside = line.get(skipped..).unwrap_or_default();
        let (sums, after) = sums.split_at_mut(inside.len().min(sums.len()));
        sums.copy_from_slice(&inside[..sums.len()]);
        after.fill(line[width - 1]);
    }

    /// The place of a row of nodes, of the nearest one beyond the edges.
    fn place(&self, row: i32) -> usize {
        (row - self.region.y as i32).clamp(0, self.region.height as i32 - 1) as usize
    }
}
