//! A two-level method after LIG ("Large Images are Gaussians"), from this crate's parts: the first
//! level fits the picture at half its size, the second one fits the residual at full size. Their
//! Gaussians are added up.

use anyhow::Result;
use image_gip::training::Training;
use image_gip::{ColorModel, Precision, Source, Target};

use super::float_file::FloatFile;
use crate::pictures::TestPicture;
use crate::{gip, memory};

/// One in so many Gaussians goes to the first level, so that both levels have the same number of
/// Gaussians per pixel.
const SHARE: u32 = 5;

/// Both levels in one file, and what they cost.
#[derive(Clone, Debug)]
pub(super) struct TwoLevelFit {
    pub(super) file: Vec<u8>,
    pub(super) gaussians: u32,
    pub(super) seconds: f64,
    /// Peak memory of the encoder, in bytes.
    pub(super) memory: f64,
}

/// Fits a picture with at most so many Gaussians in all; each level is trained on its own.
pub(super) fn fit(
    picture: &TestPicture,
    gaussians: u32,
    training: &Training,
) -> Result<TwoLevelFit> {
    let first = (gaussians / SHARE).max(1);
    let (half, half_size) = downsampled(picture);
    let (coarse, costs) = fit_level(&half, half_size, first, training)?;
    let mut sum = upsampled(&coarse, picture)?;

    let second = (gaussians - first).max(1);
    let residual = residual(picture, &gip::planes(&sum.to_bytes())?);
    let (fine, fine_costs) = fit_level(&residual, sum.size, second, training)?;
    let fine = FloatFile::read(&fine)?;
    // The residual was stored as r / 2 + 1/2: its amplitudes count twice, and its base colour b
    // stands for 2 b - 1.
    sum.gaussians.extend(fine.gaussians.into_iter().map(|mut row| {
        row[5..].iter_mut().for_each(|amplitude| *amplitude *= 2.0);
        row
    }));
    for (base, fine) in sum.base.iter_mut().zip(fine.base) {
        let both = i32::from(*base) + 2 * i32::from(fine) - i32::from(u16::MAX);
        *base = both.clamp(0, u16::MAX.into()) as u16;
    }
    Ok(TwoLevelFit {
        file: sum.to_bytes(),
        gaussians: sum.gaussians.len() as u32,
        seconds: costs.seconds + fine_costs.seconds,
        memory: costs.memory.max(fine_costs.memory),
    })
}

/// What a level costs.
struct LevelCosts {
    seconds: f64,
    memory: f64,
}

/// A `.gip` file of the samples, with what it cost.
fn fit_level(
    samples: &[u16],
    (width, height): (u32, u32),
    gaussians: u32,
    training: &Training,
) -> Result<(Vec<u8>, LevelCosts)> {
    let source = Source::new_u16(width, height, ColorModel::Rgb, samples)?;
    let encoder = gip::psnr_encoder(gip::EFFORT)
        .with_target(Target::Gaussians(gaussians))
        .with_precision(Precision::Float)
        .with_training(training.clone());
    let (encoded, memory) = memory::peak(|| encoder.encode(&source));
    let encoded = encoded?;
    Ok((encoded.bytes, LevelCosts { seconds: encoded.report.seconds, memory }))
}

/// The Gaussians of a file of half the picture's size, at its full size. Gaussians are continuous:
/// their centres and the factors of their covariances are multiplied by two.
fn upsampled(half: &[u8], picture: &TestPicture) -> Result<FloatFile> {
    let mut file = FloatFile::read(half)?;
    file.size = (picture.width, picture.height);
    file.gaussians.iter_mut().flat_map(|row| &mut row[..5]).for_each(|value| *value *= 2.0);
    Ok(file)
}

/// Means over two by two pixels, with the size. The last column and row of odd sides are repeated.
fn downsampled(picture: &TestPicture) -> (Vec<u16>, (u32, u32)) {
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

/// The picture minus the planes: a residual `r` is stored as `r / 2 + 1/2`.
fn residual(picture: &TestPicture, planes: &[f32]) -> Vec<u16> {
    let pixels = picture.rgb.len() / 3;
    let samples = picture.rgb.iter().enumerate().map(|(index, &sample)| {
        let residual = f32::from(sample) / 255.0 - planes[index % 3 * pixels + index / 3];
        // The cast saturates.
        ((0.5 + 0.5 * residual) * 65535.0).round() as u16
    });
    samples.collect()
}

#[cfg(test)]
mod tests {
    use image_gip::Parameterization;

    use super::*;
    use crate::sections::methods;

    #[test]
    fn both_levels_add_up_to_the_picture() {
        let (width, height) = (33, 20);
        // A ramp, which the first level can fit, with an edge, which it cannot.
        let rgb = (0..width * height).flat_map(|i| {
            let (x, y) = ((i % 33) as u8, (i / 33) as u8);
            [4 * x, 5 * y, if x < 17 { 60 } else { 200 }]
        });
        let picture =
            TestPicture { name: String::new(), path: "".into(), width, height, rgb: rgb.collect() };
        let training = methods::paper(300, Parameterization::Covariance, false, false);
        let both = fit(&picture, 60, &training).expect("a small picture");
        assert!((13..=60).contains(&both.gaussians), "{}", both.gaussians);
        let psnr = gip::psnr_float(&both.file, &picture).expect("it decodes");
        let (half, size) = downsampled(&picture);
        assert_eq!((size, half.len()), ((17, 10), 17 * 10 * 3));
        let (coarse, _) = fit_level(&half, size, 12, &training).expect("a small picture");
        let coarse = upsampled(&coarse, &picture).expect("it is RGB").to_bytes();
        let alone = gip::psnr_float(&coarse, &picture).expect("it decodes");
        assert!(psnr > alone + 3.0 && psnr > 25.0, "{psnr}, {alone} with one level");
    }

    #[test]
    fn the_residual_is_what_is_missing() {
        let picture = TestPicture {
            name: String::new(),
            path: "".into(),
            width: 1,
            height: 2,
            rgb: vec![255, 0, 51, 255, 0, 51],
        };
        // Planes: red, green, blue of both pixels.
        let planes = [0.0, 1.0, 0.0, 1.0, 0.2, 3.0];
        assert_eq!(residual(&picture, &planes), [65_535, 32_768, 32_768, 32_768, 0, 0]);
    }
}
