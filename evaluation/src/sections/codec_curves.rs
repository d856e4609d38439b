//! Curves of quality over rate: a codec at all its settings, on all pictures of a set.

use anyhow::{Context, Result};
use image_gip::{Encoder, Target};

use super::rate_store::{Point, RateStore, Wanted};
use crate::baselines::{Baseline, Worker};
use crate::curve::{Curve, bd_rate};
use crate::gip;
use crate::metric::Metric;
use crate::parallel;
use crate::pictures::TestPicture;
use crate::table::mean;

/// A way to run our encoder that gets curves of its own.
#[derive(Clone, Copy, Debug)]
pub(super) struct Variant<'a> {
    pub(super) name: &'static str,
    pub(super) encoder: fn(u8) -> Encoder,
    /// What it is asked for, from small files to large ones.
    pub(super) targets: &'a [Target],
}

/// Rates to ask an encoder for: two or three in each of the ranges that are compared.
const RATES: &[Target] = &[
    Target::BitsPerPixel(0.1),
    Target::BitsPerPixel(0.2),
    Target::BitsPerPixel(0.4),
    Target::BitsPerPixel(0.7),
    Target::BitsPerPixel(1.0),
    Target::BitsPerPixel(1.5),
    Target::BitsPerPixel(2.0),
];

/// Our encoder as it is by default, and then other ways to run it.
pub(super) const OURS: [Variant<'static>; 3] = [
    Variant { name: gip::NAME, encoder: gip::encoder, targets: RATES },
    Variant { name: gip::PLAIN_NAME, encoder: gip::plain_encoder, targets: RATES },
    Variant { name: gip::PSNR_NAME, encoder: gip::psnr_encoder, targets: RATES },
];

/// All rates: curves are measured to their end.
pub(super) const EVERYWHERE: (f64, f64) = (0.0, f64::INFINITY);

/// Which of the settings are measured.
#[derive(Clone, Copy, Debug)]
pub(super) struct Extent {
    /// One in so many, and the last.
    pub(super) step: usize,
    /// The first file of at least so many bits per pixel is the last of its picture.
    pub(super) until: f64,
}

impl Extent {
    /// All settings, or those of a quick run.
    pub(super) fn new(quick: bool) -> Self {
        Self { step: if quick { 3 } else { 1 }, until: EVERYWHERE.1 }
    }

    fn chosen<T: Clone>(self, settings: &[T]) -> Vec<T> {
        let last = settings.len() - 1;
        let index = (0..=last).filter(|&index| index % self.step == 0 || index == last);
        index.map(|index| settings[index].clone()).collect()
    }
}

impl Variant<'_> {
    /// What the encoder is asked for, in the words of the stored measurements.
    pub(super) fn settings(&self) -> Vec<String> {
        self.targets.iter().map(|&target| setting(target)).collect()
    }
}

/// A target at the default effort.
pub(super) fn setting(target: Target) -> String {
    let target = match target {
        Target::BitsPerPixel(rate) => format!("{rate} bpp"),
        Target::Quality(quality) => format!("quality {quality}"),
        Target::Lambda(lambda) => format!("lambda {lambda}"),
        other => format!("{other:?}"),
    };
    format!("{target}, effort {}", gip::EFFORT)
}

/// The settings of a baseline that curves run through.
#[derive(Clone, Copy, Debug)]
pub(super) struct Sweep {
    /// One baseline, or several that are tunings of one codec with the same settings: then each picture has the one
    /// that is best by the metric in question.
    pub(super) tunings: &'static [Baseline],
    pub(super) extent: Extent,
}

/// A codec with the measurements of all its files.
#[derive(Debug)]
pub(super) struct Codec {
    pub(super) id: &'static str,
    pub(super) name: &'static str,
    pub(super) settings: Vec<String>,
    /// For each picture, a point for each setting, or for the first of them.
    pub(super) points: Vec<Vec<Point>>,
    /// The same with other tunings, of which the best counts.
    pub(super) retuned: Vec<Vec<Vec<Point>>>,
}

impl Codec {
    /// A variant of ours, asked for each of its targets.
    pub(super) fn ours(
        store: &mut RateStore,
        version: &str,
        variant: &Variant<'_>,
        pictures: &[TestPicture],
        extent: Extent,
    ) -> Result<Self> {
        let targets = extent.chosen(variant.targets);
        let settings = extent.chosen(&variant.settings());
        let (codec, until) = (variant.name, extent.until);
        let wanted = Wanted { version, codec, settings: &settings, pictures, until };
        let mut threads = parallel::threads();
        let points = store.all(&[wanted], &mut threads, |(), [_, index], reference| {
            let encoder = (variant.encoder)(gip::EFFORT).with_target(targets[index]);
            Point::of_ours(encoder, reference)
        })?;
        let points = points.into_iter().flatten().collect();
        Ok(Self { id: codec, name: codec, settings, points, retuned: Vec::new() })
    }

