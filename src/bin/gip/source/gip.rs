//! Reading .gip files as sources, without their texture: it is noise, which would take many bytes as detail, and
//! figures of quality leave it out.

use anyhow::Result;
use image_gip::{Decoder, Header, Limits, Metadata, RenderOptions};

use super::stored::Stored;
use crate::decode::{Wanted, partial, skipped};
use crate::picture::StillImage;

pub(super) fn read(file: &[u8], limits: &Limits, allow_partial: bool) -> Result<Stored> {
    let picture = match whole(file, limits) {
        Err(error) if allow_partial => {
            let wanted = |header: &Header, _: &Metadata| Ok(wanted(header));
            partial(file, limits.clone(), wanted)?.ok_or(error)?
        }
        picture => picture?,
    };
    let StillImage { image, metadata, warnings } = picture;
    Ok(Stored { image, orientation: metadata.orientation(), metadata, warnings })
}

fn whole(file: &[u8], limits: &Limits) -> Result<StillImage> {
    let mut decoder = Decoder::new_with_limits(file, limits.clone())?;
    let image = wanted(decoder.header()).decode(&mut decoder)?;
    // Metadata may stand after the layers.
    let metadata = decoder.metadata().clone();
    let has_texture = decoder.picture()?.texture_map().is_some();
    let mut warnings = skipped(decoder.stream());
    warnings.extend(has_texture.then(|| "its texture is left out".to_owned()));
    Ok(StillImage { image, metadata, warnings })
}

fn wanted(header: &Header) -> Wanted {
    Wanted::as_stored(RenderOptions::new().with_texture(false), header)
}
