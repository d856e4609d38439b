//! Rendering against an oracle that was written from the specification: every Gaussian at every
//! pixel, in `f32` bit for bit and in `f64` within a bound.

mod common;

use common::oracle::{self, Request};
use common::scenes::{PAPER, SMOOTH, WIDE, assert_matches_oracle, planes, random_rows, scene};
use common::{
    CHOLESKY, COVARIANCE, EXPONENTIAL, Entry, File, GRAY, GRAY_ALPHA, Header, RGB, RGBA,
    ROTATION_SCALE, Random, cases, decode_valid,
};
use image_gip::{ColorModel, DecodeError, Region, RenderOptions, RequestError, Threads};
use proptest::prelude::*;

#[test]
fn random_scenes_match_the_oracle_bit_for_bit() {
    let mut random = Random(1);
    for color in [GRAY, GRAY_ALPHA, RGB, RGBA] {
        for parameterization in [COVARIANCE, CHOLESKY, ROTATION_SCALE] {
            for kernel in [SMOOTH, PAPER, WIDE, (EXPONENTIAL, 0.5)] {
                let size = (37, 21);
                let rows = random_rows(&mut random, 40, (color, parameterization), size);
                let file = scene(color, parameterization, kernel, size, &rows);
                for (width, height) in [size, (80, 50), (11, 6), (90, 5), (1, 1)] {
                    assert_matches_oracle(&file, &Request::at(width, height));
                }
            }
        }
    }
}

/// Rows of Cholesky components for the hard shapes that a file may hold.
fn hard_rows() -> Vec<(&'static str, Vec<Vec<f32>>)> {
    let needle = |angle: f32, long: f32, thin: f32| {
        // The factor of R diag(long, thin)^2 R^T, in f64 so that thin ones stay what they are.
        let (sin, cos) = f64::from(angle).sin_cos();
        let (long, thin) = (f64::from(long), f64::from(thin));
        let l11 = (cos * long).hypot(sin * thin);
        let l21 = cos * sin * (long * long - thin * thin) / l11;
        vec![48.3, 31.9, l11 as f32, l21 as f32, (long * thin / l11) as f32, 0.9]
    };
    let angles = |long: f32, thin: f32| -> Vec<_> {
        (0..360).map(|degree| needle((degree as f32).to_radians(), long, thin)).collect()
    };
    let limit = 2_f32.powi(24);
    let least = 2_f32.powi(-12);
    vec![
        ("needles", angles(60.0, 0.3)),
        ("long needles", angles(1e5, 0.01)),
        ("the most extreme needles", angles(limit * 0.99, least * 1.01)),
        (
            "dots",
            (0..200)
                .map(|i| {
                    let at = i as f32 * 0.37;
                    vec![at, at * 0.7, 0.01, 0.0, 0.01, 1.0]
                })
                .collect(),
        ),
        (
            "dots on pixel centres",
            (0..60).map(|i| vec![i as f32 + 0.5, i as f32 + 0.5, least, 0.0, least, 1.0]).collect(),
        ),
        (
            "wider than the picture",
            (0..9)
                .map(|i| {
                    vec![
                        10.0 * i as f32,
                        64.0,
                        9600.0,
                        3000.0,
                        9600.0,
                        if i % 2 == 0 { 0.3 } else { -0.3 },
                    ]
                })
                .collect(),
        ),
        ("as wide as can be", vec![vec![0.0, 0.0, limit, limit, limit, 0.1]]),
        (
            "sheared to the bounds",
            vec![
                vec![3.0, 3.0, least, limit, least, 0.5],
                vec![3.0, 3.0, limit, -limit, least, 0.5],
                vec![3.0, 3.0, least, limit, limit, 0.5],
            ],
        ),
        (
            "far outside",
            vec![
                vec![limit, limit, 1.0, 0.0, 1.0, 1.0],
                vec![-limit, 20.0, limit, 0.0, 1.0, 0.5],
                vec![-1000.0, 2000.0, 500.0, -900.0, 20.0, 0.5],
                vec![1e6, 1e6, 4e5, 4e5, 10.0, 0.5],
                vec![-0.4, 10.0, 0.2, 0.0, 0.2, 0.5],
                vec![96.4, 10.0, 0.2, 0.0, 0.2, 0.5],
            ],
        ),
        (
            "cancelling pairs",
            (0..40)
                .flat_map(|i| {
                    let x = 2.0 * i as f32;
                    [
                        vec![x, 30.0, 9.0, 2.0, 7.0, 100.0],
                        vec![x + 1e-3, 30.0, 9.0, 2.0, 7.0, -100.0],
                    ]
                })
                .collect(),
        ),
        ("thousands of the same", vec![vec![40.2, 30.7, 6.0, 1.0, 5.0, 0.001]; 3000]),
        (
            "colours at the bound",
            vec![
                vec![40.0, 30.0, 5.0, 0.0, 5.0, 65536.0],
                vec![41.0, 30.0, 5.0, 0.0, 5.0, -65536.0],
            ],
        ),
        ("subnormal colours", vec![vec![40.0, 30.0, 5.0, 0.0, 5.0, 1e-44]; 5]),
    ]
}

