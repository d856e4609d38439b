//! Makes the triplets: an original between two versions of it in files of equal size.

use std::collections::{BTreeMap, BTreeSet};
use std::path::PathBuf;

use anyhow::{Result, ensure};
use clap::builder::RangedU64ValueParser;
use fastrand::Rng;
use image::RgbImage;
use image::imageops::{self, FilterType};

use super::key::{self, Shown, Triplet};
use crate::baselines::Worker;
use crate::canvas::{Canvas, LINE};
use crate::contents::Contents;
use crate::files;
use crate::pictures::{self, TestPicture};
use crate::versions::{self, RATES, Version};
use crate::{gip, provenance};

/// The size of a crop in the picture's pixels.
const CROP: (u32, u32) = (320, 240);
/// Between the pictures of a triplet, in pixels.
const GAP: u32 = 8;
/// How many pixels wide a pixel is shown: in half of the triplets each.
const SCALES: [u32; 2] = [1, 2];
/// What is compared with the textured version.
const OTHERS: [Shown; 2] = [Shown::Plain, Shown::Avif];

/// Makes triplets for a blind choice, and the key that says which picture is which.
///
/// Viewers get the folder `triplets` of OUT, and nothing else of it.
#[derive(Debug, clap::Args)]
pub(crate) struct Args {
    /// Folder with pictures, as .png; may be repeated.
    #[arg(long, value_name = "DIR", required = true)]
    pictures: Vec<PathBuf>,
    /// CSV with the columns picture and content, for results by class of content.
    #[arg(long, value_name = "CSV")]
    content: Option<PathBuf>,
    /// Folder for key.csv and the folder `triplets`; it is made if it is missing.
    #[arg(long, value_name = "OUT")]
    out: PathBuf,
    /// Triplets for each rate and comparison.
    #[arg(long, value_name = "N", default_value_t = 36, value_parser = at_least_one())]
    count: usize,
    /// Seed of crops, sides and order.
    #[arg(long, value_name = "N", default_value_t = 1)]
    seed: u64,
}

fn at_least_one() -> RangedU64ValueParser<usize> {
    RangedU64ValueParser::new().range(1..)
}

pub(crate) fn make(args: &Args) -> Result<()> {
    let mut pictures = Vec::new();
    for folder in &args.pictures {
        pictures.extend(pictures::load(folder, None)?);
    }
    let names: BTreeSet<&str> = pictures.iter().map(|picture| picture.name.as_str()).collect();
    ensure!(names.len() == pictures.len(), "two pictures have the same name");
    let contents = args.content.as_deref().map_or(Ok(Contents::default()), Contents::load)?;
    let key = args.out.join("key.csv");
    ensure!(!key.exists(), "{} is there already: its triplets would be lost", key.display());
    let folder = args.out.join("triplets");
    files::make_folder(&folder)?;

    let mut triplets = plan(&pictures, &contents, args.count, args.seed)?;
    let mut worker = Worker::start(&args.out, 0)?;
    for picture in &pictures {
        for rate in RATES {
            let all = triplets.iter_mut();
            let of_files: Vec<&mut Triplet> = all
                .filter(|triplet| triplet.picture == picture.name && triplet.bpp == rate)
                .collect();
            let sides = of_files.iter().flat_map(|triplet| [triplet.left, triplet.right]);
            let shown = shown(&sides.collect(), &mut worker, picture, rate)?;
            for triplet in of_files {
                let sides = [triplet.left, triplet.right].map(|side| &shown[&side]);
                let rates = sides.map(|version| rounded(picture.rate(version.bytes)));
                [triplet.left_bpp, triplet.right_bpp] = rates;
                let path = folder.join(format!("{}.png", triplet.triplet));
                draw(picture, sides.map(|side| &side.samples[..]), triplet).save_png(&path)?;
            }
        }
    }
    key::write(&key, &triplets)
}

/// To four decimals, as the key has it.
fn rounded(rate: f64) -> f64 {
    (rate * 1e4).round() / 1e4
}

