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
    /// What it is asked for, in bits per pixel.
    pub(super) rates: &'static [f64],
}

/// Our encoder as it is by default, and then other ways to run it: "gip, --tune psnr" has its place
/// here as soon as the encoder knows that.
pub(super) const OURS: &[Variant] = &[Variant {
    name: gip::NAME,
    encoder: gip::encoder,
    rates: &[0.1, 0.15, 0.25, 0.35, 0.5, 0.75, 1.0, 1.5],
}];

/// The rates of a quick run.
const QUICK_RATES: [f64; 5] = [0.15, 0.25, 0.5, 0.75, 1.05];
/// A quick run takes one in so many of a baseline's settings, and the last.
const QUICK_STEP: usize = 3;

impl Variant {
    pub(super) fn rates(&self, quick: bool) -> &'static [f64] {
        if quick { &QUICK_RATES } else { self.rates }
    }
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
    /// A variant of ours, asked for each of its rates.
    pub(super) fn ours(
        store: &mut RateStore,
        version: &str,
        variant: &Variant,
        pictures: &[TestPicture],
        quick: bool,
    ) -> Result<Self> {
        let rates = variant.rates(quick);
        let settings: Vec<String> =
            rates.iter().map(|rate| format!("{rate} bpp, effort {}", gip::EFFORT)).collect();
        let points = points(pictures, rates.len(), |picture, index| {
            let target = Target::BitsPerPixel(rates[index]);
            let encoder = (variant.encoder)(gip::EFFORT).with_target(target);
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
        let step = if quick { QUICK_STEP } else { 1 };
        let last = baseline.settings.len() - 1;
        let settings: Vec<String> = (0..=last)
            .filter(|&index| index % step == 0 || index == last)
            .map(|index| baseline.settings[index].to_owned())
            .collect();
        let points = points(pictures, settings.len(), |picture, index| {
            store.baseline(worker, versions, baseline, &settings[index], picture)
        })?;
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
