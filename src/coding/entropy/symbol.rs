//! From slots to symbols and back (spec, section 7.3). Finding the symbol of a slot is the step
//! that decoding time depends on most.

#[cfg(feature = "std")]
use fearless_simd::{Level, Simd, dispatch, i16x16, prelude::*};

/// Symbols of a model.
pub(crate) const SYMBOLS: usize = 16;
/// A model divides 2^15 slots among its symbols.
pub(crate) const SCALE_BITS: u32 = 15;

/// The first slot of each symbol, which is its cumulative frequency, then the number of all slots.
/// They increase from 0 to 2^15, which as an `i16` is -2^15.
pub(crate) type CumulativeFrequencies = [i16; SYMBOLS + 1];

/// The last of the [`CumulativeFrequencies`].
pub(crate) const END: i16 = i16::MIN;

/// The symbol of a slot.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) struct SlotSymbol {
    pub(crate) symbol: u32,
    /// The number of the symbol's slots that come before this slot.
    pub(crate) offset: u32,
    /// The number of the symbol's slots.
    pub(crate) frequency: u32,
}

impl SlotSymbol {
    fn new(starts: &CumulativeFrequencies, slot: u32, symbol: usize) -> Self {
        let (start, frequency) = slots_of(starts, symbol);
        Self { symbol: symbol as u32, offset: slot - start, frequency }
    }
}

/// The first slot of a symbol, and the number of its slots.
pub(crate) fn slots_of(starts: &CumulativeFrequencies, symbol: usize) -> (u32, u32) {
    let [start, end] = [symbol, symbol + 1].map(|index| u32::from(starts[index] as u16));
    (start, end - start)
}

/// The instructions with which symbols are found and models adapted. All give the same results.
pub(crate) trait SymbolSearch: Copy {
    /// The symbol of a slot below 2^15.
    fn find(self, starts: &CumulativeFrequencies, slot: u32) -> SlotSymbol;

    /// Moves the starts of all symbols towards `targets` by 2^-rate of the difference, rounded
    /// down.
    fn adapt(self, starts: &mut CumulativeFrequencies, targets: &[i16; SYMBOLS], rate: u8);
}

/// SIMD at the level that the whole program is compiled for; scalar code without `std`.
#[derive(Clone, Copy, Debug)]
pub(crate) struct BaselineSearch;

impl SymbolSearch for BaselineSearch {
    #[inline(always)]
    fn find(self, starts: &CumulativeFrequencies, slot: u32) -> SlotSymbol {
        #[cfg(feature = "std")]
        let symbol = dispatch!(Level::baseline(), simd => symbol_of_slot(simd, starts, slot));
        #[cfg(not(feature = "std"))]
        let symbol = scalar_symbol_of_slot(starts, slot);
        SlotSymbol::new(starts, slot, symbol)
    }

    #[inline(always)]
    fn adapt(self, starts: &mut CumulativeFrequencies, targets: &[i16; SYMBOLS], rate: u8) {
        #[cfg(feature = "std")]
        dispatch!(Level::baseline(), simd => adapt(simd, starts, targets, rate));
        #[cfg(not(feature = "std"))]
        for (start, target) in starts.iter_mut().zip(targets) {
            *start += (target - *start) >> rate;
        }
    }
}

#[cfg(feature = "std")]
#[inline(always)]
fn adapt<S: Simd>(simd: S, starts: &mut CumulativeFrequencies, targets: &[i16; SYMBOLS], rate: u8) {
    let starts = starts.first_chunk_mut().expect("one for each symbol");
    let old = i16x16::load_array_ref(simd, starts);
    let change = (i16x16::load_array_ref(simd, targets) - old) >> u32::from(rate);
    (old + change).store_array(starts);
}

#[cfg(feature = "std")]
#[inline(always)]
fn symbol_of_slot<S: Simd>(simd: S, starts: &CumulativeFrequencies, slot: u32) -> usize {
    let starts = starts.first_chunk().expect("one for each symbol");
    let later = i16x16::load_array_ref(simd, starts).simd_gt(slot as i16);
    // At least one, since symbol 0 starts at 0.
    (later.to_bitmask() | 1 << SYMBOLS).trailing_zeros() as usize - 1
}

#[cfg(any(not(feature = "std"), all(test, feature = "encode")))]
fn scalar_symbol_of_slot(starts: &CumulativeFrequencies, slot: u32) -> usize {
    starts[..SYMBOLS].iter().filter(|&&start| start as u32 <= slot).count() - 1
}

