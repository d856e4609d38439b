//! The attributes of a Gaussian: all that is coded of it but its position (spec, section 7.4).
//!
//! As everywhere in this coding, the same functions encode and decode. Only an encoder uses the
//! codes that are `known`.

use super::contexts::{self, EXPONENTS, MAGNITUDES, RATIOS, SHAPE_EXPONENTS};
use super::numbers::{ESCAPE, excess, plain, signed};
use super::quantization::{Code, MAX_EXPONENT, Quantization, step_scale};
use super::rans::{Attribute, SymbolCoder};

/// The last step exponent whose colours are coded without plain bits.
const COLOR_EXPONENT: u32 = 3;
/// The expected logarithm of a Gaussian's size, from the level of its cell: in a cell of one pixel,
/// and what each doubling of the cell's area adds.
const EXPECTED_SIZE: [f32; 2] = [0.1, 0.19];

/// Codes the attributes of a Gaussian in a cell of a level. The centre is returned as it is known.
#[inline(always)]
pub(super) fn attributes(
    coder: &mut impl SymbolCoder,
    quantization: &Quantization,
    channels: usize,
    level: u32,
    known: Code,
) -> Code {
    let exponent = precision(coder, known.exponent);
    coder.begin(Attribute::Color);
    let color = color(coder, channels, exponent as usize, known.color);
    coder.begin(Attribute::Shape);
    let [size, ratio, slant] =
        shape(coder, quantization, level, exponent, [known.size, known.ratio, known.slant]);
    Code { exponent, color, size, ratio, slant, center: known.center }
}

/// Codes the step exponent.
#[inline(always)]
pub(super) fn precision(coder: &mut impl SymbolCoder, known: u32) -> u32 {
    coder.begin(Attribute::Precision);
    let exponent = coder.symbol(contexts::EXPONENT, known);
    if exponent > MAX_EXPONENT {
        coder.refuse();
        return MAX_EXPONENT;
    }
    exponent
}

/// Codes size, ratio and slant for a step exponent.
#[inline(always)]
pub(super) fn shape(
    coder: &mut impl SymbolCoder,
    quantization: &Quantization,
    level: u32,
    exponent: u32,
    [size, ratio, slant]: [i32; 3],
) -> [i32; 3] {
    let shift = exponent.saturating_sub(SHAPE_EXPONENTS as u32 - 1);
    let rank = (exponent as usize).min(SHAPE_EXPONENTS - 1);
    let step = quantization.size.step() * step_scale(exponent);
    let expected = EXPECTED_SIZE[0] + EXPECTED_SIZE[1] * level as f32;
    let expected = (expected / step) as i32;
    let size = size.wrapping_sub(expected);
    let size = signed(coder, contexts::SIZE + rank, shift, size).wrapping_add(expected);
    let ratio = signed(coder, contexts::RATIO + rank, shift, ratio);
    // In steps of exponent 2, whatever it is.
    let coarse = if exponent < 2 { ratio << (2 - exponent) } else { ratio >> shift };
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
    exponent: usize,
    known: [i32; 4],
) -> [i32; 4] {
    let shift = (exponent as u32).saturating_sub(COLOR_EXPONENT);
    let mut color = [0; 4];
    let first = known[0].unsigned_abs();
    let symbol = coder.symbol(contexts::FIRST_AXIS + exponent, (first >> shift).min(ESCAPE));
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
        let context =
            contexts::OTHER_AXES + ((axis - 1) * EXPONENTS + exponent) * MAGNITUDES + range;
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
