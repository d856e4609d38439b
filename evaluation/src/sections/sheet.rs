//! Contact sheets: what a person sees of us and of others in files of the same size, where the
//! difference is largest.

use std::path::Path;

use anyhow::Result;
use image::{RgbImage, imageops};
use image_gip::Target;

use super::crops::{Crop, extremes};
use crate::bench::Bench;
use crate::canvas::{Canvas, LINE};
use crate::gip;
use crate::pictures::{PictureSet, TestPicture};
use crate::table::Table;
use crate::versions::{self, Version};
use crate::visual;

/// The rate of our files, in bits per pixel: low enough to see the differences.
const RATE: f64 = 0.4;
/// The baselines beside us; crops are chosen by the first.
const OTHERS: [&str; 2] = ["AVIF", "WebP"];
/// The side of a crop in pixels. Crops are shown pixel by pixel.
const SIDE: u32 = 160;
const GAP: u32 = 4;
/// Of sheets as JPEG: two bits per pixel, several times as many as the files have that they show.
const SHEET_QUALITY: u8 = 75;
/// Of the README's picture.
const README_QUALITY: u8 = 88;
/// Of the two crops of each picture, in the order of [`Pair`].
const TITLES: [&str; 2] = [
    "where gip compares worst with AVIF, at equal bytes (codec, bits per pixel: SSIMULACRA2)",
    "where gip compares best with AVIF, at equal bytes",
];
/// How many crops of each kind are in the README's picture.
const README_CROPS: usize = 3;
/// Where the pictures come from.
const LICENCE: &str = "Photographs: Kodak (released by Eastman Kodak for unrestricted use); gb82 \
                       image set (CC0 1.0)";

pub(crate) fn measure(bench: &mut Bench) -> Result<String> {
    let mut text = format!(
        "What one sees of the original, of our file at effort {} and {RATE} bits per pixel, and of \
         {} (as in the section about rate) at the quality whose file is nearest to ours in size. \
         From each picture the {SIDE} x {SIDE} pixels where we compare worst and those where we \
         compare best with {}, by the map of SSIMULACRA2; pixel by pixel, each with the rate and \
         the SSIMULACRA2 of the whole file. {LICENCE}.\n",
        gip::EFFORT,
        OTHERS.join(" and "),
        OTHERS[0],
    );
    let mut strips = Vec::new();
    for set in bench.sets() {
        let pairs = pairs(bench, &set)?;
        let name = format!("sheet-{}.jpg", set.name).to_lowercase();
        sheet(&pairs).save_jpeg(&bench.path(&name), SHEET_QUALITY)?;
        text.push_str(&format!("\n### Sheet: {}\n\n![{0}: crops]({name})\n", set.name));
        text.push_str(&table(&pairs));
        strips.extend(pairs);
    }
    if let Some(path) = &bench.readme_picture {
        readme_picture(strips, path)?;
    }
    Ok(text)
}

/// A picture as one codec shows it.
struct Shown {
    codec: &'static str,
    rate: f64,
    ssimulacra2: f64,
    samples: Vec<u8>,
}

impl Shown {
    fn new(codec: &'static str, picture: &TestPicture, version: Version) -> Result<Self> {
        let rate = picture.rate(version.bytes);
        let ssimulacra2 = picture.distortion(&version.samples)?.ssimulacra2;
        Ok(Self { codec, rate, ssimulacra2, samples: version.samples })
    }
}

/// One crop of a picture, side by side as all show it.
struct Strip {
    picture: String,
    crop: Crop,
    /// With their captions.
    tiles: Vec<(String, RgbImage)>,
}

/// The strips of a picture where we compare worst and best with the first of the others, and what
/// all files score.
struct Pair {
    strips: [Strip; 2],
    scores: Vec<f64>,
}

fn pairs(bench: &mut Bench, set: &PictureSet) -> Result<Vec<Pair>> {
    set.pictures.iter().map(|picture| pair(bench, picture)).collect()
}

fn pair(bench: &mut Bench, picture: &TestPicture) -> Result<Pair> {
    let ours = ours(bench, picture)?;
    let bytes = ours.bytes;
    let mut shown = vec![Shown::new(gip::NAME, picture, ours)?];
    for name in OTHERS {
        let (worker, _) = bench.baselines()?;
        let other = versions::baseline_called(name)?;
        let theirs = Version::baseline(worker, other, picture, bytes)?;
        shown.push(Shown::new(name, picture, theirs)?);
    }
    let error = |version: &Shown| {
        visual::ssimulacra2_map(&picture.rgb, &version.samples, picture.width, picture.height)
    };
    let (ours, others) = (error(&shown[0])?, error(&shown[1])?);
    let ahead: Vec<f64> =
        ours.iter().zip(&others).map(|(ours, others)| f64::from(others - ours)).collect();
    let side = SIDE.min(picture.width).min(picture.height);
    let strips = extremes(&ahead, picture.width, side);
    let strips = strips.map(|crop| strip(picture, &shown, crop, side));
    Ok(Pair { strips, scores: shown.iter().map(|version| version.ssimulacra2).collect() })
}

