//! An estimate of the visual quality of a rendering, on the scale of SSIMULACRA2.
//!
//! SSIMULACRA2 (<https://github.com/cloudinary/ssimulacra2>) adds up 108 norms of differences in three
//! channels on six scales, with weights that were fitted to what people said. The nine norms that are
//! measured here make up 93 % of the sum on photographs, and the estimate takes them for all of it: on
//! the pictures of Kodak and photos it is within 2.3 of the metric.

mod plane;
mod pyramid;

use std::sync::OnceLock;

use super::error::EncodeError;
use super::progress::Observer;
use super::sensitivity::SCALES;
use super::source::Source;
use super::strips;
use crate::render::Picture;
use pyramid::{Pyramid, PyramidBuilder};

/// The sum of all norms of SSIMULACRA2, as a factor on those that are measured.
const UNMEASURED: f64 = 1.07;
/// The highest quality that is aimed at. People see no difference from 90 on.
pub(crate) const MOST_QUALITY: f64 = 97.0;

/// Most Gaussians per pixel that are tried first.
const MOST_DENSITY: f64 = 0.25;

/// The source of renderings whose quality is estimated. Its pyramid is made when it is needed first.
#[derive(Debug)]
pub(crate) struct Judge<'a> {
    source: &'a Source<'a>,
    pyramid: OnceLock<Pyramid>,
}

impl<'a> Judge<'a> {
    pub(crate) fn new(source: &'a Source<'a>) -> Self {
        Self { source, pyramid: OnceLock::new() }
    }

    fn pyramid(&self, observer: &mut Observer<'_>) -> Result<&Pyramid, EncodeError> {
        if let Some(pyramid) = self.pyramid.get() {
            return Ok(pyramid);
        }
        let source = self.source;
        let size = [source.width() as usize, source.height() as usize];
        let channels = source.color().channels();
        let mut builder = PyramidBuilder::new(size, source.color());
        for strip in strips::strips(source.width(), source.height()) {
            observer.poll()?;
            let (first, rows) = (strip.y as usize, strip.height as usize);
            builder.set(first, rows, |x, y, channel| {
                let at = ((first + y) * size[0] + x) * channels + channel;
                f32::from(source.wide_sample(at)) / 65535.0
            });
        }
        let pyramid = builder.finish(observer)?;
        Ok(self.pyramid.get_or_init(|| pyramid))
    }

    /// Size in bytes.
    pub(crate) fn memory(&self) -> usize {
        self.pyramid.get().map_or(0, Pyramid::memory)
    }

    /// Size in bytes with what a judgement needs: a pyramid of the rendering too, linear light at half
    /// of the size, and a strip of the rendering.
    pub(crate) fn memory_at_work(&self) -> usize {
        let half = self.pyramid.get().map_or(0, |pyramid| pyramid.luma[1].values.len());
        let source = self.source;
        let strip = strips::memory(source.width(), source.height(), source.color().channels());
        2 * self.memory() + half * size_of::<[f32; 3]>() + strip
    }

    /// How much a picture that is rendered at the source's size differs from the source to the eye,
    /// on an open scale from 0. It is about proportional to the squared error.
    ///
    /// # Errors
    /// [`EncodeError::Cancelled`] when the caller cancels.
    pub(crate) fn dissimilarity(
        &self,
        picture: &Picture<'_>,
        observer: &mut Observer<'_>,
    ) -> Result<f64, EncodeError> {
        let source = self.pyramid(observer)?;
        let header = picture.header();
        let size = [header.width as usize, header.height as usize];
        let mut builder = PyramidBuilder::new(size, header.color);
        strips::render(picture, u32::MAX, observer, |region, planes| {
            let pixels = region.pixels() as usize;
            builder.set(region.y as usize, region.height as usize, |x, y, channel| {
                planes[channel * pixels + y * size[0] + x]
            });
        })?;
        let rendering = builder.finish(observer)?;
        source.dissimilarity(&rendering, observer)
    }
}

impl Pyramid {
    /// Size in bytes.
    fn memory(&self) -> usize {
        let planes = self.luma.iter().chain([&self.blue]);
        planes.map(|plane| size_of_val(&plane.values[..])).sum()
    }

