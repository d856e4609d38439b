//! How much work a picture is for the GPU, as hostile files could stop it for minutes.

use image_gip::{Gaussian, Kernel};

use crate::view::{Frame, TILE};

/// Evaluations of the kernel that take as long as the test whether a splat touches a tile.
const TEST: u64 = 4;

/// Evaluations for each pixel of the grid that are always allowed: twice those of the decoder, as tiles are four
/// times as large.
const PER_PIXEL: u64 = 128;

/// The most kernel evaluations of a rendering with a limit of those beyond [`PER_PIXEL`].
pub(crate) fn allowed(frame: &Frame, max_work: u64) -> u64 {
    let pixels = u64::from(frame.grid.width) * u64::from(frame.grid.height);
    pixels.saturating_mul(PER_PIXEL).saturating_add(max_work)
}

/// An upper bound of the kernel evaluations of a rendering, tests of tiles included.
pub(crate) fn evaluations(gaussians: &[Gaussian], frame: &Frame, kernel: Kernel) -> u64 {
    let drawn = gaussians.iter().filter(|gaussian| gaussian.is_drawable());
    drawn.map(|gaussian| of_gaussian(gaussian, frame, kernel)).sum()
}

fn of_gaussian(gaussian: &Gaussian, frame: &Frame, kernel: Kernel) -> u64 {
    let [sx, sy] = frame.scale;
    let [l11, l21, l22] = gaussian.cholesky;
    // Widening for a smaller output adds less than one pixel to each.
    let (l11, l21, l22) = (l11 * sx + 1.0, (l21 * sy).abs(), l22 * sy + 1.0);
    let radius = kernel.cutoff().sqrt();
    let height = l21.hypot(l22);
    let [x, y] = gaussian.center;
    let columns = Span::new(x * sx, radius * l11, frame.grid.x, frame.grid.width);
    let rows = Span::new(y * sy, radius * height, frame.grid.y, frame.grid.height);
    let (Some(columns), Some(rows)) = (columns, rows) else { return 0 };
    // In a row of tiles, an ellipse is as wide as its chord, and moves by its slope. Both ends may
    // lie within a tile.
    let tile = TILE as f32;
    let chord = 2.0 * radius * l11 * (l22 / height);
    let slope = (l11 / height) * (l21 / height);
    let widest = ((chord + slope * (tile + 1.0)) / tile) as u64;
    let touched = columns.tiles(1).min(widest.saturating_add(2)) * rows.tiles(1);
    let bin = frame.bin_tiles();
    touched * u64::from(TILE * TILE) + columns.tiles(bin) * rows.tiles(bin) * TEST
}

/// The tiles that a splat may touch along an axis.
struct Span {
    first: u32,
    last: u32,
}

impl Span {
    /// The tiles up to `reach` pixels from a centre, in a region from `origin` on; `None` if there
    /// are none.
    fn new(center: f32, reach: f32, origin: u32, length: u32) -> Option<Self> {
        let reach = reach + 1.0 + (center.abs() + reach) * 4e-6;
        let (low, high) = (center - reach - origin as f32, center + reach - origin as f32);
        let end = length as f32;
        // The casts are of numbers from 0 to 2^23.
        let tile = |at: f32| at.clamp(0.0, end - 1.0) as u32 / TILE;
        (high >= 0.0 && low < end).then(|| Self { first: tile(low), last: tile(high) })
    }

    /// Their number, rounded up to whole bins of so many tiles.
    fn tiles(&self, bin: u32) -> u64 {
        u64::from(self.last / bin - self.first / bin + 1) * u64::from(bin)
    }
}

#[cfg(test)]
mod tests {
    use image_gip::Region;

    use super::*;

    fn frame(width: u32, height: u32) -> Frame {
        let region = Region { x: 0, y: 0, width, height };
        let [scale, ratio, offset] = [[1.0; 2], [1.0; 2], [0.0; 2]];
        Frame { scale, grid: region, region, ratio, offset, gaussians: 1, fade: 0.0 }
    }

    fn gaussian(center: [f32; 2], cholesky: [f32; 3]) -> Gaussian {
        Gaussian { center, cholesky, color: [1.0; 4] }
    }

    #[test]
    fn a_small_gaussian_takes_the_tiles_around_it() {
        let small = gaussian([100.0, 100.0], [1.0, 0.0, 1.0]);
        let work = evaluations(&[small], &frame(4096, 4096), Kernel::Quartic);
        // At most 3 x 2 tiles, and the tests of one bin of 16 x 16.
        assert!((256..=6 * 256 + 256 * TEST).contains(&work), "{work}");
    }

    #[test]
    fn a_gaussian_that_does_not_show_takes_nothing() {
        let outside = gaussian([-100.0, 10.0], [1.0, 0.0, 1.0]);
        let not_drawn = gaussian([10.0, 10.0], [f32::NAN, 0.0, 1.0]);
        assert_eq!(evaluations(&[outside, not_drawn], &frame(64, 64), Kernel::Quartic), 0);
    }

    #[test]
    fn the_largest_gaussians_take_all_tiles() {
        let largest = gaussian([0.0; 2], [16_777_216.0, -16_777_216.0, 16_777_216.0]);
        let tiles = 256 * 256;
        let work = evaluations(&[largest; 3], &frame(4096, 4096), Kernel::PAPER);
        assert_eq!(work, 3 * tiles * (256 + TEST));
    }

    #[test]
    fn a_diagonal_needle_takes_far_fewer_tiles_than_its_rectangle() {
        let needle = gaussian([2048.0; 2], [800.0, 800.0, 0.5]);
        let work = evaluations(&[needle], &frame(4096, 4096), Kernel::Quartic);
        assert!(work < 256 * 256 * 256 / 16, "{work}");
    }
}
