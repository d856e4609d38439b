//! Decoding time, from a file in memory to 8-bit samples: ours and that of other decoders, measured
//! in the same run.

use std::sync::atomic::{AtomicUsize, Ordering};
use std::time::Instant;
use std::{array, thread};

use anyhow::{Context, Result};
use image_gip::{
    Decoder, Gaussian, Region, RenderOptions, StreamDecoder, Target, Threads, metrics,
};

use super::rate_store::RateStore;
use crate::baselines::{BASELINES, Baseline, SEQUENTIAL_JPEG};
use crate::bench::{Bench, timing_version};
use crate::comparison::list_or_none;
use crate::gip;
use crate::kernel_benchmark;
use crate::memory;
use crate::pictures::TestPicture;
use crate::provenance::cores;
use crate::table::{Table, mean, median};
use crate::versions::nearest;

/// Rates of the files, in bits per pixel.
const RATES: [f64; 3] = [0.25, 0.5, 1.0];
/// How many pictures are decoded.
const PICTURES: usize = 8;
const QUICK_PICTURES: usize = 1;
/// Parts of our decoder are timed as medians over so many runs.
const REPEATS: usize = 15;
/// Decoders that are compared take turns, because the speed of a machine drifts: so many turns of
/// so many runs each. With all threads there are more turns, because other programs disturb them
/// more.
const TURNS: usize = 21;
const TURNS_ALL_THREADS: usize = 63;
const RUNS_PER_TURN: usize = 5;
/// The sides of a picture are so many times those of its thumbnail.
const THUMBNAIL: u32 = 8;
/// The same for a preview from the first tenth of a file.
const PREVIEW: u32 = 4;
/// Bytes of a Gaussian in the decoder's list.
const GAUSSIAN_BYTES: f64 = size_of::<Gaussian>() as f64;
/// The picture of which a region is decoded: its width, rate and effort.
const LARGE_PICTURE: (u32, f64, u8) = (2048, 0.5, 2);
/// The side of the region in pixels.
const REGION: u32 = 128;

pub(crate) fn measure(bench: &mut Bench) -> Result<String> {
    let pictures = bench.sample(if bench.quick { QUICK_PICTURES } else { PICTURES });
    let mut text = format!(
        "Compared with: the decoders of libjpeg-turbo, libwebp, OpenJPEG, libavif with dav1d, and \
         libjxl, on files of the same pictures at about the same rate; {}. Decoding goes from a \
         file in memory to 8-bit RGB in memory that is allocated beforehand. Decoders that are \
         compared take turns: {TURNS} turns of {RUNS_PER_TURN} decodings each, \
         {TURNS_ALL_THREADS} turns where all threads are used. A time is the median over all \
         turns, a ratio the median of the ratios in each turn. The times of the other decoders \
         include some microseconds of Python.\n",
        bench.pictures_used(pictures.len()),
    );
    let mut files = RateStore::open(bench)?;
    let mut all = Vec::new();
    for rate in RATES {
        all.push(against_others(bench, &mut files, &pictures, rate)?);
    }
    text.push_str(&ratios(bench, &all));
    text.push_str(&breakdown(&all, &pictures));
    text.push_str(&region(bench)?);
    Ok(text)
}

/// A decoder at a rate.
struct DecoderRow {
    decoder: &'static str,
    /// For each picture: bits per pixel, PSNR, seconds, and our seconds divided by these.
    points: Vec<[f64; 4]>,
}

impl DecoderRow {
    /// Our time divided by this decoder's: the median over the pictures.
    fn ratio(&self) -> f64 {
        median(self.points.iter().map(|point| point[3])).unwrap_or(f64::NAN)
    }

    fn mean(&self, column: usize) -> f64 {
        mean(self.points.iter().map(|point| point[column])).unwrap_or(f64::NAN)
    }
}

/// What our decoder takes for one file; times are seconds with one thread.
#[derive(Clone, Copy, Debug)]
struct DecoderProfile {
    bytes: f64,
    psnr: f64,
    /// From the whole file to all samples.
    whole: f64,
    /// The speedup of all threads that decode one file together.
    scaling: f64,
    /// The speedup, in files per second, of all threads that decode a file each: what the machine
    /// allows.
    one_each: f64,
    /// From bytes to Gaussians.
    parse: f64,
    /// From no Gaussians to samples.
    output: f64,
    /// The speedup of decoding a thumbnail.
    thumbnail: f64,
    /// PSNR of the thumbnail against one rendered from all Gaussians.
    thumbnail_psnr: f64,
    /// From the first tenth of the bytes to samples, at full size and as a preview.
    tenth: [f64; 2],
    /// Number of Gaussians in the first tenth of the bytes.
    tenth_gaussians: f64,
    /// Peak memory with one thread, without the file and the output.
    memory: f64,
    gaussians: f64,
    /// Kernel evaluations.
    evaluations: f64,
}

