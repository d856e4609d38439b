//! The test vectors of texture.

use super::common::entropy::{Code, Grid};
use super::common::steps::at_most;
use super::common::texture::{self, Texture, map_sides, with_count};
use super::common::{File, GRAY, GRAY_ALPHA, Header, RGB, RGBA, Random, chunk, of_chunks, offsets};
use super::entropy::scattered;
use super::sound::{codes, packed, random_file};
use super::{Rendering, Vector, header};

/// A Gaussian of step exponent 2 at a point of a map, as large as its cell lets expect, not slanted, with
/// about this much of each sum.
fn at(header: &Header, point: [f32; 2], colors: [f32; 3]) -> Code {
    let center = Grid::new(map_sides(header.sides())).units(point);
    let axes = texture::axes(colors).map(|axis| axis.round() as i32).to_vec();
    Code { exponent: 2, axes, center, ..Code::default() }
}

/// Random Gaussians with small codes in the map.
fn scatter(seed: u64, header: &Header, count: usize) -> Vec<Code> {
    let mut random = Random(seed);
    let sides = map_sides(header.sides()).map(|side| side as f32);
    let one = |_| {
        let point = sides.map(|side| random.range(0.0, side));
        let mut within = |most: i32| (random.next() % (2 * most as u64 + 1)) as i32 - most;
        let colors = [7, 5, 3].map(|most| within(most) as f32);
        let [size, ratio, slant] = [2, 2, 2].map(within);
        Code { size, ratio, slant, ..at(header, point, colors) }
    };
    (0..count).map(one).collect()
}

fn with(file: File, texture: &Texture) -> File {
    let payload = texture.payload(file.header.sides());
    file.with(b"tXTR", &payload)
}

/// A file with random texture.
fn textured(seed: u64, file: File, count: usize) -> File {
    let codes = scatter(seed, &file.header, count);
    with(file, &Texture { step: at_most(0.4), codes })
}

/// A gray picture without Gaussians.
fn empty(width: u32, height: u32) -> File {
    File::new(header(GRAY, width, height), packed(GRAY, (width, height)), vec![])
}

