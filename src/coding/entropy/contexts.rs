//! The contexts of symbols: the first of each kind. Contexts of a kind follow each other (spec,
//! section 7.4).

use super::lattice::MAX_CLASS;
use super::symbol::SYMBOLS;

/// Classes of precision.
pub(super) const CLASSES: usize = MAX_CLASS as usize + 1;
/// Kinds of magnitudes that contexts tell apart.
pub(super) const MAGNITUDES: usize = 5;
/// Geometry is modelled as precisely as class 2 has it; finer classes add plain bits.
pub(super) const LEVELS: usize = 3;
/// Kinds of ratios that contexts tell apart.
pub(super) const RATIOS: usize = 7;
/// Counts below this are coded as they are.
pub(super) const FEW_COUNT: usize = SYMBOLS;

/// Class of precision.
pub(super) const CLASS: usize = 0;
/// Magnitude of the first colour axis, by class.
pub(super) const FIRST_AXIS: usize = CLASS + 1;
/// The other colour axes, by axis, class and magnitude of the axis before.
pub(super) const OTHER_AXES: usize = FIRST_AXIS + CLASSES;
/// Size, ratio and slant, by level of precision; slant by ratio as well.
pub(super) const SIZE: usize = OTHER_AXES + 3 * CLASSES * MAGNITUDES;
pub(super) const RATIO: usize = SIZE + LEVELS;
pub(super) const SLANT: usize = RATIO + LEVELS;
/// Length of what exceeds the symbols.
pub(super) const EXCESS: usize = SLANT + LEVELS * RATIOS;
/// How many of a few Gaussians are in the first part of a cell, by their number.
pub(super) const FEW: usize = EXCESS + 1;
/// Which share of many, by the logarithm of their number.
pub(super) const MANY: usize = FEW + FEW_COUNT;
/// All contexts.
pub(super) const COUNT: usize = MANY + 32;
