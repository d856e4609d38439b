//! What the viewers chose.

use std::collections::{BTreeMap, BTreeSet};
use std::fs;
use std::path::{Path, PathBuf};

use anyhow::{Context, Result, ensure};
use image::RgbImage;
use image::imageops::{self, FilterType};
use serde::Deserialize;

use super::binomial::interval;
use super::key::{self, Shown, Triplet};
use crate::canvas::{Canvas, LINE};
use crate::files;
use crate::table::Table;

/// The most bytes of a sheet.
const SHEET_BYTES: usize = 1_000_000;

/// Prints what viewers chose, and gathers the triplets in which texture lost.
///
/// Each FOLDER has a key.csv, as `triplets` wrote it; all other .csv in it are answers, with the
/// columns triplet, viewer, and answer: left, right or same.
#[derive(Debug, clap::Args)]
pub(crate) struct Args {
    #[arg(value_name = "FOLDER", required = true)]
    folders: Vec<PathBuf>,
    /// The folder with the triplets' pictures: of those in which more viewers chose the other
    /// version than texture, a sheet for each rate and comparison is written to FOLDER.
    #[arg(long, value_name = "DIR")]
    triplets: Option<PathBuf>,
}

/// Prints the tables and writes the sheets that the arguments ask for.
pub(crate) fn print(args: &Args) -> Result<()> {
    for folder in &args.folders {
        let round = Round::load(folder)?;
        ensure!(!round.answers.is_empty(), "{} has no answers", folder.display());
        println!("{}{}", folder.display(), round.tables());
        if let Some(triplets) = &args.triplets {
            round.write_lost(triplets, folder)?;
        }
    }
    Ok(())
}

/// The tables of all rounds in a folder. Empty if there are none.
pub(crate) fn report(folder: &Path) -> Result<String> {
    let tables = rounds(folder)?.into_iter();
    Ok(tables.map(|(name, round)| format!("\n#### Round {name}\n{}", round.tables())).collect())
}

/// The share of texture in the decided answers of all rounds in a folder, with names such as
/// `1/plain/0.25 bpp`: of the round, of what it was compared with, and of the rate.
pub(crate) fn shares(folder: &Path) -> Result<Vec<(String, f64)>> {
    let mut shares = Vec::new();
    for (name, round) in rounds(folder)? {
        let mut tables: Vec<(Shown, f64)> =
            round.triplets.iter().map(|triplet| (triplet.other(), triplet.bpp)).collect();
        tables.sort_by(|a, b| a.0.cmp(&b.0).then(a.1.total_cmp(&b.1)));
        tables.dedup();
        for (other, rate) in tables {
            if let Some(share) = round.tally(other, |triplet, _| triplet.bpp == rate).share() {
                shares.push((format!("{name}/{other}/{rate} bpp"), share));
            }
        }
    }
    Ok(shares)
}

/// The rounds of those folders of `folder` that have a key, in the order of their names.
fn rounds(folder: &Path) -> Result<Vec<(String, Round)>> {
    let Ok(entries) = fs::read_dir(folder) else {
        return Ok(Vec::new());
    };
    let mut rounds: Vec<PathBuf> = entries.flatten().map(|entry| entry.path()).collect();
    rounds.retain(|path| path.join("key.csv").exists());
    rounds.sort();
    let named = rounds.iter().map(|path| {
        let name = path.file_name().unwrap_or_default().to_string_lossy().into_owned();
        Ok((name, Round::load(path)?))
    });
    named.collect()
}

#[derive(Clone, Copy, Debug, PartialEq, Eq, Deserialize)]
#[serde(rename_all = "lowercase")]
enum Choice {
    Left,
    Right,
    Same,
}

#[derive(Debug, Deserialize)]
struct Answer {
    triplet: String,
    viewer: String,
    answer: Choice,
}

/// A version that is smaller than its rival by more than this is no fair choice.
const LEAST_SIZE: f64 = 0.9;

/// Who the viewers were, in a sentence: a file in the folder of a round.
const VIEWERS: &str = "viewers.txt";

/// Triplets with all answers to them.
#[derive(Debug)]
struct Round {
    /// Who saw them; empty if nobody said.
    viewers: String,
    /// How many are left out, because one of their files is much smaller.
    unequal: usize,
    triplets: Vec<Triplet>,
    /// By index of triplet, with the viewer: what was chosen, `None` for no difference.
    answers: Vec<(usize, String, Option<Shown>)>,
}

