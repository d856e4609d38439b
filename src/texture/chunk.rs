//! `tXTR`: the Gaussians of a texture's map (spec, section 5.7).

use alloc::vec;
use alloc::vec::Vec;

use super::map;
use crate::chunk::ChunkType;
#[cfg(feature = "encode")]
use crate::coding::entropy::Code;
use crate::coding::entropy::{LayerCoder, Quantization};
use crate::container::Header;
use crate::error::DecodeError;
use crate::gaussian::Gaussian;

/// The steps of position, size, ratio and slant.
const GEOMETRY: [f32; 4] = [1.095_445_1, 0.774_596_7, 0.866_025_4, 1.732_050_8];

/// The texture of a picture: the Gaussians of its map.
#[derive(Clone, Debug, PartialEq)]
pub(crate) struct Texture {
    /// The header of the map.
    header: Header,
    gaussians: Vec<Gaussian>,
}

impl Texture {
    /// Reads a payload. `check` decides whether so many Gaussians may be decoded.
    ///
    /// # Errors
    /// When the payload is malformed or has more Gaussians than the map has nodes, and those of `check`.
    pub(crate) fn parse(
        payload: &[u8],
        picture: &Header,
        check: impl FnOnce(u32) -> Result<(), DecodeError>,
    ) -> Result<Self, DecodeError> {
        let malformed = |reason| DecodeError::malformed(ChunkType::TXTR, reason);
        let named = |error: DecodeError| error.in_chunk(ChunkType::TXTR);
        let Some((step, layer)) = payload.split_first_chunk() else {
            return Err(malformed("too short for a step"));
        };
        let header = map::header(picture);
        let (count, bytes) = LayerCoder::read_count(layer, u32::MAX).map_err(named)?;
        if count as u64 > u64::from(header.width) * u64::from(header.height) {
            return Err(malformed("more Gaussians than nodes"));
        }
        check(count as u32)?;
        let quantization = quantization(f32::from_le_bytes(*step)).map_err(named)?;
        let coder = LayerCoder::new(&quantization, &header);
        let mut gaussians = vec![Gaussian::NOTHING; count];
        coder.read_gaussians(bytes, None, header.color, &mut gaussians).map_err(named)?;
        Ok(Self { header, gaussians })
    }

    /// The payload of a map with these codes, which it sorts into the order of the file.
    #[cfg(feature = "encode")]
    pub(crate) fn to_payload(codes: &mut [Code], step: f32, picture: &Header) -> Vec<u8> {
        let quantization = quantization(step).expect("a valid step");
        let layer = LayerCoder::new(&quantization, &map::header(picture)).write(codes);
        [&step.to_le_bytes(), &layer.payload[..]].concat()
    }

    /// The header of the map.
    pub(crate) fn header(&self) -> &Header {
        &self.header
    }

    /// The Gaussians of the map.
    pub(crate) fn gaussians(&self) -> &[Gaussian] {
        &self.gaussians
    }

    /// Bytes of memory that it holds.
    pub(crate) fn memory(&self) -> u64 {
        (self.gaussians.capacity() * size_of::<Gaussian>()) as u64
    }
}

/// The quantization grid of a map with this colour step.
fn quantization(step: f32) -> Result<Quantization, DecodeError> {
    Quantization::checked(GEOMETRY, vec![step; map::CHANNELS])
}
