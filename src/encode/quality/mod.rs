//! An estimate of the visual quality of a rendering, on the scale of SSIMULACRA2.
//!
//! SSIMULACRA2 (<https://github.com/cloudinary/ssimulacra2>) adds up 108 norms of differences in three
//! channels on six scales, with weights that were fitted to what people said. The nine norms that are
//! measured here make up 93 % of the sum on photographs, and the estimate takes them for all of it: on
//! the pictures of Kodak and photos it is within 2.3 of the metric.

mod difference;
mod light;
mod pyramid;
mod rows;

use fearless_simd::{Level, dispatch};
use rayon::prelude::*;

use super::error::EncodeError;
use super::progress::Observer;
use super::sensitivity::SCALES;
use super::source::Source;
use super::strips;
use crate::region::Region;
use crate::render::Picture;
use difference::{RADIUS, Sums, differences};
use light::Strip;
use pyramid::ROWS;
use rows::Rows;

/// The sum of all norms of SSIMULACRA2, as a factor on those that are measured.
const UNMEASURED: f64 = 1.07;
/// The highest quality that is aimed at. People see no difference from 90 on.
pub(crate) const MOST_QUALITY: f64 = 97.0;

/// Most Gaussians per pixel that are tried first.
const MOST_DENSITY: f64 = 0.25;

/// How much a picture that is rendered at the source's size differs from the source to the eye, on an
/// open scale from 0. It is about proportional to the squared error.
///
/// # Errors
/// [`EncodeError::Cancelled`] when the caller cancels.
pub(crate) fn dissimilarity(
    source: &Source<'_>,
    picture: &Picture<'_>,
    observer: &mut Observer<'_>,
) -> Result<f64, EncodeError> {
    let mut judgement = Judgement::new(source);
    strips::render(picture, u32::MAX, observer, |region, planes| judgement.see(region, planes))?;
    Ok(judgement.dissimilarity())
}

/// Size in bytes of what a judgement holds: a strip of the rendering, and rows of both pictures.
pub(crate) fn memory(source: &Source<'_>) -> usize {
    let (width, height) = (source.width(), source.height());
    let groups = strips::rows(width, height).div_ceil(ROWS);
    let scales = Judgement::new(source).scales;
    let rows = scales.iter().map(|scale| scale.rows.memory(groups, 2 * RADIUS));
    strips::memory(width, height, source.color().channels()) + rows.sum::<usize>()
}

/// A comparison of a rendering, which comes in strips from the top, with its source.
#[derive(Debug)]
pub(crate) struct Judgement<'a> {
    source: &'a Source<'a>,
    level: Level,
    scales: [Scale; pyramid::SCALES],
}

/// What is known of a rendering on one scale.
#[derive(Debug)]
struct Scale {
    rows: Rows,
    /// How many rows were compared, and the sums over them.
    compared: usize,
    sums: Sums,
}

impl<'a> Judgement<'a> {
    pub(crate) fn new(source: &'a Source<'a>) -> Self {
        let size = [source.width() as usize, source.height() as usize];
        let scales = core::array::from_fn(|scale| {
            let rows = Rows::new(size.map(|side| side.div_ceil(1 << scale)), ROWS >> scale);
            Scale { rows, compared: 0, sums: Sums::default() }
        });
        Self { source, level: Level::new(), scales }
    }

    /// Takes in the next strip, all columns of it: float samples, plane after plane. The number of its
    /// rows is a multiple of [`ROWS`], except at the bottom.
    pub(crate) fn see(&mut self, region: Region, planes: &[f32]) {
        let (source, level) = (self.source, self.level);
        let strip = Strip { model: source.color(), region, planes };
        let (first, rows) = (region.y as usize, region.height as usize);
        let blank: Vec<_> = (0..rows.div_ceil(ROWS))
            .map(|_| self.scales.each_mut().map(|scale| scale.rows.blank()))
            .collect();
        let filled = blank.into_par_iter().enumerate().map(|(index, mut groups)| {
            let size = [region.width as usize, ROWS.min(rows - index * ROWS)];
            let y = first + index * ROWS;
            dispatch!(level, simd => {
                pyramid::fill(simd, source, size, y, 0, &mut groups);
                pyramid::fill(simd, &strip, size, y, 1, &mut groups);
            });
            groups
        });
        for groups in filled.collect::<Vec<_>>() {
            for (scale, group) in self.scales.iter_mut().zip(groups) {
                scale.rows.push(group);
            }
        }
        self.compare();
    }

