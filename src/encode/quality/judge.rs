//! Judging a rendering strip by strip, and the number of Gaussians for a quality.

use fearless_simd::{Level, dispatch};
use rayon::prelude::*;

use super::blotches;
use super::light::Strip;
use super::pyramid::Shown;
use super::scales::Scales;
use super::smooth::{self, SmoothAreas};
use crate::encode::error::Result;
use crate::encode::progress::Observer;
use crate::encode::source::Source;
use crate::encode::strips;
use crate::region::Region;
use crate::render::Picture;

// Constants: docs/tuning.md, "What a person sees".
/// The highest quality that is aimed at. People see no difference from 90 on.
pub(crate) const MOST_QUALITY: f64 = 97.0;

/// The mean perceptual weight of a picture without any variance.
const MOST_WEIGHT: f64 = 20.07;
/// A picture whose mean weight is less than this below the most is taken to have large even areas, and
/// begins with fewer Gaussians:
const EVEN: f64 = 6.0;
/// at least this share of them.
const LEAST_SHARE: f64 = 0.15;
/// Most Gaussians per pixel that are tried first.
const MOST_DENSITY: f64 = 0.25;

/// How a rendering differs from its source to the eye.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Verdict {
    /// That of SSIMULACRA2, if it measures such small pictures, on an open scale from 0, about
    /// proportional to the squared error.
    distance: Option<f64>,
    /// The same of a small picture among its mirror images.
    mirrored: Option<f64>,
    /// The mean square deviation of smooth areas.
    blotches: f64,
}

impl Verdict {
    /// The quality, from 0 to 100.
    pub(crate) fn quality(&self) -> f64 {
        quality(self.distance.or(self.mirrored).unwrap_or(0.0)).max(0.0)
    }

    /// The error as a factor on what a quality from 0 to 100 allows.
    pub(crate) fn excess(&self, wanted: f64) -> f64 {
        let of_blotches = self.blotches / blotches::allowed(wanted.min(MOST_QUALITY));
        self.excess_of_structure(wanted).max(of_blotches)
    }

    /// The same without regard to blotches.
    pub(crate) fn excess_of_structure(&self, wanted: f64) -> f64 {
        self.worst() / distance_at(wanted.min(MOST_QUALITY))
    }

    /// The largest distance.
    pub(crate) fn worst(&self) -> f64 {
        self.distance.into_iter().chain(self.mirrored).fold(0.0, f64::max)
    }
}

/// What judges renderings of a source. It knows what is the same for all of them.
#[derive(Debug)]
pub(crate) struct Judge<'a> {
    source: &'a Source<'a>,
    level: Level,
    /// Those over each background.
    smooth: Vec<SmoothAreas>,
}

impl<'a> Judge<'a> {
    pub(crate) fn new(source: &'a Source<'a>) -> Self {
        let (size, level) = (source.size(), Level::new());
        let smooth = |&background: &f32| {
            SmoothAreas::new(&Shown { picture: source, size, background }, level)
        };
        Self { source, level, smooth: source.backgrounds().iter().map(smooth).collect() }
    }

    pub(crate) fn source(&self) -> &'a Source<'a> {
        self.source
    }

    /// Judges a picture, rendered at the source's size.
    pub(crate) fn judge(
        &self,
        picture: &Picture<'_>,
        observer: &mut Observer<'_>,
    ) -> Result<Verdict> {
        let mut judgement = Judgement::new(self);
        strips::render(picture, u32::MAX, observer, |region, planes| {
            judgement.see(region, planes);
        })?;
        Ok(judgement.verdict())
    }
}

/// Size in bytes of what a judgement holds: a strip of the rendering, and rows of both pictures.
pub(crate) fn memory(source: &Source<'_>) -> usize {
    let (width, height) = (source.width(), source.height());
    let scales = [Scales::of_metric(source.size()), Scales::of_mirrored(source.size())];
    let rows = strips::rows(width, height);
    let held = scales.iter().flatten().map(|scales| scales.memory(rows)).sum::<usize>();
    strips::memory(width, height, source.color().channels()) + source.backgrounds().len() * held
}

