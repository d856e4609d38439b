//! Files made to hurt: every limit refuses before memory is taken or time is spent.

mod common;

use cap::Cap;
use common::entropy::{Code, Grid};
use common::memory::peak;
use common::texture::{Texture, map_sides, with_count};
use common::{
    CHOLESKY, ENTROPY, Entry, File, Header, PACKED, RGB, RGBA, SIGNATURE, chunk, decode_pieces,
    decode_valid, number, of_chunks, quantizers, steps,
};
use image_gip::{
    DecodeError, LimitKind, Limits, Picture, Region, RenderOptions, StreamDecoder, Threads,
};
use std::alloc::System;
use std::sync::{Mutex, MutexGuard};

/// Counts what is allocated.
#[global_allocator]
static MEMORY: Cap<System> = Cap::new(System, usize::MAX);

/// One test at a time, so that what is counted belongs to it.
fn alone() -> MutexGuard<'static, ()> {
    static TURN: Mutex<()> = Mutex::new(());
    TURN.lock().unwrap_or_else(|poisoned| poisoned.into_inner())
}

fn limits(change: impl FnOnce(&mut Limits)) -> Limits {
    let mut limits = Limits::default();
    change(&mut limits);
    limits
}

/// A file up to its header, with quantizers or steps of any kind.
fn header(change: impl FnOnce(&mut Header)) -> Vec<u8> {
    let mut header = Header::default();
    change(&mut header);
    let dequantizer = match header.coding {
        PACKED => quantizers(&vec![Entry::FLOAT; header.components()]),
        _ => steps::bytes(&vec![1.0; 4 + header.channels()]),
    };
    [&SIGNATURE[..], &header.chunk(&dequantizer)].concat()
}

/// A chunk of this type without its end, which declares the longest payload that there is.
fn endless(kind: &[u8], payload: &[u8]) -> Vec<u8> {
    [kind, &number((1 << 31) - 1), payload].concat()
}

/// Feeds a file that one limit refuses: which, what it wanted and what is allowed.
#[track_caller]
fn refusal(bytes: &[u8], limits: Limits) -> (LimitKind, u64, u64) {
    refusal_within(10_000, bytes, limits)
}

/// The same, with less than so many bytes held.
#[track_caller]
fn refusal_within(most: u64, bytes: &[u8], limits: Limits) -> (LimitKind, u64, u64) {
    let ((_, result), peak) = peak(&MEMORY, || decode_pieces([bytes], limits));
    match result.expect_err("a limit is exceeded") {
        DecodeError::Limit { kind, wanted, allowed } => {
            assert!(wanted > allowed && peak < most, "{kind}: {wanted}, {peak} bytes held");
            (kind, wanted, allowed)
        }
        error => panic!("{error}"),
    }
}

#[test]
fn hostile_headers_are_refused_before_anything_is_allocated() {
    let _alone = alone();
    let side = 1 << 20;
    let defaults = Limits::default;
    let many = header(|h| (h.gaussians, h.layers) = (u32::MAX, 1));
    assert_eq!(refusal(&many, defaults()), (LimitKind::Gaussians, u32::MAX.into(), 1 << 22));
    let wide = header(|h| h.width = side);
    assert_eq!(refusal(&wide, defaults()), (LimitKind::Width, 1 << 20, 1 << 16));
    let high = header(|h| h.height = side);
    assert_eq!(refusal(&high, defaults()), (LimitKind::Height, 1 << 20, 1 << 16));
    let large = header(|h| (h.width, h.height) = (1 << 16, 1 << 16));
    assert_eq!(refusal(&large, defaults()), (LimitKind::Pixels, 1 << 32, 1 << 28));
    let (kind, ..) = refusal(&many, limits(|l| l.max_gaussians = u32::MAX));
    assert_eq!(kind, LimitKind::Memory);
    // Every bound counts as it is set.
    let small = header(|h| (h.width, h.height, h.gaussians, h.layers) = (20, 30, 5, 1));
    for (changed, expected) in [
        (limits(|l| l.max_width = 19), (LimitKind::Width, 20, 19)),
        (limits(|l| l.max_height = 29), (LimitKind::Height, 30, 29)),
        (limits(|l| l.max_pixels = 599), (LimitKind::Pixels, 600, 599)),
        (limits(|l| l.max_gaussians = 4), (LimitKind::Gaussians, 5, 4)),
    ] {
        assert_eq!(refusal(&small, changed), expected);
    }
}

