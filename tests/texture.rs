//! Texture against an oracle that was written from the specification, bit for bit, and that it looks like
//! what it is for: noise of the strength that the map says, without a pattern that repeats.

mod common;

use common::entropy::{Code, Grid};
use common::oracle::{self, Request};
use common::scenes::{SMOOTH, assert_matches_oracle, planes, random_rows, scene};
use common::steps::at_most;
use common::synthesis::{Block, Place, blocks_between_nodes, map_sums, place_in_block};
use common::texture::{Texture, axes, map_sides};
use common::{
    CHOLESKY, File, GRAY, GRAY_ALPHA, Header, RGB, RGBA, Random, chunk, decode, of_chunks, offsets,
};
use image_gip::{RenderOptions, StreamDecoder, Threads};

/// The codes of the colour axes of about this much of each sum.
fn rounded_axes(colors: [f32; 3]) -> [i32; 3] {
    axes(colors).map(|axis| axis.round() as i32)
}

/// Random Gaussians with small codes over a map.
fn random_map(random: &mut Random, sides: [u32; 2], step: f32, count: usize) -> Texture {
    let map = map_sides(sides);
    let grid = Grid::new(map);
    let code = |_| {
        let exponent = (random.next() % 6) as u32;
        let mut within = |most: i32| (random.next() % (2 * most as u64 + 1)) as i32 - most;
        let shape = 1 << exponent.saturating_sub(1);
        // Directions are of all kinds: their whole range is narrower than that of strengths.
        let axes = rounded_axes([9, 9, 2].map(|most| within(most) as f32)).to_vec();
        let [size, ratio, slant] = [within(shape), within(shape), within(shape)];
        let center = grid.units(map.map(|side| random.range(0.0, side as f32)));
        Code { exponent, axes, size, ratio, slant, center }
    };
    Texture { step, codes: (0..count).map(code).collect() }
}

/// A picture of a few Gaussians with this texture.
fn textured(color: u8, size: (u32, u32), texture: &Texture) -> File {
    let rows = random_rows(&mut Random(8), 6, (color, CHOLESKY), size);
    let file = scene(color, CHOLESKY, SMOOTH, size, &rows);
    let payload = texture.payload(file.header.sides());
    file.with(b"tXTR", &payload)
}

/// Sizes of the output: as stored, enlarged along one or both axes, and reduced down to where texture is
/// gone.
fn outputs((width, height): (u32, u32)) -> Vec<(u32, u32)> {
    let scaled = |(x, y): (f64, f64)| {
        let side = |side: u32, factor: f64| ((f64::from(side) * factor).round() as u32).max(1);
        (side(width, x), side(height, y))
    };
    let factors = [
        (1.0, 1.0),
        (1.37, 1.0),
        (1.0, 2.6),
        (1.9, 1.3),
        (3.0, 0.5),
        (0.7, 1.6),
        (0.9, 0.9),
        (0.5, 0.5),
        (0.25, 0.25),
        (0.2, 0.2),
        (0.126, 0.126),
        (0.1, 0.1),
        (0.1, 1.2),
    ];
    factors.map(scaled).to_vec()
}

#[test]
fn random_maps_match_the_oracle_bit_for_bit() {
    let mut random = Random(11);
    let colors = [GRAY, GRAY_ALPHA, RGB, RGBA];
    let sizes = [(1, 1), (8, 8), (1, 40), (9, 7), (33, 17), (64, 3), (47, 80), (200, 150)];
    for (size, color) in sizes.into_iter().zip(colors.into_iter().cycle()) {
        let sides = [size.0, size.1];
        let nodes = map_sides(sides).map(|side| side as usize);
        // Strong, of directions between the patterns, and just above what is cut off.
        for step in [1.0, at_most(0.2), at_most(0.02)] {
            let count = (nodes[0] * nodes[1]).min(14);
            let file = textured(color, size, &random_map(&mut random, sides, step, count));
            for (width, height) in outputs(size) {
                assert_matches_oracle(&file, &Request::at(width, height));
            }
        }
    }
}

#[test]
fn every_octave_and_direction_matches_the_oracle() {
    for octave in 0..2 {
        for direction in [0.5, 0.95, 0.05, 0.7, 0.3] {
            let mut sums = [0.0, 0.0, direction];
            sums[octave] = 0.7;
            let size = (37, 45);
            let file = textured(GRAY, size, &Texture::constant([size.0, size.1], sums));
            for (width, height) in [size, (50, 20), (74, 135)] {
                assert_matches_oracle(&file, &Request::at(width, height));
            }
        }
    }
}

