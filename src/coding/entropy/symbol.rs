//! Which symbol a share stands for: what entropy decoding waits for most.

#[cfg(feature = "std")]
use fearless_simd::{Level, Simd, dispatch, i16x16, prelude::*};

/// Symbols of a model.
pub(crate) const SYMBOLS: usize = 16;
/// Probabilities of a model are shares of 2^15.
pub(crate) const SCALE_BITS: u32 = 15;

/// The shares of all symbols before each one, summed up, and at the end those of all: from 0 to
/// 2^15, whose bits are those of the smallest `i16`.
pub(crate) type Starts = [i16; SYMBOLS + 1];

/// The last of [`Starts`].
pub(crate) const END: i16 = i16::MIN;

/// The symbol of a share.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) struct Found {
    pub(crate) symbol: u32,
    /// The symbol's shares before this one.
    pub(crate) offset: u32,
    /// All of the symbol's shares.
    pub(crate) size: u32,
}

impl Found {
    fn new(starts: &Starts, share: u32, symbol: usize) -> Self {
        let (start, size) = shares_of(starts, symbol);
        Self { symbol: symbol as u32, offset: share - start, size }
    }
}

/// The first of a symbol's shares, and how many they are.
pub(crate) fn shares_of(starts: &Starts, symbol: usize) -> (u32, u32) {
    let [start, end] = [symbol, symbol + 1].map(|index| u32::from(starts[index] as u16));
    (start, end - start)
}

/// A way to find symbols.
pub(crate) trait SymbolSearch: Copy {
    /// The symbol of a share below 2^15.
    fn find(self, starts: &Starts, share: u32) -> Found;

    /// Moves starts towards others by 2^-rate of the distance, rounded down.
    fn approach(self, starts: &mut Starts, targets: &[i16; SYMBOLS], rate: u8);
}

/// With what every machine of the kind has.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Portable;

impl SymbolSearch for Portable {
    #[inline(always)]
    fn find(self, starts: &Starts, share: u32) -> Found {
        #[cfg(feature = "std")]
        let symbol = dispatch!(Level::baseline(), simd => symbol_at(simd, starts, share));
        #[cfg(not(feature = "std"))]
        let symbol = plain_symbol_at(starts, share);
        Found::new(starts, share, symbol)
    }

    #[inline(always)]
    fn approach(self, starts: &mut Starts, targets: &[i16; SYMBOLS], rate: u8) {
        #[cfg(feature = "std")]
        dispatch!(Level::baseline(), simd => approach(simd, starts, targets, rate));
        #[cfg(not(feature = "std"))]
        for (start, target) in starts.iter_mut().zip(targets) {
            *start += (target - *start) >> rate;
        }
    }
}

#[cfg(feature = "std")]
#[inline(always)]
fn approach<S: Simd>(simd: S, starts: &mut Starts, targets: &[i16; SYMBOLS], rate: u8) {
    let starts = starts.first_chunk_mut().expect("one for each symbol");
    let old = i16x16::load_array_ref(simd, starts);
    let change = (i16x16::load_array_ref(simd, targets) - old) >> u32::from(rate);
    (old + change).store_array(starts);
}

#[cfg(feature = "std")]
#[inline(always)]
fn symbol_at<S: Simd>(simd: S, starts: &Starts, share: u32) -> usize {
    let starts = starts.first_chunk().expect("one for each symbol");
    let later = i16x16::load_array_ref(simd, starts).simd_gt(share as i16);
    // Symbol 0 starts at 0.
    (later.to_bitmask() | 1 << SYMBOLS).trailing_zeros() as usize - 1
}

#[cfg(any(not(feature = "std"), all(test, feature = "encode")))]
fn plain_symbol_at(starts: &Starts, share: u32) -> usize {
    starts[..SYMBOLS].iter().filter(|&&start| start as u32 <= share).count() - 1
}

/// With an instruction for the least of eight numbers: the distances of the starts on either side
/// are there before the symbol is.
#[cfg(all(feature = "std", any(target_arch = "x86", target_arch = "x86_64")))]
#[derive(Clone, Copy, Debug)]
pub(crate) struct Avx2Search(pub(crate) fearless_simd::Avx2);

#[cfg(all(feature = "std", any(target_arch = "x86", target_arch = "x86_64")))]
impl SymbolSearch for Avx2Search {
    #[inline(always)]
    fn find(self, starts: &Starts, share: u32) -> Found {
        nearest(self.0, starts, share)
    }

    #[inline(always)]
    fn approach(self, starts: &mut Starts, targets: &[i16; SYMBOLS], rate: u8) {
        approach(self.0, starts, targets, rate);
    }
}

#[cfg(all(feature = "std", any(target_arch = "x86", target_arch = "x86_64")))]
fearless_simd::kernel!(
    #[inline]
    fn nearest(avx2: Avx2, starts: &Starts, share: u32) -> Found {
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
        let at = _mm_set1_epi16(share as i16);
        let (low, high) = (eight_from(0), eight_from(8));
        // How far each start lies before the share; of one that lies after it this wraps around, to
        // 2^15 and more. All bits turned, it is how many shares lie between, and the other way
        // round.
        let (before_low, before_high) = (_mm_sub_epi16(at, low), _mm_sub_epi16(at, high));
        let offset = least(_mm_min_epu16(before_low, before_high));
        let turned = _mm_xor_si128(_mm_max_epu16(before_low, before_high), _mm_set1_epi16(-1));
        // No start lies after the last symbol's shares: the largest distance is that from 0, and
        // without its highest bit that to 2^15.
        let rest = least(turned);
        let later = _mm_packs_epi16(_mm_cmpgt_epi16(low, at), _mm_cmpgt_epi16(high, at));
        let symbol = (SYMBOLS as u32 - 1) - (_mm_movemask_epi8(later) as u32).count_ones();
        Found { symbol, offset, size: offset + rest + 1 }
    }
);

#[cfg(all(test, feature = "encode"))]
mod tests {
    use super::*;
    use crate::coding::entropy::rans::Model;
    use crate::testing::simd_levels;

    #[test]
    fn the_symbol_of_every_share_is_found() {
        let mut model = Model::new(core::array::from_fn(|index| (index * 2048) as i16));
        // Shares of one and of nearly all among them.
        for symbol in [3; 300].into_iter().chain([15, 0, 15]) {
            model.update(Portable, symbol);
        }
        let starts = model.starts();
        for share in 0..1 << SCALE_BITS {
            let symbol = plain_symbol_at(starts, share);
            let (start, size) = shares_of(starts, symbol);
            assert!((start..start + size).contains(&share), "{share}: {symbol}");
            for (name, level) in simd_levels() {
                let found = dispatch!(level, simd => symbol_at(simd, starts, share));
                assert_eq!(found, symbol, "{name}: {share}");
            }
            let found = Found::new(starts, share, symbol);
            assert_eq!(Portable.find(starts, share), found, "{share}");
            #[cfg(any(target_arch = "x86", target_arch = "x86_64"))]
            if let Some(avx2) = Level::new().as_avx2() {
                assert_eq!(Avx2Search(avx2).find(starts, share), found, "{share}");
            }
        }
    }
}