impl Round {
    fn load(folder: &Path) -> Result<Self> {
        let entries = fs::read_dir(folder)
            .with_context(|| format!("cannot read the folder {}", folder.display()))?;
        let mut tables: Vec<PathBuf> = entries.flatten().map(|entry| entry.path()).collect();
        tables.retain(|path| path.extension().is_some_and(|extension| extension == "csv"));
        tables.retain(|path| path.file_name().is_some_and(|name| name != "key.csv"));
        tables.sort();
        let mut answers = Vec::new();
        for path in tables {
            let unreadable = || format!("cannot read {}", path.display());
            let mut reader = csv::Reader::from_path(&path).with_context(unreadable)?;
            for answer in reader.deserialize() {
                answers.push(answer.with_context(unreadable)?);
            }
        }
        let viewers = files::read_if_any(&folder.join(VIEWERS))?.unwrap_or_default();
        Ok(Self { viewers, ..Self::new(key::read(&folder.join("key.csv"))?, answers)? })
    }

    fn new(triplets: Vec<Triplet>, answers: Vec<Answer>) -> Result<Self> {
        let mut seen = BTreeSet::new();
        let answers = answers.into_iter().map(|Answer { triplet, viewer, answer }| {
            let index = triplets.iter().position(|known| known.triplet == triplet);
            let index = index.with_context(|| format!("the key has no triplet {triplet}"))?;
            ensure!(
                seen.insert((index, viewer.clone())),
                "{viewer} answered triplet {triplet} twice"
            );
            let shown = match answer {
                Choice::Left => Some(triplets[index].left),
                Choice::Right => Some(triplets[index].right),
                Choice::Same => None,
            };
            Ok((index, viewer, shown))
        });
        let mut answers: Vec<(usize, String, Option<Shown>)> = answers.collect::<Result<_>>()?;
        answers.retain(|(index, ..)| triplets[*index].size_ratio() >= LEAST_SIZE);
        let unequal = triplets.iter().filter(|triplet| triplet.size_ratio() < LEAST_SIZE).count();
        Ok(Self { viewers: String::new(), unequal, triplets, answers })
    }

    /// The answers to the triplets of one comparison that a filter lets pass.
    fn tally(&self, other: Shown, pass: impl Fn(&Triplet, &str) -> bool) -> Tally {
        let mut tally = Tally::default();
        let mut triplets = BTreeSet::new();
        for (index, viewer, shown) in &self.answers {
            let triplet = &self.triplets[*index];
            if triplet.other() == other && pass(triplet, viewer) {
                triplets.insert(index);
                match shown {
                    None => tally.same += 1,
                    Some(Shown::Textured) => tally.textured += 1,
                    Some(_) => tally.other += 1,
                }
            }
        }
        tally.triplets = triplets.len();
        tally
    }

    fn tables(&self) -> String {
        let viewers: BTreeSet<&str> =
            self.answers.iter().map(|(_, viewer, _)| viewer.as_str()).collect();
        let versions: BTreeSet<&str> =
            self.triplets.iter().map(|triplet| triplet.version.as_str()).collect();
        let versions: Vec<&str> = versions.into_iter().collect();
        let mut text = format!(
            "\n{} Encoder: commit {}. {} triplets, of which {} are left out, because one file has less than {:.0} % of \
             the other's bytes (on some pictures AVIF's largest file has); {} viewers, {} answers to the others. Decided answers are those that chose a side. The \
             intervals (95 %, Clopper and Pearson) take each answer as independent of all others; \
             answers to the same triplet are not quite that.\n",
            self.viewers.trim(),
            versions.join(", "),
            self.triplets.len(),
            self.unequal,
            100.0 * LEAST_SIZE,
            viewers.len(),
            self.answers.len()
        );
        let others: BTreeSet<Shown> = self.triplets.iter().map(Triplet::other).collect();
        for other in others {
            text.push_str(&format!("\nTextured against {other}:\n{}", self.table(other, &viewers)));
        }
        text
    }

    /// By rate, then by content and rate, by scale, and by viewer.
    fn table(&self, other: Shown, viewers: &BTreeSet<&str>) -> String {
        let mut table = Table::new(&[
            "triplets of",
            "triplets",
            "answers",
            "no difference",
            "decided",
            "for textured",
            "share",
            "interval",
        ]);
        let mut row = |name: &str, tally: Tally| {
            if tally.triplets > 0 {
                table.row(&tally.cells(name));
            }
        };
        let mut rates: Vec<f64> = self.triplets.iter().map(|triplet| triplet.bpp).collect();
        rates.sort_by(f64::total_cmp);
        rates.dedup();
        for &rate in &rates {
            row(&format!("{rate} bpp"), self.tally(other, |triplet, _| triplet.bpp == rate));
        }
        row("all rates", self.tally(other, |_, _| true));
        let contents: BTreeSet<&str> =
            self.triplets.iter().map(|triplet| triplet.content.as_str()).collect();
        for content in contents.into_iter().filter(|content| !content.is_empty()) {
            for &rate in &rates {
                let tally = self
                    .tally(other, |triplet, _| triplet.content == content && triplet.bpp == rate);
                row(&format!("{content}, {rate} bpp"), tally);
            }
            row(
                &format!("{content}, all rates"),
                self.tally(other, |triplet, _| triplet.content == content),
            );
        }
        let scales: BTreeSet<u32> = self.triplets.iter().map(|triplet| triplet.scale).collect();
        for scale in scales {
            row(&format!("{scale}:1"), self.tally(other, |triplet, _| triplet.scale == scale));
        }
        for &viewer in viewers {
            row(&format!("viewer {viewer}"), self.tally(other, |_, each| each == viewer));
        }
        table.finish()
    }

