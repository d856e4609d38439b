//! A two-level method after LIG ("Large Images are Gaussians"), from this crate's parts: a picture
//! of half the size first, then what is missing at full size, with all Gaussians added up.

use anyhow::Result;
use image_gip::training::Training;
use image_gip::{ColorModel, Precision, Source, Target};

use super::handmade::Handmade;
use crate::pictures::Picture;
use crate::{gip, memory};

/// Of so many Gaussians the first level gets one: as many per pixel as the second.
const SHARE: u32 = 5;

/// Both levels in one file, and what they cost.
#[derive(Clone, Debug)]
pub(super) struct Levels {
    pub(super) file: Vec<u8>,
    pub(super) gaussians: u32,
    pub(super) seconds: f64,
    pub(super) memory: f64,
}

/// Fits a picture with at most so many Gaussians in all; each level trains on its own.
pub(super) fn fit(picture: &Picture, gaussians: u32, training: &Training) -> Result<Levels> {
    let (half, size) = halved(picture);
    let first = (gaussians / SHARE).max(1);
    let (coarse, [seconds, memory]) = level(&half, size, first, training)?;
    let mut sum = Handmade::from_file(&coarse)?;
    sum.size = (picture.width, picture.height);
    // The model is continuous: centres and the factors of covariances grow alike.
    sum.gaussians.iter_mut().for_each(|row| row[..5].iter_mut().for_each(|value| *value *= 2.0));

    let second = (gaussians - first).max(1);
    let missing = missing(picture, &gip::planes(&sum.file())?);
    let (fine, costs) = level(&missing, sum.size, second, training)?;
    let fine = Handmade::from_file(&fine)?;
    sum.gaussians.extend(fine.gaussians.into_iter().map(|mut row| {
        row[5..].iter_mut().for_each(|amplitude| *amplitude *= 2.0);
        row
    }));
    for (base, fine) in sum.base.iter_mut().zip(fine.base) {
        // What is missing is stored as a half of itself on mid-gray.
        let both = i32::from(*base) + 2 * i32::from(fine) - i32::from(u16::MAX);
        *base = both.clamp(0, u16::MAX.into()) as u16;
    }
    Ok(Levels {
        file: sum.file(),
        gaussians: sum.gaussians.len() as u32,
        seconds: seconds + costs[0],
        memory: memory.max(costs[1]),
    })
}

/// A file of floats, with seconds and bytes that it took.
fn level(
    samples: &[u16],
    (width, height): (u32, u32),
    gaussians: u32,
    training: &Training,
) -> Result<(Vec<u8>, [f64; 2])> {
    let source = Source::new_u16(width, height, ColorModel::Rgb, samples)?;
    let encoder = gip::encoder(gip::EFFORT)
        .with_target(Target::Gaussians(gaussians))
        .with_precision(Precision::Float)
        .with_training(training.clone());
    let (encoded, memory) = memory::peak(|| encoder.encode(&source));
    let encoded = encoded?;
    Ok((encoded.bytes, [encoded.report.seconds, memory]))
}

/// Means over two by two pixels, with the size. Odd sides count their last pixels twice.
fn halved(picture: &Picture) -> (Vec<u16>, (u32, u32)) {
    let (width, height) = (picture.width.div_ceil(2), picture.height.div_ceil(2));
    let sample = |x: u32, y: u32, channel: u32| {
        let (x, y) = (x.min(picture.width - 1), y.min(picture.height - 1));
        u32::from(picture.rgb[((y * picture.width + x) * 3 + channel) as usize])
    };
    let samples = (0..width * height * 3).map(|index| {
        let (x, y, channel) = (2 * (index / 3 % width), 2 * (index / 3 / width), index % 3);
        let corners = [(x, y), (x + 1, y), (x, y + 1), (x + 1, y + 1)];
        let sum: u32 = corners.map(|(x, y)| sample(x, y, channel)).iter().sum();
        (sum * 257 / 4) as u16
    });
    (samples.collect(), (width, height))
}

/// What planes lack of the picture, a half of it on mid-gray.
fn missing(picture: &Picture, planes: &[f32]) -> Vec<u16> {
    let pixels = picture.rgb.len() / 3;
    let samples = picture.rgb.iter().enumerate().map(|(index, &sample)| {
        let missing = f32::from(sample) / 255.0 - planes[index % 3 * pixels + index / 3];
        // A cast keeps within the bounds.
        ((0.5 + 0.5 * missing) * 65535.0).round() as u16
    });
    samples.collect()
}

#[cfg(test)]
mod tests {
    use image_gip::Chart;

    use super::*;
    use crate::sections::methods;

    #[test]
    fn both_levels_add_up_to_the_picture() {
        let (width, height) = (33, 20);
        // A ramp, which the first level gets, with an edge, which it cannot get.
        let rgb = (0..width * height).flat_map(|i| {
            let (x, y) = ((i % 33) as u8, (i / 33) as u8);
            [4 * x, 5 * y, if x < 17 { 60 } else { 200 }]
        });
        let picture =
            Picture { name: String::new(), path: "".into(), width, height, rgb: rgb.collect() };
        let training = methods::paper(300, Chart::Covariance, false, false);
        let levels = fit(&picture, 60, &training).expect("a small picture");
        assert!((13..=60).contains(&levels.gaussians), "{}", levels.gaussians);
        let psnr = gip::psnr_float(&levels.file, &picture).expect("it decodes");
        let (half, size) = halved(&picture);
        assert_eq!((size, half.len()), ((17, 10), 17 * 10 * 3));
        let (coarse, _) = level(&half, size, 12, &training).expect("a small picture");
        let mut coarse = Handmade::from_file(&coarse).expect("it is RGB");
        coarse.size = (width, height);
        coarse.gaussians.iter_mut().flat_map(|row| &mut row[..5]).for_each(|value| *value *= 2.0);
        let alone = gip::psnr_float(&coarse.file(), &picture).expect("it decodes");
        assert!(psnr > alone + 3.0 && psnr > 25.0, "{psnr}, {alone} with one level");
    }
}