#[test]
fn regions_and_prefixes_match_the_oracle() {
    let mut random = Random(12);
    let size = (131, 77);
    let file = textured(RGBA, size, &random_map(&mut random, [131, 77], 1.0, 30));
    for (width, height) in outputs(size).into_iter().chain([(4000, 3001), (1 << 23, 1 << 23)]) {
        for _ in 0..4 {
            let mut part = |side: u32| {
                let start = random.next() as u32 % side;
                (start, 1 + random.next() as u32 % (side - start).min(40))
            };
            let ((x, columns), (y, rows)) = (part(width), part(height));
            let prefix = random.next() as usize % 8;
            let region = (x, y, columns, rows);
            assert_matches_oracle(&file, &Request { region, prefix, ..Request::at(width, height) });
        }
    }
}

#[test]
fn without_texture_the_samples_are_those_of_the_file_without_the_chunk() {
    let mut random = Random(13);
    let size = (60, 44);
    for color in [GRAY, GRAY_ALPHA, RGB, RGBA] {
        let file = textured(color, size, &random_map(&mut random, [60, 44], 1.0, 12));
        let bare = File { extra: Vec::new(), ..file.clone() };
        for (width, height) in outputs(size) {
            let request = Request::at(width, height);
            assert_matches_oracle(&file, &request.without_texture());
            for reference in [false, true] {
                let [with, without, expected] =
                    [(&file, request), (&file, request.without_texture()), (&bare, request)]
                        .map(|(file, request)| planes(file, &request, reference, Threads::One));
                assert_eq!(without, expected, "{width}x{height}");
                let shows = 8.0 * (width as f32 / 60.0).min(height as f32 / 44.0) > 1.0;
                assert_eq!(with != expected, shows, "{width}x{height}");
                // Alpha has none.
                if color % 2 == 1 {
                    let alpha = expected.len() / (usize::from(color) + 1) * usize::from(color);
                    let opaque = with[alpha..] == expected[alpha..];
                    assert!(opaque, "{width}x{height}: texture in alpha");
                }
            }
        }
    }
}

/// Maps that an encoder would not write.
fn extreme_maps(sides: [u32; 2]) -> Vec<(&'static str, Texture)> {
    let map = map_sides(sides);
    let grid = Grid::new(map);
    let at = |x: f32, y: f32, colors: [f32; 3]| Code {
        exponent: 2,
        axes: rounded_axes(colors).to_vec(),
        center: grid.units([x, y]),
        ..Code::default()
    };
    let nodes = || (0..map[1]).flat_map(|y| (0..map[0]).map(move |x| (x, y)));
    let sign = |x: u32, y: u32| if (x + y).is_multiple_of(2) { 1.0 } else { -1.0 };
    let on_nodes = |colors: &dyn Fn(u32, u32) -> [f32; 3]| -> Vec<Code> {
        nodes().map(|(x, y)| at(x as f32 + 0.5, y as f32 + 0.5, colors(x, y))).collect()
    };
    let last = map[0] as f32 - 0.1;
    vec![
        ("as many Gaussians as nodes", {
            let codes = on_nodes(&|x, y| [9.0 * sign(x, y), 5.0, 6.0 * sign(y, 0)]);
            Texture { step: at_most(0.3), codes }
        }),
        ("as many at one point", {
            Texture {
                step: at_most(0.01),
                codes: nodes().map(|_| at(2.2, 2.9, [5.0, 2.0, 1.0])).collect(),
            }
        }),
        ("colours at the bound", {
            let codes = on_nodes(&|x, y| [60.0 * sign(x, y), 20.0, 60.0 * sign(x, 0)]);
            Texture { step: 900.0, codes }
        }),
        (
            "the largest step",
            Texture {
                step: 1024.0,
                codes: vec![
                    at(1.0, 1.0, [1.0, 0.5, 1.0]),
                    at(last, 2.0, [40_000.0, -3.0, -40_000.0]),
                ],
            },
        ),
        (
            "the least step",
            Texture {
                step: 1.0 / 1_048_576.0,
                codes: vec![
                    at(1.0, 1.0, [1.0, 0.5, 1.0]),
                    at(last, 2.0, [50_000.0, 40_000.0, 20_000.0]),
                ],
            },
        ),
        ("all negative", Texture { step: 1.0, codes: on_nodes(&|_, _| [-9.0, -9.0, 3.0]) }),
        (
            "around the map",
            Texture {
                step: 1.0,
                codes: [[-7.5, -7.5], [map[0] as f32 + 7.0, 1.0], [1.0, map[1] as f32 + 7.0]]
                    .map(|[x, y]| Code { size: 9, ..at(x, y, [40.0, 9.0, 20.0]) })
                    .to_vec(),
            },
        ),
        (
            "none that is drawn",
            Texture {
                step: 1.0,
                codes: vec![
                    Code { size: 400, ..at(1.0, 1.0, [9.0, 9.0, 0.0]) },
                    Code { size: -400, ..at(2.0, 1.0, [9.0, 9.0, 0.0]) },
                ],
            },
        ),
        (
            "needles",
            Texture {
                step: 1.0,
                codes: (-6..=6)
                    .map(|slant| Code {
                        size: 5,
                        ratio: 3,
                        slant: 9 * slant,
                        ..at(4.0, 3.0, [30.0, 8.0, 4.0])
                    })
                    .collect(),
            },
        ),
    ]
}