#[test]
fn hard_shapes_match_the_oracle_bit_for_bit() {
    for (name, rows) in hard_rows() {
        for kernel in [SMOOTH, PAPER] {
            println!("{name}, kernel {kernel:?}");
            let file = scene(GRAY, CHOLESKY, kernel, (96, 64), &rows);
            assert_matches_oracle(&file, &Request::whole(&file));
            assert_matches_oracle(&file, &Request::at(13, 64));
            let close_up = Request {
                size: (1 << 16, 1 << 16),
                region: (31_000, 32_000, 40, 30),
                ..Request::whole(&file)
            };
            assert_matches_oracle(&file, &close_up);
        }
    }
}

#[test]
fn pictures_of_any_size_match_the_oracle() {
    let mut random = Random(2);
    for size in [(1, 1), (1, 300), (300, 1), (15, 9), (16, 8), (17, 7), (8192, 16)] {
        let rows = random_rows(&mut random, 12, (RGB, CHOLESKY), size);
        let file = scene(RGB, CHOLESKY, SMOOTH, size, &rows);
        assert_matches_oracle(&file, &Request::whole(&file));
    }
}

#[test]
fn no_gaussian_leaves_the_base_color() {
    let file = scene(RGBA, CHOLESKY, SMOOTH, (33, 9), &[]);
    let expected = vec![(127.0_f32 / 255.0).to_bits(); 33 * 9 * 4];
    assert_eq!(planes(&file, &Request::whole(&file), false, Threads::Pool), expected);
}

#[test]
fn what_is_out_of_bounds_is_not_drawn() {
    let sound = [20.0, 20.0, 3.0, 0.5, 4.0, 0.7];
    let above = 2_f32.powi(24).next_up();
    let below = 2_f32.powi(-12).next_down();
    let changes = [
        (0, above),
        (0, -above),
        (1, above),
        (2, above),
        (2, below),
        (2, -3.0),
        (2, 0.0),
        (3, above),
        (3, -above),
        (4, above),
        (4, below),
        (4, -3.0),
        (5, 65536.0_f32.next_up()),
    ];
    let mut rows = vec![sound.to_vec()];
    for (component, value) in changes {
        rows.push(sound.to_vec());
        rows.last_mut().expect("just pushed")[component] = value;
    }
    let all = scene(GRAY, CHOLESKY, SMOOTH, (40, 40), &rows);
    let one = scene(GRAY, CHOLESKY, SMOOTH, (40, 40), &rows[..1]);
    let request = Request::whole(&all);
    assert_eq!(
        planes(&all, &request, false, Threads::One),
        planes(&one, &request, false, Threads::One)
    );
    let decoder = decode_valid(&all.bytes());
    let drawable: Vec<_> = decoder.gaussians().iter().map(|g| g.is_drawable()).collect();
    assert_eq!(drawable.iter().position(|drawn| *drawn), Some(0));
    assert!(drawable[1..].iter().all(|drawn| !drawn));
}

/// The model in f64 with the true exponential, and per pixel the error that f32 may make.
fn exact(file: &File) -> (Vec<f64>, Vec<f64>) {
    let header = &file.header;
    let pixels = (header.width * header.height) as usize;
    let mut sums = vec![f64::from(header.base[0]) / 65535.0; pixels];
    let mut bounds = vec![2_f64.powi(-24); pixels];
    for codes in file.layers[0].chunks(6) {
        let values: Vec<f64> = codes.iter().map(|&c| f64::from(f32::from_bits(c))).collect();
        let [x, y, l11, l21, l22, color] = values[..] else { unreachable!("six components") };
        for pixel in 0..pixels {
            let dx = f64::from(pixel as u32 % header.width) + 0.5 - x;
            let dy = f64::from(pixel as u32 / header.width) + 0.5 - y;
            let u = dx / l11;
            let q = u * u + ((dy - l21 * u) / l22).powi(2);
            let weight = match header.kernel {
                EXPONENTIAL if q <= f64::from(header.cutoff) => (q * -0.5).exp(),
                EXPONENTIAL => 0.0,
                _ => (1.0 - q / 4.0).max(0.0).powi(2),
            };
            sums[pixel] += color * weight;
            // q comes from w dx + i22 dy, which cancels in a slanted needle; a sum rounds once
            // per Gaussian.
            let eps = 2_f64.powi(-24);
            let slant = 1.0 + (l21 / l22).abs();
            let spread = if weight > 0.0 || q < 80.0 { 12.0 * slant * color.abs() } else { 0.0 };
            bounds[pixel] += eps * (spread + sums[pixel].abs());
        }
    }
    (sums, bounds)
}

