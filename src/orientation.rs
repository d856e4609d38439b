//! How a picture is turned for display.

use alloc::vec::Vec;

use crate::error::RequestError;
#[cfg(feature = "encode")]
use crate::gaussian::Gaussian;
use crate::region::Region;

/// How a picture as stored is turned for display, as Exif has it (spec, section 5.5). See
/// [`Metadata::orientation`](crate::Metadata::orientation).
///
/// The decoder works on the picture as stored: sizes and regions of a request are in its pixels.
/// For a request in pixels of the upright picture, [`Orientation::turned_size`] and
/// [`Orientation::stored_region`] give what to ask for, and [`Orientation::apply`] turns the
/// samples that come back.
///
/// ```
/// use image_gip::Orientation;
///
/// // Two columns and three rows.
/// let stored = [1, 2, 3, 4, 5, 6];
/// assert_eq!(Orientation::Rotate90.turned_size(2, 3), (3, 2));
/// assert_eq!(Orientation::Rotate90.apply(&stored, 2, 1), [5, 3, 1, 6, 4, 2]);
/// ```
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Hash)]
#[repr(u8)]
#[expect(clippy::exhaustive_enums, reason = "Exif has these eight")]
pub enum Orientation {
    /// The picture is upright as stored. Exif has the value 1 for this, and so on.
    #[default]
    NoTransforms = 1,
    /// Left and right are exchanged.
    FlipHorizontal,
    /// Turned by 180 degrees.
    Rotate180,
    /// Top and bottom are exchanged.
    FlipVertical,
    /// Turned by 90 degrees clockwise, then left and right are exchanged: rows become columns.
    Rotate90FlipH,
    /// Turned by 90 degrees clockwise.
    Rotate90,
    /// Turned by 270 degrees clockwise, then left and right are exchanged.
    Rotate270FlipH,
    /// Turned by 270 degrees clockwise.
    Rotate270,
}

impl Orientation {
    /// All eight, in the order of their Exif values.
    const ALL: [Self; 8] = [
        Self::NoTransforms,
        Self::FlipHorizontal,
        Self::Rotate180,
        Self::FlipVertical,
        Self::Rotate90FlipH,
        Self::Rotate90,
        Self::Rotate270FlipH,
        Self::Rotate270,
    ];

    /// The orientation of an Exif value, 1 to 8.
    #[must_use]
    pub fn from_exif(value: u8) -> Option<Self> {
        Self::ALL.get(usize::from(value).checked_sub(1)?).copied()
    }

    /// The Exif value, 1 to 8.
    #[must_use]
    pub fn to_exif(self) -> u8 {
        self as u8
    }

    /// The size of a picture of `width` x `height` pixels after turning: of the upright picture
    /// from that of the stored one, or the other way round.
    #[must_use]
    pub fn turned_size(self, width: u32, height: u32) -> (u32, u32) {
        if self.exchanges_axes() { (height, width) } else { (width, height) }
    }

    /// The region of the stored picture that becomes a region of the upright picture, which has
    /// `width` x `height` pixels.
    ///
    /// # Errors
    /// When the region is empty or not inside of the upright picture.
    pub fn stored_region(
        self,
        region: Region,
        width: u32,
        height: u32,
    ) -> Result<Region, RequestError> {
        if !region.is_inside(width, height) {
            return Err(RequestError::Region { region, width, height });
        }
        let whole = self.turned_size(width, height);
        let (width, height) = self.turned_size(region.width, region.height);
        let (x, y) = self.turned_size(region.x, region.y);
        let x = if self.mirrors_columns() { whole.0 - width - x } else { x };
        let y = if self.mirrors_rows() { whole.1 - height - y } else { y };
        Ok(Region { x, y, width, height })
    }

    /// Turns interleaved samples: height x width x channels, rows from the top. `width` is that of
    /// the samples as stored.
    ///
    /// # Panics
    /// When there are no channels, or the samples are no whole number of rows.
    #[must_use]
    pub fn apply<T: Copy>(self, samples: &[T], width: usize, channels: usize) -> Vec<T> {
        if samples.is_empty() {
            return Vec::new();
        }
        assert!(samples.len().is_multiple_of(width * channels), "no whole number of rows");
        let height = samples.len() / (width * channels);
        let (columns, rows) = if self.exchanges_axes() { (height, width) } else { (width, height) };
        let mut turned = Vec::with_capacity(samples.len());
        for row in 0..rows {
            for column in 0..columns {
                let (x, y) = if self.exchanges_axes() { (row, column) } else { (column, row) };
                let x = if self.mirrors_columns() { width - 1 - x } else { x };
                let y = if self.mirrors_rows() { height - 1 - y } else { y };
                turned.extend_from_slice(&samples[(y * width + x) * channels..][..channels]);
            }
        }
        turned
    }

