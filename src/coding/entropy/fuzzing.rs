//! The entropy coder by itself, for the fuzz target `coder`.

use alloc::vec::Vec;

#[cfg(any(target_arch = "x86", target_arch = "x86_64"))]
use fearless_simd::Level;

use super::contexts;
use super::rans::{RansDecoder, RansEncoder, SymbolCoder};
#[cfg(any(target_arch = "x86", target_arch = "x86_64"))]
use super::symbol::Avx2Search;
use super::symbol::{BaselineSearch, SymbolSearch};
use super::tables;

/// What is coded: a symbol or plain bits.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Item {
    /// One of sixteen symbols, with the model of a context.
    Symbol {
        /// Below [`contexts`].
        context: usize,
        /// Below 16.
        symbol: u32,
    },
    /// Plain bits.
    Bits {
        /// At most 16.
        count: u32,
        /// Below 2^count.
        value: u32,
    },
}

/// The number of contexts.
#[must_use]
pub const fn contexts() -> usize {
    contexts::COUNT
}

/// The bytes of `items`.
#[must_use]
pub fn encode(items: &[Item]) -> Vec<u8> {
    let mut models = tables::initial_models();
    let mut encoder = RansEncoder::new(&mut models);
    code(&mut encoder, items);
    encoder.finish()
}

/// Decodes as many symbols and plain bits as `items` has, with its contexts and counts. Returns
/// their values, and whether the bytes are valid.
///
/// # Panics
/// When SIMD levels give different results.
#[must_use]
pub fn decode(bytes: &[u8], items: &[Item]) -> (Vec<u32>, bool) {
    let decoded = decode_with(BaselineSearch, bytes, items);
    #[cfg(any(target_arch = "x86", target_arch = "x86_64"))]
    if let Some(avx2) = Level::new().as_avx2() {
        assert_eq!(decode_with(Avx2Search(avx2), bytes, items), decoded);
    }
    decoded
}

fn decode_with(search: impl SymbolSearch, bytes: &[u8], items: &[Item]) -> (Vec<u32>, bool) {
    let mut models = tables::initial_models();
    let mut decoder = RansDecoder::with_search(bytes, &mut models, search);
    let values = code(&mut decoder, items);
    (values, decoder.is_complete())
}

fn code(coder: &mut impl SymbolCoder, items: &[Item]) -> Vec<u32> {
    let code = |item: &Item| match *item {
        Item::Symbol { context, symbol } => coder.symbol(context, symbol),
        Item::Bits { count, value } => coder.bits(count, value),
    };
    items.iter().map(code).collect()
}
