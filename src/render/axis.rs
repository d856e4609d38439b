//! The pixels of an output, and the grid of pixels in which the Gaussians are evaluated for it (spec,
//! section 9.2).

use core::ops::Range;

/// Most pixels of the grid for one output pixel along an axis, so that the cost of an output
/// follows its size. Up to there the grid is that of the stored pixels.
const MOST_PER_PIXEL: u64 = 8;

/// The pixels of an output along one axis, and those of the grid that they are made of.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Axis {
    /// Side of the whole output in pixels.
    output: u64,
    /// Side of the whole grid in pixels.
    grid: u64,
}

impl Axis {
    /// The axis of an output, with the sides of the stored picture and of the output in pixels.
    pub(crate) fn new(stored: u32, output: u32) -> Self {
        let (stored, output) = (u64::from(stored), u64::from(output));
        let mut divisor = 1;
        // An eighth of a side may have been rounded down.
        while MOST_PER_PIXEL * (output + 1) * divisor < stored {
            divisor *= 2;
        }
        Self { output, grid: stored.div_ceil(divisor).max(output) }
    }

    /// Whether the output is smaller than the stored picture.
    pub(crate) fn is_reduced(self) -> bool {
        self.grid > self.output
    }

    /// Side of the grid in pixels.
    pub(crate) fn grid(self) -> u32 {
        self.grid as u32
    }

    /// Side of the whole output in pixels.
    pub(super) fn output(self) -> u32 {
        self.output as u32
    }

    /// The pixels of the grid that those of the output touch.
    pub(crate) fn span(self, pixels: Range<u32>) -> Range<u32> {
        let first = u64::from(pixels.start) * self.grid / self.output;
        let end = (u64::from(pixels.end) * self.grid).div_ceil(self.output);
        first as u32..end as u32
    }

    /// How much of a pixel of the output and one of the grid is the same, where they are `grid` and
    /// `output` long.
    pub(super) fn overlap(self, pixel: u32, of_grid: u32) -> f32 {
        let (pixel, of_grid) = (u64::from(pixel), u64::from(of_grid));
        let first = (pixel * self.grid).max(of_grid * self.output);
        let end = ((pixel + 1) * self.grid).min((of_grid + 1) * self.output);
        (end - first) as f32
    }

    /// The nearest number of output pixels that are made of so many of the grid, but at least one.
    pub(crate) fn pixels_of(self, of_grid: usize) -> usize {
        (of_grid as u64 * self.output / self.grid).max(1) as usize
    }
}
