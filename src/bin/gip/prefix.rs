//! `gip prefix`.

use anyhow::{Context, Result, bail};
use image_gip::Prefixes;

use crate::args;
use crate::errors::WrongUsage;
use crate::files::{self, Output};

pub(crate) fn run(args: &args::Prefix) -> Result<()> {
    let output = Output::new(&args.output)?;
    if !args.force {
        output.check_name("prefix")?;
    }
    output.check_is_not(&args.input)?;
    let file = files::read(&args.input)?;
    let prefixes = Prefixes::new(&file).with_context(|| files::input_name(&args.input))?;
    let Some(prefix) = prefixes.within(args.bytes) else {
        let input = files::input_name(&args.input);
        let Some(first) = prefixes.iter().next() else { bail!("{input}: has no complete layer") };
        let least = first.bytes;
        let text = format!(
            "{input}: the file of its first layer has {least} bytes; BYTES must be {least} at least"
        );
        return Err(WrongUsage(text).into());
    };
    output.write(&prefixes.file(prefix), None)?;
    let text = format!(
        "{}: {} of {} layers, {} Gaussians, {} bytes",
        files::output_name(&args.output),
        prefix.layers,
        prefixes.layers(),
        prefix.gaussians,
        prefix.bytes
    );
    files::print(&text, Some(&args.output))
}
