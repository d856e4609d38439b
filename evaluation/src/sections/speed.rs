//! Encoding and decoding time against PSNR, of our codec and the baselines.

use anyhow::Result;
use image_gip::{Target, Threads};

use super::growth;
use super::rate::RateStore;
use crate::baselines::{BASELINES, DESCRIPTION};
use crate::bench::{Bench, timing_version};
use crate::comparison::{Better, NamedFigures, better_than};
use crate::gip;
use crate::pictures::TestPicture;
use crate::plot::{Corner, Plot, Scale, Series};
use crate::provenance::cores;
use crate::table::Table;

/// The rate of all files, approximately, in bits per pixel.
const RATE: f64 = 0.5;
/// How many pictures are coded.
const PICTURES: usize = 8;
const QUICK_PICTURES: usize = 2;
const EFFORTS: [u8; 9] = [1, 2, 3, 4, 5, 6, 7, 8, 9];
const QUICK_EFFORTS: [u8; 4] = [1, 3, 5, 7];
/// The baselines' times are medians over so many runs.
const REPEATS: u32 = 5;

/// What the codecs are compared by.
const CRITERIA: [(&str, Better); 5] = [
    ("PSNR at about this rate", Better::Higher),
    ("encoding time with one thread", Better::Lower),
    ("encoding time with all", Better::Lower),
    ("decoding time with one thread", Better::Lower),
    ("decoding time with all", Better::Lower),
];

pub(crate) fn measure(bench: &mut Bench) -> Result<String> {
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
    for (name, title, seconds, unit) in [
        (
            "speed-encode.svg",
            "Encoding, all threads",
            CodecRow::encoding as fn(&CodecRow) -> f64,
            "seconds",
        ),
        ("speed-decode.svg", "Decoding, all threads", CodecRow::decoding, "milliseconds"),
    ] {
        let factor = if unit == "milliseconds" { 1000.0 } else { 1.0 };
        plot_scatter(bench, name, title, &rows, &|row| factor * seconds(row), unit)?;
        text.push_str(&format!("\n![{title}]({name})\n"));
    }
    text.push_str(&growth::measure(bench)?);
    Ok(text)
}

/// A codec at a setting, on average over the pictures.
#[derive(Clone, Debug)]
struct CodecRow {
    codec: &'static str,
    setting: String,
    rate: f64,
    psnr: f64,
    /// Seconds with one thread and with all.
    encode: [f64; 2],
    decode: [f64; 2],
}

impl CodecRow {
    fn encoding(&self) -> f64 {
        self.encode[1]
    }

    fn decoding(&self) -> f64 {
        self.decode[1]
    }
}

fn pictures(bench: &Bench) -> Vec<TestPicture> {
    bench.sample(if bench.quick { QUICK_PICTURES } else { PICTURES })
}

fn measure_all(bench: &mut Bench) -> Result<Vec<CodecRow>> {
    let mut store = bench.store(
        "speed.csv",
        ["codec", "quality", "threads", "image"],
        ["bytes", "bpp", "psnr", "encode_seconds", "decode_seconds"],
    )?;
    let mut files = RateStore::open(bench)?;
    let pictures = pictures(bench);
    let efforts: &[u8] = if bench.quick { &QUICK_EFFORTS } else { &EFFORTS };
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
                Ok(values(picture, measured.bytes, measured.distortion.psnr, times))
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
                Ok(values(picture, trip.bytes, trip.distortion.psnr, times))
            })
        })?);
    }
    Ok(rows)
}

/// The setting whose rate is nearest to `wanted`, by bisection. `settings` go from small files to
/// large ones.
pub(super) fn nearest<'a>(
    settings: &[&'a str],
    wanted: f64,
    mut rate: impl FnMut(&str) -> Result<f64>,
) -> Result<&'a str> {
    let (mut low, mut high) = (0, settings.len() - 1);
    while high - low > 1 {
        let middle = usize::midpoint(low, high);
        if rate(settings[middle])? < wanted { low = middle } else { high = middle }
    }
    let below = wanted / rate(settings[low])?;
    let above = rate(settings[high])? / wanted;
    Ok(settings[if below.max(1.0 / below) < above.max(1.0 / above) { low } else { high }])
}

