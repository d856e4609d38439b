//! Measurements of whole files, by every codec at every setting: `rate.csv`.

use std::cell::LazyCell;
use std::cmp::Reverse;

use anyhow::{Context, Result, anyhow};
use image_gip::{Encoder, Threads};

use crate::baselines::{Baseline, Worker};
use crate::bench::Bench;
use crate::gip;
use crate::parallel;
use crate::pictures::{Distortion, Reference, TestPicture};
use crate::store::Store;

/// What one file contributes to a rate-distortion curve.
#[derive(Clone, Copy, Debug)]
pub(super) struct Point {
    pub(super) bytes: f64,
    /// In bits per pixel.
    pub(super) rate: f64,
    pub(super) distortion: Distortion,
}

impl Point {
    fn of(reference: &Reference<'_>, bytes: f64, decoded: &[u8]) -> Result<Self> {
        let rate = reference.picture.rate(bytes);
        Ok(Self { bytes, rate, distortion: reference.distortion(decoded)? })
    }

    /// Of our file, with one thread: the file is the same with any number of threads.
    pub(super) fn of_ours(encoder: Encoder, reference: &Reference<'_>) -> Result<Self> {
        let file = gip::file(encoder, reference.picture, Threads::One)?.bytes;
        Self::of(reference, file.len() as f64, &gip::decode(&file, Threads::One)?)
    }

    pub(super) fn of_baseline(
        worker: &mut Worker,
        baseline: &Baseline,
        setting: &str,
        reference: &Reference<'_>,
    ) -> Result<Self> {
        let trip = worker.round_trip(baseline.id, setting, reference.picture, Some(1), [1; 2])?;
        Self::of(reference, trip.bytes, &trip.decoded)
    }

    /// In the order of the columns.
    fn values(&self) -> [f64; 7] {
        let [psnr, ms_ssim, ssimulacra2, butteraugli, cvvdp] = self.distortion.values();
        [self.bytes, self.rate, psnr, ms_ssim, ssimulacra2, butteraugli, cvvdp]
    }
}

impl From<[f64; 7]> for Point {
    fn from([bytes, rate, distortion @ ..]: [f64; 7]) -> Self {
        Self { bytes, rate, distortion: Distortion::from(distortion) }
    }
}

/// Files of one codec that are wanted.
#[derive(Clone, Copy, Debug)]
pub(super) struct Wanted<'a> {
    /// Of the codec.
    pub(super) version: &'a str,
    /// What tells this codec from all others.
    pub(super) codec: &'a str,
    /// From small files to large ones.
    pub(super) settings: &'a [String],
    pub(super) pictures: &'a [TestPicture],
    /// A rate in bits per pixel: of each picture, the first file that reaches it is the last.
    pub(super) until: f64,
}

/// The measurements of files that any section has needed so far.
#[derive(Debug)]
pub(super) struct RateStore(Store<3, 7>);

impl RateStore {
    pub(super) fn open(bench: &Bench) -> Result<Self> {
        let values = Distortion::columns_of_file(&[]);
        Ok(Self(bench.store("rate.csv", ["codec", "quality", "image"], values)?))
    }

    pub(super) fn baseline(
        &mut self,
        worker: &mut Worker,
        versions: &str,
        baseline: &Baseline,
        setting: &str,
        picture: &TestPicture,
    ) -> Result<Point> {
        let key = [baseline.id, setting, &picture.name];
        let values = self.0.get(versions, key, || {
            Ok(Point::of_baseline(worker, baseline, setting, &picture.reference()?)?.values())
        })?;
        Ok(values.into())
    }

