//! What the samples stand for, in codes: the chunks `cICP`, `mDCV` and `cLLI` (spec, section 5.5), whose payloads are
//! those of PNG's chunks of these names.

/// The colour space of the samples, as two coding-independent code points (Rec. ITU-T H.273; PNG, third edition,
/// chunk `cICP`). Samples are RGB in full range, or gray; the matrix coefficients are 0.
///
/// Any code may stand here: those that are not known are passed on.
///
/// ```
/// use image_gip::{Cicp, Metadata};
///
/// let mut metadata = Metadata::default();
/// metadata.cicp = Some(Cicp::DISPLAY_P3);
/// assert_eq!(metadata.cicp, Some(Cicp::new(12, 13)));
/// ```
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash)]
#[non_exhaustive]
pub struct Cicp {
    /// `ColourPrimaries` (H.273, table 2): 1 for those of sRGB and BT.709, 9 for BT.2020, 12 for Display P3.
    pub primaries: u8,
    /// `TransferCharacteristics` (H.273, table 3): 13 for that of sRGB, 16 for PQ, 18 for HLG.
    pub transfer: u8,
}

/// The display on which the picture was made (SMPTE ST 2086; PNG, third edition, chunk `mDCV`).
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash)]
pub struct MasteringDisplay {
    /// CIE 1931 x and y of its red, in 0.00002.
    pub red: [u16; 2],
    /// x and y of its green, in 0.00002.
    pub green: [u16; 2],
    /// x and y of its blue, in 0.00002.
    pub blue: [u16; 2],
    /// x and y of its white, in 0.00002.
    pub white: [u16; 2],
    /// The most luminance that it shows, in 0.0001 cd/m².
    pub max_luminance: u32,
    /// The least luminance that it shows, in 0.0001 cd/m².
    pub min_luminance: u32,
}

/// How bright the picture is (CTA-861; PNG, third edition, chunk `cLLI`).
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash)]
pub struct ContentLight {
    /// That of the brightest pixel, `MaxCLL`, in 0.0001 cd/m²; 0 if it is not known.
    pub max_content: u32,
    /// The mean of the picture, `MaxFALL`, in 0.0001 cd/m²; 0 if it is not known.
    pub max_frame_average: u32,
}

impl Cicp {
    /// sRGB, which samples are in without any colour space.
    pub const SRGB: Self = Self::new(1, 13);
    /// Display P3.
    pub const DISPLAY_P3: Self = Self::new(12, 13);
    /// BT.2100 with the transfer function PQ, for pictures of high dynamic range.
    pub const BT2100_PQ: Self = Self::new(9, 16);
    /// BT.2100 with the transfer function HLG, for pictures of high dynamic range.
    pub const BT2100_HLG: Self = Self::new(9, 18);

    /// The colour space of these codes of H.273.
    #[must_use]
    pub const fn new(primaries: u8, transfer: u8) -> Self {
        Self { primaries, transfer }
    }

    /// The colour space of a payload. `None` if it has the wrong length, or samples that are transformed by a matrix
    /// or are not of full range.
    pub(super) fn parse(payload: &[u8]) -> Option<Self> {
        match *payload {
            [primaries, transfer, 0, 1] => Some(Self { primaries, transfer }),
            _ => None,
        }
    }

    /// The payload of the chunk `cICP`, in `.gip` as in PNG.
    #[must_use]
    pub const fn to_bytes(self) -> [u8; 4] {
        [self.primaries, self.transfer, 0, 1]
    }
}

impl MasteringDisplay {
    /// The display of a payload; `None` if it has the wrong length.
    pub(super) fn parse(payload: &[u8]) -> Option<Self> {
        let payload: &[u8; 24] = payload.try_into().ok()?;
        let half = |at: usize| u16::from_be_bytes([payload[at], payload[at + 1]]);
        Some(Self {
            red: [half(0), half(2)],
            green: [half(4), half(6)],
            blue: [half(8), half(10)],
            white: [half(12), half(14)],
            max_luminance: word(payload, 16),
            min_luminance: word(payload, 20),
        })
    }

    /// The payload of the chunk `mDCV`, in `.gip` as in PNG.
    #[must_use]
    pub fn to_bytes(&self) -> [u8; 24] {
        let Self { red, green, blue, white, max_luminance, min_luminance } = *self;
        let mut payload = [0; 24];
        let chromaticities = [red, green, blue, white].into_iter().flatten();
        for (bytes, value) in payload.as_chunks_mut().0.iter_mut().zip(chromaticities) {
            *bytes = value.to_be_bytes();
        }
        payload[16..20].copy_from_slice(&max_luminance.to_be_bytes());
        payload[20..].copy_from_slice(&min_luminance.to_be_bytes());
        payload
    }
}

impl ContentLight {
    /// How bright the picture of a payload is; `None` if that has the wrong length.
    pub(super) fn parse(payload: &[u8]) -> Option<Self> {
        let payload: &[u8; 8] = payload.try_into().ok()?;
        Some(Self { max_content: word(payload, 0), max_frame_average: word(payload, 4) })
    }

    /// The payload of the chunk `cLLI`, in `.gip` as in PNG.
    #[must_use]
    pub fn to_bytes(&self) -> [u8; 8] {
        let levels = u64::from(self.max_content) << 32 | u64::from(self.max_frame_average);
        levels.to_be_bytes()
    }
}

/// The number of four bytes at a place, all of which are there.
#[inline(always)]
fn word<const N: usize>(payload: &[u8; N], at: usize) -> u32 {
    u32::from_be_bytes([payload[at], payload[at + 1], payload[at + 2], payload[at + 3]])
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn numbers_stand_as_in_png() {
        // The primaries of BT.2020, D65, and 0.05 to 1000 cd/m².
        let display = MasteringDisplay {
            red: [35_400, 14_600],
            green: [8_500, 39_850],
            blue: [6_550, 2_300],
            white: [15_635, 16_450],
            max_luminance: 10_000_000,
            min_luminance: 500,
        };
        let bytes = display.to_bytes();
        assert_eq!(bytes[..4], [0x8A, 0x48, 0x39, 0x08]);
        assert_eq!(bytes[16..], [0x00, 0x98, 0x96, 0x80, 0, 0, 0x01, 0xF4]);
        assert_eq!(MasteringDisplay::parse(&bytes), Some(display));
        let light = ContentLight { max_content: 10_000_000, max_frame_average: 2_500_000 };
        let bytes = light.to_bytes();
        assert_eq!(bytes, [0x00, 0x98, 0x96, 0x80, 0x00, 0x26, 0x25, 0xA0]);
        assert_eq!(ContentLight::parse(&bytes), Some(light));
        assert_eq!(Cicp::parse(&Cicp::BT2100_PQ.to_bytes()), Some(Cicp::BT2100_PQ));
    }
}
