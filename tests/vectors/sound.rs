//! The test vectors of everything but the entropy coding.

use super::common::{
    COVARIANCE, ENTROPY, EXPONENTIAL, Entry, File, GRAY, GRAY_ALPHA, Header, RGB, RGBA,
    ROTATION_SCALE, Random, chunk,
};
use super::{Rendering, Vector, header};
use image_gip::ColorModel;

/// Exif data with one entry, the orientation.
pub(super) const TURNED: &[u8] = b"MM\0*\0\0\0\x08\0\x01\x01\x12\0\x03\0\0\0\x01\0\x06\0\0\0\0\0\0";
const UPRIGHT: &[u8] = b"MM\0*\0\0\0\x08\0\x01\x01\x12\0\x03\0\0\0\x01\0\x01\0\0\0\0\0\0";

/// A header of a gray picture on black.
pub(super) fn gray() -> Header {
    Header { width: 24, height: 16, ..Header::default() }
}

/// The paper's bit depths over a picture of this size: 12 for positions, 10 for shapes, 6 for
/// colours; standard deviations from 0.3 to 6 pixels in their logarithm.
pub(super) fn packed(color: u8, size: (u32, u32)) -> Vec<Entry> {
    let mut entries = vec![
        Entry::linear(12, size.0 as f32 / 4096.0, 0.0),
        Entry::linear(12, size.1 as f32 / 4096.0, 0.0),
        Entry::log(10, 0.002_929_687_5, -1.2),
        Entry::linear(10, 0.007_812_5, -4.0),
        Entry::log(10, 0.002_929_687_5, -1.2),
    ];
    entries.resize(6 + usize::from(color), Entry::linear(6, 0.015_625, -0.5));
    entries
}

/// Random codes for `count` Gaussians.
pub(super) fn codes(seed: u64, entries: &[Entry], count: usize) -> Vec<u32> {
    let mut random = Random(seed);
    let code = |entry: &Entry| (random.next() & ((1 << entry.bits) - 1)) as u32;
    entries.iter().cycle().take(count * entries.len()).map(code).collect()
}

/// A packed file of random Gaussians.
pub(super) fn random_file(seed: u64, header: Header, count: usize) -> File {
    let entries = packed(header.color, (header.width, header.height));
    let codes = codes(seed, &entries, count);
    File::new(header, entries, vec![codes])
}

/// A gray file of floats on black.
pub(super) fn floats(header: Header, rows: &[[f32; 6]]) -> File {
    File::of_floats(header, &rows.iter().map(|row| row.to_vec()).collect::<Vec<_>>())
}

/// The payload of an `mDCV`: the primaries of BT.2020, D65, and 0.005 to 1000 cd/m².
pub(super) const MASTERING: &[u8; 24] =
    b"\x8A\x48\x39\x08\x21\x34\x9B\xAA\x19\x96\x08\xFC\x3D\x13\x40\x42\x00\x98\x96\x80\0\0\0\x32";

pub(super) fn valid() -> Vec<Vector> {
    [color_models(), parameterizations(), kernels(), quantizers(), chunks(), shapes(), bounds()]
        .concat()
}

