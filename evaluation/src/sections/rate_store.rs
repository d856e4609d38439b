//! Measurements of whole files, by every codec at every setting: `rate.csv`.

use anyhow::Result;
use image_gip::{Encoder, Threads};

use crate::baselines::{Baseline, Worker};
use crate::bench::Bench;
use crate::gip;
use crate::pictures::{Distortion, TestPicture};
use crate::store::Store;

/// What one file contributes to a rate-distortion curve.
#[derive(Clone, Copy, Debug)]
pub(super) struct Point {
    pub(super) bytes: f64,
    /// In bits per pixel.
    pub(super) rate: f64,
    pub(super) distortion: Distortion,
}

/// The measurements of files that any section has needed so far.
#[derive(Debug)]
pub(super) struct RateStore(Store<3, 7>);

impl RateStore {
    pub(super) fn open(bench: &Bench) -> Result<Self> {
        let values = Distortion::columns_of_file(&[]);
        Ok(Self(bench.store("rate.csv", ["codec", "quality", "image"], values)?))
    }

    /// A file of ours. `name` and `setting` tell this encoder from all others.
    pub(super) fn ours(
        &mut self,
        version: &str,
        name: &str,
        setting: &str,
        encoder: Encoder,
        picture: &TestPicture,
    ) -> Result<Point> {
        self.point(version, [name, setting, &picture.name], || {
            let measured = gip::encode(encoder, picture, Threads::Pool)?;
            Ok((measured.bytes, picture.rate(measured.bytes), measured.distortion))
        })
    }

    pub(super) fn baseline(
        &mut self,
        worker: &mut Worker,
        versions: &str,
        baseline: &Baseline,
        setting: &str,
        picture: &TestPicture,
    ) -> Result<Point> {
        self.point(versions, [baseline.id, setting, &picture.name], || {
            let trip = worker.round_trip(baseline.id, setting, picture, Some(1), [1; 2])?;
            let distortion = picture.distortion(&trip.decoded)?;
            Ok((trip.bytes, picture.rate(trip.bytes), distortion))
        })
    }

    fn point(
        &mut self,
        version: &str,
        key: [&str; 3],
        measure: impl FnOnce() -> Result<(f64, f64, Distortion)>,
    ) -> Result<Point> {
        let values = self.0.get(version, key, || {
            let (bytes, rate, distortion) = measure()?;
            let [psnr, ms_ssim, ssimulacra2, butteraugli, cvvdp] = distortion.values();
            Ok([bytes, rate, psnr, ms_ssim, ssimulacra2, butteraugli, cvvdp])
        })?;
        let [bytes, rate, distortion @ ..] = values;
        Ok(Point { bytes, rate, distortion: Distortion::from(distortion) })
    }
}
