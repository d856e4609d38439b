//! The metadata of a picture.

use image::{ImageDecoder, ImageResult};
use image_gip::{Metadata, MetadataLoss};

use super::extended_xmp;

/// Reads the metadata of a file before its pixels, and tells what of them is lost.
pub(super) fn read(
    decoder: &mut impl ImageDecoder,
    file: &[u8],
) -> ImageResult<(Metadata, Vec<MetadataLoss>)> {
    let mut metadata = Metadata::default();
    metadata.icc_profile = decoder.icc_profile()?;
    let exif = decoder.exif_metadata()?.filter(|exif| !exif.is_empty());
    let has_exif = exif.is_some();
    metadata.exif = exif.and_then(tiff_stream);
    let is_damaged = has_exif && metadata.exif.is_none();
    metadata.xmp = decoder.xmp_metadata()?;
    let loss = metadata.join_xmp(|name| extended_xmp::find(file, name));
    Ok((
        metadata,
        is_damaged.then_some(MetadataLoss::DamagedExif).into_iter().chain(loss).collect(),
    ))
}

/// The TIFF stream of Exif metadata: some programs write the prefix of JPEG's Exif marker before
/// it. `None` for anything else.
fn tiff_stream(mut exif: Vec<u8>) -> Option<Vec<u8>> {
    if exif.starts_with(b"Exif\0\0") {
        exif.drain(..6);
    }
    (exif.starts_with(b"II") || exif.starts_with(b"MM")).then_some(exif)
}
