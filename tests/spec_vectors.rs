//! The test vectors of the specification: `spec/vectors` holds what this builds, byte for byte,
//! and every way to decode it gives the pixels that `index.tsv` lists.
//!
//! `BLESS=1 cargo test --test spec_vectors` writes the folder again.

mod common;
#[path = "vectors/entropy.rs"]
mod entropy;

use core::fmt::Write as _;
use std::fs;
use std::path::Path;

use common::oracle::{self, Request};
use common::{
    COVARIANCE, EXPONENTIAL, Entry, File, GRAY, GRAY_ALPHA, Ghdr, QUARTIC, RGB, RGBA,
    ROTATION_SCALE, Random, chunk, crc32, decode, decode_pieces, gaus, of_chunks, qntz,
};
use image_gip::{
    ColorModel, DecodeError, Limits, Region, RenderOptions, SampleDepth, StreamDecoder, Threads,
};

const FOLDER: &str = concat!(env!("CARGO_MANIFEST_DIR"), "/spec/vectors");

/// One file of the folder.
struct Vector {
    name: &'static str,
    shows: &'static str,
    bytes: Vec<u8>,
    /// The structure behind the bytes, for the oracle; `None` for a file that breaks a rule.
    file: Option<File>,
    /// Further ways to render it.
    requests: Vec<Rendering>,
}

#[derive(Clone, Copy)]
enum Rendering {
    Whole,
    Size(u32, u32),
    Region(u32, u32, u32, u32),
    SizeAndRegion((u32, u32), (u32, u32, u32, u32)),
    Prefix(u32),
    Color(ColorModel),
}

impl Rendering {
    fn name(self) -> String {
        match self {
            Self::Whole => "whole".into(),
            Self::Size(w, h) => format!("size {w}x{h}"),
            Self::Region(x, y, w, h) => format!("region {w}x{h} at {x},{y}"),
            Self::SizeAndRegion((sw, sh), (x, y, w, h)) => {
                format!("size {sw}x{sh}, region {w}x{h} at {x},{y}")
            }
            Self::Prefix(count) => format!("first {count}"),
            Self::Color(color) => format!("as {color:?}"),
        }
    }

    fn options(self) -> RenderOptions {
        let options = RenderOptions::new();
        let region = |(x, y, width, height)| Region { x, y, width, height };
        match self {
            Self::Whole => options,
            Self::Size(w, h) => options.with_size(w, h),
            Self::Region(x, y, w, h) => options.with_region(region((x, y, w, h))),
            Self::SizeAndRegion((w, h), part) => options.with_size(w, h).with_region(region(part)),
            Self::Prefix(count) => options.with_prefix(count),
            Self::Color(color) => options.with_color(color),
        }
    }

    /// The same for the oracle, which does not widen colour models.
    fn request(self, file: &File) -> Option<Request> {
        let mut request = Request::whole(file);
        match self {
            Self::Whole => {}
            Self::Size(w, h) => request = Request::at(w, h),
            Self::Region(x, y, w, h) => request.region = (x, y, w, h),
            Self::SizeAndRegion(size, region) => {
                (request.size, request.region) = (size, region);
            }
            Self::Prefix(count) => request.prefix = count as usize,
            Self::Color(_) => return None,
        }
        Some(request)
    }
}

impl Vector {
    fn valid(name: &'static str, shows: &'static str, file: File) -> Self {
        let bytes = file.bytes();
        Self { name, shows, bytes, file: Some(file), requests: vec![Rendering::Whole] }
    }

    /// A valid file whose chunks are not just those of `file`.
    fn valid_chunks(
        name: &'static str,
        shows: &'static str,
        file: File,
        chunks: &[Vec<u8>],
    ) -> Self {
        Self { bytes: of_chunks(chunks), ..Self::valid(name, shows, file) }
    }

    fn invalid(name: &'static str, shows: &'static str, bytes: Vec<u8>) -> Self {
        Self { name, shows, bytes, file: None, requests: Vec::new() }
    }

    fn also(mut self, requests: &[Rendering]) -> Self {
        self.requests.extend(requests);
        self
    }
}