/// Colour models and sample depths (section 5.2), and what may be asked for (section 9.1).
fn color_models() -> Vec<Vector> {
    vec![
        Vector::valid(
            "gray8",
            "packed coding: gray, 8 bits, quartic kernel, Cholesky parameterization; other sizes, regions and colour models",
            random_file(60, header(GRAY, 24, 16), 20),
        )
        .also(&[
            Rendering::Size(48, 32),
            Rendering::Size(12, 8),
            Rendering::Size(7, 31),
            Rendering::Size(1, 1),
            Rendering::Region(3, 5, 17, 9),
            Rendering::SizeAndRegion((240, 160), (100, 77, 33, 21)),
            Rendering::SizeAndRegion((8_388_608, 8_388_608), (4_000_000, 4_000_001, 9, 5)),
            Rendering::Color(ColorModel::GrayAlpha),
            Rendering::Color(ColorModel::Rgb),
            Rendering::Color(ColorModel::Rgba),
        ]),
        Vector::valid(
            "gray-alpha8",
            "gray and straight alpha",
            random_file(61, header(GRAY_ALPHA, 17, 9), 15),
        )
        .also(&[Rendering::Color(ColorModel::Rgba), Rendering::Size(5, 40)]),
        Vector::valid("rgb8", "RGB, 8 bits", random_file(62, header(RGB, 40, 24), 30)).also(&[
            Rendering::Size(20, 12),
            Rendering::Size(13, 50),
            Rendering::Color(ColorModel::Rgba),
        ]),
        Vector::valid("rgba8", "RGB and straight alpha", random_file(63, header(RGBA, 19, 23), 20))
            .also(&[
                Rendering::Size(18, 11),
                Rendering::Size(2, 3),
                Rendering::SizeAndRegion((7, 9), (2, 3, 4, 5)),
            ]),
        Vector::valid(
            "gray16",
            "gray, 16 bits",
            random_file(64, Header { depth: 16, ..header(GRAY, 24, 16) }, 20),
        )
        .also(&[Rendering::Size(9, 6), Rendering::Color(ColorModel::Rgba)]),
        Vector::valid(
            "rgba16",
            "RGBA, 16 bits",
            random_file(65, Header { depth: 16, ..header(RGBA, 16, 16) }, 20),
        )
        .also(&[Rendering::Size(6, 1)]),
    ]
}

/// Parameterizations (section 8).
fn parameterizations() -> Vec<Vector> {
    let gray = gray();
    let rotated = |s1: f32, s2: f32, angle: f32| [12.0, 8.0, s1, s2, angle, 0.3];
    let covariance_entries = {
        let mut entries = packed(RGB, (40, 24));
        entries[2] = Entry::log(10, 0.004_882_812_5, -2.0);
        entries[3] = Entry::linear(10, 0.031_25, -16.0);
        entries[4] = Entry::log(10, 0.004_882_812_5, -2.0);
        entries
    };
    let paper =
        Header { form: COVARIANCE, kernel: EXPONENTIAL, cutoff: 11.082_527, ..header(RGB, 40, 24) };
    vec![
        Vector::valid(
            "paper",
            "the paper's choices: exp(-q/2) cut off at weight 1/255, covariance parameterization with variances \
             in log, 12/12 + 10/10/10 + 6/6/6 bits; Gaussians whose codes give no covariance matrix are not drawn",
            {
                let codes = codes(66, &covariance_entries, 40);
                File::new(paper, covariance_entries.clone(), vec![codes])
            },
        )
        .also(&[Rendering::Size(20, 12)]),
        Vector::valid(
            "parameterization-covariance",
            "covariance parameterization in floats; four of the six matrices are not positive definite",
            floats(
                Header { form: COVARIANCE, ..gray },
                &[
                    [6.0, 5.0, 4.0, 1.5, 2.0, 0.8],
                    [12.0, 8.0, 9.0, -5.9, 4.0, 0.5],
                    [12.0, 8.0, 1.0, 2.0, 1.0, 0.9],
                    [12.0, 8.0, 4.0, 2.0, 1.0, 0.9],
                    [12.0, 8.0, -1.0, 0.0, 1.0, 0.9],
                    [12.0, 8.0, 0.0, 0.0, 1.0, 0.9],
                ],
            ),
        ),
        Vector::valid(
            "parameterization-rotation-scale",
            "rotation and scale in floats: angles in all quadrants, of many turns, and over 1024; negative \
             scales",
            floats(
                Header { form: ROTATION_SCALE, ..gray },
                &[
                    rotated(5.0, 0.7, 0.0),
                    rotated(5.0, 0.7, 0.5),
                    rotated(5.0, 0.7, 1.570_796_4),
                    rotated(5.0, 0.7, 2.5),
                    rotated(5.0, 0.7, -0.9),
                    rotated(3.0, 4.0, 1000.1),
                    rotated(3.0, 4.0, -1024.0),
                    rotated(9.0, 9.0, 1024.25),
                    rotated(-2.0, -6.0, 0.3),
                    rotated(-2.0, 6.0, 0.3),
                ],
            ),
        ),
    ]
}

