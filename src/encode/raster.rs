//! The source picture as float planes, tile by tile, in the layout of the training pass.

use super::source::Source;
use crate::render::{Plane, TILE_HEIGHT, TILE_WIDTH};

/// The samples of a picture in [0, 1], one [`Plane`] per tile and channel: all channels of the
/// first tile, then all of the second. Pixels of a tile that lie outside the picture are 0.
#[derive(Debug)]
pub(crate) struct Raster {
    pub(crate) width: usize,
    pub(crate) height: usize,
    pub(crate) channels: usize,
    /// Half of the distance between neighbouring samples of the source's depth.
    pub(crate) half_step: f32,
    planes: Vec<Plane>,
}

impl Raster {
    pub(crate) fn new(source: &Source<'_>) -> Self {
        let (width, height) = (source.width() as usize, source.height() as usize);
        let channels = source.color().channels();
        let columns = width.div_ceil(TILE_WIDTH);
        let tiles = columns * height.div_ceil(TILE_HEIGHT);
        let mut planes = vec![[[0.0; TILE_WIDTH]; TILE_HEIGHT]; tiles * channels];
        for y in 0..height {
            for x in 0..width {
                let tile = y / TILE_HEIGHT * columns + x / TILE_WIDTH;
                for channel in 0..channels {
                    planes[tile * channels + channel][y % TILE_HEIGHT][x % TILE_WIDTH] =
                        source.sample((y * width + x) * channels + channel);
                }
            }
        }
        let half_step = 0.5 / f32::from(source.depth().max_sample());
        Self { width, height, channels, half_step, planes }
    }

    /// All channels of a tile.
    pub(crate) fn tile<const CHANNELS: usize>(&self, tile: usize) -> &[Plane; CHANNELS] {
        self.planes[tile * CHANNELS..][..CHANNELS].try_into().expect("a tile has all channels")
    }

    /// The samples of a pixel; 0 for absent channels.
    pub(crate) fn sample(&self, x: usize, y: usize) -> [f32; 4] {
        let tile = y / TILE_HEIGHT * self.width.div_ceil(TILE_WIDTH) + x / TILE_WIDTH;
        let mut sample = [0.0; 4];
        for (channel, value) in sample[..self.channels].iter_mut().enumerate() {
            *value = self.planes[tile * self.channels + channel][y % TILE_HEIGHT][x % TILE_WIDTH];
        }
        sample
    }

    /// The mean of each channel over the picture; 0 for absent channels.
    pub(crate) fn mean(&self) -> [f32; 4] {
        let mut sums = [0.0_f64; 4];
        for (index, plane) in self.planes.iter().enumerate() {
            let sum = plane.iter().flatten().map(|&sample| f64::from(sample)).sum::<f64>();
            sums[index % self.channels] += sum;
        }
        sums.map(|sum| (sum / (self.width * self.height) as f64) as f32)
    }

    pub(crate) fn pixels(&self) -> usize {
        self.width * self.height
    }

    /// Bytes held.
    pub(crate) fn memory(&self) -> usize {
        size_of_val(&self.planes[..])
    }
}
