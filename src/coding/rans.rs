//! The entropy coder: asymmetric numeral systems with adaptive models of sixteen symbols (spec,
//! section 7.3; Duda 2013, Giesen 2014).

#[cfg(feature = "encode")]
use alloc::vec::Vec;

#[cfg(feature = "std")]
use fearless_simd::{Level, Simd, dispatch, i16x16, prelude::*};

/// Symbols of a model.
pub(crate) const SYMBOLS: usize = 16;
/// Probabilities of a model are shares of 2^15.
const SCALE_BITS: u32 = 15;
/// States are at least this, so that one word of 16 bits always restores them.
const LEAST_STATE: u32 = 1 << 16;
/// Most bits that one call passes.
pub(crate) const MAX_BITS: u32 = 16;
/// A model learns by 1/32 of what is new at first, then more slowly: after so many symbols each
/// time by half as much.
const FIRST_RATE: u8 = 5;
const SLOWER_AFTER: [u8; 2] = [32, 96];

/// How probable each symbol is, and what was seen to make it so.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Model {
    /// The shares of all symbols before each one, summed up: the first is 0.
    starts: [i16; SYMBOLS],
    seen: u8,
}

/// Where the shares would start if only one symbol ever came, with one share for each other.
const TARGETS: [[i16; SYMBOLS]; SYMBOLS] = {
    let mut targets = [[0; SYMBOLS]; SYMBOLS];
    let mut symbol = 0;
    while symbol < SYMBOLS {
        let mut index = 0;
        while index < SYMBOLS {
            let rest = if index > symbol { (1 << SCALE_BITS) - SYMBOLS } else { 0 };
            targets[symbol][index] = (rest + index) as i16;
            index += 1;
        }
        symbol += 1;
    }
    targets
};

impl Model {
    /// A model that expects what its `starts` say: increasing from 0, all below 2^15.
    pub(crate) const fn new(starts: [i16; SYMBOLS]) -> Self {
        Self { starts, seen: 0 }
    }

    /// The first of the shares that stand for a symbol, and how many they are.
    fn share(&self, symbol: usize) -> (u32, u32) {
        let start = self.starts[symbol] as u32;
        let end = self.starts.get(symbol + 1).map_or(1 << SCALE_BITS, |&end| end as u32);
        (start, end - start)
    }

    /// The symbol that one of the shares stands for.
    fn symbol_at(&self, share: u32) -> usize {
        #[cfg(feature = "std")]
        return dispatch!(Level::baseline(), simd => self.symbol_at_with(simd, share));
        #[cfg(not(feature = "std"))]
        self.plain_symbol_at(share)
    }

    /// All at once, with what every machine of the kind has.
    #[cfg(feature = "std")]
    #[inline(always)]
    fn symbol_at_with<S: Simd>(&self, simd: S, share: u32) -> usize {
        let later = i16x16::load_array_ref(simd, &self.starts).simd_gt(share as i16);
        // Symbol 0 starts at 0.
        (later.to_bitmask() | 1 << SYMBOLS).trailing_zeros() as usize - 1
    }

    #[cfg(any(not(feature = "std"), all(test, feature = "encode")))]
    fn plain_symbol_at(&self, share: u32) -> usize {
        self.starts.iter().filter(|&&start| start as u32 <= share).count() - 1
    }

    /// Learns from a symbol. Every symbol keeps a share.
    fn update(&mut self, symbol: usize) {
        let rate =
            FIRST_RATE + SLOWER_AFTER.map(|after| u8::from(self.seen >= after)).iter().sum::<u8>();
        self.seen = self.seen.saturating_add(1);
        for (start, target) in self.starts.iter_mut().zip(&TARGETS[symbol]) {
            *start += (target - *start) >> rate;
        }
    }

    /// What each symbol costs, in bits.
    #[cfg(feature = "std")]
    pub(crate) fn costs(&self) -> [f32; SYMBOLS] {
        core::array::from_fn(|symbol| SCALE_BITS as f32 - (self.share(symbol).1 as f32).log2())
    }
}

/// A direction of coding: walks over what is coded are written once, for the encoder, which knows
/// the values, and for the decoder, which does not and passes anything.
pub(crate) trait Coder {
    /// Codes a symbol below [`SYMBOLS`] by the model of a context, which learns from it. Returns
    /// the symbol.
    fn symbol(&mut self, context: usize, symbol: u32) -> u32;

    /// Codes the low `count` <= [`MAX_BITS`] bits of a value without a model. Returns them.
    fn bits(&mut self, count: u32, value: u32) -> u32;

    /// Notes that what was coded has no meaning.
    fn refuse(&mut self);

    /// Notes what is coded from here on.
    fn begin(&mut self, _: Attribute) {}
}

/// What a Gaussian's bits are for.
#[derive(Clone, Copy, Debug)]
pub(crate) enum Attribute {
    Position,
    Precision,
    Shape,
    Color,
}

