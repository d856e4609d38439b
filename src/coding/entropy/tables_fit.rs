//! How the tables of [`super::tables`] are made.

use std::fmt::Write;

use super::contexts;
use super::rans::{Model, RansDecoder, SymbolCoder};
use super::symbol::SYMBOLS;
use super::tables;
use crate::chunk::ChunkType;
use crate::coding::layer_count::LayerCount;
use crate::container::{Dequantizer, Event, Header, Parser, varint};

/// How often each symbol of each context was coded.
type SymbolCounts = Vec<[f64; SYMBOLS]>;

/// A coder that counts the symbols that another one codes.
struct SymbolCounter<C> {
    coder: C,
    counts: SymbolCounts,
}

impl<C: SymbolCoder> SymbolCoder for SymbolCounter<C> {
    fn symbol(&mut self, context: usize, symbol: u32) -> u32 {
        let symbol = self.coder.symbol(context, symbol);
        self.counts[context][symbol as usize] += 1.0;
        symbol
    }

    fn bits(&mut self, count: u32, value: u32) -> u32 {
        self.coder.bits(count, value)
    }

    fn refuse(&mut self) {
        self.coder.refuse();
    }
}

/// Prints the tables that fit the entropy-coded files in the folder `GIP_TABLES`, each of which has
/// the same weight:
///
///     GIP_TABLES=DIR cargo test --release fit_the_tables -- --ignored --nocapture
#[test]
#[ignore = "prints the tables of src/coding/entropy/tables.rs"]
fn fit_the_tables() {
    let folder = std::env::var("GIP_TABLES").expect("a folder in GIP_TABLES");
    let mut totals = vec![[0.0; SYMBOLS]; contexts::COUNT];
    for entry in std::fs::read_dir(folder).expect("a folder") {
        let bytes = std::fs::read(entry.expect("an entry").path()).expect("a file");
        for (total, counts) in totals.iter_mut().zip(counts(&bytes)) {
            for (total, count) in total.iter_mut().zip(counts) {
                *total += count;
            }
        }
    }
    let mut text = String::new();
    for (total, before) in totals.iter().zip(&tables::STARTS) {
        writeln!(text, "    {:?},", starts(total, before)).expect("a string");
    }
    println!("{text}");
}

/// The symbols of a file, per thousand Gaussians.
fn counts(file: &[u8]) -> SymbolCounts {
    let (header, dequantizer) =
        Header::parse(&payloads(file, ChunkType::HEADER)[0]).expect("valid");
    let Some(Dequantizer::Entropy(quantization)) = dequantizer else { panic!("not entropy coded") };
    let coder = header.layer_coder(&quantization);
    let mut counts = vec![[0.0; SYMBOLS]; contexts::COUNT];
    let mut left = header.gaussians;
    let layers = payloads(file, ChunkType::LAYER);
    for (number, payload) in layers.iter().enumerate() {
        let mut models = tables::initial_models();
        let mut bytes = &payload[..];
        let declared = LayerCount::new(left, layers.len() - 1 - number);
        let count = declared.read(&mut varint::Arriving::default(), &mut bytes);
        let count = count.expect("a valid layer").expect("a whole layer");
        left -= count;
        let decoder = RansDecoder::new(bytes, &mut models);
        let mut counter = SymbolCounter { coder: decoder, counts };
        coder.read_with(&mut counter, count as usize, |_, _| ());
        assert!(counter.coder.is_complete());
        counts = counter.counts;
    }
    let factor = 1000.0 / f64::from(header.gaussians);
    counts.iter().map(|counts| counts.map(|count| factor * count)).collect()
}

/// The payloads of all chunks of a type.
fn payloads(mut file: &[u8], wanted: ChunkType) -> Vec<Vec<u8>> {
    let mut parser = Parser::new();
    let mut payloads = Vec::new();
    loop {
        match parser.next(&mut file).expect("a valid file") {
            Event::NeedMore => break payloads,
            Event::Begin(chunk, _) if chunk == wanted => payloads.push(Vec::new()),
            Event::Payload(bytes) if parser.current() == Some(wanted) => {
                payloads.last_mut().expect("it has begun").extend_from_slice(bytes);
            }
            _ => {}
        }
    }
}

/// The starts that fit the counts of a context. Counts of rare symbols are noisy, so the
/// frequencies of the table before are added as a prior.
fn starts(counts: &[f64; SYMBOLS], before: &[i16; SYMBOLS]) -> [i16; SYMBOLS] {
    /// Fewest slots of a symbol.
    const MIN_SLOTS: f64 = 8.0;
    /// The weight of the prior, in symbols per thousand Gaussians.
    const PRIOR: f64 = 100.0;

    let model = Model::new(*before);
    let prior = model.costs().map(|bits| PRIOR * (-f64::from(bits)).exp2());
    let weights: Vec<f64> = counts.iter().zip(prior).map(|(a, b)| a + b).collect();
    let total: f64 = weights.iter().sum();
    let mut sum = 0.0;
    core::array::from_fn(|symbol| {
        let shared = 32768.0 - MIN_SLOTS * SYMBOLS as f64;
        let start = MIN_SLOTS * symbol as f64 + shared * sum / total;
        sum += weights[symbol];
        start.round() as i16
    })
}
