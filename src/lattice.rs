//! The lattice of Gaussians that coding 1 can store: codes to values, with steps as fine as a
//! Gaussian is strong (spec, sections 7.4 and 7.5).

use alloc::vec;
use alloc::vec::Vec;

use byteorder::{ByteOrder, LittleEndian};

use crate::color::ColorModel;
use crate::container::ChunkType;
use crate::error::DecodeError;
use crate::gaussian::Gaussian;
use crate::math;
use crate::render::Backend;

/// Steps of geometry: position, size, ratio, slant.
const GEOMETRY: usize = 4;
/// Largest class of precision.
pub(crate) const MAX_CLASS: u32 = 7;
/// Positions are multiples of half of this many parts of a pixel.
const UNITS_PER_PIXEL: u32 = 128;
/// The finest cell of positions is 2^-6 pixel wide.
const FINEST: i32 = 6;
/// Steps lie within these.
const STEPS: core::ops::RangeInclusive<f32> = 9.536_743e-7..=1024.0;
/// Logarithms of size and of ratio are confined to this magnitude, so that their exponentials stay
/// finite.
const MAX_LOGARITHM: f32 = 20.0;
/// Red, green and blue by the three colour axes: lightness, red against blue, green against both.
/// Orthonormal, so that an error is as large in one as in the other.
const AXES: [[f32; 3]; 3] = [
    [0.577_350_26, 0.577_350_26, 0.577_350_26],
    [0.707_106_77, 0.0, -0.707_106_77],
    [0.408_248_3, -0.816_496_6, 0.408_248_3],
];

/// A Gaussian in whole steps.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub(crate) struct Code {
    /// Class of precision, up to [`MAX_CLASS`]: steps of geometry are halved so many times.
    pub(crate) class: u32,
    /// Amplitudes along the colour axes, times the root of the area.
    pub(crate) color: [i32; 4],
    /// Logarithm of the geometric mean of l11 and l22.
    pub(crate) size: i32,
    /// Half of the logarithm of l11 / l22.
    pub(crate) ratio: i32,
    /// l21 / l22.
    pub(crate) slant: i32,
    /// Centre in units of the [`Grid`].
    pub(crate) center: [u32; 2],
}

/// The shape of a Gaussian.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Shape {
    /// Geometric mean of l11 and l22.
    pub(crate) size: f32,
    pub(crate) cholesky: [f32; 3],
}

/// The exponentials of whole steps.
#[derive(Clone, Debug, PartialEq)]
pub(crate) struct Exponentials {
    step: f32,
    /// Those of the codes that are likely, class by class: the coder waits for them.
    likely: Vec<f32>,
}

impl Exponentials {
    /// Codes of class 0 in the table: from minus half of that on. Every class has twice as many.
    const LIKELY: u32 = 16;
    /// Classes in the table.
    const CLASSES: u32 = 6;

    fn new(step: f32) -> Self {
        let mut likely = vec![0.0; (Self::LIKELY as usize) * ((1 << Self::CLASSES) - 1)];
        Backend::fastest().run(
            #[inline(always)]
            || {
                let mut rest = likely.as_mut_slice();
                for class in 0..Self::CLASSES {
                    let (count, step) = (Self::LIKELY << class, step * fineness(class));
                    let (values, later) = rest.split_at_mut(count as usize);
                    rest = later;
                    let first = -(count as i32 / 2);
                    for (code, value) in (first..).zip(values) {
                        *value = Self::exp(code, step);
                    }
                }
            },
        );
        Self { step, likely }
    }

    #[inline(always)]
    fn exp(code: i32, step: f32) -> f32 {
        math::exp((code as f32 * step).clamp(-MAX_LOGARITHM, MAX_LOGARITHM))
    }

    /// The step of class 0.
    pub(crate) fn step(&self) -> f32 {
        self.step
    }

    fn of(&self, code: i32, class: u32) -> f32 {
        let count = Self::LIKELY << class;
        let index = code.wrapping_add(count as i32 / 2) as u32;
        if class < Self::CLASSES && index < count {
            return self.likely[(count - Self::LIKELY + index) as usize];
        }
        Self::exp(code, self.step * fineness(class))
    }
}

/// The steps of a file.
#[derive(Clone, Debug, PartialEq)]
pub(crate) struct Lattice {
    /// Of the position, relative to the Gaussian's own extent.
    pub(crate) position: f32,
    pub(crate) size: Exponentials,
    pub(crate) ratio: Exponentials,
    pub(crate) slant: f32,
    /// Of each colour axis.
    pub(crate) color: Vec<f32>,
}

