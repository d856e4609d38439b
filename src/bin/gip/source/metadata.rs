//! The metadata of a picture.

use std::io::Cursor;

use exif::experimental::Writer;
use exif::{In, Reader, Tag};
use image::{ImageDecoder, ImageResult};
use image_gip::{Metadata, MetadataLoss};

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

/// Exif with the tags of the first page. What else is in the file does not count, even if it is damaged.
pub(super) fn exif_of_tiff(file: &[u8]) -> Option<Vec<u8>> {
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
