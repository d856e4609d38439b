//! Files that look valid: right signature, lengths and CRCs around arbitrary contents.
//!
//! The layout is written down here a second time on purpose. The crate's own writer cannot write
//! what the encoder never chooses, and a mistake in it would pass unnoticed.

use arbitrary::Arbitrary;
use image_gip::{DecodeError, StreamDecoder};

use crate::entropy_coded::{EntropyCoded, Map};

const SIGNATURE: &[u8] = b"\xC7GIP\r\n\x1A\n";

/// What a file is made of.
#[derive(Arbitrary, Debug)]
pub struct File {
    width: Side,
    height: Side,
    color: Color,
    sixteen_bit: bool,
    /// Of the entropy coding, which leaves parameterization, quantizers and packed codes unused.
    entropy_coded: Option<EntropyCoded>,
    kernel: Kernel,
    parameterization: Parameterization,
    base_color: [u16; 4],
    position: [Quantizer; 2],
    shape: [Quantizer; 3],
    channels: [Quantizer; 4],
    /// The packed codes of each layer.
    layers: Vec<Vec<u8>>,
    extras: Vec<Extra>,
    flaw: Option<Flaw>,
    texture: Option<Map>,
}

#[derive(Arbitrary, Debug)]
enum Side {
    Small(u8),
    Large(u16),
}

#[derive(Arbitrary, Clone, Copy, Debug)]
enum Color {
    Gray,
    GrayAlpha,
    Rgb,
    Rgba,
}

#[derive(Arbitrary, Debug)]
enum Kernel {
    /// A cut-off in 1/1024, from 1/1024 to 64.
    Exponential(u16),
    Quartic,
}

#[derive(Arbitrary, Clone, Copy, Debug)]
enum Parameterization {
    Covariance,
    Cholesky,
    RotationScale,
}

#[derive(Arbitrary, Debug)]
enum Quantizer {
    Float,
    Linear(Steps),
    Log(Steps),
}

#[derive(Arbitrary, Debug)]
struct Steps {
    bits: u8,
    /// A scale of (1 + mantissa / 256) * 2^exponent.
    exponent: i8,
    mantissa: u8,
    offset: i32,
    /// The offset is counted in 2^-shift.
    shift: u8,
}

/// A chunk besides the necessary ones.
#[derive(Arbitrary, Debug)]
struct Extra {
    /// Before which of the other chunks.
    place: u8,
    kind: ExtraKind,
    payload: Vec<u8>,
}

#[derive(Arbitrary, Debug)]
enum ExtraKind {
    IccProfile,
    Exif,
    Xmp,
    Text,
    Other([u8; 4]),
}

/// One changed byte.
#[derive(Arbitrary, Debug)]
struct Flaw {
    place: u16,
    change: u8,
}

impl File {
    /// The bytes of the file.
    pub fn to_bytes(&self) -> Vec<u8> {
        let layers = self.layers();
        let quantizers = match &self.entropy_coded {
            None => self.quantizers().iter().flat_map(|quantizer| quantizer.entry()).collect(),
            Some(entropy_coded) => entropy_coded.quantizers(self.channels()),
        };
        let mut chunks = vec![(*b"GHDR", self.header(&layers)), (*b"QNTZ", quantizers)];
        chunks.extend(self.texture.iter().map(|map| (*b"tXTR", map.payload(self.sides()))));
        chunks.extend(layers.into_iter().map(|(_, payload)| (*b"GAUS", payload)));
        chunks.push((*b"GEND", Vec::new()));
        for extra in &self.extras {
            // Never before the header: that is one error, found at once.
            let place = 1 + usize::from(extra.place) % (chunks.len() - 1);
            chunks.insert(place, (extra.kind.name(), extra.payload.clone()));
        }
        let mut file = SIGNATURE.to_vec();
        for (kind, payload) in chunks {
            write_chunk(&mut file, kind, &payload);
        }
        if let Some(flaw) = &self.flaw {
            let place = usize::from(flaw.place) % file.len();
            file[place] ^= flaw.change;
        }
        file
    }

    /// Checks that a decoder refused this file only where it had a reason, and that it found what
    /// the file says. (Floats are not promised to be finite.)
    pub fn check(&self, decoder: &StreamDecoder, error: Option<&DecodeError>) {
        if !self.extras.is_empty() || self.flaw.is_some() {
            return;
        }
        assert_eq!(error.is_none(), decoder.is_complete());
        if let Some(map) = &self.texture
            && !map.is_sound(self.sides())
        {
            assert!(error.is_some(), "a flaw of the texture was not noticed");
            return;
        }
        if let Some(entropy_coded) = &self.entropy_coded {
            entropy_coded.check(self.sides(), self.channels(), decoder, error);
        } else if !self.quantizers().iter().any(|q| matches!(q, Quantizer::Float)) {
            match error {
                None | Some(DecodeError::Limit { .. }) => {}
                Some(error) => panic!("a sound file was refused: {error}"),
            }
        }
    }

