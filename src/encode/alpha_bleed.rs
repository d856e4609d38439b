//! Colours for what does not show: alpha bleeding.
//!
//! The colour of a transparent pixel does not show, whatever it is, until the picture is scaled: then the
//! edges of what is visible take it in. And it would cost bits. So every pixel takes the colour of the
//! visible pixels around it, as far as that does not show: its colour times its alpha changes by less than
//! half a sample. Opaque pixels keep theirs, transparent ones are free, and of the colours of nearly
//! transparent ones only what is more than rounding remains.
//!
//! The colours around come from a pyramid of means, weighted by alpha, each level of which fills what the
//! finer one has not: the pull-push method (S. Gortler et al., The Lumigraph, 1996).

use core::ops::Range;

use super::error::Result;
use super::progress::Observer;
use super::source::{Source, SourceSamples};

/// By how much a premultiplied sample may change: rounding must not find it.
const LEAST_VISIBLE: f32 = 0.499;
/// The weights of four cells in a row in the one of the next level that lies in their middle.
const TAPS: [f32; 4] = [0.125, 0.375, 0.375, 0.125];
// Constants: docs/tuning.md, "Not measured".
/// The known share of what a cell is made from with which it is known: that of a cell beside an edge.
const ENOUGH: f32 = 0.125;

/// Samples of either depth.
#[derive(Debug)]
pub(crate) enum Bled {
    Eight(Vec<u8>),
    Sixteen(Vec<u16>),
}

impl Bled {
    /// The samples of a source with other colours where they do not show; `None` if all of them show.
    pub(crate) fn new(source: &Source<'_>, observer: &mut Observer<'_>) -> Result<Option<Self>> {
        if !source.is_premultiplied() {
            return Ok(None);
        }
        let (width, channels) = (source.width() as usize, source.color().channels());
        Ok(match source.samples() {
            SourceSamples::Eight(samples) => {
                bled(samples, width, channels, u8::MAX, observer)?.map(Self::Eight)
            }
            SourceSamples::Sixteen(samples) => {
                bled(samples, width, channels, u16::MAX, observer)?.map(Self::Sixteen)
            }
        })
    }

    /// The source with these samples.
    pub(crate) fn source<'a>(&'a self, source: &Source<'a>) -> Source<'a> {
        source.with_samples(match self {
            Self::Eight(samples) => SourceSamples::Eight(samples),
            Self::Sixteen(samples) => SourceSamples::Sixteen(samples),
        })
    }

    /// Size in bytes, with that of the pyramid that [`Bled::new`] needs.
    pub(crate) fn memory(&self, source: &Source<'_>) -> usize {
        let samples = match self {
            Self::Eight(samples) => size_of_val(&samples[..]),
            Self::Sixteen(samples) => size_of_val(&samples[..]),
        };
        let cells = sizes(source.size()).map(|[width, height]| width * height).sum::<usize>();
        samples + cells * size_of::<Cell>()
    }
}

/// A sample type.
trait Sample: Copy + Send + Sync + PartialEq + Into<f32> {
    /// The nearest sample to a value in its range.
    fn nearest(value: f32) -> Self;
}

impl Sample for u8 {
    fn nearest(value: f32) -> Self {
        (value + 0.5) as Self
    }
}

impl Sample for u16 {
    fn nearest(value: f32) -> Self {
        (value + 0.5) as Self
    }
}

/// The mean colour of a cell of the pyramid, and how much of it is known, from 0 to 1.
type Cell = [f32; 4];

/// One level of the pyramid.
struct Level {
    width: usize,
    height: usize,
    cells: Vec<Cell>,
}

/// The sizes of the levels of the pyramid, each half the one before.
fn sizes(size: [usize; 2]) -> impl Iterator<Item = [usize; 2]> {
    let half = |size: &[usize; 2]| (*size != [1, 1]).then(|| size.map(|side| side.div_ceil(2)));
    core::iter::successors(Some(size.map(|side| side.div_ceil(2))), half)
}