/// The paper's bit depths over a picture of this size: 12 for positions, 10 for shapes, 6 for
/// colours; standard deviations from 0.3 to 6 pixels in their logarithm.
fn packed(color: u8, size: (u32, u32)) -> Vec<Entry> {
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
fn codes(seed: u64, entries: &[Entry], count: usize) -> Vec<u32> {
    let mut random = Random(seed);
    let code = |entry: &Entry| (random.next() & ((1 << entry.bits) - 1)) as u32;
    entries.iter().cycle().take(count * entries.len()).map(code).collect()
}

fn header(color: u8, width: u32, height: u32) -> Ghdr {
    let mut base = [0; 4];
    base[..=usize::from(color)].fill(0x8080);
    Ghdr { color, width, height, base, ..Ghdr::default() }
}

/// A packed file of random Gaussians.
fn random_file(seed: u64, header: Ghdr, count: usize) -> File {
    let entries = packed(header.color, (header.width, header.height));
    let codes = codes(seed, &entries, count);
    File::new(header, entries, vec![codes])
}

/// A gray file of floats on black.
fn floats(header: Ghdr, rows: &[[f32; 6]]) -> File {
    File::of_floats(header, &rows.iter().map(|row| row.to_vec()).collect::<Vec<_>>())
}

fn valid_vectors() -> Vec<Vector> {
    let gray = Ghdr { width: 24, height: 16, ..Ghdr::default() };
    let needle = |x: f32, y: f32, l11: f32, l21: f32, l22: f32| [x, y, l11, l21, l22, 0.5];
    let rotated = |s1: f32, s2: f32, angle: f32| [12.0, 8.0, s1, s2, angle, 0.3];
    let covariance_entries = {
        let mut entries = packed(RGB, (40, 24));
        entries[2] = Entry::log(10, 0.004_882_812_5, -2.0);
        entries[3] = Entry::linear(10, 0.031_25, -16.0);
        entries[4] = Entry::log(10, 0.004_882_812_5, -2.0);
        entries
    };
    let paper = Ghdr {
        parameterization: COVARIANCE,
        kernel: EXPONENTIAL,
        cutoff: 11.082_527,
        ..header(RGB, 40, 24)
    };
    let depths = [1, 3, 5, 7, 9, 11, 13, 15, 16];
    let spans = [24.0, 16.0, 4.0, 3.0, 4.0, 1.0, 1.0, 1.0, 1.0];
    let lows = [0.0, 0.0, 0.5, -1.5, 0.5, -0.5, -0.5, -0.5, -0.5];
    let odd: Vec<Entry> = depths
        .into_iter()
        .zip(spans.into_iter().zip(lows))
        .map(|(bits, (span, low)): (u8, (f32, f32))| {
            Entry::linear(bits, span / (1_u32 << bits) as f32, low)
        })
        .collect();
    let even: Vec<Entry> = [2, 4, 6, 8, 10, 12, 14, 16, 1]
        .into_iter()
        .zip(spans.into_iter().zip(lows))
        .map(|(bits, (span, low)): (u8, (f32, f32))| {
            Entry::linear(bits, span / (1_u32 << bits) as f32, low)
        })
        .collect();
    let logs = vec![
        Entry::log(8, 0.0125, 0.0),
        Entry::log(8, 0.0125, -0.5),
        Entry::log(8, 0.007_812_5, -1.0),
        Entry::log(8, 0.007_812_5, -2.0),
        Entry::log(8, 0.007_812_5, -1.0),
        Entry::log(8, 0.007_812_5, -3.0),
    ];
    let layered = {
        let entries = packed(RGB, (32, 20));
        let layers = [5, 1, 9, 2].into_iter().zip(70..);
        let layers = layers.map(|(count, seed)| codes(seed, &entries, count)).collect();
        File::new(header(RGB, 32, 20), entries, layers)
    };
    let described = random_file(80, header(GRAY, 16, 16), 6)
        .with(b"iCCP", b"not a real ICC profile; decoders hand it over as it is")
        .with(b"eXIf", b"MM\0*\0\0\0\x08\0\x01\x01\x12\0\x03\0\0\0\x01\0\x06\0\0\0\0\0\0")
        .with(b"xMPd", b"<x:xmpmeta xmlns:x=\"adobe:ns:meta/\"/>")
        .with(b"tEXt", "Title\0Dämmerung über dem Meer".as_bytes())
        .with(b"tEXt", b"Comment\0")
        .with(b"tEXt", b"Comment\0keywords may repeat\nlines too");
    let ancillary = {
        let file = random_file(81, header(GRAY_ALPHA, 16, 16), 6);
        let mut chunks = file.chunks();
        chunks.insert(3, chunk(b"tEXt", b"known, but late and so skipped unread"));
        chunks.insert(3, chunk(b"zzZz", b""));
        chunks.insert(2, chunk(b"prVt", b"private and safe to copy"));
        chunks.insert(1, chunk(b"abcd", b"reserved bit set: unknown, and skipped"));
        (file, chunks)
    };
    let unquantized = {
        let file = floats(Ghdr { base: [0x1234, 0, 0, 0], ..gray }, &[]);
        let chunks = vec![chunk(b"GHDR", &file.header.payload()), chunk(b"GEND", &[])];
        (file, chunks)
    };
    let infinite_limit = 16_777_216.0;
    let least = 0.000_244_140_63;
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
            random_file(64, Ghdr { depth: 16, ..header(GRAY, 24, 16) }, 20),
        )
        .also(&[Rendering::Size(9, 6), Rendering::Color(ColorModel::Rgba)]),
        Vector::valid(
            "rgba16",
            "RGBA, 16 bits",
            random_file(65, Ghdr { depth: 16, ..header(RGBA, 16, 16) }, 20),
        )
        .also(&[Rendering::Size(6, 1)]),
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
                Ghdr { parameterization: COVARIANCE, ..gray },
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
                Ghdr { parameterization: ROTATION_SCALE, ..gray },
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
        Vector::valid(
            "kernel-cutoff-2",
            "exponential kernel with cut-off 2, which leaves an edge; pixel centres exactly on it are drawn",
            floats(
                Ghdr { kernel: EXPONENTIAL, cutoff: 2.0, ..gray },
                &[[8.5, 8.5, 1.0, 0.0, 1.0, 0.7], [16.0, 7.0, 4.0, 1.0, 3.0, 0.4]],
            ),
        ),
        Vector::valid(
            "kernel-cutoff-64",
            "exponential kernel with the largest cut-off",
            floats(
                Ghdr { kernel: EXPONENTIAL, cutoff: 64.0, depth: 16, ..gray },
                &[[8.5, 8.5, 1.0, 0.0, 1.0, 0.7], [16.0, 7.0, 4.0, 1.0, 3.0, 0.4]],
            ),
        ),
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
            File::new(gray, logs.clone(), vec![codes])
        }),
        Vector::valid("layers", "four layers; pictures of the first Gaussians only", layered).also(&[
            Rendering::Prefix(5),
            Rendering::Prefix(6),
            Rendering::Prefix(0),
            Rendering::Prefix(1000),
        ]),
        Vector::valid("metadata", "an ICC profile, Exif, XMP and three texts", described),
        Vector::valid_chunks(
            "ancillary",
            "unknown ancillary chunks wherever they may stand, and a known one after a layer: all are skipped",
            ancillary.0,
            &ancillary.1,
        ),
        Vector::valid(
            "no-gaussians",
            "no Gaussians: the base colour alone",
            File::of_floats(
                Ghdr { color: RGBA, base: [0, 0x7FFF, 0x8000, 0xFFFF], ..Ghdr::default() },
                &[],
            ),
        ),
        Vector::valid_chunks(
            "no-quantizers",
            "without a layer, QNTZ may be absent: the smallest file",
            unquantized.0,
            &unquantized.1,
        ),
        Vector::valid(
            "one-pixel",
            "a picture of one pixel",
            floats(Ghdr { width: 1, height: 1, ..gray }, &[[0.25, 0.75, 0.5, 0.1, 0.4, 0.9]]),
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
        Vector::valid(
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
        ),
        Vector::valid(
            "order",
            "amplitudes of 100 and more that cancel, so that the order of summation shows",
            floats(
                Ghdr { depth: 16, ..gray },
                &[
                    [9.0, 8.0, 5.0, 1.0, 4.0, 100.0],
                    [9.01, 8.0, 5.0, 1.0, 4.0, -100.0],
                    [14.0, 8.0, 5.0, 1.0, 4.0, 0.3],
                    [9.0, 8.0, 5.0, 1.0, 4.0, 65_536.0],
                    [14.0, 9.0, 5.0, 1.0, 4.0, 0.001],
                    [9.0, 8.0, 5.0, 1.0, 4.0, -65_536.0],
                ],
            ),
        ),
        Vector::valid(
            "thousand-equal",
            "a thousand equal Gaussians from a quantizer with one bit per component",
            {
                let entries = [12.0, 8.0, 4.0, 1.0, 3.0, 0.001].map(|v| Entry::linear(1, 1.0, v));
                File::new(gray, entries.to_vec(), vec![vec![0; 6000]])
            },
        ),
    ]
}