#[test]
fn extreme_maps_match_the_oracle() {
    let size = (58, 41);
    for (name, texture) in extreme_maps([58, 41]) {
        println!("{name}");
        for color in [GRAY, RGBA] {
            let file = textured(color, size, &texture);
            for (width, height) in [size, (80, 41), (58, 60), (30, 21), (13, 9), (6, 4)] {
                assert_matches_oracle(&file, &Request::at(width, height));
            }
            let close_up =
                Request { region: (31_000, 32_000, 40, 30), ..Request::at(1 << 16, 1 << 16) };
            assert_matches_oracle(&file, &close_up);
        }
    }
}

/// T of an octave in f64, from the sums of the map.
fn exact(sums: &[Vec<f32>], sides: [u32; 2], octave: usize, [x, y]: [i64; 2]) -> f64 {
    let mut texture = 0.0;
    if octave == 0 {
        let parents =
            |at: i64| [(at.div_euclid(2), 0.75), ((at - 1).div_euclid(2) + at.rem_euclid(2), 0.25)];
        for (column, of_column) in parents(x) {
            for (row, of_row) in parents(y) {
                texture += of_column * of_row * exact(sums, sides, 1, [column, row]);
            }
        }
    }
    let gain_of_node = |pattern: usize, [column, row]: [i64; 2]| {
        let [width, height] = sides.map(i64::from);
        let node = (row.clamp(0, height - 1) * width + column.clamp(0, width - 1)) as usize;
        let [amplitude, direction] = [octave, 2].map(|m| f64::from(sums[m][node]));
        let d = 4.0 * direction - 2.0;
        let streaks = (d.abs() - 0.375).clamp(0.0, 1.0);
        let part = match pattern {
            0 => (1.0 - streaks * streaks).sqrt() * [1.0, 1.82][octave],
            _ if (d > 0.0) == (pattern == 1) => streaks * [1.23, 1.72][octave],
            _ => 0.0,
        };
        ((amplitude - 1.0 / 128.0) / 2.0).clamp(0.0, 1.0) * part / 1024.0
    };
    let gain = |pattern: usize, [x, y]: [i64; 2]| {
        let n = blocks_between_nodes(octave, pattern);
        let [column, row] = [x, y].map(|at| at.div_euclid(n));
        let [e, f] = place_in_block(pattern).map(f64::from);
        let right = (x.rem_euclid(n) as f64 + e) / n as f64;
        let below = (y.rem_euclid(n) as f64 + f) / n as f64;
        let mut mean = 0.0;
        for (column, of_column) in [(column, 1.0 - right), (column + 1, right)] {
            for (row, of_row) in [(row, 1.0 - below), (row + 1, below)] {
                mean += of_column * of_row * gain_of_node(pattern, [column, row]);
            }
        }
        mean
    };
    for pattern in 0..3 {
        let Place { block, value, next, part } = Place::new(pattern, x, y);
        let part = f64::from(part);
        let weights = if next.is_some() { [1.0 - part, part] } else { [1.0, 0.0] };
        for (block @ [x, y], weight) in [block, next.unwrap_or(block)].into_iter().zip(weights) {
            let signs = [[1, 1, 1], [1, -1, -1], [-1, 1, -1], [-1, -1, 1]][value];
            let numbers = Block::new(octave, pattern, x, y).numbers;
            let number: i32 = signs.iter().zip(numbers).map(|(sign, number)| sign * number).sum();
            texture += weight * gain(pattern, block) * f64::from(number);
        }
    }
    texture
}

