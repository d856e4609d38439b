//! From planes of sums to samples (spec, sections 9.5 and 9.6).

#[cfg(feature = "std")]
use fearless_simd::{Simd, dispatch, f32x16, i32x16, prelude::*, u8x16, u8x64};

#[cfg(feature = "std")]
use super::simd_kernel::{larger, smaller};
use super::tile::PairPlane;
use super::tile_grid::{PAIR_WIDTH, TILE_HEIGHT};
use crate::color::ColorModel;
use crate::simd::Backend;

/// An integer sample type.
pub(crate) trait Sample: Copy + Send {
    /// The full sample, 255 or 65535.
    const OPAQUE: Self;
    /// The full sample as a number.
    const SCALE: f32;
    /// The sample with this value, which is 0 to that of the full sample.
    fn from_integer(value: i32) -> Self;

    /// The nearest sample: clamps to [0, 1], scales, adds one half and truncates.
    fn from_unit(value: f32) -> Self {
        Self::from_integer((value.clamp(0.0, 1.0) * Self::SCALE + 0.5) as i32)
    }

    /// The pixels of a row of two tiles, from the integer samples of each channel.
    #[cfg(feature = "std")]
    #[inline(always)]
    fn pixels<S: Simd, const CHANNELS: usize>(
        _: S,
        channels: [i32x16<S>; CHANNELS],
    ) -> [[Self; CHANNELS]; PAIR_WIDTH] {
        interleave(channels)
    }
}

impl Sample for u8 {
    const OPAQUE: Self = Self::MAX;
    const SCALE: f32 = 255.0;

    fn from_integer(value: i32) -> Self {
        value as Self
    }

    /// Combines the samples of each pixel in a word, and then moves the bytes of four words with
    /// one instruction. Compilers vectorize a loop over single bytes on few machines.
    #[cfg(feature = "std")]
    #[inline(always)]
    fn pixels<S: Simd, const CHANNELS: usize>(
        simd: S,
        channels: [i32x16<S>; CHANNELS],
    ) -> [[Self; CHANNELS]; PAIR_WIDTH] {
        if CHANNELS < 3 {
            return interleave(channels);
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

/// For four pixels, each of which is a word with its first sample lowest: the byte of each sample.
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

/// The pixels of a row of two tiles, sample by sample.
#[cfg(feature = "std")]
#[inline(always)]
fn interleave<S: Simd, T: Sample, const CHANNELS: usize>(
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

/// For each channel of the output, the plane that it is copied from; `None` for an opaque alpha
/// channel.
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
        // The output has the stored channels. Colour models with fewer channels were refused
        // before.
        (_, output) => &[Some(0), Some(1), Some(2), Some(3)][..output.channels()],
    }
}

/// Where a pair of tiles is written among interleaved samples.
pub(super) struct Destination<'a, T> {
    /// The first column of the tiles in the output.
    pub(super) x: usize,
    /// The output from the first row of the tiles on.
    pub(super) rows: &'a mut [T],
    /// Samples per row.
    pub(super) stride: usize,
}

/// Converts a pair of tiles to interleaved samples.
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
        Backend::Reference(_) => write_rows(destination, |row| pixels(planes, sources, row)),
        #[cfg(feature = "std")]
        Backend::Simd(level) => dispatch!(level, simd => write_rows(
            destination,
            #[inline(always)]
            |row| pixels_simd(simd, planes, sources, row),
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
        // Nearly all tiles: the length of the copies is known to the compiler.
        for (row, samples) in tiles.enumerate() {
            *samples.first_chunk_mut().expect("whole tiles") = pixels(row);
        }
    } else {
        for (row, samples) in tiles.enumerate() {
            samples.copy_from_slice(&pixels(row)[..samples.len()]);
        }
    }
}

/// The pixels of a row of a pair of tiles.
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

/// [`pixels`] with SIMD, with the same bits.
#[cfg(feature = "std")]
#[inline(always)]
fn pixels_simd<S: Simd, T: Sample, const CHANNELS: usize>(
    simd: S,
    planes: &[PairPlane],
    sources: [Option<usize>; CHANNELS],
    row: usize,
) -> [[T; CHANNELS]; PAIR_WIDTH] {
    let mut channels = [i32x16::splat(simd, T::SCALE as i32); CHANNELS];
    for (channel, source) in sources.into_iter().enumerate() {
        if let Some(plane) = source {
            let line = f32x16::load_array_ref(simd, &planes[plane][row]);
            let clamped = smaller(simd, larger(simd, line, 0.0), 1.0);
            channels[channel] = i32x16::truncate_from(clamped * T::SCALE + 0.5);
        }
    }
    T::pixels(simd, channels)
}

/// Copies a pair of tiles, whose first pixel is (x, y), to planes with rows of `width` samples.
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

/// Converts a row of means, channels x width, to interleaved samples.
pub(super) fn write_means<T: Sample>(means: &[f32], sources: &[Option<usize>], out: &mut [T]) {
    let width = out.len() / sources.len();
    for (channel, source) in sources.iter().enumerate() {
        let samples = out.iter_mut().skip(channel).step_by(sources.len());
        match source {
            Some(plane) => samples
                .zip(&means[plane * width..])
                .for_each(|(sample, &mean)| *sample = T::from_unit(mean)),
            None => samples.for_each(|sample| *sample = T::OPAQUE),
        }
    }
}

/// Copies a row of means, channels x width, to row `y` of planes.
pub(super) fn write_mean_planes(
    means: &[f32],
    y: usize,
    sources: &[Option<usize>],
    strips: &mut [&mut [f32]],
    width: usize,
) {
    for (source, strip) in sources.iter().zip(strips) {
        let line = &mut strip[y * width..][..width];
        match source {
            Some(plane) => line.copy_from_slice(&means[plane * width..][..width]),
            None => line.fill(1.0),
        }
    }
}
