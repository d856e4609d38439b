//! Random files, and the crate's renderings of them against the oracle's.

use super::oracle::{self, Request};
use super::{CHOLESKY, COVARIANCE, EXPONENTIAL, File, Header, QUARTIC, Random, decode_valid};
use image_gip::{Region, RenderOptions, Threads};

/// A file of floats with these rows of components.
pub(crate) fn scene(
    color: u8,
    parameterization: u8,
    kernel: (u8, f32),
    size: (u32, u32),
    rows: &[Vec<f32>],
) -> File {
    let mut base = [0; 4];
    base[..=usize::from(color)].fill(0x7F7F);
    let (width, height) = size;
    let header = Header {
        color,
        form: parameterization,
        kernel: kernel.0,
        cutoff: kernel.1,
        width,
        height,
        base,
        ..Header::default()
    };
    File::of_floats(header, rows)
}

pub(crate) const SMOOTH: (u8, f32) = (QUARTIC, 4.0);
pub(crate) const PAPER: (u8, f32) = (EXPONENTIAL, 11.082_527);
pub(crate) const WIDE: (u8, f32) = (EXPONENTIAL, 64.0);

/// Random Gaussians over a picture and somewhat beyond, in any parameterization.
pub(crate) fn random_rows(
    random: &mut Random,
    count: usize,
    file: (u8, u8),
    size: (u32, u32),
) -> Vec<Vec<f32>> {
    let (color, parameterization) = file;
    let row = |_| {
        let (width, height) = (size.0 as f32, size.1 as f32);
        let mut row = vec![random.range(-0.2, 1.2) * width, random.range(-0.2, 1.2) * height];
        let (s1, s2) = (random.decades(0.2, 30.0), random.decades(0.2, 30.0));
        match parameterization {
            // Correlated by up to 0.95.
            COVARIANCE => row.extend([s1 * s1, s1 * s2 * random.range(-0.95, 0.95), s2 * s2]),
            CHOLESKY => row.extend([s1, random.range(-2.0, 2.0) * s2, s2]),
            _ => row.extend([s1, s2, random.range(-4.0, 4.0)]),
        }
        row.extend((0..=color).map(|_| random.range(-0.5, 0.5)));
        row
    };
    (0..count).map(row).collect()
}

/// The planes that the crate renders, by the given code path.
pub(crate) fn planes(
    file: &File,
    request: &Request,
    reference: bool,
    threads: Threads,
) -> Vec<u32> {
    let decoder = decode_valid(&file.bytes());
    let picture = decoder.picture().expect("the header has arrived");
    let options = options(request).with_reference(reference).with_threads(threads);
    let mut out = vec![f32::NAN; picture.output_len(&options).expect("fits")];
    picture.render_planes(&options, &mut out).expect("a sound request");
    out.into_iter().map(f32::to_bits).collect()
}

fn options(request: &Request) -> RenderOptions {
    let (x, y, width, height) = request.region;
    let options = RenderOptions::new()
        .with_size(request.size.0, request.size.1)
        .with_region(Region { x, y, width, height })
        .with_texture(request.texture);
    match u32::try_from(request.prefix) {
        Ok(count) => options.with_prefix(count),
        Err(_) => options,
    }
}

/// The crate against the oracle: all code paths, planes and samples, bit for bit.
#[track_caller]
pub(crate) fn assert_matches_oracle(file: &File, request: &Request) {
    let expected = oracle::render(file, request);
    let bits: Vec<u32> = expected.concat().into_iter().map(f32::to_bits).collect();
    for (reference, threads) in
        [(true, Threads::One), (false, Threads::One), (false, Threads::Pool)]
    {
        let found = planes(file, request, reference, threads);
        let wrong = found.iter().zip(&bits).position(|(found, expected)| found != expected);
        assert_eq!(wrong, None, "reference {reference}, {threads:?}, {request:?}");
    }
    let decoder = decode_valid(&file.bytes());
    let picture = decoder.picture().expect("the header has arrived");
    let options = options(request);
    let mut eight = vec![0; bits.len()];
    picture.render_u8(&options, &mut eight).expect("a sound request");
    assert!(eight.into_iter().map(u16::from).eq(oracle::samples(&expected, 8)), "8 bits");
    let mut sixteen = vec![0; bits.len()];
    picture.render_u16(&options, &mut sixteen).expect("a sound request");
    assert_eq!(sixteen, oracle::samples(&expected, 16), "16 bits");
}