#[test]
fn single_precision_stays_close_to_the_exact_model() {
    let mut random = Random(3);
    // At a cut-off of 64 the step is exp(-32): the side on which a pixel falls does not matter.
    for kernel in [SMOOTH, WIDE] {
        let size = (70, 50);
        let mut scenes = vec![random_rows(&mut random, 300, (GRAY, CHOLESKY), size)];
        scenes.extend(hard_rows().into_iter().map(|(_, rows)| rows));
        for rows in scenes {
            let file = scene(GRAY, CHOLESKY, kernel, size, &rows);
            let (exact, bounds) = exact(&file);
            let found = planes(&file, &Request::whole(&file), false, Threads::Pool);
            for ((found, exact), bound) in found.into_iter().zip(exact).zip(bounds) {
                let error = (f64::from(f32::from_bits(found)) - exact).abs();
                assert!(error <= bound, "an error of {error:e}, allowed {bound:e}");
            }
        }
    }
    // What that means for an ordinary picture: a quarter of a 16-bit step.
    let rows = random_rows(&mut random, 300, (GRAY, CHOLESKY), (70, 50));
    let file = scene(GRAY, CHOLESKY, SMOOTH, (70, 50), &rows);
    let found = planes(&file, &Request::whole(&file), false, Threads::Pool);
    let worst = found
        .iter()
        .zip(exact(&file).0)
        .map(|(&found, exact)| (f64::from(f32::from_bits(found)) - exact).abs());
    assert!(worst.fold(0.0, f64::max) < 4e-6);
}

proptest! {
    #![proptest_config(cases(48))]
    #[test]
    fn a_region_is_that_part_of_the_whole(
        seed in any::<u64>(),
        size in (1_u32..90, 1_u32..70),
        corner in (0.0_f64..1.0, 0.0_f64..1.0),
        extent in (0.0_f64..1.0, 0.0_f64..1.0),
    ) {
        let rows = random_rows(&mut Random(seed), 20, (RGB, ROTATION_SCALE), (40, 30));
        let file = scene(RGB, ROTATION_SCALE, PAPER, (40, 30), &rows);
        let whole = Request::at(size.0, size.1);
        let part = |at: f64, extent: f64, size: u32| {
            let first = (at * f64::from(size)) as u32;
            (first, 1 + (extent * f64::from(size - first - 1)) as u32)
        };
        let (x, width) = part(corner.0, extent.0, size.0);
        let (y, height) = part(corner.1, extent.1, size.1);
        let all = planes(&file, &whole, false, Threads::Pool);
        let found = planes(&file, &Request { region: (x, y, width, height), ..whole }, false, Threads::Pool);
        let row = |plane: u32, row: u32| {
            let start = ((plane * size.1 + y + row) * size.0 + x) as usize;
            &all[start..start + width as usize]
        };
        let rows = (0..3).flat_map(|plane| (0..height).map(move |y| (plane, y)));
        let expected: Vec<u32> = rows.flat_map(|(plane, y)| row(plane, y).to_vec()).collect();
        prop_assert_eq!(found, expected);
    }

    #[test]
    fn a_prefix_is_the_file_with_fewer_gaussians(seed in any::<u64>(), count in 0_usize..25) {
        let rows = random_rows(&mut Random(seed), 20, (GRAY_ALPHA, COVARIANCE), (40, 30));
        let all = scene(GRAY_ALPHA, COVARIANCE, SMOOTH, (40, 30), &rows);
        let few = scene(GRAY_ALPHA, COVARIANCE, SMOOTH, (40, 30), &rows[..count.min(rows.len())]);
        let prefix = Request { prefix: count, ..Request::whole(&all) };
        prop_assert_eq!(
            planes(&all, &prefix, false, Threads::Pool),
            planes(&few, &Request::whole(&few), false, Threads::Pool)
        );
    }

    #[test]
    fn packed_attributes_of_any_depth_match_the_oracle(
        seed in any::<u64>(),
        bits in prop::collection::vec(1_u8..=16, 8),
        logs in any::<[bool; 2]>(),
    ) {
        let mut random = Random(seed);
        let ranges = [
            (0.0, 24.0), (0.0, 18.0), (0.3, 6.0), (-3.0, 3.0), (0.3, 6.0),
            (-0.5, 0.5), (-0.5, 0.5), (-0.5, 0.5),
        ];
        let entry = |((low, high), &bits): ((f32, f32), &u8)| {
            Entry::linear(bits, (high - low) / ((1 << bits) - 1) as f32, low)
        };
        let mut entries: Vec<Entry> = ranges.into_iter().zip(&bits).map(entry).collect();
        for (component, log) in [2, 4].into_iter().zip(logs) {
            if log {
                let steps = 3.0 / ((1 << bits[component]) - 1) as f32;
                entries[component] = Entry::log(bits[component], steps, -1.2);
            }
        }
        let codes = |_| {
            let code = |entry: &Entry| (random.next() & ((1 << entry.bits) - 1)) as u32;
            entries.iter().map(code).collect::<Vec<u32>>()
        };
        let layer: Vec<u32> = (0..15).flat_map(codes).collect();
        let header = Header { color: RGB, width: 24, height: 18, ..Header::default() };
        let file = File::new(header, entries, vec![layer]);
        assert_matches_oracle(&file, &Request::whole(&file));
    }
}

