//! The source picture as planes of tiles, in the layout of the training pass.

use fearless_simd::{Simd, f32x16, prelude::*};

use super::error::EncodeError;
use super::options::Tune;
use super::progress::Observer;
use super::sensitivity::Sensitivity;
use super::source::Source;
use crate::render::tile_grid::TILE_HEIGHT;

/// Width in pixels of a tile of the training pass, twice that of the decoder's tiles: every splat
/// of a tile costs a reduction of its gradient sums, and wider tiles need fewer reductions.
pub(crate) const TILE_WIDTH: usize = 16;

/// One channel of a tile, row by row.
pub(crate) type TilePlane = [[f32; TILE_WIDTH]; TILE_HEIGHT];
/// One channel of the source in a tile, row by row, where a full sample is [`FULL_SCALE`]: as exact
/// as floats, in half the memory.
pub(crate) type SamplePlane = [SampleLine; TILE_HEIGHT];
/// A row of it.
pub(crate) type SampleLine = [u16; TILE_WIDTH];
/// The value of a full sample in a [`SamplePlane`].
pub(crate) const FULL_SCALE: f32 = 65535.0;
/// Work for a sample.
const WORK: f64 = 2.0;

/// The samples of a picture, one [`SamplePlane`] per tile and channel: all channels of the
/// first tile, then all of the second, and so on. Samples of a tile outside the picture are 0.
#[derive(Debug)]
pub(crate) struct Raster {
    pub(crate) width: usize,
    pub(crate) height: usize,
    pub(crate) channels: usize,
    /// Half of the quantization step of the source's depth, where a full sample is 1.
    pub(crate) half_step: f32,
    /// How much errors count by their place and scale; `None` if all count the same.
    pub(crate) sensitivity: Option<Sensitivity>,
    /// The mean of each channel over the picture, where a full sample is 1; 0 for absent channels.
    pub(crate) mean: [f32; 4],
    planes: Vec<SamplePlane>,
}

impl Raster {
    /// # Errors
    /// [`EncodeError::Cancelled`] when the caller cancels.
    pub(crate) fn new(
        source: &Source<'_>,
        tune: Tune,
        observer: &mut Observer<'_>,
    ) -> Result<Self, EncodeError> {
        let (width, height) = (source.width() as usize, source.height() as usize);
        let channels = source.color().channels();
        let columns = width.div_ceil(TILE_WIDTH);
        let tiles = columns * height.div_ceil(TILE_HEIGHT);
        let mut planes = vec![[[0; TILE_WIDTH]; TILE_HEIGHT]; tiles * channels];
        let work = WORK * (TILE_HEIGHT * width * channels) as f64;
        let rows = planes.chunks_exact_mut(columns * channels).enumerate();
        let sums = observer.map(work, rows, |(row, planes)| {
            let first = row * TILE_HEIGHT;
            let mut sums = [0_u64; 4];
            for y in first..height.min(first + TILE_HEIGHT) {
                for x in 0..width {
                    for channel in 0..channels {
                        let sample = source.wide_sample((y * width + x) * channels + channel);
                        planes[x / TILE_WIDTH * channels + channel][y - first][x % TILE_WIDTH] =
                            sample;
                        sums[channel] += u64::from(sample);
                    }
                }
            }
            sums
        })?;
        let full = (width * height) as f64 * f64::from(FULL_SCALE);
        let mean = core::array::from_fn(|channel| {
            (sums.iter().map(|sums| sums[channel]).sum::<u64>() as f64 / full) as f32
        });
        let half_step = 0.5 / f32::from(source.depth().max_sample());
        let sensitivity = match tune {
            Tune::Visual => Some(Sensitivity::new(source, observer)?),
            Tune::Psnr => None,
        };
        Ok(Self { width, height, channels, half_step, sensitivity, mean, planes })
    }

    /// All channels of a tile.
    pub(crate) fn tile<const CHANNELS: usize>(&self, tile: usize) -> &[SamplePlane; CHANNELS] {
        self.planes[tile * CHANNELS..][..CHANNELS].try_into().expect("a tile has all channels")
    }

    /// The samples of a pixel, where a full sample is 1; 0 for absent channels.
    pub(crate) fn sample(&self, x: usize, y: usize) -> [f32; 4] {
        let tile = y / TILE_HEIGHT * self.width.div_ceil(TILE_WIDTH) + x / TILE_WIDTH;
        let mut sample = [0.0; 4];
        for (channel, value) in sample[..self.channels].iter_mut().enumerate() {
            let plane = &self.planes[tile * self.channels + channel];
            *value = f32::from(plane[y % TILE_HEIGHT][x % TILE_WIDTH]) / FULL_SCALE;
        }
        sample
    }

    /// A row of one channel, by tiles.
    pub(crate) fn line(&self, y: usize, channel: usize) -> impl Iterator<Item = &SampleLine> {
        let columns = self.width.div_ceil(TILE_WIDTH);
        let tiles = self.planes[y / TILE_HEIGHT * columns * self.channels..]
            .chunks_exact(self.channels)
            .take(columns);
        tiles.map(move |planes| &planes[channel][y % TILE_HEIGHT])
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

    /// The sum of squared errors at a PSNR in dB, where a full sample is 1.
    pub(crate) fn error_of(&self, psnr: f64) -> f64 {
        (self.pixels() * self.channels) as f64 * 10_f64.powf(-psnr / 10.0)
    }

    pub(crate) fn pixels(&self) -> usize {
        self.width * self.height
    }

    /// Size in bytes.
    pub(crate) fn memory(&self) -> usize {
        size_of_val(&self.planes[..]) + self.sensitivity.as_ref().map_or(0, Sensitivity::memory)
    }
}

/// The pixel centres of the sixteen columns from `x` on.
#[inline(always)]
pub(crate) fn centers<S: Simd>(simd: S, x: u32) -> f32x16<S> {
    f32x16::from_fn(simd, |column| (x as usize + column) as f32 + 0.5)
}