pub(super) fn valid() -> Vec<Vector> {
    let nodes = |header: &Header| {
        let [columns, rows] = map_sides(header.sides());
        (0..rows).flat_map(move |row| (0..columns).map(move |column| [column, row]))
    };
    let most = {
        let file = empty(33, 20);
        let code = |[column, row]: [u32; 2]| {
            let sign = if (column + row).is_multiple_of(2) { 1.0 } else { -1.0 };
            let point = [column, row].map(|node| node as f32 + 0.5);
            at(&file.header, point, [9.0, 5.0 * sign, 5.0 * sign])
        };
        let codes = nodes(&file.header).map(code).collect();
        with(file.clone(), &Texture { step: at_most(0.3), codes })
    };
    let beyond = {
        let file = random_file(201, header(RGB, 40, 24), 8);
        let codes = vec![
            at(&file.header, [1.0, 1.0], [900.0, 200.0, 900.0]),
            at(&file.header, [4.5, 3.0], [900.0, -200.0, -900.0]),
            at(&file.header, [3.0, 1.0], [-500.0, -500.0, 0.0]),
        ];
        with(file, &Texture { step: 1.0, codes })
    };
    let steps = |step: f32, colors: [f32; 3]| {
        let file = empty(24, 16);
        let codes = vec![at(&file.header, [1.5, 1.5], colors)];
        with(file, &Texture { step, codes })
    };
    let not_drawn = {
        let file = empty(24, 16);
        let sound = at(&file.header, [1.5, 1.5], [9.0, 9.0, 0.0]);
        let codes =
            vec![Code { size: 400, ..sound.clone() }, sound.clone(), Code { size: -400, ..sound }];
        with(file, &Texture { step: at_most(0.3), codes })
    };
    let constant = |name, shows, direction| {
        let file = empty(40, 24);
        let texture = Texture::constant(file.header.sides(), [0.2, 0.3, direction]);
        Vector::valid(name, shows, with(file, &texture)).also(&[
            Rendering::Size(57, 24),
            Rendering::Size(40, 31),
            Rendering::SizeAndRegion((4000, 2400), (1999, 1001, 31, 17)),
            Rendering::Size(16, 10),
        ])
    };
    let moved = |name, shows, behind: usize| {
        let entries = packed(GRAY, (24, 16));
        let layers = [202, 207].map(|seed| codes(seed, &entries, 6)).to_vec();
        let file = textured(202, File::new(header(GRAY, 24, 16), entries, layers), 4);
        let mut chunks = file.chunks();
        let texture = chunks.remove(1);
        chunks.insert(1 + behind, texture);
        Vector::valid_chunks(name, shows, file, &chunks).also(&[Rendering::Plain])
    };
    let bounded = {
        let file = scattered(203, header(RGBA, 70, 45), 20);
        let bounds = file.bounds();
        textured(203, file.with(b"bNDS", &bounds), 20)
    };
    vec![
        Vector::valid(
            "texture-gray8",
            "texture with all patterns on a picture of the packed coding; other sizes, regions and colour models",
            textured(200, random_file(200, header(GRAY, 61, 43), 12), 16),
        )
        .also(&[
            Rendering::Plain,
            Rendering::Size(88, 43),
            Rendering::Size(61, 100),
            Rendering::Size(150, 97),
            Rendering::Size(122, 20),
            Rendering::Size(55, 39),
            Rendering::Size(30, 21),
            Rendering::Size(15, 10),
            Rendering::Size(12, 9),
            Rendering::Size(8, 6),
            Rendering::Size(7, 5),
            Rendering::Region(3, 5, 17, 9),
            Rendering::SizeAndRegion((30, 21), (7, 3, 9, 5)),
            Rendering::SizeAndRegion((610, 430), (301, 207, 33, 21)),
            Rendering::SizeAndRegion((8_388_608, 8_388_608), (4_000_000, 4_000_001, 9, 5)),
            Rendering::Prefix(3),
            Rendering::Color(image_gip::ColorModel::Rgba),
        ]),
        Vector::valid(
            "texture-gray-alpha8",
            "texture of a picture with alpha, which has none",
            textured(204, random_file(204, header(GRAY_ALPHA, 29, 33), 10), 9),
        )
        .also(&[Rendering::Size(11, 12), Rendering::Size(41, 33)]),
        Vector::valid(
            "texture-rgb16",
            "texture of a picture of the entropy coding with 16 bits",
            textured(205, scattered(205, Header { depth: 16, ..header(RGB, 50, 31) }, 15), 12),
        )
        .also(&[Rendering::Plain, Rendering::Size(75, 60), Rendering::Size(13, 8)]),
        Vector::valid(
            "texture-rgba8",
            "texture beside bNDS in a picture of the entropy coding",
            bounded,
        )
        .also(&[
            Rendering::Region(1, 2, 3, 4),
            Rendering::Region(60, 37, 10, 8),
            Rendering::SizeAndRegion((400, 20), (120, 7, 9, 5)),
        ]),
        constant("texture-isotropic", "isotropic texture, as strong everywhere, of no Gaussian", 0.5),
        constant("texture-horizontal", "horizontal streaks, as strong everywhere", 0.9),
        constant("texture-vertical", "vertical streaks, as strong everywhere", 0.1),
        Vector::valid(
            "texture-one-pixel",
            "texture of a picture of one pixel, whose map has four nodes",
            with(empty(1, 1), &Texture::constant([1, 1], [0.3, 0.2, 0.7])),
        )
        .also(&[Rendering::Size(16, 16)]),
        Vector::valid("texture-many", "a map of as many Gaussians as nodes, the most that is allowed", most)
            .also(&[Rendering::Size(45, 31)]),
        Vector::valid("texture-clamped", "strengths and directions beyond their ranges", beyond)
            .also(&[Rendering::Size(9, 6)]),
        Vector::valid(
            "texture-step-least",
            "the least step of a map, 2^-20",
            steps(1.0 / 1_048_576.0, [50_000.0, 40_000.0, 20_000.0]),
        ),
        Vector::valid("texture-step-most", "the largest step of a map, 2^10", steps(1024.0, [1.0, 1.0, -1.0])),
        Vector::valid("texture-not-drawn", "a map of one Gaussian that is drawn and two that are not", not_drawn),
        moved("texture-between", "tXTR between two layers", 1),
        moved("texture-late", "tXTR after the last layer", 2),
    ]
}

