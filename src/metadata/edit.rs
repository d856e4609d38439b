//! Metadata for whoever changes the picture, or the file that they are in.

use exif::{Tag, Value};

use super::exif::{Exif, write};
use super::policy::MetadataLoss;
use super::xmp;
use crate::container::Metadata;

/// What of the tags of a TIFF file would be in the Exif of another format.
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

impl Metadata {
    /// Sets the Exif to what the tags of a TIFF file's first page say that other formats have there:
    /// description, artist, copyright, camera, dates and resolution. The orientation is not among them:
    /// whoever reads the pixels turns them. What is damaged, and all that is of another page, is left out.
    pub fn set_exif_of_tiff(&mut self, file: &[u8]) {
        self.exif = Exif::read(file).and_then(|exif| {
            let fields = TAGS_OF_TIFF.map(|tag| exif.field(tag, u32::MAX).ok().flatten());
            let fields: Vec<_> = fields.into_iter().flatten().collect();
            write(&fields, exif.is_little_endian())
        });
    }

    /// Whether the Exif says that the colours are those of Adobe RGB: cameras name it there, and add no ICC
    /// profile (DCF 2.0).
    #[must_use]
    pub fn is_adobe_rgb(&self) -> bool {
        let exif = self.exif.as_deref().and_then(Exif::read);
        let index = exif.and_then(|exif| exif.field(Tag::InteroperabilityIndex, 4).ok().flatten());
        match index.map(|field| field.value) {
            Some(Value::Ascii(texts)) => texts.iter().any(|text| text.starts_with(b"R03")),
            _ => false,
        }
    }

    /// Makes Exif and XMP say that the picture is upright, for whoever has turned its pixels. What they do
    /// not say is not added.
    pub fn reset_orientation(&mut self) {
        self.reset_exif_orientation();
        if let Some(xmp) = &mut self.xmp {
            xmp::reset_orientation(xmp);
        }
    }

    /// Puts XMP together of which a second part is elsewhere in the file, as in JPEG, where it is called
    /// *extended XMP*. `find` is asked for it by its name, a GUID, and returns the bytes of its segments in
    /// order. If it has none, or if they are damaged, the first part remains, without the name, and the loss
    /// is returned.
    ///
    /// XMP that names no second part stays as it is, and `find` is not called.
    pub fn join_xmp(&mut self, find: impl FnOnce(&str) -> Option<Vec<u8>>) -> Option<MetadataLoss> {
        let xmp = self.xmp.as_mut()?;
        let name = xmp::name(xmp)?;
        if let Some(joined) =
            find(&name).and_then(|extension| xmp::join(xmp, Some(&extension)).ok())
        {
            *xmp = joined;
            return None;
        }
        if let Ok(first) = xmp::join(xmp, None) {
            *xmp = first;
        }
        Some(MetadataLoss::XmpExtension)
    }
}
