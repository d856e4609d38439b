//! The entropy coder: the range variant of asymmetric numeral systems (rANS) with adaptive models
//! of sixteen symbols (spec, section 7.3; Duda 2013, Giesen 2014).

#[cfg(feature = "encode")]
use alloc::vec::Vec;

#[cfg(feature = "std")]
use super::symbol::slots_of;
use super::symbol::{
    BaselineSearch, CumulativeFrequencies, END, SCALE_BITS, SYMBOLS, SymbolSearch,
};

/// The least state between symbols: a state below it is renormalized with one word of 16 bits.
const MIN_STATE: u32 = 1 << 16;
/// Most plain bits in one call.
pub(crate) const MAX_BITS: u32 = 16;
/// A model first moves by 2^-5 of the way to each symbol's target. After each of these numbers of
/// symbols the rate is one higher, and the model moves half as far.
const FIRST_RATE: u8 = 5;
const SLOWER_AFTER: [u8; 2] = [32, 96];
/// The rate for each number of symbols that a model has coded.
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

/// The adaptive probabilities of the symbols of one context. Each model has a cache line of its
/// own, so that no symbol waits for two.
#[derive(Clone, Copy, Debug)]
#[repr(align(64))]
pub(crate) struct Model {
    starts: CumulativeFrequencies,
    /// How many symbols were coded, counted up to the last change of the rate.
    seen: u8,
}

/// For each symbol the starts that a model approaches if only that symbol is coded: each other
/// symbol has one slot.
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
    /// A model with these first slots of the symbols: increasing from 0, all below 2^15.
    #[inline]
    pub(crate) fn new(starts: [i16; SYMBOLS]) -> Self {
        let mut model = Self { starts: [END; SYMBOLS + 1], seen: 0 };
        model.starts[..SYMBOLS].copy_from_slice(&starts);
        model
    }

    /// Adapts to a symbol. Every symbol keeps at least one slot.
    #[inline(always)]
    pub(crate) fn update(&mut self, search: impl SymbolSearch, symbol: usize) {
        let rate = RATES[usize::from(self.seen)];
        self.seen += u8::from(self.seen < SLOWER_AFTER[1]);
        search.adapt(&mut self.starts, &TARGETS[symbol % SYMBOLS], rate);
    }

    /// The cost of each symbol in bits: -log2 of its probability.
    #[cfg(feature = "std")]
    pub(crate) fn costs(&self) -> [f32; SYMBOLS] {
        let frequency = |symbol| slots_of(&self.starts, symbol).1;
        core::array::from_fn(|symbol| SCALE_BITS as f32 - (frequency(symbol) as f32).log2())
    }
}

/// An encoder or a decoder of symbols and plain bits.
///
/// The syntax of a layer is written once for both: every call is given a value and returns the
/// value that was coded. An encoder codes the value that it is given; a decoder ignores it.
pub(crate) trait SymbolCoder {
    /// Codes a symbol below [`SYMBOLS`] with the model of a context, which adapts to it.
    fn symbol(&mut self, context: usize, symbol: u32) -> u32;

    /// Codes `count` <= [`MAX_BITS`] plain bits: a value below 2^count, without a model.
    fn bits(&mut self, count: u32, value: u32) -> u32;

    /// Marks the coded data as malformed.
    fn refuse(&mut self);

    /// Says which attribute is coded from here on.
    fn begin(&mut self, _: Attribute) {}
}

/// What bits of a Gaussian are for.
#[derive(Clone, Copy, Debug)]
pub(crate) enum Attribute {
    Position,
    Precision,
    Shape,
    Color,
}

/// Reads what a [`RansEncoder`] wrote. Malformed bytes are decoded to arbitrary values. At the
/// end, [`RansDecoder::is_complete`] says whether the bytes were valid.
#[derive(Debug)]
pub(crate) struct RansDecoder<'a, S = BaselineSearch> {
    models: &'a mut [Model],
    search: S,
    state: u32,
    words: &'a [[u8; 2]],
    /// How many words were read, those past the end included.
    used: usize,
    refused: bool,
}

impl<'a> RansDecoder<'a> {
    /// A decoder of `bytes` with one model for each context.
    pub(crate) fn new(bytes: &'a [u8], models: &'a mut [Model]) -> Self {
        Self::with_search(bytes, models, BaselineSearch)
    }
}

impl<'a, S: SymbolSearch> RansDecoder<'a, S> {
    /// A decoder that finds symbols with `search`.
    #[inline(always)]
    pub(crate) fn with_search(bytes: &'a [u8], models: &'a mut [Model], search: S) -> Self {
        let (words, rest) = bytes.as_chunks();
        let refused = !rest.is_empty();
        let mut decoder = Self { models, search, state: 0, words, used: 0, refused };
        // The initial state.
        for part in 0..2 {
            decoder.state |= decoder.next_word() << (16 * part);
            decoder.used += 1;
        }
        decoder.refused |= decoder.state < MIN_STATE;
        decoder
    }

