//! What each effort costs, and how long it takes to reach the PSNR of other codecs.

use anyhow::{Context, Result};
use image_gip::{ColorModel, Source, Target, Threads};

use super::rate_store::RateStore;
use crate::baselines::{BASELINES, Baseline};
use crate::bench::{Bench, timing_version};
use crate::curve::Curve;
use crate::pictures::TestPicture;
use crate::store::Store;
use crate::table::{Table, mean, median};
use crate::versions::nearest;
use crate::{gip, memory};

const QUICK_EFFORTS: [u8; 3] = [1, 3, 5];
/// Those whose PSNR is to be reached.
const RIVALS: [&str; 2] = ["AVIF tune=psnr", "WebP"];
/// The rivals' times are medians over so many runs.
const REPEATS: u32 = 5;

/// Measurements of our encoder: PSNR, seconds, peak memory in bytes.
type EncodingStore = Store<3, 3>;

/// An encoding of one picture with an effort.
#[derive(Clone, Copy, Debug, PartialEq)]
struct Encoding {
    megapixels: f64,
    psnr: f64,
    /// Seconds with one thread and with all.
    seconds: [f64; 2],
    memory: f64,
}

/// Of files with about `rate` bits per pixel.
pub(super) fn measure(bench: &mut Bench, kodak: &[TestPicture], rate: f64) -> Result<String> {
    let mut text = format!(
        "\n### Efforts\n\nCompared with each other, then with the named codecs: our encoder, tuned \
         for PSNR, asked for {rate} bits per pixel. Times are those of the encoder from samples in \
         memory to a verified file in memory; all threads where none are named. Memory is the \
         encoder's peak memory without the source. The times to another codec's PSNR at {rate} bits \
         per pixel (interpolated between its settings) are interpolated between efforts, and divided \
         by that codec's own, with all threads, too: medians over the pictures, and the least and \
         the largest. Where the lowest effort is better already, its time is taken.\n",
    );
    let large = bench.large.clone();
    for (name, pictures) in [("Kodak", kodak), ("Large pictures", &large)] {
        if !pictures.is_empty() {
            text.push_str(&format!("\n{name}, {} pictures:\n", pictures.len()));
            text.push_str(&set(bench, pictures, rate)?);
        }
    }
    Ok(text)
}

fn set(bench: &mut Bench, pictures: &[TestPicture], rate: f64) -> Result<String> {
    let efforts: &[u8] = if bench.quick { &QUICK_EFFORTS } else { &gip::EFFORTS };
    let mut store: EncodingStore = bench.store(
        "encoding.csv",
        ["effort", "threads", "image"],
        ["psnr", "encode_seconds", "encode_peak_memory"],
    )?;
    let mut by_picture = Vec::new();
    for picture in pictures {
        let encodings =
            efforts.iter().map(|&effort| encoding(&mut store, bench, effort, picture, rate));
        by_picture.push(encodings.collect::<Result<Vec<_>>>()?);
    }
    let mut text = effort_table(efforts, &by_picture);
    let (mut files, mut times) = (RateStore::open(bench)?, rival_times(bench)?);
    let mut table = Table::new(&["time to the PSNR of", "over its own time", "from", "to"]);
    for name in RIVALS {
        let rival = BASELINES.iter().find(|baseline| baseline.name == name).context(name)?;
        let mut ratios = Vec::new();
        for (picture, encodings) in pictures.iter().zip(&by_picture) {
            let (psnr, seconds) =
                rival_at_rate(&mut files, &mut times, bench, rival, picture, rate)?;
            ratios.push(seconds_to(psnr, encodings).unwrap_or(f64::INFINITY) / seconds);
        }
        let cell = |value: f64| format!("{value:.2}");
        let least = ratios.iter().copied().fold(f64::INFINITY, f64::min);
        let most = ratios.iter().copied().fold(0.0, f64::max);
        let middle = median(ratios).unwrap_or(f64::NAN);
        table.row(&[name.to_owned(), cell(middle), cell(least), cell(most)]);
    }
    text.push_str(&table.finish());
    Ok(text)
}

fn encoding(
    store: &mut EncodingStore,
    bench: &Bench,
    effort: u8,
    picture: &TestPicture,
    rate: f64,
) -> Result<Encoding> {
    let mut with = |label: &str, threads: Threads| {
        store.get(&bench.product, [&effort.to_string(), label, &picture.name], || {
            let source =
                Source::new_u8(picture.width, picture.height, ColorModel::Rgb, &picture.rgb)?;
            let target = Target::BitsPerPixel(rate);
            let encoder = gip::psnr_encoder(effort).with_target(target).with_threads(threads);
            let (encoded, memory) = memory::peak(|| encoder.encode(&source));
            let report = encoded?.report;
            Ok([report.psnr, report.seconds, memory])
        })
    };
    let [psnr, one, _] = with("one", Threads::One)?;
    let [_, all, memory] = with("all", Threads::Pool)?;
    let megapixels = f64::from(picture.width) * f64::from(picture.height) * 1e-6;
    Ok(Encoding { megapixels, psnr, seconds: [one, all], memory })
}

