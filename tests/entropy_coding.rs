//! The entropy coding: the crate and a coder that is written from the specification alone find the same
//! in whatever bytes.

mod common;

use common::entropy::{self, Code, Grid};
use common::rans::{self, Op};
use common::{File, Ghdr, Random, bits, cases, chunk, decode_pieces, of_chunks, steps};
use image_gip::{ChunkType, DecodeError, Limits, StreamDecoder};
use proptest::prelude::*;

/// Decodes without limits: sides may be as long as the format allows.
fn decode(bytes: &[u8]) -> (StreamDecoder, Result<(), DecodeError>) {
    decode_pieces([bytes], Limits::none())
}

/// A number whose magnitude has up to `bits` bits, each length as likely.
fn number(random: &mut Random, bits: u64) -> i32 {
    let length = random.next() % (bits + 1);
    let magnitude = (random.next() & ((1 << length) - 1)) as i32;
    if random.next() & 1 == 1 { -magnitude } else { magnitude }
}

/// Codes of all exponents, mostly small, some beyond the symbols, anywhere in the grid.
fn code(random: &mut Random, header: &Ghdr, spread: u32) -> Code {
    let grid = Grid::new(header.sides());
    let exponent = (random.next() % 8) as u32;
    let long = if random.next().is_multiple_of(8) { 15 } else { 5 };
    let center = grid.roots.map(|roots| {
        let side = roots * grid.root * 128;
        let start = side / 3;
        start + (random.next() % u64::from((side - start).min(spread))) as u32
    });
    Code {
        exponent,
        axes: (0..header.channels()).map(|_| number(random, long)).collect(),
        size: number(random, long),
        ratio: number(random, long),
        slant: number(random, long),
        center,
    }
}

fn random_file(seed: u64) -> File {
    let mut random = Random(seed);
    let mut side = || random.decades(1.0, if seed.is_multiple_of(4) { 1_048_576.0 } else { 200.0 });
    let header = Ghdr { width: side() as u32, height: side() as u32, ..Ghdr::default() };
    let header = Ghdr { color: (random.next() % 4) as u8, ..header };
    let small = |step: f32| (step, step * 64.0);
    let extreme = (2_f32.powi(-20), 2_f32.powi(10));
    let ranges = [small(0.1), small(0.05), small(0.05), small(0.05)];
    let of_axis = small(0.01);
    let range = ranges.into_iter().chain([of_axis; 4]).take(4 + header.channels());
    let wild = random.next().is_multiple_of(4);
    let range = range.map(|range| if wild { extreme } else { range });
    let steps = range.map(|(low, high)| random.decades(low, high).clamp(extreme.0, extreme.1));
    let steps: Vec<f32> = steps.collect();
    let layers = (0..1 + random.next() % 3).map(|_| {
        let most = if random.next().is_multiple_of(8) { 600 } else { 20 };
        let spread = if random.next().is_multiple_of(3) { 200 } else { u32::MAX };
        let count = 1 + random.next() % most;
        (0..count).map(|_| code(&mut random, &header, spread)).collect()
    });
    let layers = layers.collect();
    File::of_entropy_coded(header, steps, layers)
}

/// The bits of what the oracle read, as [`bits`] gives those of what the crate read.
fn oracle_bits(values: &[Vec<f32>]) -> Vec<[u32; 9]> {
    let bits = |values: &Vec<f32>| {
        let mut all = [0; 9];
        all.iter_mut().zip(values).for_each(|(bits, value)| *bits = value.to_bits());
        all
    };
    values.iter().map(bits).collect()
}

/// An entropy-coded file with this payload of its only layer.
fn with_payload(header: &Ghdr, steps_of_file: &[f32], payload: &[u8]) -> Vec<u8> {
    of_chunks(&[
        chunk(b"GHDR", &header.payload()),
        chunk(b"QNTZ", &steps(steps_of_file)),
        chunk(b"GAUS", payload),
        chunk(b"GEND", &[]),
    ])
}