    /// Compares all rows whose surroundings are known.
    fn compare(&mut self) {
        let level = self.level;
        let ready = |scale: &Scale| {
            let known = scale.rows.known();
            if known == scale.rows.height { known } else { known.saturating_sub(RADIUS) }
        };
        let tasks: Vec<_> = (self.scales.iter().enumerate())
            .flat_map(|(index, scale)| (scale.compared..ready(scale)).map(move |y| (index, y)))
            .collect();
        let scales = &self.scales;
        let compared = tasks
            .par_iter()
            .map(|&(index, y)| dispatch!(level, simd => differences(simd, &scales[index].rows, y)));
        // Added row by row, so that the sums depend neither on the threads nor on the strips.
        for (sums, (index, y)) in compared.collect::<Vec<_>>().into_iter().zip(tasks) {
            let scale = &mut self.scales[index];
            scale.sums += sums;
            scale.compared = y + 1;
            scale.rows.forget((y + 1).saturating_sub(RADIUS));
        }
    }

    /// The dissimilarity, after the last strip: the weighted sum of norms that SSIMULACRA2 takes.
    pub(crate) fn dissimilarity(self) -> f64 {
        let mut sum = 0.0;
        for (index, scale) in self.scales.iter().enumerate() {
            // An L1 norm is a mean, an L4 norm the 4th root of a mean of 4th powers.
            let pixels = (scale.rows.width * scale.rows.height) as f64;
            let l4 = |sum: f64| (sum / pixels).sqrt().sqrt();
            let structure_l1 = scale.sums.structure / pixels;
            let structure_l4 = l4(scale.sums.structure_4);
            sum += match index {
                0 => 7.466_89 * structure_l4 + 17.445_83 * l4(scale.sums.lost_4),
                1 => 6.683_68 * structure_l4,
                2 => 225.205_15 * structure_l1 + 19.213_24 * structure_l4,
                3 => 176.393_18 * structure_l1 + 24.433_01 * structure_l4,
                _ => 95.108_05 * structure_l1 + 171.266_73 * l4(scale.sums.artifacts_4),
            };
        }
        0.956_238_26 * UNMEASURED * sum
    }
}

/// The quality at a dissimilarity, at most 100.
pub(crate) fn quality(dissimilarity: f64) -> f64 {
    let x = dissimilarity;
    let mapped = x * (2.326_765_64 + x * (-0.020_884_52 + x * 6.248_497e-5));
    100.0 - 10.0 * mapped.max(0.0).powf(0.627_633_65)
}

/// The dissimilarity at a quality from 0 to 100.
pub(crate) fn dissimilarity_at(quality_wanted: f64) -> f64 {
    let wanted = quality_wanted.min(MOST_QUALITY);
    // The quality falls with the dissimilarity, from 100 to less than 0.
    let (mut least, mut most) = (0.0, 30.0);
    for _ in 0..50 {
        let middle = 0.5 * (least + most);
        if quality(middle) > wanted { least = middle } else { most = middle }
    }
    0.5 * (least + most)
}

