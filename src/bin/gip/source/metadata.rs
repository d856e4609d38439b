//! The metadata of a picture, and how it is to be turned.

use std::io::Cursor;

use exif::experimental::Writer;
use exif::{In, Reader, Tag};
use image::{ImageDecoder, ImageFormat, ImageResult};
use image_gip::{Metadata, MetadataLoss, Orientation};

use super::extended_xmp;

/// What of the tags of a TIFF would be in the Exif of another format. The orientation is not: it is applied.
const TAGS_OF_TIFF: [Tag; 17] = [
    Tag::ImageDescription,
    Tag::Make,
    Tag::Model,
    Tag::XResolution,
    Tag::YResolution,
    Tag::ResolutionUnit,
    Tag::Software,
    Tag::DateTime,
    Tag::Artist,
    Tag::Copyright,
    Tag::ExifVersion,
    Tag::DateTimeOriginal,
    Tag::DateTimeDigitized,
    Tag::OffsetTimeOriginal,
    Tag::OffsetTimeDigitized,
    Tag::SubSecTimeOriginal,
    Tag::SubSecTimeDigitized,
];

/// How a picture is to be turned, which a TIFF says by a tag and all others by their Exif.
pub(super) fn orientation(
    decoder: &mut impl ImageDecoder,
    format: Option<ImageFormat>,
    metadata: &Metadata,
) -> ImageResult<Orientation> {
    if format != Some(ImageFormat::Tiff) {
        // The decoders of `image` know nothing of the prefix that was removed.
        return Ok(metadata.orientation());
    }
    Ok(Orientation::from_exif(decoder.orientation()?.to_exif()).unwrap_or_default())
}

/// Reads the metadata of a file before its pixels.
pub(super) fn read(
    decoder: &mut impl ImageDecoder,
    format: Option<ImageFormat>,
    file: &[u8],
) -> ImageResult<(Metadata, Option<MetadataLoss>)> {
    let mut metadata = Metadata::default();
    metadata.icc_profile = decoder.icc_profile()?;
    metadata.exif = match format {
        Some(ImageFormat::Tiff) => exif_of_tiff(file),
        _ => decoder.exif_metadata()?.and_then(tiff_stream),
    };
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

/// Exif with the tags of the first page. What else is in the file does not count, even if it is damaged.
fn exif_of_tiff(file: &[u8]) -> Option<Vec<u8>> {
    let mut reader = Reader::new();
    let exif = reader.continue_on_error(true).read_raw(file.to_vec());
    let exif = exif.or_else(|error| error.distill_partial_result(|_| {})).ok()?;
    let (mut writer, mut out) = (Writer::new(), Cursor::new(Vec::new()));
    let fields = TAGS_OF_TIFF.iter().filter_map(|tag| exif.get_field(*tag, In::PRIMARY));
    fields.for_each(|field| writer.push_field(field));
    // It fails if there is nothing to write.
    writer.write(&mut out, exif.little_endian()).ok()?;
    Some(out.into_inner())
}