#[test]
fn single_precision_stays_close_to_the_exact_texture() {
    let size = (61, 47);
    let sides = [61, 47];
    let map = random_map(&mut Random(16), sides, 1.0, 20);
    let header = Header { width: size.0, height: size.1, ..Header::default() };
    let file = File::of_floats(header, &[]).with(b"tXTR", &map.payload(sides));
    let sums = map_sums(sides, &map.payload(sides));
    let found = planes(&file, &Request::whole(&file), false, Threads::Pool);
    let mut largest: f64 = 0.0;
    for (pixel, found) in (0..).zip(found) {
        let place = [pixel % i64::from(size.0), pixel / i64::from(size.0)];
        let exact = exact(&sums, map_sides(sides), 0, place);
        largest = largest.max(exact.abs());
        let error = (f64::from(f32::from_bits(found)) - exact).abs();
        assert!(error < 2e-6, "{place:?}: an error of {error:e}");
    }
    assert!(largest > 1.0, "hardly any texture: {largest}");
}

#[test]
fn islands_of_texture_match_the_oracle() {
    let mut random = Random(14);
    let size = (730, 66);
    let mut islands = random_map(&mut random, [730, 66], 0.5, 16);
    islands.codes.iter_mut().for_each(|code| code.size = -4 << code.exponent.saturating_sub(1));
    let file = textured(GRAY, size, &islands);
    for (width, height) in [size, (1000, 66), (730, 80), (400, 30)] {
        assert_matches_oracle(&file, &Request::at(width, height));
        let region = (width / 3 + 1, 5, width / 2, height / 2);
        assert_matches_oracle(&file, &Request { region, ..Request::at(width, height) });
    }
}

#[test]
fn texture_that_has_arrived_is_shown() {
    let mut random = Random(15);
    let sides = [40, 30];
    let file = textured(RGB, (40, 30), &random_map(&mut random, sides, 1.0, 9));
    let none = File { layers: Vec::new(), ..file.clone() };
    let nothing = File { extra: Vec::new(), ..none.clone() };
    let [textured, plain] = [&none, &nothing].map(|file| {
        let planes = oracle::render(file, &Request::whole(file));
        oracle::samples(&planes, 8)
    });
    assert_ne!(textured, plain);
    let (bytes, chunks) = (file.bytes(), file.chunks());
    let [start, end] = [1, 2].map(|at| offsets(&chunks)[at]);
    let shown = |bytes: &[u8]| {
        let (decoder, result) = decode(bytes);
        let picture = decoder.picture().expect("a header");
        let mut samples = vec![0; textured.len()];
        picture.render_u8(&RenderOptions::new(), &mut samples).expect("a sound request");
        let samples: Vec<u16> = samples.into_iter().map(u16::from).collect();
        (samples, result.expect_err("it is not whole"))
    };
    // Within and behind tXTR, and within the layer, of which no Gaussian is complete.
    for length in start..end + 20 {
        let (samples, error) = shown(&bytes[..length]);
        assert!(error.is_unexpected_end(), "{length}: {error}");
        let expected = if length < end { &plain } else { &textured };
        assert!(samples == *expected, "{length}");
    }
    // An error behind it takes nothing away.
    for wrong in [chunk(b"tXTR", b"?"), chunk(b"A", b""), chunk(b"L", &[0; 4])] {
        let mut chunks = chunks.clone();
        chunks[2] = wrong;
        let (samples, error) = shown(&of_chunks(&chunks));
        assert!(samples == textured, "{error}");
    }
}