pub(super) fn invalid() -> Vec<Vector> {
    // H, tXTR, a layer and E.
    let sides = [16, 16];
    let plain = random_file(206, header(GRAY, 16, 16), 4);
    let header = plain.header;
    let map = |count| Texture { step: at_most(0.4), codes: scatter(206, &header, count) };
    let sound = map(9).payload(sides);
    let file = plain.clone().with(b"tXTR", &sound);
    let replaced = |payload: &[u8]| {
        let mut chunks = file.chunks();
        chunks[1] = chunk(b"tXTR", payload);
        of_chunks(&chunks)
    };
    // The oracle refuses it as well, and says why: the picture has no texture.
    let skipped = |name, shows, payload: &[u8], flaw: &str| {
        let found = texture::read(sides, payload);
        assert_eq!(found.map(|_| ()), Err(flaw), "{name}");
        Vector::skipping(name, shows, plain.clone(), replaced(payload))
    };
    let with_step = |name, shows, code: u16| {
        let payload = [&code.to_le_bytes()[..], &sound[2..]].concat();
        skipped(name, shows, &payload, "a step out of range")
    };
    // The bytes of the nine Gaussians, behind the step and the number.
    let coded = &sound[3..];
    let with_number = |number: &[u8]| [&sound[..2], number, coded].concat();
    let changed = |change: &dyn Fn(&mut Vec<u8>)| {
        let mut payload = sound.clone();
        change(&mut payload);
        payload
    };
    let start = offsets(&file.chunks())[1];
    let late = {
        let mut chunks = file.chunks();
        chunks.insert(3, chunk(b"tXTR", &sound));
        of_chunks(&chunks)
    };
    vec![
        skipped("skip-texture-short", "tXTR too short for the step", &sound[..1], "no step"),
        skipped("skip-texture-no-number", "tXTR that ends after its step", &sound[..2], "no count"),
        skipped(
            "skip-texture-no-layer",
            "tXTR that ends after its number",
            &sound[..3],
            "more than four Gaussians for each byte",
        ),
        skipped(
            "skip-texture-number-needless",
            "tXTR whose number has a byte that it does not need",
            &with_number(&[0x89, 0]),
            "no count",
        ),
        skipped(
            "skip-texture-number-over",
            "tXTR whose number has 33 bits",
            &with_number(&[0x89, 0x80, 0x80, 0x80, 0x10]),
            "no count",
        ),
        with_step("skip-texture-step-over", "tXTR with a step just over 2^10", 0xF001),
        skipped(
            "skip-texture-many",
            "tXTR with ten Gaussians for nine nodes",
            &map(10).payload(sides),
            "more Gaussians than nodes",
        ),
        skipped(
            "skip-texture-empty",
            "tXTR whose layer has no Gaussians",
            &with_number(&[0]),
            "no Gaussians",
        ),
        skipped(
            "skip-texture-state",
            "tXTR whose layer has an initial state below 2^16",
            &changed(&|payload| payload[5..7].fill(0)),
            "the state begins below 2^16",
        ),
        skipped(
            "skip-texture-words-fewer",
            "tXTR whose layer has one word too few",
            &changed(&|payload| payload.truncate(payload.len() - 2)),
            "no word left",
        ),
        skipped(
            "skip-texture-words-more",
            "tXTR whose layer has one word too many",
            &changed(&|payload| payload.extend([0, 0])),
            "words left",
        ),
        Vector::skipping(
            "skip-texture-twice",
            "two tXTR: the second one is skipped",
            file.clone(),
            file.clone().with(b"tXTR", &map(4).payload(sides)).bytes(),
        ),
        Vector::skipping("skip-texture-late", "a second tXTR, after the layer", file.clone(), late),
        Vector::skipping(
            "skip-texture-broken-twice",
            "a broken tXTR and a sound one, which counts",
            file.clone(),
            {
                let mut chunks = file.chunks();
                chunks.insert(1, chunk(b"tXTR", &sound[..2]));
                of_chunks(&chunks)
            },
        ),
        skipped(
            "skip-texture-dense",
            "tXTR with nine Gaussians in two bytes",
            &with_count(at_most(0.4), 9, &[0, 0]),
            "more than four Gaussians for each byte",
        ),
        Vector::invalid("xtexture-crc", "a flipped bit in tXTR", {
            let mut bytes = file.bytes();
            bytes[start + 20] ^= 4;
            bytes
        }),
        Vector::invalid(
            "xtexture-truncated",
            "ends within tXTR",
            file.bytes()[..start + 20].to_vec(),
        ),
    ]
}