    /// The orientation that turns a picture as this one and then the next one do.
    ///
    /// ```
    /// use image_gip::Orientation;
    ///
    /// let turned = Orientation::Rotate90.then(Orientation::FlipHorizontal);
    /// assert_eq!(turned, Orientation::Rotate90FlipH);
    /// ```
    #[must_use]
    pub fn then(self, next: Self) -> Self {
        let (columns, rows) = (next.mirrors_columns(), next.mirrors_rows());
        // What the next one mirrors, along the axes as stored.
        let (columns, rows) = if self.exchanges_axes() { (rows, columns) } else { (columns, rows) };
        let is_it = |both: &Self| {
            both.exchanges_axes() == (self.exchanges_axes() != next.exchanges_axes())
                && both.mirrors_columns() == (self.mirrors_columns() != columns)
                && both.mirrors_rows() == (self.mirrors_rows() != rows)
        };
        // They are a group: there always is one.
        Self::ALL.into_iter().find(is_it).unwrap_or(self)
    }

    /// Turns a Gaussian of a picture of `width` x `height` pixels as stored. Where rows stay rows, its shape is exact;
    /// all else is rounded to `f32`.
    #[cfg(feature = "encode")]
    #[must_use]
    pub fn apply_to_gaussian(self, gaussian: &Gaussian, width: f32, height: f32) -> Gaussian {
        let ([x, y], [l11, l21, l22]) = (gaussian.center, gaussian.cholesky);
        let x = if self.mirrors_columns() { width - x } else { x };
        let y = if self.mirrors_rows() { height - y } else { y };
        let l21 = if self.mirrors_columns() == self.mirrors_rows() { l21 } else { -l21 };
        if !self.exchanges_axes() {
            return Gaussian { center: [x, y], cholesky: [l11, l21, l22], ..*gaussian };
        }
        // The Cholesky factor of the covariance with its axes exchanged.
        let [l11, l21, l22] = [l11, l21, l22].map(f64::from);
        let extent = l21.hypot(l22);
        let cholesky = [extent, l11 * l21 / extent, l11 * l22 / extent].map(|entry| entry as f32);
        Gaussian { center: [y, x], cholesky, ..*gaussian }
    }

    /// Whether rows as stored are columns of the upright picture.
    fn exchanges_axes(self) -> bool {
        use Orientation::{Rotate90, Rotate90FlipH, Rotate270, Rotate270FlipH};
        matches!(self, Rotate90FlipH | Rotate90 | Rotate270FlipH | Rotate270)
    }

    /// Whether the first column as stored comes last.
    fn mirrors_columns(self) -> bool {
        use Orientation::{FlipHorizontal, Rotate180, Rotate270, Rotate270FlipH};
        matches!(self, FlipHorizontal | Rotate180 | Rotate270FlipH | Rotate270)
    }