#[test]
fn declared_lengths_take_no_memory() {
    let _alone = alone();
    for kind in [b"iCCP", b"tEXt", b"prVt"] {
        let bytes = [header(|_| ()), endless(kind, &[b'x'; 5000])].concat();
        let ((_, result), peak) =
            peak(&MEMORY, || decode_pieces([bytes.as_slice()], Limits::none()));
        assert!(result.expect_err("incomplete").is_unexpected_end());
        assert!(peak < 12_000, "{peak} bytes held");
    }
    let bytes = [header(|_| ()), endless(b"iCCP", &[])].concat();
    assert_eq!(refusal(&bytes, Limits::default()).0, LimitKind::Memory);
    // A layer that declares many Gaussians and sends few.
    let count = 1 << 22;
    for layers in [1, 2] {
        let header = Header { gaussians: count + layers - 1, layers, ..Header::default() };
        let start = header.chunk(&quantizers(&[Entry::linear(1, 1.0, 0.0); 6]));
        let of_layer = if layers > 1 { number(count) } else { Vec::new() };
        let length = number(of_layer.len() as u32 + 6 * count / 8);
        let layer = [b"L", &length[..], &of_layer, &[0xAA; 300]].concat();
        let bytes = of_chunks(&[start, layer]);
        let mut limits = Limits::default();
        limits.max_gaussians += layers;
        let ((decoder, _), peak) = peak(&MEMORY, || decode_pieces([bytes.as_slice()], limits));
        assert_eq!(decoder.gaussians().len(), 400);
        assert!(peak < 60_000, "{peak} bytes held");
    }
}

#[test]
fn an_entropy_coded_layer_takes_memory_as_it_arrives() {
    let _alone = alone();
    let start = header(|h| (h.coding, h.gaussians, h.layers) = (ENTROPY, 1 << 22, 1));
    let bytes = [start, endless(b"L", &[7; 5000])].concat();
    let ((_, result), peak) = peak(&MEMORY, || decode_pieces([bytes.as_slice()], Limits::none()));
    assert!(result.expect_err("incomplete").is_unexpected_end());
    // Models of all contexts take 13 kB, tables of exponentials 8 kB, whatever the file.
    const HELD: u64 = 24_000;
    assert!(peak < HELD + 6_000, "{peak} bytes held");
    assert_eq!(refusal_within(HELD, &bytes, Limits::default()).0, LimitKind::Memory);
}

/// Gaussians over a map, all as large as this code says.
fn map(sides: [u32; 2], count: u32, size: i32) -> Texture {
    let map = map_sides(sides);
    let grid = Grid::new(map);
    let code = |n: u32| {
        let center = grid.units([(n % map[0]) as f32 + 0.5, (n / map[0] % map[1]) as f32 + 0.5]);
        Code { exponent: 2, axes: vec![3, 1, 0], size, center, ..Code::default() }
    };
    Texture { step: 0.5, codes: (0..count).map(code).collect() }
}

#[test]
fn texture_takes_memory_as_it_arrives() {
    let _alone = alone();
    let start = header(|h| (h.width, h.height) = (1 << 14, 1 << 14));
    let bytes = [&start[..], &endless(b"tXTR", &[7; 5000])].concat();
    let ((_, result), peak) = peak(&MEMORY, || decode_pieces([bytes.as_slice()], Limits::none()));
    assert!(result.expect_err("incomplete").is_unexpected_end());
    assert!(peak < 12_000, "{peak} bytes held");
    assert_eq!(refusal(&bytes, Limits::default()).0, LimitKind::Memory);
    // As many Gaussians as the bytes may stand for.
    let count = 4 * 300_000_u32;
    let payload = with_count(1.0, count, &[7; 300_000]);
    let bytes = [start, chunk(b"tXTR", &payload)].concat();
    let little = limits(|l| l.max_memory = 8 << 20);
    assert_eq!(refusal_within(1 << 20, &bytes, little).0, LimitKind::Memory);
    let few = limits(|l| l.max_gaussians = count - 1);
    let (kind, wanted, _) = refusal_within(1 << 20, &bytes, few);
    assert_eq!((kind, wanted), (LimitKind::Gaussians, count.into()));
}

