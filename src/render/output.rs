//! Float planes to samples (spec, sections 9.5 and 9.6).

use super::tile::{Plane, TILE_HEIGHT, TILE_WIDTH};
use crate::color::ColorModel;

/// An integer sample type.
pub(crate) trait Sample: Copy + Send {
    /// A full sample.
    const OPAQUE: Self;
    /// Rounds to the nearest sample: clamp to [0, 1], scale, add one half, drop the fraction.
    fn from_unit(value: f32) -> Self;
}

impl Sample for u8 {
    const OPAQUE: Self = Self::MAX;

    fn from_unit(value: f32) -> Self {
        (value.clamp(0.0, 1.0) * 255.0 + 0.5) as Self
    }
}

impl Sample for u16 {
    const OPAQUE: Self = Self::MAX;

    fn from_unit(value: f32) -> Self {
        (value.clamp(0.0, 1.0) * 65535.0 + 0.5) as Self
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

/// Copies a tile to interleaved samples; `x` is its first column, `stride` the samples per row.
pub(super) fn write_interleaved<T: Sample>(
    planes: &[Plane],
    x: usize,
    sources: &[Option<usize>],
    strip: &mut [T],
    stride: usize,
) {
    let channels = sources.len();
    for (row, samples) in strip.chunks_mut(stride).take(TILE_HEIGHT).enumerate() {
        let end = samples.len().min((x + TILE_WIDTH) * channels);
        let samples = &mut samples[x * channels..end];
        for (channel, source) in sources.iter().enumerate() {
            let line = source.map(|plane| &planes[plane][row]);
            for (column, pixel) in samples.chunks_exact_mut(channels).enumerate() {
                pixel[channel] = line.map_or(T::OPAQUE, |line| T::from_unit(line[column]));
            }
        }
    }
}

/// Copies a tile to planes; `x` is its first column, `width` the length of a row.
pub(super) fn write_planes(
    planes: &[Plane],
    x: usize,
    sources: &[Option<usize>],
    strips: &mut [&mut [f32]],
    width: usize,
) {
    for (source, strip) in sources.iter().zip(strips) {
        for (row, line) in strip.chunks_mut(width).enumerate() {
            let end = width.min(x + TILE_WIDTH);
            let line = &mut line[x..end];
            match source {
                Some(plane) => line.copy_from_slice(&planes[*plane][row][..end - x]),
                None => line.fill(1.0),
            }
        }
    }
}
