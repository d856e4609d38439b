//! What losses look like.

use std::ptr;

use anyhow::{Context, Result};
use image::{RgbImage, imageops};
use image_gip::{Target, Threads};

use super::case::{Case, worst};
use super::kinds::KINDS;
use crate::baselines::Worker;
use crate::bench::Bench;
use crate::canvas::{Canvas, LINE};
use crate::gip;
use crate::metric::Metric;
use crate::parallel;
use crate::pictures::TestPicture;
use crate::sections::crops::{Crop, extremes};
use crate::sections::ranges::{RANGES, short};
use crate::versions::{self, Version};
use crate::visual;

const COLUMNS: u32 = 2;
/// Of our files, in bits per pixel, by the range that stands for the picture; the others have as many
/// bytes.
const RATES: [f64; RANGES.len()] = [0.2, 0.5, 1.3];
const OTHERS: [&str; 2] = ["AVIF", "JPEG XL"];
/// Of a crop, in pixels.
const SIDE: u32 = 160;
const GAP: u32 = 4;
/// The original, ours, and the others.
const TILES: u32 = 2 + OTHERS.len() as u32;
const NAME: &str = "sheet-losses.jpg";
/// Most bytes of the sheet.
const BYTES: usize = 300_000;

/// One crop as the original and all codecs show it, with captions.
struct Strip(Vec<(String, RgbImage)>);

/// Writes the sheet of the worst picture by each metric and of each class of content, and says what
/// is in it.
pub(super) fn make(bench: &mut Bench, cases: &[Case]) -> Result<String> {
    let (workers, _) = bench.workers()?;
    let strips = parallel::map(workers, &chosen(cases), |worker, (case, metric)| {
        let rate = case.telling(*metric).map_or(RATES[0], |(range, _)| RATES[range]);
        strip(worker, *metric, &case.picture, rate).with_context(|| case.picture.name.clone())
    })?;
    let canvas = draw(&strips);
    let path = bench.path(NAME);
    canvas.save_jpeg(&path, BYTES)?;
    Ok(format!(
        "\n### Sheet: losses\n\nThe picture with the largest BD-rate by each metric, and then of each class of content by \
         {}, each picture once: the {SIDE} x {SIDE} pixels where ours is furthest behind {} (by the map of SSIMULACRA2; for \
         PSNR, by squared error), in our file of {} bits per pixel (where low, middle or high \
         rates stand for the picture) and in others of as many bytes ({} at speed 6 with its default tuning: a file of it at its best takes half a minute); with the rate and the metric of the whole file. Photographs: Kodak; gb82 image set (CC0 1.0); Unsplash.\n\n![Crops where \
         we lose]({NAME})\n",
        Metric::Ssimulacra2.name(),
        OTHERS[0],
        RATES.map(|rate| rate.to_string()).join(", "),
        OTHERS[0],
    ))
}

/// The pictures of the sheet, each with the metric that it is there for.
fn chosen(cases: &[Case]) -> Vec<(&Case, Metric)> {
    let mut chosen: Vec<(&Case, Metric)> = Vec::new();
    let of_metrics = Metric::ALL.map(|metric| (metric, worst(cases, metric)));
    let of_kinds = KINDS.iter().map(|(kind, ..)| {
        let mut all = worst(cases, Metric::Ssimulacra2);
        all.retain(|case| case.content == *kind);
        (Metric::Ssimulacra2, all)
    });
    for (metric, all) in of_metrics.into_iter().chain(of_kinds) {
        let is_new = |case: &&&Case| chosen.iter().all(|(shown, _)| !ptr::eq(*shown, **case));
        if let Some(case) = all.iter().find(is_new) {
            chosen.push((case, metric));
        }
    }
    chosen
}

