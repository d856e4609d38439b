//! The quantization grid: the Gaussians that entropy-coded files can store, from integer codes to values and
//! back (spec, section 7.5). The step exponent of a Gaussian scales the steps of its geometry.

use alloc::vec;
use alloc::vec::Vec;

use super::cells::CenterGrid;
use super::steps;
use crate::color::ColorModel;
use crate::container::fields::Fields;
use crate::error::DecodeError;
use crate::gaussian::Gaussian;
use crate::math;
use crate::simd::Backend;

/// Largest step exponent.
pub(crate) const MAX_EXPONENT: u32 = 7;
/// The largest code that the encoder rounds to.
#[cfg(feature = "encode")]
pub(crate) const MOST_CODE: f32 = 30_000.0;
/// Most fraction bits of a position: the least position interval is 2^-6 pixels.
const MAX_FRACTION_BITS: i32 = 6;
/// The logarithms of size and ratio are clamped to this magnitude, so that their exponentials stay
/// finite.
const MAX_LOGARITHM: f32 = 20.0;
/// The red, green and blue of one unit along each of the three colour axes: lightness, red against
/// blue, and green against both. Orthonormal, so that an error has the same size in axes and
/// channels.
const AXES: [[f32; 3]; 3] = [
    [0.577_350_26, 0.577_350_26, 0.577_350_26],
    [0.707_106_77, 0.0, -0.707_106_77],
    [0.408_248_3, -0.816_496_6, 0.408_248_3],
];

/// The integer codes of a Gaussian, in steps of the [`Quantization`].
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub(crate) struct Code {
    /// Step exponent n, 0 to [`MAX_EXPONENT`]: steps of geometry are 2^-n of those of the file.
    pub(crate) exponent: u32,
    /// Amplitudes along the colour axes, times the geometric mean of l11 and l22.
    pub(crate) color: [i32; 4],
    /// Logarithm of the geometric mean of l11 and l22.
    pub(crate) size: i32,
    /// Half of the logarithm of l11 / l22.
    pub(crate) ratio: i32,
    /// l21 / l22.
    pub(crate) slant: i32,
    /// Coordinates of the centre, in units of the [`CenterGrid`].
    pub(crate) center: [u32; 2],
}

/// The shape of a Gaussian, in pixels.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Shape {
    /// Geometric mean of l11 and l22.
    pub(crate) size: f32,
    /// (l11, l21, l22).
    pub(crate) cholesky: [f32; 3],
}

/// Exponentials of codes times steps, with a table of those that are likely.
#[derive(Clone, Debug, PartialEq)]
pub(crate) struct ExpTable {
    /// The step of exponent 0.
    step: f32,
    /// The table, exponent by exponent. It is worth it: decoding waits for the shape of each
    /// Gaussian before it reads on.
    likely: Vec<f32>,
}

impl ExpTable {
    /// How many codes of exponent 0 are in the table: half of them negative. Every exponent has
    /// twice as many as the one before.
    const LIKELY: u32 = 16;
    /// Step exponents in the table.
    const EXPONENTS: u32 = 6;