/// Our file of a picture, encoded when it is first needed.
struct LazyFile<'a> {
    picture: &'a TestPicture,
    rate: f64,
    file: Option<gip::MeasuredFile>,
}

impl LazyFile<'_> {
    fn get(&mut self) -> Result<&gip::MeasuredFile> {
        if self.file.is_none() {
            let encoder = gip::encoder(gip::EFFORT).with_target(Target::BitsPerPixel(self.rate));
            self.file = Some(gip::encode(encoder, self.picture, Threads::Pool)?);
        }
        self.file.as_ref().context("it was just made")
    }
}

/// Times tasks that take turns: the median of each task's times, and the median over the turns of
/// the first task's time divided by each task's. A task returns its seconds.
fn interleaved<const N: usize>(
    turns: usize,
    mut tasks: [&mut dyn FnMut() -> Result<f64>; N],
) -> Result<([f64; N], [f64; N])> {
    let mut all = Vec::new();
    for _ in 0..turns {
        let mut turn = [0.0; N];
        for (time, task) in turn.iter_mut().zip(&mut tasks) {
            *time = task()?;
        }
        all.push(turn);
    }
    let of = |get: &dyn Fn(&[f64; N]) -> f64| median(all.iter().map(get)).unwrap_or(f64::NAN);
    let times = array::from_fn(|index| of(&|turn| turn[index]));
    Ok((times, array::from_fn(|index| of(&|turn| turn[0] / turn[index]))))
}

/// Seconds per decoding when every core of the machine decodes on its own.
fn one_file_each(file: &[u8], options: &RenderOptions, samples: usize) -> Result<f64> {
    let decodings = 2 * RUNS_PER_TURN * cores();
    let started = AtomicUsize::new(0);
    let start = Instant::now();
    thread::scope(|scope| {
        let work = || {
            let mut out = vec![0; samples];
            while started.fetch_add(1, Ordering::Relaxed) < decodings {
                render(file, options, &mut out)?;
            }
            Ok(())
        };
        let workers: Vec<_> = (0..cores()).map(|_| scope.spawn(work)).collect();
        workers.into_iter().try_for_each(|worker| worker.join().expect("it does not panic"))
    })
    .map(|()| start.elapsed().as_secs_f64() / decodings as f64)
}