#[cfg(feature = "std")]
#[test]
fn what_follows_the_layers_needs_no_more_memory_side_by_side() {
    let _alone = alone();
    let sides = [256, 256];
    let header = Header { width: 256, height: 256, ..Header::default() };
    let grid = Grid::new(header.sides());
    let mut random = common::Random(9);
    let mut code = |_| {
        let axes = vec![(random.next() % 4000) as i32];
        let center = grid.units([random.range(0.0, 256.0), random.range(0.0, 256.0)]);
        Code { exponent: 7, axes, center, ..Code::default() }
    };
    let layers = (0..20).map(|_| (0..100).map(&mut code).collect()).collect();
    let file = File::of_entropy_coded(header, vec![1.0, 1.0, 1.0, 1.0, 0.125], layers);
    let texture = map(sides, 1000, 0).payload(sides);
    let metadata = [b"xMPD".to_vec(), vec![b'x'; 40_000]];
    for (kind, payload) in [(&b"tXTR"[..], &texture), (&metadata[0], &metadata[1])] {
        let mut chunks = file.chunks();
        chunks.insert(chunks.len() - 1, chunk(kind, payload));
        let bytes = of_chunks(&chunks);
        let mut refused = 0;
        for max_memory in (10..130).map(|step| step * 4000) {
            let limits = limits(|l| l.max_memory = max_memory);
            let (_, one_by_one) = decode_pieces([bytes.as_slice()], limits.clone());
            let side_by_side = image_gip::Decoder::new_with_limits(bytes.as_slice(), limits)
                .and_then(|mut decoder| decoder.read_to_end());
            let found = [one_by_one, side_by_side].map(ending);
            assert_eq!(found[0], found[1], "{max_memory}");
            refused += usize::from(found[0] == "bytes of memory");
        }
        assert!((1..119).contains(&refused), "{refused} of 120");
    }
}

#[test]
fn a_map_of_large_gaussians_is_refused_by_its_work() {
    let _alone = alone();
    let header = Header { width: 2048, height: 2048, ..Header::default() };
    let texture = map([2048, 2048], 4000, 40).payload([2048, 2048]);
    let bytes = File::of_floats(header, &[]).with(b"tXTR", &texture).bytes();
    let allowed = limits(|l| l.max_work = 1 << 24);
    let (decoder, result) = decode_pieces([bytes.as_slice()], allowed);
    result.expect("a sound file");
    let picture = decoder.picture().expect("a complete file");
    let mut out = vec![7; 2048 * 2048];
    for threads in [Threads::One, Threads::Pool] {
        let options = RenderOptions::new().with_threads(threads);
        let error = picture.render_u8(&options, &mut out).expect_err("too much work");
        assert!(matches!(error, DecodeError::Limit { kind: LimitKind::Work, .. }), "{error}");
        assert!(out.iter().all(|&sample| sample == 7), "the buffer was touched");
    }
    // Without texture, and where none shows, the map is not rendered.
    let options = RenderOptions::new().with_size(256, 256);
    picture.render_u8(&options, &mut out[..1 << 16]).expect("no texture");
    picture.render_u8(&RenderOptions::new().with_texture(false), &mut out).expect("no texture");
    // Of a region, only the nodes around it count.
    let region = Region { x: 1000, y: 1000, width: 64, height: 64 };
    let options = RenderOptions::new().with_region(region);
    picture.render_u8(&options, &mut out[..1 << 12]).expect("a few nodes");
}

