//! Encoding and decoding time against quality, of our codec and the baselines.

use anyhow::Result;
use image_gip::{Target, Threads};

use super::rate_store::RateStore;
use super::{encoding, growth, race};
use crate::baselines::{BASELINES, DESCRIPTION};
use crate::bench::{Bench, timing_version};
use crate::comparison::{Better, NamedFigures, better_than};
use crate::gip;
use crate::metric::Metric;
use crate::pictures::{Distortion, TestPicture};
use crate::plot::{Corner, Plot, Scale, Series};
use crate::provenance::cores;
use crate::table::{Table, mean};
use crate::versions::nearest;

/// The rate of all files, approximately, in bits per pixel.
const RATE: f64 = 0.5;
/// How many pictures are coded.
const PICTURES: usize = 6;
const QUICK_PICTURES: usize = 1;
/// The baselines' times are medians over so many runs.
const REPEATS: u32 = 5;

/// The times that codecs are compared by, beside all metrics.
const TIMES: [&str; 4] = [
    "encoding time with one thread",
    "encoding time with all",
    "decoding time with one thread",
    "decoding time with all",
];

pub(crate) fn measure(bench: &mut Bench) -> Result<String> {
    let (kodak, large) = (pictures(bench), bench.large.clone());
    let sets = [("Kodak", &kodak[..]), (encoding::LARGE, &large[..])];
    // What matters most comes first, so that a run that is interrupted has it.
    let races = race::measure(bench, &sets)?;
    let rows = measure_all(bench)?;
    let mut text = format!(
        "Compared with: {DESCRIPTION} On each picture they are at the setting whose rate is \
         nearest to {RATE} bits per pixel; ours is asked for {RATE} bits per pixel at every \
         effort. Times are wall-clock times from samples in memory to a file in memory and back. \
         Means; {}; all threads are {}. JPEG, JPEG 2000 and WebP use one thread in any case. Other \
         programs that run on the machine make the times longer.\n",
        bench.pictures_used(pictures(bench).len()),
        cores(),
    );
    text.push_str(&table(&rows));
    text.push_str(&worse_than_baselines(&rows));
    for metric in [Metric::Ssimulacra2, Metric::Psnr] {
        for (title, milliseconds) in [
            ("Encoding", CodecRow::encoding as fn(&CodecRow) -> f64),
            ("Decoding", CodecRow::decoding),
        ] {
            let name = format!("speed-{title}-{}.svg", metric.name()).to_lowercase();
            let title = format!("{title}, all threads, by {}", metric.name());
            plot_scatter(bench, &name, &title, &rows, milliseconds, metric)?;
            text.push_str(&format!("\n![{title}]({name})\n"));
        }
    }
    text.push_str(&races);
    let large = bench.large_sample();
    let sets = [("Kodak", &kodak[..]), (encoding::LARGE, &large[..])];
    text.push_str(&encoding::efforts(bench, &sets, RATE)?);
    text.push_str(&encoding::single_pictures(bench, RATE)?);
    text.push_str(&growth::measure(bench)?);
    Ok(text)
}

/// A codec at a setting, on average over the pictures.
#[derive(Clone, Debug)]
struct CodecRow {
    codec: &'static str,
    setting: String,
    rate: f64,
    /// In the order of [`Metric::ALL`].
    levels: [f64; 5],
    /// Seconds with one thread and with all.
    encode: [f64; 2],
    decode: [f64; 2],
}

impl CodecRow {
    /// Milliseconds with all threads.
    fn encoding(&self) -> f64 {
        1000.0 * self.encode[1]
    }

    fn decoding(&self) -> f64 {
        1000.0 * self.decode[1]
    }
}

fn pictures(bench: &Bench) -> Vec<TestPicture> {
    bench.sample(if bench.quick { QUICK_PICTURES } else { PICTURES })
}

fn measure_all(bench: &mut Bench) -> Result<Vec<CodecRow>> {
    let columns = Distortion::columns_of_file(&["encode_seconds", "decode_seconds"]);
    let keys = ["codec", "quality", "threads", "image"];
    let mut store = bench.store("speed.csv", keys, columns)?;
    let mut files = RateStore::open(bench)?;
    let pictures = pictures(bench);
    let efforts: &[u8] = if bench.quick { &gip::QUICK_EFFORTS } else { &gip::EFFORTS };
    let product = bench.product.clone();
    let (worker, versions) = bench.baselines()?;
    let mut rows = Vec::new();
    for &effort in efforts {
        let setting = format!("{RATE} bpp, effort {effort}");
        rows.push(row(gip::NAME, &format!("effort {effort}"), &pictures, |index, threads| {
            let picture = &pictures[index];
            let key = [gip::NAME, &setting, thread_label(threads), &picture.name];
            store.get(&product, key, || {
                let encoder = gip::encoder(effort).with_target(Target::BitsPerPixel(RATE));
                let measured = gip::encode(encoder, picture, threads)?;
                let decode = gip::decode_seconds(&measured.file, threads)?;
                let times = [measured.report.seconds, decode];
                Ok(values(picture, measured.bytes, &measured.distortion, times))
            })
        })?);
    }
    for baseline in &BASELINES {
        let mut settings = Vec::new();
        for picture in &pictures {
            let rate = |setting: &str| {
                let point = files.baseline(worker, &versions, baseline, setting, picture)?;
                Ok(point.rate)
            };
            settings.push(nearest(baseline.settings, RATE, rate)?);
        }
        rows.push(row(baseline.name, &settings.join(", "), &pictures, |index, threads| {
            let (setting, picture) = (settings[index], &pictures[index]);
            let key = [baseline.id, setting, thread_label(threads), &picture.name];
            store.get(&timing_version(&product, &versions), key, || {
                let threads = (threads == Threads::One).then_some(1);
                let trip =
                    worker.round_trip(baseline.id, setting, picture, threads, [REPEATS; 2])?;
                let times = [trip.encode_seconds, trip.decode_seconds];
                let distortion = picture.distortion(&trip.decoded)?;
                Ok(values(picture, trip.bytes, &distortion, times))
            })
        })?);
    }
    Ok(rows)
}

