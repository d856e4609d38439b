//! Files that look valid: right signature, lengths and CRCs around arbitrary contents.
//!
//! The layout is written down here a second time on purpose. The crate's own writer cannot write
//! what the encoder never chooses, and a mistake in it would pass unnoticed.

use arbitrary::Arbitrary;
use image_gip::{DecodeError, StreamDecoder};

use crate::entropy_coded::{EntropyCoded, Map};
use crate::number;

/// With the version, 1.
const SIGNATURE: &[u8] = b"\xC7GIP\r\n\x01\n";
/// An Exif of one entry, up to the value of its orientation.
const EXIF: &[u8] = b"II*\0\x08\0\0\0\x01\0\x12\x01\x03\0\x01\0\0\0";

/// Types that any letters of an extra may happen to be.
const KNOWN: [&[u8]; 5] = [b"H", b"L", b"E", b"bNDS", b"tXTR"];

/// How many skipped chunks a decoder lists.
const LISTED: usize = 16;

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
    /// Before which of the other chunks, and what it holds.
    texture: Option<(u8, Map)>,
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
    /// An Exif with an orientation of 0 to 9, in place of the payload.
    Orientation(u8),
    Xmp,
    Text,
    /// A `cICP` of these codes, in place of the payload.
    ColorSpace([u8; 4]),
    MasteringDisplay,
    ContentLight,
    /// A critical chunk has the first letter alone.
    Other([u8; 4]),
}

/// Type and payload.
type Chunk = (Vec<u8>, Vec<u8>);

/// One changed byte.
#[derive(Arbitrary, Debug)]
struct Flaw {
    place: u16,
    change: u8,
}