#[test]
fn a_small_file_of_large_gaussians_is_refused_by_its_work() {
    let _alone = alone();
    // 10 kB: one bit per component, all of them at the centre and as wide as can be.
    let entry = |value| Entry::linear(1, 1.0, value);
    let entries =
        vec![entry(2000.0), entry(2000.0), entry(1e7), entry(0.0), entry(1e7), entry(0.1)];
    let header = Header { width: 4096, height: 4096, ..Header::default() };
    let file = File::new(header, entries, vec![vec![0; 6 * 13_000]]);
    let bytes = file.bytes();
    assert!(bytes.len() < 10_000);
    let decoder = decode_valid(&bytes);
    let picture = decoder.picture().expect("a complete file");
    let mut out = vec![7; 4096 * 4096];
    for threads in [Threads::One, Threads::Pool] {
        let options = RenderOptions::new().with_threads(threads);
        let (error, held) = peak(&MEMORY, || picture.render_u8(&options, &mut out));
        let error = error.expect_err("too much work");
        // 64 that cover the picture are always allowed. Counting ends with the first that is too
        // many: the 321st of 2^24 pixels each.
        assert!(
            matches!(
                error,
                DecodeError::Limit { kind: LimitKind::Work, wanted, allowed }
                    if (wanted, allowed) == (321 << 24, 320 << 24)
            ),
            "{error}"
        );
        // Lists of the rows that each of them covers would take 6 MB.
        assert!(held < 1_000_000, "{held} bytes held");
        assert!(out.iter().all(|&sample| sample == 7), "the buffer was touched");
    }
    // The cost follows the output: a thumbnail of the same file is fine.
    let options = RenderOptions::new().with_size(64, 64);
    picture.render_u8(&options, &mut out[..64 * 64]).expect("little work");
}

#[test]
fn spans_without_pixels_count_as_work() {
    let _alone = alone();
    // Needles that pass every row of a tall picture, most of the time beside it.
    let header = Header { width: 1, height: 60_000, ..Header::default() };
    let needles = |x: f32| {
        let needle = |i: usize| vec![x, 30_000.0 + i as f32, 1e6, 1e7, 1.0, 0.1];
        File::of_floats(header, &(0..12_000).map(needle).collect::<Vec<_>>()).bytes()
    };
    let mut out = vec![7; 60_000];
    let options = RenderOptions::new().with_threads(Threads::One);
    // All of the time.
    let decoder = decode_valid(&needles(2e6));
    decoder.picture().expect("complete").render_u8(&options, &mut out).expect("no work");
    assert!(out.iter().all(|&sample| sample == 0));
    let decoder = decode_valid(&needles(0.5));
    out.fill(7);
    let picture = decoder.picture().expect("a complete file");
    let error = picture.render_u8(&options, &mut out).expect_err("too much work");
    // Each of them counts as if it covered the whole picture, and the 8956th is one too many.
    assert!(
        matches!(
            error,
            DecodeError::Limit { kind: LimitKind::Work, wanted, .. } if wanted == 8956 * 8 * 60_000
        ),
        "{error}"
    );
    assert!(out.iter().all(|&sample| sample == 7), "the buffer was touched");
}

#[test]
fn the_memory_limit_holds() {
    let _alone = alone();
    // Many Gaussians over many tiles, long metadata, many texts.
    let mut random = common::Random(1);
    let rows: Vec<Vec<f32>> = (0..5_000)
        .map(|_| {
            let mut row = vec![random.range(0.0, 450.0), random.range(0.0, 450.0)];
            row.extend([random.decades(0.5, 20.0), 3.0, random.decades(0.5, 20.0)]);
            row.extend([0.1; 4]);
            row
        })
        .collect();
    let base = [0; 4];
    let header = Header { color: RGBA, width: 450, height: 450, base, ..Header::default() };
    let texture = map([450, 450], 1500, 0).payload([450, 450]);
    let mut file = File::of_floats(header, &rows).with(b"iCCP", &vec![1; 75_000]);
    file = file.with(b"tXTR", &texture);
    for _ in 0..750 {
        file = file.with(b"tEXt", b"a\0b");
    }
    let bytes = file.bytes();
    let mut out = vec![0; 450 * 450 * 4];
    let mut attempt = |max_memory: u64| {
        let limits = limits(|l| l.max_memory = max_memory);
        let options = RenderOptions::new().with_threads(Threads::One);
        peak(&MEMORY, || {
            let mut decoder = StreamDecoder::new().with_limits(limits);
            decoder.feed(&bytes)?;
            decoder.picture().expect("a complete file").render_u8(&options, &mut out)
        })
    };
    // The least limit with which it succeeds, and what is held then.
    let mut least = None;
    for max_memory in (0..40).map(|step| step * 25_000) {
        let (result, peak) = attempt(max_memory);
        // The limit speaks of what grows with the file; the rest is a few kilobytes.
        assert!(peak <= max_memory + 20_000, "{peak} bytes held, {max_memory} allowed");
        match result {
            Ok(()) => _ = least.get_or_insert((max_memory, peak)),
            Err(DecodeError::Limit { kind: LimitKind::Memory, wanted, allowed }) => {
                assert!(least.is_none() && wanted > allowed && allowed == max_memory);
            }
            Err(error) => panic!("{error}"),
        }
    }
    let (least, held) = least.expect("enough memory");
    assert!(5 * least < 7 * held, "the limit is far too strict: {least} for {held}");
}

