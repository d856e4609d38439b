//! The source picture as planes of tiles, in the layout of the training pass.

use super::alpha_bleed::Bled;
use super::error::Result;
use super::loss::PictureLoss;
use super::options::Tune;
use super::progress::Observer;
use super::sample_tile::{FULL_SCALE, OF_EIGHT, SampleLine, SamplePlane, SampleTile, TILE_WIDTH};
use super::source::{Source, SourceSamples};
use crate::render::tile_grid::TILE_HEIGHT;

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
    pub(crate) loss: PictureLoss,
    /// The mean of each channel over the picture, where a full sample is 1; 0 for absent channels.
    pub(crate) mean: [f32; 4],
    planes: Planes,
    /// Size in bytes of what else [`TiledSource::new`] needed.
    pub(crate) scratch_memory: usize,
}

impl TiledSource {
    /// That of a source. Colours that do not show are others, unless they are to be kept.
    pub(crate) fn new(
        source: &Source<'_>,
        tune: Tune,
        observer: &mut Observer<'_>,
    ) -> Result<Self> {
        Self::with_loss(
            source,
            |source, observer| PictureLoss::new(source, tune, observer),
            observer,
        )
    }

    /// The same, where errors count as is said, given the colours that count.
    pub(crate) fn with_loss(
        source: &Source<'_>,
        loss: impl FnOnce(&Source<'_>, &mut Observer<'_>) -> Result<PictureLoss>,
        observer: &mut Observer<'_>,
    ) -> Result<Self> {
        let bled = Bled::new(source, observer)?;
        let bled_memory = bled.as_ref().map_or(0, |bled| bled.memory(source));
        let bled_source = bled.as_ref().map(|bled| bled.source(source));
        let source = bled_source.as_ref().unwrap_or(source);
        let [width, height] = source.size();
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
        let loss = loss(source, observer)?;
        let scratch_memory = bled_memory + loss.scratch_memory(source);
        Ok(Self { width, height, channels, loss, mean, planes, scratch_memory })
    }

    /// The same, with channels that are no colours.
    pub(crate) fn without_colors(self) -> Self {
        Self { loss: self.loss.without_colors(), ..self }
    }

    /// All channels of a tile.
    pub(crate) fn tile<const CHANNELS: usize>(&self, tile: usize) -> SampleTile<'_, CHANNELS> {
        match &self.planes {
            Planes::Eight(planes) => SampleTile::Eight(channels_of(planes, tile)),
            Planes::Sixteen(planes) => SampleTile::Sixteen(channels_of(planes, tile)),
        }
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

    pub(crate) fn pixels(&self) -> usize {
        self.width * self.height
    }

    /// Number of samples.
    pub(crate) fn samples(&self) -> usize {
        self.pixels() * self.channels
    }

    /// Size in bytes.
    pub(crate) fn memory(&self) -> usize {
        let planes = match &self.planes {
            Planes::Eight(planes) => size_of_val(&planes[..]),
            Planes::Sixteen(planes) => size_of_val(&planes[..]),
        };
        planes + self.loss.memory()
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
) -> Result<(Vec<SamplePlane<T>>, [u64; 4])> {
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