/// About how many Gaussians a picture needs for a dissimilarity, where `means` are the means of the
/// eye's sensitivity to it. It is a fit to photographs with 110 and 320 iterations, good to a factor of
/// 1.3 on average: texture, and above all fine texture, takes Gaussians.
pub(crate) fn count_for(dissimilarity: f64, pixels: usize, means: [f64; SCALES]) -> usize {
    let [fine, .., coarse] = means;
    let density = 0.5 * dissimilarity.powf(-0.83) * fine.powf(-4.5) * coarse.powf(3.35);
    // The cast saturates.
    ((pixels as f64 * density.min(MOST_DENSITY)) as usize).max(1)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::color::ColorModel;

    /// How much a rendering differs from a source, both of which are interleaved, if it comes in strips
    /// of so many rows.
    fn judged(
        [width, height]: [usize; 2],
        model: ColorModel,
        source: &[f32],
        rendering: &[f32],
        strip: usize,
    ) -> f64 {
        let samples: Vec<u16> = source.iter().map(|sample| (sample * 65535.0) as u16).collect();
        let source =
            Source::new_u16(width as u32, height as u32, model, &samples).expect("the sizes agree");
        let mut judgement = Judgement::new(&source);
        let channels = model.channels();
        let rows = rendering.chunks(strip * width * channels).enumerate();
        for (index, rows) in rows {
            let planes: Vec<f32> = (0..channels)
                .flat_map(|channel| rows.iter().skip(channel).step_by(channels).copied())
                .collect();
            let [y, height] = [index * strip, planes.len() / (channels * width)];
            let region = Region { x: 0, y: y as u32, width: width as u32, height: height as u32 };
            judgement.see(region, &planes);
        }
        judgement.dissimilarity()
    }

    #[test]
    fn noise_is_seen_on_even_ground_first() {
        let size = [96, 64];
        let mut rng = fastrand::Rng::with_seed(6);
        let mut noise = || rng.f32() - 0.5;
        // Even ground on the left, texture on the right.
        let source: Vec<f32> =
            (0..96 * 64).map(|at| if at % 96 < 48 { 0.5 } else { 0.5 + 0.6 * noise() }).collect();
        let mut with_noise = |left: bool, strength: f32| {
            let samples: Vec<f32> = (source.iter().enumerate())
                .map(|(at, sample)| {
                    let here = (at % 96 < 48) == left;
                    sample + if here { strength * noise() } else { 0.0 }
                })
                .collect();
            judged(size, ColorModel::Gray, &source, &samples, 64)
        };
        let (even, textured) = (with_noise(true, 0.05), with_noise(false, 0.05));
        assert!(even > 3.0 * textured, "{even}, {textured}");
        let strengths = [0.01, 0.03, 0.1].map(|strength| quality(with_noise(true, strength)));
        assert!(strengths.is_sorted_by(|a, b| a > b), "{strengths:?}");
    }

    #[test]
    fn every_model_and_size_has_a_quality() {
        for model in [ColorModel::Gray, ColorModel::GrayAlpha, ColorModel::Rgb, ColorModel::Rgba] {
            for size in [[1, 1], [5, 2], [33, 17], [300, 50]] {
                let mut rng = fastrand::Rng::with_seed(7);
                let length = size[0] * size[1] * model.channels();
                let samples: Vec<f32> = (0..length).map(|_| rng.f32()).collect();
                let other: Vec<f32> = samples.iter().map(|sample| 1.3 * sample - 0.2).collect();
                let same = judged(size, model, &samples, &samples, 16);
                assert!(same < 0.01, "{model:?} {size:?}: {same}");
                let found = judged(size, model, &samples, &other, 16);
                assert!(found.is_finite() && found > 0.01, "{model:?} {size:?}: {found}");
                for strip in [32, 64] {
                    assert_eq!(found, judged(size, model, &samples, &other, strip), "{strip}");
                }
            }
        }
    }

    #[test]
    fn the_scale_can_be_inverted() {
        assert_eq!(quality(0.0), 100.0);
        for wanted in [0.0, 20.0, 50.0, 75.0, 90.0, MOST_QUALITY] {
            assert!((quality(dissimilarity_at(wanted)) - wanted).abs() < 1e-6, "{wanted}");
        }
        assert_eq!(dissimilarity_at(100.0), dissimilarity_at(MOST_QUALITY));
    }
}
