//! Float planes to samples (spec, sections 9.5 and 9.6).

#[cfg(feature = "std")]
use fearless_simd::{Simd, dispatch, f32x16, i32x16, prelude::*};

use super::tile::{Backend, Plane, TILE_HEIGHT, TILE_WIDTH};
use crate::color::ColorModel;

/// An integer sample type.
pub(crate) trait Sample: Copy + Send {
    /// A full sample.
    const OPAQUE: Self;
    /// The same as a number.
    const SCALE: f32;
    /// A sample from a number that it can be.
    fn from_integer(value: i32) -> Self;

    /// Rounds to the nearest sample: clamp to [0, 1], scale, add one half, drop the fraction.
    fn from_unit(value: f32) -> Self {
        Self::from_integer((value.clamp(0.0, 1.0) * Self::SCALE + 0.5) as i32)
    }
}

impl Sample for u8 {
    const OPAQUE: Self = Self::MAX;
    const SCALE: f32 = 255.0;

    fn from_integer(value: i32) -> Self {
        value as Self
    }
}

impl Sample for u16 {
    const OPAQUE: Self = Self::MAX;
    const SCALE: f32 = 65535.0;

    fn from_integer(value: i32) -> Self {
        value as Self
    }
}

/// For each output channel the plane it comes from; `None` is opaque alpha.
pub(super) fn sources(stored: ColorModel, output: ColorModel) -> &'static [Option<usize>] {
    use ColorModel::{Gray, GrayAlpha, Rgb, Rgba};
    match (stored, output) {
        (Gray, Gray) => &[Some(0)],
        (Gray, GrayAlpha) => &[Some(0), None],
        (GrayAlpha, GrayAlpha) => &[Some(0), Some(1)],
        (Gray, Rgb) => &[Some(0), Some(0), Some(0)],
        (Gray, Rgba) => &[Some(0), Some(0), Some(0), None],
        (GrayAlpha, Rgba) => &[Some(0), Some(0), Some(0), Some(1)],
        (Rgb, Rgba) => &[Some(0), Some(1), Some(2), None],
        // What is left are the stored models themselves; narrower ones were refused before.
        (_, output) => &[Some(0), Some(1), Some(2), Some(3)][..output.channels()],
    }
}

/// Where a tile goes among interleaved samples.
pub(super) struct Place<'a, T> {
    /// The tile's first column.
    pub(super) x: usize,
    /// From the tile's first row on.
    pub(super) rows: &'a mut [T],
    /// Samples per row.
    pub(super) stride: usize,
}

/// Copies a tile to interleaved samples.
pub(super) fn write_interleaved<T: Sample>(
    backend: Backend,
    planes: &[Plane],
    sources: &[Option<usize>],
    place: Place<'_, T>,
) {
    match *sources {
        [a] => write_channels(backend, planes, [a], place),
        [a, b] => write_channels(backend, planes, [a, b], place),
        [a, b, c] => write_channels(backend, planes, [a, b, c], place),
        [a, b, c, d] => write_channels(backend, planes, [a, b, c, d], place),
        _ => unreachable!("a picture has one to four channels"),
    }
}

fn write_channels<T: Sample, const CHANNELS: usize>(
    backend: Backend,
    planes: &[Plane],
    sources: [Option<usize>; CHANNELS],
    place: Place<'_, T>,
) {
    match backend {
        Backend::Reference => {
            write_rows(planes, sources, place, |line| line.map(T::from_unit));
        }
        #[cfg(feature = "std")]
        Backend::Simd(level) => dispatch!(level, simd => {
            write_rows(planes, sources, place, #[inline(always)] |line| samples(simd, line));
        }),
    }
}

#[inline(always)]
fn write_rows<T: Sample, const CHANNELS: usize>(
    planes: &[Plane],
    sources: [Option<usize>; CHANNELS],
    Place { x, rows, stride }: Place<'_, T>,
    convert: impl Fn(&[f32; TILE_WIDTH]) -> [T; TILE_WIDTH],
) {
    let rows = rows.chunks_mut(stride).take(TILE_HEIGHT);
    let tiles = rows.map(|samples| samples[x * CHANNELS..].as_chunks_mut().0);
    if stride / CHANNELS - x >= TILE_WIDTH {
        // Nearly all: copies of known length.
        for (row, samples) in tiles.enumerate() {
            *samples.first_chunk_mut().expect("a whole tile") =
                interleaved(planes, sources, row, &convert);
        }
    } else {
        for (row, samples) in tiles.enumerate() {
            let pixels = interleaved(planes, sources, row, &convert);
            samples.copy_from_slice(&pixels[..samples.len()]);
        }
    }
}

/// The pixels of a row of a tile.
#[inline(always)]
fn interleaved<T: Sample, const CHANNELS: usize>(
    planes: &[Plane],
    sources: [Option<usize>; CHANNELS],
    row: usize,
    convert: impl Fn(&[f32; TILE_WIDTH]) -> [T; TILE_WIDTH],
) -> [[T; CHANNELS]; TILE_WIDTH] {
    let mut pixels = [[T::OPAQUE; CHANNELS]; TILE_WIDTH];
    for (channel, source) in sources.into_iter().enumerate() {
        if let Some(plane) = source {
            let line = convert(&planes[plane][row]);
            for (pixel, sample) in pixels.iter_mut().zip(line) {
                pixel[channel] = sample;
            }
        }
    }
    pixels
}

/// [`Sample::from_unit`], sixteen at a time and bit for bit.
#[cfg(feature = "std")]
#[inline(always)]
fn samples<S: Simd, T: Sample>(simd: S, line: &[f32; TILE_WIDTH]) -> [T; TILE_WIDTH] {
    let scaled = f32x16::load_array_ref(simd, line).max(0.0).min(1.0) * T::SCALE + 0.5;
    let mut samples = [T::OPAQUE; TILE_WIDTH];
    for (sample, value) in samples.iter_mut().zip(i32x16::truncate_from(scaled).to_array()) {
        *sample = T::from_integer(value);
    }
    samples
}

/// Copies a tile to planes; (x, y) is its first pixel, `width` the length of a row.
pub(super) fn write_planes(
    planes: &[Plane],
    (x, y): (usize, usize),
    sources: &[Option<usize>],
    strips: &mut [&mut [f32]],
    width: usize,
) {
    for (source, strip) in sources.iter().zip(strips) {
        for (row, line) in strip[y * width..].chunks_mut(width).take(TILE_HEIGHT).enumerate() {
            let end = width.min(x + TILE_WIDTH);
            let line = &mut line[x..end];
            match source {
                Some(plane) => line.copy_from_slice(&planes[*plane][row][..end - x]),
                None => line.fill(1.0),
            }
        }
    }
}
