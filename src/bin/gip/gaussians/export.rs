//! `gip export`.

use anyhow::{Context, Result, anyhow};
use image_gip::{Gaussian, Metadata, Picture, StreamDecoder};

use super::format::format_of;
use super::model::{Model, Spots};
use super::{json, npz, ply, svg};
use crate::args::{self, GaussianFormat};
use crate::decode::skipped;
use crate::files::{self, Output};

pub(crate) fn run(args: &args::Export) -> Result<()> {
    let output = Output::new(&args.output)?;
    output.check_is_not(&args.input)?;
    let format = format_of(args.format, &args.output)?;
    let context = || files::input_name(&args.input);
    let limits = args.limits.limits();
    let file = files::read(&args.input)?;
    let mut stream = StreamDecoder::new().with_limits(limits.clone());
    stream.feed(&file).and_then(|_| stream.finish()).with_context(context)?;
    let picture = stream.picture().ok_or_else(|| anyhow!("the file has no header"))?;

    let mut warnings = skipped(&stream);
    let model = Model {
        picture: spots(&picture, &mut warnings),
        texture: picture.texture_map().map(|map| spots(&map, &mut warnings)),
    };
    if model.texture.is_some() && matches!(format, GaussianFormat::Ply | GaussianFormat::Svg) {
        warnings.push(format!("its texture has no place in {format:?} and is left out"));
    }
    warnings.extend(metadata_warning(stream.metadata()));
    let orientation = stream.metadata().orientation().to_exif();
    if orientation != 1 {
        warnings.push(format!(
            "the picture is exported as stored, and shown turned by orientation {orientation} of Exif"
        ));
    }
    files::warn(&args.input, &warnings);
    let bytes = match format {
        GaussianFormat::Npz => npz::write(&model),
        GaussianFormat::Json => json::write_object(&model)?.into_bytes(),
        GaussianFormat::Jsonl => json::write_lines(&model)?.into_bytes(),
        GaussianFormat::Ply => ply::write(&model.picture),
        GaussianFormat::Svg => {
            svg::write(&model.picture, &limits).with_context(context)?.into_bytes()
        }
    };
    output.write(&bytes, None)?;
    let texture =
        model.texture.filter(|_| !matches!(format, GaussianFormat::Ply | GaussianFormat::Svg));
    let texture = texture.map_or_else(String::new, |texture| {
        format!(" and {} of the texture", texture.gaussians.len())
    });
    let (name, count) = (files::output_name(&args.output), model.picture.gaussians.len());
    let text = format!("{name}: {count} Gaussians{texture}, {} bytes", bytes.len());
    files::print(&text, Some(&args.output))
}

/// The Gaussians that are drawn.
fn spots(picture: &Picture<'_>, warnings: &mut Vec<String>) -> Spots {
    let all = picture.gaussians();
    let gaussians: Vec<_> = all.iter().copied().filter(Gaussian::is_drawable).collect();
    let left_out = all.len() - gaussians.len();
    if left_out > 0 {
        warnings.push(format!("{left_out} Gaussians that are not drawn are left out"));
    }
    Spots { header: picture.header().clone(), gaussians }
}

/// What is said of metadata, which no format here has.
fn metadata_warning(metadata: &Metadata) -> Option<String> {
    let light = metadata.mastering_display.is_some() || metadata.content_light.is_some();
    let kinds = [
        (metadata.cicp.is_some(), "colour space"),
        (light, "mastering display or content light level"),
        (metadata.icc_profile.is_some(), "colour profile"),
        (metadata.exif.is_some(), "Exif"),
        (metadata.xmp.is_some(), "XMP"),
        (!metadata.texts.is_empty(), "texts"),
    ];
    let there: Vec<_> =
        kinds.iter().filter(|(is_there, _)| *is_there).map(|(_, name)| *name).collect();
    (!there.is_empty()).then(|| format!("not exported: {}", there.join(", ")))
}
