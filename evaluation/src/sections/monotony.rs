//! Whether more bits, and more effort, give a picture that is no worse.

use std::collections::HashSet;

use anyhow::Result;
use image_gip::{Target, Threads, Tune};

use crate::bench::Bench;
use crate::gip;
use crate::parallel;
use crate::pictures::{PictureSet, TestPicture};
use crate::store::Store;
use crate::table::Table;

const EFFORTS: [u8; 3] = [1, 2, 3];
const TUNES: [(&str, Tune); 2] = [("visual", Tune::Visual), ("psnr", Tune::Psnr)];
/// In bits per pixel.
const RATES: [f64; 5] = [0.1, 0.25, 0.5, 1.0, 2.0];
const QUICK_RATES: [f64; 3] = [0.25, 1.0, 2.0];
/// One in so many pictures of a set is measured.
const STEP: usize = 4;
const LARGE_STEP: usize = 6;
/// What the PSNR may fall, in dB.
const TOLERANCE: f64 = 0.1;
/// The PSNR of a picture of which nothing but the rounding to samples is left: what is better counts as
/// this.
const EXACT: f64 = 58.9;
/// The falls that are named.
const NAMED: usize = 20;

/// The files of a picture with one tune.
struct Files<'a> {
    tune: &'a str,
    picture: &'a str,
    rates: &'a [f64],
    /// PSNR and estimated quality, by effort and rate.
    reached: Vec<Vec<[f64; 2]>>,
}

/// A file whose picture is worse than that of one with fewer bits or less effort.
struct Fall<'a> {
    tune: &'a str,
    picture: &'a str,
    /// Effort and rate, of the file and of the better one.
    file: (u8, f64),
    better: (u8, f64),
    by: f64,
    quality_by: f64,
}

pub(crate) fn measure(bench: &mut Bench) -> Result<String> {
    let rates: &[f64] = if bench.quick { &QUICK_RATES } else { &RATES };
    let keys = ["tune", "effort", "bpp", "image"];
    let mut store: Store<4, 3> = bench.store("monotony.csv", keys, ["bytes", "psnr", "quality"])?;
    // Of large pictures one, which takes as long as seven of Kodak's.
    let step = |set: &PictureSet| if set.name == "large" { LARGE_STEP } else { STEP };
    let sets = bench.all_sets().into_iter();
    let pictures: Vec<TestPicture> =
        sets.flat_map(|set| set.clone().every(step(&set)).pictures).collect();
    let runs = pictures.iter().flat_map(|picture| TUNES.map(|tune| (picture, tune)));
    let runs: Vec<(&TestPicture, (&str, Tune))> = runs.collect();
    let settings = EFFORTS.iter().flat_map(|&effort| rates.iter().map(move |&rate| (effort, rate)));
    let settings: Vec<((u8, f64), [String; 2])> = settings
        .map(|(effort, rate)| ((effort, rate), [effort.to_string(), rate.to_string()]))
        .collect();
    let jobs = runs.iter().flat_map(|&(picture, (name, tune))| {
        settings.iter().map(move |&((effort, rate), [ref of_effort, ref of_rate])| {
            ([name, of_effort, of_rate, &picture.name], (picture, tune, effort, rate))
        })
    });
    let jobs: Vec<_> = jobs.collect();
    let rows = store.all(
        &bench.product,
        &mut parallel::threads(),
        &jobs,
        |(), &(picture, tune, effort, rate)| encoded(picture, tune, effort, rate),
    )?;
    let files =
        runs.iter().zip(rows.chunks(settings.len())).map(|(&(picture, (tune, _)), rows)| {
            let reached: Vec<[f64; 2]> =
                rows.iter().map(|[_, psnr, quality]| [psnr.min(EXACT), *quality]).collect();
            let reached = reached.chunks(rates.len()).map(<[_]>::to_vec).collect();
            Files { tune, picture: &picture.name, rates, reached }
        });
    let files: Vec<Files<'_>> = files.collect();
    let mut falls: Vec<Fall<'_>> = files.iter().flat_map(Files::falls).collect();
    falls.sort_by(|a, b| b.by.total_cmp(&a.by));
    bench.figure("pictures", pictures.len() as f64, "pictures");
    bench.figure("falls", falls.len() as f64, "files");
    bench.figure("worst", falls.first().map_or(0.0, |fall| fall.by), "dB");
    let mut text = format!(
        "Compared with each other: files of {} pictures, one in {STEP} of each set (of large ones one in {LARGE_STEP}), \
         at {} bits per pixel and at the efforts {} (the default is {}). A picture \
         falls if its PSNR is more than {TOLERANCE} dB below that of a file with fewer bits and the same effort, or \
         with less effort and the same bits; above {EXACT} dB nothing but rounding is left of the error.\n\n",
        pictures.len(),
        listed(rates),
        listed(&EFFORTS),
        gip::EFFORT,
    );
    text.push_str(&counts(&files, &falls));
    let compared = files.len() * settings.len();
    text.push_str(&match falls.first() {
        Some(worst) => format!(
            "\nOf {compared} files {} fall, the worst by {:.2} dB ({}).\n",
            fallen(&falls),
            worst.by,
            worst.picture
        ),
        None => format!("\nOf {compared} files none falls.\n"),
    });
    if !falls.is_empty() {
        text.push_str(&format!("\nThe largest falls:\n\n{}", named(&falls)));
    }
    Ok(text)
}