fn strip(worker: &mut Worker, metric: Metric, picture: &TestPicture, rate: f64) -> Result<Strip> {
    let encoder = gip::encoder(gip::EFFORT).with_target(Target::BitsPerPixel(rate));
    let file = gip::file(encoder, picture, Threads::One)?;
    let mut versions = vec![(gip::NAME, Version::of_file(&file.bytes, Some(file.report))?)];
    let bytes = versions[0].1.bytes;
    for name in OTHERS {
        let baseline = versions::baseline_called(name)?;
        versions.push((name, Version::baseline(worker, baseline, picture, bytes)?));
    }
    let [(_, ours), (_, rival), ..] = &versions[..] else { unreachable!("there are three") };
    let ahead = error(picture, rival, metric)?.into_iter().zip(error(picture, ours, metric)?);
    let ahead: Vec<f64> = ahead.map(|(rival, ours)| rival - ours).collect();
    let side = SIDE.min(picture.width).min(picture.height);
    let [crop, _] = extremes(&ahead, picture.width, side);
    // Captions have room for 26 letters, so names end where their first part does.
    let name = picture.name.split('-').next().unwrap_or_default();
    let caption = format!("{}: {}", short(name), metric.name());
    let mut tiles = vec![(caption, cut(picture, &picture.rgb, crop, side))];
    for (name, version) in &versions {
        let level = metric.shown(metric.level(&picture.distortion(&version.samples)?));
        let caption = format!("{name} {:.2} bpp: {level:.2}", picture.rate(version.bytes));
        tiles.push((caption, cut(picture, &version.samples, crop, side)));
    }
    Ok(Strip(tiles))
}

/// For each pixel, how far a version is from the source.
fn error(picture: &TestPicture, version: &Version, metric: Metric) -> Result<Vec<f64>> {
    let (source, decoded) = (&picture.rgb, &version.samples);
    if metric == Metric::Psnr {
        let squares = source.iter().zip(decoded).map(|(a, b)| f64::from(a.abs_diff(*b)).powi(2));
        let squares: Vec<f64> = squares.collect();
        return Ok(squares.chunks_exact(3).map(|pixel| pixel.iter().sum()).collect());
    }
    let map = visual::ssimulacra2_map(source, decoded, picture.width, picture.height)?;
    Ok(map.into_iter().map(f64::from).collect())
}

fn cut(picture: &TestPicture, samples: &[u8], crop: Crop, side: u32) -> RgbImage {
    let whole = RgbImage::from_raw(picture.width, picture.height, samples.to_vec());
    let whole = whole.expect("as many samples as the picture has");
    imageops::crop_imm(&whole, crop.x, crop.y, side, side).to_image()
}

/// Strips in columns, from left to right and from top to bottom.
fn draw(strips: &[Strip]) -> Canvas {
    let (width, height) = (GAP + TILES * (SIDE + GAP), LINE + SIDE + GAP);
    let rows = (strips.len() as u32).div_ceil(COLUMNS);
    let mut canvas = Canvas::new(COLUMNS * (width + GAP), rows.max(1) * height);
    for (index, Strip(tiles)) in strips.iter().enumerate() {
        let (column, row) = (index as u32 % COLUMNS, index as u32 / COLUMNS);
        for (tile, (caption, picture)) in tiles.iter().enumerate() {
            let x = column * (width + GAP) + GAP + tile as u32 * (SIDE + GAP);
            canvas.write(caption, (x, row * height));
            canvas.paste(picture, (x, row * height + LINE));
        }
    }
    canvas
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::sections::losses::case::tests::case;

    #[test]
    fn every_metric_and_every_class_has_another_picture() {
        let cases = [
            case("a", "text", 0.1),
            case("b", "face", 0.9),
            case("c", "face", 0.8),
            case("d", "face", 0.7),
            case("e", "face", 0.6),
            case("f", "face", 0.5),
            case("g", "rendered", -0.5),
        ];
        let chosen = chosen(&cases);
        let names: Vec<&str> = chosen.iter().map(|(case, _)| case.picture.name.as_str()).collect();
        assert_eq!(names, ["b", "c", "d", "e", "f", "a", "g"]);
        assert_eq!(chosen[4].1, Metric::Psnr);
        assert_eq!(chosen[6].1, Metric::Ssimulacra2);
    }
}
