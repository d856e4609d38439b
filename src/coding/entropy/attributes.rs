//! The attributes of a Gaussian: all that is coded of it but its position (spec, section 7.4).
//!
//! As everywhere in this coding, the same functions encode and decode. Only an encoder uses the
//! codes that are `known`.

use super::contexts::{self, CLASSES, MAGNITUDES, RATIOS, SHAPE_CLASSES};
use super::lattice::{Code, Lattice, MAX_CLASS, class_scale};
use super::numbers::{ESCAPE, excess, plain, signed};
use super::rans::{Attribute, SymbolCoder};

/// The last precision class whose colours are coded without plain bits.
const COLOR_CLASS: u32 = 3;
/// The expected logarithm of a Gaussian's size, from the level of its cell: in a cell of one pixel,
/// and what each doubling of the cell's area adds.
const EXPECTED_SIZE: [f32; 2] = [0.1, 0.19];

/// Codes the attributes of a Gaussian in a cell of a level. The centre is returned as it is known.
#[inline(always)]
pub(super) fn attributes(
    coder: &mut impl SymbolCoder,
    lattice: &Lattice,
    channels: usize,
    level: u32,
    known: Code,
) -> Code {
    let class = precision(coder, known.class);
    coder.begin(Attribute::Color);
    let color = color(coder, channels, class as usize, known.color);
    coder.begin(Attribute::Shape);
    let [size, ratio, slant] =
        shape(coder, lattice, level, class, [known.size, known.ratio, known.slant]);
    Code { class, color, size, ratio, slant, center: known.center }
}

/// Codes the precision class.
#[inline(always)]
pub(super) fn precision(coder: &mut impl SymbolCoder, known: u32) -> u32 {
    coder.begin(Attribute::Precision);
    let class = coder.symbol(contexts::CLASS, known);
    if class > MAX_CLASS {
        coder.refuse();
        return MAX_CLASS;
    }
    class
}

/// Codes size, ratio and slant for a precision class.
#[inline(always)]
pub(super) fn shape(
    coder: &mut impl SymbolCoder,
    lattice: &Lattice,
    level: u32,
    class: u32,
    [size, ratio, slant]: [i32; 3],
) -> [i32; 3] {
    let shift = class.saturating_sub(SHAPE_CLASSES as u32 - 1);
    let rank = (class as usize).min(SHAPE_CLASSES - 1);
    let step = lattice.size.step() * class_scale(class);
    let expected = EXPECTED_SIZE[0] + EXPECTED_SIZE[1] * level as f32;
    let expected = (expected / step) as i32;
    let size = size.wrapping_sub(expected);
    let size = signed(coder, contexts::SIZE + rank, shift, size).wrapping_add(expected);
    let ratio = signed(coder, contexts::RATIO + rank, shift, ratio);
    // In steps of class 2, whatever the class.
    let coarse = if class < 2 { ratio << (2 - class) } else { ratio >> shift };
    let range = (coarse.div_euclid(3) + RATIOS as i32 / 2).clamp(0, RATIOS as i32 - 1);
    let context = contexts::SLANT + rank * RATIOS + range as usize;
    [size, ratio, signed(coder, context, shift, slant)]
}

/// Codes the amplitudes along the colour axes: the first with its sign, the others relative to that
/// sign.
#[inline(always)]
pub(super) fn color(
    coder: &mut impl SymbolCoder,
    channels: usize,
    class: usize,
    known: [i32; 4],
) -> [i32; 4] {
    let shift = (class as u32).saturating_sub(COLOR_CLASS);
    let mut color = [0; 4];
    let first = known[0].unsigned_abs();
    let symbol = coder.symbol(contexts::FIRST_AXIS + class, (first >> shift).min(ESCAPE));
    let mut high = symbol;
    if symbol == ESCAPE {
        high += excess(coder, (first >> shift).wrapping_sub(ESCAPE));
    }
    let magnitude = (high << shift | plain(coder, shift, first & ((1 << shift) - 1))) as i32;
    let negative = magnitude != 0 && coder.bits(1, u32::from(known[0] < 0)) == 1;
    let sign = if negative { -1 } else { 1 };
    color[0] = sign * magnitude;
    for axis in 1..channels {
        let range = magnitude_range(color[axis - 1]);
        let context = contexts::OTHER_AXES + ((axis - 1) * CLASSES + class) * MAGNITUDES + range;
        color[axis] = sign * signed(coder, context, shift, sign * known[axis]);
    }
    color
}

/// Which of the [`MAGNITUDES`] the magnitude of a value lies in.
fn magnitude_range(value: i32) -> usize {
    value
        .checked_abs()
        .map_or(MAGNITUDES - 1, |value| ((32 - value.leading_zeros()) as usize).min(MAGNITUDES - 1))
}
