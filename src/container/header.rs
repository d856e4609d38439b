//! The header, the chunk `H`: all that a decoder must know before it allocates memory, and what turns the codes
//! of Gaussians into values (spec, section 5.1).

use alloc::vec::Vec;

use super::fields::Fields;
#[cfg(feature = "encode")]
use super::varint;
use crate::chunk::{ChunkType, VERSION};
use crate::coding::entropy::{LayerCoder, Quantization};
use crate::coding::packed::Quantizer;
use crate::color::{ColorModel, SampleDepth};
use crate::error::{DecodeError, PictureError};
use crate::gaussian::{Parameterization, component_count};
use crate::kernel::Kernel;

/// Largest width and height of a picture, in pixels.
pub(crate) const MAX_SIDE: u32 = 1 << 20;

/// Most bytes of the payload.
const MAX_LENGTH: u32 = 255;

/// The fields of the first byte of the header, from the lowest bit on.
const COLOR_MODEL: u8 = 0b0000_0011;
const SIXTEEN_BITS: u8 = 0b0000_0100;
const ENTROPY: u8 = 0b0000_1000;
const QUARTIC: u8 = 0b0001_0000;
/// The parameterization with the packed coding; with the entropy coding, whether steps of geometry follow.
const FORM_SHIFT: u32 = 5;
const FORM: u8 = 0b0110_0000;
const RESERVED: u8 = 0b1000_0000;

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
    /// Number of layers: 0 if there are no Gaussians, else 1 to their number.
    pub layers: u16,
    /// The kernel and its cut-off.
    pub kernel: Kernel,
    /// What the three stored components of a shape mean.
    pub parameterization: Parameterization,
    /// The colour that the Gaussians are added to: one value per channel, in 1/65535 of a full
    /// sample, and a multiple of 257 if samples have 8 bits; 0 in channels that the colour model lacks.
    pub base_color: [u16; 4],
}

/// What turns the codes of a file's Gaussians into values.
#[derive(Clone, Debug, PartialEq)]
pub(crate) enum Dequantizer {
    /// The quantizers of the packed coding, one per component.
    Packed(Vec<Quantizer>),
    /// The quantization grid of the entropy coding.
    Entropy(Quantization),
}

impl Header {
    /// The header of a picture of Gaussians that come from elsewhere, for [`Picture::from_gaussians`] and
    /// `Writer`: with 8 bits per sample, the quartic kernel, Cholesky factors as the stored shape, and black (and
    /// transparent) as the base colour. Its fields can be changed; those out of range are refused where the header is
    /// used.
    ///
    /// [`Picture::from_gaussians`]: crate::Picture::from_gaussians
    #[must_use]
    pub const fn new(width: u32, height: u32, color: ColorModel) -> Self {
        Self {
            version: VERSION,
            coding: Coding::Packed,
            width,
            height,
            color,
            depth: SampleDepth::Eight,
            gaussians: 0,
            layers: 0,
            kernel: Kernel::Quartic,
            parameterization: Parameterization::Cholesky,
            base_color: [0; 4],
        }
    }

    /// Refuses fields that no file can have. Coding and numbers of Gaussians and layers are those of the file.
    pub(crate) fn check(&self) -> Result<(), PictureError> {
        let sides = [self.width, self.height];
        let steps = match self.depth {
            SampleDepth::Eight => 257,
            SampleDepth::Sixteen => 1,
        };
        let base = &self.base_color[..self.color.channels()];
        let rules = [
            (
                sides.iter().all(|side| (1..=MAX_SIDE).contains(side)),
                "width and height must be 1 to 2^20 pixels",
            ),
            (
                base.iter().all(|value| value % steps == 0),
                "the base colour must be multiples of 257, as samples have 8 bits",
            ),
            (self.kernel.is_valid(), "the cut-off of the kernel must be over 0 and at most 64"),
        ];
        let broken = rules.into_iter().find(|(holds, _)| !holds);
        broken.map_or(Ok(()), |(_, rule)| Err(PictureError::Header(rule)))
    }

    /// Refuses a payload that is too long, before it is read.
    pub(crate) fn check_length(length: u32) -> Result<(), DecodeError> {
        if length > MAX_LENGTH {
            return Err(DecodeError::unsupported(ChunkType::HEADER, "length", length));
        }
        Ok(())
    }