#[test]
fn a_smaller_output_is_close_to_the_area_average() {
    let mut random = Random(4);
    let size = (96, 64);
    let mut rows = random_rows(&mut random, 150, (GRAY, CHOLESKY), size);
    // Dots and lines finer than an output pixel: sampled without a filter they would flicker.
    rows.extend((0..60).map(|_| {
        let at = [random.range(0.0, 96.0), random.range(0.0, 64.0)];
        vec![at[0], at[1], 0.5, random.range(-3.0, 3.0), 0.5, random.range(-0.5, 0.5)]
    }));
    let file = scene(GRAY, CHOLESKY, SMOOTH, size, &rows);
    let floats = |request: &Request| -> Vec<f32> {
        planes(&file, request, false, Threads::Pool).into_iter().map(f32::from_bits).collect()
    };
    let mut large = floats(&Request::whole(&file));
    large.iter_mut().for_each(|value| *value = value.clamp(0.0, 1.0));
    for factor in [2_u32, 4, 8] {
        let (width, height) = (size.0 / factor, size.1 / factor);
        let small = floats(&Request::at(width, height));
        let mut squares = [0.0, 0.0];
        for (pixel, found) in small.iter().enumerate() {
            let (x, y) = (pixel as u32 % width * factor, pixel as u32 / width * factor);
            let box_sum: f32 = (0..factor * factor)
                .map(|i| large[((y + i / factor) * size.0 + x + i % factor) as usize])
                .sum();
            let average = box_sum / (factor * factor) as f32;
            let point = large[((y + factor / 2) * size.0 + x + factor / 2) as usize];
            squares[0] += f64::from(found - average).powi(2);
            squares[1] += f64::from(point - average).powi(2);
        }
        let [filtered, point] = squares.map(|sum| (sum / small.len() as f64).sqrt());
        println!("1/{factor}: filtered {filtered:.4}, point-sampled {point:.4}");
        assert!(filtered < 0.03, "1/{factor}: RMS {filtered} off the area average");
        assert!(filtered * 2.0 < point, "1/{factor}: {filtered} against {point} unfiltered");
    }
}

#[test]
fn samples_round_to_the_nearest_and_clamp() {
    // A constant picture: one Gaussian so wide that it is flat.
    for value in [-3.0_f32, -1e-9, 0.0, 0.25, 0.5 / 255.0, 0.499 / 255.0, 254.6 / 255.0, 1.0, 9.0] {
        let rows = [vec![8.0, 8.0, 1e7, 0.0, 1e7, value]];
        let header = Header { width: 2, height: 2, ..Header::default() };
        let file = File::of_floats(header, &rows);
        let decoder = decode_valid(&file.bytes());
        let picture = decoder.picture().expect("the header has arrived");
        let (mut eight, mut sixteen) = ([0; 4], [0; 4]);
        picture.render_u8(&RenderOptions::new(), &mut eight).expect("a sound request");
        picture.render_u16(&RenderOptions::new(), &mut sixteen).expect("a sound request");
        let nearest = |full: f64| (f64::from(value).clamp(0.0, 1.0) * full).round();
        assert_eq!(eight.map(f64::from), [nearest(255.0); 4], "{value}");
        assert_eq!(sixteen.map(f64::from), [nearest(65535.0); 4], "{value}");
    }
}