    fn new(step: f32) -> Self {
        let mut likely = vec![0.0; (Self::LIKELY as usize) * ((1 << Self::EXPONENTS) - 1)];
        Backend::fastest().run(
            #[inline(always)]
            || {
                let mut rest = likely.as_mut_slice();
                for exponent in 0..Self::EXPONENTS {
                    let (count, step) = (Self::LIKELY << exponent, step * step_scale(exponent));
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

    /// The step of exponent 0.
    pub(crate) fn step(&self) -> f32 {
        self.step
    }

    /// The exponential of a code with a step exponent.
    fn of(&self, code: i32, exponent: u32) -> f32 {
        let count = Self::LIKELY << exponent;
        let index = code.wrapping_add(count as i32 / 2) as u32;
        if exponent < Self::EXPONENTS && index < count {
            return self.likely[(count - Self::LIKELY + index) as usize];
        }
        Self::exp(code, self.step * step_scale(exponent))
    }
}

/// The quantizer steps of a file with [`Coding::Entropy`](crate::Coding), each from 2^-20 to 2^10
/// (spec, section 7.5).
///
/// Each Gaussian has a step exponent n, 0 to 7. The steps of position, size, ratio and slant are
/// those of exponent 0; for the others they are multiplied by 2^-n.
#[derive(Clone, Debug, PartialEq)]
#[non_exhaustive]
pub struct QuantizationSteps {
    /// Of the centre, along x in units of l11 and along y in units of l22. The intervals in pixels
    /// are then rounded to powers of two.
    pub position: f32,
    /// Of the natural logarithm of the geometric mean of l11 and l22, in pixels.
    pub size: f32,
    /// Of half of the natural logarithm of l11 / l22.
    pub ratio: f32,
    /// Of l21 / l22.
    pub slant: f32,
    /// Of the amplitude (1.0 is a full sample) times the geometric mean of l11 and l22 in pixels:
    /// one for each colour axis, which are as many as channels.
    pub color: Vec<f32>,
}

/// The quantization grid of a file: the [`QuantizationSteps`], with tables of exponentials.
#[derive(Clone, Debug, PartialEq)]
pub(crate) struct Quantization {
    pub(crate) position: f32,
    pub(crate) size: ExpTable,
    pub(crate) ratio: ExpTable,
    pub(crate) slant: f32,
    pub(crate) color: Vec<f32>,
}

impl Quantization {
    /// The quantization grid with these steps: of position, size, ratio and slant, and of each colour axis.
    pub(crate) fn new([position, size, ratio, slant]: steps::Geometry, color: Vec<f32>) -> Self {
        let [size, ratio] = [size, ratio].map(ExpTable::new);
        Self { position, size, ratio, slant, color }
    }

    /// Reads what the header says of steps: that of the first colour axis, those of the others in relation to it,
    /// and, if they are not the usual ones, those of geometry (spec, section 5.3).
    pub(crate) fn parse(
        fields: &mut Fields<'_>,
        channels: usize,
        has_geometry: bool,
    ) -> Result<Self, DecodeError> {
        let mut color = vec![steps::read(fields)?];
        for _ in 1..channels {
            color.push(steps::read_related(fields, color[0])?);
        }
        let mut geometry = steps::USUAL_GEOMETRY;
        if has_geometry {
            for step in &mut geometry {
                *step = steps::read(fields)?;
            }
        }
        Ok(Self::new(geometry, color))
    }

    /// The quantization grid with these steps; `None` if a file of so many channels cannot have them.
    #[cfg(feature = "encode")]
    pub(crate) fn of_steps(steps: &QuantizationSteps, channels: usize) -> Option<Self> {
        let QuantizationSteps { position, size, ratio, slant, ref color } = *steps;
        let geometry = [position, size, ratio, slant];
        let first = *color.first()?;
        let can_be_stored = steps::is_step(first)
            && color.len() == channels
            && color.iter().all(|&step| steps::is_related(step, first))
            && (geometry == steps::USUAL_GEOMETRY || geometry.into_iter().all(steps::is_step));
        can_be_stored.then(|| Self::new(geometry, color.clone()))
    }

    /// The steps.
    pub(crate) fn steps(&self) -> QuantizationSteps {
        let [position, size, ratio, slant] = self.geometry();
        QuantizationSteps { position, size, ratio, slant, color: self.color.clone() }
    }

    fn geometry(&self) -> steps::Geometry {
        [self.position, self.size.step, self.ratio.step, self.slant]
    }

    /// Whether the steps of geometry are the usual ones.
    #[cfg(feature = "encode")]
    pub(crate) fn has_usual_geometry(&self) -> bool {
        self.geometry() == steps::USUAL_GEOMETRY
    }

    /// Appends what the header says of the steps, which must be such that it can: see [`steps`].
    #[cfg(feature = "encode")]
    pub(crate) fn write(&self, out: &mut Vec<u8>) {
        let (first, others) = self.color.split_first().expect("a channel at least");
        steps::write(*first, out);
        others.iter().for_each(|step| steps::write_related(*step, *first, out));
        if !self.has_usual_geometry() {
            self.geometry().iter().for_each(|step| steps::write(*step, out));
        }
    }

    /// The shape of a Gaussian with this code.
    #[inline]
    pub(crate) fn shape(&self, code: &Code) -> Shape {
        let size = self.size.of(code.size, code.exponent);
        let ratio = self.ratio.of(code.ratio, code.exponent);
        let (l11, l22) = (size * ratio, size / ratio);
        let l21 = code.slant as f32 * (self.slant * step_scale(code.exponent)) * l22;
        Shape { size, cholesky: [l11, l21, l22] }
    }

    /// The fraction bits f of the coordinates along x and y: the position interval is 2^-f pixels,
    /// more than a pixel if f is negative.
    pub(crate) fn fraction_bits(&self, exponent: u32, shape: &Shape) -> [i32; 2] {
        let [l11, _, l22] = shape.cholesky;
        [l11, l22].map(|extent| {
            // With the factor sqrt(2), the exponent is that of the nearest power of two.
            let step = self.position * step_scale(exponent) * extent * core::f32::consts::SQRT_2;
            let exponent = (step.to_bits() >> 23) as i32 - 127;
            (-exponent).min(MAX_FRACTION_BITS)
        })
    }

    /// The Gaussian with this code, whose shape was computed before.
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
    /// How much the Gaussian adds to the picture: the sum of the squares of its colour codes. Their
    /// steps are relative to the Gaussian's size, so this follows its energy.
    pub(crate) fn energy(&self) -> i64 {
        self.color.iter().map(|&code| i64::from(code) * i64::from(code)).sum()
    }
}

#[cfg(feature = "encode")]
impl Quantization {
    /// The code with a step exponent that is nearest to a Gaussian, or of a lower exponent if the slant is so
    /// large that it has no code in this one.
    ///
    /// Where possible, a component compensates for the rounding errors of those before it: what
    /// matters is the covariance and the centre, not each component by itself.
    pub(crate) fn code(
        &self,
        gaussian: &Gaussian,
        exponent: u32,
        grid: &CenterGrid,
        model: ColorModel,
    ) -> Code {
        let scale = step_scale(exponent);
        let nearest = |value: f32, step: f32| (value / step).round().clamp(-MOST_CODE, MOST_CODE);
        let [l11, l21, l22] = gaussian.cholesky;
        let size = nearest(0.5 * (l11 * l22).ln(), self.size.step * scale) as i32;
        let ratio = nearest(0.5 * (l11 / l22).ln(), self.ratio.step * scale) as i32;
        let mut code = Code { exponent, size, ratio, ..Code::default() };
        // With L (I + D) for the rounded Cholesky factor, this slant makes D21 zero.
        let Shape { size, cholesky: [c11, _, c22] } = self.shape(&code);
        let slant = l21 / l22 * (1.0 + (c11 / l11).ln() - (c22 / l22).ln());
        if exponent > 0 && slant.abs() > MOST_CODE * self.slant * scale {
            return self.code(gaussian, exponent - 1, grid, model);
        }
        code.slant = nearest(slant, self.slant * scale) as i32;
        code.center = self.placed(&code, gaussian.center, grid);
        let axes = to_axes(gaussian.color, model);
        for ((code, axis), step) in code.color.iter_mut().zip(axes).zip(&self.color) {
            *code = nearest(axis * size, *step) as i32;
        }
        code
    }

    /// The code that stands for exactly this Gaussian, if there is one. Its centre may lie between the position
    /// intervals: files have it in the middle of a cell that is smaller than these.
    pub(crate) fn exact_code(
        &self,
        gaussian: &Gaussian,
        grid: &CenterGrid,
        model: ColorModel,
    ) -> Option<Code> {
        let codes = (0..=MAX_EXPONENT).map(|exponent| self.code(gaussian, exponent, grid, model));
        let center = grid.units(gaussian.center);
        // With a higher exponent than its own, an interval would be smaller than the cell; with a lower one, an axis whose
        // interval is not the larger of both would be rounded to it.
        let in_small_cell = codes.clone().rev().map(|code| Code { center, ..code });
        let in_small_cell = in_small_cell.filter(|code| {
            let fraction_bits = self.fraction_bits(code.exponent, &self.shape(code));
            let is_smaller = |axis: usize| {
                center[axis].trailing_zeros() < grid.interval_bits(fraction_bits[axis])
            };
            (0..2).all(is_smaller)
        });
        let is_it = |code: &Code| self.gaussian(code, &self.shape(code), grid, model) == *gaussian;
        codes.chain(in_small_cell).find(is_it)
    }

    /// The coordinates, in units and with the precision of a code, that are nearest to a centre in
    /// pixels. The rounding error along x moves y along the Gaussian's slant.
    pub(crate) fn placed(&self, code: &Code, [x, y]: [f32; 2], grid: &CenterGrid) -> [u32; 2] {
        let shape = self.shape(code);
        let [l11, l21, _] = shape.cholesky;
        let fraction_bits = self.fraction_bits(code.exponent, &shape);
        let column = grid.snapped(grid.units([x, y])[0], fraction_bits[0]);
        let error = grid.center([column, 0])[0] - x;
        let row = grid.snapped(grid.units([x, y + l21 / l11 * error])[1], fraction_bits[1]);
        [column, row]
    }

    /// The logarithms of size and ratio that a code stands for, and the slant.
    pub(crate) fn shape_values(&self, code: &Code) -> [f32; 3] {
        let scale = step_scale(code.exponent);
        [
            code.size as f32 * (self.size.step * scale),
            code.ratio as f32 * (self.ratio.step * scale),
            code.slant as f32 * (self.slant * scale),
        ]
    }

    /// The amplitude along each colour axis of one step, for the size that a code has.
    pub(crate) fn color_units(&self, code: &Code) -> [f32; 4] {
        let Shape { size, .. } = self.shape(code);
        let mut units = [0.0; 4];
        for (unit, step) in units.iter_mut().zip(&self.color) {
            *unit = step / size;
        }
        units
    }

    /// A code whose centre is moved by one position interval along an axis; `None` at the edge of
    /// the grid.
    pub(crate) fn moved(
        &self,
        code: &Code,
        axis: usize,
        forward: bool,
        grid: &CenterGrid,
    ) -> Option<Code> {
        let fraction_bits = self.fraction_bits(code.exponent, &self.shape(code))[axis];
        let step = 1 << grid.interval_bits(fraction_bits);
        let center = code.center[axis];
        let center = if forward { center.checked_add(step)? } else { center.checked_sub(step)? };
        let mut code = *code;
        code.center[axis] = center;
        (center < grid.whole().sides[axis]).then_some(code)
    }
}

/// The Gaussians of an entropy-coded file, as codes.
#[cfg(feature = "encode")]
#[derive(Clone, Debug)]
pub(crate) struct QuantizedCodes {
    pub(crate) quantization: Quantization,
    pub(crate) codes: Vec<Code>,
}

/// What the steps of a step exponent are multiplied by: 2^-nxponent.
pub(super) fn step_scale(exponent: u32) -> f32 {
    f32::from_bits((127 - exponent) << 23)
}

/// Channels from colour axes. Gray and alpha are axes of their own.
fn from_axes(axes: [f32; 4], model: ColorModel) -> [f32; 4] {
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

    #[cfg(feature = "encode")]
    #[test]
    fn a_steep_gaussian_keeps_its_direction() {
        let quantization = Quantization::new([1.1, 0.8, 0.9, 1.7], vec![0.01]);
        let grid = CenterGrid::new(400, 300);
        for slant in [1.0_f32, 300.0, -470.0, 3000.0] {
            let cholesky = [0.57 * slant.abs(), 0.57 * slant, 0.57];
            let gaussian =
                Gaussian { center: [113.9, 41.9], cholesky, color: [1.9, 0.0, 0.0, 0.0] };
            let code = quantization.code(&gaussian, MAX_EXPONENT, &grid, ColorModel::Gray);
            let [l11, l21, _] = quantization.shape(&code).cholesky;
            assert!((l21 / l11 - slant.signum()).abs() < 0.01, "{slant}: {code:?}");
        }
    }

    #[test]
    fn the_table_has_the_values_that_are_computed_without_it() {
        for step in [0.9, 0.013, 700.0] {
            let exponentials = ExpTable::new(step);
            for exponent in 0..=MAX_EXPONENT {
                let step = step * step_scale(exponent);
                for code in (-1000..1000).chain([i32::MIN, i32::MAX]) {
                    let found = exponentials.of(code, exponent);
                    let computed = ExpTable::exp(code, step);
                    assert_eq!(found.to_bits(), computed.to_bits(), "{step} {exponent} {code}");
                }
            }
        }
    }
}