impl Lattice {
    /// With steps of position, size, ratio and slant, and one for each colour axis.
    pub(crate) fn new([position, size, ratio, slant]: [f32; GEOMETRY], color: Vec<f32>) -> Self {
        let [size, ratio] = [size, ratio].map(Exponentials::new);
        Self { position, size, ratio, slant, color }
    }

    /// Reads the payload of `QNTZ`: four steps of geometry, then one per channel.
    pub(crate) fn parse(payload: &[u8], channels: usize) -> Result<Self, DecodeError> {
        let malformed = |reason| DecodeError::malformed(ChunkType::QNTZ, reason);
        if payload.len() != (GEOMETRY + channels) * size_of::<f32>() {
            return Err(malformed("the length is not four bytes per step"));
        }
        let steps: Vec<f32> = payload.chunks_exact(4).map(LittleEndian::read_f32).collect();
        if !steps.iter().all(|step| STEPS.contains(step)) {
            return Err(malformed("a step that is not within 2^-20 to 2^10"));
        }
        let (geometry, color) = steps.split_first_chunk().expect("four steps at least");
        Ok(Self::new(*geometry, color.to_vec()))
    }

    /// All steps: position, size, ratio, slant, colour axes.
    pub(crate) fn steps(&self) -> Vec<f32> {
        let geometry = [self.position, self.size.step, self.ratio.step, self.slant];
        geometry.iter().chain(&self.color).copied().collect()
    }

    /// The payload of `QNTZ`.
    #[cfg(feature = "encode")]
    pub(crate) fn to_payload(&self) -> Vec<u8> {
        self.steps().into_iter().flat_map(f32::to_le_bytes).collect()
    }

    /// The shape that a code stands for.
    #[inline]
    pub(crate) fn shape(&self, code: &Code) -> Shape {
        let size = self.size.of(code.size, code.class);
        let ratio = self.ratio.of(code.ratio, code.class);
        let (l11, l22) = (size * ratio, size / ratio);
        let l21 = code.slant as f32 * (self.slant * fineness(code.class)) * l22;
        Shape { size, cholesky: [l11, l21, l22] }
    }

    /// How fine the position is along x and y: cells are 2^-n pixels wide.
    pub(crate) fn fineness_of_position(&self, class: u32, shape: &Shape) -> [i32; 2] {
        let [l11, _, l22] = shape.cholesky;
        [l11, l22].map(|extent| {
            // The nearest power of two, from the exponent of the number.
            let step = self.position * fineness(class) * extent * core::f32::consts::SQRT_2;
            let exponent = (step.to_bits() >> 23) as i32 - 127;
            (-exponent).min(FINEST)
        })
    }

    /// The Gaussian that a code and its shape stand for.
    #[inline(always)]
    pub(crate) fn gaussian(
        &self,
        code: &Code,
        shape: &Shape,
        grid: &Grid,
        model: ColorModel,
    ) -> Gaussian {
        let Shape { size, cholesky } = *shape;
        let mut axes = [0.0; 4];
        for ((axis, &code), &step) in axes.iter_mut().zip(&code.color).zip(&self.color) {
            *axis = code as f32 * (step / size);
        }
        Gaussian { center: grid.center(code.center), cholesky, color: from_axes(axes, model) }
    }
}

#[cfg(feature = "encode")]
impl Code {
    /// What the Gaussian adds to the picture: the sum of its squares, in steps of colour.
    pub(crate) fn strength(&self) -> i64 {
        self.color.iter().map(|&code| i64::from(code) * i64::from(code)).sum()
    }
}

#[cfg(feature = "encode")]
impl Lattice {
    /// The code nearest to a Gaussian, with the precision of a class.
    ///
    /// Rounding errors of one component are made good by the next where they can be: what counts
    /// is the covariance and the place, not the components.
    pub(crate) fn code(
        &self,
        gaussian: &Gaussian,
        class: u32,
        grid: &Grid,
        model: ColorModel,
    ) -> Code {
        let fine = fineness(class);
        let nearest = |value: f32, step: f32| (value / step).round().clamp(-30_000.0, 30_000.0);
        let [l11, l21, l22] = gaussian.cholesky;
        let size = nearest(0.5 * (l11 * l22).ln(), self.size.step * fine) as i32;
        let ratio = nearest(0.5 * (l11 / l22).ln(), self.ratio.step * fine) as i32;
        let mut code = Code { class, size, ratio, ..Code::default() };
        // With L (1 + D) for the rounded factor, the slant is to make D21 zero.
        let Shape { size, cholesky: [c11, _, c22] } = self.shape(&code);
        let slant = l21 / l22 * (1.0 + (c11 / l11).ln() - (c22 / l22).ln());
        code.slant = nearest(slant, self.slant * fine) as i32;
        code.center = self.placed(&code, gaussian.center, grid);
        let axes = to_axes(gaussian.color, model);
        for ((code, axis), step) in code.color.iter_mut().zip(axes).zip(&self.color) {
            *code = nearest(axis * size, *step) as i32;
        }
        code
    }