fn ours(bench: &Bench, file: &mut LazyFile<'_>) -> Result<DecoderProfile> {
    let (picture, rate) = (file.picture, file.rate);
    let mut store = bench.store(
        "decode.csv",
        ["rate", "image"],
        [
            "bytes",
            "psnr",
            "seconds",
            "scaling",
            "one_each",
            "seconds_parse",
            "seconds_output",
            "thumbnail",
            "thumbnail_psnr",
            "seconds_tenth",
            "seconds_tenth_small",
            "gaussians_tenth",
            "memory",
            "gaussians",
            "evaluations",
        ],
    )?;
    let key = [&rate.to_string(), &picture.name];
    let values = store.get(&bench.product, key.map(String::as_str), || {
        let measured = file.get()?;
        let file = &measured.file;
        let mut out = vec![0; picture.rgb.len()];
        let one = RenderOptions::new().with_threads(Threads::One);
        let (rendered, held) = memory::peak(|| render(file, &one, &mut out));
        rendered?;
        let whole_turn = |options: &RenderOptions| {
            let mut out = vec![0; picture.rgb.len()];
            gip::median_seconds(RUNS_PER_TURN, || render(file, options, &mut out))
        };
        let all = RenderOptions::new();
        let ([whole, ..], [_, scaling, one_each]) = interleaved(
            TURNS_ALL_THREADS,
            [&mut || whole_turn(&one), &mut || whole_turn(&all), &mut || {
                one_file_each(file, &one, picture.rgb.len())
            }],
        )?;
        let nothing = one.clone().with_prefix(0);
        let mut stream = StreamDecoder::new();
        stream.feed(file)?;
        let picture_of = || stream.picture().expect("the file is whole");
        let (width, height) = (picture.width / THUMBNAIL, picture.height / THUMBNAIL);
        let small = one.clone().with_size(width, height);
        let (_, [_, faster]) = interleaved(
            TURNS,
            [&mut || whole_turn(&one), &mut || {
                gip::median_seconds(RUNS_PER_TURN, || thumbnail(file, &small, &mut out))
            }],
        )?;
        let mut of_all = vec![0; picture_of().output_len(&small)?];
        picture_of().render_u8(&small, &mut of_all)?;
        thumbnail(file, &small, &mut out)?;
        let thumbnail_psnr = metrics::psnr(&of_all, &out[..of_all.len()], 255.0);
        let tenth = &file[..file.len() / 10];
        let preview = one.clone().with_size(picture.width / PREVIEW, picture.height / PREVIEW);
        Ok([
            measured.bytes,
            measured.distortion.psnr,
            whole,
            scaling,
            one_each,
            seconds(|| Ok(StreamDecoder::new().feed(file).map(|_| ())?))?,
            seconds(|| Ok(picture_of().render_u8(&nothing, &mut out)?))?,
            faster,
            thumbnail_psnr,
            seconds(|| render_prefix(tenth, &one, &mut out))
                .context("of the first tenth of the file")?,
            seconds(|| render_prefix(tenth, &preview, &mut out))?,
            gip::open(tenth, |picture| Ok(picture.gaussians().len() as f64))?,
            held,
            measured.report.gaussians.into(),
            evaluations(stream.gaussians(), picture.width, picture.height),
        ])
    })?;
    let [bytes, psnr, whole, scaling, one_each, parse, output, rest @ ..] = values;
    let [
        thumbnail,
        thumbnail_psnr,
        tenth,
        preview,
        tenth_gaussians,
        memory,
        gaussians,
        evaluations,
    ] = rest;
    Ok(DecoderProfile {
        bytes,
        psnr,
        whole,
        scaling,
        one_each,
        parse,
        output,
        thumbnail,
        thumbnail_psnr,
        tenth: [tenth, preview],
        tenth_gaussians,
        memory,
        gaussians,
        evaluations,
    })
}

/// The least and the largest.
fn min_and_max(values: impl Iterator<Item = f64> + Clone) -> [f64; 2] {
    [values.clone().fold(f64::NAN, f64::min), values.fold(f64::NAN, f64::max)]
}

fn seconds(work: impl FnMut() -> Result<()>) -> Result<f64> {
    gip::median_seconds(REPEATS, work)
}

/// Decodes as many layers as the output size needs and renders them, into the first of the samples.
fn thumbnail(file: &[u8], options: &RenderOptions, samples: &mut [u8]) -> Result<()> {
    let mut decoder = Decoder::new(file)?;
    decoder.set_options(options.clone());
    let (width, height) = options.output_size(decoder.header());
    decoder.read_at_least(decoder.header().gaussians_for(width, height))?;
    let picture = decoder.picture()?;
    let length = picture.output_len(options)?;
    Ok(picture.render_u8(options, &mut samples[..length])?)
}

/// Decodes and renders a file.
fn render(file: &[u8], options: &RenderOptions, samples: &mut [u8]) -> Result<()> {
    let mut decoder = Decoder::new(file)?;
    decoder.set_options(options.clone());
    Ok(decoder.decode_into(samples)?)
}

/// Decodes and renders the Gaussians in a prefix of a file, into the first of the samples.
fn render_prefix(prefix: &[u8], options: &RenderOptions, samples: &mut [u8]) -> Result<()> {
    gip::open(prefix, |picture| {
        let length = picture.output_len(options)?;
        Ok(picture.render_u8(options, &mut samples[..length])?)
    })
}

/// Kernel evaluations of the decoder: it evaluates a Gaussian at every pixel of the tiles of 8 x 8
/// that the Gaussian touches.
fn evaluations(gaussians: &[Gaussian], width: u32, height: u32) -> f64 {
    const TILE: (u32, u32) = (8, 8);
    let touched = |gaussian: &Gaussian, row: u32| {
        let spans = (row * TILE.1..(row + 1) * TILE.1).filter_map(|y| span(gaussian, y, width));
        let hull = spans.reduce(|a, b| (a.0.min(b.0), a.1.max(b.1)));
        hull.map_or(0, |(first, last)| last / TILE.0 - first / TILE.0 + 1)
    };
    let rows = height.div_ceil(TILE.1);
    let tiles = gaussians.iter().flat_map(|gaussian| (0..rows).map(|row| touched(gaussian, row)));
    f64::from(tiles.sum::<u32>()) * f64::from(TILE.0 * TILE.1)
}

