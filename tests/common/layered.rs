//! An entropy-coded file of many layers that says where each of them shows, and what becomes of a
//! decoder that meets damaged ones.

use std::sync::OnceLock;

use image_gip::Region;

use super::entropy::{Code, Grid};
use super::oracle::{grid, parts};
use super::{File, Header, RGB, Random, of_chunks, payload, without_last_word};

pub(crate) const SIZE: (u32, u32) = (300, 200);
pub(crate) const LAYERS: usize = 24;
pub(crate) const IN_A_LAYER: usize = 20;
/// Chunks before the first layer: header, bounds.
pub(crate) const BEFORE: usize = 2;

/// Each layer has a square of 50 x 50 pixels to itself, and shows around it.
fn sample() -> File {
    let header = Header { color: RGB, width: SIZE.0, height: SIZE.1, ..Header::default() };
    let grid = Grid::new(header.sides());
    let mut random = Random(5);
    let layer = |number: usize| {
        let [x, y] = [(number % 6) as f32 * 50.0, (number / 6) as f32 * 50.0];
        let mut code = |_| {
            let mut within = |most: i32| (random.next() % (2 * most as u64 + 1)) as i32 - most;
            let axes = vec![within(20), within(9), within(9)];
            let [size, ratio, slant] = [within(6), within(3), within(3)];
            let center = grid.units([x + random.range(0.0, 50.0), y + random.range(0.0, 50.0)]);
            Code { exponent: 2, axes, size, ratio, slant, center }
        };
        (0..IN_A_LAYER).map(&mut code).collect()
    };
    let layers = (0..LAYERS).map(layer).collect();
    File::of_entropy_coded(header, vec![0.5, 0.5, 0.5, 0.5, 0.125, 0.125, 0.125], layers)
}

/// The chunks of the file.
pub(crate) fn chunks() -> Vec<Vec<u8>> {
    static CHUNKS: OnceLock<Vec<Vec<u8>>> = OnceLock::new();
    let chunks = CHUNKS.get_or_init(|| {
        let file = sample();
        let bounds = file.bounds();
        file.with(b"bNDS", &bounds).chunks()
    });
    chunks.clone()
}

/// The file with layers that lack their last word: they are framed well, and malformed inside.
pub(crate) fn damaged(layers: &[usize]) -> Vec<u8> {
    let mut chunks = chunks();
    for layer in layers {
        let damaged = &mut chunks[BEFORE + layer];
        *damaged = without_last_word(damaged);
    }
    of_chunks(&chunks)
}

/// The layers that a decoder decodes: those that it refuses when they are damaged.
#[track_caller]
pub(crate) fn decoded(mut decodes: impl FnMut(&[u8]) -> bool) -> Vec<usize> {
    assert!(decodes(&of_chunks(&chunks())), "a sound file");
    (0..LAYERS).filter(|&layer| !decodes(&damaged(&[layer]))).collect()
}

/// The layers that may show in a region of an output of this size (section 5.6): eight pixels of the
/// grid beside their bounds, and further where the grid is coarse.
pub(crate) fn showing(size: (u32, u32), region: Region) -> Vec<usize> {
    let entries = payload(&chunks()[BEFORE - 1]).to_vec();
    let axis = |side, stored, start, length| {
        let of_grid = grid(stored, side);
        let (first, _) = parts(start, of_grid, side)[0];
        let &(last, _) = parts(start + length - 1, of_grid, side).last().expect("a pixel");
        (of_grid, stored, first, last + 1 - first)
    };
    let axes = [
        axis(size.0, SIZE.0, region.x, region.width),
        axis(size.1, SIZE.1, region.y, region.height),
    ];
    let shows = |layer: &usize| {
        axes.into_iter().enumerate().all(|(axis, (side, stored, start, length))| {
            let [first, last] = [0, 2].map(|end| f64::from(entries[4 * layer + axis + end]));
            let (scale, cell) = (f64::from(side) / f64::from(stored), f64::from(side) / 256.0);
            let widened = if scale < 1.0 { (1.0 - scale * scale) / 6.0 } else { 0.0 };
            let margin = 8.0 + (4.0 * widened).sqrt();
            first * cell - margin < f64::from(start + length)
                && (last + 1.0) * cell + margin > f64::from(start)
        })
    };
    (0..LAYERS).filter(shows).collect()
}

/// Sizes of the output and regions of it, with the number of layers that show there.
pub(crate) fn regions() -> [((u32, u32), Region, usize); 8] {
    let region = |x, y, width, height| Region { x, y, width, height };
    [
        // A corner, the opposite one, the middle, a row, a close-up.
        (SIZE, region(0, 0, 20, 20), 1),
        (SIZE, region(280, 180, 20, 20), 1),
        (SIZE, region(140, 90, 20, 20), 4),
        (SIZE, region(0, 120, 300, 1), 10),
        ((3000, 2000), region(1200, 900, 100, 100), 4),
        // Of a small picture, and of one that is large along one axis and small along the other.
        ((75, 50), region(60, 40, 5, 5), 3),
        ((1500, 100), region(1400, 0, 100, 100), 4),
        (SIZE, region(0, 0, 300, 200), LAYERS),
    ]
}