/// Bytes, PSNR and quality of a file.
fn encoded(picture: &TestPicture, tune: Tune, effort: u8, rate: f64) -> Result<[f64; 3]> {
    let encoder = gip::encoder(effort).with_tune(tune).with_target(Target::BitsPerPixel(rate));
    let encoded = gip::file(encoder, picture, Threads::One)?;
    let report = encoded.report;
    Ok([encoded.bytes.len() as f64, report.psnr.min(EXACT), report.quality])
}

impl<'a> Files<'a> {
    fn falls(&self) -> Vec<Fall<'a>> {
        let all: Vec<(usize, usize)> = (0..self.reached.len())
            .flat_map(|effort| (0..self.rates.len()).map(move |rate| (effort, rate)))
            .collect();
        let mut falls = Vec::new();
        for &(effort, rate) in &all {
            let poorer =
                |&&(e, r): &&(usize, usize)| (e == effort && r < rate) || (e < effort && r == rate);
            for &(e, r) in all.iter().filter(poorer) {
                let [psnr, quality] = self.reached[effort][rate];
                let [better, better_quality] = self.reached[e][r];
                if better - psnr > TOLERANCE {
                    falls.push(Fall {
                        tune: self.tune,
                        picture: self.picture,
                        file: (EFFORTS[effort], self.rates[rate]),
                        better: (EFFORTS[e], self.rates[r]),
                        by: better - psnr,
                        quality_by: better_quality - quality,
                    });
                }
            }
        }
        falls
    }
}

/// Numbers in a sentence.
fn listed<T: ToString>(numbers: &[T]) -> String {
    let [others @ .., last] = numbers else { return String::new() };
    let others: Vec<String> = others.iter().map(T::to_string).collect();
    format!("{} and {}", others.join(", "), last.to_string())
}

/// How many files fall, whether below one better file or several.
fn fallen(falls: &[Fall<'_>]) -> usize {
    let file = |fall: &Fall<'_>| {
        (fall.tune.to_owned(), fall.picture.to_owned(), fall.file.0, fall.file.1.to_bits())
    };
    falls.iter().map(file).collect::<HashSet<_>>().len()
}

/// How many files fall, by tune, effort and rate.
fn counts(files: &[Files<'_>], falls: &[Fall<'_>]) -> String {
    let Some(rates) = files.first().map(|files| files.rates) else { return String::new() };
    let names = ["tune".to_owned(), "effort".to_owned()];
    let columns = names.into_iter().chain(rates.iter().map(|rate| format!("{rate} bpp")));
    let mut table = Table::new(&columns.chain(["worst".to_owned()]).collect::<Vec<_>>());
    for (tune, _) in TUNES {
        for effort in EFFORTS {
            let of_row = || falls.iter().filter(|fall| fall.tune == tune && fall.file.0 == effort);
            let mut row = vec![tune.to_owned(), effort.to_string()];
            for &rate in rates {
                let mut fallen: Vec<&str> =
                    of_row().filter(|fall| fall.file.1 == rate).map(|fall| fall.picture).collect();
                fallen.sort_unstable();
                fallen.dedup();
                let all = files.iter().filter(|files| files.tune == tune).count();
                row.push(format!("{} of {all}", fallen.len()));
            }
            let worst = of_row().map(|fall| fall.by).fold(0.0, f64::max);
            row.push(format!("{worst:.2} dB"));
            table.row(&row);
        }
    }
    table.finish()
}

fn named(falls: &[Fall<'_>]) -> String {
    let mut table =
        Table::new(&["picture", "tune", "effort, bpp", "better", "PSNR falls by", "quality by"]);
    for fall in falls.iter().take(NAMED) {
        table.row(&[
            fall.picture.to_owned(),
            fall.tune.to_owned(),
            format!("{}, {}", fall.file.0, fall.file.1),
            format!("{}, {}", fall.better.0, fall.better.1),
            format!("{:.2} dB", fall.by),
            format!("{:.1}", fall.quality_by),
        ]);
    }
    table.finish()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn worse_pictures_of_more_bits_or_effort_are_found() {
        let rates = [0.5, 1.0];
        let reached = vec![
            vec![[30.0, 50.0], [33.0, 60.0]],
            vec![[31.0, 55.0], [30.5, 54.0]],
            vec![[31.0, 55.0], [34.0, 70.0]],
        ];
        let files = [Files { tune: "visual", picture: "a", rates: &rates, reached }];
        let falls = files[0].falls();
        let found: Vec<_> = falls.iter().map(|fall| (fall.file, fall.better, fall.by)).collect();
        assert_eq!(found, [((2, 1.0), (1, 1.0), 2.5), ((2, 1.0), (2, 0.5), 0.5)]);
        assert_eq!((fallen(&falls), listed(&[1, 2, 3])), (1, "1, 2 and 3".to_owned()));
        let counts = counts(&files, &falls);
        assert!(counts.contains("| visual | 2 | 0 of 1 | 1 of 1 | 2.50 dB |"), "{counts}");
    }
}
