//! Measures of the difference between two pictures: PSNR, MS-SSIM, largest error.
//!
//! All functions take interleaved samples of `u8`, `u16`, `f32` or any other type that converts to
//! `f64`, and compute in `f64`.

use crate::color::ColorModel;

/// Standard deviation of the Gaussian window of SSIM, in pixels.
const SIGMA: f64 = 1.5;
/// Taps of the Gaussian window of SSIM along each axis.
const WINDOW: usize = 11;
/// The constants that keep SSIM's quotients stable, relative to a full sample.
const K1: f64 = 0.01;
const K2: f64 = 0.03;
/// The exponents of the five scales of MS-SSIM, finest first (Wang, Simoncelli and Bovik, 2003).
const SCALE_WEIGHTS: [f64; 5] = [0.0448, 0.2856, 0.3001, 0.2363, 0.1333];

/// Peak signal-to-noise ratio in dB, over all samples of all channels. `full_scale` is the value of
/// a full sample: 255.0, 65535.0 or 1.0. Infinite if the pictures are identical.
///
/// ```
/// assert_eq!(image_gip::metrics::psnr(&[0_u8, 255], &[0, 255], 255.0), f64::INFINITY);
/// assert_eq!(image_gip::metrics::psnr(&[0_u8, 0], &[255, 255], 255.0), 0.0);
/// ```
///
/// # Panics
/// When the pictures are empty or differ in length.
#[must_use]
pub fn psnr<T: Copy + Into<f64>>(a: &[T], b: &[T], full_scale: f64) -> f64 {
    check(a, b);
    let squares: f64 = a.iter().zip(b).map(|(&a, &b)| (a.into() - b.into()).powi(2)).sum();
    10.0 * (full_scale * full_scale * a.len() as f64 / squares).log10()
}

/// The largest absolute difference of two samples, in the unit of the samples.
///
/// # Panics
/// When the pictures are empty or differ in length.
#[must_use]
pub fn max_abs_error<T: Copy + Into<f64>>(a: &[T], b: &[T]) -> f64 {
    check(a, b);
    a.iter().zip(b).map(|(&a, &b)| (a.into() - b.into()).abs()).fold(0.0, f64::max)
}

/// Multi-scale structural similarity (MS-SSIM), from 0 to 1, which is that of identical pictures.
/// It is the mean over the channels; alpha counts like any other. Pictures have rows of `width`
/// pixels of `channels` samples, and `full_scale` is the value of a full sample: 255.0, 65535.0 or
/// 1.0.
///
/// The definition is that of the Python package `pytorch_msssim`: a Gaussian window of 11 taps and
/// standard deviation 1.5 without padding, and five scales. From one scale to the next, 2 x 2
/// pixels are averaged; along an odd side, the first pair begins one pixel before the picture, with
/// zeros.
///
/// Five scales need sides of more than 160 pixels. For a smaller picture, only the scales are used
/// whose shorter side is more than 10 pixels, but at least one scale. Their weights are multiplied
/// so that their sum is that of all five. Along a side of less than 11 pixels, the window has the
/// largest odd number of taps that fits.
///
/// # Panics
/// When the pictures are empty or differ in length, or when the length is not a whole number of
/// rows.
#[must_use]
pub fn ms_ssim<T: Copy + Into<f64>>(
    a: &[T],
    b: &[T],
    width: usize,
    channels: usize,
    full_scale: f64,
) -> f64 {
    check(a, b);
    assert!(
        a.len().checked_rem(width * channels) == Some(0),
        "{} samples are no rows of {width} pixels of {channels} samples",
        a.len()
    );
    let scales = scales(width, a.len() / (width * channels));
    let channel = |samples: &[T], channel| Plane {
        width,
        samples: samples.iter().skip(channel).step_by(channels).map(|&s| s.into()).collect(),
    };
    let sum: f64 = (0..channels)
        .map(|c| ms_ssim_of_planes(channel(a, c), channel(b, c), scales, full_scale))
        .sum();
    sum / channels as f64
}

/// The samples of a picture as they show: colours times their alpha, if there is one. `full_scale` is the
/// value of a full sample: 255.0, 65535.0 or 1.0.
///
/// ```
/// use image_gip::{ColorModel, metrics};
///
/// let shown = metrics::premultiplied(&[200_u8, 51, 30, 0], ColorModel::GrayAlpha, 255.0);
/// assert_eq!(shown, [40.0, 51.0, 0.0, 0.0]);
/// ```
#[must_use]
pub fn premultiplied<T: Copy + Into<f64>>(
    samples: &[T],
    color: ColorModel,
    full_scale: f64,
) -> Vec<f64> {
    let mut samples: Vec<f64> = samples.iter().map(|&sample| sample.into()).collect();
    if color.has_alpha() {
        for pixel in samples.chunks_exact_mut(color.channels()) {
            if let Some((alpha, colors)) = pixel.split_last_mut() {
                colors.iter_mut().for_each(|sample| *sample *= *alpha / full_scale);
            }
        }
    }
    samples
}

