//! Statistics: what the bits of a file are spent on.

#[cfg(feature = "std")]
use super::rans::{Attribute, RansDecoder, SymbolCoder};

/// Bits that Gaussians take in a file, by what they are for.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
#[non_exhaustive]
pub struct AttributeBits {
    /// Of the centres.
    pub position: f64,
    /// Of how precisely each Gaussian is stored; none with [`Coding::Packed`](crate::Coding).
    pub precision: f64,
    /// Of the covariances.
    pub shape: f64,
    /// Of the amplitudes in all channels.
    pub color: f64,
}

/// A decoder that counts the bits of what it reads.
#[cfg(feature = "std")]
#[derive(Debug)]
pub(crate) struct CountingDecoder<'a> {
    decoder: RansDecoder<'a>,
    bits: &'a mut AttributeBits,
    attribute: Attribute,
}

#[cfg(feature = "std")]
impl<'a> CountingDecoder<'a> {
    pub(crate) fn new(decoder: RansDecoder<'a>, bits: &'a mut AttributeBits) -> Self {
        Self { decoder, bits, attribute: Attribute::Position }
    }

    pub(crate) fn into_decoder(self) -> RansDecoder<'a> {
        self.decoder
    }

    fn add(&mut self, bits: f64) {
        let AttributeBits { position, precision, shape, color } = self.bits;
        *match self.attribute {
            Attribute::Position => position,
            Attribute::Precision => precision,
            Attribute::Shape => shape,
            Attribute::Color => color,
        } += bits;
    }
}

#[cfg(feature = "std")]
impl SymbolCoder for CountingDecoder<'_> {
    fn symbol(&mut self, context: usize, symbol: u32) -> u32 {
        let before = self.decoder.costs(context);
        let symbol = self.decoder.symbol(context, symbol);
        self.add(before[symbol as usize].into());
        symbol
    }

    fn bits(&mut self, count: u32, value: u32) -> u32 {
        self.add(count.into());
        self.decoder.bits(count, value)
    }

    fn refuse(&mut self) {
        self.decoder.refuse();
    }

    fn begin(&mut self, attribute: Attribute) {
        self.attribute = attribute;
    }
}
