//! The test vectors of the entropy coding.

use super::common::entropy::{self, Code, Grid};
use super::common::rans::{self, Op};
use super::common::steps::{at_most, ratio, usual_geometry};
use super::common::{
    EXPONENTIAL, File, GRAY, GRAY_ALPHA, Header, RGB, RGBA, Random, chunk, number, of_chunks,
    offsets, payload,
};
use super::{Rendering, Vector, header};

/// The usual steps of geometry, and the same step for every colour axis.
fn usual_steps(color: u8) -> Vec<f32> {
    let mut steps = usual_geometry().to_vec();
    steps.resize(5 + usize::from(color), at_most(0.1));
    steps
}

const LEAST_STEP: f32 = 1.0 / 1_048_576.0;
const MOST_STEP: f32 = 1024.0;

/// A Gaussian of step exponent 2 at a point of the picture, as large as its cell lets expect, not slanted.
fn at(header: &Header, point: [f32; 2], first: i32) -> Code {
    let mut axes = vec![0; header.channels()];
    axes[0] = first;
    Code { exponent: 2, axes, center: Grid::new(header.sides()).units(point), ..Code::default() }
}

/// Random Gaussians with small codes in the picture.
fn scatter(seed: u64, header: &Header, count: usize) -> Vec<Code> {
    let mut random = Random(seed);
    let grid = Grid::new(header.sides());
    let sides = [header.width as f32, header.height as f32];
    let one = |_| {
        let exponent = 1 + (random.next() % 5) as u32;
        let mut within = |most: i32| (random.next() % (2 * most as u64 + 1)) as i32 - most;
        let (color, shape) = (6 << exponent.saturating_sub(3), 1 << exponent.saturating_sub(1));
        let axes = (0..header.channels()).map(|_| within(color)).collect();
        let [size, ratio, slant] = [within(shape), within(shape), within(shape)];
        let center = grid.units(sides.map(|side| random.range(0.0, side)));
        Code { exponent, axes, size, ratio, slant, center }
    };
    (0..count).map(one).collect()
}

pub(super) fn scattered(seed: u64, header: Header, count: usize) -> File {
    let codes = scatter(seed, &header, count);
    File::of_entropy_coded(header, usual_steps(header.color), vec![codes])
}

/// The largest number of Gaussians of which each may take two bits, where one more takes no more bytes.
fn densest() -> usize {
    let bytes = |count| payload(&dense(count).chunks()[1]).len();
    let is_full = |&count: &usize| bytes(count) == count / 4 && bytes(count + 1) == count / 4;
    (100..1000).step_by(4).find(is_full).expect("they take less than two bits each")
}

/// Equal Gaussians without colour.
fn dense(count: usize) -> File {
    let header = header(GRAY, 24, 16);
    let steps = vec![MOST_STEP, 0.75, 0.75, 1.75, at_most(0.1)];
    let code = Code { exponent: 1, ..at(&header, [4.0, 8.0], 0) };
    File::of_entropy_coded(header, steps, vec![vec![code; count]])
}

