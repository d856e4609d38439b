//! What a source and a rendering of it have in each cell of a picture.

use fearless_simd::{Level, dispatch};
use rayon::prelude::*;

use super::bands::{Block, BlockCells, COLUMNS, Content, HALO, HEIGHT, ROWS, STRIDE};
use crate::encode::error::Result;
use crate::encode::progress::Observer;
use crate::encode::rows::{Border, MARGIN, Rows};
use crate::encode::source::{SPAN, Source};
use crate::encode::strips;
use crate::region::Region;
use crate::render::Picture;
use crate::texture::CELL;

/// Shares of red, green and blue in luma.
const LUMA: [f32; 3] = [0.299, 0.587, 0.114];

/// The cells of a picture, row by row.
#[derive(Debug)]
pub(super) struct Cells {
    pub(super) columns: usize,
    pub(super) rows: usize,
    /// The content of the source, and that of the rendering.
    pub(super) content: Vec<[Content; 2]>,
}

impl Cells {
    /// Those of a source and of a picture of it.
    pub(super) fn new(
        source: &Source<'_>,
        picture: &Picture<'_>,
        observer: &mut Observer<'_>,
    ) -> Result<Self> {
        let mut comparison = Comparison::new(source);
        strips::render(picture, u32::MAX, observer, |region, planes| {
            comparison.see(region, planes);
        })?;
        Ok(comparison.cells)
    }
}

/// A comparison of a rendering, which comes in strips from the top, with its source.
#[derive(Debug)]
struct Comparison<'a> {
    source: &'a Source<'a>,
    level: Level,
    /// The latest rows of luma, as it shows over black.
    rows: Rows,
    /// How many rows of pixels are in cells.
    done: usize,
    cells: Cells,
}

impl<'a> Comparison<'a> {
    fn new(source: &'a Source<'a>) -> Self {
        let size = source.size();
        let [columns, rows] = size.map(|side| side.div_ceil(CELL));
        let content = vec![[Content::default(); 2]; columns * rows];
        Self {
            source,
            level: Level::new(),
            rows: Rows::new(size, Border::Mirrored, ROWS),
            done: 0,
            cells: Cells { columns, rows, content },
        }
    }

    /// Takes in the next strip, all columns of it: float samples, plane after plane. The number of its rows is
    /// a multiple of [`ROWS`], except at the bottom.
    fn see(&mut self, region: Region, planes: &[f32]) {
        let (source, level) = (self.source, self.level);
        let rows = region.height as usize;
        let blank: Vec<_> = (0..rows).step_by(ROWS).map(|y| (y, self.rows.blank())).collect();
        let filled = blank.into_par_iter().map(|(first, mut group)| {
            for row in first..rows.min(first + ROWS) {
                for x in (0..region.width as usize).step_by(SPAN) {
                    let luma = dispatch!(level, _ => luma(source, region, planes, x, row));
                    for (which, luma) in luma.into_iter().enumerate() {
                        let part = group.part(which, row - first, x);
                        let count = SPAN.min(region.width as usize - x);
                        part[..count].copy_from_slice(&luma[..count]);
                    }
                }
            }
            group
        });
        for group in filled.collect::<Vec<_>>() {
            self.rows.push(group);
        }
        self.compare();
    }

    /// Finds the cells of all rows whose surroundings are known.
    fn compare(&mut self) {
        let (rows, level) = (&self.rows, self.level);
        let [width, height] = [rows.width, rows.height];
        let end = if rows.known() == height { height } else { rows.known().saturating_sub(HALO) };
        let end = if end == height { end } else { end / ROWS * ROWS };
        let tops = (self.done..end).step_by(ROWS);
        let corners = tops.flat_map(|y| (0..width).step_by(COLUMNS).map(move |x| [x, y]));
        let corners: Vec<[usize; 2]> = corners.collect();
        let found = corners.par_iter().map_init(Block::default, |block, &corner| {
            dispatch!(level, _ => [0, 1].map(|which| cells_of(rows, which, corner, block)))
        });
        let found: Vec<[BlockCells; 2]> = found.collect();
        for ([x, y], [source, rendering]) in corners.into_iter().zip(found) {
            for (row, line) in source.iter().zip(&rendering).enumerate() {
                for (column, (&source, &rendering)) in line.0.iter().zip(line.1).enumerate() {
                    let (x, y) = (x / CELL + column, y / CELL + row);
                    if x < self.cells.columns && y < self.cells.rows {
                        self.cells.content[y * self.cells.columns + x] = [source, rendering];
                    }
                }
            }
        }
        self.done = end;
        self.rows.forget(end.saturating_sub(HALO));
    }
}

