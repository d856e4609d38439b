//! The metadata of a picture.

use image::{ImageDecoder, ImageResult};
use image_gip::{Metadata, MetadataLoss};

use super::extended_xmp;

/// Reads the metadata of a file before its pixels.
pub(super) fn read(
    decoder: &mut impl ImageDecoder,
    file: &[u8],
) -> ImageResult<(Metadata, Option<MetadataLoss>)> {
    let mut metadata = Metadata::default();
    metadata.icc_profile = decoder.icc_profile()?;
    metadata.exif = decoder.exif_metadata()?.and_then(tiff_stream);
    metadata.xmp = decoder.xmp_metadata()?;
    let loss = metadata.join_xmp(|name| extended_xmp::find(file, name));
    Ok((metadata, loss))
}

/// The TIFF stream of Exif metadata: some programs write the prefix of JPEG's Exif marker before
/// it. `None` for anything else.
fn tiff_stream(mut exif: Vec<u8>) -> Option<Vec<u8>> {
    if exif.starts_with(b"Exif\0\0") {
        exif.drain(..6);
    }
    (exif.starts_with(b"II") || exif.starts_with(b"MM")).then_some(exif)
}
