//! How long our encoder takes until a file of another codec's size is as good as that codec's.

use anyhow::Result;
use image_gip::{ColorModel, Encoder, Source, Target, Threads, metrics};

use crate::baselines::{Baseline, Worker};
use crate::bench::{Bench, timing_version};
use crate::gip;
use crate::pictures::TestPicture;
use crate::table::{Table, mean, median};
use crate::versions::{baseline_called, nearest_setting};
use crate::visual;

/// What takes longer has lost.
const EFFORTS: [u8; 4] = [1, 2, 3, 4];
/// Both are timed in turns, so that other work on the machine slows both down alike: so many times, or until ours have
/// taken so many seconds.
const ROUNDS: usize = 5;
const SECONDS: f64 = 3.0;

/// Whom we race, and by what.
struct Rival {
    baseline: &'static str,
    /// What tables call ours.
    name: &'static str,
    metric: &'static str,
    /// The metric of decoded samples; higher is better.
    level: fn(&TestPicture, &[u8]) -> Result<f64>,
    encoder: fn(u8) -> Encoder,
    /// In bits per pixel.
    rates: &'static [f64],
}

const RIVALS: [Rival; 4] = [
    Rival {
        baseline: "AVIF",
        name: gip::NAME,
        metric: "SSIMULACRA2",
        level: ssimulacra2,
        encoder: gip::encoder,
        rates: &[0.25, 0.5],
    },
    Rival {
        baseline: "AVIF",
        name: gip::PLAIN_NAME,
        metric: "SSIMULACRA2",
        level: ssimulacra2,
        encoder: gip::plain_encoder,
        rates: &[0.25, 0.5],
    },
    Rival {
        baseline: "AVIF tune=psnr",
        name: gip::PSNR_NAME,
        metric: "PSNR",
        level: psnr,
        encoder: gip::psnr_encoder,
        rates: &[0.5],
    },
    Rival {
        baseline: "WebP",
        name: gip::PSNR_NAME,
        metric: "PSNR",
        level: psnr,
        encoder: gip::psnr_encoder,
        rates: &[0.5],
    },
];

fn ssimulacra2(picture: &TestPicture, decoded: &[u8]) -> Result<f64> {
    visual::ssimulacra2(&picture.rgb, decoded, picture.width, picture.height)
}

fn psnr(picture: &TestPicture, decoded: &[u8]) -> Result<f64> {
    Ok(metrics::psnr(&picture.rgb, decoded, 255.0))
}

/// On sets of pictures, each with its name.
pub(super) fn measure(bench: &mut Bench, sets: &[(&str, &[TestPicture])]) -> Result<String> {
    let mut text = String::from(
        "\n### Until it is as good\n\nCompared with the named codecs, each at the quality whose file is nearest to \
         the rate: our encoder at the lowest effort whose file of the same bytes is as good by the metric. \
         SSIMULACRA2 takes texture for noise, so that ours is measured without it, too. The time is interpolated \
         between that effort and the one before (in its logarithm), and divided by the other codec's own; medians \
         of rounds in which both take turns, with all threads. The effort is interpolated likewise; where the \
         lowest is better already, its time is taken, and where none up to the default effort is as good the ratio is \
         never.\n",
    );
    for &(set, pictures) in sets {
        if !pictures.is_empty() {
            text.push_str(&races(bench, set, pictures)?);
        }
    }
    Ok(text)
}

fn races(bench: &mut Bench, set: &str, pictures: &[TestPicture]) -> Result<String> {
    let mut store = bench.store(
        "races.csv",
        ["codec", "ours", "rate", "image"],
        ["bytes", "level", "effort", "seconds", "other_seconds"],
    )?;
    let quick = bench.quick;
    let efforts: &[u8] = if quick { &gip::QUICK_EFFORTS } else { &EFFORTS };
    let product = bench.product.clone();
    let (worker, versions) = bench.baselines()?;
    let version = timing_version(&product, &versions);
    let mut table = Table::new(&["", "time over its own", "from", "to", "effort"]);
    let mut figures = Vec::new();
    let mut by_picture = vec![Vec::new(); pictures.len()];
    let mut columns = vec!["picture".to_owned()];
    for rival in RIVALS {
        let baseline = baseline_called(rival.baseline)?;
        for &rate in rival.rates {
            let mut races = Vec::new();
            for picture in pictures {
                let key = [baseline.id, rival.name, &rate.to_string(), &picture.name];
                let values = store.get(&version, key, || {
                    Ok(Race::run(&rival, baseline, worker, picture, rate, efforts)?.values())
                })?;
                races.push(Race::from(values));
            }
            let Rival { name, metric, baseline, .. } = rival;
            let figure = format!("races/{set}/{name} to {baseline}/{rate} bpp");
            let name = format!("{name}, to the {metric} of {baseline}, {rate} bpp");
            let ratios = || races.iter().map(Race::ratio);
            let middle = median(ratios()).unwrap_or(f64::NAN);
            let least = ratios().fold(f64::INFINITY, f64::min);
            let most = ratios().fold(0.0, f64::max);
            figures.push((figure, middle));
            let effort = mean(races.iter().map(|race| race.effort)).unwrap_or(f64::NAN);
            let effort = if effort.is_finite() { format!("{effort:.1}") } else { "-".into() };
            let [middle, least, most] = [middle, least, most].map(cell);
            table.row(&[name.clone(), middle, least, most, effort]);
            columns.push(name);
            by_picture.iter_mut().zip(ratios()).for_each(|(cells, ratio)| cells.push(cell(ratio)));
        }
    }
    figures.into_iter().for_each(|(name, ratio)| bench.figure(name, ratio, ""));
    let mut single = Table::new(&columns);
    for (picture, cells) in pictures.iter().zip(by_picture) {
        single.row(&[vec![picture.name.clone()], cells].concat());
    }
    let count = pictures.len();
    Ok(format!("\n{set}, {count} pictures:\n{}{}", table.finish(), single.finish()))
}