/// Kernels (section 9.3).
fn kernels() -> Vec<Vector> {
    let gray = gray();
    vec![
        Vector::valid(
            "kernel-cutoff-2",
            "exponential kernel with cut-off 2, which leaves an edge; pixel centres exactly on it are drawn",
            floats(
                Header { kernel: EXPONENTIAL, cutoff: 2.0, ..gray },
                &[[8.5, 8.5, 1.0, 0.0, 1.0, 0.7], [16.0, 7.0, 4.0, 1.0, 3.0, 0.4]],
            ),
        ),
        Vector::valid(
            "kernel-cutoff-64",
            "exponential kernel with the largest cut-off",
            floats(
                Header { kernel: EXPONENTIAL, cutoff: 64.0, depth: 16, ..gray },
                &[[8.5, 8.5, 1.0, 0.0, 1.0, 0.7], [16.0, 7.0, 4.0, 1.0, 3.0, 0.4]],
            ),
        ),
    ]
}

/// Quantizers (section 6) and packed codes (section 7.2).
fn quantizers() -> Vec<Vector> {
    let spans = [24.0, 16.0, 4.0, 3.0, 4.0, 1.0, 1.0, 1.0, 1.0];
    let lows = [0.0, 0.0, 0.5, -1.5, 0.5, -0.5, -0.5, -0.5, -0.5];
    let linear = |depths: [u8; 9]| -> Vec<Entry> {
        let entry = |(bits, (span, low)): (u8, (f32, f32))| {
            Entry::linear(bits, span / (1_u32 << bits) as f32, low)
        };
        depths.into_iter().zip(spans.into_iter().zip(lows)).map(entry).collect()
    };
    let odd = linear([1, 3, 5, 7, 9, 11, 13, 15, 16]);
    let even = linear([2, 4, 6, 8, 10, 12, 14, 16, 1]);
    let logs = vec![
        Entry::log(8, 0.0125, 0.0),
        Entry::log(8, 0.0125, -0.5),
        Entry::log(8, 0.007_812_5, -1.0),
        Entry::log(8, 0.007_812_5, -2.0),
        Entry::log(8, 0.007_812_5, -1.0),
        Entry::log(8, 0.007_812_5, -3.0),
    ];
    vec![
        Vector::valid("depths-odd", "bit depths 1, 3, 5, 7, 9, 11, 13, 15, 16; padding bits", {
            let codes = codes(67, &odd, 7);
            File::new(header(RGBA, 24, 16), odd.clone(), vec![codes])
        }),
        Vector::valid("depths-even", "bit depths 2, 4, 6, 8, 10, 12, 14, 16, 1; padding bits", {
            let codes = codes(68, &even, 7);
            File::new(header(RGBA, 24, 16), even.clone(), vec![codes])
        }),
        Vector::valid("logarithms", "a logarithmic quantizer for every component", {
            let codes = codes(69, &logs, 12);
            File::new(gray(), logs.clone(), vec![codes])
        }),
    ]
}