/// AVX2, with the instruction of SSE4.1 for the least of eight numbers. It gives the distances from
/// the slot to the starts before and after it directly, without waiting for the symbol.
#[cfg(all(feature = "std", any(target_arch = "x86", target_arch = "x86_64")))]
#[derive(Clone, Copy, Debug)]
pub(crate) struct Avx2Search(pub(crate) fearless_simd::Avx2);

#[cfg(all(feature = "std", any(target_arch = "x86", target_arch = "x86_64")))]
impl SymbolSearch for Avx2Search {
    #[inline(always)]
    fn find(self, starts: &CumulativeFrequencies, slot: u32) -> SlotSymbol {
        find_by_distance(self.0, starts, slot)
    }

    #[inline(always)]
    fn adapt(self, starts: &mut CumulativeFrequencies, targets: &[i16; SYMBOLS], rate: u8) {
        adapt(self.0, starts, targets, rate);
    }
}

#[cfg(all(feature = "std", any(target_arch = "x86", target_arch = "x86_64")))]
fearless_simd::kernel!(
    #[inline]
    fn find_by_distance(avx2: Avx2, starts: &CumulativeFrequencies, slot: u32) -> SlotSymbol {
        #[cfg(target_arch = "x86")]
        use core::arch::x86 as arch;
        #[cfg(target_arch = "x86_64")]
        use core::arch::x86_64 as arch;

        use arch::{
            __m128i, _mm_cmpgt_epi16, _mm_cvtsi128_si32, _mm_max_epu16, _mm_min_epu16,
            _mm_minpos_epu16, _mm_movemask_epi8, _mm_packs_epi16, _mm_set1_epi16, _mm_sub_epi16,
            _mm_xor_si128,
        };
        use fearless_simd::i16x8;

        let eight_from = |first: usize| -> __m128i {
            let eight = starts[first..].first_chunk().expect("seventeen in all");
            i16x8::load_array_ref(avx2, eight).into()
        };
        let least = |distances| {
            let least = _mm_cvtsi128_si32(_mm_minpos_epu16(distances));
            least as u32 & ((1 << SCALE_BITS) - 1)
        };
        let at = _mm_set1_epi16(slot as i16);
        let (low, high) = (eight_from(0), eight_from(8));
        // How many slots each start lies before this one, modulo 2^16: starts after it give 2^15 or
        // more. The least is the offset within the symbol.
        let (before_low, before_high) = (_mm_sub_epi16(at, low), _mm_sub_epi16(at, high));
        let offset = least(_mm_min_epu16(before_low, before_high));
        // The complement of such a difference counts the slots between this one and a start after
        // it. The least of them is the number of the symbol's slots after this one.
        let between = _mm_xor_si128(_mm_max_epu16(before_low, before_high), _mm_set1_epi16(-1));
        // In the last symbol no start lies after the slot. The largest difference is then that to
        // start 0, and its complement without the highest bit counts the slots up to 2^15.
        let rest = least(between);
        let later = _mm_packs_epi16(_mm_cmpgt_epi16(low, at), _mm_cmpgt_epi16(high, at));
        let symbol = (SYMBOLS as u32 - 1) - (_mm_movemask_epi8(later) as u32).count_ones();
        SlotSymbol { symbol, offset, frequency: offset + rest + 1 }
    }
);

#[cfg(all(test, feature = "encode"))]
mod tests {
    use super::*;
    use crate::testing::simd_levels;

    #[test]
    fn the_symbol_of_every_slot_is_found() {
        // Some symbols have one slot, one has nearly all.
        let starts = &core::array::from_fn(|index| match index as i16 {
            16 => END,
            symbol @ 0..4 => symbol,
            symbol => 29_000 + 9 * symbol * symbol,
        });
        for slot in 0..1 << SCALE_BITS {
            let symbol = scalar_symbol_of_slot(starts, slot);
            let (start, frequency) = slots_of(starts, symbol);
            assert!((start..start + frequency).contains(&slot), "{slot}: {symbol}");
            for (name, level) in simd_levels() {
                let found = dispatch!(level, simd => symbol_of_slot(simd, starts, slot));
                assert_eq!(found, symbol, "{name}: {slot}");
            }
            let found = SlotSymbol::new(starts, slot, symbol);
            assert_eq!(BaselineSearch.find(starts, slot), found, "{slot}");
            #[cfg(any(target_arch = "x86", target_arch = "x86_64"))]
            if let Some(avx2) = Level::new().as_avx2() {
                assert_eq!(Avx2Search(avx2).find(starts, slot), found, "{slot}");
            }
        }
    }
}
