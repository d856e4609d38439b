//! What `--quality` means: whether the same number looks the same on every picture.

use anyhow::Result;
use image_gip::Target;

use super::codec_curves::{Codec, EVERYWHERE, Extent, Variant};
use super::rate_store::{Point, RateStore};
use crate::bench::Bench;
use crate::comparison::list_or_none;
use crate::gip;
use crate::table::{Table, mean};

/// The qualities that the encoder is asked for.
const QUALITIES: [f64; 5] = [30.0, 50.0, 60.0, 75.0, 90.0];
const QUICK_QUALITIES: [f64; 2] = [50.0, 75.0];
/// How far SSIMULACRA2 may be from its mean over the pictures.
const TOLERANCE: f64 = 4.0;

/// The file of a picture, by the picture's name.
type File = (String, Point);

pub(crate) fn measure(bench: &mut Bench) -> Result<String> {
    let qualities: &[f64] = if bench.quick { &QUICK_QUALITIES } else { &QUALITIES };
    let targets: Vec<Target> = qualities.iter().map(|&quality| Target::Quality(quality)).collect();
    let variant = Variant { name: gip::PLAIN_NAME, encoder: gip::plain_encoder, targets: &targets };
    let extent = Extent { step: 1, until: EVERYWHERE.1 };
    let mut store = RateStore::open(bench)?;
    let sets = bench.sets();
    // For each set the files of each quality, and then all of them.
    let mut all = vec![Vec::new(); qualities.len()];
    let mut text = format!(
        "Compared with each other: pictures encoded with the same `--quality`, at effort {}. It is \
         meant to be the SSIMULACRA2 of the picture without texture, which is what is measured here, \
         and at most {TOLERANCE} from its mean on every picture.\n",
        gip::EFFORT
    );
    for set in &sets {
        let codec = Codec::ours(&mut store, &bench.product, &variant, &set.pictures, extent)?;
        let files_of = |index: usize| {
            let files = set.pictures.iter().zip(&codec.points);
            files
                .map(|(picture, points)| (picture.name.clone(), points[index]))
                .collect::<Vec<File>>()
        };
        let of_set: Vec<_> = (0..qualities.len()).map(files_of).collect();
        all.iter_mut().zip(&of_set).for_each(|(all, files)| all.extend_from_slice(files));
        text.push_str(&format!("\n### Quality: {}\n{}", set.name, table(qualities, &of_set)));
    }
    if sets.len() > 1 {
        text.push_str(&format!("\n### Quality: all\n{}", table(qualities, &all)));
    }
    for (quality, files) in qualities.iter().zip(&all) {
        let scores = Scores::new(files);
        bench.figure(format!("{quality}/least"), scores.least.1, "SSIMULACRA2");
        bench.figure(format!("{quality}/largest"), scores.largest.1, "SSIMULACRA2");
    }
    text.push_str(&verdict(qualities, &all));
    Ok(text)
}

/// SSIMULACRA2 of all files of one quality.
struct Scores<'a> {
    mean: f64,
    least: (&'a str, f64),
    largest: (&'a str, f64),
}

impl<'a> Scores<'a> {
    fn new(files: &'a [File]) -> Self {
        let scores =
            || files.iter().map(|(name, file)| (name.as_str(), file.distortion.ssimulacra2));
        let by_score = |a: &(&str, f64), b: &(&str, f64)| a.1.total_cmp(&b.1);
        Self {
            mean: mean(scores().map(|(_, score)| score)).unwrap_or(f64::NAN),
            least: scores().min_by(by_score).unwrap_or(("none", f64::NAN)),
            largest: scores().max_by(by_score).unwrap_or(("none", f64::NAN)),
        }
    }

    /// The picture that is furthest from the mean, and by how much.
    fn worst(&self) -> (&'a str, f64) {
        let [low, high] = [self.least, self.largest].map(|(name, score)| (name, score - self.mean));
        if -low.1 > high.1 { low } else { high }
    }
}

fn table(qualities: &[f64], files: &[Vec<File>]) -> String {
    let mut table = Table::new(&[
        "quality",
        "mean bpp",
        "least bpp",
        "largest bpp",
        "mean SSIMULACRA2",
        "least",
        "largest",
        "spread",
        "furthest from the mean",
        "by",
    ]);
    for (quality, files) in qualities.iter().zip(files) {
        let scores = Scores::new(files);
        let rates = || files.iter().map(|(_, file)| file.rate);
        let (worst, by) = scores.worst();
        table.row(&[
            quality.to_string(),
            format!("{:.3}", mean(rates()).unwrap_or(f64::NAN)),
            format!("{:.3}", rates().fold(f64::NAN, f64::min)),
            format!("{:.3}", rates().fold(f64::NAN, f64::max)),
            format!("{:.1}", scores.mean),
            format!("{:.1}", scores.least.1),
            format!("{:.1}", scores.largest.1),
            format!("±{:.1}", (scores.largest.1 - scores.least.1) / 2.0),
            worst.to_owned(),
            format!("{by:+.1}"),
        ]);
    }
    table.finish()
}

/// At which qualities all pictures are near enough to the mean, and the mean to the quality.
fn verdict(qualities: &[f64], files: &[Vec<File>]) -> String {
    let named = |holds: &dyn Fn(f64, &Scores<'_>) -> bool| {
        let holding = qualities
            .iter()
            .zip(files)
            .filter(|(quality, files)| holds(**quality, &Scores::new(files)));
        let names: Vec<String> = holding.map(|(quality, _)| quality.to_string()).collect();
        list_or_none(names.iter().map(String::as_str))
    };
    format!(
        "\nAll pictures are within {TOLERANCE} of the mean at: {}. The mean is within {TOLERANCE} of \
         the quality at: {}.\n",
        named(&|_, scores| scores.worst().1.abs() <= TOLERANCE),
        named(&|quality, scores| (scores.mean - quality).abs() <= TOLERANCE),
    )
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::pictures::Distortion;

    #[test]
    fn the_worst_picture_is_the_furthest_from_the_mean() {
        let file = |name: &str, ssimulacra2: f64| {
            let distortion = Distortion::from([30.0, 0.9, ssimulacra2, 1.0, 8.0]);
            (name.to_owned(), Point { bytes: 1.0, rate: 0.5, distortion })
        };
        let near = vec![file("a", 49.0), file("b", 51.0), file("c", 53.0)];
        let far = vec![file("a", 40.0), file("b", 54.0), file("c", 56.0)];
        assert_eq!(Scores::new(&near).worst(), ("c", 2.0));
        assert_eq!(Scores::new(&far).worst(), ("a", -10.0));
        let text = verdict(&[50.0, 60.0], &[near, far]);
        assert!(
            text.contains("the mean at: 50. The mean is within 4 of the quality at: 50."),
            "{text}"
        );
    }
}
