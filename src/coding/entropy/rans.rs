//! The entropy coder: asymmetric numeral systems with adaptive models of sixteen symbols (spec,
//! section 7.3; Duda 2013, Giesen 2014).

#[cfg(feature = "encode")]
use alloc::vec::Vec;

#[cfg(feature = "std")]
use super::symbol::shares_of;
use super::symbol::{END, Portable, SCALE_BITS, SYMBOLS, Starts, SymbolSearch};

/// States are at least this, so that one word of 16 bits always restores them.
const LEAST_STATE: u32 = 1 << 16;
/// Most bits that one call passes.
pub(crate) const MAX_BITS: u32 = 16;
/// A model learns by 1/32 of what is new at first, then more slowly: after so many symbols each
/// time by half as much.
const FIRST_RATE: u8 = 5;
const SLOWER_AFTER: [u8; 2] = [32, 96];
/// The rates, as powers of 1/2, by how many symbols were seen.
const RATES: [u8; 256] = {
    let mut rates = [FIRST_RATE; 256];
    let mut seen = 0;
    while seen < rates.len() {
        rates[seen] += (seen >= SLOWER_AFTER[0] as usize) as u8;
        rates[seen] += (seen >= SLOWER_AFTER[1] as usize) as u8;
        seen += 1;
    }
    rates
};

/// How probable each symbol is, and what was seen to make it so. In a cache line of its own: every
/// symbol waits for one.
#[derive(Clone, Copy, Debug)]
#[repr(align(64))]
pub(crate) struct Model {
    starts: Starts,
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
    pub(crate) fn new(starts: [i16; SYMBOLS]) -> Self {
        let mut model = Self { starts: [END; SYMBOLS + 1], seen: 0 };
        model.starts[..SYMBOLS].copy_from_slice(&starts);
        model
    }

    /// Learns from a symbol. Every symbol keeps a share.
    #[inline(always)]
    pub(crate) fn update(&mut self, search: impl SymbolSearch, symbol: usize) {
        let rate = RATES[usize::from(self.seen)];
        self.seen += u8::from(self.seen < SLOWER_AFTER[1]);
        search.approach(&mut self.starts, &TARGETS[symbol % SYMBOLS], rate);
    }

    #[cfg(all(test, feature = "encode"))]
    pub(crate) fn starts(&self) -> &Starts {
        &self.starts
    }

    /// What each symbol costs, in bits.
    #[cfg(feature = "std")]
    pub(crate) fn costs(&self) -> [f32; SYMBOLS] {
        let size = |symbol| shares_of(&self.starts, symbol).1;
        core::array::from_fn(|symbol| SCALE_BITS as f32 - (size(symbol) as f32).log2())
    }
}

/// A direction of coding: walks over what is coded are written once, for the encoder, which knows
/// the values, and for the decoder, which does not and passes anything.
pub(crate) trait SymbolCoder {
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

/// Reads what an [`RansEncoder`] wrote. Whether the bytes were sound is known at the end.
#[derive(Debug)]
pub(crate) struct RansDecoder<'a, S = Portable> {
    models: &'a mut [Model],
    search: S,
    state: u32,
    words: &'a [[u8; 2]],
    /// Words used, even of those that are not there.
    used: usize,
    refused: bool,
}

impl<'a> RansDecoder<'a> {
    /// A decoder of `bytes`, one model for each context.
    pub(crate) fn new(bytes: &'a [u8], models: &'a mut [Model]) -> Self {
        Self::with_search(bytes, models, Portable)
    }
}

impl<'a, S: SymbolSearch> RansDecoder<'a, S> {
    /// A decoder that finds symbols in a certain way.
    #[inline(always)]
    pub(crate) fn with_search(bytes: &'a [u8], models: &'a mut [Model], search: S) -> Self {
        let (words, rest) = bytes.as_chunks();
        let refused = !rest.is_empty();
        let mut decoder = Self { models, search, state: 0, words, used: 0, refused };
        // The first state, then words as they are needed.
        for part in 0..2 {
            decoder.state |= decoder.next() << (16 * part);
            decoder.used += 1;
        }
        decoder.refused |= decoder.state < LEAST_STATE;
        decoder
    }

    /// Whether all bytes were used and led back to where the encoder began.
    #[inline(always)]
    pub(crate) fn is_complete(&self) -> bool {
        !self.refused && self.used == self.words.len() && self.state == LEAST_STATE
    }

    /// The next word; zeros after the last.
    #[inline(always)]
    fn next(&self) -> u32 {
        // No `map_or`: it would also ask whether there is a reference.
        if self.used < self.words.len() {
            u16::from_le_bytes(self.words[self.used]).into()
        } else {
            0
        }
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
impl RansDecoder<'_> {
    /// What the symbols of a context cost now, in bits.
    pub(crate) fn costs(&self, context: usize) -> [f32; SYMBOLS] {
        self.models[context].costs()
    }
}

impl<S: SymbolSearch> SymbolCoder for RansDecoder<'_, S> {
    #[inline(always)]
    fn symbol(&mut self, context: usize, _: u32) -> u32 {
        let model = &mut self.models[context];
        let share = self.state & ((1 << SCALE_BITS) - 1);
        let found = self.search.find(&model.starts, share);
        model.update(self.search, found.symbol as usize);
        self.state = found.size * (self.state >> SCALE_BITS) + found.offset;
        self.restore();
        found.symbol
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

/// Collects what a [`RansDecoder`] will read. Numeral systems are stacks: the bytes are made at the
/// end, last symbol first.
#[cfg(feature = "encode")]
#[derive(Debug)]
pub(crate) struct RansEncoder<'a> {
    models: &'a mut [Model],
    /// For each symbol its first share, how many it has, and out of how many as a power of two: in
    /// pieces, since they take more memory than all else that a file is made from.
    shares: Vec<Vec<(u16, u16, u8)>>,
}

#[cfg(feature = "encode")]
impl<'a> RansEncoder<'a> {
    /// An encoder with one model for each context.
    pub(crate) fn new(models: &'a mut [Model]) -> Self {
        Self { models, shares: Vec::new() }
    }

