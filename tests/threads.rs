//! However many threads there are, the outcome is the same bit for bit.

mod common;

use common::entropy::{Code, Grid};
use common::{File, Header, RGB, Random, bits, decode, decode_valid, of_chunks, without_last_word};
use image_gip::{DecodeError, Decoder, Gaussian, RenderOptions, Threads};

/// Numbers of threads, fewer and more than layers, and than this machine has.
const THREADS: [usize; 4] = [1, 2, 3, 9];
/// Gaussians of the layers: the largest neither first nor last.
const LAYERS: [usize; 5] = [40, 700, 1900, 1, 600];

fn on_threads<T: Send>(threads: usize, work: impl FnOnce() -> T + Send) -> T {
    let pool = rayon::ThreadPoolBuilder::new().num_threads(threads).build().expect("threads");
    pool.install(work)
}

fn sample() -> File {
    let header = Header { color: RGB, width: 200, height: 150, ..Header::default() };
    let grid = Grid::new(header.sides());
    let mut random = Random(21);
    let mut code = |_| {
        let mut within = |most: i32| (random.next() % (2 * most as u64 + 1)) as i32 - most;
        let axes = vec![within(9), within(5), within(3)];
        let [size, ratio, slant] = [within(4), within(2), within(2)];
        let center = grid.units([random.range(0.0, 200.0), random.range(0.0, 150.0)]);
        Code { exponent: 2, axes, size, ratio, slant, center }
    };
    let layers = LAYERS.map(|count| (0..count).map(&mut code).collect()).into();
    File::of_entropy_coded(header, vec![0.5, 0.5, 0.5, 0.5, 0.125, 0.125, 0.125], layers)
}

/// The file with a layer that lacks its last word.
fn damaged(layer: usize) -> Vec<u8> {
    let mut chunks = sample().chunks();
    let damaged = &mut chunks[1 + layer];
    *damaged = without_last_word(damaged);
    of_chunks(&chunks)
}

/// What the decoder of a reader makes of a file: its Gaussians, and how it ends.
fn read(bytes: &[u8]) -> (Vec<Gaussian>, Result<(), DecodeError>) {
    let mut decoder = Decoder::new(bytes).expect("it begins well");
    let result = decoder.read_to_end();
    (decoder.picture().expect("what is left is sound").gaussians().to_vec(), result)
}

#[test]
fn layers_side_by_side_are_those_one_after_the_other() {
    let bytes = sample().bytes();
    let expected = decode_valid(&bytes);
    for threads in THREADS {
        let (gaussians, result) = on_threads(threads, || read(&bytes));
        result.expect("a sound file");
        assert_eq!(bits(&gaussians), bits(expected.gaussians()), "{threads} threads");
    }
}

#[test]
fn a_damaged_layer_keeps_those_before_it() {
    for layer in 0..LAYERS.len() {
        let bytes = damaged(layer);
        let (expected, error) = decode(&bytes);
        let error = error.expect_err("a damaged layer").to_string();
        assert_eq!(expected.gaussians().len(), LAYERS[..layer].iter().sum::<usize>());
        for threads in THREADS {
            let (gaussians, result) = on_threads(threads, || read(&bytes));
            assert_eq!(bits(&gaussians), bits(expected.gaussians()), "{layer}, {threads} threads");
            assert_eq!(result.expect_err("a damaged layer").to_string(), error);
        }
    }
}

#[test]
fn what_was_wrong_first_is_told() {
    let mut bytes = damaged(1);
    bytes.truncate(bytes.len() - 5);
    let (gaussians, result) = on_threads(2, || read(&bytes));
    assert_eq!(gaussians.len(), LAYERS[0]);
    assert!(!result.expect_err("a damaged layer").is_unexpected_end());
}

#[test]
fn a_picture_is_the_same_on_any_number_of_threads() {
    let decoder = decode_valid(&sample().bytes());
    let picture = decoder.picture().expect("it has arrived");
    for (width, height) in [(200, 150), (75, 160)] {
        let options = RenderOptions::new().with_size(width, height);
        let render = |threads| {
            let mut out = vec![f32::NAN; picture.output_len(&options).expect("fits")];
            let options = options.clone().with_threads(threads);
            picture.render_planes(&options, &mut out).expect("a sound request");
            out.into_iter().map(f32::to_bits).collect::<Vec<_>>()
        };
        let expected = render(Threads::One);
        for threads in THREADS {
            assert!(on_threads(threads, || render(Threads::Pool)) == expected, "{threads} threads");
        }
    }
}