/// The first and the last pixel of a row where a Gaussian of the quartic kernel is not zero.
fn span(gaussian: &Gaussian, y: u32, width: u32) -> Option<(u32, u32)> {
    let [l11, l21, l22] = gaussian.cholesky.map(f64::from);
    let [x, cy] = gaussian.center.map(f64::from);
    // q <= 4, solved for dx at the dy of this row.
    let (yy, dy) = (l21 * l21 + l22 * l22, f64::from(y) + 0.5 - cy);
    let squared = 4.0 - dy * dy / yy;
    let half = (squared > 0.0).then(|| l11 * l22 / yy.sqrt() * squared.sqrt())?;
    let middle = x - 0.5 + l11 * l21 / yy * dy;
    let (first, last) = ((middle - half).ceil().max(0.0), (middle + half).floor());
    let last = last.min(f64::from(width) - 1.0);
    (first <= last).then_some((first as u32, last as u32))
}

/// All that was measured at one rate.
struct RateResults {
    rate: f64,
    /// All decoders, ours first.
    rows: Vec<DecoderRow>,
    /// What else was measured of our decoder, for each picture.
    ours: Vec<DecoderProfile>,
}

fn against_others(
    bench: &mut Bench,
    files: &mut RateStore,
    pictures: &[TestPicture],
    rate: f64,
) -> Result<RateResults> {
    let mut all = Vec::new();
    let mut rows = vec![DecoderRow { decoder: gip::NAME, points: Vec::new() }];
    let others = || BASELINES.iter().chain([&SEQUENTIAL_JPEG]);
    rows.extend(others().map(|other| DecoderRow { decoder: other.name, points: Vec::new() }));
    for picture in pictures {
        let mut file = LazyFile { picture, rate, file: None };
        let times = ours(bench, &mut file)?;
        rows[0].points.push([picture.rate(times.bytes), times.psnr, times.whole, 1.0]);
        for (row, other) in rows[1..].iter_mut().zip(others()) {
            row.points.push(theirs(bench, files, other, &mut file)?);
        }
        all.push(times);
    }
    Ok(RateResults { rate, rows, ours: all })
}

fn theirs(
    bench: &mut Bench,
    files: &mut RateStore,
    other: &Baseline,
    file: &mut LazyFile<'_>,
) -> Result<[f64; 4]> {
    let (picture, rate) = (file.picture, file.rate);
    let mut store = bench.store(
        "decoders.csv",
        ["codec", "quality", "image"],
        ["bpp", "psnr", "decode_seconds", "our_share"],
    )?;
    let product = bench.product.clone();
    let (worker, versions) = bench.baselines()?;
    let setting = nearest(other.settings, rate, |setting| {
        Ok(files.baseline(worker, &versions, other, setting, picture)?.rate)
    })?;
    store.get(&timing_version(&product, &versions), [other.id, setting, &picture.name], || {
        let trip = worker.round_trip(other.id, setting, picture, Some(1), [1, 1])?;
        let (ours, mut out) = (file.get()?, vec![0; picture.rgb.len()]);
        let one = RenderOptions::new().with_threads(Threads::One);
        let ([_, theirs], [_, share]) = interleaved(
            TURNS,
            [
                &mut || gip::median_seconds(RUNS_PER_TURN, || render(&ours.file, &one, &mut out)),
                &mut || worker.decode_again(RUNS_PER_TURN),
            ],
        )?;
        Ok([
            picture.rate(trip.bytes),
            metrics::psnr(&picture.rgb, &trip.decoded, 255.0),
            theirs,
            share,
        ])
    })
}

/// Tables of all decoders' times with one thread, and of our time divided by theirs.
fn ratios(bench: &Bench, all: &[RateResults]) -> String {
    let mut text = String::from("\n### One thread\n");
    for RateResults { rate, rows, .. } in all {
        let mut table = Table::new(&[
            "decoder",
            "bpp",
            "PSNR in dB",
            "ms",
            "ours / theirs, median",
            "least",
            "largest",
        ]);
        for row in rows {
            let [least, largest] = min_and_max(row.points.iter().map(|point| point[3]));
            let name = |figure: &str| format!("{}/{rate} bpp/{figure}", row.decoder);
            bench.figure(name("ms"), 1000.0 * row.mean(2), "ms");
            bench.figure(name("ours to theirs"), row.ratio(), "");
            table.row(&[
                row.decoder.to_owned(),
                format!("{:.3}", row.mean(0)),
                format!("{:.2}", row.mean(1)),
                format!("{:.2}", 1000.0 * row.mean(2)),
                format!("{:.2}", row.ratio()),
                format!("{least:.2}"),
                format!("{largest:.2}"),
            ]);
        }
        let faster = rows.iter().filter(|row| row.ratio() > 1.0);
        text.push_str(&format!(
            "\nFiles of about {rate} bpp:\n{}\nFaster than ours: {}.\n",
            table.finish(),
            list_or_none(faster.map(|row| row.decoder)),
        ));
    }
    text
}

