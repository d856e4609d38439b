//! The map of a texture: a small picture whose pixels are the nodes between which strength and direction
//! are interpolated (spec, section 9.7).

use alloc::vec;
use alloc::vec::Vec;
use core::ops::Range;

use crate::color::{ColorModel, SampleDepth};
use crate::container::{Coding, Header};
use crate::gaussian::Parameterization;
use crate::kernel::Kernel;
use crate::math;
use crate::region::Region;

/// Pixels of the picture between two nodes, along each axis.
pub(crate) const CELL: usize = 8;
/// Octaves of a pattern. Its lattice has a pitch of 1, 2 or 4 pixels.
pub(crate) const OCTAVES: usize = 3;
/// Patterns of an octave: isotropic, horizontal streaks, vertical streaks.
pub(crate) const PATTERNS: usize = 3;
/// The channels of the map: an amplitude for each octave, and the direction.
pub(super) const CHANNELS: usize = OCTAVES + 1;

/// What does not count as amplitude and as direction, since the Gaussians of the map do not end exactly where
/// texture and streaks do.
const LEAST_SUM: f32 = 1.0 / 128.0;
const LEAST_DIRECTION: f32 = 0.125;
/// Amplitude per sum.
const AMPLITUDE: f32 = 0.5;
/// Direction per sum, and the direction of a sum of zero.
const DIRECTION: (f32, f32) = (4.0, -2.0);
/// What makes the standard deviation of each octave 1: of the isotropic pattern, and of streaks. The
/// values of a lattice are integers, 1024 of which are 1.
const GAINS: [[f32; 2]; OCTAVES] =
    [[1.0 / 1024.0, 1.23 / 1024.0], [1.82 / 1024.0, 1.72 / 1024.0], [2.1 / 1024.0, 1.86 / 1024.0]];

/// The sum for an amplitude, of which a decoder takes a little less.
#[cfg(feature = "encode")]
pub(crate) fn amplitude_sum(amplitude: f32) -> f32 {
    beyond(LEAST_SUM, amplitude / AMPLITUDE).min(1.0)
}

/// The sum for a direction, of which a decoder takes a little less.
#[cfg(feature = "encode")]
pub(crate) fn direction_sum(direction: f32) -> f32 {
    let strength = beyond(LEAST_DIRECTION, direction.abs());
    (strength.copysign(direction) - DIRECTION.1) / DIRECTION.0
}

/// The value, or one nearer to 0 if it is less than what counts: down to half of that it falls to 0.
#[cfg(feature = "encode")]
fn beyond(least: f32, value: f32) -> f32 {
    if value < least { (2.0 * value - least).max(0.0) } else { value }
}

/// The header of a picture's map: that of a picture of its own.
pub(super) fn header(picture: &Header) -> Header {
    let nodes = |side: u32| side.div_ceil(CELL as u32) + 1;
    Header {
        version: picture.version,
        coding: Coding::Entropy,
        width: nodes(picture.width),
        height: nodes(picture.height),
        color: ColorModel::Rgba,
        depth: SampleDepth::Sixteen,
        gaussians: 0,
        layers: 0,
        kernel: Kernel::Quartic,
        parameterization: Parameterization::Cholesky,
        base_color: [0, 0, 0, 1 << 15],
    }
}

/// What the patterns of an octave are multiplied by at nodes in a row: patterns x nodes.
pub(super) type Gains<const NODES: usize> = [[f32; NODES]; PATTERNS];

/// The nodes of a part of a map.
#[derive(Debug)]
pub(crate) struct NodeMap {
    /// Which nodes these are.
    region: Region,
    /// Their sums: channels x height x width.
    sums: Vec<f32>,
    /// For each node whether it has an amplitude: 1 if so.
    shows: Vec<u8>,
    /// What all amplitudes are multiplied by, 0 to 1.
    fade: f32,
}

impl NodeMap {
    pub(crate) fn new(region: Region, sums: Vec<f32>, fade: f32) -> Self {
        let mut shows = vec![0; sums.len() / CHANNELS];
        for plane in sums.chunks_exact(shows.len()).take(OCTAVES) {
            for (shows, sum) in shows.iter_mut().zip(plane) {
                *shows |= u8::from(*sum > LEAST_SUM);
            }
        }
        Self { region, sums, shows, fade }
    }