/// Checks that crate and oracle make the same of one layer, whether it is sound or not.
#[track_caller]
fn compare(header: &Ghdr, steps: &[f32], payload: &[u8]) {
    let count = payload.first_chunk().map_or(1, |count| u32::from_le_bytes(*count));
    let header = Ghdr { coding: 1, gaussians: count.max(1), layers: 1, ..*header };
    let (decoder, result) = decode(&with_payload(&header, steps, payload));
    match (entropy::read(header.sides(), steps, payload), result) {
        (Ok(layer), Ok(())) => {
            assert_eq!(oracle_bits(&layer.values), bits(decoder.gaussians()));
        }
        (Err(_), Err(DecodeError::Malformed { chunk: ChunkType::GAUS, .. })) => {}
        (oracle, result) => panic!("the oracle: {:?}; the crate: {result:?}", oracle.map(|_| ())),
    }
}

/// The first layer of a random file: its header, steps, number of Gaussians, symbols and bits.
fn layer(seed: u64) -> (Ghdr, Vec<f32>, u32, Vec<Op>) {
    let file = random_file(seed);
    let coded = file.entropy_coded.expect("entropy-coded");
    let mut codes = coded.layers[0].clone();
    let ops = entropy::write(file.header.sides(), &coded.steps, &mut codes);
    (file.header, coded.steps, codes.len() as u32, ops)
}

fn payload(count: u32, ops: &[Op]) -> Vec<u8> {
    [&count.to_le_bytes()[..], &rans::encode(ops)].concat()
}

proptest! {
    #![proptest_config(cases(200))]
    #[test]
    fn what_the_oracle_writes_is_read_alike(seed: u64) {
        let file = random_file(seed);
        let coded = file.entropy_coded.as_ref().expect("entropy-coded");
        let mut values = Vec::new();
        for layer in &coded.layers {
            let mut codes = layer.clone();
            let ops = entropy::write(file.header.sides(), &coded.steps, &mut codes);
            let count = (codes.len() as u32).to_le_bytes();
            let payload = [&count[..], &rans::encode(&ops)].concat();
            let layer = entropy::read(file.header.sides(), &coded.steps, &payload);
            let layer = layer.expect("what the oracle wrote");
            prop_assert_eq!(layer.ops, ops);
            prop_assert_eq!(layer.codes, codes);
            values.extend(layer.values);
        }
        let (decoder, result) = decode(&file.bytes());
        result.expect("what the oracle wrote");
        prop_assert_eq!(bits(decoder.gaussians()), oracle_bits(&values));
    }

    #[test]
    fn bytes_without_sense_are_judged_alike(
        color in 0_u8..4,
        sides in (1_u32..3000, 1_u32..3000),
        count in 1_u32..100,
        bytes in prop::collection::vec(any::<u8>(), 0..100),
    ) {
        let header = Ghdr { color, width: sides.0, height: sides.1, ..Ghdr::default() };
        let steps = vec![0.1; 4 + header.channels()];
        compare(&header, &steps, &[&count.to_le_bytes()[..], &bytes].concat());
    }

    #[test]
    fn damaged_layers_are_judged_alike(seed: u64, at: usize, change in 1_u8.., shorter: bool) {
        let (header, steps, count, ops) = layer(seed);
        let mut payload = payload(count, &ops);
        let at = at % payload.len();
        if shorter {
            payload.truncate(at);
        } else {
            payload[at] ^= change;
        }
        compare(&header, &steps, &payload);
    }

    /// The bytes are sound for some symbols, but not for those that the tree asks for.
    #[test]
    fn other_symbols_are_judged_alike(seed: u64, at: usize, from_end: bool, other in 0_u32..16) {
        let (header, steps, count, mut ops) = layer(seed);
        let at = if from_end { ops.len() - 1 - at % ops.len().min(20) } else { at % ops.len() };
        match &mut ops[at] {
            Op::Symbol { symbol, .. } => *symbol = other,
            Op::Bits { count, value } => *value = other & ((1 << *count) - 1),
        }
        compare(&header, &steps, &payload(count, &ops));
    }
}
