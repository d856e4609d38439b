//! The tree of cells that centres are coded in (spec, section 7.4).

/// Positions are multiples of half of this many parts of a pixel.
const UNITS_PER_PIXEL: u32 = 128;

/// The grid of possible centres: square roots of a power of two of pixels, one more than the
/// picture needs on every side.
#[derive(Clone, Copy, Debug)]
pub(crate) struct CenterGrid {
    /// Side of a root in units.
    root: u32,
    columns: u32,
    rows: u32,
}

/// Several roots, in units.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Roots {
    corner: [u32; 2],
    pub(super) sides: [u32; 2],
}

/// A root or a part of one: a square, or twice as high as wide.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Cell {
    /// In units.
    pub(crate) corner: [u32; 2],
    /// Logarithm to base 2 of the area in square pixels.
    pub(crate) level: u32,
}

/// Two parts of something, and the axis along which the second follows the first.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Split<T> {
    pub(crate) axis: usize,
    /// Where the second begins along the axis.
    pub(crate) middle: u32,
    pub(crate) parts: [T; 2],
}

impl CenterGrid {
    pub(crate) fn new(width: u32, height: u32) -> Self {
        // At least 8 pixels, and at least a 16th of the longer side.
        let root = width.max(height).div_ceil(16).next_power_of_two().max(8);
        let roots = |side: u32| side.div_ceil(root) + 2;
        Self { root: root * UNITS_PER_PIXEL, columns: roots(width), rows: roots(height) }
    }

    /// All of it.
    pub(crate) fn whole(&self) -> Roots {
        Roots { corner: [0; 2], sides: [self.columns * self.root, self.rows * self.root] }
    }

    /// Splits the longer side of several roots; gives the cell of a single one.
    pub(crate) fn split(&self, roots: &Roots) -> Result<Split<Roots>, Cell> {
        let Roots { corner, sides } = *roots;
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

    /// The point that a centre's units stand for, in pixels.
    pub(crate) fn center(&self, units: [u32; 2]) -> [f32; 2] {
        units.map(|unit| (unit as i32 - self.root as i32) as f32 / UNITS_PER_PIXEL as f32)
    }

    /// The units nearest to a point.
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
    /// Logarithm of the width of the cells of a fineness, in units.
    pub(super) fn cell_bits(&self, fineness: i32) -> u32 {
        let bits = UNITS_PER_PIXEL.ilog2() as i32 - fineness;
        bits.clamp(1, self.root.ilog2() as i32) as u32
    }

    /// The middle of the cell that a unit lies in.
    pub(super) fn snapped(&self, unit: u32, fineness: i32) -> u32 {
        let bits = self.cell_bits(fineness);
        (unit >> bits << bits) + (1 << bits >> 1)
    }
}

impl Cell {
    /// Halves the longer side; `None` for a pixel.
    pub(crate) fn split(&self) -> Option<Split<Self>> {
        let level = self.level.checked_sub(1)?;
        let [x, y] = self.corner;
        let axis = (self.level % 2) as usize;
        let half = 1 << (self.side(axis) - 1);
        // Which axis it is is as good as random, so there is no branch to be foreseen.
        let (right, down) = if axis == 0 { (half, 0) } else { (0, half) };
        let corner = [x + right, y + down];
        let parts = [self.corner, corner].map(|corner| Self { corner, level });
        Some(Split { axis, middle: corner[axis], parts })
    }

    /// Logarithm to base 2 of a side in units.
    fn side(&self, axis: usize) -> u32 {
        (self.level + axis as u32) / 2 + UNITS_PER_PIXEL.ilog2()
    }

    /// How many bits a position within the cell takes along each axis.
    pub(crate) fn bits(&self, fineness: [i32; 2]) -> [u32; 2] {
        core::array::from_fn(|axis| {
            let pixels = self.side(axis) as i32 - UNITS_PER_PIXEL.ilog2() as i32;
            (pixels + fineness[axis]).max(0) as u32
        })
    }

    /// Which of 2^bits parts a unit lies in, along an axis.
    pub(crate) fn part(&self, axis: usize, bits: u32, unit: u32) -> u32 {
        unit.wrapping_sub(self.corner[axis]) >> (self.side(axis) - bits)
    }

    /// The middle of one of 2^bits parts along an axis.
    pub(crate) fn middle(&self, axis: usize, bits: u32, part: u32) -> u32 {
        let shift = self.side(axis) - bits;
        self.corner[axis] + (part << shift) + (1 << shift >> 1)
    }
}
