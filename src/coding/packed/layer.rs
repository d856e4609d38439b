//! Layers of the packed coding (spec, section 7.2).

use super::bits::BitReader;
use super::quantizer::Quantizer;
use crate::chunk::ChunkType;
use crate::coding::layer_count::LayerCount;
use crate::container::varint;
use crate::error::DecodeError;
use crate::gaussian::MAX_COMPONENTS;
#[cfg(feature = "encode")]
use alloc::vec::Vec;

/// The number of bytes of the codes of `count` Gaussians.
pub(crate) fn packed_length(quantizers: &[Quantizer], count: u32) -> u64 {
    let bits = quantizers.iter().map(|quantizer| u64::from(quantizer.bits())).sum::<u64>();
    (bits * u64::from(count)).div_ceil(8)
}

/// Reads one layer as its bytes arrive.
#[derive(Debug)]
pub(crate) struct PackedLayerReader {
    /// What is known of the number of Gaussians, and its bytes.
    declared: LayerCount,
    arriving: varint::Arriving,
    /// The number of Gaussians in this layer, once its bytes have arrived.
    count: Option<u32>,
    bits: BitReader,
    /// The number of Gaussians that were read.
    done: u32,
    /// The components of the Gaussian that is arriving.
    values: [f32; MAX_COMPONENTS],
    /// The number of its components that have arrived.
    filled: usize,
    /// Bytes of payload that the chunk declares.
    length: u32,
}

impl PackedLayerReader {
    /// A reader for a payload of `length` bytes.
    pub(crate) fn new(length: u32, declared: LayerCount) -> Self {
        Self {
            declared,
            arriving: varint::Arriving::default(),
            count: None,
            bits: BitReader::default(),
            done: 0,
            values: [0.0; MAX_COMPONENTS],
            filled: 0,
            length,
        }
    }

    /// The number of Gaussians in this layer: just as many as the payload has bytes for. `None` until its bytes have
    /// arrived.
    pub(crate) fn count(
        &mut self,
        input: &mut &[u8],
        quantizers: &[Quantizer],
    ) -> Result<Option<u32>, DecodeError> {
        if self.count.is_none() {
            let Some(count) = self.declared.read(&mut self.arriving, input)? else {
                return Ok(None);
            };
            let codes = packed_length(quantizers, count);
            if u64::from(self.length) != u64::from(self.arriving.bytes()) + codes {
                return Err(malformed("the length does not match the number of Gaussians"));
            }
            self.count = Some(count);
        }
        Ok(self.count)
    }

    /// Reads the components of the next Gaussian: two of position, three of shape, one per channel.
    /// `None` until all its bytes have arrived, and after the last Gaussian.
    pub(crate) fn next(
        &mut self,
        input: &mut &[u8],
        quantizers: &[Quantizer],
    ) -> Result<Option<&[f32; MAX_COMPONENTS]>, DecodeError> {
        if self.count.is_none_or(|count| self.done == count) {
            return Ok(None);
        }
        while self.filled < quantizers.len() {
            let quantizer = &quantizers[self.filled];
            let Some(code) = self.bits.read(quantizer.bits().into(), input) else {
                return Ok(None);
            };
            let value = quantizer.value(code);
            if !value.is_finite() {
                return Err(malformed("an attribute that is not finite"));
            }
            self.values[self.filled] = value;
            self.filled += 1;
        }
        self.filled = 0;
        self.done += 1;
        Ok(Some(&self.values))
    }

    /// Checks, after the last byte of the payload, that all Gaussians were read and the padding is
    /// zero.
    pub(crate) fn finish(&self) -> Result<(), DecodeError> {
        if self.count != Some(self.done) {
            return Err(malformed("too short for its number of Gaussians"));
        }
        if !self.bits.is_padding() {
            return Err(malformed("a padding bit is not zero"));
        }
        Ok(())
    }
}

fn malformed(reason: &'static str) -> DecodeError {
    DecodeError::malformed(ChunkType::LAYER, reason)
}

/// The Gaussians of a file with the packed coding, as codes.
#[cfg(feature = "encode")]
#[derive(Clone, Debug)]
pub(crate) struct PackedCodes {
    pub(crate) quantizers: Vec<Quantizer>,
    /// For each Gaussian in file order, the code of each component.
    pub(crate) codes: Vec<[u32; MAX_COMPONENTS]>,
}

/// The bytes of these codes.
#[cfg(feature = "encode")]
pub(crate) fn write_layer(codes: &[[u32; MAX_COMPONENTS]], quantizers: &[Quantizer]) -> Vec<u8> {
    let mut writer = super::bits::BitWriter::default();
    for gaussian in codes {
        for (&code, quantizer) in gaussian.iter().zip(quantizers) {
            writer.write(code, quantizer.bits().into());
        }
    }
    writer.finish()
}
