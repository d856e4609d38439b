//! LSQ+ quantizers: `value = code * scale + offset`, or the exponential of that (spec, section 6;
//! paper, section "Compression Framework").

use alloc::vec::Vec;

use byteorder::{ByteOrder, LittleEndian};

use crate::chunk::ChunkType;
use crate::error::DecodeError;
use crate::math;

/// Bytes of one entry of the `QNTZ` chunk.
pub(crate) const ENTRY_LENGTH: usize = 12;
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

    /// Reads the payload of `QNTZ`: one entry per component (spec, section 5.3).
    pub(crate) fn parse_all(payload: &[u8], components: usize) -> Result<Vec<Self>, DecodeError> {
        if payload.len() != components * ENTRY_LENGTH {
            return Err(malformed("the length is not 12 bytes per component"));
        }
        payload.chunks_exact(ENTRY_LENGTH).map(Self::parse).collect()
    }

    fn parse(entry: &[u8]) -> Result<Self, DecodeError> {
        if entry[2..4] != [0; 2] {
            return Err(malformed("a reserved byte is not zero"));
        }
        let steps = UniformQuantizer {
            bits: entry[1],
            scale: LittleEndian::read_f32(&entry[4..]),
            offset: LittleEndian::read_f32(&entry[8..]),
        };
        let quantizer = match entry[0] {
            0 if steps.bits != 32 => return Err(malformed("a float that is not 32 bits deep")),
            0 if steps.scale != 1.0 || steps.offset != 0.0 => {
                return Err(malformed("a float whose scale and offset are not 1 and 0"));
            }
            0 => return Ok(Self::Float),
            1 => Self::Linear(steps),
            2 => Self::Log(steps),
            kind => return Err(DecodeError::unsupported(ChunkType::QNTZ, "kind", kind.into())),
        };
        if !(1..=16).contains(&steps.bits) {
            return Err(malformed("a bit depth that is not 1 to 16"));
        }
        if !(steps.scale > 0.0 && steps.scale <= MAX_PARAMETER) {
            return Err(malformed("a scale that is not positive and at most 2^32"));
        }
        if steps.offset.is_nan() || steps.offset.abs() > MAX_PARAMETER {
            return Err(malformed("an offset that is not within +-2^32"));
        }
        Ok(quantizer)
    }

    /// The entry of `QNTZ` for this quantizer.
    #[cfg(feature = "encode")]
    pub(crate) fn to_entry(self) -> [u8; ENTRY_LENGTH] {
        let (kind, steps) = match self {
            Self::Float => (0, UniformQuantizer { bits: 32, scale: 1.0, offset: 0.0 }),
            Self::Linear(steps) => (1, steps),
            Self::Log(steps) => (2, steps),
        };
        let mut entry = [0; ENTRY_LENGTH];
        entry[0] = kind;
        entry[1] = steps.bits;
        LittleEndian::write_f32(&mut entry[4..], steps.scale);
        LittleEndian::write_f32(&mut entry[8..], steps.offset);
        entry
    }
}

fn malformed(reason: &'static str) -> DecodeError {
    DecodeError::malformed(ChunkType::QNTZ, reason)
}
