//! The steps of the quantization grid as a file has them: the upper bits of a binary32 (spec, section 5.3).

#[cfg(feature = "encode")]
use alloc::vec::Vec;

use crate::container::fields::Fields;
use crate::error::DecodeError;

/// Steps of position, size, ratio and slant.
pub(crate) type Geometry = [f32; 4];

// Constants: docs/tuning.md, "Rate model".
/// The steps of geometry that a file has if it does not say others. The quantization of each adds as much distortion
/// as that of a step of colour, for a Gaussian of norm 1: from integrals of the quartic kernel's derivatives. They are
/// the roots of 1.2, 0.6, 0.75 and 3.
pub(crate) const USUAL_GEOMETRY: Geometry = [1.095_445_1, 0.774_596_7, 0.866_025_4, 1.732_050_8];

/// The bits of the least step, 2^-20, and how far the bits of a step's number are shifted: its 16 bits are the lower
/// five of the exponent, and the upper eleven of the mantissa.
const LEAST_STEP: u32 = 0x3580_0000;
const STEP_SHIFT: u32 = 12;
/// The number of the largest step, 2^10.
const MOST_STEP: u16 = 0xF000;
/// The bits of the least ratio of two steps, 2^-8, and how far the bits of its number are shifted: it has four bits
/// of exponent, and four of the mantissa.
const LEAST_RATIO: u32 = 0x3B80_0000;
const RATIO_SHIFT: u32 = 19;

/// The step with this number.
fn step(number: u16) -> f32 {
    f32::from_bits(LEAST_STEP + (u32::from(number) << STEP_SHIFT))
}

/// The ratio with this number.
fn ratio(number: u8) -> f32 {
    f32::from_bits(LEAST_RATIO + (u32::from(number) << RATIO_SHIFT))
}

/// Reads a step.
pub(crate) fn read(fields: &mut Fields<'_>) -> Result<f32, DecodeError> {
    match fields.u16()? {
        number if number <= MOST_STEP => Ok(step(number)),
        number => Err(fields.unsupported("step", number.into())),
    }
}

/// Reads a step that is told by its ratio to another one.
pub(super) fn read_related(fields: &mut Fields<'_>, other: f32) -> Result<f32, DecodeError> {
    let related = other * ratio(fields.u8()?);
    if !(step(0)..=step(MOST_STEP)).contains(&related) {
        return Err(fields.malformed("a step that is not within 2^-20 to 2^10"));
    }
    Ok(related)
}

/// The number whose value is nearest to that of a positive number, by its bits.
#[cfg(feature = "encode")]
fn nearest(value: f32, least: u32, shift: u32, most: u32) -> u32 {
    let bits = value.to_bits() + (1 << (shift - 1));
    (bits.saturating_sub(least) >> shift).min(most)
}

/// The number of the step nearest to one.
#[cfg(feature = "encode")]
fn number(value: f32) -> u16 {
    nearest(value, LEAST_STEP, STEP_SHIFT, MOST_STEP.into()) as u16
}

/// The number of the ratio nearest to one.
#[cfg(feature = "encode")]
fn number_of_ratio(value: f32) -> u8 {
    nearest(value, LEAST_RATIO, RATIO_SHIFT, u8::MAX.into()) as u8
}

/// The nearest step that a file can have.
#[cfg(feature = "encode")]
pub(crate) fn rounded(value: f32) -> f32 {
    step(number(value))
}

/// Whether a file can have a step.
#[cfg(feature = "encode")]
pub(super) fn is_step(value: f32) -> bool {
    (step(0)..=step(MOST_STEP)).contains(&value) && rounded(value) == value
}

/// Whether a file can have a step beside another one, which it can have.
#[cfg(feature = "encode")]
pub(super) fn is_related(value: f32, other: f32) -> bool {
    (step(0)..=step(MOST_STEP)).contains(&value) && other * rounded_ratio(value / other) == value
}

/// The nearest ratio of two steps that a file can have.
#[cfg(feature = "encode")]
pub(crate) fn rounded_ratio(value: f32) -> f32 {
    ratio(number_of_ratio(value))
}

/// Bytes of the steps of so many colour axes, where those of geometry are the usual ones.
#[cfg(feature = "encode")]
pub(crate) const fn usual_length(channels: usize) -> usize {
    size_of::<u16>() + channels - 1
}

/// Appends a step that a file can have.
#[cfg(feature = "encode")]
pub(crate) fn write(step: f32, out: &mut Vec<u8>) {
    debug_assert_eq!(step, rounded(step));
    out.extend(number(step).to_le_bytes());
}

/// Appends the ratio of a step to another one, where a file can have both.
#[cfg(feature = "encode")]
pub(super) fn write_related(step: f32, other: f32, out: &mut Vec<u8>) {
    debug_assert_eq!(step, other * rounded_ratio(step / other));
    out.push(number_of_ratio(step / other));
}