/// Layers, metadata and other chunks (sections 4 and 5).
fn chunks() -> Vec<Vector> {
    let gray = gray();
    let layered = {
        let entries = packed(RGB, (32, 20));
        let layers = [5, 1, 9, 2].into_iter().zip(70..);
        let layers = layers.map(|(count, seed)| codes(seed, &entries, count)).collect();
        File::new(header(RGB, 32, 20), entries, layers)
    };
    let described = random_file(80, header(GRAY, 16, 16), 6)
        .with(b"iCCP", b"not a real ICC profile; decoders hand it over as it is")
        .with(b"eXIF", TURNED)
        .with(b"xMPD", b"<x:xmpmeta xmlns:x=\"adobe:ns:meta/\"/>")
        .with(b"tEXt", "Title\0Dämmerung über dem Meer".as_bytes())
        .with(b"tEXt", b"Comment\0")
        .with(b"tEXt", b"Comment\0keywords may repeat\nlines too");
    let ancillary = {
        let file = random_file(81, header(GRAY_ALPHA, 16, 16), 6);
        let mut chunks = file.chunks();
        chunks.insert(2, chunk(b"zzZz", b""));
        chunks.insert(1, chunk(b"prVt", b"safe to copy"));
        chunks.insert(1, chunk(b"abcD", b"all cases of letters are allowed; not safe to copy"));
        (file, chunks)
    };
    // With all kinds of metadata, of which the ICC profile alone stands before a layer.
    let late = {
        let entries = packed(GRAY, (24, 16));
        let layers = [3, 4, 2].into_iter().zip(76..);
        let layers = layers.map(|(count, seed)| codes(seed, &entries, count)).collect();
        let file = File::new(header(GRAY, 24, 16), entries, layers);
        let mut chunks = file.chunks();
        chunks.insert(4, chunk(b"tEXt", b"Comment\0after the last layer"));
        chunks.insert(4, chunk(b"prVt", b"unknown, and skipped"));
        chunks.insert(4, chunk(b"xMPD", b"<x:xmpmeta xmlns:x=\"adobe:ns:meta/\"/>"));
        chunks.insert(3, chunk(b"eXIF", UPRIGHT));
        chunks.insert(2, chunk(b"tEXt", b"Title\0after the first layer"));
        chunks.insert(1, chunk(b"iCCP", b"not a real ICC profile"));
        (file, chunks)
    };
    // PQ, made on a display of BT.2020's primaries, with 0.005 to 1000 cd/m².
    let dynamic = random_file(82, Header { depth: 16, ..header(RGB, 16, 16) }, 6)
        .with(b"cICP", &[9, 16, 0, 1])
        .with(b"mDCV", MASTERING)
        .with(b"cLLI", b"\x00\x98\x96\x80\x00\x26\x25\xA0");
    let unknown = {
        let file = random_file(83, header(GRAY, 16, 16), 6);
        let mut chunks = file.chunks();
        chunks.insert(1, chunk(b"cICP", &[255, 0, 0, 1]));
        chunks.insert(1, chunk(b"iCCP", b"not a real ICC profile"));
        (file, chunks)
    };
    let long = {
        let entries = vec![Entry::linear(3, 2.0, 1.0); 6];
        let layers = [127, 128, 1, 300].into_iter().zip(85..);
        let layers = layers.map(|(count, seed)| codes(seed, &entries, count)).collect();
        File::new(gray, entries, layers).with(b"tEXt", &[b"Comment\0", &[b'.'; 200][..]].concat())
    };
    let uncut =
        Header { kernel: EXPONENTIAL, cutoff: 4.0, base: [0x1234, 0, 0, 0], depth: 16, ..gray };
    let empty = |header: Header| File::of_floats(header, &[]);
    let entropy_coded = Header { coding: ENTROPY, form: 1, base: [0x6060, 0, 0, 0], ..gray };
    vec![
        Vector::valid("layers", "four layers; pictures of the first Gaussians only", layered).also(
            &[
                Rendering::Prefix(5),
                Rendering::Prefix(6),
                Rendering::Prefix(0),
                Rendering::Prefix(1000),
            ],
        ),
        Vector::valid("metadata", "an ICC profile, Exif, XMP and three texts", described),
        Vector::valid(
            "cicp",
            "cICP with BT.2020 and PQ, mDCV and cLLI; 16 bits",
            dynamic,
        ),
        Vector::valid_chunks(
            "cicp-unknown",
            "cICP with codes that H.273 does not define, after an ICC profile: both are handed over",
            unknown.0,
            &unknown.1,
        ),
        Vector::valid_chunks(
            "ancillary",
            "unknown ancillary chunks wherever they may stand: all are skipped",
            ancillary.0,
            &ancillary.1,
        ),
        Vector::valid_chunks(
            "metadata-late",
            "metadata between and after the layers: text, XMP, Exif that does not turn the picture",
            late.0,
            &late.1,
        ),
        Vector::valid(
            "layers-long",
            "layers of 127, 128, 1 and 300 Gaussians and a text of 208 bytes: numbers of one byte and of two",
            long,
        )
        .also(&[Rendering::Prefix(127), Rendering::Prefix(256)]),
        Vector::valid(
            "no-gaussians",
            "no Gaussians: the base colour alone, and no quantizers",
            empty(Header { color: RGBA, base: [0, 0x7F7F, 0x8080, 0xFFFF], ..Header::default() }),
        ),
        Vector::valid(
            "no-gaussians16",
            "no Gaussians, 16 bits, exponential kernel, whose cut-off is there all the same",
            empty(uncut),
        ),
        Vector::valid(
            "no-gaussians-entropy",
            "no Gaussians: no steps either, though the format says that those of geometry are there",
            empty(entropy_coded),
        ),
    ]
}