    /// How much another picture of the same size differs: the weighted sum of norms that
    /// SSIMULACRA2 takes.
    fn dissimilarity(&self, other: &Self, observer: &mut Observer<'_>) -> Result<f64, EncodeError> {
        let mut sum = 0.0;
        let planes = self.luma.iter().zip(&other.luma);
        for (scale, (plane, other)) in planes.enumerate() {
            let found = plane.differences(other, observer)?;
            sum += match scale {
                0 => 7.466_89 * found.structure_l4 + 17.445_83 * found.lost_l4,
                1 => 6.683_68 * found.structure_l4,
                2 => 225.205_15 * found.structure_l1 + 19.213_24 * found.structure_l4,
                _ => 176.393_18 * found.structure_l1 + 24.433_01 * found.structure_l4,
            };
        }
        let found = self.blue.differences(&other.blue, observer)?;
        sum += 95.108_05 * found.structure_l1 + 171.266_73 * found.artifacts_l4;
        Ok(0.956_238_26 * UNMEASURED * sum)
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
/// eye's sensitivity to it. It is a fit to photographs at efforts 3 and 5, good to a factor of 1.3 on
/// average: texture, and above all fine texture, takes Gaussians.
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
    use crate::encode::progress::unobserved;

    /// A pyramid of a picture of one colour model from its samples.
    fn pyramid(size: [usize; 2], model: ColorModel, samples: &[f32]) -> Pyramid {
        let mut builder = PyramidBuilder::new(size, model);
        builder.set(0, size[1], |x, y, channel| {
            samples[(y * size[0] + x) * model.channels() + channel]
        });
        unobserved(|observer| builder.finish(observer))
    }

    fn dissimilarity(a: &Pyramid, b: &Pyramid) -> f64 {
        unobserved(|observer| a.dissimilarity(b, observer))
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
            let source = pyramid(size, ColorModel::Gray, &source);
            dissimilarity(&source, &pyramid(size, ColorModel::Gray, &samples))
        };
        let (even, textured) = (with_noise(true, 0.05), with_noise(false, 0.05));
        assert!(even > 3.0 * textured, "{even}, {textured}");
        let strengths = [0.01, 0.03, 0.1].map(|strength| quality(with_noise(true, strength)));
        assert!(strengths.is_sorted_by(|a, b| a > b), "{strengths:?}");
    }

    #[test]
    fn every_model_and_size_has_a_quality() {
        for model in [ColorModel::Gray, ColorModel::GrayAlpha, ColorModel::Rgb, ColorModel::Rgba] {
            for size in [[1, 1], [5, 2], [33, 17]] {
                let mut rng = fastrand::Rng::with_seed(7);
                let length = size[0] * size[1] * model.channels();
                let samples: Vec<f32> = (0..length).map(|_| rng.f32()).collect();
                let other: Vec<f32> = samples.iter().map(|sample| 1.3 * sample - 0.2).collect();
                let source = pyramid(size, model, &samples);
                assert!(dissimilarity(&source, &source) < 0.01, "{model:?} {size:?}");
                let found = dissimilarity(&source, &pyramid(size, model, &other));
                assert!(found.is_finite() && found > 0.01, "{model:?} {size:?}: {found}");
            }
        }
    }

    #[test]
    fn a_picture_may_come_in_strips() {
        let size = [9, 21];
        let sample = |x: usize, y: usize, _: usize| ((x * 7 + y * 3) % 11) as f32 / 11.0;
        let mut builder = PyramidBuilder::new(size, ColorModel::Gray);
        builder.set(0, 21, sample);
        let whole = unobserved(|observer| builder.finish(observer));
        let mut builder = PyramidBuilder::new(size, ColorModel::Gray);
        for (first, rows) in [(0, 8), (8, 2), (10, 11)] {
            builder.set(first, rows, |x, y, channel| sample(x, first + y, channel));
        }
        let strips = unobserved(|observer| builder.finish(observer));
        for (whole, strips) in whole.luma.iter().zip(&strips.luma) {
            assert_eq!(whole.values, strips.values);
        }
        assert_eq!(whole.blue.values, strips.blue.values);
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