fn invalid_vectors() -> Vec<Vector> {
    let entries = vec![Entry::FLOAT; 6];
    let sound_codes = [8.0_f32, 8.0, 2.0, 0.5, 2.0, 0.5].map(f32::to_bits);
    let layers = vec![sound_codes.to_vec(), sound_codes.repeat(2), sound_codes.to_vec()];
    let file = File::new(Ghdr::default(), entries.clone(), layers);
    let bytes = file.bytes();
    let chunks = file.chunks();
    // GHDR, QNTZ, three layers, GEND; the first layer is number 2.
    let changed = |at: usize, change: &dyn Fn(&mut Vec<u8>)| {
        let mut bytes = bytes.clone();
        let start = 8 + chunks[..at].iter().map(Vec::len).sum::<usize>();
        let mut chunk = bytes.split_off(start);
        let rest = chunk.split_off(chunks[at].len());
        change(&mut chunk);
        [bytes, chunk, rest].concat()
    };
    let replaced = |at: usize, chunk: Vec<u8>| {
        let mut chunks = chunks.clone();
        chunks[at] = chunk;
        of_chunks(&chunks)
    };
    let inserted = |at: usize, chunk: Vec<u8>| {
        let mut chunks = chunks.clone();
        chunks.insert(at, chunk);
        of_chunks(&chunks)
    };
    let removed = |at: usize| {
        let mut chunks = chunks.clone();
        chunks.remove(at);
        of_chunks(&chunks)
    };
    let with_header = |change: &dyn Fn(&mut Ghdr)| {
        let mut header = file.header;
        change(&mut header);
        replaced(0, chunk(b"GHDR", &header.payload()))
    };
    let with_entry = |entry: Entry| {
        let mut entries = entries.clone();
        entries[2] = entry;
        replaced(1, chunk(b"QNTZ", &qntz(&entries)))
    };
    let with_layer = |codes: &[u32]| replaced(3, chunk(b"GAUS", &gaus(&entries, codes)));
    let nan = {
        let mut codes = sound_codes.repeat(2);
        codes[9] = 0x7FC0_0000;
        codes
    };
    let infinite = {
        let mut codes = sound_codes.repeat(2);
        codes[11] = 0xFF80_0000;
        codes
    };
    let padded = {
        let entries = vec![Entry::linear(3, 1.0, 1.0); 6];
        let mut payload = gaus(&entries, &[1; 6]);
        payload[6] |= 0x80;
        let header = Ghdr { gaussians: 1, layers: 1, ..Ghdr::default() };
        of_chunks(&[
            chunk(b"GHDR", &header.payload()),
            chunk(b"QNTZ", &qntz(&entries)),
            chunk(b"GAUS", &payload),
            chunk(b"GEND", &[]),
        ])
    };
    let last = |chunk: &mut Vec<u8>| chunk.len() - 1;
    let scale = |scale: f32| with_entry(Entry::linear(8, scale, 0.5));
    vec![
        Vector::invalid("xempty", "no byte at all", Vec::new()),
        Vector::invalid("xsignature", "line endings that a transfer in text mode has converted", {
            let mut bytes = bytes.clone();
            bytes.remove(4);
            bytes
        }),
        Vector::invalid("xtruncated-header", "ends within the header", bytes[..40].to_vec()),
        Vector::invalid(
            "xtruncated-layer",
            "ends within the second layer: the Gaussians that arrived are shown",
            bytes[..8 + 48 + 84 + 40 + 8 + 4 + 24 + 5].to_vec(),
        ),
        Vector::invalid("xtruncated-end", "no GEND", removed(5)),
        Vector::invalid(
            "xcrc-header",
            "a wrong CRC of the header",
            changed(0, &|c| {
                let at = last(c);
                c[at] ^= 1;
            }),
        ),
        Vector::invalid(
            "xcrc-layer",
            "a flipped bit in the second layer",
            changed(3, &|c| c[20] ^= 4),
        ),
        Vector::invalid("xcrc-end", "a wrong CRC of the last chunk: all Gaussians are kept", {
            changed(5, &|c| {
                let at = last(c);
                c[at] ^= 1;
            })
        }),
        Vector::invalid(
            "xcritical",
            "an unknown critical chunk",
            inserted(2, chunk(b"ABCD", b"?")),
        ),
        Vector::invalid(
            "xtype",
            "a type that is not four letters",
            inserted(2, chunk(b"ab1d", b"?")),
        ),
        Vector::invalid("xlength-over", "a length over 2^31 - 1", changed(2, &|c| c[3] = 0x80)),
        Vector::invalid("xlength-header", "a header of 35 bytes", {
            let mut payload = file.header.payload();
            payload.pop();
            replaced(0, chunk(b"GHDR", &payload))
        }),
        Vector::invalid(
            "xlength-quantizers",
            "one quantizer too few",
            replaced(1, chunk(b"QNTZ", &qntz(&entries[1..]))),
        ),
        Vector::invalid("xlength-layer", "a layer one byte longer than its count says", {
            let mut payload = gaus(&entries, &sound_codes.repeat(2));
            payload.push(0);
            replaced(3, chunk(b"GAUS", &payload))
        }),
        Vector::invalid("xlength-end", "GEND with a payload", replaced(5, chunk(b"GEND", &[0]))),
        Vector::invalid("xversion", "version 2", with_header(&|h| h.version = 2)),
        Vector::invalid("xcoding", "an unknown coding", with_header(&|h| h.coding = 2)),
        Vector::invalid("xcolor", "an unknown colour model", with_header(&|h| h.color = 4)),
        Vector::invalid("xdepth", "a sample depth of 12", with_header(&|h| h.depth = 12)),
        Vector::invalid("xwidth-zero", "a width of 0", with_header(&|h| h.width = 0)),
        Vector::invalid(
            "xheight-over",
            "a height over 2^20",
            with_header(&|h| h.height = 1_048_577),
        ),
        Vector::invalid(
            "xcount-fewer",
            "one Gaussian fewer than declared",
            with_header(&|h| h.gaussians = 5),
        ),
        Vector::invalid(
            "xcount-more",
            "one Gaussian more than declared",
            with_header(&|h| h.gaussians = 3),
        ),
        Vector::invalid(
            "xlayers-fewer",
            "one layer fewer than declared",
            with_header(&|h| h.layers = 4),
        ),
        Vector::invalid(
            "xlayers-more",
            "one layer more than declared",
            with_header(&|h| h.layers = 2),
        ),
        Vector::invalid(
            "xlayers-zero",
            "Gaussians without a layer",
            with_header(&|h| h.layers = 0),
        ),
        Vector::invalid("xkernel", "an unknown kernel", with_header(&|h| h.kernel = 2)),
        Vector::invalid(
            "xcutoff-nan",
            "a cut-off of NaN",
            with_header(&|h| {
                (h.kernel, h.cutoff) = (EXPONENTIAL, f32::from_bits(0x7FC0_0000));
            }),
        ),
        Vector::invalid(
            "xcutoff-over",
            "a cut-off over 64",
            with_header(&|h| {
                (h.kernel, h.cutoff) = (EXPONENTIAL, 64.5);
            }),
        ),
        Vector::invalid(
            "xcutoff-quartic",
            "quartic kernel with a cut-off other than 4",
            with_header(&|h| {
                (h.kernel, h.cutoff) = (QUARTIC, 9.0);
            }),
        ),
        Vector::invalid(
            "xparameterization",
            "an unknown parameterization",
            with_header(&|h| h.parameterization = 3),
        ),
        Vector::invalid(
            "xtransform",
            "an unknown colour transform",
            with_header(&|h| h.transform = 1),
        ),
        Vector::invalid(
            "xreserved",
            "a reserved byte that is not zero",
            with_header(&|h| {
                h.reserved[2] = 1;
            }),
        ),
        Vector::invalid(
            "xbase",
            "a base colour in a channel that gray does not have",
            with_header(&|h| {
                h.base[1] = 1;
            }),
        ),
        Vector::invalid("xscale-zero", "a scale of zero", scale(0.0)),
        Vector::invalid("xscale-negative", "a negative scale", scale(-1.0)),
        Vector::invalid("xscale-nan", "a scale of NaN", scale(f32::from_bits(0x7FC0_0000))),
        Vector::invalid("xscale-infinite", "an infinite scale", scale(f32::INFINITY)),
        Vector::invalid("xoffset-nan", "an offset of NaN", {
            with_entry(Entry::log(8, 1.0, f32::from_bits(0x7FC0_0000)))
        }),
        Vector::invalid("xbits-zero", "a bit depth of 0", with_entry(Entry::linear(0, 1.0, 0.5))),
        Vector::invalid("xbits-over", "a bit depth of 17", with_entry(Entry::linear(17, 1.0, 0.5))),
        Vector::invalid("xquantizer", "an unknown kind of quantizer", {
            with_entry(Entry { kind: 3, ..Entry::linear(8, 1.0, 0.5) })
        }),
        Vector::invalid("xfloat-scale", "a float with a scale that is not 1", {
            with_entry(Entry { scale: 2.0, ..Entry::FLOAT })
        }),
        Vector::invalid("xfloat-nan", "a float attribute that is NaN", with_layer(&nan)),
        Vector::invalid(
            "xfloat-infinite",
            "a float attribute that is infinite",
            with_layer(&infinite),
        ),
        Vector::invalid(
            "xlayer-empty",
            "a layer without Gaussians",
            replaced(3, chunk(b"GAUS", &[0; 4])),
        ),
        Vector::invalid("xpadding", "a padding bit that is not zero", padded),
        Vector::invalid("xorder-quantizers", "QNTZ after a layer", {
            let mut chunks = chunks.clone();
            chunks.swap(1, 2);
            of_chunks(&chunks)
        }),
        Vector::invalid("xorder-header", "a chunk before GHDR", inserted(0, chunk(b"prVt", b""))),
        Vector::invalid("xtwice-header", "two headers", inserted(1, chunks[0].clone())),
        Vector::invalid("xtwice-quantizers", "two QNTZ", inserted(1, chunks[1].clone())),
        Vector::invalid("xtwice-icc", "two ICC profiles", {
            let chunks =
                [vec![chunks[0].clone()], vec![chunk(b"iCCP", b"p"); 2], chunks[1..].to_vec()];
            of_chunks(&chunks.concat())
        }),
        Vector::invalid("xtext", "a text without the NUL after its keyword", {
            inserted(1, chunk(b"tEXt", b"Title: none"))
        }),
        Vector::invalid("xtext-utf8", "a text that is not UTF-8", {
            inserted(1, chunk(b"tEXt", b"Title\0\xE9"))
        }),
    ]
}

