//! `gip import`.

use anyhow::{Context, Result, anyhow, bail};
use image_gip::{
    DecodeError, Decoder, Header, LimitKind, Limits, Picture, PictureError, Precision, WriteError,
    Writer,
};

use super::format::format_of;
use super::model::{BYTE_ORDER_MARK, Imported};
use super::{json, npz, ply};
use crate::args::{self, GaussianFormat};
use crate::errors::WrongUsage;
use crate::files::{self, Output};
use crate::limits;

pub(crate) fn run(args: &args::Import) -> Result<()> {
    let output = Output::new(&args.output)?;
    if !args.force {
        output.check_name("import")?;
    }
    args.check()?;
    let format = format_of(args.format, &args.input)?;
    let context = || files::input_name(&args.input);
    let limits = args.limits.limits();
    let bytes = files::read(&args.input)?;
    let mut imported = read(format, &bytes, &args.header, &limits).with_context(context)?;
    let channels = change(&mut imported, &args.header)?;
    let mut header = imported.fields.header(channels).with_context(context)?;
    header.parameterization = args.parameterization.into();
    check(&header, &imported, &limits).with_context(context)?;

    let writer = writer(args, header).with_limits(limits.clone());
    let file = args.threads.pool()?.install(|| writer.write(&imported.gaussians));
    let file = file.map_err(|error| match error {
        WriteError::Picture(error) => flaw(&error, &imported).context(context()),
        WriteError::Option(_) | WriteError::ColorStep(_) | WriteError::Quantizers(_) => {
            WrongUsage(error.to_string()).into()
        }
        error => error.into(),
    })?;
    let count = Decoder::new_with_limits(&file[..], limits)?.header().gaussians as usize;
    let left_out = imported.gaussians.len() - count;
    if left_out > 0 {
        let warning = format!("{left_out} Gaussians that do not show in the picture are left out");
        imported.warnings.push(warning);
    }
    files::warn(&args.input, &imported.warnings);
    output.write(&file, None)?;
    let name = files::output_name(&args.output);
    files::print(&format!("{name}: {count} Gaussians, {} bytes", file.len()), Some(&args.output))
}

fn read(
    format: GaussianFormat,
    bytes: &[u8],
    header: &args::HeaderArgs,
    limits: &Limits,
) -> Result<Imported> {
    let text = || {
        let bytes = bytes.strip_prefix(BYTE_ORDER_MARK).unwrap_or(bytes);
        str::from_utf8(bytes).context("it is not UTF-8")
    };
    match format {
        GaussianFormat::Npz => npz::read(bytes, limits.max_memory),
        GaussianFormat::Json => json::read_object(text()?),
        GaussianFormat::Jsonl => json::read_lines(text()?),
        GaussianFormat::Ply => ply::read(bytes, header),
        GaussianFormat::Svg => {
            bail!(WrongUsage("SVG is not imported, as it does not have the numbers".into()))
        }
    }
}

/// Changes the fields of the header that options say. Returns the channels.
///
/// # Errors
/// When a sample of the base colour has more bits than the picture.
fn change(imported: &mut Imported, args: &args::HeaderArgs) -> Result<usize, WrongUsage> {
    let fields = &mut imported.fields;
    if let Some((width, height)) = args.size {
        (fields.width, fields.height) = (Some(width), Some(height));
    }
    fields.depth = args.depth.or(fields.depth);
    if let Some(kernel) = args.kernel {
        (fields.kernel, fields.cutoff) = (Some(kernel.name().into()), None);
    }
    fields.cutoff = args.cutoff.map(|cutoff| cutoff as f32).or(fields.cutoff);
    let of_base = if args.base_color.len() > 1 { args.base_color.len() } else { 3 };
    let channels = imported.channels.unwrap_or(of_base);
    if let Some(base) = args.base_color(fields.depth, channels)? {
        fields.base_color = Some(base);
    }
    Ok(channels)
}

/// Refuses what is not drawn, and what a decoder with these limits would refuse.
fn check(header: &Header, imported: &Imported, limits: &Limits) -> Result<()> {
    limits::check_size(limits, (header.width, header.height))?;
    match Picture::from_gaussians(header, &imported.gaussians, limits) {
        Ok(_) => Ok(()),
        Err(PictureError::Count { found, allowed }) => Err(DecodeError::Limit {
            kind: LimitKind::Gaussians,
            wanted: found as u64,
            allowed: allowed.into(),
        }
        .into()),
        Err(error) => Err(flaw(&error, imported)),
    }
}

/// An error about a Gaussian, with its line if it has one.
fn flaw(error: &PictureError, imported: &Imported) -> anyhow::Error {
    let line = match error {
        PictureError::Gaussian { index, .. } => imported.lines.get(*index),
        _ => None,
    };
    line.map_or_else(|| anyhow!("{error}"), |line| anyhow!("line {line}: {error}"))
}

fn writer(args: &args::Import, header: Header) -> Writer {
    let writer = Writer::new(header).with_precision(args.precision.into());
    match (Precision::from(args.precision), args.bits, args.color_step) {
        (Precision::Packed, Some([position, shape, color]), _) => {
            writer.with_bit_depths(position, shape, color)
        }
        (Precision::Entropy, _, Some(step)) => writer.with_color_step(step as f32),
        _ => writer,
    }
}
