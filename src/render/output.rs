//! Float planes to samples (spec, sections 9.5 and 9.6).

#[cfg(feature = "std")]
use fearless_simd::{Simd, dispatch, f32x16, i32x16, prelude::*, u8x16, u8x64};

use super::tile::PairPlane;
use super::tile_grid::{PAIR_WIDTH, TILE_HEIGHT};
use crate::color::ColorModel;
use crate::simd::Backend;

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

    /// The pixels of a row of two tiles, from the numbers that the samples of each channel can be.
    #[cfg(feature = "std")]
    #[inline(always)]
    fn pixels<S: Simd, const CHANNELS: usize>(
        _: S,
        channels: [i32x16<S>; CHANNELS],
    ) -> [[Self; CHANNELS]; PAIR_WIDTH] {
        one_by_one(channels)
    }
}

impl Sample for u8 {
    const OPAQUE: Self = Self::MAX;
    const SCALE: f32 = 255.0;

    fn from_integer(value: i32) -> Self {
        value as Self
    }

    /// A word for each pixel: bytes that are put in place one by one become vector code on few
    /// machines.
    #[cfg(feature = "std")]
    #[inline(always)]
    fn pixels<S: Simd, const CHANNELS: usize>(
        simd: S,
        channels: [i32x16<S>; CHANNELS],
    ) -> [[Self; CHANNELS]; PAIR_WIDTH] {
        if CHANNELS < 3 {
            return one_by_one(channels);
        }
        let mut words = channels[0];
        for (channel, samples) in channels.into_iter().enumerate().skip(1) {
            words |= samples << (8 * channel as u32);
        }
        let order = u8x64::block_splat(u8x16::load_array(simd, word_order(CHANNELS)));
        let bytes = words.bitcast::<u8x64<S>>().swizzle_dyn_within_blocks(order).to_array();
        let mut pixels = [[0; CHANNELS]; PAIR_WIDTH];
        let blocks = pixels.as_flattened_mut().chunks_exact_mut(4 * CHANNELS);
        for (samples, bytes) in blocks.zip(bytes.as_chunks::<16>().0) {
            samples.copy_from_slice(&bytes[..4 * CHANNELS]);
        }
        pixels
    }
}

/// Of four words, each of a pixel with its first channel lowest: the bytes in the order of samples.
#[cfg(feature = "std")]
const fn word_order(channels: usize) -> [u8; 16] {
    let mut order = [0; 16];
    let mut place = 0;
    while place < 4 * channels {
        let byte = place % channels;
        let byte = if cfg!(target_endian = "little") { byte } else { 3 - byte };
        order[place] = (place / channels * 4 + byte) as u8;
        place += 1;
    }
    order
}

#[cfg(feature = "std")]
#[inline(always)]
fn one_by_one<S: Simd, T: Sample, const CHANNELS: usize>(
    channels: [i32x16<S>; CHANNELS],
) -> [[T; CHANNELS]; PAIR_WIDTH] {
    let mut pixels = [[T::OPAQUE; CHANNELS]; PAIR_WIDTH];
    for (channel, samples) in channels.into_iter().enumerate() {
        for (pixel, sample) in pixels.iter_mut().zip(samples.to_array()) {
            pixel[channel] = T::from_integer(sample);
        }
    }
    pixels
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

/// Where two tiles go among interleaved samples.
pub(super) struct Destination<'a, T> {
    /// Their first column.
    pub(super) x: usize,
    /// From their first row on.
    pub(super) rows: &'a mut [T],
    /// Samples per row.
    pub(super) stride: usize,
}

/// Copies two tiles to interleaved samples.
pub(super) fn write_interleaved<T: Sample>(
    backend: Backend,
    planes: &[PairPlane],
    sources: &[Option<usize>],
    destination: &mut Destination<'_, T>,
) {
    match *sources {
        [a] => write_channels(backend, planes, [a], destination),
        [a, b] => write_channels(backend, planes, [a, b], destination),
        [a, b, c] => write_channels(backend, planes, [a, b, c], destination),
        [a, b, c, d] => write_channels(backend, planes, [a, b, c, d], destination),
        _ => unreachable!("a picture has one to four channels"),
    }
}

fn write_channels<T: Sample, const CHANNELS: usize>(
    backend: Backend,
    planes: &[PairPlane],
    sources: [Option<usize>; CHANNELS],
    destination: &mut Destination<'_, T>,
) {
    match backend {
        Backend::Reference => write_rows(destination, |row| pixels(planes, sources, row)),
        #[cfg(feature = "std")]
        Backend::Simd(level) => dispatch!(level, simd => write_rows(
            destination,
            #[inline(always)]
            |row| pixels_at_once(simd, planes, sources, row),
        )),
    }
}

#[inline(always)]
fn write_rows<T: Sample, const CHANNELS: usize>(
    Destination { x, rows, stride }: &mut Destination<'_, T>,
    pixels: impl Fn(usize) -> [[T; CHANNELS]; PAIR_WIDTH],
) {
    let (x, stride) = (*x, *stride);
    let rows = rows.chunks_mut(stride).take(TILE_HEIGHT);
    let tiles = rows.map(|samples| samples[x * CHANNELS..].as_chunks_mut().0);
    if stride / CHANNELS - x >= PAIR_WIDTH {
        // Nearly all: copies of known length.
        for (row, samples) in tiles.enumerate() {
            *samples.first_chunk_mut().expect("whole tiles") = pixels(row);
        }
    } else {
        for (row, samples) in tiles.enumerate() {
            samples.copy_from_slice(&pixels(row)[..samples.len()]);
        }
    }
}

/// The pixels of a row of two tiles.
fn pixels<T: Sample, const CHANNELS: usize>(
    planes: &[PairPlane],
    sources: [Option<usize>; CHANNELS],
    row: usize,
) -> [[T; CHANNELS]; PAIR_WIDTH] {
    let sample = |source: Option<usize>, column: usize| {
        source.map_or(T::OPAQUE, |plane| T::from_unit(planes[plane][row][column]))
    };
    core::array::from_fn(|column| sources.map(|source| sample(source, column)))
}

/// [`pixels`], all at once and bit for bit.
#[cfg(feature = "std")]
#[inline(always)]
fn pixels_at_once<S: Simd, T: Sample, const CHANNELS: usize>(
    simd: S,
    planes: &[PairPlane],
    sources: [Option<usize>; CHANNELS],
    row: usize,
) -> [[T; CHANNELS]; PAIR_WIDTH] {
    let mut channels = [i32x16::splat(simd, T::SCALE as i32); CHANNELS];
    for (channel, source) in sources.into_iter().enumerate() {
        if let Some(plane) = source {
            let line = f32x16::load_array_ref(simd, &planes[plane][row]);
            let scaled = line.max(0.0).min(1.0) * T::SCALE + 0.5;
            channels[channel] = i32x16::truncate_from(scaled);
        }
    }
    T::pixels(simd, channels)
}

/// Copies two tiles to planes; (x, y) is their first pixel, `width` the length of a row.
pub(super) fn write_planes(
    planes: &[PairPlane],
    (x, y): (usize, usize),
    sources: &[Option<usize>],
    strips: &mut [&mut [f32]],
    width: usize,
) {
    for (source, strip) in sources.iter().zip(strips) {
        for (row, line) in strip[y * width..].chunks_mut(width).take(TILE_HEIGHT).enumerate() {
            let end = width.min(x + PAIR_WIDTH);
            let line = &mut line[x..end];
            match source {
                Some(plane) => line.copy_from_slice(&planes[*plane][row][..end - x]),
                None => line.fill(1.0),
            }
        }
    }
}