/// Reads what an [`Encoder`] wrote. Whether the bytes were sound is known at the end.
#[derive(Debug)]
pub(crate) struct Decoder<'a> {
    models: &'a mut [Model],
    state: u32,
    words: &'a [[u8; 2]],
    /// Words used, even of those that are not there.
    used: usize,
    refused: bool,
}

impl<'a> Decoder<'a> {
    /// A decoder of `bytes`, one model for each context.
    pub(crate) fn new(bytes: &'a [u8], models: &'a mut [Model]) -> Self {
        let (words, rest) = bytes.as_chunks();
        let mut decoder = Self { models, state: 0, words, used: 0, refused: !rest.is_empty() };
        // The first state, then words as they are needed.
        for part in 0..2 {
            decoder.state |= decoder.next() << (16 * part);
            decoder.used += 1;
        }
        decoder.refused |= decoder.state < LEAST_STATE;
        decoder
    }

    /// Whether all bytes were used and led back to where the encoder began.
    pub(crate) fn is_complete(&self) -> bool {
        !self.refused && self.used == self.words.len() && self.state == LEAST_STATE
    }

    /// The next word; zeros after the last.
    #[inline(always)]
    fn next(&self) -> u32 {
        self.words.get(self.used).map_or(0, |&word| u16::from_le_bytes(word).into())
    }

    /// Takes a word if the state needs one. Whether it does is as good as random, so there is no
    /// branch to be foreseen.
    #[inline(always)]
    fn restore(&mut self) {
        let next = self.next();
        let is_short = self.state < LEAST_STATE;
        self.state = if is_short { self.state << 16 | next } else { self.state };
        self.used += usize::from(is_short);
    }
}

#[cfg(feature = "std")]
impl Decoder<'_> {
    /// What the symbols of a context cost now, in bits.
    pub(crate) fn costs(&self, context: usize) -> [f32; SYMBOLS] {
        self.models[context].costs()
    }
}

impl Coder for Decoder<'_> {
    #[inline(always)]
    fn symbol(&mut self, context: usize, _: u32) -> u32 {
        let model = &mut self.models[context];
        let share = self.state & ((1 << SCALE_BITS) - 1);
        let symbol = model.symbol_at(share);
        let (start, size) = model.share(symbol);
        model.update(symbol);
        self.state = size * (self.state >> SCALE_BITS) + (share - start);
        self.restore();
        symbol as u32
    }

    #[inline(always)]
    fn bits(&mut self, count: u32, _: u32) -> u32 {
        let value = self.state & ((1 << count) - 1);
        self.state >>= count;
        self.restore();
        value
    }

    fn refuse(&mut self) {
        self.refused = true;
    }
}

/// Collects what a [`Decoder`] will read. Numeral systems are stacks: the bytes are made at the
/// end, last symbol first.
#[cfg(feature = "encode")]
#[derive(Debug)]
pub(crate) struct Encoder<'a> {
    models: &'a mut [Model],
    /// For each symbol its first share, how many it has, and out of how many as a power of two.
    shares: Vec<(u16, u16, u8)>,
}

#[cfg(feature = "encode")]
impl<'a> Encoder<'a> {
    /// An encoder with one model for each context.
    pub(crate) fn new(models: &'a mut [Model]) -> Self {
        Self { models, shares: Vec::new() }
    }

    /// The bytes.
    pub(crate) fn finish(self) -> Vec<u8> {
        let mut state = LEAST_STATE;
        let mut words: Vec<u16> = Vec::new();
        for &(start, size, scale) in self.shares.iter().rev() {
            let (start, size, scale) = (u32::from(start), u64::from(size), u32::from(scale));
            if u64::from(state) >= size << (32 - scale) {
                words.push(state as u16);
                state >>= 16;
            }
            let size = size as u32;
            state = ((state / size) << scale) + state % size + start;
        }
        words.extend([(state >> 16) as u16, state as u16]);
        words.iter().rev().flat_map(|word| word.to_le_bytes()).collect()
    }
}

#[cfg(feature = "encode")]
impl Coder for Encoder<'_> {
    fn symbol(&mut self, context: usize, symbol: u32) -> u32 {
        let model = &mut self.models[context];
        let (start, size) = model.share(symbol as usize);
        self.shares.push((start as u16, size as u16, SCALE_BITS as u8));
        model.update(symbol as usize);
        symbol
    }

    fn bits(&mut self, count: u32, value: u32) -> u32 {
        assert!(count <= MAX_BITS && value >> count == 0, "a value wider than its bits");
        self.shares.push((value as u16, 1, count as u8));
        value
    }

    fn refuse(&mut self) {
        unreachable!("an encoder knows what it codes")
    }
}

/// What every symbol of every context costs, in bits.
#[cfg(feature = "encode")]
pub(crate) type Costs = Vec<[f32; SYMBOLS]>;

/// Sums up what coding would cost, without learning.
#[cfg(feature = "encode")]
#[derive(Clone, Copy, Debug)]
pub(crate) struct Cost<'a> {
    pub(crate) costs: &'a Costs,
    /// Bits.
    pub(crate) bits: f32,
}

