//! Placeholders in figures, set by set.

use anyhow::Result;

use super::codecs::{BUDGETS, Codec};
use crate::bench::Bench;
use crate::gip;
use crate::pictures::PictureSet;
use crate::store::Store;
use crate::table::{Table, mean, median};

/// One in so many pictures of a set is measured.
const STEP: usize = 2;
/// How many pictures of a set a quick run takes.
const QUICK_PICTURES: usize = 1;

/// What the CSV file has of a placeholder at each of the budgets; NaN where there is none.
const COLUMNS: [&str; 12] = [
    "bytes_100",
    "ssimulacra2_100",
    "psnr_100",
    "bytes_200",
    "ssimulacra2_200",
    "psnr_200",
    "bytes_400",
    "ssimulacra2_400",
    "psnr_400",
    "bytes_800",
    "ssimulacra2_800",
    "psnr_800",
];

/// Size, SSIMULACRA2 and PSNR of a placeholder.
type Figures = [f64; 3];

pub(super) fn measure(bench: &mut Bench) -> Result<String> {
    let mut text = format!(
        "Files that pages show while the picture itself is on its way: of at most {} bytes, as `gip encode --bytes` makes them at effort \
         {}. Each is shown at an eighth of the picture's size, and compared there with the averages \
         of the picture over squares of eight pixels. A ThumbHash has 20 to 25 bytes; its 32 pixels \
         are enlarged. A BlurHash has as many components as fit, at most 9 x 9, and is decoded at this \
         size. WebP, AVIF (at speed 6, and at speed 0 in 4:4:4) and JPEG XL are given the picture at \
         sixteen sizes, at fifteen qualities, and are enlarged. (Bicubic enlargement; smaller \
         pictures are by Lanczos's filter.) Of all files that fit, they show the one that is best \
         by SSIMULACRA2. Every other picture of each set.\n",
        BUDGETS.map(|budget| budget.to_string()).join(", "),
        gip::EFFORT,
    );
    let mut store = bench.store("placeholders.csv", ["codec", "image"], COLUMNS)?;
    for set in bench.sets().into_iter().map(|set| set.every(STEP)) {
        let of_codec = |codec| figures(bench, &mut store, codec, &set);
        let all = Codec::ALL.into_iter().map(of_codec).collect::<Result<Vec<_>>>()?;
        for (codec, at_budgets) in Codec::ALL.into_iter().zip(&all) {
            for (budget, figures) in BUDGETS.iter().zip(at_budgets) {
                let scores = figures.iter().map(|[_, ssimulacra2, _]| *ssimulacra2);
                let score = mean(scores.filter(|score| !score.is_nan())).unwrap_or(f64::NAN);
                let name = format!("{}/{}/{budget} bytes", set.name, codec.name());
                bench.figure(name, score, "SSIMULACRA2");
            }
        }
        text.push_str(&format!("\n### Placeholders: {}\n{}", set.name, table(&all)));
    }
    Ok(text)
}

/// The figures of all pictures of a set, at each budget.
fn figures(
    bench: &mut Bench,
    store: &mut Store<2, 12>,
    codec: Codec,
    set: &PictureSet,
) -> Result<Vec<Vec<Figures>>> {
    let version = match codec {
        Codec::Gip => bench.product.clone(),
        Codec::ThumbHash | Codec::BlurHash => "as in Cargo.lock".to_owned(),
        Codec::Baseline(_) => bench.baselines()?.1,
    };
    let count = if bench.quick { QUICK_PICTURES } else { usize::MAX };
    let taken = &set.pictures[..count.min(set.pictures.len())];
    let jobs = taken.iter().map(|picture| ([codec.name(), picture.name.as_str()], picture));
    let jobs: Vec<_> = jobs.collect();
    let scratch = bench.path("");
    let (workers, _) = bench.workers()?;
    let rows = store.all(&version, workers, &jobs, |worker, picture| {
        let figures = codec.placeholders(worker, &scratch, picture)?.map(|placeholder| {
            placeholder
                .map_or([f64::NAN; 3], |found| [found.bytes as f64, found.ssimulacra2, found.psnr])
        });
        Ok(figures.as_flattened().try_into().expect("as many as columns"))
    })?;
    let mut at_budgets = vec![Vec::new(); BUDGETS.len()];
    for values in rows {
        for (all, figures) in at_budgets.iter_mut().zip(values.as_chunks().0) {
            all.push(*figures);
        }
    }
    Ok(at_budgets)
}

/// A row for each codec, of which ours is the first.
fn table(codecs: &[Vec<Vec<Figures>>]) -> String {
    let mut columns = vec!["SSIMULACRA2: mean (median); PSNR; better than gip".to_owned()];
    columns.extend(BUDGETS.map(|budget| format!("{budget} bytes")));
    let mut table = Table::new(&columns);
    for (codec, at_budgets) in Codec::ALL.into_iter().zip(codecs) {
        let mut cells = vec![codec.name().to_owned()];
        cells.extend(at_budgets.iter().zip(&codecs[0]).map(|(theirs, ours)| cell(theirs, ours)));
        table.row(&cells);
    }
    table.finish()
}

/// What a codec reaches with the pictures that it has a placeholder of, and in how many it is better than ours.
fn cell(theirs: &[Figures], ours: &[Figures]) -> String {
    let found = || theirs.iter().filter(|[bytes, ..]| !bytes.is_nan());
    let scores = || found().map(|[_, ssimulacra2, _]| *ssimulacra2);
    let (Some(mean_score), Some(middle)) = (mean(scores()), median(scores())) else {
        return "none".to_owned();
    };
    let psnr = mean(found().map(|[.., psnr]| *psnr)).unwrap_or(f64::NAN);
    let better = theirs.iter().zip(ours).filter(|(theirs, ours)| theirs[1] > ours[1]).count();
    let missing = theirs.len() - found().count();
    let missing = if missing > 0 { format!("; none of {missing}") } else { String::new() };
    format!("{mean_score:.1} ({middle:.1}); {psnr:.2} dB; {better}{missing}")
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_cell_is_of_the_pictures_that_have_a_placeholder() {
        let ours = [[90.0, 10.0, 20.0], [91.0, 20.0, 22.0], [92.0, 30.0, 24.0]];
        let theirs = [[f64::NAN; 3], [91.0, 21.0, 19.0], [92.0, 11.0, 18.0]];
        assert_eq!(cell(&ours, &ours), "20.0 (20.0); 22.00 dB; 0");
        assert_eq!(cell(&theirs, &ours), "16.0 (16.0); 18.50 dB; 1; none of 1");
        assert_eq!(cell(&theirs[..1], &ours), "none");
    }

    #[test]
    fn columns_are_of_the_budgets() {
        let of = |budget: usize| ["bytes", "ssimulacra2", "psnr"].map(|f| format!("{f}_{budget}"));
        assert_eq!(COLUMNS.map(str::to_owned).as_slice(), BUDGETS.map(of).as_flattened());
    }
}
