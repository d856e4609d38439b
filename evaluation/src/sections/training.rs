//! What those who train networks get: random crops from `.gip` and from other formats, and what is learned from them.

use std::collections::HashMap;
use std::path::Path;
use std::process::{Command, Stdio};

use anyhow::{Context, Result, ensure};

use crate::bench::Bench;
use crate::pictures::TestPicture;
use crate::provenance::FOLDER;
use crate::python::{self, Built};
use crate::table::Table;

/// The pictures that crops are made of.
const PICTURES: usize = 8;
const QUICK_PICTURES: usize = 1;
/// What crops are read by, as the program calls it.
const READERS: [&str; 7] = [
    "gip",
    "gip with texture",
    "JPEG by Pillow",
    "JPEG by Pillow at a smaller scale",
    "JPEG by simplejpeg at a smaller scale",
    "WebP by Pillow",
    "AVIF by Pillow",
];
/// What a network learns from, besides from files, as the program calls it.
const PICTURES_THEMSELVES: &str = "the pictures";
/// The formats of the files, whose quality follows in the program's rows.
const FILES: [&str; 2] = ["gip", "JPEG"];
/// Qualities of JPEG whose bytes all have.
const QUALITIES: [&str; 2] = ["10", "30"];
const QUICK_QUALITIES: [&str; 1] = ["30"];

pub(crate) fn measure(bench: &mut Bench) -> Result<String> {
    let programs = Path::new(FOLDER).join("../bindings/python");
    let package = Built { source: &programs, version: &bench.product };
    let programs = programs.join("benchmarks");
    let python =
        python::environment("training", &programs.join("requirements.txt"), Some(package))?;
    let run = |program: &str| {
        let mut command = Command::new(&python);
        command.arg(programs.join(program)).arg("--csv");
        command
    };
    let mut text = String::from(
        "`bindings/python/benchmarks/crops.py` makes random crops of 224 x 224 pixels, as torchvision's \
         `RandomResizedCrop` draws them, of files of equal SSIMULACRA2, which it reads anew for each crop. What is \
         not rendered at that size is resampled by Pillow. Medians of rounds in which all take turns.\n",
    );
    let taken = bench.sample(if bench.quick { QUICK_PICTURES } else { PICTURES });
    for (set, pictures) in [("Kodak", taken), ("large", bench.large_sample())] {
        if !pictures.is_empty() {
            text.push_str(&crops(bench, set, &pictures, run("crops.py"))?);
        }
    }
    text.push_str(&learning(bench, &run)?);
    Ok(text)
}

/// How fast crops are made of the pictures of a set.
fn crops(
    bench: &Bench,
    set: &str,
    pictures: &[TestPicture],
    mut command: Command,
) -> Result<String> {
    let keys = ["set", "pictures", "reader"];
    let values = ["ssimulacra2", "bytes", "crops_1", "crops_2"];
    let mut store = bench.store("training-crops.csv", keys, values)?;
    let paths = pictures.iter().map(|picture| &picture.path);
    command.arg("--pictures").args(paths).arg("--files").arg(bench.path("training").join(set));
    let mut measured = Measured::new(command);
    let mut table =
        Table::new(&["", "SSIMULACRA2", "bytes", "crops a second", "with two processes"]);
    let mut ours = [f64::NAN; 2];
    for reader in READERS {
        let key = [set, &pictures.len().to_string(), reader];
        let [ssimulacra2, bytes, one, two] =
            store.get(&bench.product, key, || measured.row(reader))?;
        // The first reader is ours.
        ours = if ours[0].is_nan() { [one, bytes] } else { ours };
        let figure = |name: &str, value: f64, unit: &str| {
            bench.figure(format!("{reader}/{set}/{name}"), value, unit);
        };
        figure("crops a second", one, "");
        figure("bytes", bytes, "");
        figure("our crops to theirs", ours[0] / one, "");
        figure("their bytes to ours", bytes / ours[1], "");
        let numbers = [format!("{ssimulacra2:.1}"), format!("{bytes:.0}"), format!("{one:.0}")];
        table.row(&[&[reader.to_owned()], &numbers[..], &[format!("{two:.0}")]].concat());
    }
    let count = pictures.len();
    Ok(format!("\n{count} pictures of the set {set}:\n{}", table.finish()))
}

