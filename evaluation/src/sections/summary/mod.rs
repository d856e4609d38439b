//! The report's first page: what the other sections have measured, in a few claims with their
//! numbers.

mod rates;
mod times;

use anyhow::Result;

use super::comparisons::compare;
use super::rate_store::RateStore;
use super::sizes;
use crate::bench::Bench;

pub(crate) fn measure(bench: &mut Bench) -> Result<String> {
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