fn cell(ratio: f64) -> String {
    if ratio.is_finite() { format!("{ratio:.2}") } else { "never".into() }
}

/// What a race comes to.
#[derive(Clone, Copy, Debug, PartialEq)]
struct Race {
    /// Of the rival's file, and its level.
    bytes: f64,
    level: f64,
    /// Of ours, interpolated; infinite if no effort is as good.
    effort: f64,
    seconds: f64,
    rival_seconds: f64,
}

impl Race {
    fn run(
        rival: &Rival,
        baseline: &Baseline,
        worker: &mut Worker,
        picture: &TestPicture,
        rate: f64,
        efforts: &[u8],
    ) -> Result<Self> {
        let wanted = rate * picture.pixels() / 8.0;
        let setting = nearest_setting(worker, baseline, picture, wanted)?;
        let theirs = worker.round_trip(baseline.id, &setting, picture, Some(1), [1; 2])?;
        let bytes = theirs.bytes;
        let level = (rival.level)(picture, &theirs.decoded)?;

        let source = Source::new_u8(picture.width, picture.height, ColorModel::Rgb, &picture.rgb)?;
        let encode = |effort: u8| {
            let encoder = (rival.encoder)(effort).with_target(Target::Bytes(bytes as u64));
            encoder.with_threads(Threads::Pool).encode(&source)
        };
        let mut reached = Vec::new();
        for &effort in efforts {
            let decoded = gip::decode(&encode(effort)?.bytes, Threads::Pool)?;
            reached.push((effort, (rival.level)(picture, &decoded)?));
            if reached.last().is_some_and(|&(_, ours)| ours >= level) {
                break;
            }
        }
        let Some(Between { efforts: [low, high], share }) = between(level, &reached) else {
            let (effort, seconds) = (f64::INFINITY, f64::NAN);
            return Ok(Self { bytes, level, effort, seconds, rival_seconds: f64::NAN });
        };

        let mut times = [const { Vec::new() }; 3];
        while times[0].len() < ROUNDS && times[1..].iter().flatten().sum::<f64>() < SECONDS {
            let trip = worker.round_trip(baseline.id, &setting, picture, None, [1; 2])?;
            times[0].push(trip.encode_seconds);
            times[1].push(encode(low)?.report.seconds);
            times[2].push(encode(high)?.report.seconds);
        }
        let [rival_seconds, before, at] = times.map(|times| median(times).unwrap_or(f64::NAN));
        let effort = f64::from(low) + share * f64::from(high - low);
        let seconds = before * (at / before).powf(share);
        Ok(Self { bytes, level, effort, seconds, rival_seconds })
    }

    /// Of the seconds.
    fn ratio(&self) -> f64 {
        if self.effort.is_finite() { self.seconds / self.rival_seconds } else { f64::INFINITY }
    }

    fn values(&self) -> [f64; 5] {
        [self.bytes, self.level, self.effort, self.seconds, self.rival_seconds]
    }
}

impl From<[f64; 5]> for Race {
    fn from([bytes, level, effort, seconds, rival_seconds]: [f64; 5]) -> Self {
        Self { bytes, level, effort, seconds, rival_seconds }
    }
}

/// Two efforts, and the share of the way from one to the other at which a level is reached.
struct Between {
    efforts: [u8; 2],
    share: f64,
}

/// Where a level lies between efforts, of which each has its own and only the last may reach it; `None` if it does not.
fn between(level: f64, efforts: &[(u8, f64)]) -> Option<Between> {
    let (&(last, best), before) = efforts.split_last()?;
    let (low, share) = match before.last() {
        Some(&(before, less)) => (before, (level - less) / (best - less)),
        None => (last, 1.0),
    };
    (best >= level).then_some(Between { efforts: [low, last], share })
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_level_is_reached_between_two_efforts() {
        let at = |level: f64, efforts: &[(u8, f64)]| {
            between(level, efforts).map(|Between { efforts, share }| (efforts, share))
        };
        assert_eq!(at(60.0, &[(1, 61.0)]), Some(([1, 1], 1.0)));
        let efforts = [(1, 50.0), (2, 58.0), (3, 62.0)];
        assert_eq!(at(61.0, &efforts), Some(([2, 3], 0.75)));
        assert_eq!(at(62.0, &efforts), Some(([2, 3], 1.0)));
        assert_eq!(at(63.0, &efforts), None);
    }

    #[test]
    fn a_race_that_is_not_won_has_no_ratio() {
        let race = Race { bytes: 1.0, level: 60.0, effort: 2.5, seconds: 3.0, rival_seconds: 2.0 };
        assert_eq!((race.ratio(), cell(race.ratio())), (1.5, "1.50".to_owned()));
        let lost = Race { effort: f64::INFINITY, ..race };
        assert_eq!(cell(lost.ratio()), "never");
        assert_eq!(Race::from(lost.values()), lost);
    }
}
