//! Changes to metadata for whoever changes the picture, or the file that they are in.

use super::policy::MetadataLoss;
use super::xmp;
use crate::container::Metadata;

impl Metadata {
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
