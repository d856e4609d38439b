//! What others print of themselves, beside what we measure.

mod codecs;
mod curves;
pub(crate) mod paper;

use anyhow::Result;

use crate::bench::Bench;

pub(crate) fn measure(bench: &mut Bench) -> Result<String> {
    Ok(format!("{}{}", curves::measure(bench)?, codecs::measure(bench)?))
}