/// The CRC-32 of the interleaved samples at the file's depth, 16-bit ones big-endian.
fn render(decoder: &StreamDecoder, options: &RenderOptions) -> u32 {
    let picture = decoder.picture().expect("the header has arrived");
    let mut bytes = vec![0; picture.output_len(options).expect("fits")];
    match picture.header().depth {
        SampleDepth::Eight => picture.render_u8(options, &mut bytes).expect("a sound request"),
        _ => {
            let mut samples = vec![0; bytes.len()];
            picture.render_u16(options, &mut samples).expect("a sound request");
            bytes = samples.iter().flat_map(|sample| sample.to_be_bytes()).collect();
        }
    }
    crc32(&bytes)
}

/// All ways to decode the file; they must agree. The lines of the index that belong to it.
fn lines(vector: &Vector) -> String {
    let Vector { name, shows, bytes, file, requests } = vector;
    let (decoder, result) = decode(bytes);
    let (by_bytes, by_bytes_result) = decode_pieces(bytes.chunks(1), Limits::default());
    let mut lines = String::new();
    let Some(file) = file else {
        let error = result.expect_err(name);
        let other = by_bytes_result.expect_err(name);
        assert_eq!(error.to_string(), other.to_string(), "{name}");
        let kept = decoder.gaussians().len();
        assert_eq!(by_bytes.gaussians().len(), kept, "{name}");
        let what = match error {
            DecodeError::Signature => "signature".into(),
            DecodeError::Malformed { chunk, .. } => format!("malformed {chunk}"),
            DecodeError::Unsupported { chunk, .. } => format!("unsupported {chunk}"),
            DecodeError::UnexpectedEnd { chunk: Some(chunk) } => format!("unexpected end {chunk}"),
            DecodeError::UnexpectedEnd { chunk: None } => "unexpected end".into(),
            error => panic!("{name}: {error}"),
        };
        writeln!(lines, "{name}.gip\terror\t{what}; {kept} kept\t{shows}").expect("a string");
        return lines;
    };
    result.expect(name);
    by_bytes_result.expect(name);
    for request in requests {
        let crc = render(&decoder, &request.options());
        for reference in [false, true] {
            for threads in [Threads::One, Threads::Pool] {
                let options = request.options().with_reference(reference).with_threads(threads);
                let found = render(&by_bytes, &options);
                assert_eq!(found, crc, "{name}, {}: reference {reference}", request.name());
            }
        }
        if let Some(request) = request.request(file) {
            let depth = file.header.depth;
            let samples = oracle::samples(&oracle::render(file, &request), depth);
            let bytes = samples.into_iter().flat_map(|sample| match depth {
                8 => vec![sample as u8],
                _ => sample.to_be_bytes().to_vec(),
            });
            assert_eq!(crc32(&bytes.collect::<Vec<_>>()), crc, "{name}: the oracle disagrees");
        }
        // What the file is there for stands in its first line alone.
        let shows = if lines.is_empty() { shows } else { "" };
        writeln!(lines, "{name}.gip\t{}\t{crc:08x}\t{shows}", request.name()).expect("a string");
    }
    lines
}

