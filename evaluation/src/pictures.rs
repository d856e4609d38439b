//! The test pictures.

use std::fs;
use std::path::{Path, PathBuf};

use anyhow::{Context, Result, ensure};
use image::{Rgb, RgbImage};
use image_gip::metrics;

use crate::visual;

/// An 8-bit RGB picture, from a file or synthetic.
#[derive(Clone, Debug)]
pub(crate) struct TestPicture {
    pub(crate) name: String,
    /// Where the file is, for other programs to read.
    pub(crate) path: PathBuf,
    pub(crate) width: u32,
    pub(crate) height: u32,
    /// Interleaved samples.
    pub(crate) rgb: Vec<u8>,
}

/// Pictures that are measured together.
#[derive(Clone, Debug)]
pub(crate) struct PictureSet {
    pub(crate) name: &'static str,
    pub(crate) pictures: Vec<TestPicture>,
}

impl PictureSet {
    /// One in so many of the pictures, evenly spread.
    pub(crate) fn every(mut self, step: usize) -> Self {
        self.pictures = self.pictures.into_iter().step_by(step).collect();
        self
    }
}

/// How well a decoded picture agrees with its source.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Distortion {
    /// In dB, over all samples.
    pub(crate) psnr: f64,
    pub(crate) ms_ssim: f64,
    pub(crate) ssimulacra2: f64,
    /// Butteraugli's 3-norm.
    pub(crate) butteraugli: f64,
    /// In JOD.
    pub(crate) cvvdp: f64,
}

impl Distortion {
    /// What CSV files call the values.
    const COLUMNS: [&str; 5] = ["psnr", "msssim", "ssimulacra2", "butteraugli", "cvvdp"];

    /// The columns of a CSV file of `V` values: the size and the rate of a file, its distortion, and others.
    ///
    /// # Panics
    /// When there are not so many.
    pub(crate) fn columns_of_file<const V: usize>(others: &[&'static str]) -> [&'static str; V] {
        let columns = [&["bytes", "bpp"], &Self::COLUMNS[..], others].concat();
        columns.try_into().expect("the store has as many values as columns")
    }

    /// In the order of the columns.
    pub(crate) fn values(&self) -> [f64; 5] {
        [self.psnr, self.ms_ssim, self.ssimulacra2, self.butteraugli, self.cvvdp]
    }
}

impl From<[f64; 5]> for Distortion {
    fn from([psnr, ms_ssim, ssimulacra2, butteraugli, cvvdp]: [f64; 5]) -> Self {
        Self { psnr, ms_ssim, ssimulacra2, butteraugli, cvvdp }
    }
}

/// A picture with what metrics need of it.
pub(crate) struct Reference<'a> {
    pub(crate) picture: &'a TestPicture,
    visual: visual::Reference,
}

impl Reference<'_> {
    pub(crate) fn distortion(&self, decoded: &[u8]) -> Result<Distortion> {
        let TestPicture { rgb, width, height, .. } = self.picture;
        ensure!(
            decoded.len() == rgb.len(),
            "{} samples were decoded in place of {}",
            decoded.len(),
            rgb.len()
        );
        Ok(Distortion {
            psnr: metrics::psnr(rgb, decoded, 255.0),
            ms_ssim: metrics::ms_ssim(rgb, decoded, *width as usize, 3, 255.0),
            ssimulacra2: self.visual.ssimulacra2(decoded)?,
            butteraugli: self.visual.butteraugli_3_norm(decoded)?,
            cvvdp: visual::cvvdp(rgb, decoded, *width, *height)?,
        })
    }
}

impl TestPicture {
    pub(crate) fn pixels(&self) -> f64 {
        f64::from(self.width) * f64::from(self.height)
    }

    /// Bits per pixel of a file of so many bytes.
    pub(crate) fn rate(&self, bytes: f64) -> f64 {
        8.0 * bytes / self.pixels()
    }