    /// Whether nothing was malformed, all bytes were read, and the state is the one that the
    /// encoder began with.
    #[inline(always)]
    pub(crate) fn is_complete(&self) -> bool {
        !self.refused && self.used == self.words.len() && self.state == MIN_STATE
    }

    /// The next word; zero past the end.
    #[inline(always)]
    fn next_word(&self) -> u32 {
        // Not `get` with `map_or`, which compiles to a second test, of the reference.
        if self.used < self.words.len() {
            u16::from_le_bytes(self.words[self.used]).into()
        } else {
            0
        }
    }

    /// Renormalizes the state if it is too small. Branchless: whether it is cannot be predicted.
    #[inline(always)]
    fn renormalize(&mut self) {
        let word = self.next_word();
        let is_small = self.state < MIN_STATE;
        self.state = if is_small { self.state << 16 | word } else { self.state };
        self.used += usize::from(is_small);
    }
}

#[cfg(feature = "std")]
impl RansDecoder<'_> {
    /// The present costs of the symbols of a context, in bits.
    pub(crate) fn costs(&self, context: usize) -> [f32; SYMBOLS] {
        self.models[context].costs()
    }
}

impl<S: SymbolSearch> SymbolCoder for RansDecoder<'_, S> {
    #[inline(always)]
    fn symbol(&mut self, context: usize, _: u32) -> u32 {
        let model = &mut self.models[context];
        let slot = self.state & ((1 << SCALE_BITS) - 1);
        let found = self.search.find(&model.starts, slot);
        model.update(self.search, found.symbol as usize);
        self.state = found.frequency * (self.state >> SCALE_BITS) + found.offset;
        self.renormalize();
        found.symbol
    }

    #[inline(always)]
    fn bits(&mut self, count: u32, _: u32) -> u32 {
        let value = self.state & ((1 << count) - 1);
        self.state >>= count;
        self.renormalize();
        value
    }

    fn refuse(&mut self) {
        self.refused = true;
    }
}

/// Writes what a [`RansDecoder`] reads. A rANS coder is a stack: what was encoded last is decoded
/// first. So this one collects the symbols, and encodes them at the end from the last to the first.
#[cfg(feature = "encode")]
#[derive(Debug)]
pub(crate) struct RansEncoder<'a> {
    models: &'a mut [Model],
    /// Of each symbol the first slot, the number of its slots, and log2 of the number of all slots.
    /// In pieces, so that no large vector is copied when it grows: this is most of the memory that
    /// writing a file takes.
    intervals: Vec<Vec<(u16, u16, u8)>>,
}

#[cfg(feature = "encode")]
impl<'a> RansEncoder<'a> {
    /// An encoder with one model for each context.
    pub(crate) fn new(models: &'a mut [Model]) -> Self {
        Self { models, intervals: Vec::new() }
    }

    fn push(&mut self, interval: (u16, u16, u8)) {
        const PIECE: usize = 1 << 12;
        if self.intervals.last().is_none_or(|piece| piece.len() == PIECE) {
            self.intervals.push(Vec::with_capacity(PIECE));
        }
        self.intervals.last_mut().expect("there is one now").push(interval);
    }

    /// The bytes.
    pub(crate) fn finish(self) -> Vec<u8> {
        let mut state = MIN_STATE;
        let mut words: Vec<u16> = Vec::new();
        for &(start, frequency, scale) in self.intervals.iter().flatten().rev() {
            let (start, scale) = (u32::from(start), u32::from(scale));
            if u64::from(state) >= u64::from(frequency) << (32 - scale) {
                words.push(state as u16);
                state >>= 16;
            }
            let frequency = u32::from(frequency);
            state = ((state / frequency) << scale) + state % frequency + start;
        }
        words.extend([(state >> 16) as u16, state as u16]);
        words.iter().rev().flat_map(|word| word.to_le_bytes()).collect()
    }
}

#[cfg(feature = "encode")]
impl SymbolCoder for RansEncoder<'_> {
    fn symbol(&mut self, context: usize, symbol: u32) -> u32 {
        let model = &mut self.models[context];
        let (start, frequency) = slots_of(&model.starts, symbol as usize);
        model.update(BaselineSearch, symbol as usize);
        self.push((start as u16, frequency as u16, SCALE_BITS as u8));
        symbol
    }

    fn bits(&mut self, count: u32, value: u32) -> u32 {
        assert!(count <= MAX_BITS && value >> count == 0, "a value wider than its bits");
        self.push((value as u16, 1, count as u8));
        value
    }

    fn refuse(&mut self) {
        unreachable!("an encoder codes valid values only")
    }
}

