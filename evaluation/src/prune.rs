//! Removes measurements that no report needs any more.

use std::path::PathBuf;

use anyhow::Result;

use crate::{provenance, store};

/// Removes measurements of other versions of our codec than the one that is checked out.
///
/// Those of baselines, and of all machines, stay.
#[derive(Debug, clap::Args)]
pub(crate) struct Args {
    /// The folder of the report.
    #[arg(value_name = "REPORT_DIR")]
    report: PathBuf,
}

/// Removes them.
pub(crate) fn prune(args: &Args) -> Result<()> {
    let product = provenance::product()?;
    store::keep(&args.report, |version| !provenance::is_of_another(version, &product))
}