    /// What it is that decoded pictures are compared with.
    pub(crate) fn reference(&self) -> Result<Reference<'_>> {
        let visual = visual::Reference::new(&self.rgb, self.width, self.height)?;
        Ok(Reference { picture: self, visual })
    }

    /// For one decoded picture; for more of them, [`Self::reference`] takes less time.
    pub(crate) fn distortion(&self, decoded: &[u8]) -> Result<Distortion> {
        self.reference()?.distortion(decoded)
    }

    /// The picture at another size: cropped, or continued in mirror images.
    pub(crate) fn mirrored(&self, width: u32, height: u32) -> Self {
        let mut rgb = Vec::with_capacity(width as usize * height as usize * 3);
        let mirror = |i: u32, side: u32| {
            let back = i / side % 2 == 1;
            if back { side - 1 - i % side } else { i % side }
        };
        for y in 0..height {
            let row = mirror(y, self.height) * self.width;
            for x in 0..width {
                let index = (row + mirror(x, self.width)) as usize * 3;
                rgb.extend_from_slice(&self.rgb[index..index + 3]);
            }
        }
        Self { width, height, rgb, ..self.clone() }
    }
}

/// A picture of so many columns and rows of square tiles, which are parts of some pictures, none of them twice; `None`
/// where they have not as many.
pub(crate) fn mosaic(
    pictures: &[&TestPicture],
    (columns, rows): (u32, u32),
    side: u32,
) -> Option<TestPicture> {
    let mut tiles = pictures.iter().flat_map(|picture| {
        let (across, down) = (picture.width / side, picture.height / side);
        (0..across * down).map(move |tile| (picture, tile % across * side, tile / across * side))
    });
    let mut mosaic = RgbImage::new(columns * side, rows * side);
    for tile in 0..columns * rows {
        let (picture, left, top) = tiles.next()?;
        for (x, y) in (0..side).flat_map(|y| (0..side).map(move |x| (x, y))) {
            let index = ((top + y) * picture.width + left + x) as usize * 3;
            let pixel = [0, 1, 2].map(|sample| picture.rgb[index + sample]);
            mosaic.put_pixel(tile % columns * side + x, tile / columns * side + y, Rgb(pixel));
        }
    }
    let (width, height) = mosaic.dimensions();
    let name = format!("{columns} x {rows} tiles");
    Some(TestPicture { name, path: PathBuf::new(), width, height, rgb: mosaic.into_raw() })
}

/// All PNGs of a folder by name, or the `at_most` smallest of them, which are quick to measure.
pub(crate) fn load(folder: &Path, at_most: Option<usize>) -> Result<Vec<TestPicture>> {
    let unreadable = || format!("cannot read the folder {}", folder.display());
    let mut paths = Vec::new();
    for entry in fs::read_dir(folder).with_context(unreadable)? {
        let path = entry?.path();
        if path.extension().is_some_and(|extension| extension.eq_ignore_ascii_case("png")) {
            paths.push(path);
        }
    }
    ensure!(!paths.is_empty(), "there is no .png in {}", folder.display());
    paths.sort();
    if let Some(most) = at_most {
        let sized = paths.into_iter().map(|path| Ok((pixels(&path)?, path)));
        let mut sized = sized.collect::<Result<Vec<_>>>()?;
        sized.sort();
        paths = sized.into_iter().take(most).map(|(_, path)| path).collect();
    }
    paths.iter().map(|path| open(path)).collect()
}

/// The number of pixels of a file, by its header.
fn pixels(path: &Path) -> Result<u64> {
    let size = image::image_dimensions(path);
    let (width, height) = size.with_context(|| format!("cannot read {}", path.display()))?;
    Ok(u64::from(width) * u64::from(height))
}

/// What Markdown takes for more than a letter; not in names of pictures.
const RESERVED: &[char] = &['|', '*', '<', '>', '`', '[', ']', '\\', '$'];