/// The cells of a block whose first pixel is `corner`.
#[inline(always)]
fn cells_of(rows: &Rows, which: usize, [x, y]: [usize; 2], block: &mut Block) -> BlockCells {
    for row in 0..HEIGHT {
        let line = rows.row((y + row) as isize - HALO as isize)[which].as_flattened();
        let line = &line[x + MARGIN - HALO..];
        let count = STRIDE.min(line.len());
        block.row(row)[..count].copy_from_slice(&line[..count]);
    }
    block.cells([COLUMNS.min(rows.width - x), ROWS.min(rows.height - y)])
}

/// The luma of some columns of a row of a strip: that of the source, and that of the rendering.
#[inline(always)]
fn luma(
    source: &Source<'_>,
    region: Region,
    planes: &[f32],
    x: usize,
    row: usize,
) -> [[f32; SPAN]; 2] {
    let (width, pixels) = (region.width as usize, region.pixels() as usize);
    let mut samples = [[[0.0; SPAN]; 4]; 2];
    let [of_source, of_rendering] = &mut samples;
    let count = source.read(x, region.y as usize + row, of_source);
    let scale = 1.0 / f32::from(source.depth().max_sample());
    for sample in of_source.as_flattened_mut() {
        *sample *= scale;
    }
    for (channel, plane) in of_rendering.iter_mut().zip(planes.chunks_exact(pixels)) {
        channel[..count].copy_from_slice(&plane[row * width + x..][..count]);
        for sample in channel {
            *sample = sample.clamp(0.0, 1.0);
        }
    }
    let channels = source.color().channels();
    let shares = if channels < 3 { [1.0, 0.0, 0.0] } else { LUMA };
    samples.map(|channels_of| {
        let mut luma = [0.0; SPAN];
        for (channel, share) in channels_of.iter().zip(shares) {
            for x in 0..SPAN {
                luma[x] += share * channel[x];
            }
        }
        if source.is_premultiplied() {
            for x in 0..SPAN {
                luma[x] *= channels_of[channels - 1][x];
            }
        }
        luma
    })
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::color::ColorModel;
    use crate::testing::simd_levels;

    /// The content of each cell, directly from the definition.
    fn plain(luma: &[f64], [width, height]: [usize; 2]) -> Vec<[f64; 7]> {
        let mirrored = |at: isize, length: usize| {
            let last = length as isize - 1;
            (if at > last { 2 * last - at } else { at.abs() }) as usize
        };
        let blur = |plane: &[f64], step: isize| -> Vec<f64> {
            let at = |x: isize, y: isize| plane[mirrored(y, height) * width + mirrored(x, width)];
            let taps = || (-2..=2).zip([1.0, 4.0, 6.0, 4.0, 1.0].map(|tap| tap / 16.0));
            let value = |x: isize, y: isize| {
                let row =
                    |dy| taps().map(|(dx, a)| a * at(x + dx * step, y + dy * step)).sum::<f64>();
                taps().map(|(dy, a)| a * row(dy)).sum()
            };
            let rows = 0..height as isize;
            rows.flat_map(|y| (0..width as isize).map(move |x| (x, y)))
                .map(|(x, y)| value(x, y))
                .collect()
        };
        let mut blurs = vec![luma.to_vec()];
        for step in [1, 2] {
            blurs.push(blur(&blurs[blurs.len() - 1], step));
        }
        let mut cells = Vec::new();
        for (top, left) in
            (0..height).step_by(8).flat_map(|y| (0..width).step_by(8).map(move |x| (y, x)))
        {
            let rows = top..height.min(top + 8);
            let pixels = rows.flat_map(|y| (left..width.min(left + 8)).map(move |x| (x, y)));
            let count = pixels.clone().count() as f64;
            let mean = |value: &dyn Fn(isize, isize) -> f64| {
                let values = pixels.clone().map(|(x, y)| value(x as isize, y as isize));
                values.sum::<f64>() / count
            };
            let at = |octave: usize, x: isize, y: isize| {
                blurs[octave][mirrored(y, height) * width + mirrored(x, width)]
            };
            let detail = |x, y| at(0, x, y) - at(2, x, y);
            let band = |octave| move |x, y| at(octave, x, y) - at(octave + 1, x, y);
            let magnitudes = [0, 1].map(|octave| mean(&|x, y| band(octave)(x, y).abs()).sqrt());
            let slopes = [[1, 0], [0, 1]]
                .map(|[dx, dy]| mean(&|x, y| (detail(x, y) - detail(x - dx, y - dy)).abs()).sqrt());
            let energies = [0, 1].map(|octave| mean(&|x, y| band(octave)(x, y).powi(2)));
            let repeated = mean(&|x, y| {
                let same = |left| at(0, x, y) == at(0, x - left, y);
                f64::from(u8::from(same(1) || same(2)))
            });
            let all = [&magnitudes[..], &slopes, &energies, &[repeated]].concat();
            cells.push(all.try_into().expect("there are seven"));
        }
        cells
    }

    /// The cells of a source and of planes that come in strips of so many rows.
    fn found(source: &Source<'_>, planes: &[f32], strip: usize, level: Level) -> Cells {
        let [width, height] = source.size();
        let mut comparison = Comparison { level, ..Comparison::new(source) };
        for y in (0..height).step_by(strip) {
            let rows = strip.min(height - y);
            let region = Region { x: 0, y: y as u32, width: width as u32, height: rows as u32 };
            let planes = planes.chunks_exact(width * height);
            let planes: Vec<&[f32]> =
                planes.map(|plane| &plane[y * width..][..rows * width]).collect();
            comparison.see(region, &planes.concat());
        }
        comparison.cells
    }

    #[test]
    fn cells_are_those_of_the_definition_whatever_the_model_and_the_strips() {
        let mut rng = fastrand::Rng::with_seed(6);
        for (size, model, shares) in [
            ([150, 101], ColorModel::Rgb, [0.299, 0.587, 0.114]),
            ([130, 33], ColorModel::GrayAlpha, [1.0, 0.0, 0.0]),
            ([17, 64], ColorModel::Gray, [1.0, 0.0, 0.0]),
        ] {
            let [width, height] = size;
            let (pixels, channels) = (width * height, model.channels());
            // Some of the gray pixels are repeated.
            let step = if model == ColorModel::Gray { 10_000 } else { 1 };
            let samples = (0..pixels * channels).map(|_| rng.u16(..) / step * step);
            let samples: Vec<u16> = samples.collect();
            let planes: Vec<f32> = (0..pixels * channels).map(|_| rng.f32() * 1.4 - 0.2).collect();
            let source = Source::new_u16(width as u32, height as u32, model, &samples);
            let source = source.expect("the sizes agree");
            let luma = |sample: &dyn Fn(usize, usize) -> f64| -> Vec<f64> {
                let alpha = |at| if model.has_alpha() { sample(at, channels - 1) } else { 1.0 };
                let colors = channels.min(3) - usize::from(channels == 2);
                let color = |at| (0..colors).map(|c| shares[c] * sample(at, c)).sum::<f64>();
                (0..pixels).map(|at| color(at) * alpha(at)).collect()
            };
            let of_source = luma(&|at, c| f64::from(samples[at * channels + c]) / 65_535.0);
            let of_planes = luma(&|at, c| f64::from(planes[c * pixels + at].clamp(0.0, 1.0)));
            let expected = [of_source, of_planes].map(|luma| plain(&luma, size));
            let first = found(&source, &planes, 32, Level::new());
            assert_eq!(first.columns * first.rows, expected[0].len());
            for (at, content) in first.content.iter().enumerate() {
                for (which, content) in content.iter().enumerate() {
                    let Content { magnitudes, slopes, energies, repeated } = content;
                    let found = [&magnitudes[..], slopes, energies, &[*repeated]].concat();
                    for (found, expected) in found.iter().zip(expected[which][at]) {
                        let error = (f64::from(*found) - expected).abs();
                        assert!(error < 1e-5, "{model:?}, cell {at}: {found}, {expected}");
                    }
                }
            }
            for (name, level) in simd_levels() {
                for strip in [32, 64, 1024] {
                    let other = found(&source, &planes, strip, level);
                    assert_eq!(other.content, first.content, "{name}, strips of {strip}");
                }
            }
        }
    }
}
