//! Pictures in memory, and converting their colour model and depth.

use image::DynamicImage;
use image_gip::{ColorModel, Metadata, MetadataPolicy, Orientation, SampleDepth};

/// What is said of an ICC profile of which a part is missing or wrong.
pub(crate) const DAMAGED_PROFILE: &str = "its ICC profile is damaged and cannot be kept";

/// An upright picture, its metadata, and what was lost on the way to it.
#[derive(Debug)]
pub(crate) struct StillImage {
    /// Gray or RGB, with or without alpha, 8 or 16 bits: `image` has eight variants for these.
    pub(crate) image: DynamicImage,
    pub(crate) metadata: Metadata,
    /// What the file that it was read from has and the picture lacks, a sentence each.
    pub(crate) warnings: Vec<String>,
}

/// The samples of a picture.
#[derive(Clone, Copy, Debug)]
pub(crate) enum SampleSlice<'a> {
    Eight(&'a [u8]),
    Sixteen(&'a [u16]),
}

impl StillImage {
    /// Applies an orientation to the pixels, and resets it in the metadata, so that it is not applied
    /// again. Metadata of a picture that is upright stays as it is.
    pub(crate) fn make_upright(&mut self, orientation: Orientation) {
        if orientation != Orientation::NoTransforms {
            let turn = image::metadata::Orientation::from_exif(orientation.to_exif());
            self.image.apply_orientation(turn.expect("both have the eight of Exif"));
            self.metadata.reset_orientation();
        }
    }

    /// Keeps only such metadata, with a warning of what may be missed.
    pub(crate) fn retain_metadata(&mut self, policy: MetadataPolicy) {
        let losses = self.metadata.retain(policy);
        self.warnings.extend(losses.iter().map(ToString::to_string));
    }

    /// Drops an ICC profile that has not as many bytes as it says, or is for another colour space than that
    /// of the samples, such as the profile of a CMYK picture that was converted to RGB.
    pub(crate) fn drop_unfit_profile(&mut self) {
        let expected: &[u8] = if self.color().channels() < 3 { b"GRAY" } else { b"RGB " };
        let size = |profile: &[u8]| Some(u32::from_be_bytes(*profile.first_chunk()?));
        let is_whole = |profile: &[u8]| size(profile).map(u64::from) == Some(profile.len() as u64);
        let is_unfit =
            |profile: &mut Vec<u8>| !is_whole(profile) || profile.get(16..20) != Some(expected);
        if let Some(profile) = self.metadata.icc_profile.take_if(is_unfit) {
            let space = String::from_utf8_lossy(profile.get(16..20).unwrap_or_default());
            let space = space.trim();
            let is_name = !space.is_empty() && space.chars().all(|c| c.is_ascii_alphanumeric());
            self.warnings.push(if is_name && is_whole(&profile) {
                format!("its ICC profile is one of {space} and cannot be kept")
            } else {
                DAMAGED_PROFILE.into()
            });
        }
    }

    /// Rounds alpha to transparent or opaque, for a format that has nothing between, with a warning if there
    /// was something.
    pub(crate) fn round_alpha(&mut self) {
        let DynamicImage::ImageRgba8(image) = &mut self.image else { return };
        let mut is_changed = false;
        for image::Rgba([.., alpha]) in image.pixels_mut() {
            let rounded = if *alpha < 128 { 0 } else { u8::MAX };
            is_changed |= *alpha != rounded;
            *alpha = rounded;
        }
        if is_changed {
            self.warnings.push("its alpha is rounded to transparent or opaque".into());
        }
    }

    /// The colour model.
    pub(crate) fn color(&self) -> ColorModel {
        match self.image.color().channel_count() {
            1 => ColorModel::Gray,
            2 => ColorModel::GrayAlpha,
            3 => ColorModel::Rgb,
            _ => ColorModel::Rgba,
        }
    }

    /// Bits per sample.
    pub(crate) fn depth(&self) -> SampleDepth {
        match self.samples() {
            SampleSlice::Eight(_) => SampleDepth::Eight,
            SampleSlice::Sixteen(_) => SampleDepth::Sixteen,
        }
    }

    /// The interleaved samples.
    pub(crate) fn samples(&self) -> SampleSlice<'_> {
        match &self.image {
            DynamicImage::ImageLuma16(image) => SampleSlice::Sixteen(image),
            DynamicImage::ImageLumaA16(image) => SampleSlice::Sixteen(image),
            DynamicImage::ImageRgb16(image) => SampleSlice::Sixteen(image),
            DynamicImage::ImageRgba16(image) => SampleSlice::Sixteen(image),
            image => SampleSlice::Eight(image.as_bytes()),
        }
    }

    /// Drops an alpha channel that is opaque everywhere.
    pub(crate) fn drop_opaque_alpha(&mut self) {
        let color = match self.color() {
            ColorModel::GrayAlpha => ColorModel::Gray,
            ColorModel::Rgba => ColorModel::Rgb,
            _ => return,
        };
        let channels = self.color().channels();
        let opaque = match self.samples() {
            SampleSlice::Eight(samples) => is_opaque(samples, channels, &u8::MAX),
            SampleSlice::Sixteen(samples) => is_opaque(samples, channels, &u16::MAX),
        };
        if opaque {
            self.convert(color, self.depth());
        }
    }

    /// Converts colour model and depth. Adding channels or increasing the depth is lossless: gray
    /// is repeated as red, green and blue, missing alpha is opaque, and 8-bit samples are scaled.
    pub(crate) fn convert(&mut self, color: ColorModel, depth: SampleDepth) {
        if (color, depth) == (self.color(), self.depth()) {
            return;
        }
        let image = &self.image;
        self.image = match (color, depth) {
            (ColorModel::Gray, SampleDepth::Eight) => image.to_luma8().into(),
            (ColorModel::GrayAlpha, SampleDepth::Eight) => image.to_luma_alpha8().into(),
            (ColorModel::Rgb, SampleDepth::Eight) => image.to_rgb8().into(),
            (_, SampleDepth::Eight) => image.to_rgba8().into(),
            (ColorModel::Gray, _) => image.to_luma16().into(),
            (ColorModel::GrayAlpha, _) => image.to_luma_alpha16().into(),
            (ColorModel::Rgb, _) => image.to_rgb16().into(),
            _ => image.to_rgba16().into(),
        };
    }
}

/// The colour model with the fewest channels that has those of both.
pub(crate) fn widest(a: ColorModel, b: ColorModel) -> ColorModel {
    match (a.channels().max(b.channels()) >= 3, a.has_alpha() || b.has_alpha()) {
        (false, false) => ColorModel::Gray,
        (false, true) => ColorModel::GrayAlpha,
        (true, false) => ColorModel::Rgb,
        (true, true) => ColorModel::Rgba,
    }
}

fn is_opaque<T: PartialEq>(samples: &[T], channels: usize, full: &T) -> bool {
    samples.iter().skip(channels - 1).step_by(channels).all(|alpha| alpha == full)
}