#[test]
fn output_sizes_count_against_the_limits() {
    let _alone = alone();
    let header = Header { color: RGB, form: CHOLESKY, ..Header::default() };
    let bytes = File::of_floats(header, &[]).bytes();
    let (decoder, result) = decode_pieces([bytes.as_slice()], limits(|l| l.max_pixels = 1000));
    result.expect("16x16 is within bounds");
    let picture = decoder.picture().expect("a complete file");
    let mut out = vec![0; 3 * 1024];
    let error =
        picture.render_u8(&RenderOptions::new().with_size(32, 32), &mut out).expect_err("large");
    assert!(matches!(error, DecodeError::Limit { kind: LimitKind::Pixels, wanted: 1024, .. }));
    let region = Region { x: 900_000, y: 900_000, width: 10, height: 10 };
    let close_up = RenderOptions::new().with_size(1 << 20, 1 << 20).with_region(region);
    picture.render_u8(&close_up, &mut out[..300]).expect("only the region counts");
}

/// A small file that asks for as much as it can.
struct Hostile {
    name: String,
    bytes: Vec<u8>,
    /// How decoding ends, and rendering of the whole picture and of a small one; `None` where that
    /// is not what is tested.
    expected: Option<[&'static str; 3]>,
}

/// Such files, and the specification's.
fn hostile_set() -> Vec<Hostile> {
    const SIZE: usize = 64 << 10;
    let mut set = Vec::new();
    let vectors = concat!(env!("CARGO_MANIFEST_DIR"), "/spec/vectors");
    for entry in std::fs::read_dir(vectors).expect("the vectors are there") {
        let path = entry.expect("a file").path();
        let bytes = std::fs::read(&path).expect("it can be read");
        set.push(Hostile { name: path.display().to_string(), bytes, expected: None });
    }
    assert!(set.len() > 100, "the vectors are missing");
    let mut add = |name: &str, bytes: Vec<u8>, expected: [&'static str; 3]| {
        assert!(bytes.len() <= SIZE + 200, "{name}: {} bytes", bytes.len());
        set.push(Hostile { name: name.to_owned(), bytes, expected: Some(expected) });
    };
    let wide = Header { width: 1 << 11, height: 1 << 11, ..Header::default() };
    // One bit per component, all of them in the middle, as wide as can be or as small.
    for (name, extent, rendered) in
        [("large Gaussians", 1e7, "kernel evaluations"), ("small Gaussians", 1e-4, "")]
    {
        let values = [1024.0, 1024.0, extent, 0.0, extent, 0.1];
        let entries = values.map(|value| Entry::linear(1, 1.0, value)).to_vec();
        let file = File::new(wide, entries, vec![vec![0; 8 * (SIZE - 1000)]]);
        add(name, file.bytes(), ["", rendered, rendered]);
    }
    // Needles from top to bottom, and short ones.
    let needle = |slant: f32| vec![1024.0, 1024.0, 1e-3, slant, 1e-3, 1.0];
    let needles = [1e6, -1e6, 1.0].into_iter().cycle().take(SIZE / 24 - 100).map(needle);
    add("needles", File::of_floats(wide, &needles.collect::<Vec<_>>()).bytes(), ["", "", ""]);
    // Entropy-coded layers of as many Gaussians as their bytes may stand for, whatever they are; the
    // last declares more than there is memory for.
    let mut random = common::Random(3);
    let noise: Vec<u8> = (0..SIZE - 200).map(|_| random.next() as u8).collect();
    let mut zeros = vec![0; SIZE - 200];
    // The least state.
    zeros[2] = 1;
    for (name, bytes) in [("zeros", &zeros), ("noise", &noise)] {
        for (per_byte, length, expected) in [
            (1, SIZE - 200, ["malformed L (layer)", "", ""]),
            (4, 28_000, ["malformed L (layer)", "", ""]),
            (4, SIZE - 200, ["bytes of memory", "no picture", "no picture"]),
        ] {
            let count = (length * per_byte) as u32;
            let header = Header { coding: ENTROPY, gaussians: count, layers: 1, ..wide };
            let steps = steps::bytes(&[1.0, 1.0, 1.0, 1.0, 0.125]);
            let chunks = [header.chunk(&steps), chunk(b"L", &bytes[..length])];
            let name = format!("{name}, {per_byte} for each of {length} bytes");
            add(&name, of_chunks(&chunks), expected);
        }
    }
    // Layers that wait for each other.
    let code = |n: u32| Code { axes: vec![1], center: [n << 7; 2], ..Code::default() };
    let layers = (0..2200).map(|n| vec![code(n)]).collect();
    let layers = File::of_entropy_coded(wide, vec![1.0, 1.0, 1.0, 1.0, 0.125], layers);
    add("layers", layers.bytes(), ["", "", ""]);
    // The same in a map; a small output has no texture.
    let picture = File::of_floats(wide, &[]);
    let large = map([1 << 11; 2], 20_000, 40).payload([1 << 11; 2]);
    let work = "kernel evaluations";
    add("a map", picture.clone().with(b"tXTR", &large).bytes(), ["", work, ""]);
    for (name, bytes) in [("zeros", &zeros), ("noise", &noise)] {
        for (count, expected) in
            [(60_000, ["", "", ""]), (66_049, ["", "", ""]), (66_050, ["", "", ""])]
        {
            let payload = with_count(1.0, count, bytes);
            let bytes = picture.clone().with(b"tXTR", &payload).bytes();
            add(&format!("a map of {name}"), bytes, expected);
        }
    }
    let mut texts = File::of_floats(wide, &[]);
    for _ in 0..SIZE / 12 - 100 {
        texts = texts.with(b"tEXt", b"a\0b");
    }
    add("texts", texts.bytes(), ["", "", ""]);
    set
}

/// How something ended: what was wrong or which limit was exceeded; empty for nothing.
fn ending(result: Result<(), DecodeError>) -> String {
    match result {
        Ok(()) => String::new(),
        Err(DecodeError::Limit { kind, .. }) => kind.to_string(),
        Err(DecodeError::Malformed { chunk, .. }) => format!("malformed {chunk}"),
        Err(error) => error.to_string(),
    }
}

#[test]
fn a_hostile_set_costs_no_more_than_its_limits_say() {
    let _alone = alone();
    let allowed = limits(|l| {
        (l.max_memory, l.max_pixels, l.max_work) = (8 << 20, 1 << 22, 1 << 28);
    });
    let mut out = vec![0; 1 << 24];
    // What came before the flaw can still be shown.
    let mut show = |picture: Option<Picture<'_>>, threads| {
        let Some(picture) = picture else { return ["no picture".into(), "no picture".into()] };
        let options = RenderOptions::new().with_threads(threads);
        [options.clone(), options.with_size(64, 64)].map(|options| {
            let length = picture.output_len(&options).unwrap_or(0);
            ending(picture.render_u8(&options, &mut out[..length]))
        })
    };
    for Hostile { name, bytes, expected } in hostile_set() {
        let ((ends, shown), alone) = peak(&MEMORY, || {
            let (decoder, result) = decode_pieces([bytes.as_slice()], allowed.clone());
            (ending(result), show(decoder.picture(), Threads::One))
        });
        assert!(alone <= allowed.max_memory + 30_000, "{name}: {alone} bytes held");
        let found = [&ends[..], &shown[0], &shown[1]];
        if let Some(expected) = expected {
            assert_eq!(found, expected, "{name}");
        }
        #[cfg(feature = "std")]
        {
            let ((side_by_side_ends, side_by_side_shown), side_by_side) = peak(&MEMORY, || {
                match image_gip::Decoder::new_with_limits(bytes.as_slice(), allowed.clone()) {
                    Ok(mut decoder) => {
                        let ends = ending(decoder.read_to_end());
                        let picture = decoder.picture().expect("what is left is sound");
                        (ends, Some(show(Some(picture), Threads::Pool)))
                    }
                    Err(error) => (ending(Err(error)), None),
                }
            });
            let allowed = allowed.max_memory + 100_000;
            assert!(side_by_side <= allowed, "{name}: {side_by_side} bytes held side by side");
            assert_eq!(side_by_side_ends, ends, "{name}");
            assert!(side_by_side_shown.is_none_or(|side_by_side| side_by_side == shown), "{name}");
        }
    }
}