#[cfg(feature = "encode")]
impl Coder for Cost<'_> {
    fn symbol(&mut self, context: usize, symbol: u32) -> u32 {
        self.bits += self.costs[context][symbol as usize];
        symbol
    }

    fn bits(&mut self, count: u32, value: u32) -> u32 {
        self.bits += count as f32;
        value
    }

    fn refuse(&mut self) {}
}

#[cfg(all(test, feature = "encode"))]
mod tests {
    use super::*;
    use crate::testing::{config, simd_levels};
    use proptest::prelude::*;

    fn flat() -> Model {
        Model::new(core::array::from_fn(|index| (index * 2048) as i16))
    }

    /// What is coded in a test: a symbol by one of several models, or bits.
    #[derive(Clone, Copy, Debug)]
    enum Item {
        Symbol(usize, u32),
        Bits(u32, u32),
    }

    fn items() -> impl Strategy<Value = Vec<Item>> {
        let symbol = (0_usize..3, prop_oneof![0_u32..2, 0_u32..16])
            .prop_map(|(model, symbol)| Item::Symbol(model, symbol));
        let bits = (0_u32..=MAX_BITS, any::<u32>())
            .prop_map(|(count, value)| Item::Bits(count, value & ((1 << count) - 1)));
        prop::collection::vec(prop_oneof![4 => symbol, 1 => bits], 0..400)
    }

    fn pass(coder: &mut impl Coder, items: &[Item], known: bool) -> Vec<u32> {
        let given = |value| if known { value } else { 0 };
        let code = |item: &Item| match *item {
            Item::Symbol(context, symbol) => coder.symbol(context, given(symbol)),
            Item::Bits(count, value) => coder.bits(count, given(value)),
        };
        items.iter().map(code).collect()
    }

    fn encoded(items: &[Item]) -> (Vec<u8>, Vec<u32>) {
        let mut models = [flat(); 3];
        let mut encoder = Encoder::new(&mut models);
        let values = pass(&mut encoder, items, true);
        (encoder.finish(), values)
    }

    proptest! {
        #![proptest_config(config(200))]

        #[test]
        fn what_is_encoded_is_decoded(items in items()) {
            let (bytes, values) = encoded(&items);
            let mut models = [flat(); 3];
            let mut decoder = Decoder::new(&bytes, &mut models);
            prop_assert_eq!(pass(&mut decoder, &items, false), values);
            prop_assert!(decoder.is_complete());
        }

        #[test]
        fn missing_bytes_are_noticed(items in items(), cut in 1_usize..5) {
            let (bytes, _) = encoded(&items);
            let mut models = [flat(); 3];
            let mut decoder = Decoder::new(&bytes[..bytes.len() - cut], &mut models);
            pass(&mut decoder, &items, false);
            prop_assert!(!decoder.is_complete());
        }

        #[test]
        fn every_symbol_keeps_a_share(symbols in prop::collection::vec(0_usize..16, 0..600)) {
            let mut model = flat();
            for symbol in symbols {
                model.update(symbol);
                let shares = (0..SYMBOLS).map(|symbol| model.share(symbol).1);
                prop_assert!(shares.clone().all(|share| (1..1 << SCALE_BITS).contains(&share)));
                prop_assert_eq!(shares.sum::<u32>(), 1 << SCALE_BITS);
            }
        }
    }

    #[test]
    fn the_symbol_of_every_share_is_found() {
        let mut model = flat();
        // Shares of one and of nearly all among them.
        for symbol in [3; 300].into_iter().chain([15, 0, 15]) {
            model.update(symbol);
        }
        for share in 0..1 << SCALE_BITS {
            let symbol = model.plain_symbol_at(share);
            let (start, size) = model.share(symbol);
            assert!((start..start + size).contains(&share), "{share}: {symbol}");
            for (name, level) in simd_levels() {
                let found = dispatch!(level, simd => model.symbol_at_with(simd, share));
                assert_eq!(found, symbol, "{name}: {share}");
            }
        }
    }

    #[test]
    fn a_model_learns() {
        let mut model = flat();
        assert!((model.costs()[3] - 4.0).abs() < 1e-6);
        for _ in 0..2000 {
            model.update(3);
        }
        assert!(model.costs()[3] < 0.02, "{:?}", model.costs());
    }

    #[test]
    fn the_cost_is_what_the_bytes_come_to() {
        let mut random = fastrand::Rng::with_seed(1);
        let symbols: Vec<u32> =
            (0..20_000).map(|_| (random.f32() * random.f32() * 16.0) as u32).collect();
        let (mut models, mut learning) = ([flat()], [flat()]);
        let mut encoder = Encoder::new(&mut models);
        let mut bits = 0.0;
        for &symbol in &symbols {
            let costs = vec![learning[0].costs()];
            let mut cost = Cost { costs: &costs, bits: 0.0 };
            cost.symbol(0, symbol);
            bits += cost.bits;
            learning[0].update(symbol as usize);
            encoder.symbol(0, symbol);
        }
        let written = encoder.finish().len() as f32 * 8.0;
        assert!((written / bits - 1.0).abs() < 1e-3, "{written} bits, {bits} expected");
    }
}