/// The picture of a file.
pub(crate) fn open(path: &Path) -> Result<TestPicture> {
    let image = image::open(path).with_context(|| format!("cannot read {}", path.display()))?;
    let image = image.into_rgb8();
    let name = path.file_stem().unwrap_or_default().to_string_lossy().into_owned();
    let (width, height) = image.dimensions();
    // Absolute, because the worker may have another working directory.
    let path = fs::canonicalize(path).with_context(|| format!("cannot find {}", path.display()))?;
    // Names go into tables of Markdown, and paths into lines for the worker.
    ensure!(
        !name.contains(RESERVED) && !path.to_string_lossy().contains(char::is_control),
        "{path:?} has a name or a folder with control characters or with one of {}: rename it",
        RESERVED.iter().collect::<String>()
    );
    Ok(TestPicture { name, path, width, height, rgb: image.into_raw() })
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn mirrors_meet_without_an_edge() {
        let rgb = (0..2 * 2 * 3).collect();
        let picture =
            TestPicture { name: String::new(), path: PathBuf::new(), width: 2, height: 2, rgb };
        let mirrored = picture.mirrored(5, 3);
        let reds: Vec<u8> = mirrored.rgb.iter().step_by(3).copied().collect();
        assert_eq!(reds, [0, 3, 3, 0, 0, 6, 9, 9, 6, 6, 6, 9, 9, 6, 6]);
        assert_eq!(picture.mirrored(2, 2).rgb, picture.rgb);
        assert_eq!(picture.mirrored(1, 1).rgb, [0, 1, 2]);
    }

    #[test]
    fn the_smallest_pictures_are_the_quick_ones() {
        let folder = tempfile::tempdir().expect("a folder");
        for (name, size) in [("a", (9, 9)), ("b", (3, 2)), ("c", (4, 4)), ("d", (2, 3))] {
            let path = folder.path().join(name).with_extension("png");
            RgbImage::new(size.0, size.1).save(path).expect("it is written");
        }
        let names = |at_most| -> Vec<String> {
            let pictures = load(folder.path(), at_most).expect("there are pictures");
            pictures.into_iter().map(|picture| picture.name).collect()
        };
        assert_eq!(names(None), ["a", "b", "c", "d"]);
        assert_eq!(names(Some(3)), ["b", "d", "c"]);
        assert_eq!(names(Some(9)).len(), 4);
    }

    #[test]
    fn names_that_tables_cannot_have_are_refused() {
        let folder = tempfile::tempdir().expect("a folder");
        for (name, fits) in [("a, b (c)", true), ("ü_1-2", true), ("a|b", false), ("a\nb", false)]
        {
            let path = folder.path().join(format!("{name}.png"));
            RgbImage::new(1, 1).save(&path).expect("it is written");
            let opened = open(&path);
            assert_eq!(opened.is_ok(), fits, "{name}");
            let refusal = opened.err().map(|error| error.to_string());
            assert!(refusal.is_none_or(|refusal| refusal.contains("rename it")), "{name}");
        }
    }

    #[test]
    fn one_in_so_many_pictures_can_be_taken() {
        let picture = |name: &str| {
            let rgb = vec![0; 3];
            TestPicture { name: name.into(), path: "".into(), width: 1, height: 1, rgb }
        };
        let set = PictureSet { name: "photos", pictures: ["a", "b", "c"].map(picture).into() };
        let names = |step: usize| -> Vec<String> {
            set.clone().every(step).pictures.into_iter().map(|picture| picture.name).collect()
        };
        assert_eq!(
            (names(1), names(2)),
            (vec!["a".into(), "b".into(), "c".into()], vec!["a".into(), "c".into()])
        );
    }

    #[test]
    fn a_mosaic_has_every_tile_once() {
        let picture = |width: u32, height: u32, first: u8| {
            let rgb = (0..(width * height * 3) as u8).map(|sample| first + sample).collect();
            TestPicture { name: String::new(), path: PathBuf::new(), width, height, rgb }
        };
        let (wide, high) = (picture(3, 1, 0), picture(1, 2, 100));
        let mosaic = mosaic(&[&wide, &high], (2, 2), 1).expect("there are five tiles");
        assert_eq!((mosaic.width, mosaic.height), (2, 2));
        assert_eq!(mosaic.rgb, [0, 1, 2, 3, 4, 5, 6, 7, 8, 100, 101, 102]);
        assert!(super::mosaic(&[&wide], (2, 2), 1).is_none());
        assert!(super::mosaic(&[&wide], (1, 1), 2).is_none());
    }

    #[test]
    fn equal_samples_have_no_distortion_and_other_sizes_are_refused() {
        let rgb = vec![7; 3];
        let picture =
            TestPicture { name: String::new(), path: PathBuf::new(), width: 1, height: 1, rgb };
        assert_eq!(picture.distortion(&[7; 3]).expect("it fits").psnr, f64::INFINITY);
        assert!(picture.distortion(&[7; 4]).is_err());
    }
}
