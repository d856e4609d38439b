//! Figures that see texture: they compare what is around a place, not what is at it. A picture with
//! other grains of the same strength and size is good by them, and one without grains is bad.
//!
//! All are about luma, `0.299 R + 0.587 G + 0.114 B` of the sRGB samples, from 0 to 255. Windows are
//! Gaussian, up to three deviations, and pictures are continued in mirror images.

use std::array;

/// Octaves of the local deviations, from the finest.
const OCTAVES: usize = 3;
/// The window of the finest octave has this deviation in pixels, and that of each further one
/// `sqrt(2)` times as much: enough waves for a deviation, and few enough that a wall does not lend its
/// texture to the sky.
const WINDOW: f64 = 6.0;
/// Added to both deviations that are compared, in levels of 255: what is much smaller is not seen,
/// so flat areas do not count.
const FLOOR: f32 = 2.0;

/// Octaves of the Wasserstein distortion, from the finest.
const DERIVATIVE_OCTAVES: usize = 4;
/// The deviation of its window in pixels of the picture. What varies more slowly is compared place by
/// place; what varies faster, by how much it varies.
const POOLING: f64 = 4.0;
/// The directions of its derivatives, as steps to a neighbour.
const DIRECTIONS: [(isize, isize); 4] = [(1, 0), (1, 1), (0, 1), (-1, 1)];

/// How far the amount of texture is from the source's: the mean of `|log2|` of the ratio of local
/// deviations, over all pixels and three octaves. 0 is as much texture everywhere as in the source.
///
/// The octaves are differences of the picture blurred with deviations of 0, 1, 2 and 4 pixels, so
/// they are about 0.3, 0.15 and 0.08 cycles a pixel. A deviation is the root of the mean square in
/// a window ([`WINDOW`]); [`FLOOR`] is added to it.
pub(crate) fn deviation_error(source: &[u8], decoded: &[u8], width: u32) -> f64 {
    let deviations = |samples: &[u8]| local_deviations(&Plane::luma(samples, width));
    let (source, decoded) = (deviations(source), deviations(decoded));
    let pairs = source.iter().zip(&decoded);
    mean(pairs.map(|(source, decoded)| {
        source.mean_with(decoded, |s, d| ((d + FLOOR) / (s + FLOOR)).log2().abs())
    }))
}

fn local_deviations(luma: &Plane) -> [Plane; OCTAVES] {
    let mut fine = luma.clone();
    array::from_fn(|octave| {
        let coarse = luma.blurred(f64::from(1 << octave));
        let band = fine.with(&coarse, |fine, coarse| fine - coarse);
        fine = coarse;
        let window = WINDOW * 2_f64.powf(octave as f64 / 2.0);
        band.map(|sample| sample * sample).blurred(window).map(f32::sqrt)
    })
}

/// A Wasserstein distortion, in levels of 255: 0 for equal pictures.
///
/// The picture is halved three times, which makes four octaves. In each, derivatives in four
/// directions have at each place a mean and a deviation in a window ([`POOLING`]). As if they were
/// normal distributions, those of both pictures are apart by the root of the squared differences of
/// means and deviations; the distortion is the mean over places, directions and octaves.
pub(crate) fn wasserstein_distortion(source: &[u8], decoded: &[u8], width: u32) -> f64 {
    let (mut source, mut decoded) = (Plane::luma(source, width), Plane::luma(decoded, width));
    mean((0..DERIVATIVE_OCTAVES).map(|octave| {
        if octave > 0 {
            (source, decoded) = (source.halved(), decoded.halved());
        }
        let window = POOLING / f64::from(1 << octave);
        mean(DIRECTIONS.map(|direction| {
            let [source, decoded] = [&source, &decoded].map(|plane| {
                let derivative = plane.derivative(direction);
                let mean = derivative.blurred(window);
                let square = derivative.map(|sample| sample * sample).blurred(window);
                let deviation =
                    square.with(&mean, |square, mean| (square - mean * mean).max(0.0).sqrt());
                (mean, deviation)
            });
            let means = source.0.with(&decoded.0, |s, d| s - d);
            let deviations = source.1.with(&decoded.1, |s, d| s - d);
            means.mean_with(&deviations, f32::hypot)
        }))
    }))
}