fn ours(bench: &Bench, picture: &TestPicture) -> Result<Version> {
    let name = format!("{}, {RATE} bpp, effort {}.gip", picture.name, gip::EFFORT);
    let file = bench.file(&name, || {
        let encoder = gip::encoder(gip::EFFORT).with_target(Target::BitsPerPixel(RATE));
        Ok(gip::file(encoder, picture)?.bytes)
    })?;
    Version::of_file(&file, None)
}

fn strip(picture: &TestPicture, shown: &[Shown], crop: Crop, side: u32) -> Strip {
    let cut = |samples: &[u8]| {
        let whole = RgbImage::from_raw(picture.width, picture.height, samples.to_vec());
        let whole = whole.expect("as many samples as the picture has");
        imageops::crop_imm(&whole, crop.x, crop.y, side, side).to_image()
    };
    let mut tiles = vec![(format!("{}, original", picture.name), cut(&picture.rgb))];
    for Shown { codec, rate, ssimulacra2, samples } in shown {
        tiles.push((format!("{codec} {rate:.2} bpp: {ssimulacra2:.1}"), cut(samples)));
    }
    Strip { picture: picture.name.clone(), crop, tiles }
}

/// The size of a strip with its captions and gaps.
fn strip_size() -> (u32, u32) {
    let tiles = 2 + OTHERS.len() as u32;
    (GAP + tiles * (SIDE + GAP), LINE + SIDE + GAP)
}

fn draw(canvas: &mut Canvas, strip: &Strip, (x, y): (u32, u32)) {
    for (index, (caption, tile)) in strip.tiles.iter().enumerate() {
        let x = x + GAP + index as u32 * (SIDE + GAP);
        canvas.write(caption, (x, y));
        canvas.paste(tile, (x, y + LINE));
    }
}

/// A row for each picture, its worst crop on the left and its best on the right.
fn sheet(pairs: &[Pair]) -> Canvas {
    let (width, height) = strip_size();
    let columns = [0, width + 3 * GAP];
    let mut canvas = Canvas::new(columns[1] + width, 2 * LINE + pairs.len() as u32 * height);
    for (title, x) in TITLES.iter().zip(columns) {
        canvas.write(title, (x + GAP, 0));
    }
    for (index, pair) in pairs.iter().enumerate() {
        for (strip, x) in pair.strips.iter().zip(columns) {
            draw(&mut canvas, strip, (x, 2 * LINE + index as u32 * height));
        }
    }
    canvas
}

/// What is in a sheet, in figures.
fn table(pairs: &[Pair]) -> String {
    let mut columns = vec!["picture".to_owned(), format!("SSIMULACRA2 of {}", gip::NAME)];
    columns.extend(OTHERS.map(|name| format!("of {name}")));
    columns.extend(["worst crop: x, y", "by", "best crop: x, y", "by"].map(str::to_owned));
    let mut table = Table::new(&columns);
    for Pair { strips, scores } in pairs {
        let mut cells = vec![strips[0].picture.clone()];
        cells.extend(scores.iter().map(|score| format!("{score:.1}")));
        for Strip { crop, .. } in strips {
            cells.push(format!("{}, {}", crop.x, crop.y));
            cells.push(format!("{:+.1}", crop.mean));
        }
        table.row(&cells);
    }
    format!(
        "\n\"By\" is how much less our pixels in the crop take from the score than those of {}, on \
         average (negative: how much more).\n{}",
        OTHERS[0],
        table.finish()
    )
}

/// The README's picture: the crops of all pictures in which we compare best and worst.
fn readme_picture(pairs: Vec<Pair>, path: &Path) -> Result<()> {
    let (mut worst, mut best): (Vec<Strip>, Vec<Strip>) =
        pairs.into_iter().map(|Pair { strips: [worst, best], .. }| (worst, best)).unzip();
    worst.sort_by(|a, b| a.crop.mean.total_cmp(&b.crop.mean));
    best.sort_by(|a, b| b.crop.mean.total_cmp(&a.crop.mean));
    let (width, height) = strip_size();
    worst.truncate(README_CROPS);
    best.truncate(README_CROPS);
    let rows = (worst.len() + best.len()) as u32;
    let mut canvas = Canvas::new(width, rows * height + 2 * 2 * LINE + LINE);
    let mut y = 0;
    for (title, strips) in TITLES.iter().zip([worst, best]) {
        canvas.write(title, (GAP, y));
        y += 2 * LINE;
        for strip in &strips {
            draw(&mut canvas, strip, (0, y));
            y += height;
        }
    }
    canvas.write(LICENCE, (GAP, y));
    canvas.save_jpeg(path, README_QUALITY)
}