    /// Reads the payload of the header. There is nothing to turn codes into values if there are no Gaussians.
    pub(crate) fn parse(payload: &[u8]) -> Result<(Self, Option<Dequantizer>), DecodeError> {
        let unsupported =
            |what, code: u8| DecodeError::unsupported(ChunkType::HEADER, what, code.into());
        let mut fields = Fields::new(ChunkType::HEADER, payload);
        let format = fields.u8()?;
        if format & RESERVED != 0 {
            return Err(unsupported("format", format));
        }
        let coding = if format & ENTROPY == 0 { Coding::Packed } else { Coding::Entropy };
        let form = (format & FORM) >> FORM_SHIFT;
        let (parameterization, has_geometry) = match (coding, Parameterization::from_code(form)) {
            (Coding::Packed, Some(parameterization)) => (parameterization, false),
            (Coding::Packed, None) => return Err(unsupported("parameterization", form)),
            (Coding::Entropy, _) if form < 2 => (Parameterization::Cholesky, form == 1),
            (Coding::Entropy, _) => return Err(unsupported("form of steps", form)),
        };
        let color = ColorModel::from_code(format & COLOR_MODEL);
        let depth =
            if format & SIXTEEN_BITS == 0 { SampleDepth::Eight } else { SampleDepth::Sixteen };
        let (width, height) = (fields.side("width")?, fields.side("height")?);
        let gaussians = fields.varint()?;
        let layers = if gaussians == 0 { 0 } else { fields.layers(gaussians)? };
        let mut base_color = [0; 4];
        for channel in &mut base_color[..color.channels()] {
            *channel = match depth {
                // 255 becomes 65535.
                SampleDepth::Eight => u16::from(fields.u8()?) * 257,
                SampleDepth::Sixteen => fields.u16()?,
            };
        }
        let kernel = if format & QUARTIC == 0 {
            Kernel::exponential(fields.f32()?)?
        } else {
            Kernel::Quartic
        };
        let header = Self {
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
        };
        let dequantizer = match coding {
            _ if gaussians == 0 => None,
            Coding::Packed => {
                let mut quantizers = Vec::new();
                for _ in 0..header.components() {
                    quantizers.push(Quantizer::parse(&mut fields)?);
                }
                Some(Dequantizer::Packed(quantizers))
            }
            Coding::Entropy => {
                let channels = color.channels();
                Some(Dequantizer::Entropy(Quantization::parse(
                    &mut fields,
                    channels,
                    has_geometry,
                )?))
            }
        };
        fields.finish()?;
        Ok((header, dequantizer))
    }

    /// The payload of the header. The dequantizer is that of its coding; it is needed only if there are Gaussians.
    #[cfg(feature = "encode")]
    pub(crate) fn to_payload(&self, dequantizer: Option<&Dequantizer>) -> Vec<u8> {
        let dequantizer = dequantizer.filter(|_| self.gaussians > 0);
        let form = match (self.coding, dequantizer) {
            (Coding::Packed, _) => self.parameterization.code(),
            (Coding::Entropy, Some(Dequantizer::Entropy(steps))) if !steps.has_usual_geometry() => {
                1
            }
            (Coding::Entropy, _) => 0,
        };
        let flags = [
            (self.depth == SampleDepth::Sixteen, SIXTEEN_BITS),
            (self.coding == Coding::Entropy, ENTROPY),
            (self.kernel == Kernel::Quartic, QUARTIC),
        ];
        let flags = flags.iter().filter(|(holds, _)| *holds).map(|(_, flag)| flag).sum::<u8>();
        let format = self.color.code() | form << FORM_SHIFT | flags;
        let mut payload = vec![format];
        for number in [self.width, self.height, self.gaussians] {
            varint::write(number, &mut payload);
        }
        if self.gaussians > 0 {
            varint::write(self.layers.into(), &mut payload);
        }
        for &channel in &self.base_color[..self.color.channels()] {
            match self.depth {
                SampleDepth::Eight => payload.push((channel / 257) as u8),
                SampleDepth::Sixteen => payload.extend(channel.to_le_bytes()),
            }
        }
        if let Kernel::Exponential { cutoff } = self.kernel {
            payload.extend(cutoff.to_le_bytes());
        }
        match dequantizer {
            None => {}
            Some(Dequantizer::Packed(quantizers)) => {
                quantizers.iter().for_each(|quantizer| quantizer.write(&mut payload));
            }
            Some(Dequantizer::Entropy(quantization)) => quantization.write(&mut payload),
        }
        payload
    }

    /// The base colour, where 1.0 is a full sample.
    pub(crate) fn base(&self) -> [f32; 4] {
        self.base_color.map(|value| f32::from(value) / 65535.0)
    }

    /// What reads and writes entropy-coded layers of the picture.
    pub(crate) fn layer_coder<'a>(&self, quantization: &'a Quantization) -> LayerCoder<'a> {
        LayerCoder::new(quantization, [self.width, self.height], self.color)
    }

    /// The number of stored components of a Gaussian: two of position, three of shape, one per
    /// channel.
    #[must_use]
    pub fn components(&self) -> usize {
        component_count(self.color.channels())
    }
}

impl Fields<'_> {
    /// The width or height of a picture.
    fn side(&mut self, name: &'static str) -> Result<u32, DecodeError> {
        match self.varint()? {
            0 => Err(self.malformed(alloc::format!("the {name} is zero"))),
            side if side > MAX_SIDE => Err(self.unsupported(name, side)),
            side => Ok(side),
        }
    }

    /// The number of layers of so many Gaussians.
    fn layers(&mut self, gaussians: u32) -> Result<u16, DecodeError> {
        match self.varint()? {
            0 => Err(self.malformed("Gaussians, but no layer")),
            layers if layers > gaussians => Err(self.malformed("more layers than Gaussians")),
            layers => {
                u16::try_from(layers).map_err(|_| self.unsupported("number of layers", layers))
            }
        }
    }
}