/// The versions of a picture at a rate that are at any side.
fn shown(
    sides: &BTreeSet<Shown>,
    worker: &mut Worker,
    picture: &TestPicture,
    rate: f64,
) -> Result<BTreeMap<Shown, Version>> {
    let mut all = BTreeMap::new();
    if sides.is_empty() {
        return Ok(all);
    }
    eprintln!("{}, {rate} bpp", picture.name);
    let textured = Version::ours(gip::encoder(gip::EFFORT), picture, rate)?;
    if sides.contains(&Shown::Plain) {
        let plain = Version::ours(gip::plain_encoder(gip::EFFORT), picture, rate)?;
        all.insert(Shown::Plain, plain);
    }
    if sides.contains(&Shown::Avif) {
        let avif = versions::baseline_called("AVIF")?;
        let avif = Version::baseline(worker, avif, picture, textured.bytes)?;
        all.insert(Shown::Avif, avif);
    }
    all.insert(Shown::Textured, textured);
    Ok(all)
}

/// The triplets in the order of their names, without the sizes of files.
fn plan(
    pictures: &[TestPicture],
    contents: &Contents,
    count: usize,
    seed: u64,
) -> Result<Vec<Triplet>> {
    let mut random = Rng::with_seed(seed);
    // Every picture has its turn before any has another, and so has every crop of a picture.
    let mut crops: Vec<Deck<(u32, u32)>> = Vec::new();
    for picture in pictures {
        ensure!(
            picture.width >= CROP.0 && picture.height >= CROP.1,
            "{} is smaller than {} x {} pixels",
            picture.name,
            CROP.0,
            CROP.1
        );
        let rows = corners(picture.height, CROP.1);
        let all = rows.flat_map(|y| corners(picture.width, CROP.0).map(move |x| (x, y)));
        crops.push(Deck::new(all));
    }
    let mut turns = Deck::new(0..pictures.len());
    let mut triplets = Vec::new();
    for (other, bpp) in OTHERS.into_iter().flat_map(|other| RATES.map(|bpp| (other, bpp))) {
        let mut scales = Deck::new(SCALES);
        let mut sides = Deck::new([[Shown::Textured, other], [other, Shown::Textured]]);
        for _ in 0..count {
            let index = turns.draw(&mut random);
            let (picture, (x, y)) = (&pictures[index], crops[index].draw(&mut random));
            let [left, right] = sides.draw(&mut random);
            triplets.push(Triplet {
                triplet: String::new(),
                picture: picture.name.clone(),
                content: contents.of(&picture.name).to_owned(),
                x,
                y,
                width: CROP.0,
                height: CROP.1,
                scale: scales.draw(&mut random),
                bpp,
                left,
                right,
                left_bpp: 0.0,
                right_bpp: 0.0,
                version: provenance::product()?,
            });
        }
    }
    // A name says nothing about what is compared.
    random.shuffle(&mut triplets);
    for (index, triplet) in triplets.iter_mut().enumerate() {
        triplet.triplet = format!("{:03}", index + 1);
    }
    Ok(triplets)
}

/// Where crops begin that cover a side: as few as possible, evenly spread.
fn corners(side: u32, crop: u32) -> impl Iterator<Item = u32> {
    let last = side.div_ceil(crop) - 1;
    (0..=last).map(move |index| index * (side - crop) / last.max(1))
}

/// Things that are drawn at random, each once before any is drawn again.
struct Deck<T> {
    all: Vec<T>,
    left: Vec<T>,
}

impl<T: Clone> Deck<T> {
    fn new(all: impl IntoIterator<Item = T>) -> Self {
        Self { all: all.into_iter().collect(), left: Vec::new() }
    }

    fn draw(&mut self, random: &mut Rng) -> T {
        if self.left.is_empty() {
            self.left.clone_from(&self.all);
            random.shuffle(&mut self.left);
        }
        self.left.pop().expect("a deck is not empty")
    }
}

/// The original between the two versions, enlarged by Lanczos's filter of three lobes.
fn draw(picture: &TestPicture, [left, right]: [&[u8]; 2], triplet: &Triplet) -> Canvas {
    let (width, height) = (triplet.width * triplet.scale, triplet.height * triplet.scale);
    let mut canvas = Canvas::new(3 * width + 2 * GAP, LINE + height);
    let tiles = [("left", left), ("original", picture.rgb.as_slice()), ("right", right)];
    for ((title, samples), index) in tiles.into_iter().zip(0..) {
        let whole = RgbImage::from_raw(picture.width, picture.height, samples.to_vec());
        let whole = whole.expect("as many samples as the picture has");
        let crop = imageops::crop_imm(&whole, triplet.x, triplet.y, triplet.width, triplet.height)
            .to_image();
        let x = index * (width + GAP);
        canvas.write(title, (x, 0));
        canvas.paste(&imageops::resize(&crop, width, height, FilterType::Lanczos3), (x, LINE));
    }
    canvas
}