fn check<T>(a: &[T], b: &[T]) {
    assert!(!a.is_empty(), "pictures without samples cannot be compared");
    assert_eq!(a.len(), b.len(), "pictures of different sizes cannot be compared");
}

/// The number of scales for a size: as many as have room for the window, but at least one.
fn scales(width: usize, height: usize) -> usize {
    let side = width.min(height);
    (1..=SCALE_WEIGHTS.len()).rev().find(|&n| side > (WINDOW - 1) << (n - 1)).unwrap_or(1)
}

/// MS-SSIM of one channel.
fn ms_ssim_of_planes(mut a: Plane, mut b: Plane, scales: usize, full_scale: f64) -> f64 {
    let weights = &SCALE_WEIGHTS[..scales];
    // With all five scales this is 1: their published weights, whose sum is 1.0001, are not
    // changed.
    let correction = SCALE_WEIGHTS.iter().sum::<f64>() / weights.iter().sum::<f64>();
    let mut product = 1.0;
    for (scale, weight) in weights.iter().enumerate() {
        let (ssim, contrast) = ssim(&a, &b, full_scale);
        let factor = if scale + 1 < scales { contrast } else { ssim };
        product *= factor.max(0.0).powf(weight * correction);
        if scale + 1 < scales {
            (a, b) = (a.halved(), b.halved());
        }
    }
    product
}

/// One channel of a picture.
struct Plane {
    width: usize,
    samples: Vec<f64>,
}

impl Plane {
    fn height(&self) -> usize {
        self.samples.len() / self.width
    }

    /// Means of 2 x 2 pixels. Along an odd side, the first pair begins at -1, where samples are
    /// zero.
    fn halved(&self) -> Self {
        let (odd_x, odd_y) = (self.width % 2, self.height() % 2);
        let width = self.width.div_ceil(2);
        let mut samples = vec![0.0; width * self.height().div_ceil(2)];
        for (y, row) in self.samples.chunks_exact(self.width).enumerate() {
            let out = &mut samples[(y + odd_y) / 2 * width..][..width];
            for (x, &sample) in row.iter().enumerate() {
                out[(x + odd_x) / 2] += 0.25 * sample;
            }
        }
        Self { width, samples }
    }
}

/// The means of SSIM and of its contrast-and-structure factor, over all positions of the window.
///
/// Rows are filtered horizontally once. A ring buffer keeps as many of them as the window is high,
/// so that memory does not grow with the height of the picture.
fn ssim(a: &Plane, b: &Plane, full_scale: f64) -> (f64, f64) {
    let (c1, c2) = ((K1 * full_scale).powi(2), (K2 * full_scale).powi(2));
    let (across, down) = (window(a.width), window(a.height()));
    let width = a.width + 1 - across.len();
    // The filtered means of a, b, aa, bb and ab.
    let mut ring = vec![[(); 5].map(|()| vec![0.0; width]); down.len()];
    let mut moments = [(); 5].map(|()| vec![0.0; width]);
    let (mut sum, mut contrast_sum) = (0.0, 0.0);
    let rows = a.samples.chunks_exact(a.width).zip(b.samples.chunks_exact(a.width));
    for (y, (a, b)) in rows.enumerate() {
        let products =
            |a: &[f64], b: &[f64]| -> Vec<f64> { a.iter().zip(b).map(|(a, b)| a * b).collect() };
        let slot = &mut ring[y % down.len()];
        filter_row(a, &across, &mut slot[0]);
        filter_row(b, &across, &mut slot[1]);
        filter_row(&products(a, a), &across, &mut slot[2]);
        filter_row(&products(b, b), &across, &mut slot[3]);
        filter_row(&products(a, b), &across, &mut slot[4]);
        let Some(first) = (y + 1).checked_sub(down.len()) else { continue };
        for (moment, out) in moments.iter_mut().enumerate() {
            out.fill(0.0);
            for (tap, weight) in down.iter().enumerate() {
                add_scaled(out, &ring[(first + tap) % down.len()][moment], *weight);
            }
        }
        let [a, b, aa, bb, ab] = &moments;
        for x in 0..width {
            let (aa, bb) = (aa[x] - a[x] * a[x], bb[x] - b[x] * b[x]);
            let (means, ab) = (a[x] * b[x], ab[x] - a[x] * b[x]);
            let contrast = (2.0 * ab + c2) / (aa + bb + c2);
            let luminance = (2.0 * means + c1) / (a[x] * a[x] + b[x] * b[x] + c1);
            sum += luminance * contrast;
            contrast_sum += contrast;
        }
    }
    let windows = (width * (a.height() + 1 - down.len())) as f64;
    (sum / windows, contrast_sum / windows)
}