#[test]
fn the_folder_holds_what_the_specification_describes() {
    let folder = Path::new(FOLDER);
    let vectors = [valid_vectors(), entropy::valid(), invalid_vectors(), entropy::invalid()];
    let vectors = vectors.into_iter().flatten().collect::<Vec<Vector>>();
    let mut index = String::from("file\trendering\tresult\tshows\n");
    for vector in &vectors {
        assert_eq!(vector.name.starts_with('x'), vector.file.is_none(), "{}", vector.name);
        index.push_str(&lines(vector));
    }
    let path = |vector: &Vector| folder.join(format!("{}.gip", vector.name));
    if std::env::var_os("BLESS").is_some() {
        for vector in &vectors {
            fs::write(path(vector), &vector.bytes).expect("writable");
        }
        fs::write(folder.join("index.tsv"), &index).expect("writable");
    }
    for vector in &vectors {
        let stored = fs::read(path(vector)).expect(vector.name);
        assert!(stored == vector.bytes, "{}.gip differs from what the test builds", vector.name);
    }
    let stored = fs::read_to_string(folder.join("index.tsv")).expect("the index");
    for (stored, built) in stored.lines().zip(index.lines()) {
        assert_eq!(stored, built, "index.tsv is out of date");
    }
    assert_eq!(stored.lines().count(), index.lines().count());
    let names = |entry: fs::DirEntry| entry.file_name().into_string().expect("ASCII");
    let mut found: Vec<String> = fs::read_dir(folder)
        .expect("the folder")
        .map(|entry| names(entry.expect("an entry")))
        .collect();
    let mut expected: Vec<String> =
        vectors.iter().map(|vector| format!("{}.gip", vector.name)).collect();
    expected.extend(["README.md".into(), "index.tsv".into()]);
    found.sort_unstable();
    expected.sort_unstable();
    assert_eq!(found, expected);
}