/// Gaussians and pictures of unusual shapes and sizes (sections 8.5 and 9.2).
fn shapes() -> Vec<Vector> {
    let gray = gray();
    let needle = |x: f32, y: f32, l11: f32, l21: f32, l22: f32| [x, y, l11, l21, l22, 0.5];
    let infinite_limit = 16_777_216.0;
    let least = 0.000_244_140_63;
    vec![
        Vector::valid(
            "one-pixel",
            "a picture of one pixel",
            floats(Header { width: 1, height: 1, ..gray }, &[[0.25, 0.75, 0.5, 0.1, 0.4, 0.9]]),
        )
        .also(&[Rendering::Size(16, 16)]),
        Vector::valid(
            "far-outside",
            "Gaussians centred outside the picture, near and far, some of which reach into it",
            floats(
                gray,
                &[
                    [-10.0, 8.0, 8.0, 0.0, 4.0, 0.9],
                    [30.0, 30.0, 6.0, -5.0, 6.0, 0.9],
                    [1e6, 1e6, 4e5, 4e5, 10.0, 0.5],
                    [-1.6e7, 3.0, 1e7, 0.0, 2.0, 0.5],
                    [1.6e7, 1.6e7, 1.0, 0.0, 1.0, 1.0],
                ],
            ),
        ),
        Vector::valid(
            "needles",
            "long, thin Gaussians at several slants, up to the bounds of section 8.5",
            floats(
                gray,
                &[
                    needle(12.0, 8.0, 20.0, 20.0, 0.25),
                    needle(12.0, 8.0, 20.0, -15.0, 0.25),
                    needle(12.0, 8.0, 0.3, 20.0, 0.3),
                    needle(4.5, 8.0, 0.01, 1000.0, 1000.0),
                    needle(12.0, 8.5, 1e5, 0.0, 0.01),
                    needle(0.0, 0.0, infinite_limit, infinite_limit * 0.625, least),
                    needle(0.5, 0.5, least, infinite_limit, infinite_limit),
                ],
            ),
        ),
        Vector::valid(
            "huge",
            "Gaussians a hundred and a million times as wide as the picture",
            floats(
                gray,
                &[
                    [0.0, 16.0, 2400.0, 100.0, 1600.0, 0.4],
                    [1000.0, -900.0, 2400.0, -1000.0, 1600.0, 0.3],
                    [5.0, 5.0, infinite_limit, infinite_limit, infinite_limit, 0.2],
                ],
            ),
        ),
        Vector::valid(
            "dots",
            "Gaussians 0.01 pixels wide and less, which show only where they hit a pixel centre",
            floats(
                gray,
                &[
                    [3.5, 4.5, 0.01, 0.0, 0.01, 0.9],
                    [7.51, 4.5, 0.01, 0.0, 0.01, 0.9],
                    [11.7, 4.7, 0.01, 0.0, 0.01, 0.9],
                    [15.5, 4.5, least, 0.0, least, 0.9],
                    [19.5, 4.5, 0.01, 0.02, 0.3, 0.9],
                ],
            ),
        )
        .also(&[Rendering::Size(6, 4), Rendering::Size(96, 64)]),
    ]
}

/// The bounds of what is drawn (section 8.5).
fn bounds() -> Vec<Vector> {
    let gray = gray();
    vec![Vector::valid(
        "not-drawn",
        "one Gaussian that is drawn, and fifteen that are not: out of bounds",
        {
            let sound = [8.0, 8.0, 3.0, 1.0, 2.0, 0.7];
            let mut rows = vec![sound];
            for (component, value) in [
                (0, 16_777_218.0),
                (0, -16_777_218.0),
                (1, 16_777_218.0),
                (1, f32::MAX),
                (2, 0.0),
                (2, -3.0),
                (2, 0.000_244_140_61),
                (2, 16_777_218.0),
                (3, 16_777_218.0),
                (3, -16_777_218.0),
                (4, 0.0),
                (4, -2.0),
                (4, 1e-45),
                (4, 16_777_218.0),
                (5, 65_536.01),
            ] {
                let mut row = sound;
                row[component] = value;
                rows.push(row);
            }
            floats(gray, &rows)
        },
    )]
}
