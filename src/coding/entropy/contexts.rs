//! The numbers of the contexts, which are the numbers of their models: for each kind of symbol that
//! of its first context. The contexts of a kind follow each other (spec, section 7.4).

use super::quantization::MAX_EXPONENT;
use super::symbol::SYMBOLS;

/// Step exponents.
pub(super) const EXPONENTS: usize = MAX_EXPONENT as usize + 1;
/// Ranges of a magnitude: 0, 1, 2 to 3, 4 to 7, and more.
pub(super) const MAGNITUDES: usize = 5;
/// Step exponents with contexts of their own for the shape. Larger exponents share those of the
/// last, and add plain bits.
pub(super) const SHAPE_EXPONENTS: usize = 3;
/// Ranges of a ratio.
pub(super) const RATIOS: usize = 7;
/// Cells of fewer Gaussians than this have a context for each number of them.
pub(super) const SMALL_COUNT: usize = SYMBOLS;

/// The step exponent.
pub(super) const EXPONENT: usize = 0;
/// The magnitude of the first colour axis, by step exponent.
pub(super) const FIRST_AXIS: usize = EXPONENT + 1;
/// The other colour axes, by axis, step exponent and range of the magnitude of the axis before.
pub(super) const OTHER_AXES: usize = FIRST_AXIS + EXPONENTS;
/// The size, by step exponent.
pub(super) const SIZE: usize = OTHER_AXES + 3 * EXPONENTS * MAGNITUDES;
/// The ratio, by step exponent.
pub(super) const RATIO: usize = SIZE + SHAPE_EXPONENTS;
/// The slant, by step exponent and range of the ratio.
pub(super) const SLANT: usize = RATIO + SHAPE_EXPONENTS;
/// The number of plain bits of an excess.
pub(super) const EXCESS: usize = SLANT + SHAPE_EXPONENTS * RATIOS;
/// How many of a cell's few Gaussians lie in its first part, by the number of Gaussians.
pub(super) const SMALL_SPLIT: usize = EXCESS + 1;
/// The same for many Gaussians: in which 16th of the possible numbers it is, by log2 of the number
/// of Gaussians.
pub(super) const LARGE_SPLIT: usize = SMALL_SPLIT + SMALL_COUNT;
/// The number of contexts.
pub(super) const COUNT: usize = LARGE_SPLIT + 32;
