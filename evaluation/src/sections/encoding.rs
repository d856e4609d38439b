//! What each effort costs, and what single pictures cost.

use anyhow::Result;
use image_gip::{ColorModel, Encoder, Source, Target, Threads};

use super::ranges::short;
use crate::bench::Bench;
use crate::pictures::{self, TestPicture};
use crate::store::Store;
use crate::table::{Table, mean, median};
use crate::{gip, memory};

/// An encoding is timed so often, or until all of its runs have taken so many seconds.
const RUNS: usize = 5;
const SECONDS: f64 = 2.0;
/// The tiles of the largest picture: 25 megapixels.
const TILES: (u32, u32) = (12, 8);
const TILE: u32 = 512;

/// The set of large pictures, each of which takes minutes at the highest efforts: they go up to the default.
pub(super) const LARGE: &str = "Large pictures";

/// Measurements of our encoder: PSNR, seconds with one thread and with all, peak memory in bytes.
type EncodingStore = Store<2, 4>;

/// An encoding of one picture with an effort.
#[derive(Clone, Copy, Debug, PartialEq)]
struct Encoding {
    megapixels: f64,
    psnr: f64,
    /// Seconds with one thread and with all.
    seconds: [f64; 2],
    memory: f64,
}

/// What each effort costs on sets of pictures, each with its name, in files of about `rate` bits per pixel.
pub(super) fn efforts(bench: &Bench, sets: &[(&str, &[TestPicture])], rate: f64) -> Result<String> {
    let mut text = format!(
        "\n### Efforts\n\nCompared with each other: our encoder, tuned for PSNR, asked for {rate} bits per pixel. \
         Times are those of the encoder from samples in memory to a verified file in memory, of one thread and of \
         all in turns; all where none are named. Memory is the encoder's peak memory without the source. PSNR is \
         a mean over the pictures, all else medians. Large pictures go up to the default effort.\n",
    );
    for &(name, pictures) in sets {
        if !pictures.is_empty() {
            let names: Vec<&str> = pictures.iter().map(|picture| short(&picture.name)).collect();
            text.push_str(&format!("\n{name}, {}:\n", names.join(", ")));
            text.push_str(&set(bench, name, pictures, rate)?);
        }
    }
    Ok(text)
}

fn set(bench: &Bench, name: &str, pictures: &[TestPicture], rate: f64) -> Result<String> {
    let mut efforts: &[u8] = if bench.quick { &gip::QUICK_EFFORTS } else { &gip::EFFORTS };
    if name == LARGE {
        let to_default = efforts.iter().take_while(|&&effort| effort <= gip::EFFORT).count();
        efforts = &efforts[..to_default];
    }
    let mut store: EncodingStore = bench.store(
        "encoding.csv",
        ["effort", "image"],
        ["psnr", "seconds_one", "seconds_all", "peak_memory"],
    )?;
    let mut by_picture = Vec::new();
    for picture in pictures {
        let encodings = efforts.iter().map(|&effort| {
            let key = [&effort.to_string(), picture.name.as_str()];
            let values = store.get(&bench.product, key, || {
                let encoder = gip::psnr_encoder(effort).with_target(Target::BitsPerPixel(rate));
                measured(&encoder, picture)
            })?;
            let [psnr, one, all, memory] = values;
            let megapixels = 1e-6 * picture.pixels();
            Ok(Encoding { megapixels, psnr, seconds: [one, all], memory })
        });
        by_picture.push(encodings.collect::<Result<Vec<_>>>()?);
    }
    let costs = costs(efforts, &by_picture);
    for cost in &costs {
        let named = |figure: &str| format!("efforts/{name}/{figure}/{}", cost.effort);
        bench.figure(named("PSNR in dB"), cost.psnr, "dB");
        bench.figure(named("seconds per megapixel"), cost.seconds[1], "s");
    }
    Ok(effort_table(&costs))
}

/// PSNR, seconds with one thread and with all in turns, peak memory with all.
fn measured(encoder: &Encoder, picture: &TestPicture) -> Result<[f64; 4]> {
    let source = Source::new_u8(picture.width, picture.height, ColorModel::Rgb, &picture.rgb)?;
    let (mut one, mut all) = (Vec::new(), Vec::new());
    let encode = |threads| encoder.clone().with_threads(threads).encode(&source);
    let (report, memory) = loop {
        let (encoded, memory) = memory::peak(|| encode(Threads::Pool));
        let report = encoded?.report;
        all.push(report.seconds);
        one.push(encode(Threads::One)?.report.seconds);
        if all.len() == RUNS || one.iter().chain(&all).sum::<f64>() > SECONDS {
            break (report, memory);
        }
    };
    let [one, all] = [one, all].map(|seconds| median(seconds).unwrap_or(f64::NAN));
    Ok([report.psnr, one, all, memory])
}

/// PSNR, seconds and peak memory with all threads.
fn with_all_threads(encoder: &Encoder, picture: &TestPicture) -> Result<[f64; 3]> {
    let mut times = Vec::new();
    loop {
        let (encoded, memory) = memory::peak(|| gip::file(encoder.clone(), picture, Threads::Pool));
        let report = encoded?.report;
        times.push(report.seconds);
        if times.len() == RUNS || times.iter().sum::<f64>() > SECONDS {
            return Ok([report.psnr, median(times).unwrap_or(f64::NAN), memory]);
        }
    }
}

