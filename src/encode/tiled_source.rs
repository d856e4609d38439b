//! The source picture as planes of tiles, in the layout of the training pass.

use fearless_simd::{Simd, f32x16, prelude::*};

use super::alpha_bleed::Bled;
use super::error::EncodeError;
use super::options::Tune;
use super::progress::Observer;
use super::sensitivity::Sensitivity;
use super::source::{Source, SourceSamples};
use crate::render::tile_grid::TILE_HEIGHT;

/// Width in pixels of a tile of the training pass, twice that of the decoder's tiles: every splat
/// of a tile costs a reduction of its gradient sums, and wider tiles need fewer reductions.
pub(crate) const TILE_WIDTH: usize = 16;

/// One channel of a tile, row by row.
pub(crate) type TilePlane = [[f32; TILE_WIDTH]; TILE_HEIGHT];
/// One channel of the source in a tile, row by row, in the source's depth.
type SamplePlane<T> = [[T; TILE_WIDTH]; TILE_HEIGHT];
/// The value of a full sample, of either depth.
pub(crate) const FULL_SCALE: f32 = 65535.0;
/// The factor from 8-bit samples to that scale.
const OF_EIGHT: u16 = 257;

/// One [`SamplePlane`] per tile and channel: all channels of the first tile, then all of the second, and
/// so on. Samples of a tile outside the picture are 0.
#[derive(Debug)]
enum Planes {
    Eight(Vec<SamplePlane<u8>>),
    Sixteen(Vec<SamplePlane<u16>>),
}

/// The samples of a picture by tiles.
#[derive(Debug)]
pub(crate) struct TiledSource {
    pub(crate) width: usize,
    pub(crate) height: usize,
    pub(crate) channels: usize,
    /// Half of the quantization step of the source's depth, where a full sample is 1.
    pub(crate) half_step: f32,
    /// How much errors count by their place and scale; `None` if all count the same.
    pub(crate) sensitivity: Option<Sensitivity>,
    /// The mean of each channel over the picture, where a full sample is 1; 0 for absent channels.
    pub(crate) mean: [f32; 4],
    planes: Planes,
    /// Size in bytes of what else [`TiledSource::new`] needed.
    pub(crate) scratch_memory: usize,
}

impl TiledSource {
    /// That of a source. Colours that do not show are others, unless they are to be kept.
    ///
    /// # Errors
    /// [`EncodeError::Cancelled`] when the caller cancels.
    pub(crate) fn new(
        source: &Source<'_>,
        tune: Tune,
        observer: &mut Observer<'_>,
    ) -> Result<Self, EncodeError> {
        let bled = Bled::new(source, observer)?;
        let bled_memory = bled.as_ref().map_or(0, |bled| bled.memory(source));
        let bled_source = bled.as_ref().map(|bled| bled.source(source));
        let source = bled_source.as_ref().unwrap_or(source);
        let (width, height) = (source.width() as usize, source.height() as usize);
        let channels = source.color().channels();
        let size = [width, height, channels];
        let (planes, sums) = match source.samples() {
            SourceSamples::Eight(samples) => {
                let (planes, sums) = by_tiles(samples, size, observer)?;
                (Planes::Eight(planes), sums.map(|sum| sum * u64::from(OF_EIGHT)))
            }
            SourceSamples::Sixteen(samples) => {
                let (planes, sums) = by_tiles(samples, size, observer)?;
                (Planes::Sixteen(planes), sums)
            }
        };
        let full = (width * height) as f64 * f64::from(FULL_SCALE);
        let mean = sums.map(|sum| (sum as f64 / full) as f32);
        let half_step = 0.5 / f32::from(source.depth().max_sample());
        let sensitivity = match tune {
            Tune::Visual => Some(Sensitivity::new(source, observer)?),
            Tune::Psnr => None,
        };
        let scratch = sensitivity.as_ref().map_or(0, |found| found.scratch_memory(source));
        let scratch_memory = bled_memory + scratch;
        Ok(Self { width, height, channels, half_step, sensitivity, mean, planes, scratch_memory })
    }