pub(super) fn valid() -> Vec<Vector> {
    let gray = header(GRAY, 24, 16);
    let sharp = |color| {
        let header = header(color, 24, 16);
        Header { depth: 16, kernel: EXPONENTIAL, cutoff: 11.082_527, ..header }
    };
    let usual = |header: Header, codes| {
        File::of_entropy_coded(header, usual_steps(header.color), vec![codes])
    };
    let layers = {
        let header = header(RGB, 40, 24);
        let layers = [5, 1, 40, 2].into_iter().zip(170..);
        let layers = layers.map(|(count, seed)| scatter(seed, &header, count)).collect();
        File::of_entropy_coded(header, usual_steps(RGB), layers)
    };
    let bounded = layers.clone().with(b"bNDS", &layers.bounds());
    let classes = {
        let header = header(RGBA, 32, 16);
        let with_exponent = |exponent: u32| {
            // One step of a symbol is this much. Codes beside its multiples need the plain bits, too.
            let (color, shape) = (1 << exponent.saturating_sub(3), 1 << exponent.saturating_sub(2));
            let base = at(&header, [4.0 * exponent as f32 + 1.5, 9.2], 5 * color + exponent as i32);
            let axes = vec![base.axes[0], 2 * color + 1, -3 * color - 1, 4 * color];
            let more = Code { exponent, axes, size: shape + 1, ..base };
            let less = Code {
                axes: more.axes.iter().map(|axis| -axis / 2).collect(),
                size: -shape - 1,
                ratio: 2 * shape - 1,
                slant: 1 - 2 * shape,
                center: [more.center[0] + 100, more.center[1] - 700],
                ..more
            };
            [more, less]
        };
        usual(header, (0..8).flat_map(with_exponent).collect())
    };
    let excess = {
        let header = header(RGB, 24, 16);
        let code = |n: u32, exponent: u32, axes: [i32; 3], [size, ratio, slant]: [i32; 3]| Code {
            axes: axes.to_vec(),
            exponent,
            size,
            ratio,
            slant,
            ..at(&header, [1.5 + 3.0 * n as f32, 8.0 - n as f32], 0)
        };
        let codes = vec![
            code(0, 2, [14, 7, -7], [0, -7, 7]),
            code(1, 2, [15, 8, -8], [1, -8, 8]),
            code(2, 2, [-16, 9, -9], [-1, -9, 9]),
            code(3, 5, [17, 40, -41], [-20, 70, 71]),
            code(4, 5, [-900, 300, 500], [30, 0, -700]),
            code(5, 2, [65_549, 65_542, -65_542], [0, 0, 65_542]),
            code(6, 7, [-1_048_799, -1_048_687, 1_048_672], [7, -2_097_344, 2_097_375]),
        ];
        usual(header, codes)
    };
    let crowd = {
        let point = [9.3, 7.7];
        let mut codes: Vec<Code> = (-4..5).map(|first| at(&gray, point, first)).collect();
        // Their step exponents differ, and so do their position intervals.
        codes.iter_mut().zip(0..).for_each(|(code, exponent)| code.exponent = exponent % 8);
        codes.push(at(&gray, [9.3, 8.2], 3));
        usual(gray, codes)
    };
    let many = {
        let header = header(GRAY, 64, 48);
        let mut random = Random(182);
        let codes = (0..400).map(|_| {
            // Half of them in an eighth of the picture.
            let left = random.next() & 1 == 1;
            let x = if left { random.range(0.0, 8.0) } else { random.range(8.0, 64.0) };
            let first = (random.next() % 3) as i32 - 1;
            Code { exponent: 1, ..at(&header, [x, random.range(0.0, 48.0)], first) }
        });
        usual(header, codes.collect())
    };
    let outside = {
        let points =
            [[-7.9, 4.0], [-0.5, -0.5], [31.9, 23.9], [12.0, -3.0], [12.0, 18.0], [26.0, 8.0]];
        usual(gray, points.map(|point| Code { size: 3, ..at(&gray, point, 9) }).to_vec())
    };
    let clamped = {
        let code = |x: f32, [size, ratio, slant]: [i32; 3]| Code {
            size,
            ratio,
            slant,
            ..at(&gray, [x, 8.0], 9)
        };
        let codes = vec![
            code(3.0, [400, 0, 0]),
            code(6.0, [-400, 0, 0]),
            code(9.0, [0, 300, 0]),
            code(12.0, [0, -300, 5]),
            code(15.0, [400, 300, -5]),
            code(18.0, [-400, 300, 65_542]),
            code(21.0, [0, 0, 1]),
        ];
        usual(gray, codes)
    };
    let not_drawn = {
        let sound = |x: f32| at(&gray, [x, 8.0], 9);
        let codes = vec![
            Code { size: 150, ..sound(2.0) },
            Code { size: -150, ..sound(5.0) },
            Code { size: 60, ratio: -40, ..sound(8.0) },
            Code { size: -36, ratio: 40, ..sound(11.0) },
            Code { size: 64, slant: 65_542, ..sound(14.0) },
            Code { size: -4, axes: vec![65_549], exponent: 0, ..sound(17.0) },
            sound(20.0),
        ];
        usual(gray, codes)
    };
    let least = {
        let sides = header(RGB, 24, 16);
        let large = |x: f32, exponent: u32, axes: [i32; 3], size: i32| Code {
            exponent,
            axes: axes.to_vec(),
            size,
            ratio: 65_000 << exponent.saturating_sub(2),
            slant: -30_000 << exponent.saturating_sub(2),
            ..at(&sides, [x, 8.0], 0)
        };
        let codes = vec![
            large(3.0, 0, [65_000, -60_000, 50_000], 65_000),
            large(10.0, 3, [65_000, 0, 1], -65_000),
            large(18.0, 7, [1_000_000, -900_000, -1_000_000], 2_000_000),
        ];
        File::of_entropy_coded(sides, vec![LEAST_STEP; 7], vec![codes])
    };
    let most = {
        let sides = header(RGB, 24, 16);
        let one = |x: f32, exponent: u32, ratio: i32| Code {
            exponent,
            axes: vec![1, 0, -1],
            ratio,
            ..at(&sides, [x, 8.0], 0)
        };
        let mut codes = vec![one(3.0, 0, 0), one(10.0, 4, 0), one(18.0, 7, 0), one(21.0, 7, 1)];
        codes[2].axes = vec![0, 1, 0];
        File::of_entropy_coded(sides, vec![MOST_STEP; 7], vec![codes])
    };
    let other_geometry = |color| {
        let header = header(color, 24, 16);
        let mut steps = usual_steps(color);
        steps[..4].copy_from_slice(&[1.25, 0.656_25, 0.906_25, 1.906_25]);
        File::of_entropy_coded(header, steps, vec![scatter(183, &header, 20)])
    };
    let other_ratios = |first: f32, ratios: [u8; 3]| {
        let header = header(RGBA, 24, 16);
        let mut steps = usual_geometry().to_vec();
        steps.push(first);
        steps.extend(ratios.map(|code| first * ratio(code)));
        File::of_entropy_coded(header, steps, vec![scatter(184, &header, 20)])
    };
    let two = File::of_entropy_coded(
        gray,
        usual_steps(GRAY),
        vec![scatter(185, &gray, 5), scatter(186, &gray, 200)],
    );
    let bounds_late = {
        let mut chunks = layers.chunks();
        chunks.insert(3, chunk(b"bNDS", &layers.bounds()));
        (layers.clone(), chunks)
    };
    let pixel = Header { width: 1, height: 1, ..gray };
    let long = Header { width: 2000, height: 3, ..gray };
    let high = Header { width: 1, height: 300, color: RGB, ..gray };
    let gray_alpha = header(GRAY_ALPHA, 17, 9);
    vec![
        Vector::valid("entropy-gray8", "entropy coding: gray, 8 bits", scattered(160, gray, 20))
            .also(&[
                Rendering::Size(48, 32),
                Rendering::Size(7, 5),
                Rendering::Region(3, 5, 17, 9),
                Rendering::Color(image_gip::ColorModel::Rgba),
            ]),
        Vector::valid(
            "entropy-gray16",
            "entropy coding: gray, 16 bits, exponential kernel",
            scattered(161, sharp(GRAY), 20),
        ),
        Vector::valid(
            "entropy-gray-alpha8",
            "entropy coding: gray and alpha, which are the two axes",
            scattered(162, gray_alpha, 15),
        ),
        Vector::valid(
            "entropy-gray-alpha16",
            "entropy coding: gray and alpha, 16 bits",
            scattered(163, sharp(GRAY_ALPHA), 15),
        ),
        Vector::valid(
            "entropy-rgb8",
            "entropy coding: RGB from three colour axes",
            scattered(164, header(RGB, 40, 24), 30),
        )
        .also(&[Rendering::Size(20, 12)]),
        Vector::valid(
            "entropy-rgb16",
            "entropy coding: RGB, 16 bits",
            scattered(165, sharp(RGB), 20),
        ),
        Vector::valid(
            "entropy-rgba8",
            "entropy coding: RGBA, whose alpha is the fourth axis",
            scattered(166, header(RGBA, 19, 23), 20),
        ),
        Vector::valid(
            "entropy-rgba16",
            "entropy coding: RGBA, 16 bits",
            scattered(167, sharp(RGBA), 20),
        ),
        Vector::valid(
            "entropy-one",
            "entropy coding: one Gaussian",
            usual(gray, vec![at(&gray, [9.0, 7.0], 7)]),
        ),
        Vector::valid(
            "entropy-layers",
            "entropy coding: four layers; the models begin anew in each",
            layers,
        )
        .also(&[Rendering::Prefix(5), Rendering::Prefix(6), Rendering::Prefix(20)]),
        Vector::valid(
            "entropy-bounds",
            "entropy coding: bNDS says where each of four layers shows",
            bounded,
        )
        .also(&[
            Rendering::Region(1, 2, 3, 4),
            Rendering::Region(30, 17, 10, 7),
            Rendering::SizeAndRegion((400, 7), (120, 1, 9, 5)),
        ]),
        Vector::valid_chunks(
            "entropy-bounds-late",
            "entropy coding: bNDS between two layers",
            bounds_late.0,
            &bounds_late.1,
        )
        .also(&[Rendering::Region(1, 2, 3, 4), Rendering::Region(30, 17, 10, 7)]),
        Vector::valid(
            "entropy-two",
            "entropy coding: two layers, of which the last has 200 Gaussians and does not say so",
            two,
        )
        .also(&[Rendering::Prefix(5), Rendering::Prefix(100)]),
        Vector::valid(
            "entropy-geometry",
            "entropy coding: the header has steps of position, size, ratio and slant",
            other_geometry(GRAY),
        ),
        Vector::valid(
            "entropy-geometry-rgb8",
            "entropy coding: the header has steps of geometry behind those of three axes",
            other_geometry(RGB),
        ),
        Vector::valid(
            "entropy-ratios",
            "entropy coding: every colour axis has a step of its own",
            other_ratios(at_most(0.1), [136, 123, 141]),
        ),
        Vector::valid(
            "entropy-ratios-extreme",
            "entropy coding: the least and the largest ratio of the step of a colour axis to the first",
            other_ratios(0.031_25, [0, 255, 128]),
        ),
        Vector::valid(
            "entropy-exponents",
            "entropy coding: all step exponents; the higher ones have plain bits below their symbols",
            classes,
        ),
        Vector::valid(
            "entropy-excess",
            "entropy coding: codes on both sides of the largest that needs no excess, and up to the largest of all",
            excess,
        ),
        Vector::valid(
            "entropy-crowd",
            "entropy coding: nine Gaussians in a cell of one pixel, which is not split",
            crowd,
        ),
        Vector::valid(
            "entropy-many",
            "entropy coding: cells of 16 Gaussians and more, and of 256 and more; models adapt at every rate",
            many,
        ),
        Vector::valid(
            "entropy-dense",
            "entropy coding: four Gaussians for each byte, the most that is allowed",
            dense(densest()),
        ),
        Vector::valid(
            "entropy-outside",
            "entropy coding: centres in the roots around the picture",
            outside,
        ),
        Vector::valid(
            "entropy-one-pixel",
            "entropy coding: a picture of one pixel",
            usual(pixel, vec![at(&pixel, [0.4, 0.6], 5), at(&pixel, [3.0, -3.0], 9)]),
        )
        .also(&[Rendering::Size(16, 16)]),
        Vector::valid(
            "entropy-long",
            "entropy coding: 2000 x 3 pixels, 18 x 3 roots of 128 pixels",
            scattered(168, long, 12),
        ),
        Vector::valid(
            "entropy-high",
            "entropy coding: 1 x 300 pixels, an odd number of roots",
            scattered(169, high, 12),
        ),
        Vector::valid(
            "entropy-clamped",
            "entropy coding: logarithms of shapes clamped to [-20, 20], on which the position interval depends; one Gaussian is drawn",
            clamped,
        ),
        Vector::valid(
            "entropy-not-drawn",
            "entropy coding: one Gaussian that is drawn, and six that are not: out of bounds",
            not_drawn,
        ),
        Vector::valid("entropy-steps-least", "entropy coding: all steps are 2^-20", least),
        Vector::valid("entropy-steps-most", "entropy coding: all steps are 2^10", most),
    ]
}

