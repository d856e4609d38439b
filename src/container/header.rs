//! The header, the chunk `GHDR`: all that a decoder must know before it allocates memory (spec,
//! section 5.1).

use byteorder::{ByteOrder, LittleEndian};

use crate::chunk::ChunkType;
use crate::color::{ColorModel, SampleDepth};
use crate::error::DecodeError;
use crate::gaussian::{Parameterization, component_count};
use crate::kernel::Kernel;

/// The version that this crate reads and writes.
pub(crate) const VERSION: u8 = 1;
/// Largest width and height of a picture, in pixels.
pub(crate) const MAX_SIDE: u32 = 1 << 20;
/// Bytes in the payload of `GHDR`.
pub(crate) const HEADER_LENGTH: usize = 36;

/// How a file stores its Gaussians (spec, section 7).
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash)]
#[non_exhaustive]
pub enum Coding {
    /// The packed coding: every component has the fixed bit depth of its quantizer, and Gaussians
    /// may stand in any order.
    Packed,
    /// The entropy coding: the Gaussians of each layer are stored as a set, in the order of a tree
    /// of cells. Each has a step exponent, and every attribute is entropy coded.
    Entropy,
}

impl Coding {
    #[cfg(feature = "encode")]
    const fn code(self) -> u8 {
        match self {
            Self::Packed => 0,
            Self::Entropy => 1,
        }
    }

    const fn from_code(code: u8) -> Option<Self> {
        match code {
            0 => Some(Self::Packed),
            1 => Some(Self::Entropy),
            _ => None,
        }
    }
}

/// The header of a file: what it says of its picture before the first Gaussian (spec, section 5.1).
#[derive(Clone, Debug, PartialEq)]
#[non_exhaustive]
pub struct Header {
    /// Version of the format: 1.
    pub version: u8,
    /// How the file stores its Gaussians.
    pub coding: Coding,
    /// Width in pixels, 1 to 2^20.
    pub width: u32,
    /// Height in pixels, 1 to 2^20.
    pub height: u32,
    /// The channels.
    pub color: ColorModel,
    /// Bits per sample of the picture that was encoded, and of the output by default.
    pub depth: SampleDepth,
    /// Number of Gaussians in all layers.
    pub gaussians: u32,
    /// Number of layers, which are `GAUS` chunks: 0 if there are no Gaussians, else 1 to their
    /// number.
    pub layers: u16,
    /// The kernel and its cut-off.
    pub kernel: Kernel,
    /// What the three stored components of a shape mean.
    pub parameterization: Parameterization,
    /// The colour that the Gaussians are added to: one value per channel, in 1/65535 of a full
    /// sample; 0 in channels that the colour model lacks.
    pub base_color: [u16; 4],
}

impl Header {
    /// Reads the payload of `GHDR`.
    pub(crate) fn parse(payload: &[u8]) -> Result<Self, DecodeError> {
        const CHUNK: ChunkType = ChunkType::GHDR;
        // The version is checked first: a later version may change all that follows.
        if let Some(&version) = payload.first()
            && version != VERSION
        {
            return Err(DecodeError::unsupported(CHUNK, "version", version.into()));
        }
        let payload: &[u8; HEADER_LENGTH] = payload
            .try_into()
            .map_err(|_| DecodeError::malformed(CHUNK, "the length is not 36 bytes"))?;
        let coding = Coding::from_code(payload[1])
            .ok_or_else(|| DecodeError::unsupported(CHUNK, "coding", payload[1].into()))?;
        let color = ColorModel::from_code(payload[2])
            .ok_or_else(|| DecodeError::unsupported(CHUNK, "colour model", payload[2].into()))?;
        let depth = SampleDepth::from_bits(payload[3])
            .ok_or_else(|| DecodeError::unsupported(CHUNK, "sample depth", payload[3].into()))?;
        let side = |at: usize, name: &'static str| match LittleEndian::read_u32(&payload[at..]) {
            0 => Err(DecodeError::malformed(CHUNK, alloc::format!("the {name} is zero"))),
            side if side > MAX_SIDE => {
                Err(DecodeError::malformed(CHUNK, alloc::format!("the {name} is over 2^20")))
            }
            side => Ok(side),
        };
        let (width, height) = (side(4, "width")?, side(8, "height")?);
        let gaussians = LittleEndian::read_u32(&payload[12..]);
        let layers = LittleEndian::read_u16(&payload[16..]);
        if u32::from(layers) > gaussians {
            return Err(DecodeError::malformed(CHUNK, "more layers than Gaussians"));
        }
        if layers == 0 && gaussians != 0 {
            return Err(DecodeError::malformed(CHUNK, "Gaussians, but no layer"));
        }
        let kernel = Kernel::parse(payload[18], LittleEndian::read_f32(&payload[20..]))?;
        let parameterization = Parameterization::from_code(payload[19]).ok_or_else(|| {
            DecodeError::unsupported(CHUNK, "parameterization", payload[19].into())
        })?;
        if coding == Coding::Entropy && parameterization != Parameterization::Cholesky {
            return Err(DecodeError::malformed(
                CHUNK,
                "a parameterization that this coding does not have",
            ));
        }
        if payload[24] != 0 {
            return Err(DecodeError::unsupported(CHUNK, "colour transform", payload[24].into()));
        }
        if payload[25..28] != [0; 3] {
            return Err(DecodeError::malformed(CHUNK, "a reserved byte is not zero"));
        }
        let mut base_color = [0; 4];
        LittleEndian::read_u16_into(&payload[28..], &mut base_color);
        if base_color[color.channels()..].iter().any(|&value| value != 0) {
            return Err(DecodeError::malformed(CHUNK, "base colour in an absent channel"));
        }
        Ok(Self {
            version: VERSION,
            coding,
            width,
            height,
            color,
            depth,
            gaussians,
            layers,
            kernel,
            parameterization,
            base_color,
        })
    }

    /// The payload of `GHDR`.
    #[cfg(feature = "encode")]
    pub(crate) fn to_payload(&self) -> [u8; HEADER_LENGTH] {
        let mut payload = [0; HEADER_LENGTH];
        payload[0] = self.version;
        payload[1] = self.coding.code();
        payload[2] = self.color.code();
        payload[3] = self.depth.bits();
        LittleEndian::write_u32(&mut payload[4..], self.width);
        LittleEndian::write_u32(&mut payload[8..], self.height);
        LittleEndian::write_u32(&mut payload[12..], self.gaussians);
        LittleEndian::write_u16(&mut payload[16..], self.layers);
        payload[18] = self.kernel.code();
        payload[19] = self.parameterization.code();
        LittleEndian::write_f32(&mut payload[20..], self.kernel.cutoff());
        LittleEndian::write_u16_into(&self.base_color, &mut payload[28..]);
        payload
    }

    /// The base colour, where 1.0 is a full sample.
    pub(crate) fn base(&self) -> [f32; 4] {
        self.base_color.map(|value| f32::from(value) / 65535.0)
    }

    /// The number of stored components of a Gaussian: two of position, three of shape, one per
    /// channel.
    #[must_use]
    pub fn components(&self) -> usize {
        component_count(self.color.channels())
    }
}
