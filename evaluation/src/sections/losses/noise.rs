//! Noise, on its own: the same photographs without and with it.

use std::{fs, slice};

use anyhow::Result;
use image::RgbImage;

use super::source::Source;
use crate::bench::Bench;
use crate::files;
use crate::gip;
use crate::metric::Metric;
use crate::pictures::TestPicture;
use crate::sections::codec_curves::{Codec, Extent, OURS, Sweep};
use crate::sections::content::{GRAIN, middle, noisy};
use crate::sections::ranges::{HIGH, MIDDLE, Outcome, bd_rates};
use crate::sections::rate_store::RateStore;
use crate::table::{Table, mean, percent};
use crate::versions;

const PICTURES: usize = 6;
const QUICK_PICTURES: usize = 1;
/// The codecs that ours is compared with.
const OTHERS: [&str; 2] = ["AVIF", "JPEG XL"];

pub(super) fn measure(bench: &mut Bench, store: &mut RateStore) -> Result<String> {
    let most = if bench.quick { QUICK_PICTURES } else { PICTURES };
    let clean: Vec<TestPicture> = bench.sample(most).iter().map(middle).collect();
    let grainy: Vec<TestPicture> = clean.iter().map(|picture| noisy(picture, GRAIN)).collect();
    let mut columns = vec![format!("BD-rate of {}: without / with noise", gip::NAME)];
    columns.extend(Metric::ALL.map(|metric| metric.name().to_owned()));
    let mut table = Table::new(&columns);
    let mut codecs = Vec::new();
    for pictures in [&clean, &grainy] {
        codecs.push(measured(bench, store, pictures)?);
    }
    let (mut larger, mut compared) = (0, 0);
    for (index, name) in OTHERS.iter().enumerate() {
        for range in [MIDDLE, HIGH] {
            let mut cells = vec![format!("{} rates, against {name}", range.name)];
            for metric in Metric::ALL {
                let [without, with] = [0, 1].map(|noise: usize| {
                    let codecs = &codecs[noise];
                    Outcome::of(&bd_rates(&codecs[0], &codecs[index + 1], metric, range)).mean
                });
                cells.push(format!("{} / {}", percent(without), percent(with)));
                larger += usize::from(without.zip(with).is_some_and(|(a, b)| b > a));
                compared += usize::from(without.is_some() && with.is_some());
            }
            table.row(&cells);
        }
    }
    let grain = [&clean, &grainy].map(|pictures| {
        let grains = pictures.iter().map(|picture| Source::of(picture).grain);
        mean(grains).unwrap_or(f64::NAN)
    });
    Ok(format!(
        "\n**Noise**: the middle of {} photographs, without and with added noise of a deviation of {GRAIN} \
         levels (grain {:.1} and {:.1}). In {larger} of {compared} means the noise makes our files larger beside the \
         others'. Every grain is independent of all others, so no Gaussian shows two of them; our texture shows \
         noise of the same strength but not the same grains, which metrics that compare pixel by pixel count as an \
         error.\n{}",
        clean.len(),
        grain[0],
        grain[1],
        table.finish(),
    ))
}

/// Ours by default and then the others.
fn measured(
    bench: &mut Bench,
    store: &mut RateStore,
    pictures: &[TestPicture],
) -> Result<Vec<Codec>> {
    let extent = Extent { until: HIGH.rates.1, ..Extent::new(bench.quick) };
    let product = bench.product.clone();
    let folder = bench.path("noise");
    files::make_folder(&folder)?;
    let pictures: Vec<TestPicture> = pictures
        .iter()
        .map(|picture| {
            let name = format!("the middle of {}", picture.name);
            let path = folder.join(format!("{name}.png"));
            let image = RgbImage::from_raw(picture.width, picture.height, picture.rgb.clone());
            image.expect("as many samples as it has").save(&path)?;
            Ok(TestPicture { path: fs::canonicalize(path)?, name, ..picture.clone() })
        })
        .collect::<Result<_>>()?;
    let mut codecs = vec![Codec::ours(store, &product, &OURS[0], &pictures, extent)?];
    let (workers, versions) = bench.workers()?;
    let sweeps = OTHERS.map(|name| {
        Ok(Sweep { tunings: slice::from_ref(versions::baseline_called(name)?), extent })
    });
    let sweeps = sweeps.into_iter().collect::<Result<Vec<_>>>()?;
    codecs.extend(Codec::baselines(store, workers, &versions, &sweeps, &pictures)?);
    fs::remove_dir_all(folder)?;
    Ok(codecs)
}
