//! `tXTR`: the Gaussians of a texture's map (spec, section 5.7).

use alloc::vec;
use alloc::vec::Vec;

use super::map;
use crate::chunk::ChunkType;
#[cfg(feature = "encode")]
use crate::coding::entropy::Code;
use crate::coding::entropy::{LayerCoder, Quantization, steps};
use crate::container::Header;
use crate::container::fields::Fields;
#[cfg(feature = "encode")]
use crate::container::varint;
use crate::error::DecodeError;
use crate::gaussian::Gaussian;

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
    /// When the payload breaks a rule, which may be that of a layer, and those of `check`.
    pub(crate) fn parse(
        payload: &[u8],
        picture: &Header,
        check: impl FnOnce(u32) -> Result<(), DecodeError>,
    ) -> Result<Self, DecodeError> {
        let header = map::header(picture);
        let mut fields = Fields::new(ChunkType::TXTR, payload);
        let quantization = quantization(steps::read(&mut fields)?);
        let count = fields.varint()?;
        if count == 0 {
            return Err(fields.malformed("no Gaussians"));
        }
        if u64::from(count) > u64::from(header.width) * u64::from(header.height) {
            return Err(fields.malformed("more Gaussians than nodes"));
        }
        let bytes = fields.rest();
        LayerCoder::check_count(count, bytes)?;
        check(count)?;
        let coder = header.layer_coder(&quantization);
        let mut gaussians = vec![Gaussian::NOTHING; count as usize];
        coder.read_gaussians(bytes, None, header.color, &mut gaussians)?;
        Ok(Self { header, gaussians })
    }

    /// The payload of a map with these codes, which it sorts into the order of the file, and a step that a file can
    /// have.
    #[cfg(feature = "encode")]
    pub(crate) fn to_payload(codes: &mut [Code], step: f32, picture: &Header) -> Vec<u8> {
        let quantization = quantization(step);
        let layer = map::header(picture).layer_coder(&quantization).write(codes);
        let mut payload = Vec::new();
        steps::write(step, &mut payload);
        varint::write(codes.len() as u32, &mut payload);
        payload.extend(layer.bytes);
        payload
    }

    /// The header of the map of a picture.
    #[cfg(feature = "encode")]
    pub(crate) fn map_header(picture: &Header) -> Header {
        map::header(picture)
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
fn quantization(step: f32) -> Quantization {
    Quantization::new(steps::USUAL_GEOMETRY, vec![step; map::CHANNELS])
}
