//! Metrics that were fitted to what people see, of interleaved 8-bit sRGB.

use anyhow::{Result, anyhow};
use butteraugli::{ButteraugliError, ButteraugliParams, ButteraugliReference};
use colorvideovdp::{Color, Cvvdp, DisplayModel, Image, Options};
use fast_ssim2::{
    PixelDescriptor, PixelSlice, Ssimulacra2Reference, compute_ssimulacra2,
    compute_ssimulacra2_maps,
};

/// SSIMULACRA2: 100 for equal pictures; 90 is hard to tell from the source, 70 is high quality, 50
/// is medium, 30 is low.
pub(crate) fn ssimulacra2(source: &[u8], decoded: &[u8], width: u32, height: u32) -> Result<f64> {
    Ok(compute_ssimulacra2(&pixels(source, width, height)?, &pixels(decoded, width, height)?)?)
}

/// What each pixel contributes to SSIMULACRA2: 0 where the pictures agree, more where they differ.
pub(crate) fn ssimulacra2_map(
    source: &[u8],
    decoded: &[u8],
    width: u32,
    height: u32,
) -> Result<Vec<f32>> {
    let (source, decoded) = (pixels(source, width, height)?, pixels(decoded, width, height)?);
    Ok(compute_ssimulacra2_maps(&source, &decoded)?.diffmap())
}

fn pixels(samples: &[u8], width: u32, height: u32) -> Result<PixelSlice<'_>> {
    let stride = width as usize * 3;
    let slice = PixelSlice::new(samples, width, height, stride, PixelDescriptor::RGB8_SRGB);
    slice.map_err(|error| anyhow!("{error}"))
}

/// What SSIMULACRA2 and Butteraugli need of a source, for many decoded pictures: with it they take a quarter and a
/// half less time.
pub(crate) struct Reference {
    width: u32,
    height: u32,
    ssimulacra2: Ssimulacra2Reference,
    butteraugli: Option<ButteraugliReference>,
}

impl Reference {
    pub(crate) fn new(source: &[u8], width: u32, height: u32) -> Result<Self> {
        let sides = [width, height].map(|side| side as usize);
        let parameters = ButteraugliParams::default();
        let butteraugli = match ButteraugliReference::new(source, sides[0], sides[1], parameters) {
            Err(ButteraugliError::InvalidDimensions { .. }) => None,
            reference => Some(reference?),
        };
        let ssimulacra2 = Ssimulacra2Reference::new(&pixels(source, width, height)?)?;
        Ok(Self { width, height, ssimulacra2, butteraugli })
    }

    /// What [`ssimulacra2`] is.
    pub(crate) fn ssimulacra2(&self, decoded: &[u8]) -> Result<f64> {
        Ok(self.ssimulacra2.compare(&pixels(decoded, self.width, self.height)?)?)
    }

    /// The 3-norm of Butteraugli: 0 for equal pictures, and more the further apart they look. Below
    /// 8 x 8 pixels it is not defined: NaN.
    pub(crate) fn butteraugli_3_norm(&self, decoded: &[u8]) -> Result<f64> {
        let Some(reference) = &self.butteraugli else { return Ok(f64::NAN) };
        Ok(reference.compare(decoded)?.pnorm_3)
    }
}

/// The display that CVVDP assumes: 24 inches of full HD, of 200 cd/m² in an office, seen from 60 cm.
const DISPLAY: &str = "standard_fhd";
/// What CVVDP may take for its work, in bytes: a GiB, its default, is too little for pictures of three megapixels.
const CVVDP_MEMORY: usize = 4 << 30;

/// ColorVideoVDP in JOD: 10 for equal pictures; of two pictures that are 1 apart, three of four
/// people prefer the one with more. Below 4 x 4 pixels it is not defined: NaN.
pub(crate) fn cvvdp(source: &[u8], decoded: &[u8], width: u32, height: u32) -> Result<f64> {
    if width.min(height) < 4 {
        return Ok(f64::NAN);
    }
    let image = |samples: &[u8]| {
        let samples = samples.iter().map(|&sample| f32::from(sample) / 255.0).collect();
        Image::new(width as usize, height as usize, 3, samples)
    };
    let options = Options::default().with_memory_limit_bytes(CVVDP_MEMORY);
    let metric = Cvvdp::new(DisplayModel::from_name(DISPLAY)?, options)?;
    let prediction = metric.predict_image(&image(decoded)?, &image(source)?, Color::Srgb)?;
    Ok(prediction.jod.into())
}

#[cfg(test)]
mod tests {
    use super::*;
    use ssimulacra2::{ColorPrimaries, Rgb, TransferCharacteristic, compute_frame_ssimulacra2};

    const SIDES: (u32, u32) = (144, 96);

