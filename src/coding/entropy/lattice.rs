//! The lattice of Gaussians that entropy-coded files can store: codes to values, with steps as fine
//! as a Gaussian is strong (spec, sections 7.4 and 7.5).

use alloc::vec;
use alloc::vec::Vec;

use byteorder::{ByteOrder, LittleEndian};

use super::cells::CenterGrid;
use crate::chunk::ChunkType;
use crate::color::ColorModel;
use crate::error::DecodeError;
use crate::gaussian::Gaussian;
use crate::math;
use crate::simd::Backend;

/// Steps of geometry: position, size, ratio, slant.
const GEOMETRY: usize = 4;
/// Largest class of precision.
pub(crate) const MAX_CLASS: u32 = 7;
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
    /// Centre in units of the [`CenterGrid`].
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

/// The steps of an entropy-coded file (spec, section 7.5): what a unit of each code stands for in
/// class 0 of precision; steps of geometry are halved from one class to the next.
#[derive(Clone, Debug, PartialEq)]
#[non_exhaustive]
pub struct LatticeSteps {
    /// Of the centre, relative to the Gaussian's own extent.
    pub position: f32,
    /// Of the logarithm of the geometric mean of l11 and l22.
    pub size: f32,
    /// Of half of the logarithm of l11 / l22.
    pub ratio: f32,
    /// Of l21 / l22.
    pub slant: f32,
    /// Of the amplitude along each colour axis, times the root of the area: one per channel.
    pub color: Vec<f32>,
}

/// The lattice of a file: its steps, ready for use.
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

    /// All steps.
    pub(crate) fn steps(&self) -> LatticeSteps {
        LatticeSteps {
            position: self.position,
            size: self.size.step,
            ratio: self.ratio.step,
            slant: self.slant,
            color: self.color.clone(),
        }
    }

    /// The payload of `QNTZ`.
    #[cfg(feature = "encode")]
    pub(crate) fn to_payload(&self) -> Vec<u8> {
        let geometry = [self.position, self.size.step, self.ratio.step, self.slant];
        geometry.iter().chain(&self.color).flat_map(|step| step.to_le_bytes()).collect()
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
        grid: &CenterGrid,
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
        grid: &CenterGrid,
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
    pub(crate) fn placed(&self, code: &Code, [x, y]: [f32; 2], grid: &CenterGrid) -> [u32; 2] {
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
        grid: &CenterGrid,
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

/// Gaussians as an entropy-coded file stores them.
#[cfg(feature = "encode")]
#[derive(Clone, Debug)]
pub(crate) struct LatticeCodes {
    pub(crate) lattice: Lattice,
    pub(crate) codes: Vec<Code>,
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