#[cfg(test)]
mod tests {
    use super::*;

    fn picture(name: &str, width: u32, height: u32) -> TestPicture {
        let rgb = (0..width * height * 3).map(|index| (index % 251) as u8).collect();
        TestPicture { name: name.to_owned(), path: PathBuf::new(), width, height, rgb }
    }

    fn planned(seed: u64) -> Vec<Triplet> {
        let pictures = [picture("a", 768, 512), picture("b", 320, 240), picture("c", 576, 576)];
        plan(&pictures, &Contents::default(), 36, seed).expect("they are large enough")
    }

    #[test]
    fn all_comparisons_get_the_same_number_of_both_scales_and_sides() {
        let mut counts = BTreeMap::new();
        for Triplet { bpp, left, right, scale, .. } in planned(1) {
            let other = if left == Shown::Textured { right } else { left };
            assert_ne!(other, Shown::Textured);
            *counts.entry((other, bpp.to_string(), "scale", scale)).or_insert(0) += 1;
            let side = u32::from(left == Shown::Textured);
            *counts.entry((other, bpp.to_string(), "side", side)).or_insert(0) += 1;
        }
        assert_eq!(counts.len(), OTHERS.len() * RATES.len() * 4);
        assert!(counts.values().all(|&count| count == 18), "{counts:?}");
    }

    #[test]
    fn crops_cover_every_picture() {
        let triplets = planned(1);
        for (name, width, height) in [("a", 768, 512), ("b", 320, 240), ("c", 576, 576)] {
            let of_picture = triplets.iter().filter(|triplet| triplet.picture == name);
            assert_eq!(of_picture.clone().count(), 36 * OTHERS.len() * RATES.len() / 3);
            let mut covered = vec![false; width * height];
            for triplet in of_picture {
                for y in triplet.y..triplet.y + triplet.height {
                    let start = y as usize * width + triplet.x as usize;
                    covered[start..start + triplet.width as usize].fill(true);
                }
            }
            assert!(covered.iter().all(|&covered| covered), "{name}");
        }
    }

    #[test]
    fn the_seed_decides_and_names_say_nothing() {
        let triplets = planned(1);
        assert_eq!(planned(1), triplets);
        assert_ne!(planned(2), triplets);
        let names: BTreeSet<&str> = triplets.iter().map(|row| row.triplet.as_str()).collect();
        assert_eq!(names.len(), triplets.len());
        // Neighbours are of other comparisons as often as chance has it.
        let same = triplets.windows(2).filter(|pair| pair[0].other() == pair[1].other()).count();
        assert!((100..190).contains(&same), "{same}");
    }

    #[test]
    fn a_small_picture_is_refused() {
        assert!(plan(&[picture("a", 320, 239)], &Contents::default(), 1, 1).is_err());
    }

    #[test]
    fn the_original_is_in_the_middle() {
        let picture = picture("a", 330, 250);
        let [dark, light] = [0, 255].map(|sample| vec![sample; picture.rgb.len()]);
        let pictures = [picture.clone()];
        let mut triplets = plan(&pictures, &Contents::default(), 2, 1).expect("it is large enough");
        triplets.sort_by_key(|triplet| triplet.scale);
        let triplet = &triplets[0];
        let canvas = draw(&picture, [&dark, &light], triplet);
        let folder = tempfile::tempdir().expect("a folder");
        let path = folder.path().join("001.png");
        canvas.save_png(&path).expect("it is written");
        let drawn = image::open(&path).expect("it was written").into_rgb8();
        assert_eq!(drawn.dimensions(), (3 * 320 + 2 * GAP, 240 + LINE));
        let first = |tile: u32| drawn.get_pixel(tile * (320 + GAP), LINE).0;
        let source = (triplet.y * picture.width + triplet.x) as usize * 3;
        assert_eq!([first(0), first(2)], [[0; 3], [255; 3]]);
        assert_eq!(first(1)[..], picture.rgb[source..source + 3]);
        let enlarged = draw(&picture, [&dark, &light], triplets.last().expect("there are 16"));
        enlarged.save_png(&path).expect("it is written");
        let drawn = image::open(&path).expect("it was written").into_rgb8();
        assert_eq!(drawn.dimensions(), (3 * 640 + 2 * GAP, 480 + LINE));
    }
}