/// Tables of our decoder: its stages; threads, thumbnails and prefixes; memory.
fn breakdown(all: &[RateResults], pictures: &[TestPicture]) -> String {
    let floor = kernel_benchmark::seconds_per_evaluation();
    let mut stages = Table::new(&[
        "bpp",
        "Gaussians",
        "evaluations per pixel",
        "bytes to Gaussians, ms",
        "output, ms",
        "binning and splatting, ms",
        "floor of splatting, ms",
        "all, ms",
    ]);
    let mut gains = Table::new(&[
        "bpp",
        "speedup of all threads, one file",
        "speedup of all threads, a file each",
        "speedup of a thumbnail",
        "PSNR of the thumbnail in dB",
        "time of the first tenth",
        "time of its preview",
        "Gaussians in it",
    ]);
    let mut memory = Table::new(&["bpp", "all, kB", "list of Gaussians, kB", "the rest, kB"]);
    for RateResults { rate, ours, .. } in all {
        let mean = |get: fn(&DecoderProfile) -> f64| mean(ours.iter().map(get)).unwrap_or(f64::NAN);
        let of = |get: fn(&DecoderProfile) -> f64| median(ours.iter().map(get)).unwrap_or(f64::NAN);
        let spread = |get: fn(&DecoderProfile) -> f64| {
            let [least, largest] = min_and_max(ours.iter().map(get));
            format!("{:.2} ({least:.2} to {largest:.2})", of(get))
        };
        let pixels = f64::from(pictures[0].width * pictures[0].height);
        let [whole, parse, output] = [mean(|t| t.whole), mean(|t| t.parse), mean(|t| t.output)];
        let evaluations = mean(|times| times.evaluations);
        let ms = |seconds: f64| format!("{:.2}", 1000.0 * seconds);
        stages.row(&[
            rate.to_string(),
            format!("{:.0}", mean(|times| times.gaussians)),
            format!("{:.1}", evaluations / pixels),
            ms(parse),
            ms(output),
            ms(whole - parse - output),
            ms(evaluations * floor),
            ms(whole),
        ]);
        gains.row(&[
            rate.to_string(),
            spread(|times| times.scaling),
            spread(|times| times.one_each),
            format!("{:.1}", of(|times| times.thumbnail)),
            format!("{:.1}", mean(|times| times.thumbnail_psnr)),
            format!("{:.0} %", 100.0 * mean(|times| times.tenth[0] / times.whole)),
            format!("{:.0} %", 100.0 * mean(|times| times.tenth[1] / times.whole)),
            format!("{:.1} %", 100.0 * mean(|times| times.tenth_gaussians / times.gaussians)),
        ]);
        let kilobytes = |bytes: f64| format!("{:.0}", 1e-3 * bytes);
        memory.row(&[
            rate.to_string(),
            kilobytes(mean(|times| times.memory)),
            kilobytes(mean(|times| GAUSSIAN_BYTES * times.gaussians)),
            kilobytes(mean(|times| times.memory - GAUSSIAN_BYTES * times.gaussians)),
        ]);
    }
    format!(
        "\n### Stages\n\nOur decoder with one thread. The time of the output is that of a picture \
         without Gaussians. The floor of splatting is the time that the kernel evaluations would \
         take in a loop of nothing else, whose data stay in registers and the first-level cache: \
         {:.3} ns each on this machine, in this run.\n{}\n### Threads and partial \
         decoding\n\nCompared with: our decoder for the whole picture with one thread, from the \
         file in memory. A thumbnail has 1/{THUMBNAIL} of the width and height and is made from as \
         many layers as that size needs; its PSNR is against a thumbnail made from all layers. \
         The first tenth of the bytes is rendered at full size, and as a preview of 1/{PREVIEW} \
         of the width and height. The speedup of threads that decode a file each, in files per \
         second, is what the machine allows. Speedups are medians over the pictures, those of \
         threads with the least and the largest; all else are means.\n{}\n### Memory\n\nPeak \
         memory with one thread, without the file and the output.\n{}",
        1e9 * floor,
        stages.finish(),
        gains.finish(),
        memory.finish(),
    )
}

