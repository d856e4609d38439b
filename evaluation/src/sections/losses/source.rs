//! What a picture is made of, in three figures.

use crate::pictures::TestPicture;

/// Figures of a source.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct Source {
    /// The share of pixels that equal their right and their lower neighbour.
    pub(super) flat: f64,
    /// The share of pixels whose luma differs from the right or the lower neighbour's by at least
    /// [`EDGE`].
    pub(super) edges: f64,
    /// The standard deviation of noise that would explain half of the finest detail, in levels of
    /// 255: the median of the magnitudes of Haar's diagonal coefficients by 0.6745.
    pub(super) grain: f64,
}

/// In levels of 255.
pub(super) const EDGE: f64 = 32.0;
/// The median of the magnitude of a normal variable of deviation 1.
const MEDIAN_OF_NORMAL: f64 = 0.6745;

impl Source {
    pub(super) const NAMES: [&str; 3] = ["flat", "edges", "grain"];

    pub(super) fn of(picture: &TestPicture) -> Self {
        let (width, height) = (picture.width as usize, picture.height as usize);
        let pixel = |x: usize, y: usize| &picture.rgb[3 * (y * width + x)..][..3];
        let luma = |x: usize, y: usize| {
            let [r, g, b] = [0, 1, 2].map(|channel| f64::from(pixel(x, y)[channel]));
            0.299 * r + 0.587 * g + 0.114 * b
        };
        let (mut flat, mut edges, mut diagonals) = (0, 0, Vec::new());
        for y in 0..height.saturating_sub(1) {
            for x in 0..width.saturating_sub(1) {
                let here = pixel(x, y);
                flat += usize::from(here == pixel(x + 1, y) && here == pixel(x, y + 1));
                let (a, b, c) = (luma(x, y), luma(x + 1, y), luma(x, y + 1));
                edges += usize::from((a - b).abs().max((a - c).abs()) >= EDGE);
                if x % 2 == 0 && y % 2 == 0 {
                    diagonals.push((a - b - c + luma(x + 1, y + 1)).abs() / 2.0);
                }
            }
        }
        let all = (width.saturating_sub(1) * height.saturating_sub(1)).max(1) as f64;
        diagonals.sort_by(f64::total_cmp);
        let median = diagonals.get(diagonals.len() / 2).copied().unwrap_or(0.0);
        Self {
            flat: flat as f64 / all,
            edges: edges as f64 / all,
            grain: median / MEDIAN_OF_NORMAL,
        }
    }

    pub(super) fn values(&self) -> [f64; 3] {
        [self.flat, self.edges, self.grain]
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn picture(pixel: impl Fn(u32, u32) -> u8) -> TestPicture {
        let side = 64;
        let grays = (0..side * side).map(|i| pixel(i % side, i / side));
        let rgb = grays.flat_map(|gray| [gray; 3]).collect();
        TestPicture { name: String::new(), path: "".into(), width: side, height: side, rgb }
    }

    #[test]
    fn flat_pictures_and_edges_are_told_apart() {
        assert_eq!(Source::of(&picture(|_, _| 7)).values(), [1.0, 0.0, 0.0]);
        let step = Source::of(&picture(|x, _| if x < 32 { 0 } else { 200 }));
        assert_eq!(step.values(), [62.0 / 63.0, 1.0 / 63.0, 0.0]);
    }

    #[test]
    fn grain_is_the_deviation_of_noise() {
        let mut random = fastrand::Rng::with_seed(1);
        // The sum of twelve uniform numbers is almost normal, with deviation 1.
        let normal: Vec<f64> =
            (0..64 * 64).map(|_| (0..12).map(|_| random.f64()).sum::<f64>() - 6.0).collect();
        let noisy = picture(|x, y| (128.0 + 8.0 * normal[(y * 64 + x) as usize]).round() as u8);
        let grain = Source::of(&noisy).grain;
        assert!((grain - 8.0).abs() < 0.6, "{grain}");
    }
}