    /// The payloads of layers that are not empty, each with its number of Gaussians.
    fn layers(&self) -> Vec<(u32, Vec<u8>)> {
        if let Some(entropy_coded) = &self.entropy_coded {
            return entropy_coded.layers(self.sides(), self.channels());
        }
        let bits = self.quantizers().iter().map(|quantizer| usize::from(quantizer.bits())).sum();
        let layers = self.layers.iter().map(|codes| layer(codes, bits));
        layers.filter(|&(count, _)| count > 0).collect()
    }

    fn sides(&self) -> [u32; 2] {
        [self.width.pixels(), self.height.pixels()]
    }

    fn channels(&self) -> usize {
        self.color as usize + 1
    }

    fn quantizers(&self) -> Vec<&Quantizer> {
        let channels = &self.channels[..=self.color as usize];
        self.position.iter().chain(&self.shape).chain(channels).collect()
    }

    fn header(&self, layers: &[(u32, Vec<u8>)]) -> Vec<u8> {
        let (kernel, cutoff) = match self.kernel {
            Kernel::Exponential(cutoff) => (0, (f32::from(cutoff) + 1.0) / 1024.0),
            Kernel::Quartic => (1, 4.0),
        };
        let gaussians: u32 = layers.iter().map(|&(count, _)| count).sum();
        let depth = if self.sixteen_bit { 16 } else { 8 };
        let (coding, parameterization) = match self.entropy_coded {
            None => (0, self.parameterization),
            Some(_) => (1, Parameterization::Cholesky),
        };
        let mut payload = vec![1, coding, self.color as u8, depth];
        payload.extend(self.sides().into_iter().flat_map(u32::to_le_bytes));
        payload.extend(gaussians.to_le_bytes());
        payload.extend((layers.len() as u16).to_le_bytes());
        payload.extend([kernel, parameterization as u8]);
        payload.extend(cutoff.to_le_bytes());
        payload.extend([0; 4]);
        for (channel, value) in self.base_color.iter().enumerate() {
            let value = if channel <= self.color as usize { *value } else { 0 };
            payload.extend(value.to_le_bytes());
        }
        payload
    }
}

impl Side {
    fn pixels(&self) -> u32 {
        1 + match *self {
            Self::Small(side) => u32::from(side),
            Self::Large(side) => u32::from(side),
        }
    }
}

impl Quantizer {
    fn bits(&self) -> u8 {
        match self {
            Self::Float => 32,
            Self::Linear(steps) | Self::Log(steps) => 1 + steps.bits % 16,
        }
    }

    fn entry(&self) -> [u8; 12] {
        let (kind, scale, offset) = match self {
            Self::Float => (0, 1.0, 0.0),
            Self::Linear(steps) => (1, steps.scale(), steps.offset()),
            Self::Log(steps) => (2, steps.scale(), steps.offset()),
        };
        let mut entry = [0; 12];
        (entry[0], entry[1]) = (kind, self.bits());
        entry[4..8].copy_from_slice(&scale.to_le_bytes());
        entry[8..].copy_from_slice(&offset.to_le_bytes());
        entry
    }
}

impl Steps {
    fn scale(&self) -> f32 {
        // Exponents up to 31 keep the scale at most 2^32.
        let exponent = i32::from(self.exponent).min(31);
        (1.0 + f32::from(self.mantissa) / 256.0) * (exponent as f32).exp2()
    }

    fn offset(&self) -> f32 {
        self.offset as f32 * (-f32::from(self.shift % 32)).exp2()
    }
}

impl ExtraKind {
    fn name(&self) -> [u8; 4] {
        match *self {
            Self::IccProfile => *b"iCCP",
            Self::Exif => *b"eXIf",
            Self::Xmp => *b"xMPd",
            Self::Text => *b"tEXt",
            Self::Other(name) => {
                name.map(|byte| if byte & 1 == 0 { b'a' } else { b'A' } + byte % 26)
            }
        }
    }
}

/// The number of Gaussians that `codes` has bits for, and the payload of their layer.
fn layer(codes: &[u8], bits: usize) -> (u32, Vec<u8>) {
    let count = codes.len() * 8 / bits;
    let used = count * bits;
    let mut payload = (count as u32).to_le_bytes().to_vec();
    payload.extend_from_slice(&codes[..used.div_ceil(8)]);
    if !used.is_multiple_of(8)
        && let Some(last) = payload.last_mut()
    {
        *last &= (1 << (used % 8)) - 1;
    }
    (count as u32, payload)
}

fn write_chunk(file: &mut Vec<u8>, kind: [u8; 4], payload: &[u8]) {
    file.extend((payload.len() as u32).to_le_bytes());
    let start = file.len();
    file.extend(kind);
    file.extend(payload);
    let crc = crc32fast::hash(&file[start..]);
    file.extend(crc.to_le_bytes());
}
