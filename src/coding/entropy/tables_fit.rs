//! How the tables of [`super::tables`] are made.

use std::fmt::Write;

use super::contexts;
use super::layer::LayerCoder;
use super::quantization::Quantization;
use super::rans::{Model, RansDecoder, SymbolCoder};
use super::symbol::SYMBOLS;
use super::tables;
use crate::container::Header;

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
    let mut rest = &file[8..];
    let mut chunks = Vec::new();
    while let Some((length, after)) = rest.split_first_chunk::<4>() {
        let (kind, after) = after.split_at(4);
        let (payload, after) = after.split_at(u32::from_le_bytes(*length) as usize);
        chunks.push((kind, payload));
        rest = &after[4..];
    }
    let of = |wanted: &'static [u8]| chunks.iter().filter(move |(kind, _)| *kind == wanted);
    let header = Header::parse(of(b"GHDR").next().expect("a header").1).expect("a valid header");
    let channels = header.color.channels();
    let steps = of(b"QNTZ").next().expect("steps").1;
    let quantization = Quantization::parse(steps, channels).expect("valid steps");
    let coder = LayerCoder::new(&quantization, &header);
    let mut counts = vec![[0.0; SYMBOLS]; contexts::COUNT];
    for (_, payload) in of(b"GAUS") {
        let mut models = tables::initial_models();
        let (count, bytes) =
            LayerCoder::read_count(payload, header.gaussians).expect("a valid layer");
        let decoder = RansDecoder::new(bytes, &mut models);
        let mut counter = SymbolCounter { coder: decoder, counts };
        coder.read_with(&mut counter, count, |_, _| ());
        assert!(counter.coder.is_complete());
        counts = counter.counts;
    }
    let factor = 1000.0 / f64::from(header.gaussians);
    counts.iter().map(|counts| counts.map(|count| factor * count)).collect()
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