fn mean(values: impl IntoIterator<Item = f64>) -> f64 {
    crate::table::mean(values).expect("there are octaves and directions")
}

/// One channel of a picture.
#[derive(Clone, Debug)]
struct Plane {
    width: usize,
    samples: Vec<f32>,
}

impl Plane {
    fn luma(rgb: &[u8], width: u32) -> Self {
        let luma = |rgb: &[u8]| {
            let [r, g, b] = [rgb[0], rgb[1], rgb[2]].map(f32::from);
            0.299 * r + 0.587 * g + 0.114 * b
        };
        Self { width: width as usize, samples: rgb.chunks_exact(3).map(luma).collect() }
    }

    fn height(&self) -> usize {
        self.samples.len() / self.width
    }

    fn map(mut self, of: impl Fn(f32) -> f32) -> Self {
        self.samples.iter_mut().for_each(|sample| *sample = of(*sample));
        self
    }

    fn with(&self, other: &Self, of: impl Fn(f32, f32) -> f32) -> Self {
        let pairs = self.samples.iter().zip(&other.samples);
        Self { width: self.width, samples: pairs.map(|(&a, &b)| of(a, b)).collect() }
    }

    fn mean_with(&self, other: &Self, of: impl Fn(f32, f32) -> f32) -> f64 {
        let pairs = self.samples.iter().zip(&other.samples);
        pairs.map(|(&a, &b)| f64::from(of(a, b))).sum::<f64>() / self.samples.len() as f64
    }

    /// Half of the difference of a place's neighbours, divided by the length of the step.
    fn derivative(&self, (dx, dy): (isize, isize)) -> Self {
        let (width, height) = (self.width as isize, self.height() as isize);
        let scale = 0.5 / ((dx * dx + dy * dy) as f32).sqrt();
        let at = |x, y| self.samples[mirror(y, height) * self.width + mirror(x, width)];
        let samples = (0..height).flat_map(|y| {
            (0..width).map(move |x| scale * (at(x + dx, y + dy) - at(x - dx, y - dy)))
        });
        Self { width: self.width, samples: samples.collect() }
    }

    /// Every second sample of every second row, after a blur that leaves little to alias.
    fn halved(&self) -> Self {
        let blurred = self.blurred(1.0);
        let rows = blurred.samples.chunks_exact(self.width).step_by(2);
        let samples = rows.flat_map(|row| row.iter().copied().step_by(2)).collect();
        Self { width: self.width.div_ceil(2), samples }
    }

    /// Blurred by a Gaussian.
    fn blurred(&self, deviation: f64) -> Self {
        let radius = (3.0 * deviation).ceil() as isize;
        let weight = |at: isize| (-0.5 * (at as f64 / deviation).powi(2)).exp();
        let sum: f64 = (-radius..=radius).map(weight).sum();
        let weights: Vec<f32> = (-radius..=radius).map(|at| (weight(at) / sum) as f32).collect();
        let (width, height) = (self.width, self.height() as isize);
        let mut vertical = vec![0.0; self.samples.len()];
        for (y, out) in vertical.chunks_exact_mut(width).enumerate() {
            for (index, weight) in weights.iter().enumerate() {
                let row = mirror(y as isize + index as isize - radius, height) * width;
                add(out, &self.samples[row..row + width], *weight);
            }
        }
        let mut samples = vec![0.0; self.samples.len()];
        for (row, out) in vertical.chunks_exact(width).zip(samples.chunks_exact_mut(width)) {
            let longer = -radius..width as isize + radius;
            let longer: Vec<f32> = longer.map(|x| row[mirror(x, width as isize)]).collect();
            for (index, weight) in weights.iter().enumerate() {
                add(out, &longer[index..index + width], *weight);
            }
        }
        Self { width, samples }
    }
}

fn add(sums: &mut [f32], samples: &[f32], weight: f32) {
    sums.iter_mut().zip(samples).for_each(|(sum, sample)| *sum += weight * sample);
}