    /// Waves of three sizes, one per channel, with fine texture in the right half. All integers, so
    /// that it is the same everywhere.
    fn picture() -> Vec<u8> {
        let wave = |at: u32, period: u32| (at % period).abs_diff(period / 2) * 160 / period;
        let pixel = |x: u32, y: u32| {
            let texture = if x > SIDES.0 / 2 { ((x * 37) ^ (y * 59)) % 23 } else { 0 };
            [wave(x + y, 64), wave(x + 2 * y, 36), wave(3 * x + y, 90)]
                .map(|sample| (60 + sample + texture) as u8)
        };
        (0..SIDES.1).flat_map(|y| (0..SIDES.0).flat_map(move |x| pixel(x, y))).collect()
    }

    fn reference() -> Reference {
        Reference::new(&picture(), SIDES.0, SIDES.1).expect("it fits")
    }

    /// A picture with coarser samples: so many values become one.
    fn coarser(samples: &[u8], values: u8) -> Vec<u8> {
        samples.iter().map(|sample| sample / values * values + values / 2).collect()
    }

    #[test]
    fn ssimulacra2_is_that_of_two_other_implementations() {
        // Of the command `ssimulacra2` of libjxl 0.11.2.
        for (values, libjxl) in [(5, 90.704_774), (12, 77.262_590), (40, 28.200_527)] {
            let (source, decoded) = (picture(), coarser(&picture(), values));
            let score = ssimulacra2(&source, &decoded, SIDES.0, SIDES.1).expect("equal sizes");
            let rgb = |samples: &[u8]| {
                let pixel = |rgb: &[u8]| [0, 1, 2].map(|channel| f32::from(rgb[channel]) / 255.0);
                let (transfer, primaries) = (TransferCharacteristic::SRGB, ColorPrimaries::BT709);
                let pixels = samples.chunks_exact(3).map(pixel).collect();
                Rgb::new(pixels, SIDES.0 as usize, SIDES.1 as usize, transfer, primaries)
                    .expect("so many samples")
            };
            let oracle = compute_frame_ssimulacra2(rgb(&source), rgb(&decoded)).expect("it fits");
            assert!((score - oracle).abs() < 0.2, "{values}: {score} {oracle}");
            assert!((score - libjxl).abs() < 1e-3, "{values}: {score} {libjxl}");
            assert_eq!(reference().ssimulacra2(&decoded).expect("equal sizes"), score);
        }
    }

    #[test]
    fn butteraugli_is_that_of_libjxl() {
        // Of the command `butteraugli_main` of libjxl 0.11.2.
        for (values, libjxl) in [(5, 0.538_620), (12, 0.986_291), (40, 3.934_458)] {
            let norm = reference().butteraugli_3_norm(&coarser(&picture(), values));
            let norm = norm.expect("equal sizes");
            assert!((norm / libjxl - 1.0).abs() < 1e-4, "{values}: {norm} {libjxl}");
        }
    }

    #[test]
    fn cvvdp_falls_as_the_error_grows() {
        let jod = [5, 12, 40].map(|values| {
            cvvdp(&picture(), &coarser(&picture(), values), SIDES.0, SIDES.1).expect("equal sizes")
        });
        assert!(10.0 > jod[0] && jod[0] > jod[1] && jod[1] > jod[2], "{jod:?}");
    }

    #[test]
    fn the_map_shows_where_the_error_is() {
        let (source, width) = (picture(), SIDES.0 as usize);
        let mut decoded = source.clone();
        // Only the left quarter is coarser.
        for row in decoded.chunks_exact_mut(3 * width) {
            let coarse = coarser(&row[..3 * width / 4], 40);
            row[..coarse.len()].copy_from_slice(&coarse);
        }
        let map = ssimulacra2_map(&source, &decoded, SIDES.0, SIDES.1).expect("equal sizes");
        let sum = |columns: std::ops::Range<usize>| -> f32 {
            map.chunks_exact(width).flat_map(|row| &row[columns.clone()]).sum()
        };
        assert!(sum(0..width / 4) > 10.0 * sum(width / 2..width * 3 / 4));
    }

    #[test]
    fn equal_pictures_are_perfect_and_tiny_ones_are_not_refused() {
        let source = picture();
        assert_eq!(ssimulacra2(&source, &source, SIDES.0, SIDES.1).expect("it fits"), 100.0);
        assert_eq!(reference().butteraugli_3_norm(&source).expect("it fits"), 0.0);
        assert!(ssimulacra2(&[0; 3], &[9; 3], 1, 1).is_ok_and(|score| score < 100.0));
        let pixel = Reference::new(&[0; 3], 1, 1).expect("it fits");
        assert!(pixel.butteraugli_3_norm(&[9; 3]).is_ok_and(f64::is_nan));
        assert_eq!(cvvdp(&source, &source, SIDES.0, SIDES.1).expect("it fits"), 10.0);
        assert!(cvvdp(&[0; 3], &[9; 3], 1, 1).is_ok_and(f64::is_nan));
    }
}
