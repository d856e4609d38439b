//! Numbers of one to five bytes (spec, section 2): seven bits in each byte, the lowest first; all bytes but the last
//! have the highest bit set. A number has no more bytes than it needs.

#[cfg(feature = "encode")]
use alloc::vec::Vec;

/// Why bytes are no such number.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) struct Flaw(&'static str);

impl Flaw {
    /// What is wrong.
    pub(crate) fn reason(self) -> &'static str {
        self.0
    }
}

/// A number whose bytes arrive one by one.
#[derive(Clone, Copy, Debug, Default)]
pub(crate) struct Arriving {
    value: u32,
    /// How many bytes have arrived.
    bytes: u32,
}

impl Arriving {
    /// Takes the bytes of the number from `input`. `None` if the input ends before the number does.
    pub(crate) fn read(&mut self, input: &mut &[u8]) -> Result<Option<u32>, Flaw> {
        while let Some((&byte, rest)) = input.split_first() {
            *input = rest;
            let (bits, shift) = (u32::from(byte & 0x7F), 7 * self.bytes);
            // The fifth byte has the four highest bits.
            if shift == 28 && byte > 0x0F {
                return Err(Flaw("a number of more than 32 bits"));
            }
            self.value |= bits << shift;
            self.bytes += 1;
            if byte < 0x80 {
                if bits == 0 && self.bytes > 1 {
                    return Err(Flaw("a number with more bytes than it needs"));
                }
                return Ok(Some(self.value));
            }
        }
        Ok(None)
    }

    /// How many bytes have arrived.
    pub(crate) fn bytes(self) -> u32 {
        self.bytes
    }
}

/// Takes a number from the front of `input`. `None` if it ends too early.
pub(crate) fn read(input: &mut &[u8]) -> Result<Option<u32>, Flaw> {
    Arriving::default().read(input)
}

/// How many bytes a number has.
#[cfg(feature = "encode")]
pub(crate) const fn length(value: u32) -> usize {
    let bits = u32::BITS - (value | 1).leading_zeros();
    bits.div_ceil(7) as usize
}

/// Appends a number.
#[cfg(feature = "encode")]
pub(crate) fn write(mut value: u32, out: &mut Vec<u8>) {
    while value >= 0x80 {
        out.push(value as u8 | 0x80);
        value >>= 7;
    }
    out.push(value as u8);
}

#[cfg(all(test, feature = "encode"))]
mod tests {
    use proptest::prelude::*;

    use super::*;
    use crate::testing::config;

    proptest! {
        #![proptest_config(config(500))]

        #[test]
        fn a_number_round_trips_in_any_pieces(value: u32, shift in 0_u32..32, piece in 1_usize..6) {
            let value = value >> shift;
            let mut bytes = Vec::new();
            write(value, &mut bytes);
            prop_assert_eq!(bytes.len(), length(value));
            bytes.push(0x55);
            let mut arriving = Arriving::default();
            let mut pieces = bytes.chunks(piece);
            let (found, rest) = loop {
                let mut input = pieces.next().expect("the number ends within the bytes");
                if let Some(found) = arriving.read(&mut input).expect("a number") {
                    break (found, input.len() + pieces.map(<[u8]>::len).sum::<usize>());
                }
            };
            prop_assert_eq!((found, rest), (value, 1));
        }
    }

    #[test]
    fn each_number_has_one_form() {
        for (bytes, flawed) in [
            (&[0x00][..], false),
            (&[0x80, 0x00], true),
            (&[0xFF, 0xFF, 0xFF, 0xFF, 0x0F], false),
            (&[0xFF, 0xFF, 0xFF, 0xFF, 0x1F], true),
            (&[0xFF, 0xFF, 0xFF, 0xFF, 0x8F], true),
            (&[0x80, 0x80, 0x80, 0x80, 0x00], true),
        ] {
            assert_eq!(read(&mut &bytes[..]).is_err(), flawed, "{bytes:?}");
        }
        assert_eq!(read(&mut &[0xFF][..]), Ok(None));
    }
}