fn bled<T: Sample>(
    samples: &[T],
    width: usize,
    channels: usize,
    full: T,
    observer: &mut Observer<'_>,
) -> Result<Option<Vec<T>>> {
    if samples.iter().skip(channels - 1).step_by(channels).all(|&alpha| alpha == full) {
        return Ok(None);
    }
    let full = full.into();
    let height = samples.len() / (width * channels);
    let colors = channels - 1;
    let mut levels: Vec<Level> = Vec::new();
    for size in sizes([width, height]) {
        let finer = levels.last();
        let level = match finer {
            None => Level::new(size, observer, |x, y| {
                gathered([x, y], [width, height], |x, y| {
                    let pixel = &samples[(y * width + x) * channels..][..channels];
                    let mut cell = [0.0; 4];
                    for (value, &sample) in cell.iter_mut().zip(&pixel[..colors]) {
                        *value = sample.into();
                    }
                    cell[3] = pixel[colors].into() / full;
                    cell
                })
            }),
            Some(finer) => Level::new(size, observer, |x, y| {
                gathered([x, y], [finer.width, finer.height], |x, y| finer.row(y)[x])
            }),
        }?;
        levels.push(level);
    }
    // From the coarsest on, each level fills the one before.
    let mut coarser = levels.pop().expect("a picture has pixels");
    while let Some(mut level) = levels.pop() {
        level.fill(&coarser, observer)?;
        coarser = level;
    }
    let mut samples = samples.to_vec();
    let rows = samples.chunks_exact_mut(width * channels).enumerate();
    observer.map(rows, |(y, samples)| {
        let around = coarser.around_row(y);
        for (x, pixel) in samples.chunks_exact_mut(channels).enumerate() {
            let alpha = pixel[colors].into();
            if alpha == full {
                continue;
            }
            // Infinite where the pixel is transparent.
            let reach = (LEAST_VISIBLE * full / alpha).floor();
            let found = around.color(x);
            for (sample, found) in pixel[..colors].iter_mut().zip(found) {
                let value: f32 = (*sample).into();
                *sample = T::nearest(found.clamp(value - reach, value + reach));
            }
        }
    })?;
    Ok(Some(samples))
}

/// The cell at a column and row, from those around it of the finer level, which has a size.
fn gathered(
    [x, y]: [usize; 2],
    [width, height]: [usize; 2],
    cell: impl Fn(usize, usize) -> Cell,
) -> Cell {
    let (mut sum, mut total) = ([0.0; 3], 0.0);
    for (row, down) in TAPS.into_iter().enumerate() {
        let Some(y) = (2 * y + row).checked_sub(1).filter(|&y| y < height) else { continue };
        for (column, across) in TAPS.into_iter().enumerate() {
            let Some(x) = (2 * x + column).checked_sub(1).filter(|&x| x < width) else { continue };
            let [red, green, blue, known] = cell(x, y);
            let weight = down * across * known;
            for (sum, color) in sum.iter_mut().zip([red, green, blue]) {
                *sum += weight * color;
            }
            total += weight;
        }
    }
    if total == 0.0 {
        return [0.0; 4];
    }
    let [red, green, blue] = sum.map(|sum| sum / total);
    [red, green, blue, (total / ENOUGH).min(1.0)]
}

impl Level {
    fn new(
        [width, height]: [usize; 2],
        observer: &mut Observer<'_>,
        cell: impl Fn(usize, usize) -> Cell + Sync + Send,
    ) -> Result<Self> {
        let mut cells = vec![[0.0; 4]; width * height];
        observer.map(cells.chunks_exact_mut(width).enumerate(), |(y, cells)| {
            for (x, found) in cells.iter_mut().enumerate() {
                *found = cell(x, y);
            }
        })?;
        Ok(Self { width, height, cells })
    }

    fn row(&self, y: usize) -> &[Cell] {
        &self.cells[y * self.width..][..self.width]
    }

    /// Fills what is not known from a level of half the size, of which all is known.
    fn fill(&mut self, coarser: &Self, observer: &mut Observer<'_>) -> Result<()> {
        let width = self.width;
        observer.map(self.cells.chunks_exact_mut(width).enumerate(), |(y, cells)| {
            let around = coarser.around_row(y);
            for (x, cell) in cells.iter_mut().enumerate() {
                let known = cell[3];
                if known < 1.0 {
                    let found = around.color(x);
                    for (color, found) in cell.iter_mut().zip(found) {
                        *color = known * *color + (1.0 - known) * found;
                    }
                }
            }
        })?;
        Ok(())
    }