/// What an effort costs, by medians over pictures: seconds per megapixel with one thread and with all,
/// their ratio, and bytes of memory per pixel. PSNR is a mean.
#[derive(Clone, Copy, Debug)]
struct Cost {
    effort: u8,
    psnr: f64,
    seconds: [f64; 2],
    ratio: f64,
    memory: f64,
}

fn costs(efforts: &[u8], by_picture: &[Vec<Encoding>]) -> Vec<Cost> {
    let all = efforts.iter().enumerate().map(|(index, &effort)| {
        let each = || by_picture.iter().map(move |encodings| encodings[index]);
        let middle = |of: fn(Encoding) -> f64| median(each().map(of)).unwrap_or(f64::NAN);
        Cost {
            effort,
            psnr: mean(each().map(|encoding| encoding.psnr)).unwrap_or(f64::NAN),
            seconds: [
                middle(|encoding| encoding.seconds[0] / encoding.megapixels),
                middle(|encoding| encoding.seconds[1] / encoding.megapixels),
            ],
            ratio: middle(|encoding| encoding.seconds[0] / encoding.seconds[1]),
            memory: middle(|encoding| encoding.memory / encoding.megapixels * 1e-6),
        }
    });
    all.collect()
}

fn effort_table(costs: &[Cost]) -> String {
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
    for &Cost { effort, psnr, seconds: [one, all], ratio, memory } in costs {
        table.row(&[
            effort.to_string(),
            format!("{psnr:.2}"),
            format!("{one:.2}"),
            format!("{all:.2}"),
            format!("{ratio:.2}"),
            before.map_or_else(|| "-".into(), |before: f64| format!("{:.2}", all / before)),
            format!("{memory:.1}"),
        ]);
        before = Some(all);
    }
    table.finish()
}

/// What single pictures of all sets cost at the default effort, and one of 25 megapixels.
pub(super) fn single_pictures(bench: &Bench, rate: f64) -> Result<String> {
    let sets = bench.all_sets();
    let mut store = bench.store(
        "encoding-pictures.csv",
        ["set", "image"],
        ["psnr", "seconds_all", "peak_memory"],
    )?;
    let encoder = gip::encoder(gip::EFFORT).with_target(Target::BitsPerPixel(rate));
    let (mut names, mut times) = (Vec::new(), Vec::new());
    let mut all = Vec::new();
    for set in &sets {
        names.push(set.name);
        for picture in &set.pictures {
            let key = [set.name, &picture.name];
            let [_, seconds, _] =
                store.get(&bench.product, key, || with_all_threads(&encoder, picture))?;
            times.push((
                seconds / picture.pixels() * 1e6,
                format!("{} ({})", picture.name, set.name),
            ));
            all.push(picture);
        }
    }
    times.sort_by(|a, b| a.0.total_cmp(&b.0));
    let middle = median(times.iter().map(|&(seconds, _)| seconds)).unwrap_or(f64::NAN);
    let most = times.last().map_or(f64::NAN, |&(seconds, _)| seconds);
    bench.figure("single pictures/slowest over median", most / middle, "");
    let mut table = Table::new(&["picture", "s per megapixel", "over the median"]);
    let slowest = times.len().saturating_sub(5).max(1);
    for (seconds, name) in times.iter().take(1).chain(&times[slowest.min(times.len())..]) {
        let cells = [format!("{seconds:.2}"), format!("{:.2}", seconds / middle)];
        table.row(&[std::slice::from_ref(name), &cells[..]].concat());
    }
    let mut text = format!(
        "\n### Single pictures\n\nCompared with each other: the {} pictures of {}, at effort {} and {rate} bits per \
         pixel, with all threads. The median is {middle:.2} seconds per megapixel; these are the fastest and the \
         slowest.\n{}",
        times.len(),
        names.join(", "),
        gip::EFFORT,
        table.finish(),
    );
    if let Some(mosaic) = pictures::mosaic(&all, TILES, TILE) {
        let key = ["mosaic", mosaic.name.as_str()];
        let [_, seconds, memory] =
            store.get(&bench.product, key, || with_all_threads(&encoder, &mosaic))?;
        bench.figure("mosaic/megapixels", 1e-6 * mosaic.pixels(), "");
        bench.figure("mosaic/seconds", seconds, "s");
        text.push_str(&format!(
            "\nA picture of {:.0} megapixels, a mosaic of {} tiles of {TILE} x {TILE} pixels of these pictures, none of \
             them twice, takes {seconds:.1} seconds and {:.1} bytes of memory per pixel.\n",
            1e-6 * mosaic.pixels(),
            TILES.0 * TILES.1,
            memory / mosaic.pixels(),
        ));
    }
    Ok(text)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn efforts_are_told_per_megapixel() {
        let encoding = |seconds: f64| Encoding {
            megapixels: 2.0,
            psnr: 30.0,
            seconds: [2.0 * seconds, seconds],
            memory: 32e6,
        };
        let text = effort_table(&costs(&[1, 2], &[vec![encoding(1.0), encoding(3.0)]]));
        assert!(text.contains("| 1 | 30.00 | 1.00 | 0.50 | 2.00 | - | 16.0 |"), "{text}");
        assert!(text.contains("| 2 | 30.00 | 3.00 | 1.50 | 2.00 | 3.00 | 16.0 |"), "{text}");
    }
}