/// A comparison of a rendering, which comes in strips from the top, with its source.
#[derive(Debug)]
pub(crate) struct Judgement<'a> {
    judge: &'a Judge<'a>,
    views: Vec<View<'a>>,
}

/// What is known of a rendering over a background.
#[derive(Debug)]
struct View<'a> {
    background: f32,
    /// What SSIMULACRA2 measures, and what it would measure of a small picture among its mirror images.
    metric: Option<Scales>,
    mirrored: Option<Scales>,
    smooth: &'a SmoothAreas,
    /// The sum over areas so far of what there is of blotches.
    blotches: f64,
}

impl<'a> Judgement<'a> {
    pub(crate) fn new(judge: &'a Judge<'a>) -> Self {
        let source = judge.source;
        let size = source.size();
        let view = |(&background, smooth)| View {
            background,
            smooth,
            metric: Scales::of_metric(size),
            mirrored: Scales::of_mirrored(size),
            blotches: 0.0,
        };
        Self { judge, views: source.backgrounds().iter().zip(&judge.smooth).map(view).collect() }
    }

    /// Takes in the next strip, all columns of it: float samples, plane after plane. The number of its
    /// rows is a multiple of 32, except at the bottom.
    pub(crate) fn see(&mut self, region: Region, planes: &[f32]) {
        let Judge { source, level, .. } = *self.judge;
        let (model, depth, curve) = (source.color(), source.depth(), source.curve());
        let strip = Strip { model, depth, region, planes, curve };
        for view in &mut self.views {
            view.see(source, &strip, level);
        }
    }

    /// The verdict after the last strip, over the background where it is worst.
    pub(crate) fn verdict(&self) -> Verdict {
        let worst = |found: fn(&View<'_>) -> Option<f64>| {
            self.views.iter().filter_map(found).reduce(f64::max)
        };
        Verdict {
            distance: worst(|view| view.metric.as_ref().map(Scales::distance)),
            mirrored: worst(|view| view.mirrored.as_ref().map(Scales::distance)),
            blotches: worst(|view| Some(view.blotches / view.smooth.count() as f64)).unwrap_or(0.0),
        }
    }
}

impl View<'_> {
    /// Takes in the next strip.
    fn see(&mut self, source: &Source<'_>, strip: &Strip<'_>, level: Level) {
        let (region, background) = (strip.region, self.background);
        let (first, rows) = (region.y as usize, region.height as usize);
        let size = source.size();
        let source = Shown { picture: source, size, background };
        let rendering = Shown { picture: strip, size, background };
        let smooth = self.smooth;
        let areas: Vec<_> = smooth::rows_of_areas(rows).collect();
        let found = areas.into_par_iter().map(|(row, rows)| {
            let y = first + row;
            dispatch!(level, _ => blotches::squares(&source, &rendering, smooth.row(y), y, rows))
        });
        for found in found.collect::<Vec<_>>() {
            self.blotches += found;
        }
        for scales in self.metric.iter_mut().chain(&mut self.mirrored) {
            scales.see(&source, &rendering, first, rows, level);
        }
    }
}

/// The quality at a distance, at most 100.
fn quality(distance: f64) -> f64 {
    let x = distance;
    let mapped = x * (2.326_765_64 + x * (-0.020_884_52 + x * 6.248_497e-5));
    100.0 - 10.0 * mapped.max(0.0).powf(0.627_633_65)
}

/// The distance at a quality from 0 to 100.
fn distance_at(wanted: f64) -> f64 {
    // The quality falls with the distance, from 100 to less than 0.
    let (mut least, mut most) = (0.0, 30.0);
    for _ in 0..50 {
        let middle = 0.5 * (least + most);
        if quality(middle) > wanted { least = middle } else { most = middle }
    }
    0.5 * (least + most)
}

