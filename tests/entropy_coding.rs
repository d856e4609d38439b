//! The entropy coding: the crate and a coder that is written from the specification alone find the same
//! in whatever bytes.

mod common;

use common::entropy::{self, Code, Grid};
use common::rans::{self, Op};
use common::steps::{self, at_most};
use common::{
    ENTROPY, File, Header, Random, bits, cases, chunk, decode_pieces, number, of_chunks,
    read_number,
};
use image_gip::{ChunkType, DecodeError, Limits, StreamDecoder};
use proptest::prelude::*;

/// Decodes without limits: sides may be as long as the format allows.
fn decode(bytes: &[u8]) -> (StreamDecoder, Result<(), DecodeError>) {
    decode_pieces([bytes], Limits::none())
}

/// A number whose magnitude has up to `bits` bits, each length as likely.
fn integer(random: &mut Random, bits: u64) -> i32 {
    let length = random.next() % (bits + 1);
    let magnitude = (random.next() & ((1 << length) - 1)) as i32;
    if random.next() & 1 == 1 { -magnitude } else { magnitude }
}

/// Codes of all exponents, mostly small, some beyond the symbols, anywhere in the grid.
fn code(random: &mut Random, header: &Header, spread: u32) -> Code {
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
        axes: (0..header.channels()).map(|_| integer(random, long)).collect(),
        size: integer(random, long),
        ratio: integer(random, long),
        slant: integer(random, long),
        center,
    }
}

/// Steps of every size that a header can state, most of them as small as an encoder's.
fn random_steps(random: &mut Random, channels: usize) -> Vec<f32> {
    let [least, most] = [steps::LEAST, steps::MOST].map(steps::step);
    let is_wild = random.next().is_multiple_of(4);
    let mut step = |low: f32| {
        let (low, high) = if is_wild { (least, most) } else { (low, low * 64.0) };
        at_most(random.decades(low, high).clamp(least, most))
    };
    let first = step(0.01);
    let mut steps = [0.1, 0.05, 0.05, 0.05].map(&mut step).to_vec();
    if random.next().is_multiple_of(3) {
        steps = steps::usual_geometry().to_vec();
    }
    steps.push(first);
    steps.extend((1..channels).map(|_| {
        let step = first * steps::ratio(random.next() as u8);
        if (least..=most).contains(&step) { step } else { first }
    }));
    steps
}

fn random_file(seed: u64) -> File {
    let mut random = Random(seed);
    let mut side = || random.decades(1.0, if seed.is_multiple_of(4) { 1_048_576.0 } else { 200.0 });
    let header = Header { width: side() as u32, height: side() as u32, ..Header::default() };
    let header = Header { color: (random.next() % 4) as u8, ..header };
    let steps = random_steps(&mut random, header.channels());
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

/// Checks that crate and oracle make the same of the bytes of a layer, whether it is sound or not: where it is the last
/// one, and where it begins with its number.
#[track_caller]
fn compare(header: &Header, steps: &[f32], count: u32, bytes: &[u8]) {
    let expected = entropy::read(header.sides(), steps, count, bytes);
    let last = crate_reads(header, steps, [count, 1], bytes);
    check(&expected, &last);
    let counted = [&number(count)[..], bytes].concat();
    let another = crate_reads(header, steps, [count + 1, 2], &counted);
    check(&expected, &another);
}

/// Checks the same of the payload of a layer that begins with its number of Gaussians, at most this.
#[track_caller]
fn compare_counted(header: &Header, steps: &[f32], most: u32, payload: &[u8]) {
    let expected = match read_number(payload) {
        None => Err("no number"),
        Some((count, _)) if count == 0 || count > most => Err("a wrong number"),
        Some((count, bytes)) => entropy::read(header.sides(), steps, count, bytes),
    };
    check(&expected, &crate_reads(header, steps, [most + 1, 2], payload));
}

/// What the crate finds in the first layer of a file that declares this many Gaussians and layers, of which it has just
/// this one; `None` if the layer is malformed.
fn crate_reads(
    header: &Header,
    steps: &[f32],
    [gaussians, layers]: [u32; 2],
    payload: &[u8],
) -> Option<Vec<[u32; 9]>> {
    let form = u8::from(!steps::has_usual_geometry(steps));
    let header = Header { coding: ENTROPY, form, gaussians, layers, ..*header };
    let chunks = [header.chunk(&steps::bytes(steps)), chunk(b"L", payload), chunk(b"E", &[])];
    let (decoder, result) = decode(&of_chunks(&chunks));
    match result {
        Err(DecodeError::Malformed { chunk: ChunkType::LAYER, .. }) => return None,
        Err(DecodeError::Malformed { chunk: ChunkType::END, .. }) if layers == 2 => {}
        result => result.expect("the rest is sound"),
    }
    Some(bits(decoder.gaussians()))
}

#[track_caller]
fn check(expected: &Result<entropy::Layer, rans::Flaw>, found: &Option<Vec<[u32; 9]>>) {
    let expected = expected.as_ref().map(|layer| oracle_bits(&layer.values));
    match (expected, found) {
        (Ok(expected), Some(found)) => assert_eq!(*found, expected),
        (Err(_), None) => {}
        (Ok(_), None) => panic!("only the oracle reads it"),
        (Err(flaw), Some(_)) => panic!("only the crate reads it: {flaw}"),
    }
}

/// The first layer of a random file: its header, steps, number of Gaussians, symbols and bits.
fn layer(seed: u64) -> (Header, Vec<f32>, u32, Vec<Op>) {
    let file = random_file(seed);
    let coded = file.entropy_coded.expect("entropy-coded");
    let mut codes = coded.layers[0].clone();
    let ops = entropy::write(file.header.sides(), &coded.steps, &mut codes);
    (file.header, coded.steps, codes.len() as u32, ops)
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
            let count = codes.len() as u32;
            let layer =
                entropy::read(file.header.sides(), &coded.steps, count, &rans::encode(&ops));
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
        let header = Header { color, width: sides.0, height: sides.1, ..Header::default() };
        let steps = vec![0.125; 4 + header.channels()];
        compare(&header, &steps, count, &bytes);
    }

    #[test]
    fn damaged_layers_are_judged_alike(
        seed: u64,
        at: usize,
        change in 1_u8..,
        shorter: bool,
        counted: bool,
    ) {
        let (header, steps, count, ops) = layer(seed);
        let bytes = rans::encode(&ops);
        // The last layer, or one that begins with its number.
        let prefix = if counted { number(count) } else { Vec::new() };
        let mut payload = [prefix, bytes].concat();
        let at = at % payload.len();
        if shorter {
            payload.truncate(at);
        } else {
            payload[at] ^= change;
        }
        if counted {
            compare_counted(&header, &steps, count, &payload);
        } else {
            compare(&header, &steps, count, &payload);
        }
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
        compare(&header, &steps, count, &rans::encode(&ops));
    }
}
