//! Coding 1: the crate and a coder that is written from the specification alone find the same in
//! whatever bytes.

mod common;

use common::coding1::{self, Code, Grid, Models};
use common::{File, GRAY, Ghdr, Random, Sets, bits, cases, chunk, decode_pieces, of_chunks, steps};
use image_gip::{DecodeError, Limits, StreamDecoder};
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

/// Codes of all classes, mostly small, some beyond the symbols, anywhere in the grid.
fn code(random: &mut Random, header: &Ghdr, spread: u32) -> Code {
    let grid = Grid::new(header);
    let class = (random.next() % 8) as u32;
    let long = if random.next().is_multiple_of(8) { 15 } else { 5 };
    let place = grid.roots.map(|roots| {
        let side = roots * grid.root * 128;
        let start = side / 3;
        start + (random.next() % u64::from((side - start).min(spread))) as u32
    });
    Code {
        class,
        axes: (0..header.channels()).map(|_| number(random, long)).collect(),
        size: number(random, long),
        ratio: number(random, long),
        slant: number(random, long),
        place,
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
    File::of_sets(header, steps, layers)
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

/// The payloads of a file with the header and steps of `file`, as bytes.
fn with_payloads(file: &File, sets: &Sets, payloads: &[Vec<u8>]) -> Vec<u8> {
    let mut chunks =
        vec![chunk(b"GHDR", &file.header.payload()), chunk(b"QNTZ", &steps(&sets.steps))];
    chunks.extend(payloads.iter().map(|payload| chunk(b"GAUS", payload)));
    chunks.push(chunk(b"GEND", &[]));
    of_chunks(&chunks)
}

/// What crate and oracle make of one layer that may be damaged: they must agree.
#[track_caller]
fn compare(header: &Ghdr, steps: &[f32], payload: &[u8]) -> bool {
    let count = payload.first_chunk().map_or(0, |count| u32::from_le_bytes(*count));
    let header = Ghdr { coding: 1, gaussians: count.clamp(1, 1 << 20), layers: 1, ..*header };
    let file = File { header, ..File::of_sets(header, steps.to_vec(), Vec::new()) };
    let file = File { header, ..file };
    let sets = file.sets.as_ref().expect("coding 1");
    let (decoder, result) = decode(&with_payloads(&file, sets, &[payload.to_vec()]));
    match (coding1::read(&header, steps, &mut Models::new(), payload), result) {
        (Ok(layer), Ok(())) => {
            assert_eq!(oracle_bits(&layer.values), bits(decoder.gaussians()));
            true
        }
        (Err(_), Err(_)) => false,
        (oracle, result) => panic!("the oracle: {:?}; the crate: {result:?}", oracle.map(|_| ())),
    }
}

proptest! {
    #![proptest_config(cases(200))]
    #[test]
    fn what_the_oracle_writes_is_read_alike(seed: u64) {
        let file = random_file(seed);
        let sets = file.sets.as_ref().expect("coding 1");
        let (mut written, mut read) = (Models::new(), Models::new());
        let mut values = Vec::new();
        for layer in &sets.layers {
            let mut codes = layer.clone();
            let ops = coding1::write(&file.header, &sets.steps, &mut codes);
            let count = (codes.len() as u32).to_le_bytes();
            let payload = [&count[..], &coding1::encode(&mut written, &ops)].concat();
            let layer = coding1::read(&file.header, &sets.steps, &mut read, &payload);
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
        let file = random_file(seed);
        let sets = file.sets.as_ref().expect("coding 1");
        let mut layer = sets.layers[0].clone();
        let ops = coding1::write(&file.header, &sets.steps, &mut layer);
        let count = (layer.len() as u32).to_le_bytes();
        let mut payload = [&count[..], &coding1::encode(&mut Models::new(), &ops)].concat();
        assert!(compare(&file.header, &sets.steps, &payload));
        let at = at % payload.len();
        if shorter {
            payload.truncate(at);
        } else {
            payload[at] ^= change;
        }
        compare(&file.header, &sets.steps, &payload);
    }
}

#[test]
fn few_bytes_are_judged_alike() {
    let header = Ghdr { color: GRAY, ..Ghdr::default() };
    let mut random = Random(1);
    let mut sound = 0;
    for _ in 0..20_000 {
        // A state and few words: some of them end as they should.
        let mut payload = vec![1, 0, 0, 0];
        payload.extend((random.next() as u32).to_le_bytes());
        payload.extend((0..random.next() % 3).flat_map(|_| (random.next() as u16).to_le_bytes()));
        sound += u32::from(compare(&header, &[1024.0; 5], &payload));
    }
    println!("{sound}");
}