    /// The triplets in which more viewers chose the other version than texture.
    fn lost(&self) -> Vec<&Triplet> {
        let mut balance = vec![0; self.triplets.len()];
        for (index, _, shown) in &self.answers {
            balance[*index] += match shown {
                None => 0,
                Some(Shown::Textured) => 1,
                Some(_) => -1,
            };
        }
        let all = self.triplets.iter().zip(balance);
        all.filter(|(_, balance)| *balance < 0).map(|(triplet, _)| triplet).collect()
    }

    /// One sheet for each rate and comparison in which a triplet was lost.
    fn write_lost(&self, triplets: &Path, folder: &Path) -> Result<()> {
        let mut sheets: BTreeMap<String, Vec<&Triplet>> = BTreeMap::new();
        for triplet in self.lost() {
            let name = format!("lost-{}-{}.jpg", triplet.other(), triplet.bpp).to_lowercase();
            sheets.entry(name).or_default().push(triplet);
        }
        for (name, lost) in sheets {
            let strips = lost.into_iter().map(|triplet| strip(triplet, triplets));
            let path = folder.join(name);
            sheet(&strips.collect::<Result<Vec<_>>>()?).save_jpeg(&path, SHEET_BYTES)?;
            println!("{}", path.display());
        }
        Ok(())
    }
}

/// The triplet as it was shown, but without enlargement, and what is in it.
fn strip(triplet: &Triplet, folder: &Path) -> Result<(String, RgbImage)> {
    let path = folder.join(format!("{}.png", triplet.triplet));
    let image = image::open(&path).with_context(|| format!("cannot read {}", path.display()))?;
    let image = image.into_rgb8();
    let (width, height) = (image.width() / triplet.scale, image.height() / triplet.scale);
    let Triplet { triplet, picture, x, y, left, right, left_bpp, right_bpp, scale, .. } = triplet;
    let caption = format!(
        "{triplet}: {left} {left_bpp:.3} bpp, original, {right} {right_bpp:.3} bpp; {picture} at {x}, \
         {y}, shown {scale}:1"
    );
    Ok((caption, imageops::resize(&image, width, height, FilterType::Triangle)))
}

fn sheet(strips: &[(String, RgbImage)]) -> Canvas {
    let width = strips.iter().map(|(_, image)| image.width()).max().unwrap_or(0);
    let height = strips.iter().map(|(_, image)| image.height() + LINE).sum();
    let (mut canvas, mut y) = (Canvas::new(width, height), 0);
    for (caption, image) in strips {
        canvas.write(caption, (0, y));
        canvas.paste(image, (0, y + LINE));
        y += LINE + image.height();
    }
    canvas
}

/// How often what was chosen.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
struct Tally {
    /// With an answer.
    triplets: usize,
    textured: u32,
    other: u32,
    same: u32,
}

impl Tally {
    /// Of texture in the decided answers, if there are any.
    fn share(self) -> Option<f64> {
        let decided = self.textured + self.other;
        (decided > 0).then(|| f64::from(self.textured) / f64::from(decided))
    }

