//! Files of a few hundred bytes, which pages show while the picture itself is on its way.

mod codecs;
mod figures;
mod sheet;

use anyhow::Result;

use crate::bench::Bench;

pub(crate) fn measure(bench: &mut Bench) -> Result<String> {
    Ok(format!("{}{}", figures::measure(bench)?, sheet::make(bench)?))
}