    /// Bytes of memory that it holds.
    pub(crate) fn memory(&self) -> u64 {
        (self.sums.len() * size_of::<f32>() + self.shows.len()) as u64
    }

    /// Finds the cells of a row that can have texture, as ranges of at most `most` cells: all that have a
    /// node with an amplitude within one cell from them.
    pub(super) fn cells_that_show(
        &self,
        row: i32,
        cells: Range<i32>,
        most: usize,
        mut visit: impl FnMut(Range<i32>),
    ) {
        let rows = [-1, 0, 1, 2].map(|down| self.row_of(&self.shows, row + down));
        let shows = |column: i32| {
            let column = self.column(column);
            rows.iter().any(|row| row[column] != 0)
        };
        if rows.iter().all(|row| row.iter().all(|&shows| shows == 0)) {
            return;
        }
        let mut first = cells.start;
        let mut end = cells.start;
        // The last column of nodes that shows.
        let mut last = (cells.start - 1..cells.start + 2).rfind(|&column| shows(column));
        for cell in cells {
            if shows(cell + 2) {
                last = Some(cell + 2);
            }
            let is_shown = last.is_some_and(|last| last >= cell - 1);
            if is_shown && end == first {
                (first, end) = (cell, cell);
            }
            end += i32::from(is_shown);
            if first < end && (!is_shown || (end - first) as usize == most) {
                visit(first..end);
                first = end;
            }
        }
        if first < end {
            visit(first..end);
        }
    }

    /// A row of nodes in a plane, the nearest one beyond the edges.
    fn row_of<'a, T>(&self, plane: &'a [T], row: i32) -> &'a [T] {
        let Region { y, width, height, .. } = self.region;
        let row = (row - y as i32).clamp(0, height as i32 - 1) as usize;
        &plane[row * width as usize..][..width as usize]
    }

    /// The place of a column of nodes in a row, the nearest one beyond the edges.
    fn column(&self, column: i32) -> usize {
        (column - self.region.x as i32).clamp(0, self.region.width as i32 - 1) as usize
    }

    /// The gains of all octaves at nodes in row `row` from column `first` on. Beyond the edge of the map, they
    /// are those of the nearest node.
    #[cfg_attr(target_arch = "wasm32", inline(never))]
    #[cfg_attr(not(target_arch = "wasm32"), inline(always))]
    pub(super) fn gains<const NODES: usize>(
        &self,
        row: i32,
        first: i32,
        gains: &mut [Gains<NODES>; OCTAVES],
    ) {
        let mut sums = [[0.0; NODES]; CHANNELS];
        let planes = self.sums.chunks_exact(self.shows.len());
        let inside = (first - self.region.x as i32) as usize;
        for (sums, plane) in sums.iter_mut().zip(planes) {
            let line = self.row_of(plane, row);
            if let Some(line) = line.get(inside..).and_then(<[f32]>::first_chunk) {
                *sums = *line;
            } else {
                for (column, sum) in (first..).zip(sums) {
                    *sum = line[self.column(column)];
                }
            }
        }
        for node in 0..NODES {
            let direction = sums[OCTAVES][node] * DIRECTION.0 + DIRECTION.1;
            let horizontal = unit(direction - LEAST_DIRECTION);
            let vertical = unit(-LEAST_DIRECTION - direction);
            let streaks = horizontal + vertical;
            let weights = [math::sqrt(1.0 - streaks * streaks), horizontal, vertical];
            for octave in 0..OCTAVES {
                let sum = sums[octave][node];
                let amplitude = unit((sum - LEAST_SUM) * AMPLITUDE) * self.fade;
                let [isotropic, streaks] = GAINS[octave];
                gains[octave][0][node] = amplitude * weights[0] * isotropic;
                gains[octave][1][node] = amplitude * weights[1] * streaks;
                gains[octave][2][node] = amplitude * weights[2] * streaks;
            }
        }
    }
}

/// The nearest number from 0 to 1; 0 for NaN.
#[inline(always)]
#[expect(clippy::manual_clamp, reason = "`clamp` keeps NaN")]
fn unit(value: f32) -> f32 {
    value.max(0.0).min(1.0)
}