/// What each effort costs per megapixel.
fn effort_table(efforts: &[u8], by_picture: &[Vec<Encoding>]) -> String {
    let mut table = Table::new(&[
        "effort",
        "PSNR in dB",
        "s per megapixel, one thread",
        "all",
        "one over all",
        "times the effort before",
        "bytes per pixel",
    ]);
    let mut before = None;
    for (index, effort) in efforts.iter().enumerate() {
        let middle = |of: fn(&Encoding) -> f64| {
            median(by_picture.iter().map(|encodings| of(&encodings[index]))).unwrap_or(f64::NAN)
        };
        let psnr = mean(by_picture.iter().map(|encodings| encodings[index].psnr));
        let all = middle(|encoding| encoding.seconds[1] / encoding.megapixels);
        table.row(&[
            effort.to_string(),
            format!("{:.2}", psnr.unwrap_or(f64::NAN)),
            format!("{:.2}", middle(|encoding| encoding.seconds[0] / encoding.megapixels)),
            format!("{all:.2}"),
            format!("{:.2}", middle(|encoding| encoding.seconds[0] / encoding.seconds[1])),
            before.map_or_else(|| "-".into(), |before: f64| format!("{:.2}", all / before)),
            format!("{:.1}", middle(|encoding| encoding.memory / encoding.megapixels * 1e-6)),
        ]);
        before = Some(all);
    }
    table.finish()
}

/// The encoding times of other codecs in seconds, with all threads.
fn rival_times(bench: &Bench) -> Result<Store<2, 1>> {
    bench.store("encoding-others.csv", ["codec", "image"], ["encode_seconds"])
}

/// A codec's PSNR in dB at a rate, and its encoding time at the nearest setting with all threads.
fn rival_at_rate(
    files: &mut RateStore,
    times: &mut Store<2, 1>,
    bench: &mut Bench,
    rival: &Baseline,
    picture: &TestPicture,
    rate: f64,
) -> Result<(f64, f64)> {
    let product = bench.product.clone();
    let (worker, versions) = bench.baselines()?;
    let mut curve = Vec::new();
    for setting in rival.settings {
        let point = files.baseline(worker, &versions, rival, setting, picture)?;
        curve.push((point.rate, point.distortion.psnr));
    }
    let setting = nearest(rival.settings, rate, |setting| {
        Ok(files.baseline(worker, &versions, rival, setting, picture)?.rate)
    })?;
    let [seconds] =
        times.get(&timing_version(&product, &versions), [rival.id, &picture.name], || {
            let trip = worker.round_trip(rival.id, setting, picture, None, [REPEATS, 1])?;
            Ok([trip.encode_seconds])
        })?;
    let psnr = Curve::new(curve).quality(rate).context("no file of about this rate")?;
    Ok((psnr, seconds))
}

/// Seconds with all threads until a PSNR is reached; `None` if no effort reaches it.
fn seconds_to(psnr: f64, encodings: &[Encoding]) -> Option<f64> {
    let reached = encodings.iter().position(|encoding| encoding.psnr >= psnr)?;
    let at = &encodings[reached];
    let Some(before) = reached.checked_sub(1).map(|index| &encodings[index]) else {
        return Some(at.seconds[1]);
    };
    let share = (psnr - before.psnr) / (at.psnr - before.psnr);
    Some(before.seconds[1] * (at.seconds[1] / before.seconds[1]).powf(share))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_time_to_a_psnr_is_that_of_the_first_effort_that_reaches_it() {
        let encoding = |psnr: f64, all: f64| Encoding {
            megapixels: 1.0,
            psnr,
            seconds: [2.0 * all, all],
            memory: 1.0,
        };
        let efforts = [encoding(30.0, 1.0), encoding(32.0, 4.0), encoding(32.5, 8.0)];
        assert_eq!(seconds_to(29.0, &efforts), Some(1.0));
        assert_eq!(seconds_to(31.0, &efforts), Some(2.0));
        assert_eq!(seconds_to(32.0, &efforts), Some(4.0));
        assert_eq!(seconds_to(33.0, &efforts), None);
    }

    #[test]
    fn efforts_are_told_per_megapixel() {
        let encoding = |seconds: f64| Encoding {
            megapixels: 2.0,
            psnr: 30.0,
            seconds: [2.0 * seconds, seconds],
            memory: 32e6,
        };
        let text = effort_table(&[1, 2], &[vec![encoding(1.0), encoding(3.0)]]);
        assert!(text.contains("| 1 | 30.00 | 1.00 | 0.50 | 2.00 | - | 16.0 |"), "{text}");
        assert!(text.contains("| 2 | 30.00 | 3.00 | 1.50 | 2.00 | 3.00 | 16.0 |"), "{text}");
    }
}
