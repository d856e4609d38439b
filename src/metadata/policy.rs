//! Which metadata is kept.

use core::fmt;

use super::{exif, icc, xmp};
use crate::container::Metadata;
use crate::orientation::Orientation;

/// Keywords of texts, as PNG registers them, whose texts an author wrote to be read by all.
const SAFE_KEYWORDS: [&str; 6] =
    ["Title", "Author", "Description", "Copyright", "Creation Time", "Disclaimer"];

/// Which metadata to keep; see [`Metadata::retain`].
///
/// Each keeps the colour space in codes, the mastering display and the content light level: they say what the samples
/// stand for, and nothing of anybody.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
#[non_exhaustive]
pub enum MetadataPolicy {
    /// All of it, as it is.
    #[default]
    All,
    /// What serves the viewer and the author, and tells nothing that a person may not know is there.
    ///
    /// - The colour profile.
    /// - Of Exif: orientation, colour space and resolution; copyright, artist and description; dates, with
    ///   time zones and fractions of seconds. Position, maker notes, embedded thumbnails, camera, serial
    ///   numbers, names of owners, user comments and all else are dropped.
    /// - Of XMP: the same, title, creator, credit, and terms of use; as plain texts and lists.
    /// - Texts with PNG's keywords `Title`, `Author`, `Description`, `Copyright`, `Creation Time` and
    ///   `Disclaimer`.
    Safe,
    /// Nothing else, not even the colour profile and the orientation.
    None,
}

/// Something that a policy dropped, and that may be missed.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
#[non_exhaustive]
pub enum MetadataLoss {
    /// A colour profile that is not sRGB's, without a colour space in codes: the same samples now stand for other
    /// colours.
    ColorProfile,
    /// An orientation other than upright: whoever shows the picture leaves it as it is stored.
    Orientation,
    /// Exif that is damaged: what could be read of it is kept, as the policy says.
    DamagedExif,
    /// XMP that is damaged, and therefore was dropped as a whole.
    DamagedXmp,
    /// The second part of XMP that is in two; see [`Metadata::join_xmp`].
    XmpExtension,
}

impl Metadata {
    /// Keeps what the policy says, and drops the rest. Returns what was dropped that may be missed.
    ///
    /// [`MetadataPolicy::None`] drops the orientation, too: turn the picture first, and
    /// [reset](Metadata::reset_orientation) the orientation.
    ///
    /// ```
    /// use image_gip::{Metadata, MetadataPolicy, Text};
    ///
    /// let mut metadata = Metadata::default();
    /// metadata.texts.push(Text::new("Author", "Emma"));
    /// metadata.texts.push(Text::new("Comment", "taken at home"));
    /// assert!(metadata.retain(MetadataPolicy::Safe).is_empty());
    /// assert_eq!(metadata.texts, [Text::new("Author", "Emma")]);
    /// ```
    pub fn retain(&mut self, policy: MetadataPolicy) -> Vec<MetadataLoss> {
        let mut losses = Vec::new();
        match policy {
            MetadataPolicy::All => {}
            MetadataPolicy::Safe => {
                let orientation = self.orientation();
                if let Some(exif) = self.exif.take() {
                    let (safe, is_damaged) = exif::safe(&exif, orientation);
                    if is_damaged {
                        losses.push(MetadataLoss::DamagedExif);
                    }
                    self.exif = safe;
                }
                if let Some(xmp) = self.xmp.take() {
                    self.xmp = xmp::safe(&xmp).unwrap_or_else(|_| {
                        losses.push(MetadataLoss::DamagedXmp);
                        None
                    });
                }
                self.texts.retain(|text| SAFE_KEYWORDS.contains(&&*text.keyword));
            }
            MetadataPolicy::None => {
                let dropped = core::mem::take(self);
                self.cicp = dropped.cicp;
                self.mastering_display = dropped.mastering_display;
                self.content_light = dropped.content_light;
                if dropped.orientation() != Orientation::NoTransforms {
                    losses.push(MetadataLoss::Orientation);
                }
                let is_needed = |profile: Vec<u8>| !icc::is_srgb(&profile);
                if self.cicp.is_none() && dropped.icc_profile.is_some_and(is_needed) {
                    losses.push(MetadataLoss::ColorProfile);
                }
            }
        }
        losses
    }
}

impl fmt::Display for MetadataLoss {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str(match self {
            Self::ColorProfile => {
                "the colour profile was dropped, so the colours are taken for sRGB"
            }
            Self::Orientation => {
                "the orientation was dropped, so the picture is shown as it is stored"
            }
            Self::DamagedExif => {
                "the Exif is damaged, and what could not be read of it was dropped"
            }
            Self::DamagedXmp => "the XMP is damaged and was dropped",
            Self::XmpExtension => {
                "the second part of the XMP is missing or damaged and was dropped"
            }
        })
    }
}
