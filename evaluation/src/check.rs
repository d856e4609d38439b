//! Whether the committed report is that of the codec that is checked out.

use std::fs;
use std::path::PathBuf;

use anyhow::{Context, Result, ensure};

use crate::{provenance, readme, report};

/// Checks that all sections of a report are of the codec that is checked out, and that the figures that the
/// README and docs/ mark are those of evaluation/report.
#[derive(Debug, clap::Args)]
pub(crate) struct Args {
    /// The folder of the report.
    #[arg(value_name = "REPORT_DIR")]
    report: PathBuf,
}

/// Checks the report.
///
/// # Errors
/// When sections are missing or of another version, or a figure differs.
pub(crate) fn check(args: &Args) -> Result<()> {
    let path = args.report.join("report.md");
    let text = fs::read_to_string(&path).with_context(|| format!("no {}", path.display()))?;
    let stale = report::of_other_versions(&text, &provenance::product()?);
    ensure!(stale.is_empty(), "missing or of another version: {}", report::names(&stale));
    readme::check(&readme::Args::default())
}