fn thread_label(threads: Threads) -> &'static str {
    if threads == Threads::One { "one" } else { "all" }
}

fn values(
    picture: &TestPicture,
    bytes: f64,
    distortion: &Distortion,
    [encode, decode]: [f64; 2],
) -> [f64; 9] {
    let [psnr, ms_ssim, ssimulacra2, butteraugli, cvvdp] = distortion.values();
    [bytes, picture.rate(bytes), psnr, ms_ssim, ssimulacra2, butteraugli, cvvdp, encode, decode]
}

/// Means over the pictures. `get` measures one with a number of threads.
fn row(
    codec: &'static str,
    setting: &str,
    pictures: &[TestPicture],
    mut get: impl FnMut(usize, Threads) -> Result<[f64; 9]>,
) -> Result<CodecRow> {
    let mut all = |threads| -> Result<Vec<[f64; 9]>> {
        (0..pictures.len()).map(|picture| get(picture, threads)).collect()
    };
    let (one, pool) = (all(Threads::One)?, all(Threads::Pool)?);
    let of = |all: &[[f64; 9]], column: usize| {
        mean(all.iter().map(|values| values[column])).unwrap_or(f64::NAN)
    };
    let level = |metric: Metric| {
        let levels = one
            .iter()
            .map(|&[_, _, distortion @ .., _, _]| metric.level(&Distortion::from(distortion)));
        metric.mean(levels).unwrap_or(f64::NAN)
    };
    Ok(CodecRow {
        codec,
        setting: setting.to_owned(),
        rate: of(&one, 1),
        levels: Metric::ALL.map(level),
        encode: [of(&one, 7), of(&pool, 7)],
        decode: [of(&one, 8), of(&pool, 8)],
    })
}

fn table(rows: &[CodecRow]) -> String {
    let mut columns = vec!["codec", "setting", "bpp"];
    columns.extend(Metric::ALL.map(Metric::with_unit));
    columns.extend(["encode s, one thread", "all", "decode ms, one thread", "all"]);
    let mut table = Table::new(&columns);
    for row in rows {
        let mut cells = vec![row.codec.to_owned(), row.setting.clone()];
        cells.push(format!("{:.3}", row.rate));
        cells.extend(Metric::ALL.iter().zip(row.levels).map(|(metric, level)| metric.cell(level)));
        cells.extend(row.encode.map(|seconds| format!("{seconds:.3}")));
        cells.extend(row.decode.map(|seconds| format!("{:.1}", 1000.0 * seconds)));
        table.row(&cells);
    }
    table.finish()
}

/// In what our codec at its default effort is worse than the baselines.
fn worse_than_baselines(rows: &[CodecRow]) -> String {
    let default = format!("effort {}", gip::EFFORT);
    let Some(ours) = rows.iter().find(|row| row.setting == default) else {
        return String::new();
    };
    let named = |row: &CodecRow| {
        (row.codec.to_owned(), [&row.levels[..], &row.encode, &row.decode].concat())
    };
    let others: Vec<NamedFigures> =
        rows.iter().filter(|row| row.codec != gip::NAME).map(named).collect();
    let metrics = Metric::ALL.map(|metric| format!("{} at about this rate", metric.name()));
    let mut figures: Vec<_> =
        metrics.iter().map(|metric| (metric.as_str(), Better::Higher)).collect();
    figures.extend(TIMES.map(|time| (time, Better::Lower)));
    let (name, values) = named(ours);
    let ours = (format!("{name} at its default effort ({})", gip::EFFORT), values);
    better_than(&figures, &ours, &others)
}

fn plot_scatter(
    bench: &Bench,
    name: &str,
    title: &str,
    rows: &[CodecRow],
    milliseconds: fn(&CodecRow) -> f64,
    metric: Metric,
) -> Result<()> {
    let index = Metric::ALL.iter().position(|&each| each == metric).expect("it is one of all");
    let mut series: Vec<Series> = Vec::new();
    for row in rows {
        let point = (milliseconds(row), metric.shown(row.levels[index]));
        match series.iter_mut().find(|series| series.name == row.codec) {
            Some(series) => series.points.push(point),
            None => series.push(Series { name: row.codec.to_owned(), points: vec![point] }),
        }
    }
    let plot = Plot {
        title: &format!("{title}: about {RATE} bits per pixel"),
        x: ("milliseconds", Scale::Logarithmic),
        y: (metric.with_unit(), Scale::Linear),
        legend: Corner::Beside,
    };
    plot.write(&bench.path(name), &series)
}
