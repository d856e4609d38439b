//! LSQ+ quantizers: `value = code * scale + offset`, or the exponential of that (spec, section 6;
//! paper, section "Compression Framework").

#[cfg(feature = "encode")]
use alloc::vec::Vec;

use crate::container::fields::Fields;
use crate::error::DecodeError;
use crate::math;

/// Largest magnitude of a scale and of an offset.
pub(crate) const MAX_PARAMETER: f32 = 4_294_967_296.0;

/// How a file with [`Coding::Packed`](crate::Coding) stores one component of its Gaussians (spec,
/// section 6). Codes are unsigned integers.
#[derive(Clone, Copy, Debug, PartialEq)]
#[non_exhaustive]
pub enum Quantizer {
    /// The value itself: the code has the 32 bits of an IEEE 754 binary32.
    Float,
    /// `value = code * scale + offset`.
    Linear(UniformQuantizer),
    /// `value = exp(code * scale + offset)`: for positive components of widely different sizes.
    Log(UniformQuantizer),
}

/// A uniform quantizer: the scale and offset that LSQ+ learns, and a bit depth. `value = code *
/// scale + offset`, in units of the component or of its logarithm.
#[derive(Clone, Copy, Debug, PartialEq)]
#[non_exhaustive]
pub struct UniformQuantizer {
    /// Bit depth, 1 to 16: codes are 0 to 2^bits - 1.
    pub bits: u8,
    /// Difference of the values of neighbouring codes; positive, at most 2^32.
    pub scale: f32,
    /// Value of code 0; from -2^32 to 2^32.
    pub offset: f32,
}

impl UniformQuantizer {
    /// A uniform quantizer of a bit depth, with the difference of the values of neighbouring codes, and the
    /// value of code 0. What is out of range is refused where it is used.
    #[must_use]
    pub const fn new(bits: u8, scale: f32, offset: f32) -> Self {
        Self { bits, scale, offset }
    }

    /// The largest code, 2^bits - 1.
    #[must_use]
    pub const fn max_code(&self) -> u32 {
        (1 << self.bits) - 1
    }

    /// The value of a code.
    pub(crate) fn value(&self, code: u32) -> f32 {
        // Codes have at most 16 bits, so the conversion is exact.
        code as f32 * self.scale + self.offset
    }

    /// The code whose value is nearest to `value`; of two, the even one.
    #[cfg(feature = "encode")]
    pub(crate) fn code(&self, value: f32) -> u32 {
        ((value - self.offset) / self.scale).clamp(0.0, self.max_code() as f32).round_ties_even()
            as u32
    }
}

impl Quantizer {
    /// Bits of one code in the file: 1 to 16, or 32 for [`Quantizer::Float`].
    #[must_use]
    pub const fn bits(&self) -> u8 {
        match self {
            Self::Float => 32,
            Self::Linear(steps) | Self::Log(steps) => steps.bits,
        }
    }

    /// The value of a code. Always finite, except that a `Float` may be infinite or NaN.
    pub(crate) fn value(&self, code: u32) -> f32 {
        match self {
            Self::Float => f32::from_bits(code),
            Self::Linear(steps) => steps.value(code),
            Self::Log(steps) => math::exp(steps.value(code)),
        }
    }

    /// The code whose value is nearest to `value`, which is positive for a logarithm.
    #[cfg(feature = "encode")]
    pub(crate) fn code(&self, value: f32) -> u32 {
        match self {
            Self::Float => value.to_bits(),
            Self::Linear(steps) => steps.code(value),
            Self::Log(steps) => steps.code(value.ln()),
        }
    }

    /// Whether a file can have it.
    #[cfg(feature = "encode")]
    pub(crate) fn is_valid(&self) -> bool {
        match self {
            Self::Float => true,
            Self::Linear(UniformQuantizer { bits, scale, offset })
            | Self::Log(UniformQuantizer { bits, scale, offset }) => {
                (1..=16).contains(bits)
                    && *scale > 0.0
                    && *scale <= MAX_PARAMETER
                    && offset.abs() <= MAX_PARAMETER
            }
        }
    }

    /// Reads an entry of the header (spec, section 6).
    pub(crate) fn parse(fields: &mut Fields<'_>) -> Result<Self, DecodeError> {
        let kind = fields.u8()?;
        if kind > 2 {
            return Err(fields.unsupported("quantizer", kind.into()));
        }
        let bits = fields.u8()?;
        match (kind, bits) {
            (_, 0) => return Err(fields.malformed("a bit depth of 0")),
            (0, 32) => return Ok(Self::Float),
            (1 | 2, 1..=16) => {}
            _ => return Err(fields.unsupported("bit depth", bits.into())),
        }
        let scale = fields.f32()?;
        if !(scale > 0.0 && scale <= MAX_PARAMETER) {
            return Err(fields.malformed("a scale that is not positive and at most 2^32"));
        }
        let offset = fields.f32()?;
        if offset.is_nan() || offset.abs() > MAX_PARAMETER {
            return Err(fields.malformed("an offset that is not within +-2^32"));
        }
        let uniform = UniformQuantizer { bits, scale, offset };
        Ok(if kind == 1 { Self::Linear(uniform) } else { Self::Log(uniform) })
    }

    /// Appends the entry of the header for this quantizer.
    #[cfg(feature = "encode")]
    pub(crate) fn write(&self, out: &mut Vec<u8>) {
        let (kind, uniform) = match self {
            Self::Float => (0, None),
            Self::Linear(uniform) => (1, Some(uniform)),
            Self::Log(uniform) => (2, Some(uniform)),
        };
        out.extend([kind, self.bits()]);
        if let Some(UniformQuantizer { scale, offset, .. }) = uniform {
            out.extend([scale, offset].into_iter().flat_map(|number| number.to_le_bytes()));
        }
    }
}