fn thread_label(threads: Threads) -> &'static str {
    if threads == Threads::One { "one" } else { "all" }
}

fn values(picture: &TestPicture, bytes: f64, psnr: f64, [encode, decode]: [f64; 2]) -> [f64; 5] {
    [bytes, picture.rate(bytes), psnr, encode, decode]
}

fn row(
    codec: &'static str,
    setting: &str,
    pictures: &[TestPicture],
    mut get: impl FnMut(usize, Threads) -> Result<[f64; 5]>,
) -> Result<CodecRow> {
    let mut means = Vec::new();
    for threads in [Threads::One, Threads::Pool] {
        let mut sums = [0.0; 5];
        for index in 0..pictures.len() {
            for (sum, value) in sums.iter_mut().zip(get(index, threads)?) {
                *sum += value / pictures.len() as f64;
            }
        }
        means.push(sums);
    }
    let [_, rate, psnr, ..] = means[0];
    Ok(CodecRow {
        codec,
        setting: setting.to_owned(),
        rate,
        psnr,
        encode: [means[0][3], means[1][3]],
        decode: [means[0][4], means[1][4]],
    })
}

fn table(rows: &[CodecRow]) -> String {
    let mut table = Table::new(&[
        "codec",
        "setting",
        "bpp",
        "PSNR in dB",
        "encode s, one thread",
        "all",
        "decode ms, one thread",
        "all",
    ]);
    for row in rows {
        let mut cells = vec![row.codec.to_owned(), row.setting.clone()];
        cells.push(format!("{:.3}", row.rate));
        cells.push(format!("{:.2}", row.psnr));
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
        let [encode, decode] = [row.encode, row.decode];
        (row.codec.to_owned(), vec![row.psnr, encode[0], encode[1], decode[0], decode[1]])
    };
    let others: Vec<NamedFigures> =
        rows.iter().filter(|row| row.codec != gip::NAME).map(named).collect();
    let (name, figures) = named(ours);
    better_than(
        &CRITERIA,
        &(format!("{name} at its default effort ({})", gip::EFFORT), figures),
        &others,
    )
}

fn plot_scatter(
    bench: &Bench,
    name: &str,
    title: &str,
    rows: &[CodecRow],
    time: &dyn Fn(&CodecRow) -> f64,
    unit: &str,
) -> Result<()> {
    let mut series: Vec<Series> = Vec::new();
    for row in rows {
        let point = (time(row), row.psnr);
        match series.iter_mut().find(|series| series.name == row.codec) {
            Some(series) => series.points.push(point),
            None => series.push(Series { name: row.codec.to_owned(), points: vec![point] }),
        }
    }
    let plot = Plot {
        title: &format!("{title}: about {RATE} bits per pixel"),
        x: (unit, Scale::Logarithmic),
        y: ("PSNR in dB", Scale::Linear),
        legend: Corner::UpperLeft,
    };
    plot.write(&bench.path(name), &series)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_nearest_setting_is_found() {
        let find = |rates: &[f64]| {
            let names: Vec<String> = rates.iter().map(f64::to_string).collect();
            let names: Vec<&str> = names.iter().map(String::as_str).collect();
            nearest(&names, 0.5, |name| Ok(name.parse()?)).expect("all are numbers").to_owned()
        };
        assert_eq!(find(&[0.1, 0.2, 0.45, 0.6, 0.9]), "0.45");
        assert_eq!(find(&[0.1, 0.2, 0.3, 0.52, 0.9]), "0.52");
        assert_eq!(find(&[0.1, 0.2]), "0.2");
        assert_eq!(find(&[0.7, 0.8, 0.9]), "0.7");
        assert_eq!(find(&[0.4]), "0.4");
    }
}