pub(super) fn invalid() -> Vec<Vector> {
    let gray = Header { color: GRAY, ..Header::default() };
    let second = {
        let mut codes: Vec<Code> = (0..39).map(|n| at(&gray, [n as f32 * 0.4, 3.3], 2)).collect();
        codes.push(at(&gray, [4.0, 12.0], 5));
        codes
    };
    let first = vec![at(&gray, [8.0, 8.0], 9), at(&gray, [3.0, 12.0], -9)];
    let file = File::of_entropy_coded(gray, usual_steps(GRAY), vec![first, second.clone()]);
    let chunks = file.chunks();
    let usual_steps = usual_steps(GRAY);
    // H, two layers, E; the second layer is damaged.
    let replaced = |at: usize, chunk: Vec<u8>| {
        let mut chunks = chunks.clone();
        chunks[at] = chunk;
        of_chunks(&chunks)
    };
    // A layer that the oracle refuses as well, and says why.
    let refused = |name, shows, payload: &[u8], flaw: &str| {
        let found = entropy::read(gray.sides(), &usual_steps, second.len() as u32, payload);
        assert_eq!(found.map(|_| ()), Err(flaw), "{name}");
        Vector::invalid(name, shows, replaced(2, chunk(b"L", payload)))
    };
    let with_header = |change: &dyn Fn(&mut Header)| {
        let mut header = file.header;
        change(&mut header);
        replaced(0, header.chunk(&file.dequantizer()))
    };
    // The first layer with these bytes as its number.
    let with_number =
        |number: &[u8]| replaced(1, chunk(b"L", &[number, &payload(&chunks[1])[1..]].concat()));
    // A header for three channels with these codes of steps, and of those of geometry if there are any.
    let with_steps = |axes: (u16, [u8; 2]), geometry: &[u16]| {
        let header = Header { color: RGB, form: u8::from(!geometry.is_empty()), ..file.header };
        let geometry: Vec<u8> = geometry.iter().flat_map(|code| code.to_le_bytes()).collect();
        replaced(0, header.chunk(&[&axes.0.to_le_bytes()[..], &axes.1, &geometry].concat()))
    };
    let payload = payload(&chunks[2]).to_vec();
    let changed = |change: &dyn Fn(&mut Vec<u8>)| {
        let mut payload = payload.clone();
        change(&mut payload);
        payload
    };
    // The second layer of other symbols.
    let with_ops = |change: &dyn Fn(&mut Vec<Op>)| {
        let mut ops = entropy::write(gray.sides(), &usual_steps, &mut second.clone());
        change(&mut ops);
        rans::encode(&ops)
    };
    let with_symbol = |found: &dyn Fn(u32) -> bool, wrong: u32| {
        with_ops(&|ops| {
            let symbols = ops.iter_mut().filter_map(|op| match op {
                Op::Symbol { context, symbol } if found(*context) => Some(symbol),
                _ => None,
            });
            *symbols.last().expect("such a symbol") = wrong;
        })
    };
    let start = offsets(&chunks)[2];
    let invalid = Vector::invalid;
    let skipping = |name, shows, bytes| Vector::skipping(name, shows, file.clone(), bytes);
    vec![
        invalid(
            "xentropy-form-2",
            "entropy coding: an unknown form of steps, 2",
            with_header(&|h| h.form = 2),
        ),
        invalid(
            "xentropy-form-3",
            "entropy coding: an unknown form of steps, 3",
            with_header(&|h| h.form = 3),
        ),
        invalid("xentropy-steps-fewer", "entropy coding: steps of geometry that are not there", {
            with_header(&|h| h.form = 1)
        }),
        invalid(
            "xentropy-steps-more",
            "entropy coding: one step more than there are colour axes",
            replaced(0, file.header.chunk(&[&file.dequantizer()[..], &[128]].concat())),
        ),
        invalid("xentropy-step-over", "entropy coding: a step of the first axis just over 2^10", {
            with_steps((0xF001, [0, 0]), &[])
        }),
        invalid("xentropy-step-most", "entropy coding: the largest code of a step of geometry", {
            with_steps((0xA000, [128, 128]), &[0xA000, 0xA000, 0xA000, 0xFFFF])
        }),
        invalid(
            "xentropy-ratio-under",
            "entropy coding: a ratio that makes a step less than 2^-20",
            with_steps((0x0800, [112, 111]), &[]),
        ),
        invalid(
            "xentropy-ratio-over",
            "entropy coding: a ratio that makes a step more than 2^10",
            with_steps((0xE800, [144, 145]), &[]),
        ),
        invalid("xentropy-count-more", "entropy coding: one Gaussian more than declared", {
            with_header(&|h| h.gaussians -= 1)
        }),
        invalid("xentropy-count-fewer", "entropy coding: one Gaussian fewer than declared", {
            with_header(&|h| h.gaussians += 1)
        }),
        invalid("xentropy-empty", "entropy coding: a layer without Gaussians", with_number(&[0])),
        invalid(
            "xentropy-number-needless",
            "entropy coding: a layer whose number has a byte that it does not need",
            with_number(&[0x82, 0]),
        ),
        invalid("xentropy-number-over", "entropy coding: a layer whose number has 33 bits", {
            with_number(&[0x82, 0x80, 0x80, 0x80, 0x10])
        }),
        invalid(
            "xentropy-number-all",
            "entropy coding: a layer that leaves no Gaussian for the next one",
            with_number(&number(file.header.gaussians)),
        ),
        invalid("xentropy-number-none", "entropy coding: a layer that ends before its number", {
            replaced(1, chunk(b"L", &[]))
        }),
        invalid(
            "xentropy-number-last",
            "entropy coding: a last layer that begins with its number",
            replaced(2, chunk(b"L", &[&number(second.len() as u32)[..], &payload].concat())),
        ),
        invalid("xentropy-dense", "entropy coding: more than four Gaussians for each byte", {
            dense(densest() + 1).bytes()
        }),
        refused(
            "xentropy-exponent-8",
            "entropy coding: step exponent 8",
            &with_symbol(&|context| context == 0, 8),
            "an exponent over 7",
        ),
        refused(
            "xentropy-exponent-15",
            "entropy coding: step exponent 15",
            &with_symbol(&|context| context == 0, 15),
            "an exponent over 7",
        ),
        refused(
            "xentropy-few",
            "entropy coding: two Gaussians in a part of a cell that has one",
            &with_symbol(&|context| context == 158, 2),
            "a part with more than the whole",
        ),
        refused(
            "xentropy-share",
            "entropy coding: plain bits beyond the range of numbers that their symbol stands for",
            // The first symbol and bits tell how many of 40 are in the left half. Of these 41 numbers
            // the first symbol stands for 0, 1 and 2.
            &with_ops(&|ops| {
                ops[0] = Op::Symbol { context: 178, symbol: 0 };
                ops[1] = Op::Bits { count: 2, value: 3 };
            }),
            "a count beyond its range",
        ),
        refused(
            "xentropy-short",
            "entropy coding: more Gaussians than a layer's bytes can have",
            &payload[..9],
            "more than four Gaussians for each byte",
        ),
        invalid("xentropy-short-state", "entropy coding: a layer too short for the state", {
            replaced(1, chunk(b"L", &[&[2], &payload[..3]].concat()))
        }),
        refused(
            "xentropy-state",
            "entropy coding: an initial state below 2^16",
            &changed(&|payload| payload[2..4].fill(0)),
            "the state begins below 2^16",
        ),
        refused(
            "xentropy-words-fewer",
            "entropy coding: one word too few",
            &changed(&|payload| payload.truncate(payload.len() - 2)),
            "no word left",
        ),
        refused(
            "xentropy-words-more",
            "entropy coding: one word too many",
            &changed(&|payload| payload.extend([0, 0])),
            "words left",
        ),
        refused(
            "xentropy-byte-more",
            "entropy coding: one byte too many",
            &changed(&|payload| payload.push(0)),
            "words left",
        ),
        refused(
            "xentropy-end-state",
            "entropy coding: a final state other than 2^16",
            &with_ops(&|ops| ops.push(Op::Bits { count: 1, value: 1 })),
            "another state at the end",
        ),
        skipping(
            "skip-entropy-bounds-fewer",
            "entropy coding: bNDS with bounds of one layer, where there are two",
            file.clone().with(b"bNDS", &[0, 0, 255, 255]).bytes(),
        ),
        skipping(
            "skip-entropy-bounds-reversed",
            "entropy coding: bNDS with a last row above the first one",
            file.clone().with(b"bNDS", &[0, 0, 255, 255, 7, 9, 7, 8]).bytes(),
        ),
        skipping(
            "skip-entropy-bounds-twice",
            "entropy coding: two bNDS",
            file.clone().with(b"bNDS", &[0, 0, 255, 255].repeat(2)).with(b"bNDS", &[0; 8]).bytes(),
        ),
        invalid("xentropy-crc", "entropy coding: a flipped bit in the second layer", {
            let mut bytes = file.bytes();
            bytes[start + 20] ^= 4;
            bytes
        }),
        invalid(
            "xentropy-truncated",
            "entropy coding: ends within the second layer, of which nothing is shown",
            file.bytes()[..start + 40].to_vec(),
        ),
    ]
}