/// What was wrong with a request.
#[track_caller]
fn refused(result: Result<(), DecodeError>) -> RequestError {
    match result.expect_err("refused") {
        DecodeError::Request(error) => error,
        error => panic!("{error}"),
    }
}

#[test]
fn a_color_model_widens_but_never_narrows() {
    use ColorModel::{Gray, GrayAlpha, Rgb, Rgba};
    let models = [Gray, GrayAlpha, Rgb, Rgba];
    for (code, stored) in models.into_iter().enumerate() {
        let rows = random_rows(&mut Random(5), 10, (code as u8, CHOLESKY), (19, 11));
        let file = scene(code as u8, CHOLESKY, SMOOTH, (19, 11), &rows);
        let decoder = decode_valid(&file.bytes());
        let picture = decoder.picture().expect("the header has arrived");
        let own = oracle::samples(&oracle::render(&file, &Request::whole(&file)), 8);
        for output in models {
            let options = RenderOptions::new().with_color(output);
            let mut out = vec![7; 19 * 11 * output.channels()];
            let result = picture.render_u8(&options, &mut out);
            let is_gray = stored.channels() <= 2;
            if stored.has_alpha() && !output.has_alpha() || !is_gray && output.channels() < 3 {
                let expected = RequestError::ColorModel { from: stored, to: output };
                assert_eq!(refused(result), expected);
                assert!(out.iter().all(|&sample| sample == 7), "the buffer was touched");
                continue;
            }
            result.expect("a wider model");
            let colors = output.channels() - usize::from(output.has_alpha());
            for (found, pixel) in out.chunks(output.channels()).zip(own.chunks(stored.channels())) {
                for (channel, &sample) in found[..colors].iter().enumerate() {
                    let source = if is_gray { pixel[0] } else { pixel[channel] };
                    assert_eq!(u16::from(sample), source, "{stored:?} to {output:?}");
                }
                if output.has_alpha() {
                    let alpha = if stored.has_alpha() { pixel[stored.channels() - 1] } else { 255 };
                    assert_eq!(u16::from(found[colors]), alpha, "{stored:?} to {output:?}");
                }
            }
            let mut floats = vec![0.0; out.len()];
            picture.render_planes(&options, &mut floats).expect("a wider model");
            let plane = out.len() / output.channels();
            for (index, &sample) in out.iter().enumerate() {
                let (pixel, channel) = (index / output.channels(), index % output.channels());
                let float = floats[channel * plane + pixel].clamp(0.0, 1.0);
                assert_eq!((float * 255.0 + 0.5) as u8, sample);
            }
        }
    }
}

#[test]
fn requests_that_make_no_sense_are_refused() {
    let file = scene(GRAY, CHOLESKY, SMOOTH, (20, 10), &[]);
    let decoder = decode_valid(&file.bytes());
    let picture = decoder.picture().expect("the header has arrived");
    let region = |x, y, width, height| Region { x, y, width, height };
    let whole = RenderOptions::new;
    let length = |found| RequestError::BufferLength { found, wanted: 200 };
    let outside = |region| RequestError::Region { region, width: 20, height: 10 };
    let sides = |width, height| RequestError::OutputSize { width, height };
    let mut cases = vec![
        (whole(), 199, length(199)),
        (whole(), 201, length(201)),
        (whole(), 0, length(0)),
        (whole().with_size(1 << 31, 1 << 31).with_region(region(0, 0, 1, 1)), 1, {
            sides(1 << 31, 1 << 31)
        }),
    ];
    for (width, height) in [(0, 10), (10, 0), ((1 << 23) + 1, 1), (1, u32::MAX)] {
        cases.push((whole().with_size(width, height), 10, sides(width, height)));
    }
    for region in [
        region(0, 0, 0, 1),
        region(0, 0, 1, 0),
        region(0, 0, 21, 1),
        region(20, 0, 1, 1),
        region(0, 10, 1, 1),
        region(u32::MAX, 0, 2, 1),
        region(1, 0, u32::MAX, 1),
    ] {
        cases.push((whole().with_region(region), 1, outside(region)));
    }
    for (options, length, expected) in cases {
        let mut out = vec![7; length];
        assert_eq!(refused(picture.render_u8(&options, &mut out)), expected, "{options:?}");
        assert!(out.iter().all(|&sample| sample == 7), "{options:?}: the buffer was touched");
    }
    // The largest sides are fine.
    let corner = region((1 << 23) - 5, (1 << 23) - 5, 5, 5);
    let options = whole().with_size(1 << 23, 1 << 23).with_region(corner);
    picture.render_u8(&options, &mut [0; 25]).expect("within bounds");
}
