//! Whether the committed report is whole, and that of the codec that is checked out.

use std::fs;
use std::path::{Path, PathBuf};

use anyhow::{Result, ensure};

use crate::report::{self, Section};
use crate::{files, provenance, readme, store};

/// Checks that all sections of a report are of the codec that is checked out and of full runs, that its
/// measurements and the files that it links are there, and that the figures that the README and docs/ mark are
/// those of evaluation/report.
#[derive(Debug, clap::Args)]
pub(crate) struct Args {
    /// The folder of the report.
    #[arg(value_name = "REPORT_DIR")]
    report: PathBuf,
}

/// Checks the report.
///
/// # Errors
/// When sections are missing or of another version, something is not whole, or a figure differs.
pub(crate) fn check(args: &Args) -> Result<()> {
    let text = files::read(&args.report.join(report::NAME))?;
    let stale = report::of_other_versions(&text, &provenance::product()?);
    ensure!(stale.is_empty(), "missing or of another version: {}", report::names(&stale));
    let faults = faults(&args.report, &text)?;
    ensure!(faults.is_empty(), "{}", faults.join("\n"));
    readme::check(&readme::Args::default())
}

/// What is not whole in the folder of a report with this text.
fn faults(folder: &Path, text: &str) -> Result<Vec<String>> {
    let mut faults = store::faults(folder)?;
    let full = report::of_full_runs(text);
    let quick: Vec<Section> =
        Section::ALL.into_iter().filter(|section| !full.contains(section)).collect();
    if !quick.is_empty() {
        faults.push(format!("missing or of a quick run: {}", report::names(&quick)));
    }
    for link in report::links(text) {
        if fs::metadata(folder.join(link)).is_ok_and(|file| file.len() > 0) {
            continue;
        }
        faults.push(format!("{link} is linked and not there"));
    }
    Ok(faults)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_committed_report_is_whole() {
        let folder = Path::new(provenance::FOLDER).join("report");
        let text = files::read(&folder.join(report::NAME)).expect("there is a report");
        assert_eq!(faults(&folder, &text).expect("all are tables"), [""; 0]);
    }

    #[test]
    fn what_is_missing_is_named() {
        let folder = tempfile::tempdir().expect("a folder");
        fs::write(folder.path().join("rate.csv"), "origin,bytes\n").expect("it is written");
        let faults = faults(folder.path(), "[a](a.svg)").expect("all are tables");
        assert_eq!(faults[0], "rate.csv is empty");
        assert!(faults[1].starts_with("missing or of a quick run: summary, "), "{faults:?}");
        assert_eq!(faults[2], "a.svg is linked and not there");
    }
}
