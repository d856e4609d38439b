//! Colour spaces in coding-independent code points: from PNG and to it, and as ICC profiles.

use std::ops::Range;

use image_gip::{Cicp, ContentLight, MasteringDisplay, Metadata};
use moxcms::{
    CicpProfile, ColorProfile, DataColorSpace, LocalizableString, MatrixCoefficients, ProfileText,
};
use png::{Info, ScaledFloat};

/// Signature and header of a PNG: what says how samples are shown may follow them.
const PNG_START: Range<usize> = 0..33;

/// Takes what a PNG says of the display that its picture was made on, and of how bright the picture is.
pub(crate) fn light_of_png(info: &Info<'_>, metadata: &mut Metadata) {
    metadata.mastering_display = info.mastering_display_color_volume.map(|display| {
        // The library doubles PNG's values, which are 16-bit integers.
        let point = |(x, y): (ScaledFloat, ScaledFloat)| {
            [x, y].map(|value| (value.into_scaled() / 2) as u16)
        };
        let points = display.chromaticities;
        MasteringDisplay {
            red: point(points.red),
            green: point(points.green),
            blue: point(points.blue),
            white: point(points.white),
            max_luminance: display.max_luminance,
            min_luminance: display.min_luminance,
        }
    });
    metadata.content_light = info.content_light_level.map(|light| ContentLight {
        max_content: light.max_content_light_level,
        max_frame_average: light.max_frame_average_light_level,
    });
}

/// The PNG with what says how its samples are shown, which the encoder of `image` does not write.
pub(crate) fn with_chunks(png: Vec<u8>, metadata: &Metadata) -> Vec<u8> {
    let mut chunks = Vec::new();
    let mut add = |name: &[u8; 4], payload: &[u8]| {
        let body = [name, payload].concat();
        chunks.extend((payload.len() as u32).to_be_bytes());
        chunks.extend(&body);
        chunks.extend(crc32fast::hash(&body).to_be_bytes());
    };
    if let Some(cicp) = metadata.cicp {
        add(b"cICP", &cicp.to_bytes());
    }
    if let Some(display) = metadata.mastering_display {
        add(b"mDCV", &display.to_bytes());
    }
    if let Some(light) = metadata.content_light {
        add(b"cLLI", &light.to_bytes());
    }
    if chunks.is_empty() {
        return png;
    }
    [&png[PNG_START], &chunks, &png[PNG_START.end..]].concat()
}

/// The colour space as an ICC profile; `None` if there is none, as for PQ and HLG.
pub(crate) fn profile(cicp: Cicp, is_gray: bool) -> Option<Vec<u8>> {
    let Cicp { primaries, transfer, .. } = cicp;
    // Others than these are of high dynamic range, historical, or unspecified.
    if primaries == 2 || !matches!(transfer, 1 | 4..=8 | 13..=15) {
        return None;
    }
    let mut profile = ColorProfile::new_from_cicp(CicpProfile {
        color_primaries: primaries.try_into().ok()?,
        transfer_characteristics: transfer.try_into().ok()?,
        matrix_coefficients: MatrixCoefficients::Identity,
        full_range: true,
    });
    let curve = profile.red_trc.clone()?;
    if is_gray {
        profile = ColorProfile::new_gray_with_gamma(1.0);
        profile.pcs = DataColorSpace::Xyz;
        profile.gray_trc = Some(curve);
    }
    named(profile, format!("CICP {primaries}/{transfer}/0/1")).encode().ok()
}

/// The profile with a name, and with the white that its colours are adapted to.
pub(crate) fn named(mut profile: ColorProfile, name: String) -> ColorProfile {
    profile.cicp = None;
    profile.media_white_point = Some(profile.white_point);
    let name = LocalizableString::new("en".into(), "US".into(), name);
    profile.description = Some(ProfileText::Localizable(vec![name]));
    profile
}

/// The codes, and before them the name of a colour space that has one.
pub(crate) fn name(cicp: Cicp) -> String {
    let Cicp { primaries, transfer, .. } = cicp;
    let space = match (primaries, transfer) {
        (1, 13) => "sRGB, ",
        (12, 13) => "Display P3, ",
        (_, 16) => "PQ, ",
        (_, 18) => "HLG, ",
        _ => "",
    };
    format!("{space}cICP {primaries}/{transfer}/0/1")
}