#[test]
fn texture_may_stand_behind_any_layer() {
    let mut random = Random(17);
    let size = (40, 30);
    let rows = random_rows(&mut random, 6, (RGB, CHOLESKY), size);
    let mut file = scene(RGB, CHOLESKY, SMOOTH, size, &rows);
    let (entries, codes) = (file.entries, &file.layers[0]);
    let (first, second) = codes.split_at(2 * entries.len());
    file = File::new(file.header, entries, vec![first.to_vec(), second.to_vec()]);
    let bare = file.chunks();
    file = file.with(b"tXTR", &random_map(&mut random, size.into(), 1.0, 9).payload(size.into()));
    let samples = |request: &Request| oracle::samples(&oracle::render(&file, request), 8);
    let shown = |bytes: &[u8]| {
        let mut decoder = StreamDecoder::new();
        decoder.feed(bytes).expect("it is sound");
        let picture = decoder.picture().expect("a header");
        let mut samples = vec![0; 40 * 30 * 3];
        picture.render_u8(&RenderOptions::new(), &mut samples).expect("a sound request");
        samples.into_iter().map(u16::from).collect::<Vec<_>>()
    };
    let whole = Request::whole(&file);
    for (at, prefix) in [(2, 2), (3, 6)] {
        let mut chunks = bare.clone();
        chunks.insert(at, file.chunks()[1].clone());
        assert!(shown(&of_chunks(&chunks)) == samples(&whole));
        // Until its last byte has arrived, there is none.
        let bytes = of_chunks(&chunks[..=at]);
        let plain = samples(&Request { prefix, ..whole.without_texture() });
        assert!(shown(&bytes[..bytes.len() - 1]) == plain);
        assert!(shown(&bytes) == samples(&Request { prefix, ..whole }));
    }
}

/// The texture of a part of a picture.
fn part(texture: &Texture, (width, height): (u32, u32), region: (u32, u32, u32, u32)) -> Vec<f32> {
    let header = Header { width, height, base: [0x8080, 0, 0, 0], ..Header::default() };
    let file = File::of_floats(header, &[]).with(b"tXTR", &texture.payload(header.sides()));
    let request = Request { region, ..Request::whole(&file) };
    let base = 128.0 / 255.0;
    let planes = planes(&file, &request, false, Threads::Pool);
    planes.into_iter().map(|bits| f32::from_bits(bits) - base).collect()
}

/// The texture of a part of a picture of 24 megapixels that has the same of it everywhere, in rows of `SIDE`.
fn constant(octaves: [f32; 2], direction: f32) -> Vec<f32> {
    const PICTURE: (u32, u32) = (6000, 4000);
    let [m0, m1] = octaves.map(|deviation| 2.0 * deviation + 1.0 / 128.0);
    let texture = Texture::constant(PICTURE.into(), [m0, m1, direction]);
    part(&texture, PICTURE, (4320, 2344, SIDE as u32, SIDE as u32))
}

const SIDE: usize = 1024;
const ISOTROPIC: f32 = 0.5;
const HORIZONTAL: f32 = 0.9;
const VERTICAL: f32 = 0.1;

fn mean(values: impl ExactSizeIterator<Item = f64>) -> f64 {
    let count = values.len() as f64;
    values.sum::<f64>() / count
}

/// The covariance of what is so far apart.
fn covariance(texture: &[f32], (x, y): (usize, usize)) -> f64 {
    let row = |row: usize| &texture[row * SIDE..][..SIDE];
    // A third of the rows tells enough.
    mean((0..(SIDE - y) / 3).map(|at| product(row(3 * at), &row(3 * at + y)[x..])))
}

fn correlation(texture: &[f32], lag: (usize, usize)) -> f64 {
    covariance(texture, lag) / covariance(texture, (0, 0))
}

/// The mean product of values side by side, up to eight of which are left out at the end.
fn product(a: &[f32], b: &[f32]) -> f64 {
    let (a, b) = (a.as_chunks::<8>().0, b.as_chunks::<8>().0);
    let mut sums = [0.0; 8];
    for (a, b) in a.iter().zip(b) {
        for (sum, (a, b)) in sums.iter_mut().zip(a.iter().zip(b)) {
            *sum += a * b;
        }
    }
    f64::from(sums.iter().sum::<f32>()) / (8 * a.len().min(b.len())) as f64
}

#[test]
fn an_octave_has_the_deviation_that_the_map_says() {
    for octave in 0..2 {
        for direction in [ISOTROPIC, HORIZONTAL, VERTICAL, 0.7, 0.3] {
            let wanted = 0.125;
            let mut octaves = [0.0; 2];
            octaves[octave] = wanted as f32;
            let texture = constant(octaves, direction);
            let average = mean(texture.iter().map(|&value| value.into()));
            let squares = texture.iter().map(|&value| f64::from(value).powi(2));
            let deviation = mean(squares).sqrt();
            println!("octave {octave}, {direction}: {average:e}, {deviation}");
            assert!(average.abs() < wanted / 200.0, "octave {octave}, {direction}: mean {average}");
            let error = (deviation / wanted - 1.0).abs();
            assert!(error < 0.02, "octave {octave}, {direction}: deviation {deviation}");
        }
    }
}

