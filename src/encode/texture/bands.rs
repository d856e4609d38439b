//! The bands of a block of luma, and how much there is in each, cell by cell.
//!
//! A band is the difference of two blurs, the coarser of which has taps twice as far apart as the finer
//! one ("à trous"): an octave, centred at about 0.3 and 0.15 cycles a pixel.

use crate::encode::source::SPAN;
use crate::texture::{CELL, OCTAVES};

/// Columns and rows of a block.
pub(super) const COLUMNS: usize = SPAN;
pub(super) const ROWS: usize = 32;
/// Columns and rows around a block that are known, of which its bands need all but one.
pub(super) const HALO: usize = 8;
/// Columns and rows of a block with what is around it.
pub(super) const STRIDE: usize = COLUMNS + 2 * HALO;
pub(super) const HEIGHT: usize = ROWS + 2 * HALO;

/// The taps of a blur: the middle one, and those next to it on both sides.
const TAPS: [f32; 3] = [0.375, 0.25, 0.0625];

// Constants: docs/tuning.md, "Texture".
/// The least square root of a magnitude that counts.
const LEAST_ROOT: f32 = 1e-4;

/// What there is of a picture in a cell, or on average around a node.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub(super) struct Content {
    /// The square root of the mean magnitude of each band. Averaged over cells, it is robust: a lone edge
    /// counts little.
    pub(super) magnitudes: [f32; OCTAVES],
    /// The same of the differences of neighbours, across columns and across rows, in the sum of all bands.
    pub(super) slopes: [f32; 2],
    /// The mean square of each band.
    pub(super) energies: [f32; OCTAVES],
    /// The share of the pixels that are the same as one of the two before them in their row: most of them in what is
    /// drawn or dithered, and few in what is random.
    pub(super) repeated: f32,
}

impl Content {
    /// The same with the reciprocals of magnitudes and slopes: the mean of reciprocals is that of what is
    /// everywhere, and counts what some cells alone have still less.
    pub(super) fn inverted(&self) -> Self {
        let inverse = |root: f32| 1.0 / root.max(LEAST_ROOT);
        let Self { magnitudes, slopes, .. } = *self;
        Self { magnitudes: magnitudes.map(inverse), slopes: slopes.map(inverse), ..*self }
    }

    /// Adds `weight` times that of another one.
    #[inline(always)]
    pub(super) fn add(&mut self, weight: f32, other: &Self) {
        for octave in 0..OCTAVES {
            self.magnitudes[octave] += weight * other.magnitudes[octave];
            self.energies[octave] += weight * other.energies[octave];
        }
        for axis in 0..2 {
            self.slopes[axis] += weight * other.slopes[axis];
        }
        self.repeated += weight * other.repeated;
    }
}

/// The cells of a block.
pub(super) type BlockCells = [[Content; COLUMNS / CELL]; ROWS / CELL];

type Plane = Vec<[f32; STRIDE]>;

/// The luma of a block with what is around it, and memory for its bands.
#[derive(Debug)]
pub(super) struct Block {
    luma: Plane,
    /// Luma that is blurred horizontally, and luma that is blurred once and twice.
    half: Plane,
    once: Plane,
    twice: Plane,
}

impl Default for Block {
    fn default() -> Self {
        let plane = || vec![[0.0; STRIDE]; HEIGHT];
        Self { luma: plane(), half: plane(), once: plane(), twice: plane() }
    }
}

impl Block {
    /// A row of the luma, to be filled.
    pub(super) fn row(&mut self, row: usize) -> &mut [f32; STRIDE] {
        &mut self.luma[row]
    }

    /// The cells of the block, of which so many columns and rows are inside the picture.
    ///
    /// The compiler turns the loops into code of the SIMD level that the caller is dispatched to.
    #[inline(always)]
    pub(super) fn cells(&mut self, size: [usize; 2]) -> BlockCells {
        let mut cells = [[Content::default(); COLUMNS / CELL]; ROWS / CELL];
        let Self { luma, half, once, twice } = self;
        blur(luma, half, once, 0);
        add_band(luma, once, 0, size, &mut cells);
        blur(once, half, twice, 1);
        add_band(once, twice, 1, size, &mut cells);
        add_slopes(luma, twice, size, &mut cells);
        add_repeated(luma, size, &mut cells);
        cells
    }
}

