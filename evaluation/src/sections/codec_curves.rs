//! Curves of quality over rate: a codec at all its settings, on all pictures of a set.

use anyhow::Result;
use image_gip::{Encoder, Target};

use super::rate_store::{Point, RateStore};
use crate::baselines::{Baseline, Worker};
use crate::curve::Curve;
use crate::gip;
use crate::metric::Metric;
use crate::pictures::TestPicture;
use crate::table::mean;

/// A way to run our encoder that gets curves of its own.
#[derive(Clone, Copy, Debug)]
pub(super) struct Variant {
    pub(super) name: &'static str,
    pub(super) encoder: fn(u8) -> Encoder,
    /// What it is asked for.
    pub(super) targets: &'static [Target],
}

/// Rates to ask an encoder for.
const RATES: &[Target] = &[
    Target::BitsPerPixel(0.1),
    Target::BitsPerPixel(0.15),
    Target::BitsPerPixel(0.25),
    Target::BitsPerPixel(0.35),
    Target::BitsPerPixel(0.5),
    Target::BitsPerPixel(0.75),
    Target::BitsPerPixel(1.0),
    Target::BitsPerPixel(1.5),
];

/// Our encoder as it is by default, and then other ways to run it.
pub(super) const OURS: [Variant; 3] = [
    Variant { name: gip::NAME, encoder: gip::encoder, targets: RATES },
    Variant { name: gip::PLAIN_NAME, encoder: gip::plain_encoder, targets: RATES },
    Variant { name: gip::PSNR_NAME, encoder: gip::psnr_encoder, targets: RATES },
];

/// A quick run takes one in so many settings, and the last.
const QUICK_STEP: usize = 3;

impl Variant {
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

/// All of some settings, or those of a quick run.
fn chosen<T: Clone>(settings: &[T], quick: bool) -> Vec<T> {
    let (step, last) = (if quick { QUICK_STEP } else { 1 }, settings.len() - 1);
    let index = (0..=last).filter(|&index| index % step == 0 || index == last);
    index.map(|index| settings[index].clone()).collect()
}

/// A codec with the measurements of all its files.
#[derive(Debug)]
pub(super) struct Codec {
    pub(super) id: &'static str,
    pub(super) name: &'static str,
    pub(super) settings: Vec<String>,
    /// For each picture, a point for each setting.
    pub(super) points: Vec<Vec<Point>>,
}

impl Codec {
    /// A variant of ours, asked for each of its targets.
    pub(super) fn ours(
        store: &mut RateStore,
        version: &str,
        variant: &Variant,
        pictures: &[TestPicture],
        quick: bool,
    ) -> Result<Self> {
        let targets = chosen(variant.targets, quick);
        let settings = chosen(&variant.settings(), quick);
        let points = points(pictures, targets.len(), |picture, index| {
            let encoder = (variant.encoder)(gip::EFFORT).with_target(targets[index]);
            store.ours(version, variant.name, &settings[index], encoder, picture)
        })?;
        Ok(Self { id: variant.name, name: variant.name, settings, points })
    }

    /// A baseline at its settings.
    pub(super) fn baseline(
        store: &mut RateStore,
        worker: &mut Worker,
        versions: &str,
        baseline: &Baseline,
        pictures: &[TestPicture],
        quick: bool,
    ) -> Result<Self> {
        let settings = chosen(baseline.settings, quick);
        let points = points(pictures, settings.len(), |picture, index| {
            store.baseline(worker, versions, baseline, settings[index], picture)
        })?;
        let settings = settings.into_iter().map(str::to_owned).collect();
        Ok(Self { id: baseline.id, name: baseline.name, settings, points })
    }

    pub(super) fn curve(&self, picture: usize, metric: Metric) -> Curve {
        let points = self.points[picture].iter();
        Curve::new(points.map(|point| (point.rate, metric.level(&point.distortion))))
    }

    pub(super) fn curves(&self, metric: Metric) -> Vec<Curve> {
        (0..self.points.len()).map(|picture| self.curve(picture, metric)).collect()
    }

    /// Mean rate against mean quality at every setting.
    pub(super) fn mean_curve(&self, metric: Metric) -> Curve {
        let at = |setting: usize| self.points.iter().map(move |points| &points[setting]);
        Curve::new((0..self.settings.len()).filter_map(|setting| {
            let rate = mean(at(setting).map(|point| point.rate))?;
            Some((rate, metric.mean(at(setting).map(|point| metric.level(&point.distortion)))?))
        }))
    }
}

/// For each picture, a point for each of so many settings.
fn points(
    pictures: &[TestPicture],
    settings: usize,
    mut point: impl FnMut(&TestPicture, usize) -> Result<Point>,
) -> Result<Vec<Vec<Point>>> {
    let all = pictures.iter();
    all.map(|picture| (0..settings).map(|setting| point(picture, setting)).collect()).collect()
}