/// The cost of every symbol in every context, in bits.
#[cfg(feature = "encode")]
pub(crate) type SymbolCosts = Vec<[f32; SYMBOLS]>;

/// Sums up the cost of what is coded, with models that do not adapt.
#[cfg(feature = "encode")]
#[derive(Clone, Copy, Debug)]
pub(crate) struct CostCounter<'a> {
    pub(crate) costs: &'a SymbolCosts,
    /// The cost so far, in bits.
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

    /// What is coded in a test: a symbol with one of three models, or plain bits.
    #[derive(Clone, Copy, Debug)]
    enum Operation {
        Symbol(usize, u32),
        Bits(u32, u32),
    }

    fn items() -> impl Strategy<Value = Vec<Operation>> {
        let symbol = (0_usize..3, prop_oneof![0_u32..2, 0_u32..16])
            .prop_map(|(model, symbol)| Operation::Symbol(model, symbol));
        let bits = (0_u32..=MAX_BITS, any::<u32>())
            .prop_map(|(count, value)| Operation::Bits(count, value & ((1 << count) - 1)));
        prop::collection::vec(prop_oneof![4 => symbol, 1 => bits], 0..400)
    }

    /// Codes the items, as an encoder that knows their values or as a decoder that does not.
    fn code(coder: &mut impl SymbolCoder, items: &[Operation], known: bool) -> Vec<u32> {
        let given = |value| if known { value } else { 0 };
        let code_item = |item: &Operation| match *item {
            Operation::Symbol(context, symbol) => coder.symbol(context, given(symbol)),
            Operation::Bits(count, value) => coder.bits(count, given(value)),
        };
        items.iter().map(code_item).collect()
    }

    fn encoded(items: &[Operation]) -> (Vec<u8>, Vec<u32>) {
        let mut models = [flat(); 3];
        let mut encoder = RansEncoder::new(&mut models);
        let values = code(&mut encoder, items, true);
        (encoder.finish(), values)
    }

    proptest! {
        #![proptest_config(config(200))]

        #[test]
        fn what_is_encoded_is_decoded(items in items()) {
            let (bytes, values) = encoded(&items);
            let mut models = [flat(); 3];
            let mut decoder = RansDecoder::new(&bytes, &mut models);
            prop_assert_eq!(code(&mut decoder, &items, false), values);
            prop_assert!(decoder.is_complete());
        }

        #[test]
        fn missing_bytes_are_noticed(items in items(), cut in 1_usize..5) {
            let (bytes, _) = encoded(&items);
            let mut models = [flat(); 3];
            let mut decoder = RansDecoder::new(&bytes[..bytes.len() - cut], &mut models);
            code(&mut decoder, &items, false);
            prop_assert!(!decoder.is_complete());
        }

        #[test]
        fn every_symbol_keeps_a_slot(symbols in prop::collection::vec(0_usize..16, 0..600)) {
            let mut model = flat();
            for symbol in symbols {
                model.update(BaselineSearch, symbol);
                let counts = (0..SYMBOLS).map(|symbol| slots_of(&model.starts, symbol).1);
                prop_assert!(counts.clone().all(|count| (1..1 << SCALE_BITS).contains(&count)));
                prop_assert_eq!(counts.sum::<u32>(), 1 << SCALE_BITS);
            }
        }
    }

    #[test]
    fn a_model_adapts() {
        let mut model = flat();
        assert!((model.costs()[3] - 4.0).abs() < 1e-6);
        for _ in 0..2000 {
            model.update(BaselineSearch, 3);
        }
        assert!(model.costs()[3] < 0.02, "{:?}", model.costs());
    }

    #[test]
    fn the_cost_is_what_the_bytes_come_to() {
        let mut random = fastrand::Rng::with_seed(1);
        let symbols: Vec<u32> =
            (0..20_000).map(|_| (random.f32() * random.f32() * 16.0) as u32).collect();
        let (mut models, mut adapting) = ([flat()], [flat()]);
        let mut encoder = RansEncoder::new(&mut models);
        let mut bits = 0.0;
        for &symbol in &symbols {
            let costs = vec![adapting[0].costs()];
            let mut cost = CostCounter { costs: &costs, bits: 0.0 };
            cost.symbol(0, symbol);
            bits += cost.bits;
            adapting[0].update(BaselineSearch, symbol as usize);
            encoder.symbol(0, symbol);
        }
        let written = encoder.finish().len() as f32 * 8.0;
        assert!((written / bits - 1.0).abs() < 1e-3, "{written} bits, {bits} expected");
    }
}