/// How well a network learns from pictures in a format.
fn learning(bench: &Bench, run: &impl Fn(&str) -> Command) -> Result<String> {
    let mut store = bench.store(
        "training-learning.csv",
        ["run", "learned"],
        ["bytes", "accuracy", "lowest", "highest"],
    )?;
    let mut table = Table::new(&["learned from", "bytes", "accuracy in %", "lowest", "highest"]);
    let qualities: &[&str] = if bench.quick { &QUICK_QUALITIES } else { &QUALITIES };
    let mut command = run("learning.py");
    command.arg("--quality").args(qualities);
    if bench.quick {
        command.args(["--pictures", "300", "--epochs", "4", "--seeds", "1"]);
    }
    let mut measured = Measured::new(command);
    let extent = if bench.quick { "quick" } else { "full" };
    let files = qualities.iter().flat_map(|&quality| FILES.map(|format| (format, quality)));
    for (format, quality) in [(PICTURES_THEMSELVES, "")].into_iter().chain(files) {
        let learned = format!("{format} {quality}");
        let learned = learned.trim_end();
        let [bytes, accuracies @ ..] =
            store.get(&bench.product, [extent, learned], || measured.row(learned))?;
        let name = if quality.is_empty() { format.into() } else { format!("{format}/{quality}") };
        bench.figure(format!("{name}/accuracy"), accuracies[0], "%");
        let size = if quality.is_empty() {
            "-".to_owned()
        } else {
            bench.figure(format!("{name}/bytes"), bytes, "");
            format!("{bytes:.0}")
        };
        let accuracies = accuracies.map(|accuracy| format!("{accuracy:.1}"));
        table.row(&[&[format.to_owned(), size], &accuracies[..]].concat());
    }
    Ok(format!(
        "\n`bindings/python/benchmarks/learning.py` has a small network learn handwritten digits before parts of \
         photographs, 128 x 128 pixels, from random crops of files of equal bytes, and tests it on pictures in the \
         same format that it has not seen: the mean of seeds, and their range.\n{}",
        table.finish()
    ))
}

/// What a program measures, which runs when the first row is asked for.
#[derive(Debug)]
struct Measured {
    command: Command,
    rows: Option<HashMap<String, [f64; 4]>>,
}

impl Measured {
    fn new(command: Command) -> Self {
        Self { command, rows: None }
    }

    /// The numbers of the row of this name.
    fn row(&mut self, name: &str) -> Result<[f64; 4]> {
        if self.rows.is_none() {
            let output = self.command.stderr(Stdio::inherit()).output();
            let output = output.with_context(|| format!("cannot run {:?}", self.command))?;
            ensure!(output.status.success(), "{:?} failed", self.command);
            self.rows = Some(rows(&output.stdout)?);
        }
        let row = self.rows.as_ref().and_then(|rows| rows.get(name));
        row.copied().with_context(|| format!("{:?} printed no row of {name}", self.command))
    }
}

/// The rows of a program: a name and four numbers each.
fn rows(text: &[u8]) -> Result<HashMap<String, [f64; 4]>> {
    let mut reader = csv::ReaderBuilder::new().has_headers(false).from_reader(text);
    reader.deserialize().map(|row| Ok(row?)).collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn rows_have_a_name_and_four_numbers() {
        let found = rows(b"gip,1,2.5,3,4\r\n\"JPEG, Pillow\",5,6,7,8\r\n").expect("they have");
        assert_eq!(
            (found["gip"], found["JPEG, Pillow"]),
            ([1.0, 2.5, 3.0, 4.0], [5.0, 6.0, 7.0, 8.0])
        );
        assert!(rows(b"gip,1,2,3\n").is_err());
        assert!(rows(b"gip,1,2,3,x\n").is_err());
    }

    #[test]
    fn a_program_runs_once_and_only_if_it_is_needed() {
        let folder = tempfile::tempdir().expect("a folder");
        let log = folder.path().join("log");
        let mut command = Command::new("sh");
        command.arg("-c").arg("echo once >> \"$0\"; echo a,1,2,3,4; echo b,5,6,7,8").arg(&log);
        let mut measured = Measured::new(command);
        assert!(!log.exists());
        assert_eq!(measured.row("b").expect("it is printed"), [5.0, 6.0, 7.0, 8.0]);
        assert_eq!(measured.row("a").expect("it is printed"), [1.0, 2.0, 3.0, 4.0]);
        assert!(measured.row("c").is_err());
        assert_eq!(std::fs::read_to_string(log).expect("it ran"), "once\n");
    }
}