/// That points of one block have the sum 0, but for rounding.
#[track_caller]
fn assert_sums_are_0(sums: impl Iterator<Item = f32>) {
    let worst = sums.map(f32::abs).max_by(f32::total_cmp).expect("a sum");
    assert!(worst < 1e-6, "{worst:e}");
}

#[test]
fn isotropic_blocks_have_the_sum_0_wherever_their_strength_changes() {
    let (width, height) = (124, 90);
    let mut random = Random(17);
    let mut islands = random_map(&mut random, [width, height], at_most(0.01), 20);
    // Of octave 0 alone, without direction.
    for code in &mut islands.codes {
        code.size = -4 << code.exponent.saturating_sub(1);
        let strength = random.range(30.0, 90.0);
        code.axes = rounded_axes([strength, -strength, 0.0]).to_vec();
    }
    let texture = part(&islands, (width, height), (0, 0, width, height));
    let strong = |value: &&f32| value.abs() > 0.05;
    let none = |value: &&f32| value.abs() < 0.001;
    assert!(texture.iter().filter(strong).count() > 1000, "hardly any texture");
    assert!(texture.iter().filter(none).count() > 1000, "texture everywhere");
    let rows = texture.chunks_exact(width as usize).collect::<Vec<_>>();
    let of_two =
        |rows: &[&[f32]], x: usize| -> f32 { rows.iter().map(|row| row[x] + row[x + 1]).sum() };
    let sums = rows
        .chunks_exact(2)
        .flat_map(|rows| (0..width as usize).step_by(2).map(move |x| of_two(rows, x)));
    assert_sums_are_0(sums);
}

#[test]
fn streaks_side_by_side_have_the_sum_0() {
    // Below 0, octave 1 is not there at all.
    let octaves = [0.1, -0.1];
    let texture = constant(octaves, HORIZONTAL);
    let rows = texture.chunks_exact(4 * SIDE);
    assert_sums_are_0(
        rows.flat_map(|rows| (0..SIDE).map(|x| (0..4).map(|y| rows[y * SIDE + x]).sum())),
    );
    let texture = constant(octaves, VERTICAL);
    let (sides, _) = texture.as_chunks::<4>();
    assert_sums_are_0(sides.iter().map(|side| side.iter().sum()));
}

#[test]
fn streaks_are_long_in_their_direction() {
    for octave in 0..2 {
        let mut octaves = [0.0; 2];
        octaves[octave] = 0.1;
        let lag = 2 << octave;
        for (direction, along, across) in
            [(HORIZONTAL, (lag, 0), (0, lag)), (VERTICAL, (0, lag), (lag, 0))]
        {
            let texture = constant(octaves, direction);
            let [along, across] = [along, across].map(|lag| correlation(&texture, lag));
            println!("octave {octave}, {direction}: {along}, {across}");
            assert!(along > 0.4 && across < 0.1, "octave {octave}: {along} along, {across} across");
        }
        let texture = constant(octaves, ISOTROPIC);
        let both = [(lag, 0), (0, lag)].map(|lag| correlation(&texture, lag));
        println!("octave {octave}: {both:?}");
        assert!((both[0] - both[1]).abs() < 0.02, "octave {octave}: {both:?}");
    }
}

#[test]
fn texture_does_not_repeat() {
    for direction in [ISOTROPIC, HORIZONTAL, VERTICAL] {
        for octave in 0..2 {
            let mut octaves = [0.0; 2];
            octaves[octave] = 0.1;
            let texture = constant(octaves, direction);
            // Streaks are four points long, and change to the next.
            let lags = (8 << octave..=512).step_by(1 << octave);
            let lags = lags.flat_map(|lag| [(lag, 0), (0, lag), (lag, lag)]);
            let variance = covariance(&texture, (0, 0));
            let found = lags.map(|lag| (covariance(&texture, lag).abs() / variance, lag));
            let worst = found.max_by(|a, b| a.0.total_cmp(&b.0)).expect("a lag");
            println!("octave {octave}, {direction}: {worst:?}");
            assert!(worst.0 < 0.04, "octave {octave}, {direction}: {worst:?}");
        }
    }
}