/// About how many Gaussians a picture needs for a quality, given the means of its perceptual weights
/// on the finest and on the coarsest scale: texture, and above all fine texture, takes Gaussians.
pub(crate) fn count_for(wanted: f64, pixels: usize, [fine, coarse]: [f64; 2]) -> usize {
    let distance = distance_at(wanted.min(MOST_QUALITY));
    let density = 0.5 * distance.powf(-0.83) * fine.powf(-4.5) * coarse.powf(3.35);
    // On even ground, weights do not tell how smooth it is.
    let density = density * ((MOST_WEIGHT - fine) / EVEN).clamp(LEAST_SHARE, 1.0);
    // The cast saturates.
    ((pixels as f64 * density.min(MOST_DENSITY)) as usize).max(1)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::color::ColorModel;
    use crate::encode::appearance::Curve;
    use crate::encode::testing::MODELS;

    /// How much a rendering differs from a source, both of which are interleaved, if it comes in strips
    /// of so many rows.
    fn judged(
        size: [usize; 2],
        model: ColorModel,
        source: &[f32],
        rendering: &[f32],
        strip: usize,
    ) -> f64 {
        verdict(size, model, None, [source, rendering], strip).worst()
    }

    /// The verdict on a rendering of a source.
    fn verdict(
        [width, height]: [usize; 2],
        model: ColorModel,
        curve: Option<&'static Curve>,
        [source, rendering]: [&[f32]; 2],
        strip: usize,
    ) -> Verdict {
        let samples: Vec<u16> =
            source.iter().map(|sample| (sample * 65535.0).round() as u16).collect();
        let source =
            Source::new_u16(width as u32, height as u32, model, &samples).expect("the sizes agree");
        let source = source.seen_by(curve);
        let judge = Judge::new(&source);
        let mut judgement = Judgement::new(&judge);
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
        judgement.verdict()
    }

    #[test]
    fn noise_is_seen_on_even_ground_first() {
        let size = [240, 160];
        let mut rng = fastrand::Rng::with_seed(6);
        let mut noise = || rng.f32() - 0.5;
        // Even ground on the left, texture on the right.
        let source: Vec<f32> = (0..240 * 160)
            .map(|at| if at % 240 < 120 { 0.5 } else { 0.5 + 0.6 * noise() })
            .collect();
        let mut with_noise = |left: bool, strength: f32| {
            let samples: Vec<f32> = (source.iter().enumerate())
                .map(|(at, sample)| {
                    let here = (at % 240 < 120) == left;
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
    fn codes_of_pq_are_judged_by_what_they_look_like() {
        let (size, model) = ([96, 64], ColorModel::Rgba);
        let mut rng = fastrand::Rng::with_seed(9);
        // A gradient, then texture.
        let source: Vec<f32> = (0..96 * 64 * 4)
            .map(|at| match at / 4 % 96 {
                column @ ..64 => 0.1 + column as f32 / 100.0,
                _ => rng.f32(),
            })
            .collect();
        let rendering: Vec<f32> = source
            .iter()
            .map(|sample| (sample + 0.04 * (rng.f32() - 0.5)).clamp(0.0, 1.0))
            .collect();
        let curve = Curve::of_pq();
        let codes = |samples: &[f32]| -> Vec<f32> {
            let code = |(at, &sample)| if at % 4 == 3 { sample } else { curve.code(sample) };
            samples.iter().enumerate().map(code).collect()
        };
        let (codes, rendered) = (codes(&source), codes(&rendering));
        let found = verdict(size, model, Some(curve), [&codes, &rendered], 32);
        let expected = verdict(size, model, None, [&source, &rendering], 32);
        let plain = verdict(size, model, None, [&codes, &rendered], 32);
        let ratio = |verdict: Verdict, of: fn(&Verdict) -> f64| of(&verdict) / of(&expected);
        let distance = |verdict: &Verdict| verdict.distance.unwrap_or(0.0);
        for of in [distance, |verdict: &Verdict| verdict.blotches] {
            assert!((ratio(found, of) - 1.0).abs() < 0.01, "{found:?}, {expected:?}");
            assert!(ratio(plain, of) < 0.9, "{plain:?}, {expected:?}");
        }
    }

    #[test]
    fn every_model_and_size_has_a_quality() {
        for model in MODELS {
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
            assert!((quality(distance_at(wanted)) - wanted).abs() < 1e-6, "{wanted}");
        }
    }
}