    /// All channels of a tile.
    pub(crate) fn tile<const CHANNELS: usize>(&self, tile: usize) -> SampleTile<'_, CHANNELS> {
        match &self.planes {
            Planes::Eight(planes) => SampleTile::Eight(channels_of(planes, tile)),
            Planes::Sixteen(planes) => SampleTile::Sixteen(channels_of(planes, tile)),
        }
    }

    /// The samples of a pixel, where a full sample is 1; 0 for absent channels.
    pub(crate) fn sample(&self, x: usize, y: usize) -> [f32; 4] {
        let tile = y / TILE_HEIGHT * self.width.div_ceil(TILE_WIDTH) + x / TILE_WIDTH;
        let mut sample = [0.0; 4];
        for (channel, value) in sample[..self.channels].iter_mut().enumerate() {
            let plane = tile * self.channels + channel;
            *value = self.sample_line(plane, y % TILE_HEIGHT).sample(x % TILE_WIDTH) / FULL_SCALE;
        }
        sample
    }

    /// A row of one channel, by tiles.
    pub(crate) fn line(&self, y: usize, channel: usize) -> impl Iterator<Item = SampleLine<'_>> {
        let columns = self.width.div_ceil(TILE_WIDTH);
        let first = y / TILE_HEIGHT * columns;
        let planes = (first..first + columns).map(move |tile| tile * self.channels + channel);
        planes.map(move |plane| self.sample_line(plane, y % TILE_HEIGHT))
    }

    fn sample_line(&self, plane: usize, row: usize) -> SampleLine<'_> {
        match &self.planes {
            Planes::Eight(planes) => SampleLine::Eight(&planes[plane][row]),
            Planes::Sixteen(planes) => SampleLine::Sixteen(&planes[plane][row]),
        }
    }

    /// How much a squared error of a pixel counts.
    #[inline]
    pub(crate) fn sensitivity(&self, x: usize, y: usize) -> f32 {
        self.sensitivity.as_ref().map_or(1.0, |sensitivity| sensitivity.at(x, y))
    }

    /// How much a squared error counts at a position in pixels, or at the nearest one inside the
    /// picture.
    #[inline]
    pub(crate) fn sensitivity_near(&self, [x, y]: [f32; 2]) -> f32 {
        // Casts saturate.
        self.sensitivity((x as usize).min(self.width - 1), (y as usize).min(self.height - 1))
    }

    /// How much a squared error counts on average under a Gaussian, which may lie across areas of very
    /// different sensitivity: at three points around its centre, one standard deviation away.
    #[inline]
    pub(crate) fn sensitivity_under(&self, center: [f32; 2], cholesky: [f32; 3]) -> f32 {
        const HALF_ROOT_OF_THREE: f32 = 0.866_025_4;
        let ([x, y], [l11, l21, l22]) = (center, cholesky);
        let near = |u: f32, v: f32| self.sensitivity_near([x + l11 * u, y + l21 * u + l22 * v]);
        let [left, right] = [-HALF_ROOT_OF_THREE, HALF_ROOT_OF_THREE].map(|u| near(u, -0.5));
        (near(0.0, 1.0) + left + right) / 3.0
    }

    /// The sum of squared errors at a PSNR in dB, where a full sample is 1.
    pub(crate) fn error_of(&self, psnr: f64) -> f64 {
        (self.pixels() * self.channels) as f64 * 10_f64.powf(-psnr / 10.0)
    }

    pub(crate) fn pixels(&self) -> usize {
        self.width * self.height
    }

    /// Size in bytes.
    pub(crate) fn memory(&self) -> usize {
        let planes = match &self.planes {
            Planes::Eight(planes) => size_of_val(&planes[..]),
            Planes::Sixteen(planes) => size_of_val(&planes[..]),
        };
        planes + self.sensitivity.as_ref().map_or(0, Sensitivity::memory)
    }
}

/// All channels of a tile of the source.
#[derive(Clone, Copy, Debug)]
pub(crate) enum SampleTile<'a, const CHANNELS: usize> {
    Eight(&'a [SamplePlane<u8>; CHANNELS]),
    Sixteen(&'a [SamplePlane<u16>; CHANNELS]),
}

impl<'a, const CHANNELS: usize> SampleTile<'a, CHANNELS> {
    #[inline(always)]
    pub(crate) fn line(&self, channel: usize, row: usize) -> SampleLine<'a> {
        match self {
            Self::Eight(planes) => SampleLine::Eight(&planes[channel][row]),
            Self::Sixteen(planes) => SampleLine::Sixteen(&planes[channel][row]),
        }
    }
}

/// A row of one channel of a tile of the source.
#[derive(Clone, Copy, Debug)]
pub(crate) enum SampleLine<'a> {
    Eight(&'a [u8; TILE_WIDTH]),
    Sixteen(&'a [u16; TILE_WIDTH]),
}

impl SampleLine<'_> {
    /// The samples, where a full one is [`FULL_SCALE`].
    #[inline(always)]
    pub(crate) fn load<S: Simd>(self, simd: S) -> f32x16<S> {
        match self {
            Self::Eight(samples) => {
                f32x16::from_fn(simd, |x| f32::from(samples[x])) * f32::from(OF_EIGHT)
            }
            Self::Sixteen(samples) => f32x16::from_fn(simd, |x| f32::from(samples[x])),
        }
    }

    /// One of them.
    fn sample(self, x: usize) -> f32 {
        f32::from(match self {
            Self::Eight(samples) => u16::from(samples[x]) * OF_EIGHT,
            Self::Sixteen(samples) => samples[x],
        })
    }
}

