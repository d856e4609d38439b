//! What the fuzz targets share: tight limits, the checks on whatever was decoded, and a generator
//! of files that look valid.

pub mod coder;
#[path = "../../tests/common/entropy.rs"]
#[allow(dead_code, reason = "the tests use more of it")]
mod entropy;
mod entropy_coded;
#[path = "../../tests/common/exp.rs"]
mod exp;
pub mod file;
#[path = "../../tests/common/numbers.rs"]
mod numbers;
#[path = "../../tests/common/rans.rs"]
mod rans;
#[path = "../../tests/common/steps.rs"]
#[allow(dead_code, reason = "the tests use more of it")]
mod steps;
#[path = "../../tests/common/texture.rs"]
#[allow(dead_code, reason = "the tests use more of it")]
mod texture;

use fearless_simd::Level;
use image_gip::{
    ChunkStatistics, ChunkType, DecodeError, Decoder, Gaussian, Limits, Picture, Prefixes, Region,
    RenderOptions, StreamDecoder, Threads,
};
use numbers::{number, read_number};

/// Bounds that leave room for every branch and keep one input to a few milliseconds.
pub fn limits() -> Limits {
    let mut limits = Limits::default();
    limits.max_gaussians = 1 << 12;
    limits.max_memory = 1 << 22;
    limits.max_work = 1 << 20;
    limits
}

/// Largest side of what the targets render.
const MAX_SIDE: u32 = 40;

/// Renders what has arrived with the vector code of this machine and with that of the least of its
/// kind, on one thread and on several: all bits are those of the reference code.
pub fn check_levels(decoder: &StreamDecoder) {
    let Some(picture) = decoder.picture() else { return };
    for options in views(&picture) {
        let one = options.clone().with_threads(Threads::One);
        for level in [Level::new(), Level::baseline()] {
            check_backend(&picture, &one.clone().with_simd_level(level));
        }
        let reference = options.clone().with_reference(true);
        assert_eq!(samples(&picture, &options), samples(&picture, &reference));
    }
}

/// Renders what has arrived in several ways and checks that they agree.
pub fn check(decoder: &StreamDecoder) {
    let Some(picture) = decoder.picture() else { return };
    let header = picture.header();
    assert!(picture.gaussians().len() <= header.gaussians as usize);
    let [small, middle, large] = views(&picture).map(|options| options.with_threads(Threads::One));

    check_backend(&picture, &small);
    let (width, height) = small.output_size(header);
    let part = Region { x: width / 3, y: height / 3, width: width - width / 3, height: 1 };
    check_region(&picture, &small, width, part);

    check_backend(&picture, &middle);
    check_backend(&picture, &large);
}

/// Makes files of the first layers of one from which `decoder` read what it could: they are as long as was said, and
/// a decoder accepts and finds in them what it found in the whole file.
pub fn check_prefixes(bytes: &[u8], decoder: &StreamDecoder) {
    // A header may exceed the decoder's limits.
    let (Ok(prefixes), Some(_)) = (Prefixes::new(bytes), decoder.header()) else {
        assert!(!decoder.is_complete(), "a sound file has no prefixes");
        return;
    };
    let found = decoder.gaussians();
    let last = prefixes.iter().len().saturating_sub(1);
    for (number, prefix) in prefixes.iter().enumerate() {
        // The work would grow with the square of the layers.
        if number > 2 && number < last {
            continue;
        }
        let file = prefixes.file(prefix);
        assert_eq!(file.len(), prefix.bytes, "the length that was said");
        let Some(expected) = found.get(..prefix.gaussians as usize) else { break };
        let mut first = StreamDecoder::new().with_limits(limits());
        let fed = first.feed(&file).expect("a part of what was sound");
        assert_eq!(fed, file.len(), "a file without its end");
        assert!(first.is_complete() && bits(first.gaussians()).eq(bits(expected)));
    }
}

