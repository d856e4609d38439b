//! Contact sheets: what a person sees of us and of others in files of the same size, where the
//! difference is largest.

use std::path::Path;

use anyhow::{Context, Result};
use image::{RgbImage, imageops};
use image_gip::{Target, Threads};

use super::crops::{Crop, extremes};
use crate::baselines::Worker;
use crate::bench::{Bench, KeptFiles};
use crate::canvas::{Canvas, LINE};
use crate::gip;
use crate::parallel;
use crate::pictures::TestPicture;
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
/// The most bytes of a sheet of a set.
const SHEET_BYTES: usize = 450_000;
/// Of the README's picture.
const README_BYTES: usize = 600_000;
/// Our files without their texture.
const PLAIN: &str = "no texture";
/// Of the crops of each picture, in the order of [`Strips`].
const TITLES: [&str; 3] = [
    "where gip compares worst with AVIF, at equal bytes (codec, bits per pixel: SSIMULACRA2)",
    "where gip compares best with AVIF, at equal bytes",
    "where gip adds most texture, at equal bytes (codec, bits per pixel: SSIMULACRA2)",
];
/// How many of these kinds are in a sheet, so many crops of each. All are in the README's picture.
const SHEET_KINDS: usize = 2;
const SHEET_CROPS: usize = 7;
const README_CROPS: usize = 3;
/// Where the pictures come from.
const LICENCE: &str = "Photographs: Kodak (released by Eastman Kodak for unrestricted use); gb82 \
                       image set (CC0 1.0)";

