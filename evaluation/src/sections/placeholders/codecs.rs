//! What codecs can do with a few hundred bytes.

use std::fs;
use std::path::Path;

use anyhow::{Result, anyhow};
use image::imageops::{self, FilterType};
use image::{DynamicImage, RgbImage};
use image_gip::{Target, Threads, metrics};

use crate::baselines::{SLOWEST_AVIF, Worker};
use crate::pictures::TestPicture;
use crate::{gip, versions, visual};

/// Most bytes of a placeholder.
pub(super) const BUDGETS: [usize; 4] = [100, 200, 400, 800];
/// Placeholders are looked at in this part of the picture's size.
const PART: u32 = 8;
/// The longer sides in pixels of the pictures that other codecs are given in place of the whole one.
const SIDES: [u32; 16] = [8, 11, 16, 19, 23, 27, 32, 38, 45, 54, 64, 76, 91, 108, 152, 256];
/// One in so many of a hundred settings of each baseline is tried.
const SETTING_STEP: usize = 7;
/// Most components of BlurHash in a direction.
const MOST_COMPONENTS: u32 = 9;

/// The baseline that is tried at its slowest, too.
const TRIED_SLOWLY: &str = "AVIF";

/// A way to make placeholders.
#[derive(Clone, Copy, Debug)]
pub(super) enum Codec {
    Gip,
    ThumbHash,
    BlurHash,
    /// The baseline of this name.
    Baseline(&'static str),
}

/// A placeholder, and how well it agrees with the picture at the size it is shown at.
#[derive(Clone, Debug)]
pub(super) struct Placeholder {
    pub(super) bytes: usize,
    pub(super) shown: RgbImage,
    pub(super) ssimulacra2: f64,
    pub(super) psnr: f64,
}

/// For each of the budgets the placeholder of a picture, if there is one.
pub(super) type Placeholders = [Option<Placeholder>; BUDGETS.len()];

impl Codec {
    /// Ours first.
    pub(super) const ALL: [Self; 6] = [
        Self::Gip,
        Self::ThumbHash,
        Self::BlurHash,
        Self::Baseline("WebP"),
        Self::Baseline("AVIF"),
        Self::Baseline("JPEG XL"),
    ];

    pub(super) fn name(self) -> &'static str {
        match self {
            Self::Gip => gip::NAME,
            Self::ThumbHash => "ThumbHash",
            Self::BlurHash => "BlurHash",
            Self::Baseline(name) => name,
        }
    }

    /// Our file at the default effort; of others the best by SSIMULACRA2, with all their settings.
    /// `scratch` is a folder for passing files to the worker.
    pub(super) fn placeholders(
        self,
        worker: &mut Worker,
        scratch: &Path,
        picture: &TestPicture,
    ) -> Result<Placeholders> {
        match self {
            Self::Gip => ours(picture),
            Self::ThumbHash => thumb_hash(picture),
            Self::BlurHash => blur_hash(picture),
            Self::Baseline(name) => baseline(worker, scratch, name, picture),
        }
    }
}

impl Placeholder {
    /// What a file of so many bytes shows of a picture.
    fn new(bytes: usize, shown: RgbImage, original: &RgbImage) -> Result<Self> {
        let (width, height) = original.dimensions();
        let ssimulacra2 = visual::ssimulacra2(original, &shown, width, height)?;
        let psnr = metrics::psnr(original, &shown, 255.0);
        Ok(Self { bytes, shown, ssimulacra2, psnr })
    }
}

/// The averages of a picture over squares of [`PART`] pixels.
pub(super) fn original(picture: &TestPicture) -> RgbImage {
    let [width, height] = [picture.width, picture.height].map(|side| side.div_ceil(PART));
    imageops::thumbnail(&image_of(picture), width, height)
}

fn image_of(picture: &TestPicture) -> RgbImage {
    RgbImage::from_raw(picture.width, picture.height, picture.rgb.clone())
        .expect("as many samples as the picture has")
}

/// Takes a placeholder where it fits and is better than what is there.
fn offer(placeholders: &mut Placeholders, new: &Placeholder) {
    for (best, budget) in placeholders.iter_mut().zip(BUDGETS) {
        let is_better = best.as_ref().is_none_or(|best| best.ssimulacra2 < new.ssimulacra2);
        if new.bytes <= budget && is_better {
            *best = Some(new.clone());
        }
    }
}

fn ours(picture: &TestPicture) -> Result<Placeholders> {
    let original = original(picture);
    let mut placeholders = Placeholders::default();
    for (placeholder, budget) in placeholders.iter_mut().zip(BUDGETS) {
        let encoder = gip::encoder(gip::EFFORT).with_target(Target::Bytes(budget as u64));
        let file = gip::file(encoder, picture, Threads::Pool)?.bytes;
        let samples = gip::decode_at(&file, original.dimensions())?;
        let shown = RgbImage::from_raw(original.width(), original.height(), samples);
        let shown = shown.expect("it was asked for this size");
        *placeholder = Some(Placeholder::new(file.len(), shown, &original)?);
    }
    Ok(placeholders)
}