/// The Gaussian window along a side: 11 taps, or the largest odd number that fits.
fn window(side: usize) -> Vec<f64> {
    let taps = WINDOW.min(side - (side + 1) % 2);
    let middle = (taps / 2) as f64;
    let weights =
        (0..taps).map(|tap| (-(tap as f64 - middle).powi(2) / (2.0 * SIGMA * SIGMA)).exp());
    let weights: Vec<f64> = weights.collect();
    let total: f64 = weights.iter().sum();
    weights.iter().map(|weight| weight / total).collect()
}

/// Filters a row at the positions where the whole window fits: `out` is shorter than `row` by the
/// number of taps minus one.
fn filter_row(row: &[f64], weights: &[f64], out: &mut [f64]) {
    out.fill(0.0);
    for (tap, &weight) in weights.iter().enumerate() {
        add_scaled(out, &row[tap..], weight);
    }
}

fn add_scaled(out: &mut [f64], row: &[f64], weight: f64) {
    for (out, value) in out.iter_mut().zip(row) {
        *out += value * weight;
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// A computed picture: ramps, parabolas and checkers, with noise that depends on the seed.
    /// Samples have 8 bits, or 16 if `deep`.
    fn picture(size: [usize; 3], seed: usize, noise: usize, deep: bool) -> Vec<u16> {
        let [width, height, channels] = size;
        let mut samples = Vec::with_capacity(width * height * channels);
        for y in 0..height {
            for x in 0..width {
                for c in 0..channels {
                    let base = (x * (3 + c) + y * y / 7 + (x / 9 + y / 13) % 2 * 90) % 256;
                    let hash = x * 7919 + y * 104_729 + c * 1_299_709 + seed * 15_485_863;
                    let sample = base + hash % 1009 % (noise + 1);
                    let sample = sample.saturating_sub(noise / 2).min(255);
                    let spread = (x * 31 + y * 17) % 200 * seed;
                    samples
                        .push(if deep { sample * 257 + spread } else { sample }.min(65535) as u16);
                }
            }
        }
        samples
    }

    #[test]
    fn agrees_with_an_independent_implementation() {
        // Computed with NumPy: a dense two-dimensional window, padding, and means by reshaping.
        for (size, noise, deep, expected_psnr, expected_ms_ssim, expected_error) in [
            ([256, 192, 3], 60, false, 23.505_763_368_3, 0.992_920_195_920, 30.0),
            ([177, 161, 1], 200, false, 13.808_797_111_8, 0.914_719_776_509, 100.0),
            ([163, 175, 2], 90, true, 20.119_513_223_4, 0.987_369_805_792, 11764.0),
            ([90, 47, 3], 60, false, 23.487_593_791_8, 0.985_864_505_989, 30.0),
            ([23, 9, 1], 120, false, 17.992_604_102_3, 0.489_925_821_583, 60.0),
            ([12, 4, 4], 40, false, 27.049_700_791_9, 0.788_329_482_564, 20.0),
            ([1, 6, 1], 100, false, 44.451_035_755_7, 0.890_999_434_748, 3.0),
            ([1, 1, 3], 60, false, 23.654_056_197_9, 0.669_222_936_013, 29.0),
        ] {
            let a = picture(size, 0, 0, deep);
            let b = picture(size, 1, noise, deep);
            let full_scale = if deep { 65535.0 } else { 255.0 };
            let psnr = psnr(&a, &b, full_scale);
            assert!((psnr - expected_psnr).abs() < 1e-9, "{size:?}: {psnr}");
            let ms_ssim = ms_ssim(&a, &b, size[0], size[2], full_scale);
            assert!((ms_ssim - expected_ms_ssim).abs() < 1e-9, "{size:?}: {ms_ssim}");
            assert_eq!(max_abs_error(&a, &b), expected_error, "{size:?}");
        }
    }

    #[test]
    fn opposites_and_copies() {
        let a = picture([200, 170, 1], 0, 0, false);
        let inverse: Vec<u16> = a.iter().map(|sample| 255 - sample).collect();
        assert_eq!(ms_ssim(&a, &inverse, 200, 1, 255.0), 0.0);
        assert_eq!(ms_ssim(&a, &a, 200, 1, 255.0), 1.0);
        assert_eq!(psnr(&a, &a, 255.0), f64::INFINITY);
        assert_eq!(max_abs_error(&a, &a), 0.0);
    }

    #[test]
    #[should_panic(expected = "no rows of 7 pixels")]
    fn a_width_that_does_not_divide_the_picture_is_refused() {
        let _ = ms_ssim(&[0_u8; 12], &[0; 12], 7, 1, 255.0);
    }
}