pub(crate) fn measure(bench: &mut Bench) -> Result<String> {
    let mut text = format!(
        "What one sees of the original, of our file at effort {} and {RATE} bits per pixel with its \
         texture and without it, and of {} (as in the section about rate) at the quality whose file \
         is nearest to ours in size. \
         From each picture the {SIDE} x {SIDE} pixels where we compare worst and those where we \
         compare best with {}, by the map of SSIMULACRA2. The tables have all of them; a sheet shows, \
         pixel by pixel, the {SHEET_CROPS} where we compare worst and the {SHEET_CROPS} where we compare best, \
         each with the rate and the SSIMULACRA2 of the whole file. {LICENCE}.\n",
        gip::EFFORT,
        OTHERS.join(" and "),
        OTHERS[0],
    );
    let mut strips = Vec::new();
    for set in bench.sets() {
        let files = bench.kept_files();
        let (workers, _) = bench.workers()?;
        let of_set = parallel::map(workers, &set.pictures, |worker, picture| {
            strips_of(&files, worker, picture).with_context(|| picture.name.clone())
        })?;
        let name = format!("sheet-{}.jpg", set.name).to_lowercase();
        sheet(&of_set).save_jpeg(&bench.path(&name), SHEET_BYTES)?;
        text.push_str(&format!("\n### Sheet: {}\n\n![{0}: crops]({name})\n", set.name));
        text.push_str(&table(&of_set));
        strips.extend(of_set);
    }
    if let Some(path) = &bench.readme_picture {
        readme_picture(&strips, path)?;
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
        let TestPicture { rgb, width, height, .. } = picture;
        let ssimulacra2 = visual::ssimulacra2(rgb, &version.samples, *width, *height)?;
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

/// The strips of a picture where we compare worst and best with the first of the others, and where we add
/// most texture, and what all files score.
struct Strips {
    strips: [Strip; 3],
    scores: Vec<f64>,
}

fn strips_of(files: &KeptFiles, worker: &mut Worker, picture: &TestPicture) -> Result<Strips> {
    let name = format!("{}, {RATE} bpp, effort {}.gip", picture.name, gip::EFFORT);
    let file = files.get(&name, || {
        let encoder = gip::encoder(gip::EFFORT).with_target(Target::BitsPerPixel(RATE));
        Ok(gip::file(encoder, picture, Threads::One)?.bytes)
    })?;
    let unreadable = || format!("remove {} and run again", files.path(&name).display());
    let ours = Version::of_file(&file, None).with_context(unreadable)?;
    let bytes = ours.bytes;
    let samples = gip::decode_plain(&file, Threads::Pool)?;
    let plain = Version { bytes, samples, report: None };
    let mut shown = vec![Shown::new(gip::NAME, picture, ours)?, Shown::new(PLAIN, picture, plain)?];
    for name in OTHERS {
        let other = versions::baseline_called(name)?;
        let theirs = Version::baseline(worker, other, picture, bytes)?;
        shown.push(Shown::new(name, picture, theirs)?);
    }
    let [ours, plain, rival, ..] = &shown[..] else { unreachable!("there are four") };
    let error = |version: &Shown| {
        visual::ssimulacra2_map(&picture.rgb, &version.samples, picture.width, picture.height)
    };
    let ahead = error(ours)?.into_iter().zip(error(rival)?);
    let ahead: Vec<f64> = ahead.map(|(ours, others)| f64::from(others - ours)).collect();
    let pixels = ours.samples.chunks_exact(3).zip(plain.samples.chunks_exact(3));
    let texture: Vec<f64> =
        pixels.map(|(ours, plain)| f64::from(ours[1].abs_diff(plain[1]))).collect();
    let side = SIDE.min(picture.width).min(picture.height);
    let [worst, best] = extremes(&ahead, picture.width, side);
    let [_, most] = extremes(&texture, picture.width, side);
    let strips = [worst, best, most].map(|crop| strip(picture, &shown, crop, side));
    Ok(Strips { strips, scores: shown.iter().map(|version| version.ssimulacra2).collect() })
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
    // The original, ours with texture and without it, and the others.
    let tiles = 3 + OTHERS.len() as u32;
    (GAP + tiles * (SIDE + GAP), LINE + SIDE + GAP)
}

fn draw(canvas: &mut Canvas, strip: &Strip, (x, y): (u32, u32)) {
    for (index, (caption, tile)) in strip.tiles.iter().enumerate() {
        let x = x + GAP + index as u32 * (SIDE + GAP);
        canvas.write(caption, (x, y));
        canvas.paste(tile, (x, y + LINE));
    }
}

/// The crops of a kind, of all pictures, that are furthest from what others show; the first is the furthest.
fn furthest(pictures: &[Strips], kind: usize, most: usize) -> Vec<&Strip> {
    let mut strips: Vec<&Strip> = pictures.iter().map(|picture| &picture.strips[kind]).collect();
    // The worst are those with the least mean.
    let sign = if kind == 0 { -1.0 } else { 1.0 };
    strips.sort_by(|a, b| (sign * b.crop.mean).total_cmp(&(sign * a.crop.mean)));
    strips.truncate(most);
    strips
}

/// The worst crops on the left and the best on the right.
fn sheet(pictures: &[Strips]) -> Canvas {
    let (width, height) = strip_size();
    let columns = [0, width + 3 * GAP];
    let rows = pictures.len().min(SHEET_CROPS) as u32;
    let mut canvas = Canvas::new(columns[1] + width, 2 * LINE + rows * height);
    for (kind, x) in columns.into_iter().enumerate() {
        canvas.write(TITLES[kind], (x + GAP, 0));
        for (row, strip) in (0..).zip(furthest(pictures, kind, SHEET_CROPS)) {
            draw(&mut canvas, strip, (x, 2 * LINE + row * height));
        }
    }
    canvas
}

/// What is in a sheet, in figures.
fn table(pictures: &[Strips]) -> String {
    let mut columns = vec!["picture".to_owned(), format!("SSIMULACRA2 of {}", gip::NAME)];
    columns.push(format!("of {PLAIN}"));
    columns.extend(OTHERS.map(|name| format!("of {name}")));
    columns.extend(["worst crop: x, y", "by", "best crop: x, y", "by"].map(str::to_owned));
    let mut table = Table::new(&columns);
    for Strips { strips, scores } in pictures {
        let mut cells = vec![strips[0].picture.clone()];
        cells.extend(scores.iter().map(|score| format!("{score:.1}")));
        for Strip { crop, .. } in &strips[..SHEET_KINDS] {
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

/// The README's picture: of all pictures the crops with most texture, and those in which we compare worst and best.
fn readme_picture(pictures: &[Strips], path: &Path) -> Result<()> {
    let (width, height) = strip_size();
    let kinds = [2, 0, 1].map(|kind| (TITLES[kind], furthest(pictures, kind, README_CROPS)));
    let rows: usize = kinds.iter().map(|(_, strips)| strips.len()).sum();
    let lines = 2 * kinds.len() as u32 + 1;
    let mut canvas = Canvas::new(width, rows as u32 * height + lines * LINE);
    let mut y = 0;
    for (title, strips) in kinds {
        canvas.write(title, (GAP, y));
        y += 2 * LINE;
        for strip in strips {
            draw(&mut canvas, strip, (0, y));
            y += height;
        }
    }
    canvas.write(LICENCE, (GAP, y));
    canvas.save_jpeg(path, README_BYTES)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_sheet_has_the_furthest_crops_and_few_of_them() {
        let strips = |index: i32| {
            let strip = |mean: i32| Strip {
                picture: format!("{index}"),
                crop: Crop { x: 0, y: 0, mean: mean.into() },
                tiles: Vec::new(),
            };
            Strips { strips: [strip(-index), strip(index * 7 % 20), strip(0)], scores: Vec::new() }
        };
        let pictures: Vec<Strips> = (0..20).map(strips).collect();
        let names = |kind, most| -> Vec<&str> {
            furthest(&pictures, kind, most).iter().map(|strip| strip.picture.as_str()).collect()
        };
        assert_eq!(names(0, 3), ["19", "18", "17"]);
        // 7 x 17, 7 x 14 and 7 x 11 leave 19, 18 and 17.
        assert_eq!(names(1, 3), ["17", "14", "11"]);
        assert_eq!(names(1, 30).len(), 20);
    }
}
