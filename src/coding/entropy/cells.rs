//! The grid of roots and the k-d tree of cells, in which centres are coded (spec, section 7.4).

/// Coordinates are in units of 1/128 pixel, counted from the corner of the grid.
const UNITS_PER_PIXEL: u32 = 128;

/// The grid in which centres lie: square roots whose side is a power of two of pixels. They cover
/// the picture and one more root on every side.
#[derive(Clone, Copy, Debug)]
pub(crate) struct CenterGrid {
    /// Side of a root in units.
    root: u32,
    columns: u32,
    rows: u32,
}

/// A cell of the tree that consists of whole roots, in units.
#[derive(Clone, Copy, Debug)]
pub(crate) struct RootBlock {
    corner: [u32; 2],
    pub(super) sides: [u32; 2],
}

/// A cell of the tree that is a root or part of one: a square, or twice as high as wide.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Cell {
    /// In units.
    pub(crate) corner: [u32; 2],
    /// log2 of the area in square pixels.
    pub(crate) level: u32,
}

/// The two parts of a cell.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Split<T> {
    /// The axis along which the second part follows the first: 0 for x, 1 for y.
    pub(crate) axis: usize,
    /// The coordinate along that axis at which the second part begins.
    pub(crate) middle: u32,
    pub(crate) parts: [T; 2],
}

impl CenterGrid {
    /// The grid of a picture of this size in pixels.
    pub(crate) fn new(width: u32, height: u32) -> Self {
        // At least 8 pixels, and at least a 16th of the longer side.
        let root = width.max(height).div_ceil(16).next_power_of_two().max(8);
        let roots = |side: u32| side.div_ceil(root) + 2;
        Self { root: root * UNITS_PER_PIXEL, columns: roots(width), rows: roots(height) }
    }

    /// The first cell of the tree: the whole grid.
    pub(crate) fn whole(&self) -> RootBlock {
        RootBlock { corner: [0; 2], sides: [self.columns * self.root, self.rows * self.root] }
    }

    /// Splits a block of roots across its longer side. `Err` has the cell of a block of one root.
    pub(crate) fn split(&self, roots: &RootBlock) -> Result<Split<RootBlock>, Cell> {
        let RootBlock { corner, sides } = *roots;
        let axis = usize::from(sides[1] > sides[0]);
        if sides[axis] == self.root {
            return Err(Cell { corner, level: 2 * (self.root / UNITS_PER_PIXEL).ilog2() });
        }
        let first = (sides[axis] / self.root).div_ceil(2) * self.root;
        let middle = corner[axis] + first;
        let mut parts = [*roots; 2];
        parts[0].sides[axis] = first;
        parts[1].sides[axis] -= first;
        parts[1].corner[axis] = middle;
        Ok(Split { axis, middle, parts })
    }

    /// The centre in pixels that has these coordinates in units (spec, section 7.5).
    pub(crate) fn center(&self, units: [u32; 2]) -> [f32; 2] {
        units.map(|unit| (unit as i32 - self.root as i32) as f32 / UNITS_PER_PIXEL as f32)
    }

    /// The coordinates in units of a centre in pixels: rounded down, and clamped to the grid.
    #[cfg(feature = "encode")]
    pub(crate) fn units(&self, center: [f32; 2]) -> [u32; 2] {
        let last = self.whole().sides;
        core::array::from_fn(|axis| {
            let unit = (f64::from(center[axis]) * f64::from(UNITS_PER_PIXEL)).floor() as i64;
            (unit + i64::from(self.root)).clamp(0, i64::from(last[axis]) - 1) as u32
        })
    }
}

#[cfg(feature = "encode")]
impl CenterGrid {
    /// By how many pixels, at least, the grid exceeds the picture on every side.
    pub(crate) fn margin(&self) -> f32 {
        (self.root / UNITS_PER_PIXEL) as f32
    }

    /// log2 of the position interval in units, from 1 up to the side of a root.
    pub(super) fn interval_bits(&self, fraction_bits: i32) -> u32 {
        let bits = UNITS_PER_PIXEL.ilog2() as i32 - fraction_bits;
        bits.clamp(1, self.root.ilog2() as i32) as u32
    }

    /// The middle of the position interval that a coordinate in units lies in.
    pub(super) fn snapped(&self, unit: u32, fraction_bits: i32) -> u32 {
        let bits = self.interval_bits(fraction_bits);
        (unit >> bits << bits) + (1 << bits >> 1)
    }
}

impl Cell {
    /// Splits the cell across its longer side; `None` for a cell of one pixel.
    pub(crate) fn split(&self) -> Option<Split<Self>> {
        let level = self.level.checked_sub(1)?;
        let [x, y] = self.corner;
        let axis = (self.level % 2) as usize;
        let half = 1 << (self.side_bits(axis) - 1);
        // Branchless: the axis cannot be predicted.
        let (right, down) = if axis == 0 { (half, 0) } else { (0, half) };
        let corner = [x + right, y + down];
        let parts = [self.corner, corner].map(|corner| Self { corner, level });
        Some(Split { axis, middle: corner[axis], parts })
    }

    /// log2 of a side in units.
    fn side_bits(&self, axis: usize) -> u32 {
        (self.level + axis as u32) / 2 + UNITS_PER_PIXEL.ilog2()
    }

    /// How many plain bits the position within the cell takes along each axis.
    pub(crate) fn position_bits(&self, fraction_bits: [i32; 2]) -> [u32; 2] {
        core::array::from_fn(|axis| {
            let pixels = self.side_bits(axis) as i32 - UNITS_PER_PIXEL.ilog2() as i32;
            (pixels + fraction_bits[axis]).max(0) as u32
        })
    }

    /// Which of 2^bits equal parts of a side a coordinate in units lies in.
    pub(crate) fn part(&self, axis: usize, bits: u32, unit: u32) -> u32 {
        unit.wrapping_sub(self.corner[axis]) >> (self.side_bits(axis) - bits)
    }

    /// The coordinate in units of the middle of one of 2^bits equal parts of a side.
    pub(crate) fn middle(&self, axis: usize, bits: u32, part: u32) -> u32 {
        let shift = self.side_bits(axis) - bits;
        self.corner[axis] + (part << shift) + (1 << shift >> 1)
    }
}
