//! Our measurements of the baselines against those of other programs.

use std::collections::HashMap;
use std::path::Path;

use anyhow::{Context, Result, ensure};

use super::codec_curves::Codec;
use crate::pictures::TestPicture;
use crate::table::Table;

/// Compares our measurements of the baselines with those of a CSV, at equal settings.
pub(super) fn compare(path: &Path, pictures: &[TestPicture], codecs: &[Codec]) -> Result<String> {
    let columns = ["codec", "quality", "image", "bytes", "psnr", "msssim"];
    let mut reader =
        csv::Reader::from_path(path).with_context(|| format!("cannot read {}", path.display()))?;
    let header = reader.headers()?.clone();
    let column = |name: &str| {
        let index = header.iter().position(|column| column == name);
        index.with_context(|| format!("{} has no column `{name}`", path.display()))
    };
    let columns = columns.into_iter().map(column).collect::<Result<Vec<_>>>()?;
    let mut known = HashMap::new();
    for row in reader.records() {
        let row = row?;
        let cell = |index: usize| row.get(columns[index]).unwrap_or_default();
        let number = |index: usize| {
            cell(index).parse::<f64>().with_context(|| format!("{}: {row:?}", path.display()))
        };
        let image = cell(2).trim_end_matches(".png").to_owned();
        // By value: "0.50" and "0.5" are one setting.
        let key = (cell(0).to_owned(), number(1)?.to_bits(), image);
        known.insert(key, [number(3)?, number(4)?, number(5)?]);
    }

    let columns = ["codec", "files", "of equal size", "largest difference in PSNR", "in MS-SSIM"];
    let mut table = Table::new(&columns);
    let mut compared = 0;
    for codec in codecs {
        let (mut files, mut equal, mut psnr, mut ms_ssim) = (0, 0, 0.0_f64, 0.0_f64);
        for (picture, points) in pictures.iter().zip(&codec.points) {
            for (setting, point) in codec.settings.iter().zip(points) {
                let key =
                    (codec.id.to_owned(), setting.parse::<f64>()?.to_bits(), picture.name.clone());
                let Some(other) = known.get(&key) else { continue };
                files += 1;
                equal += i32::from(other[0] == point.bytes);
                psnr = psnr.max((other[1] - point.distortion.psnr).abs());
                ms_ssim = ms_ssim.max((other[2] - point.distortion.ms_ssim).abs());
            }
        }
        compared += files;
        table.row(&[
            codec.name.to_owned(),
            files.to_string(),
            equal.to_string(),
            format!("{psnr:.4} dB"),
            format!("{ms_ssim:.6}"),
        ]);
    }
    ensure!(compared > 0, "{} has none of these files", path.display());
    Ok(format!(
        "\nOur measurements of the baselines against those in {}, which were made by other \
         programs (one that keeps JPEG XL at full resolution differs from distance 20 on):\n{}",
        path.file_name().unwrap_or_default().to_string_lossy(),
        table.finish()
    ))
}