/// Blurs a plane to a coarser one. The first and last rows and columns are not those of a larger plane, two
/// steps more of them in each octave.
#[inline(always)]
fn blur(fine: &Plane, half: &mut Plane, coarse: &mut Plane, octave: usize) {
    let step = 1 << octave;
    let unknown = 2 * (step - 1);
    for row in unknown..HEIGHT - unknown {
        let columns = STRIDE - 4 * step;
        let [a, b, c, d, e] = [0, 1, 2, 3, 4].map(|tap| &fine[row][tap * step..][..columns]);
        let blurred = &mut half[row][2 * step..][..columns];
        for x in 0..columns {
            blurred[x] = TAPS[0] * c[x] + TAPS[1] * (b[x] + d[x]) + TAPS[2] * (a[x] + e[x]);
        }
    }
    for row in unknown + 2 * step..HEIGHT - unknown - 2 * step {
        let [a, b, c, d, e] = [0, 1, 2, 3, 4].map(|tap| &half[row + tap * step - 2 * step]);
        let blurred = &mut coarse[row];
        for x in 0..STRIDE {
            blurred[x] = TAPS[0] * c[x] + TAPS[1] * (b[x] + d[x]) + TAPS[2] * (a[x] + e[x]);
        }
    }
}

/// Takes in a band, the difference of two planes.
#[inline(always)]
fn add_band(fine: &Plane, coarse: &Plane, octave: usize, size: [usize; 2], cells: &mut BlockCells) {
    by_cells(
        size,
        cells,
        |row, sums| {
            let [fine, coarse] = [fine, coarse].map(|plane| columns(plane, row, 0));
            let [magnitudes, squares] = sums;
            for x in 0..COLUMNS {
                let band = fine[x] - coarse[x];
                magnitudes[x] += band.abs();
                squares[x] += band * band;
            }
        },
        |content, [magnitude, square]| {
            content.magnitudes[octave] = magnitude.sqrt();
            content.energies[octave] = square;
        },
    );
}

/// Takes in the slopes of the difference of two planes.
#[inline(always)]
fn add_slopes(fine: &Plane, coarse: &Plane, size: [usize; 2], cells: &mut BlockCells) {
    by_cells(
        size,
        cells,
        |row, sums| {
            let near = [fine, coarse].map(|plane| columns(plane, row, 0));
            let left = [fine, coarse].map(|plane| columns(plane, row, 1));
            let above = [fine, coarse].map(|plane| columns(plane, row - 1, 0));
            let [across_columns, across_rows] = sums;
            for x in 0..COLUMNS {
                let [near, left, above] =
                    [near, left, above].map(|[fine, coarse]| fine[x] - coarse[x]);
                across_columns[x] += (near - left).abs();
                across_rows[x] += (near - above).abs();
            }
        },
        |content, slopes| content.slopes = slopes.map(f32::sqrt),
    );
}

/// Takes in how many pixels are repeated.
#[inline(always)]
fn add_repeated(luma: &Plane, size: [usize; 2], cells: &mut BlockCells) {
    by_cells(
        size,
        cells,
        |row, [repeated, _]| {
            let [near, one, two] = [0, 1, 2].map(|left| columns(luma, row, left));
            for x in 0..COLUMNS {
                let is_repeated = (near[x] == one[x]) | (near[x] == two[x]);
                repeated[x] += f32::from(u8::from(is_repeated));
            }
        },
        |content, [repeated, _]| content.repeated = repeated,
    );
}

/// The columns of the block in a row, or those so far to the left of them.
#[inline(always)]
fn columns(plane: &Plane, row: usize, left: usize) -> &[f32; COLUMNS] {
    plane[row][HALO - left..].first_chunk().expect("there is a halo")
}

/// Sums of two values over each cell, to which `add` adds those of a row. `set` takes the means.
#[inline(always)]
fn by_cells(
    [width, height]: [usize; 2],
    cells: &mut BlockCells,
    mut add: impl FnMut(usize, &mut [[f32; COLUMNS]; 2]),
    mut set: impl FnMut(&mut Content, [f32; 2]),
) {
    for (cells, first) in cells.iter_mut().zip((0..height).step_by(CELL)) {
        let rows = CELL.min(height - first);
        let mut sums = [[0.0; COLUMNS]; 2];
        for row in first..first + rows {
            add(HALO + row, &mut sums);
        }
        for (cell, first) in cells.iter_mut().zip((0..width).step_by(CELL)) {
            let columns = CELL.min(width - first);
            let scale = 1.0 / (rows * columns) as f32;
            let mean = |sums: &[f32; COLUMNS]| sums[first..][..columns].iter().sum::<f32>() * scale;
            set(cell, [mean(&sums[0]), mean(&sums[1])]);
        }
    }
}