    /// Of some codecs, given from quick ones to slow ones: for each picture the points of its files. What is
    /// missing is measured with one thread for each worker, by `measure` of the indices of codec and setting.
    pub(super) fn all<W: Send>(
        &mut self,
        all: &[Wanted<'_>],
        workers: &mut [W],
        measure: impl Fn(&mut W, [usize; 2], &Reference<'_>) -> Result<Point> + Sync,
    ) -> Result<Vec<Vec<Vec<Point>>>> {
        // With what is known already, and those first that take longest, so that all workers end at once.
        let mut jobs: Vec<(usize, &TestPicture, Vec<Option<Point>>)> = Vec::new();
        for (codec, wanted) in all.iter().enumerate() {
            self.0.note(wanted.version)?;
            for picture in wanted.pictures {
                let known = wanted.settings.iter();
                let known = known.map(|setting| self.known(wanted, setting, picture));
                jobs.push((codec, picture, known.collect()));
            }
        }
        jobs.sort_by_key(|(codec, picture, _)| Reverse((*codec, picture.rgb.len())));
        let work = |worker: &mut W,
                    (codec, picture, known): &(usize, &TestPicture, Vec<Option<Point>>),
                    emit: &mut dyn FnMut((usize, usize, String, Point))| {
            let wanted = &all[*codec];
            let reference = LazyCell::new(|| picture.reference());
            for (index, setting) in wanted.settings.iter().enumerate() {
                let point = match known[index] {
                    Some(point) => point,
                    None => {
                        let key = || format!("{}, {setting}, {}", wanted.codec, picture.name);
                        let reference = reference.as_ref().map_err(|error| anyhow!("{error:#}"))?;
                        let point =
                            measure(worker, [*codec, index], reference).with_context(key)?;
                        emit((*codec, index, picture.name.clone(), point));
                        point
                    }
                };
                if point.rate >= wanted.until {
                    break;
                }
            }
            Ok(())
        };
        let store = &mut self.0;
        parallel::for_each(workers, &jobs, work, |(codec, setting, picture, point)| {
            let Wanted { version, codec, settings, .. } = all[codec];
            let key = [codec, &settings[setting], &picture];
            store.get(version, key, || Ok(point.values())).map(|_| ())
        })?;
        let of_all = all.iter().map(|wanted| {
            wanted.pictures.iter().map(|picture| self.points(wanted, picture)).collect()
        });
        of_all.collect()
    }

    /// The points of a picture, which are all measured.
    fn points(&self, wanted: &Wanted<'_>, picture: &TestPicture) -> Result<Vec<Point>> {
        let mut points = Vec::new();
        for setting in wanted.settings {
            let point = self.known(wanted, setting, picture).context("it was measured before")?;
            points.push(point);
            if point.rate >= wanted.until {
                break;
            }
        }
        Ok(points)
    }

    fn known(&self, wanted: &Wanted<'_>, setting: &str, picture: &TestPicture) -> Option<Point> {
        self.0.known(wanted.version, [wanted.codec, setting, &picture.name]).map(Point::from)
    }
}

#[cfg(test)]
mod tests {
    use std::sync::atomic::{AtomicUsize, Ordering};

    use super::*;
    use crate::store::Source;

    fn picture(name: &str, side: u32) -> TestPicture {
        let rgb = vec![7; 3 * (side * side) as usize];
        TestPicture { name: name.into(), path: "".into(), width: side, height: side, rgb }
    }

    #[test]
    fn files_are_measured_once_on_all_cores_until_the_rate_is_reached() {
        let folder = tempfile::tempdir().expect("a folder");
        let open = || {
            let (keys, values) = (["codec", "quality", "image"], Distortion::columns_of_file(&[]));
            let path = folder.path().join("rate.csv");
            let source = Source { machine: "here".into(), commit: "1".into() };
            RateStore(Store::open(&path, &source, keys, values).expect("it opens"))
        };
        let pictures = [picture("a", 1), picture("b", 2)];
        let settings = ["1", "2", "3"].map(str::to_owned);
        let count = AtomicUsize::new(0);
        let all = |store: &mut RateStore, until: f64| {
            let wanted = Wanted {
                version: "1",
                codec: "c",
                settings: &settings,
                pictures: &pictures,
                until,
            };
            let points = store.all(&[wanted], &mut [(), ()], |(), [_, index], reference| {
                count.fetch_add(1, Ordering::Relaxed);
                // A file of the larger picture has half as many bits per pixel.
                let rate = (index + 1) as f64 / f64::from(reference.picture.width);
                Ok(Point { bytes: 1.0, rate, distortion: Distortion::from([rate; 5]) })
            });
            let [points] = &points.expect("it measures")[..] else { panic!("there is one codec") };
            let rates = |points: &Vec<Point>| points.iter().map(|point| point.rate).collect();
            let rates: Vec<Vec<f64>> = points.iter().map(rates).collect();
            (rates, count.swap(0, Ordering::Relaxed))
        };
        let until_one = vec![vec![1.0], vec![0.5, 1.0]];
        assert_eq!(all(&mut open(), 1.0), (until_one.clone(), 3));
        assert_eq!(all(&mut open(), 1.0), (until_one, 0));
        let until_two = vec![vec![1.0, 2.0], vec![0.5, 1.0, 1.5]];
        assert_eq!(all(&mut open(), 2.0), (until_two, 2));
    }

    #[test]
    fn our_file_is_measured_as_it_is() {
        let picture = picture("a", 16);
        let point = Point::of_ours(gip::encoder(1), &picture.reference().expect("it has one"));
        let point = point.expect("a small picture");
        assert_eq!(point.rate, point.bytes / 32.0);
        assert!(point.distortion.psnr > 50.0);
        assert_eq!(Point::from(point.values()).values(), point.values());
    }
}
