//! How many bits of a file each attribute takes.

#[cfg(feature = "std")]
use super::rans::{Attribute, RansDecoder, SymbolCoder};

/// How many bits of a file each attribute takes, in all of its Gaussians together.
///
/// With [`Coding::Entropy`](crate::Coding) a symbol counts as -log2 of its probability.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
#[non_exhaustive]
pub struct AttributeBits {
    /// Bits of the centres, the k-d tree of cells included.
    pub position: f64,
    /// Bits of the step exponents; 0 with [`Coding::Packed`](crate::Coding).
    pub precision: f64,
    /// Bits of the covariances.
    pub shape: f64,
    /// Bits of the amplitudes in all channels.
    pub color: f64,
}

/// A decoder that counts the bits that it reads.
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
