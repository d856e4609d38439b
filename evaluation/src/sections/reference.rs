//! Our measurements of the baselines against those of other programs.

use std::collections::HashMap;
use std::path::Path;

use anyhow::{Context, Result, ensure};

use super::codec_curves::Codec;
use super::rate_store::Point;
use crate::pictures::TestPicture;
use crate::table::Table;

/// Bytes, PSNR and MS-SSIM of files by codec, setting and picture, of a CSV that other programs wrote.
pub(super) struct Reference {
    /// Of the CSV.
    name: String,
    files: HashMap<[String; 3], [f64; 3]>,
}

impl Reference {
    pub(super) fn load(path: &Path) -> Result<Self> {
        let unreadable = || format!("cannot read {}", path.display());
        let mut reader = csv::Reader::from_path(path).with_context(unreadable)?;
        let header = reader.headers().with_context(unreadable)?.clone();
        let column = |name: &str| {
            let index = header.iter().position(|column| column == name);
            index.with_context(|| format!("{} has no column `{name}`", path.display()))
        };
        let columns = ["codec", "quality", "image", "bytes", "psnr", "msssim"];
        let columns = columns.into_iter().map(column).collect::<Result<Vec<_>>>()?;
        let mut files = HashMap::new();
        for row in reader.records() {
            let row = row.with_context(unreadable)?;
            let cell = |index: usize| row.get(columns[index]).unwrap_or_default();
            let number = |index: usize| {
                cell(index).parse::<f64>().with_context(|| format!("{}: {row:?}", path.display()))
            };
            let key = Self::key(cell(0), cell(1), cell(2).trim_end_matches(".png"));
            files.insert(key, [number(3)?, number(4)?, number(5)?]);
        }
        let name = path.file_name().unwrap_or_default().to_string_lossy().into_owned();
        Ok(Self { name, files })
    }

    /// Settings that are numbers are compared by value: "0.50" and "0.5" are one.
    fn key(codec: &str, setting: &str, picture: &str) -> [String; 3] {
        let setting = setting.parse::<f64>().map_or(setting.to_owned(), |value| value.to_string());
        [codec.to_owned(), setting, picture.to_owned()]
    }

    /// The measurements that both have of a codec: theirs, and ours.
    fn common<'a>(
        &'a self,
        codec: &'a Codec,
        pictures: &'a [TestPicture],
    ) -> impl Iterator<Item = ([f64; 3], Point)> {
        let files = pictures.iter().zip(&codec.points).flat_map(|(picture, points)| {
            codec
                .settings
                .iter()
                .zip(points)
                .map(move |(setting, &point)| (picture, setting, point))
        });
        files.filter_map(|(picture, setting, point)| {
            let theirs = self.files.get(&Self::key(codec.id, setting, &picture.name))?;
            Some((*theirs, point))
        })
    }

    /// A table of how far our measurements are from theirs.
    ///
    /// # Errors
    /// When there is no file that both have.
    pub(super) fn compare(&self, pictures: &[TestPicture], codecs: &[Codec]) -> Result<String> {
        let columns =
            ["codec", "files", "of equal size", "largest difference in PSNR", "in MS-SSIM"];
        let mut table = Table::new(&columns);
        let mut compared = 0;
        for codec in codecs {
            let (mut files, mut equal, mut psnr, mut ms_ssim) = (0, 0, 0.0_f64, 0.0_f64);
            for ([bytes, their_psnr, their_ms_ssim], ours) in self.common(codec, pictures) {
                files += 1;
                equal += i32::from(bytes == ours.bytes);
                psnr = psnr.max((their_psnr - ours.distortion.psnr).abs());
                ms_ssim = ms_ssim.max((their_ms_ssim - ours.distortion.ms_ssim).abs());
            }
            compared += files;
            if files > 0 {
                table.row(&[
                    codec.name.to_owned(),
                    files.to_string(),
                    equal.to_string(),
                    format!("{psnr:.4} dB"),
                    format!("{ms_ssim:.6}"),
                ]);
            }
        }
        ensure!(compared > 0, "{} has none of the files that are measured here", self.name);
        Ok(format!(
            "\nOur measurements of the baselines against those in {}, which were made by other \
             programs (one that keeps JPEG XL at full resolution differs from distance 20 on):\n{}",
            self.name,
            table.finish()
        ))
    }
}

#[cfg(test)]
mod tests {
    use std::{fs, slice};

    use super::*;
    use crate::pictures::Distortion;

    #[test]
    fn files_that_both_have_are_compared() {
        let folder = tempfile::tempdir().expect("a folder");
        let path = folder.path().join("theirs.csv");
        let rows = "image,codec,quality,bytes,psnr,msssim\na.png,webp,50.0,100,30.5,0.9\n\
                    a,gip,\"0.5 bpp, effort 4\",70,31,0.9\nb,webp,50,1,1,1\n";
        fs::write(&path, rows).expect("it is written");
        let reference = Reference::load(&path).expect("it is a table");
        let picture =
            TestPicture { name: "a".into(), path: "".into(), width: 1, height: 1, rgb: vec![0; 3] };
        let point = |bytes: f64, psnr: f64| {
            let distortion = Distortion::from([psnr, 0.9, 0.0, 0.0, 0.0]);
            Point { bytes, rate: 1.0, distortion }
        };
        let codec = |id, setting: &str, point| Codec {
            id,
            name: id,
            settings: vec![setting.to_owned()],
            points: vec![vec![point]],
            retuned: Vec::new(),
        };
        let codecs = [
            codec("webp", "50", point(100.0, 30.25)),
            codec("gip", "0.5 bpp, effort 4", point(71.0, 31.0)),
            codec("jp2", "0.5", point(1.0, 1.0)),
        ];
        let text = reference.compare(slice::from_ref(&picture), &codecs).expect("two are common");
        assert!(text.contains("| webp | 1 | 1 | 0.2500 dB |"), "{text}");
        assert!(text.contains("| gip | 1 | 0 | 0.0000 dB |") && !text.contains("jp2"), "{text}");
        assert!(reference.compare(&[picture], &codecs[2..]).is_err());
    }
}
