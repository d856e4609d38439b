//! The entropy coder by itself, for the fuzz target `coder`.

use alloc::vec::Vec;

use super::rans::{Coder, Decoder, Encoder};
use super::set::{Models, context};

/// What is coded.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Item {
    /// One of sixteen symbols, by the model of a context.
    Symbol {
        /// Below [`contexts`].
        context: usize,
        /// Below 16.
        symbol: u32,
    },
    /// Bits without a model.
    Bits {
        /// At most 16.
        count: u32,
        /// Below 2^count.
        value: u32,
    },
}

/// How many contexts there are.
#[must_use]
pub const fn contexts() -> usize {
    context::COUNT
}

/// The bytes of `items`.
#[must_use]
pub fn encode(items: &[Item]) -> Vec<u8> {
    let mut models = Models::default();
    let mut encoder = Encoder::new(models.all());
    code(&mut encoder, items);
    encoder.finish()
}

/// The values that `bytes` have in place of those of `items`, and whether they are sound.
#[must_use]
pub fn decode(bytes: &[u8], items: &[Item]) -> (Vec<u32>, bool) {
    let mut models = Models::default();
    let mut decoder = Decoder::new(bytes, models.all());
    let values = code(&mut decoder, items);
    (values, decoder.is_complete())
}

fn code(coder: &mut impl Coder, items: &[Item]) -> Vec<u32> {
    let code = |item: &Item| match *item {
        Item::Symbol { context, symbol } => coder.symbol(context, symbol),
        Item::Bits { count, value } => coder.bits(count, value),
    };
    items.iter().map(code).collect()
}
