//! Removes measurements that no report needs any more.

use std::path::PathBuf;

use anyhow::Result;

use crate::{files, provenance, store};

/// Removes measurements of other versions of our codec than the one that is checked out.
///
/// Those of baselines, and of all machines, stay, and those whose origin is not known.
#[derive(Debug, clap::Args)]
pub(crate) struct Args {
    /// The folder of the report.
    #[arg(value_name = "REPORT_DIR")]
    report: PathBuf,
}

/// Removes them, and says how many.
pub(crate) fn prune(args: &Args) -> Result<()> {
    let _lock = files::lock(&args.report)?;
    let product = provenance::product()?;
    let removed = |version: &str| provenance::is_of_another(version, &product);
    for (table, count) in store::remove(&args.report, removed)? {
        println!("{table}: {count} rows removed");
    }
    Ok(())
}
