//! Numbers that are composed of symbols and plain bits (spec, section 7.3).
//!
//! All functions are inlined into the loop over Gaussians: a function that is called gets the coder
//! by reference, and then the coder's state cannot stay in registers.

use super::contexts;
use super::rans::{MAX_BITS, SymbolCoder};
use super::symbol::SYMBOLS;

/// The escape: the symbol for all numbers that the other symbols do not stand for.
pub(super) const ESCAPE: u32 = SYMBOLS as u32 - 1;
/// The symbols of a signed number stand for -7 to 7.
const MAX_SIGNED: i32 = 7;

/// Codes a signed number, its low `shift` bits as plain bits.
#[inline(always)]
pub(super) fn signed(coder: &mut impl SymbolCoder, context: usize, shift: u32, value: i32) -> i32 {
    let high = value >> shift;
    let escapes = high.unsigned_abs() > MAX_SIGNED as u32;
    let symbol = if escapes { ESCAPE } else { (high + MAX_SIGNED) as u32 };
    let mut decoded = coder.symbol(context, symbol) as i32 - MAX_SIGNED;
    if decoded > MAX_SIGNED {
        let negative = coder.bits(1, u32::from(high < 0)) == 1;
        let rest = excess(coder, high.unsigned_abs().wrapping_sub(MAX_SIGNED as u32 + 1)) as i32;
        let magnitude = rest + MAX_SIGNED + 1;
        decoded = if negative { -magnitude } else { magnitude };
    }
    decoded << shift | plain(coder, shift, value as u32 & ((1 << shift) - 1)) as i32
}

/// Codes an excess: the length of the number as a symbol, then its bits below the highest one (an
/// Elias gamma code; Elias, 1975).
#[inline(always)]
pub(super) fn excess(coder: &mut impl SymbolCoder, value: u32) -> u32 {
    let length = coder.symbol(contexts::EXCESS, value.saturating_add(1).ilog2().min(ESCAPE));
    let low = plain(coder, length, value.wrapping_add(1) & ((1 << length) - 1));
    (1 << length | low) - 1
}

/// Codes the low `count` bits of a value, 0 to 32, as plain bits.
#[inline(always)]
pub(super) fn plain(coder: &mut impl SymbolCoder, count: u32, value: u32) -> u32 {
    if count == 0 {
        return 0;
    }
    let low = count.min(MAX_BITS);
    let value = value & ((1_u64 << count) - 1) as u32;
    let bits = coder.bits(low, value & ((1 << low) - 1));
    if count > low { bits | coder.bits(count - low, value >> low) << low } else { bits }
}