fn channels_of<T, const CHANNELS: usize>(
    planes: &[SamplePlane<T>],
    tile: usize,
) -> &[SamplePlane<T>; CHANNELS] {
    planes[tile * CHANNELS..][..CHANNELS].try_into().expect("a tile has all channels")
}

/// Interleaved samples by tiles, and the sum of each channel. The size is the width, the height and the
/// number of channels.
fn by_tiles<T: Copy + Default + Into<u64> + Send + Sync>(
    samples: &[T],
    [width, height, channels]: [usize; 3],
    observer: &mut Observer<'_>,
) -> Result<(Vec<SamplePlane<T>>, [u64; 4]), EncodeError> {
    let columns = width.div_ceil(TILE_WIDTH);
    let tiles = columns * height.div_ceil(TILE_HEIGHT);
    let mut planes = vec![[[T::default(); TILE_WIDTH]; TILE_HEIGHT]; tiles * channels];
    let rows = planes.chunks_exact_mut(columns * channels).enumerate();
    let sums = observer.map(rows, |(row, planes)| {
        let first = row * TILE_HEIGHT;
        let mut sums = [0_u64; 4];
        for y in first..height.min(first + TILE_HEIGHT) {
            let line = &samples[y * width * channels..][..width * channels];
            for (x, pixel) in line.chunks_exact(channels).enumerate() {
                let planes = &mut planes[x / TILE_WIDTH * channels..][..channels];
                for (channel, &sample) in pixel.iter().enumerate() {
                    planes[channel][y - first][x % TILE_WIDTH] = sample;
                    sums[channel] += sample.into();
                }
            }
        }
        sums
    })?;
    let total = |channel| sums.iter().map(|sums: &[u64; 4]| sums[channel]).sum();
    Ok((planes, core::array::from_fn(total)))
}

/// The residuals of sixteen samples of the source (from 0 to [`FULL_SCALE`]) after clamping, as in the
/// output: a rendering above white is no error where the source is white, nor one below black where the
/// source is black.
#[inline(always)]
pub(crate) fn visible<S: Simd>(simd: S, residual: f32x16<S>, sample: f32x16<S>) -> f32x16<S> {
    let zero = f32x16::splat(simd, 0.0);
    let residual = sample.simd_ge(FULL_SCALE).select(residual.min(zero), residual);
    sample.simd_le(zero).select(residual.max(zero), residual)
}

/// The pixel centres of the sixteen columns from `x` on.
#[inline(always)]
pub(crate) fn centers<S: Simd>(simd: S, x: u32) -> f32x16<S> {
    f32x16::from_fn(simd, |column| (x as usize + column) as f32 + 0.5)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::color::ColorModel;
    use crate::encode::progress::unobserved;

    #[test]
    fn what_lies_under_a_gaussian_counts() {
        // Even ground on the left, and noise on the right.
        let mut rng = fastrand::Rng::with_seed(2);
        let samples: Vec<u8> =
            (0..96 * 96).map(|i| if i % 96 < 48 { 128 } else { rng.u8(..) }).collect();
        let source = Source::new_u8(96, 96, ColorModel::Gray, &samples).expect("the sizes agree");
        let tiled = |tune| unobserved(|observer| TiledSource::new(&source, tune, observer));
        let visual = tiled(Tune::Visual);
        let [even, noise] = [8.0, 88.0].map(|x| visual.sensitivity_near([x, 48.0]));
        assert!(even > 4.0 * noise, "{even}, {noise}");
        let under = |x, cholesky| visual.sensitivity_under([x, 48.0], cholesky);
        // Small, wide, high, outside the picture.
        assert!((under(8.5, [0.1, 0.0, 0.1]) / even - 1.0).abs() < 1e-5);
        assert!((under(60.0, [30.0, 0.0, 2.0]) - noise) > 0.1 * even);
        assert!(under(60.0, [2.0, 0.0, 30.0]) < 2.0 * noise);
        assert!(under(-1e30, [1e30, 1e30, 1.0]).is_finite());
        assert_eq!(tiled(Tune::Psnr).sensitivity_under([60.0, 48.0], [30.0, 0.0, 2.0]), 1.0);
    }
}