/// All values of Gaussians, by their bits.
fn bits(gaussians: &[Gaussian]) -> impl Iterator<Item = u32> + '_ {
    let values =
        |gaussian: &Gaussian| [&gaussian.center[..], &gaussian.cholesky, &gaussian.color].concat();
    gaussians.iter().flat_map(values).map(f32::to_bits)
}

/// Decodes the middle of a file from the layers that show in it: the same as from all of them, where
/// the file does not say which these are.
pub fn decode_region(bytes: &[u8]) {
    let Ok(mut decoder) = Decoder::new_with_limits(bytes, limits()) else { return };
    let Ok(picture) = decoder.picture() else { return };
    let [_, middle, _] = views(&picture).map(|options| options.with_threads(Threads::One));
    decoder.set_options(middle.clone());
    let Ok(length) = decoder.output_len() else { return };
    let mut samples = vec![0; length];
    let decoded = decoder.decode_into(&mut samples);
    let says_where = |chunk: &ChunkStatistics| chunk.kind == ChunkType::BNDS;
    if decoded.is_ok() && !decoder.stream().chunks().iter().any(says_where) {
        let mut expected = vec![0; length];
        let picture = decoder.picture().expect("every layer was decoded");
        picture.render_u8(&middle, &mut expected).expect("it was rendered before");
        assert_eq!(samples, expected);
    }
}

/// All of a picture, small, its middle at its stored size, however large that is, and the same enlarged.
fn views(picture: &Picture<'_>) -> [RenderOptions; 3] {
    let header = picture.header();
    let (width, height) = (header.width.min(MAX_SIDE), header.height.min(MAX_SIDE));
    let middle = |size: (u32, u32)| {
        let (x, y) = ((size.0 - width) / 2, (size.1 - height) / 2);
        let region = Region { x, y, width, height };
        RenderOptions::new().with_size(size.0, size.1).with_region(region)
    };
    let stored = (header.width, header.height);
    let large = (stored.0 + stored.0 / 2 + 1, stored.1 + stored.1 / 3);
    [RenderOptions::new().with_size(width, height), middle(stored), middle(large)]
}

/// The fast code gives the bits of the reference code, or refuses just as it does.
fn check_backend(picture: &Picture<'_>, options: &RenderOptions) {
    let fast = planes(picture, options);
    let reference = planes(picture, &options.clone().with_reference(true));
    match (&fast, &reference) {
        (Some(fast), Some(reference)) => {
            let differs = fast.iter().zip(reference).position(|(a, b)| a.to_bits() != b.to_bits());
            assert_eq!(differs, None, "a sample of the fast code differs: {options:?}");
            assert!(fast.iter().all(|sample| sample.is_finite()), "a sample is not finite");
        }
        _ => assert_eq!(fast, reference, "only one of fast and reference code refused"),
    }
}

/// A region equals that part of the whole.
fn check_region(picture: &Picture<'_>, options: &RenderOptions, width: u32, part: Region) {
    let options = options.clone().with_threads(Threads::One);
    let (Some(whole), Some(region)) =
        (samples(picture, &options), samples(picture, &options.clone().with_region(part)))
    else {
        return;
    };
    let channels = picture.header().color.channels();
    let first = (part.y * width + part.x) as usize * channels;
    assert_eq!(whole[first..][..region.len()], region, "the region differs from the whole");
}

/// Float planes; `None` when a limit would be exceeded, the only reason to refuse there is.
fn planes(picture: &Picture<'_>, options: &RenderOptions) -> Option<Vec<f32>> {
    let mut out = vec![0.0; picture.output_len(&options).expect("small")];
    granted(picture.render_planes(options, &mut out)).then_some(out)
}

/// Interleaved samples, as [`planes`].
fn samples(picture: &Picture<'_>, options: &RenderOptions) -> Option<Vec<u16>> {
    let mut out = vec![0; picture.output_len(&options).expect("small")];
    granted(picture.render_u16(options, &mut out)).then_some(out)
}

fn granted(result: Result<(), DecodeError>) -> bool {
    match result {
        Ok(()) => true,
        Err(DecodeError::Limit { .. }) => false,
        Err(error) => panic!("a fitting request was refused: {error}"),
    }
}