/// Times a small region of a large picture.
fn region(bench: &Bench) -> Result<String> {
    let mut store = bench.store(
        "decode-region.csv",
        ["image", "width", "rate", "effort"],
        ["gaussians", "whole", "whole_rendered", "region", "region_rendered"],
    )?;
    let (width, rate, effort) = LARGE_PICTURE;
    let picture = &bench.pictures[0];
    let height = width * picture.height / picture.width;
    let key = [width.to_string(), rate.to_string(), effort.to_string()];
    let key = [&picture.name, &key[0], &key[1], &key[2]];
    let values = store.get(&bench.product, key.map(String::as_str), || {
        let wide = picture.mirrored(width, height);
        let encoder = gip::encoder(effort).with_target(Target::BitsPerPixel(rate));
        let file = gip::encode(encoder, &wide, Threads::Pool)?.file;
        let (x, y) = ((width - REGION) / 2, (height - REGION) / 2);
        let all = RenderOptions::new().with_threads(Threads::One);
        let part = all.clone().with_region(Region { x, y, width: REGION, height: REGION });
        let mut out = vec![0; wide.rgb.len()];
        let mut stream = StreamDecoder::new();
        stream.feed(&file)?;
        let rendered = |options: &RenderOptions| {
            let picture = stream.picture().expect("the file is whole");
            let length = picture.output_len(options)?;
            seconds(|| Ok(picture.render_u8(options, &mut vec![0; length])?))
        };
        Ok([
            stream.gaussians().len() as f64,
            seconds(|| render(&file, &all, &mut out))?,
            rendered(&all)?,
            seconds(|| render(&file, &part, &mut out[..(REGION * REGION * 3) as usize]))?,
            rendered(&part)?,
        ])
    })?;
    let [gaussians, whole, whole_rendered, region, region_rendered] = values;
    Ok(format!(
        "\n### A region\n\nCompared with: our decoder for the whole picture, both with one thread. \
         The region is {REGION} x {REGION} pixels in the middle of {} mirrored to {width} x \
         {height}, at {rate} bits per pixel, {gaussians} Gaussians. Rendering, from Gaussians \
         that are decoded already, as in a viewer: {:.3} ms against {:.2} ms, {:.0} times as \
         fast. Decoding and rendering, from the bytes, only the layers that reach the region: \
         {:.2} ms against {:.2} ms, {:.1} times as fast.\n",
        picture.name,
        1000.0 * region_rendered,
        1000.0 * whole_rendered,
        whole_rendered / region_rendered,
        1000.0 * region,
        1000.0 * whole,
        whole / region,
    ))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn tasks_take_turns_and_ratios_are_of_the_same_turn() {
        let order = std::cell::RefCell::new(String::new());
        let task = |name: char, seconds: [f64; 3]| {
            let (order, mut seconds) = (&order, seconds.into_iter());
            move || {
                order.borrow_mut().push(name);
                seconds.next().context("there are three turns")
            }
        };
        // The machine is at half its speed in the second turn.
        let (mut a, mut b) = (task('a', [1.0, 2.0, 1.5]), task('b', [4.0, 8.0, 3.0]));
        let (times, ratios) = interleaved(3, [&mut a, &mut b]).expect("three turns");
        assert_eq!(*order.borrow(), "ababab");
        assert_eq!(times, [1.5, 4.0]);
        assert_eq!(ratios, [1.0, 0.25]);
    }

    #[test]
    fn touched_tiles_are_counted() {
        let gaussian = |center, cholesky| Gaussian { center, cholesky, color: [1.0; 4] };
        // A disc of radius 2 within one tile, and one on the corner of four.
        let inside = gaussian([12.0, 4.0], [1.0, 0.0, 1.0]);
        let corner = gaussian([16.0, 8.0], [1.0, 0.0, 1.0]);
        let outside = gaussian([-9.0, 8.0], [1.0, 0.0, 1.0]);
        let tiles = |gaussian| evaluations(&[gaussian], 64, 64) / 64.0;
        assert_eq!([inside, corner, outside].map(tiles), [1.0, 4.0, 0.0]);
    }
}
