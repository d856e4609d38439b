//! The report's first page: what the other sections have measured, in a few claims with their
//! numbers.

mod rates;
mod times;

use anyhow::{Result, ensure};

use super::comparisons::compare;
use super::rate_store::RateStore;
use super::sizes;
use crate::bench::Bench;
use crate::files;
use crate::report::{self, Section};

/// What it tells of; without them it would have to measure all that they do.
const NEEDED: [Section; 2] = [Section::Rate, Section::Sizes];

pub(crate) fn measure(bench: &mut Bench) -> Result<String> {
    let report = files::read_if_any(&bench.path(report::NAME))?.unwrap_or_default();
    let mut missing = report::of_other_versions(&report, &bench.product);
    missing.retain(|section| NEEDED.contains(section));
    ensure!(missing.is_empty(), "measure these first: {}", report::names(&missing));
    let mut store = RateStore::open(bench)?;
    let comparisons = compare(bench, &mut store)?;
    let mut text = String::from(
        "Every number of this page is made from the measurements of the sections that follow, which say how \
         it was measured.\n\n",
    );
    text.push_str(&rates::claims(bench, &comparisons));
    text.push_str(&sizes::claim(bench)?);
    text.push_str(&times::claims(bench)?);
    text.push_str(&rates::pictures(bench, &comparisons)?);
    Ok(text)
}