fn thumb_hash(picture: &TestPicture) -> Result<Placeholders> {
    let original = original(picture);
    let (width, height) = original.dimensions();
    let rgba = DynamicImage::from(original.clone()).into_rgba8();
    let hash = thumbhash::rgba_to_thumb_hash(width as usize, height as usize, &rgba);
    let decoded = thumbhash::thumb_hash_to_rgba(&hash);
    let (columns, rows, samples) = decoded.map_err(|()| anyhow!("no ThumbHash of it"))?;
    let shown = enlarged(&opaque([columns as u32, rows as u32], &samples), &original);
    let mut placeholders = Placeholders::default();
    offer(&mut placeholders, &Placeholder::new(hash.len(), shown, &original)?);
    Ok(placeholders)
}

fn blur_hash(picture: &TestPicture) -> Result<Placeholders> {
    let original = original(picture);
    let (width, height) = original.dimensions();
    let rgba = DynamicImage::from(original.clone()).into_rgba8();
    let mut placeholders = Placeholders::default();
    for columns in 1..=MOST_COMPONENTS {
        for rows in 1..=MOST_COMPONENTS {
            let hash = blurhash::encode(columns, rows, width, height, &rgba)?;
            let samples = blurhash::decode(&hash, width, height, 1.0)?;
            let shown = opaque([width, height], &samples);
            offer(&mut placeholders, &Placeholder::new(hash.len(), shown, &original)?);
        }
    }
    Ok(placeholders)
}

/// Interleaved samples with an alpha channel, which is left out.
fn opaque([width, height]: [u32; 2], rgba: &[u8]) -> RgbImage {
    let samples = rgba.chunks_exact(4).flat_map(|pixel| &pixel[..3]).copied().collect();
    RgbImage::from_raw(width, height, samples).expect("they are of this size")
}

fn baseline(
    worker: &mut Worker,
    scratch: &Path,
    name: &str,
    picture: &TestPicture,
) -> Result<Placeholders> {
    let mut baselines = vec![versions::baseline_called(name)?];
    if name == TRIED_SLOWLY {
        baselines.push(&SLOWEST_AVIF);
    }
    let (whole, original) = (image_of(picture), original(picture));
    // The worker may have another working directory.
    let path = std::path::absolute(scratch.join(format!("placeholder of {}.png", picture.name)))?;
    let mut placeholders = Placeholders::default();
    for longer in SIDES {
        let scale = f64::from(longer) / f64::from(picture.width.max(picture.height));
        let scaled = |side| (f64::from(side) * scale).round().max(1.0) as u32;
        let [width, height] = [picture.width, picture.height].map(scaled);
        let small = imageops::resize(&whole, width, height, FilterType::Lanczos3);
        small.save(&path)?;
        let (path, rgb) = (path.clone(), small.into_raw());
        let small = TestPicture { name: picture.name.clone(), path, width, height, rgb };
        for baseline in &baselines {
            for setting in versions::settings(baseline).iter().step_by(SETTING_STEP) {
                let trip = worker.round_trip(baseline.id, setting, &small, Some(1), [1; 2])?;
                let bytes = trip.bytes as usize;
                // Files grow from setting to setting.
                if bytes > BUDGETS[BUDGETS.len() - 1] {
                    break;
                }
                let decoded = RgbImage::from_raw(width, height, trip.decoded);
                let shown = enlarged(&decoded.expect("it is of this size"), &original);
                offer(&mut placeholders, &Placeholder::new(bytes, shown, &original)?);
            }
        }
    }
    fs::remove_file(path)?;
    Ok(placeholders)
}

/// A small picture at the size of another one, as browsers enlarge.
fn enlarged(small: &RgbImage, like: &RgbImage) -> RgbImage {
    imageops::resize(small, like.width(), like.height(), FilterType::CatmullRom)
}

#[cfg(test)]
mod tests {
    use super::*;

    fn placeholder(bytes: usize, ssimulacra2: f64) -> Placeholder {
        Placeholder { bytes, shown: RgbImage::new(1, 1), ssimulacra2, psnr: 20.0 }
    }

    #[test]
    fn the_best_that_fits_is_kept() {
        let mut best = Placeholders::default();
        for (bytes, ssimulacra2) in [(801, 90.0), (300, 30.0), (150, 10.0), (160, 5.0), (390, 20.0)]
        {
            offer(&mut best, &placeholder(bytes, ssimulacra2));
        }
        let bytes = best.map(|best| best.map(|best| best.bytes));
        assert_eq!(bytes, [None, Some(150), Some(300), Some(300)]);
    }

    #[test]
    fn hashes_show_the_picture() {
        let (width, height) = (256, 160);
        let pixel = |x: u32, y: u32| [(x / 2) as u8 + 60, y as u8 + 60, 120];
        let rgb = (0..height).flat_map(|y| (0..width).flat_map(move |x| pixel(x, y))).collect();
        let picture = TestPicture { name: String::new(), path: "".into(), width, height, rgb };
        for placeholders in [thumb_hash(&picture), blur_hash(&picture)] {
            let first = placeholders.expect("it is small")[0].clone().expect("it fits");
            assert_eq!(first.shown.dimensions(), (32, 20));
            assert!(first.psnr > 25.0, "{}", first.psnr);
        }
    }
}