    /// What stands for a point with a code's precision; an error along x is followed along the
    /// Gaussian's slant.
    pub(crate) fn placed(&self, code: &Code, [x, y]: [f32; 2], grid: &Grid) -> [u32; 2] {
        let shape = self.shape(code);
        let [l11, l21, _] = shape.cholesky;
        let fineness = self.fineness_of_position(code.class, &shape);
        let column = grid.snapped(grid.units([x, y])[0], fineness[0]);
        let error = grid.center([column, 0])[0] - x;
        let row = grid.snapped(grid.units([x, y + l21 / l11 * error])[1], fineness[1]);
        [column, row]
    }

    /// The amplitudes along the colour axes that a unit of a code stands for.
    pub(crate) fn color_units(&self, code: &Code) -> [f32; 4] {
        let Shape { size, .. } = self.shape(code);
        let mut units = [0.0; 4];
        for (unit, step) in units.iter_mut().zip(&self.color) {
            *unit = step / size;
        }
        units
    }

    /// Moves a code by one cell along an axis; `None` at the end of the grid.
    pub(crate) fn moved(
        &self,
        code: &Code,
        axis: usize,
        forward: bool,
        grid: &Grid,
    ) -> Option<Code> {
        let fineness = self.fineness_of_position(code.class, &self.shape(code))[axis];
        let step = 1 << grid.cell_bits(fineness);
        let center = code.center[axis];
        let center = if forward { center.checked_add(step)? } else { center.checked_sub(step)? };
        let mut code = *code;
        code.center[axis] = center;
        (center < grid.whole().sides[axis]).then_some(code)
    }
}

/// 2^-class.
pub(crate) fn fineness(class: u32) -> f32 {
    f32::from_bits((127 - class) << 23)
}

/// Channels from colour axes. Gray and alpha are axes of their own.
pub(crate) fn from_axes(axes: [f32; 4], model: ColorModel) -> [f32; 4] {
    match model {
        ColorModel::Gray | ColorModel::GrayAlpha => axes,
        ColorModel::Rgb | ColorModel::Rgba => {
            let channel =
                |c: usize| AXES[0][c] * axes[0] + AXES[1][c] * axes[1] + AXES[2][c] * axes[2];
            [channel(0), channel(1), channel(2), axes[3]]
        }
    }
}

/// Colour axes from channels.
#[cfg(feature = "encode")]
pub(crate) fn to_axes(color: [f32; 4], model: ColorModel) -> [f32; 4] {
    match model {
        ColorModel::Gray | ColorModel::GrayAlpha => color,
        ColorModel::Rgb | ColorModel::Rgba => {
            let axis = |a: usize| (0..3).map(|c| AXES[a][c] * color[c]).sum();
            [axis(0), axis(1), axis(2), color[3]]
        }
    }
}

/// The grid of possible centres: square roots of a power of two of pixels, one more than the
/// picture needs on every side.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Grid {
    /// Side of a root in units.
    root: u32,
    columns: u32,
    rows: u32,
}

/// Several roots, in units.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Roots {
    corner: [u32; 2],
    sides: [u32; 2],
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

impl Grid {
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
impl Grid {
    /// Logarithm of the width of the cells of a fineness, in units.
    fn cell_bits(&self, fineness: i32) -> u32 {
        let bits = UNITS_PER_PIXEL.ilog2() as i32 - fineness;
        bits.clamp(1, self.root.ilog2() as i32) as u32
    }

    /// The middle of the cell that a unit lies in.
    fn snapped(&self, unit: u32, fineness: i32) -> u32 {
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

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_table_has_what_would_be_computed() {
        for step in [0.9, 0.013, 700.0] {
            let exponentials = Exponentials::new(step);
            for class in 0..=MAX_CLASS {
                let step = step * fineness(class);
                for code in (-1000..1000).chain([i32::MIN, i32::MAX]) {
                    let found = exponentials.of(code, class);
                    let computed = Exponentials::exp(code, step);
                    assert_eq!(found.to_bits(), computed.to_bits(), "{step} {class} {code}");
                }
            }
        }
    }
}