    fn cells(self, name: &str) -> Vec<String> {
        let decided = self.textured + self.other;
        let (share, interval) = if let Some(share) = self.share() {
            let (low, high) = interval(self.textured, decided);
            (
                format!("{:.0} %", 100.0 * share),
                format!("{:.0} to {:.0} %", 100.0 * low, 100.0 * high),
            )
        } else {
            ("-".to_owned(), "-".to_owned())
        };
        let counts = [self.triplets as u32, decided + self.same, self.same, decided, self.textured];
        let mut cells = vec![name.to_owned()];
        cells.extend(counts.map(|count| count.to_string()));
        cells.extend([share, interval]);
        cells
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Two triplets against plain at 0.25 bpp, and one against AVIF at 1 bpp.
    const KEY: &str = "\
triplet,picture,content,x,y,width,height,scale,bpp,left,right,left_bpp,right_bpp,version
001,a,text,0,0,32,24,1,0.25,textured,plain,0.25,0.251,1
002,b,,8,0,32,24,2,0.25,plain,textured,0.25,0.25,1
003,a,text,0,0,32,24,1,1,textured,avif,1,1,1
";

    /// A folder with the key and one table of answers.
    fn round(answers: &str) -> (tempfile::TempDir, Result<Round>) {
        let folder = tempfile::tempdir().expect("a folder");
        fs::write(folder.path().join("key.csv"), KEY).expect("it is written");
        let text = format!("triplet,viewer,answer\n{answers}");
        fs::write(folder.path().join("one.csv"), text).expect("it is written");
        let round = Round::load(folder.path());
        (folder, round)
    }

    #[test]
    fn answers_count_for_what_was_at_the_chosen_side() {
        let answers = "001,v,left\n002,v,left\n003,v,same\n001,w,left\n";
        let (folder, round) = round(answers);
        let round = round.expect("all is in order");
        let plain = round.tally(Shown::Plain, |triplet, _| triplet.bpp == 0.25);
        assert_eq!(plain, Tally { triplets: 2, textured: 2, other: 1, same: 0 });
        let avif = round.tally(Shown::Avif, |_, _| true);
        assert_eq!(avif, Tally { triplets: 1, textured: 0, other: 0, same: 1 });
        let rounds = folder.path().parent().expect("it has one");
        let text = report(rounds).expect("it is readable");
        let round = folder.path().file_name().expect("a name").to_string_lossy();
        let shares = shares(rounds).expect("it is readable");
        let of_round = |(name, _): &&(String, f64)| name.starts_with(&*round);
        let shares: Vec<_> = shares.iter().filter(of_round).collect();
        // Of the answers about AVIF none is decided.
        assert_eq!(shares, [&(format!("{round}/plain/0.25 bpp"), 2.0 / 3.0)]);
        assert!(text.contains(&format!("#### Round {round}\n")), "{text}");
        for row in [
            "| 0.25 bpp | 2 | 3 | 0 | 3 | 2 | 67 % | 9 to 99 % |",
            "| text, 0.25 bpp | 1 | 2 | 0 | 2 | 2 | 100 % | 16 to 100 % |",
            "| 1 bpp | 1 | 1 | 1 | 0 | 0 | - | - |",
            "| 2:1 | 1 | 1 | 0 | 1 | 0 | 0 % |",
            "| viewer w | 1 | 1 | 0 | 1 | 1 | 100 % |",
        ] {
            assert!(text.contains(row), "{row}\n{text}");
        }
    }

    #[test]
    fn a_choice_between_unequal_files_does_not_count() {
        let folder = tempfile::tempdir().expect("a folder");
        let key = format!("{KEY}004,a,text,0,0,32,24,1,1,avif,textured,0.5,1,2\n");
        fs::write(folder.path().join("key.csv"), key).expect("it is written");
        fs::write(folder.path().join(VIEWERS), "Two friends.\n").expect("it is written");
        let answers = "triplet,viewer,answer\n003,v,left\n004,v,left\n";
        fs::write(folder.path().join("one.csv"), answers).expect("it is written");
        let round = Round::load(folder.path()).expect("all is in order");
        let avif = round.tally(Shown::Avif, |_, _| true);
        assert_eq!(avif, Tally { triplets: 1, textured: 1, other: 0, same: 0 });
        let text = round.tables();
        let start = "Two friends. Encoder: commit 1, 2. 4 triplets, of which 1 are left out";
        assert!(text.contains(start), "{text}");
        assert!(text.contains("1 viewers, 1 answers to the others."), "{text}");
    }

    #[test]
    fn answers_that_cannot_be_are_refused() {
        for answers in ["004,v,left\n", "001,v,both\n", "001,v,left\n001,v,right\n"] {
            assert!(round(answers).1.is_err(), "{answers}");
        }
    }

    #[test]
    fn no_folder_is_no_round() {
        let folder = tempfile::tempdir().expect("a folder");
        assert_eq!(report(&folder.path().join("blind")).expect("it may be missing"), "");
    }

    #[test]
    fn lost_triplets_are_gathered_as_small_as_they_are() {
        let answers = "001,v,right\n001,w,left\n001,u,right\n002,v,right\n003,v,right\n";
        let (folder, round) = round(answers);
        let round = round.expect("all is in order");
        let triplets = tempfile::tempdir().expect("a folder");
        for (name, scale) in [("001", 1), ("003", 1)] {
            let image = RgbImage::new(112 * scale, 24 * scale);
            image.save(triplets.path().join(format!("{name}.png"))).expect("it is written");
        }
        round.write_lost(triplets.path(), folder.path()).expect("all pictures are there");
        let size = |name: &str| image::image_dimensions(folder.path().join(name)).ok();
        assert_eq!(size("lost-plain-0.25.jpg"), Some((112, 24 + LINE)));
        assert_eq!(size("lost-avif-1.jpg"), Some((112, 24 + LINE)));
    }
}