    /// Whether the first row as stored comes last.
    fn mirrors_rows(self) -> bool {
        use Orientation::{FlipVertical, Rotate90, Rotate180, Rotate270FlipH};
        matches!(self, Rotate180 | FlipVertical | Rotate90 | Rotate270FlipH)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// A picture of two columns and three rows in each orientation, as its rows.
    const TURNED: [&str; 8] = [
        "ab cd ef", "ba dc fe", "fe dc ba", "ef cd ab", "ace bdf", "eca fdb", "fdb eca", "bdf ace",
    ];

    fn turned(orientation: Orientation) -> Vec<u8> {
        orientation.apply(b"abcdef", 2, 1)
    }

    #[test]
    fn samples_are_turned_as_exif_says() {
        for (orientation, rows) in Orientation::ALL.into_iter().zip(TURNED) {
            let name = alloc::format!("{orientation:?}");
            assert_eq!(turned(orientation), rows.replace(' ', "").as_bytes(), "{name}");
            let columns = orientation.turned_size(2, 3).0 as usize;
            assert_eq!(rows.find(' '), Some(columns), "{name}");
            assert_eq!(Orientation::from_exif(orientation.to_exif()), Some(orientation));
        }
        assert_eq!([0, 9, 255].map(Orientation::from_exif), [None; 3]);
        assert!(Orientation::Rotate90.apply::<u16>(&[], 0, 3).is_empty());
    }

    #[test]
    fn one_orientation_after_another_is_one() {
        for first in Orientation::ALL {
            for next in Orientation::ALL {
                let columns = first.turned_size(2, 3).0 as usize;
                let expected = next.apply(&turned(first), columns, 1);
                assert_eq!(turned(first.then(next)), expected, "{first:?} {next:?}");
            }
        }
    }

    #[cfg(feature = "encode")]
    #[test]
    fn gaussians_are_turned_as_samples_are() {
        let stored = Gaussian {
            center: [3.25, 1.5],
            cholesky: [2.0, -0.75, 0.5],
            color: [0.25, -0.5, 0.0, 0.0],
        };
        let q = |gaussian: &Gaussian, x: usize, y: usize| {
            let [dx, dy] =
                [x as f32 + 0.5 - gaussian.center[0], y as f32 + 0.5 - gaussian.center[1]];
            let [xx, xy, yy] = gaussian.conic();
            xx * dx * dx + 2.0 * xy * dx * dy + yy * dy * dy
        };
        let distances = |gaussian: &Gaussian, width: usize, height: usize| {
            let place = |at: usize| q(gaussian, at % width, at / width);
            (0..width * height).map(place).collect::<Vec<_>>()
        };
        for orientation in Orientation::ALL {
            let gaussian = orientation.apply_to_gaussian(&stored, 7.0, 5.0);
            let (width, height) = orientation.turned_size(7, 5);
            let found = distances(&gaussian, width as usize, height as usize);
            let expected = orientation.apply(&distances(&stored, 7, 5), 7, 1);
            for (found, expected) in found.iter().zip(&expected) {
                assert!((found / expected - 1.0).abs() < 1e-5, "{orientation:?}");
            }
            assert_eq!(gaussian.color, stored.color);
        }
    }

    #[test]
    fn pixels_stay_whole() {
        let stored = [1, 2, 3, 4, 5, 6, 7, 8, 9, 10, 11, 12];
        let turned = Orientation::Rotate90.apply(&stored, 2, 3);
        assert_eq!(turned, [7, 8, 9, 1, 2, 3, 10, 11, 12, 4, 5, 6]);
    }

    /// A region of samples that are `width` wide.
    fn cut(samples: &[u8], width: u32, region: Region) -> Vec<u8> {
        let Region { x, y, width: columns, height: rows } = region;
        let row = |row| &samples[(row * width + x) as usize..][..columns as usize];
        (y..y + rows).map(row).collect::<Vec<_>>().concat()
    }

    #[test]
    fn a_region_of_the_stored_picture_becomes_that_of_the_upright_one() {
        for orientation in Orientation::ALL {
            let (width, height) = orientation.turned_size(2, 3);
            for (x, y) in (0..width).flat_map(|x| (0..height).map(move |y| (x, y))) {
                for (columns, rows) in [(1, 1), (2, 1), (1, 2), (2, 2), (width, height)] {
                    let region = Region { x, y, width: columns, height: rows };
                    let Ok(stored) = orientation.stored_region(region, width, height) else {
                        assert!(x + columns > width || y + rows > height);
                        continue;
                    };
                    let part = cut(b"abcdef", 2, stored);
                    let part = orientation.apply(&part, stored.width as usize, 1);
                    assert_eq!(part, cut(&turned(orientation), width, region), "{orientation:?}");
                }
            }
        }
    }

    #[test]
    fn a_region_outside_is_refused() {
        for (x, width) in [(0, 4), (3, 1), (u32::MAX, u32::MAX), (0, 0)] {
            let region = Region { x, y: 0, width, height: 1 };
            let error = RequestError::Region { region, width: 3, height: 2 };
            assert_eq!(Orientation::Rotate90.stored_region(region, 3, 2), Err(error));
        }
    }
}