/// The place within a side that shows a place beyond it.
fn mirror(at: isize, side: isize) -> usize {
    let at = at.rem_euclid(2 * side);
    at.min(2 * side - 1 - at) as usize
}

#[cfg(test)]
mod tests {
    use image_gip::metrics;

    use super::*;

    const WIDTH: u32 = 128;

    /// A ramp with an edge; `grain` is added in the right half.
    fn picture(mut grain: impl FnMut() -> f32) -> Vec<u8> {
        let (width, height) = (WIDTH as usize, 96);
        let mut rgb = Vec::new();
        for (y, x) in (0..height).flat_map(|y| (0..width).map(move |x| (y, x))) {
            let scene = 80.0 + x as f32 * 0.3 + if y > 40 { 30.0 } else { 0.0 };
            let sample = scene + if x > width / 2 { grain() } else { 0.0 };
            rgb.extend([sample.round() as u8; 3]);
        }
        rgb
    }

    fn noise(seed: u64, strength: f32) -> impl FnMut() -> f32 {
        let mut random = fastrand::Rng::with_seed(seed);
        move || strength * (random.f32() - 0.5)
    }

    fn figures(source: &[u8], decoded: &[u8]) -> [f64; 2] {
        [deviation_error, wasserstein_distortion].map(|figure| figure(source, decoded, WIDTH))
    }

    #[test]
    fn equal_pictures_are_perfect_at_any_size() {
        let source = picture(noise(1, 60.0));
        assert_eq!(figures(&source, &source), [0.0; 2]);
        for width in [1, 2, 7] {
            let source = &source[..3 * 2 * width as usize];
            assert_eq!(deviation_error(source, source, width), 0.0);
            assert_eq!(wasserstein_distortion(source, source, width), 0.0);
        }
    }

    #[test]
    fn other_grains_are_better_than_none_though_psnr_says_the_opposite() {
        let source = picture(noise(1, 60.0));
        let (other, smooth) = (picture(noise(2, 60.0)), picture(|| 0.0));
        let psnr = |decoded: &[u8]| metrics::psnr(&source, decoded, 255.0);
        assert!(psnr(&smooth) > psnr(&other) + 2.0);
        for (other, smooth) in figures(&source, &other).iter().zip(figures(&source, &smooth)) {
            assert!(2.0 * other < smooth, "{other} {smooth}");
        }
    }

    #[test]
    fn too_much_texture_is_as_wrong_as_too_little() {
        let figures = |strength| figures(&picture(noise(1, 40.0)), &picture(noise(2, strength)));
        let (weak, right, strong) = (figures(20.0), figures(40.0), figures(80.0));
        for index in 0..2 {
            assert!(right[index] < weak[index].min(strong[index]));
        }
    }

    #[test]
    fn what_is_too_weak_to_be_seen_hardly_counts() {
        let source = picture(|| 0.0);
        let [weak, strong] =
            [2.0, 40.0].map(|strength| figures(&source, &picture(noise(1, strength))));
        for index in 0..2 {
            assert!(weak[index] < 0.1 * strong[index], "{weak:?} {strong:?}");
        }
    }

    #[test]
    fn a_structure_that_moved_is_a_distortion() {
        // Eight pixels are more than the window of the means; deviations are as before.
        let source = picture(|| 0.0);
        let mut moved = source.clone();
        moved.rotate_right(8 * 3 * WIDTH as usize);
        assert!(wasserstein_distortion(&source, &moved, WIDTH) > 0.5);
    }

    #[test]
    fn a_blur_keeps_the_mean_and_mirrors_the_edges() {
        let plane = Plane { width: 5, samples: vec![7.0; 15] };
        assert!(plane.blurred(4.0).samples.iter().all(|sample| (sample - 7.0).abs() < 1e-4));
        assert_eq!([-3, -1, 0, 2, 3, 5, 6].map(|at| mirror(at, 3)), [2, 0, 0, 2, 2, 0, 0]);
        assert_eq!(plane.halved().samples.len(), 6);
    }
}