    /// Baselines at their settings, given from quick ones to slow ones.
    pub(super) fn baselines(
        store: &mut RateStore,
        workers: &mut [Worker],
        versions: &str,
        sweeps: &[Sweep],
        pictures: &[TestPicture],
    ) -> Result<Vec<Self>> {
        let tunings = |sweep: &Sweep| {
            let settings: Vec<&str> = sweep.extent.chosen(sweep.tunings[0].settings);
            let settings: Vec<String> = settings.into_iter().map(str::to_owned).collect();
            let until = sweep.extent.until;
            sweep.tunings.iter().map(move |baseline| (baseline, settings.clone(), until))
        };
        let all: Vec<(&Baseline, Vec<String>, f64)> = sweeps.iter().flat_map(tunings).collect();
        let wanted = all.iter().map(|(baseline, settings, until)| Wanted {
            version: versions,
            codec: baseline.id,
            settings,
            pictures,
            until: *until,
        });
        let wanted: Vec<Wanted<'_>> = wanted.collect();
        let points = store.all(&wanted, workers, |worker, [codec, index], reference| {
            let (baseline, settings, _) = &all[codec];
            Point::of_baseline(worker, baseline, &settings[index], reference)
        })?;
        let mut of_tunings = all.iter().zip(points);
        let codecs = sweeps.iter().map(|sweep| {
            let ((baseline, settings, _), points) = of_tunings.next()?;
            let others = of_tunings.by_ref().take(sweep.tunings.len() - 1);
            let retuned = others.map(|(_, points)| points).collect();
            let Baseline { id, name, .. } = **baseline;
            Some(Self { id, name, settings: settings.clone(), points, retuned })
        });
        codecs.collect::<Option<_>>().context("each has the points of its tunings")
    }

    /// The points of a picture with the tuning that is best by a metric.
    fn best_points(&self, picture: usize, metric: Metric) -> &[Point] {
        let mut best = &self.points[picture];
        for tuning in &self.retuned {
            let curves = (curve(best, metric), curve(&tuning[picture], metric));
            if bd_rate(&curves.0, &curves.1, EVERYWHERE).is_some_and(|share| share < 0.0) {
                best = &tuning[picture];
            }
        }
        best
    }

    pub(super) fn curve(&self, picture: usize, metric: Metric) -> Curve {
        curve(self.best_points(picture, metric), metric)
    }

    pub(super) fn curves(&self, metric: Metric) -> Vec<Curve> {
        (0..self.points.len()).map(|picture| self.curve(picture, metric)).collect()
    }

    /// Mean rate against mean quality at every setting that all pictures have.
    pub(super) fn mean_curve(&self, metric: Metric) -> Curve {
        let all = 0..self.points.len();
        let all: Vec<&[Point]> = all.map(|picture| self.best_points(picture, metric)).collect();
        let common = all.iter().map(|points| points.len()).min().unwrap_or(0);
        let at = |setting: usize| all.iter().map(move |points| &points[setting]);
        Curve::new((0..common).filter_map(|setting| {
            let rate = mean(at(setting).map(|point| point.rate))?;
            Some((rate, metric.mean(at(setting).map(|point| metric.level(&point.distortion)))?))
        }))
    }
}

fn curve(points: &[Point], metric: Metric) -> Curve {
    Curve::new(points.iter().map(|point| (point.rate, metric.level(&point.distortion))))
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::pictures::Distortion;

    /// Points of this PSNR and SSIMULACRA2 at 0.5 and 1 bits per pixel.
    fn points(psnr: [f64; 2], ssimulacra2: [f64; 2]) -> Vec<Point> {
        let point = |index: usize| Point {
            bytes: 1.0,
            rate: [0.5, 1.0][index],
            distortion: Distortion::from([psnr[index], 0.9, ssimulacra2[index], 1.0, 8.0]),
        };
        vec![point(0), point(1)]
    }

    #[test]
    fn each_picture_has_the_tuning_that_is_best_by_the_metric() {
        let codec = Codec {
            id: "a",
            name: "a",
            settings: vec!["1".into(), "2".into()],
            points: vec![points([30.0, 35.0], [50.0, 60.0]), points([20.0, 25.0], [40.0, 60.0])],
            retuned: vec![vec![
                points([29.0, 34.0], [55.0, 65.0]),
                points([22.0, 26.0], [30.0, 50.0]),
            ]],
        };
        let at = |picture: usize, metric| codec.curve(picture, metric).quality(0.5);
        assert_eq!([0, 1].map(|picture| at(picture, Metric::Psnr)), [Some(30.0), Some(22.0)]);
        let scores = [0, 1].map(|picture| at(picture, Metric::Ssimulacra2));
        assert_eq!(scores, [Some(55.0), Some(40.0)]);
        assert_eq!(codec.mean_curve(Metric::Psnr).quality(0.5), Some(26.0));
    }

    #[test]
    fn the_mean_ends_where_the_first_picture_does() {
        let all = points([30.0, 35.0], [50.0, 60.0]);
        let codec = Codec {
            id: "a",
            name: "a",
            settings: vec!["1".into(), "2".into()],
            points: vec![all.clone(), all[..1].to_vec()],
            retuned: Vec::new(),
        };
        let mean: Vec<(f64, f64)> = codec.mean_curve(Metric::Psnr).points().collect();
        assert_eq!(mean, [(0.5, 30.0)]);
    }

    #[test]
    fn a_step_leaves_settings_out_but_not_the_last() {
        let chosen = |step| Extent { step, until: 2.0 }.chosen(&[0, 1, 2, 3, 4, 5]);
        assert_eq!(chosen(1), [0, 1, 2, 3, 4, 5]);
        assert_eq!(chosen(2), [0, 2, 4, 5]);
        assert_eq!(chosen(3), [0, 3, 5]);
    }
}