    /// The rows around the row at y of the level of twice the size.
    fn around_row(&self, y: usize) -> Around<'_> {
        let [near, far] = neighbours(y, 0..self.height);
        Around { rows: [self.row(near), self.row(far)] }
    }
}

/// The rows of a level between which a row of the finer level lies, the nearer one first.
struct Around<'a> {
    rows: [&'a [Cell]; 2],
}

impl Around<'_> {
    /// The colour at a column of the finer level, interpolated.
    fn color(&self, x: usize) -> [f32; 3] {
        let [near, far] = neighbours(x, 0..self.rows[0].len());
        let [above, below] = self.rows.map(|row| {
            core::array::from_fn::<_, 3, _>(|channel| {
                0.75 * row[near][channel] + 0.25 * row[far][channel]
            })
        });
        core::array::from_fn(|channel| 0.75 * above[channel] + 0.25 * below[channel])
    }
}

/// The nearest cell to one of the finer level along an axis, and the next on the other side of it.
fn neighbours(at: usize, range: Range<usize>) -> [usize; 2] {
    let near = at / 2;
    let far = if at.is_multiple_of(2) { near.saturating_sub(1) } else { near + 1 };
    [near, far.min(range.end - 1)]
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::color::ColorModel;
    use crate::encode::progress::unobserved;
    use crate::encode::testing::source;

    /// The samples of a source after bleeding.
    fn bled_u8(size: [usize; 2], color: ColorModel, samples: &[u8]) -> Option<Vec<u8>> {
        let source = source(size, color, samples);
        match unobserved(|observer| Bled::new(&source, observer))? {
            Bled::Eight(samples) => Some(samples),
            Bled::Sixteen(_) => unreachable!("the depth stays"),
        }
    }

    #[test]
    fn what_shows_stays() {
        let mut rng = fastrand::Rng::with_seed(8);
        for size in [[1, 1], [2, 5], [33, 17], [64, 64]] {
            let samples: Vec<u8> = (0..size[0] * size[1] * 4).map(|_| rng.u8(..)).collect();
            let found = bled_u8(size, ColorModel::Rgba, &samples).expect("some are not opaque");
            for (before, after) in samples.chunks_exact(4).zip(found.chunks_exact(4)) {
                assert_eq!(before[3], after[3]);
                for channel in 0..3 {
                    let change = i32::from(after[channel]) - i32::from(before[channel]);
                    let shown = change as f32 * f32::from(before[3]) / 255.0;
                    assert!(shown.abs() < 0.5, "{before:?} {after:?}");
                }
            }
        }
    }

    #[test]
    fn transparent_pixels_take_the_colour_of_their_neighbours() {
        // Two coloured squares on transparent black.
        let pixels = (0..48).flat_map(|y| (0..96).map(move |x| (x, y)));
        let samples: Vec<u16> = pixels
            .clone()
            .flat_map(|(x, y)| match (x, y) {
                (20..36, 16..32) => [60_000, 10, 3000, 65535],
                (60..76, 16..32) => [100, 40_000, 3000, 65535],
                _ => [0; 4],
            })
            .collect();
        let source = Source::new_u16(96, 48, ColorModel::Rgba, &samples).expect("the sizes agree");
        let found = unobserved(|observer| Bled::new(&source, observer));
        let Some(Bled::Sixteen(found)) = found else { unreachable!("some are transparent") };
        for ((x, y), pixel) in pixels.zip(found.chunks_exact(4)) {
            assert_eq!(pixel[2], 3000, "{x} {y}");
            if (16..40).contains(&x) && (12..36).contains(&y) {
                assert!(pixel[0] > 55_000, "{x} {y}: {pixel:?}");
            }
            assert!(pixel[0].max(pixel[1]) > 20_000, "{x} {y}: {pixel:?}");
        }
    }

    #[test]
    fn opaque_and_wholly_transparent_pictures_are_no_trouble() {
        assert_eq!(bled_u8([3, 1], ColorModel::GrayAlpha, &[9, 255, 8, 255, 7, 255]), None);
        assert_eq!(bled_u8([3, 1], ColorModel::Gray, &[9, 8, 7]), None);
        let nothing = bled_u8([3, 1], ColorModel::GrayAlpha, &[9, 0, 80, 0, 7, 0]);
        assert_eq!(nothing, Some(vec![0; 6]));
    }
}