impl File {
    /// The bytes of the file.
    pub fn to_bytes(&self) -> Vec<u8> {
        let mut file = SIGNATURE.to_vec();
        for (kind, payload) in self.chunks() {
            let start = file.len();
            file.extend(kind);
            file.extend(number(payload.len() as u32));
            file.extend(payload);
            let crc = crc32fast::hash(&file[start..]);
            file.extend(crc.to_le_bytes());
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
        // Extras of any letters may be what changes the picture.
        let other = |extra: &&Extra| matches!(extra.kind, ExtraKind::Other(_));
        let others = || self.extras.iter().filter(other).map(|extra| extra.kind.name());
        if self.flaw.is_some() || others().any(|name| KNOWN.contains(&&name[..])) {
            return;
        }
        assert_eq!(error.is_none(), decoder.is_complete());
        if others().any(|name| name.len() == 1) {
            assert!(error.is_some(), "a critical chunk was skipped");
            return;
        }
        if let (None, Some(expected)) = (error, self.skipped()) {
            let found = decoder.skipped().iter().map(|skipped| skipped.chunk.letters().to_string());
            let listed = expected.iter().take(LISTED).map(|kind| String::from_utf8_lossy(kind));
            assert!(found.eq(listed), "{:?} instead of {expected:?}", decoder.skipped());
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

    fn chunks(&self) -> Vec<Chunk> {
        let layers = self.layers();
        let mut chunks = vec![(b"H".to_vec(), self.header(&layers))];
        let later = (0..layers.len()).rev();
        chunks.extend(layers.into_iter().zip(later).map(|((count, codes), later)| {
            // The last layer has all that remain.
            let count = if later > 0 { number(count) } else { Vec::new() };
            (b"L".to_vec(), [count, codes].concat())
        }));
        chunks.push((b"E".to_vec(), Vec::new()));
        // Never before the header: that is one error, found at once.
        let mut insert = |place: u8, chunk| {
            chunks.insert(1 + usize::from(place) % (chunks.len() - 1), chunk);
        };
        if let Some((place, map)) = &self.texture {
            insert(*place, (b"tXTR".to_vec(), map.payload(self.sides())));
        }
        for Extra { place, kind, payload } in &self.extras {
            insert(*place, (kind.name(), kind.payload(payload)));
        }
        chunks
    }

    /// The types of the chunks that a decoder skips, as they break a rule; `None` for files of which it is not known
    /// here.
    fn skipped(&self) -> Option<Vec<Vec<u8>>> {
        let (mut seen, mut skipped, mut is_shown) = (Vec::new(), Vec::new(), false);
        for (kind, payload) in self.chunks() {
            is_shown |= kind == b"L";
            let appears_twice = seen.contains(&kind);
            let is_sound = match &kind[..] {
                b"tEXt" => is_text(&payload),
                b"iCCP" => !appears_twice && !is_shown,
                b"cICP" => !appears_twice && !is_shown && matches!(payload[..], [_, _, 0, 1]),
                b"mDCV" => !appears_twice && !is_shown && payload.len() == 24,
                b"cLLI" => !appears_twice && !is_shown && payload.len() == 8,
                b"eXIF" if appears_twice => false,
                // Arbitrary bytes may turn the picture, or not.
                b"eXIF" if is_shown => match payload.strip_prefix(EXIF)? {
                    [orientation, 0, 0, 0, 0, 0, 0, 0] => !(2..=8).contains(orientation),
                    _ => return None,
                },
                b"xMPD" => !appears_twice,
                b"tXTR" => self.texture.as_ref().is_none_or(|(_, map)| map.is_sound(self.sides())),
                _ => true,
            };
            if is_sound { &mut seen } else { &mut skipped }.push(kind);
        }
        Some(skipped)
    }

    /// The number of Gaussians in each layer that is not empty, and the bytes in which they are coded.
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
        let (coding, form) = match &self.entropy_coded {
            None => (0, self.parameterization as u8),
            Some(entropy_coded) => (1, u8::from(entropy_coded.has_geometry())),
        };
        let kernel = u8::from(matches!(self.kernel, Kernel::Quartic));
        let depth = u8::from(self.sixteen_bit);
        let mut payload =
            vec![self.color as u8 | depth << 2 | coding << 3 | kernel << 4 | form << 5];
        let gaussians: u32 = layers.iter().map(|&(count, _)| count).sum();
        payload.extend(self.sides().into_iter().chain([gaussians]).flat_map(number));
        if gaussians > 0 {
            payload.extend(number(layers.len() as u32));
        }
        for value in &self.base_color[..self.channels()] {
            match self.sixteen_bit {
                false => payload.push((value >> 8) as u8),
                true => payload.extend(value.to_le_bytes()),
            }
        }
        if let Kernel::Exponential(cutoff) = self.kernel {
            payload.extend(((f32::from(cutoff) + 1.0) / 1024.0).to_le_bytes());
        }
        match &self.entropy_coded {
            _ if gaussians == 0 => {}
            None => {
                payload.extend(self.quantizers().iter().flat_map(|quantizer| quantizer.entry()))
            }
            Some(entropy_coded) => payload.extend(entropy_coded.fields(self.channels())),
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

    fn entry(&self) -> Vec<u8> {
        let (kind, steps) = match self {
            Self::Float => (0, None),
            Self::Linear(steps) => (1, Some(steps)),
            Self::Log(steps) => (2, Some(steps)),
        };
        let numbers = steps.into_iter().flat_map(|steps| [steps.scale(), steps.offset()]);
        [kind, self.bits()].into_iter().chain(numbers.flat_map(f32::to_le_bytes)).collect()
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
    fn name(&self) -> Vec<u8> {
        let name = match *self {
            Self::IccProfile => *b"iCCP",
            Self::Exif | Self::Orientation(_) => *b"eXIF",
            Self::Xmp => *b"xMPD",
            Self::Text => *b"tEXt",
            Self::ColorSpace(_) => *b"cICP",
            Self::MasteringDisplay => *b"mDCV",
            Self::ContentLight => *b"cLLI",
            Self::Other(name) => {
                name.map(|byte| if byte & 1 == 0 { b'a' } else { b'A' } + byte % 26)
            }
        };
        let length = if name[0].is_ascii_lowercase() { 4 } else { 1 };
        name[..length].to_vec()
    }

    fn payload(&self, payload: &[u8]) -> Vec<u8> {
        match *self {
            // The value fills four bytes, and no other directory follows.
            Self::ColorSpace(codes) => codes.to_vec(),
            Self::Orientation(value) => [EXIF, &[value % 10, 0, 0, 0], &[0; 4]].concat(),
            _ => payload.to_vec(),
        }
    }
}

/// Whether it is a keyword of 1 to 79 bytes, a NUL byte and a text without one, both in UTF-8.
fn is_text(payload: &[u8]) -> bool {
    let mut parts = payload.split(|&byte| byte == 0);
    let (keyword, text, rest) = (parts.next(), parts.next(), parts.next());
    let is_utf8 = |part: &[u8]| str::from_utf8(part).is_ok();
    keyword.is_some_and(|keyword| (1..80).contains(&keyword.len()) && is_utf8(keyword))
        && text.is_some_and(is_utf8)
        && rest.is_none()
}

/// The number of Gaussians that `codes` has bits for, and the codes of as many.
fn layer(codes: &[u8], bits: usize) -> (u32, Vec<u8>) {
    let count = codes.len() * 8 / bits;
    let used = count * bits;
    let mut codes = codes[..used.div_ceil(8)].to_vec();
    if !used.is_multiple_of(8)
        && let Some(last) = codes.last_mut()
    {
        *last &= (1 << (used % 8)) - 1;
    }
    (count as u32, codes)
}