    fn push(&mut self, share: (u16, u16, u8)) {
        const PIECE: usize = 1 << 12;
        if self.shares.last().is_none_or(|piece| piece.len() == PIECE) {
            self.shares.push(Vec::with_capacity(PIECE));
        }
        self.shares.last_mut().expect("there is one now").push(share);
    }

    /// The bytes.
    pub(crate) fn finish(self) -> Vec<u8> {
        let mut state = LEAST_STATE;
        let mut words: Vec<u16> = Vec::new();
        for &(start, size, scale) in self.shares.iter().flatten().rev() {
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
impl SymbolCoder for RansEncoder<'_> {
    fn symbol(&mut self, context: usize, symbol: u32) -> u32 {
        let model = &mut self.models[context];
        let (start, size) = shares_of(&model.starts, symbol as usize);
        model.update(Portable, symbol as usize);
        self.push((start as u16, size as u16, SCALE_BITS as u8));
        symbol
    }

    fn bits(&mut self, count: u32, value: u32) -> u32 {
        assert!(count <= MAX_BITS && value >> count == 0, "a value wider than its bits");
        self.push((value as u16, 1, count as u8));
        value
    }

    fn refuse(&mut self) {
        unreachable!("an encoder knows what it codes")
    }
}

/// What every symbol of every context costs, in bits.
#[cfg(feature = "encode")]
pub(crate) type SymbolCosts = Vec<[f32; SYMBOLS]>;

/// Sums up what coding would cost, without learning.
#[cfg(feature = "encode")]
#[derive(Clone, Copy, Debug)]
pub(crate) struct CostCounter<'a> {
    pub(crate) costs: &'a SymbolCosts,
    /// Bits.
    pub(crate) bits: f32,
}

#[cfg(feature = "encode")]
impl SymbolCoder for CostCounter<'_> {
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
    use crate::testing::config;
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

    fn pass(coder: &mut impl SymbolCoder, items: &[Item], known: bool) -> Vec<u32> {
        let given = |value| if known { value } else { 0 };
        let code = |item: &Item| match *item {
            Item::Symbol(context, symbol) => coder.symbol(context, given(symbol)),
            Item::Bits(count, value) => coder.bits(count, given(value)),
        };
        items.iter().map(code).collect()
    }

    fn encoded(items: &[Item]) -> (Vec<u8>, Vec<u32>) {
        let mut models = [flat(); 3];
        let mut encoder = RansEncoder::new(&mut models);
        let values = pass(&mut encoder, items, true);
        (encoder.finish(), values)
    }

    proptest! {
        #![proptest_config(config(200))]

        #[test]
        fn what_is_encoded_is_decoded(items in items()) {
            let (bytes, values) = encoded(&items);
            let mut models = [flat(); 3];
            let mut decoder = RansDecoder::new(&bytes, &mut models);
            prop_assert_eq!(pass(&mut decoder, &items, false), values);
            prop_assert!(decoder.is_complete());
        }

        #[test]
        fn missing_bytes_are_noticed(items in items(), cut in 1_usize..5) {
            let (bytes, _) = encoded(&items);
            let mut models = [flat(); 3];
            let mut decoder = RansDecoder::new(&bytes[..bytes.len() - cut], &mut models);
            pass(&mut decoder, &items, false);
            prop_assert!(!decoder.is_complete());
        }

        #[test]
        fn every_symbol_keeps_a_share(symbols in prop::collection::vec(0_usize..16, 0..600)) {
            let mut model = flat();
            for symbol in symbols {
                model.update(Portable, symbol);
                let shares = (0..SYMBOLS).map(|symbol| shares_of(&model.starts, symbol).1);
                prop_assert!(shares.clone().all(|share| (1..1 << SCALE_BITS).contains(&share)));
                prop_assert_eq!(shares.sum::<u32>(), 1 << SCALE_BITS);
            }
        }
    }

    #[test]
    fn a_model_learns() {
        let mut model = flat();
        assert!((model.costs()[3] - 4.0).abs() < 1e-6);
        for _ in 0..2000 {
            model.update(Portable, 3);
        }
        assert!(model.costs()[3] < 0.02, "{:?}", model.costs());
    }

    #[test]
    fn the_cost_is_what_the_bytes_come_to() {
        let mut random = fastrand::Rng::with_seed(1);
        let symbols: Vec<u32> =
            (0..20_000).map(|_| (random.f32() * random.f32() * 16.0) as u32).collect();
        let (mut models, mut learning) = ([flat()], [flat()]);
        let mut encoder = RansEncoder::new(&mut models);
        let mut bits = 0.0;
        for &symbol in &symbols {
            let costs = vec![learning[0].costs()];
            let mut cost = CostCounter { costs: &costs, bits: 0.0 };
            cost.symbol(0, symbol);
            bits += cost.bits;
            learning[0].update(Portable, symbol as usize);
            encoder.symbol(0, symbol);
        }
        let written = encoder.finish().len() as f32 * 8.0;
        assert!((written / bits - 1.0).abs() < 1e-3, "{written} bits, {bits} expected");
    }
}
