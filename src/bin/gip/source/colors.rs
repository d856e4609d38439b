//! What files say about their colours beside an ICC profile.

use std::ops::RangeInclusive;

use image_gip::{Cicp, Metadata};
use moxcms::{Chromaticity, ColorPrimaries, ColorProfile, ToneReprCurve, XyY};
use png::{CodingIndependentCodePoints, Info, SourceChromaticities};

use super::light;
use super::stored::Stored;
use crate::cicp;

/// The gamma that stands for sRGB, and how far others that do may be from it.
const SRGB_GAMMA: f64 = 0.454_55;
const SAME_GAMMA: f64 = 0.01;
/// Gammas that pictures have.
const GAMMAS: RangeInclusive<f64> = 0.1..=10.0;
/// The least area of the triangle of primaries, a hundredth of sRGB's, and that of the three to the
/// white relative to it.
const LEAST_AREA: f64 = 0.001;
const LEAST_SHARE: f64 = 0.001;
/// How far chromaticities of sRGB may be from the standard's.
const SAME_CHROMATICITY: f64 = 0.002;
/// x and y of sRGB's white, red, green and blue.
pub(super) const SRGB: [(f64, f64); 4] = [(0.3127, 0.329), (0.64, 0.33), (0.3, 0.6), (0.15, 0.06)];

/// Applies the chunks of a PNG, of which the first of cICP, iCCP, sRGB, and gAMA with cHRM counts (PNG,
/// third edition, 4.3). Codes and profiles are kept; a gamma alone is turned to that of sRGB, and what has other
/// chromaticities gets a profile.
pub(super) fn of_png(info: &Info<'_>, stored: &mut Stored) {
    cicp::light_of_png(info, &mut stored.metadata);
    match info.coding_independent_code_points {
        Some(points) if !points.is_video_full_range_image => {
            stored.warnings.push(limited(points, has_other(info)));
        }
        Some(points) if !is_default(points) => {
            let cicp = Cicp::new(points.color_primaries, points.transfer_function);
            if cicp == Cicp::SRGB {
                // As samples are without codes and profile.
                stored.metadata.icc_profile = None;
            } else {
                stored.metadata.cicp = Some(cicp);
            }
            return;
        }
        _ => {}
    }
    if info.icc_profile.is_none() && info.srgb.is_none() {
        of_gamma_and_chromaticities(info, stored);
    }
}

/// Whether code points leave open (2) what they do not have in common with sRGB. Then what else the file says
/// about its colours counts.
fn is_default(points: CodingIndependentCodePoints) -> bool {
    let (primaries, transfer) = (points.color_primaries, points.transfer_function);
    matches!((primaries, transfer), (1 | 2, 2) | (2, 13))
}

/// Whether a PNG has a description of its colours beside cICP.
fn has_other(info: &Info<'_>) -> bool {
    info.icc_profile.is_some()
        || info.srgb.is_some()
        || info.gama_chunk.is_some()
        || info.chrm_chunk.is_some()
}

/// What is said of codes for samples of limited range.
fn limited(points: CodingIndependentCodePoints, has_other: bool) -> String {
    let CodingIndependentCodePoints { color_primaries, transfer_function, .. } = points;
    let kept = match has_other {
        true => "what else it says about its colours counts",
        false => "its samples are taken as sRGB",
    };
    format!(
        "its colour space (cICP {color_primaries}/{transfer_function}/0/0, of limited range) cannot be \
         kept; {kept}"
    )
}

fn of_gamma_and_chromaticities(info: &Info<'_>, stored: &mut Stored) {
    let is_gray = stored.image.color().channel_count() < 3;
    let mut invalid = |chunk, is_valid: bool| {
        if !is_valid {
            stored.warnings.push(format!("its chunk {chunk} is invalid, and is ignored"));
        }
        is_valid
    };
    let gamma = info.gama_chunk.map(|gamma| f64::from(gamma.into_value()));
    let gamma = gamma.filter(|gamma| invalid("gAMA", GAMMAS.contains(gamma)));
    let is_srgb_gamma = gamma.is_none_or(|gamma| (gamma / SRGB_GAMMA - 1.0).abs() < SAME_GAMMA);
    let chromaticities = info.chrm_chunk.filter(|_| !is_gray).map(points);
    let chromaticities = chromaticities.filter(|points| invalid("cHRM", is_color_space(points)));
    let others = chromaticities.filter(|points| !is_srgb(points));
    match (others, gamma) {
        (None, Some(gamma)) if !is_srgb_gamma => {
            light::from_power(&mut stored.image, 1.0 / gamma);
        }
        (None, _) => {}
        (Some([white, red, green, blue]), gamma) => {
            let curve = match gamma {
                Some(gamma) => ToneReprCurve::Parametric(vec![(1.0 / gamma) as f32]),
                None => srgb_curve(),
            };
            let point = |(x, y): (f64, f64)| Chromaticity::new(x as f32, y as f32);
            let primaries =
                ColorPrimaries { red: point(red), green: point(green), blue: point(blue) };
            let white = XyY { x: white.0, y: white.1, yb: 1.0 };
            let mut profile = ColorProfile::new_srgb();
            profile.update_rgb_colorimetry(white, primaries);
            profile.red_trc = Some(curve.clone());
            profile.green_trc = Some(curve.clone());
            profile.blue_trc = Some(curve);
            let profile = cicp::named(profile, "PNG gAMA cHRM".into());
            let matrix = profile.colorant_matrix();
            if matrix.v.iter().flatten().all(|value| value.is_finite() && value.abs() < 4.0)
                && let Ok(profile) = profile.encode()
            {
                stored.metadata.icc_profile = Some(profile);
            } else {
                stored.warnings.push("its chunk cHRM is invalid, and is ignored".into());
            }
        }
    }
}

/// Whether chromaticities of white, red, green and blue are those of sRGB.
pub(super) fn is_srgb(points: &[(f64, f64); 4]) -> bool {
    points.iter().zip(SRGB).all(|(&(x, y), (u, v))| {
        (x - u).abs() <= SAME_CHROMATICITY && (y - v).abs() <= SAME_CHROMATICITY
    })
}

/// Whether red, green and blue make a triangle that the white, which is the first, is in.
fn is_color_space(&[white, red, green, blue]: &[(f64, f64); 4]) -> bool {
    let area = |a: (f64, f64), b: (f64, f64), c: (f64, f64)| {
        ((b.0 - a.0) * (c.1 - a.1) - (c.0 - a.0) * (b.1 - a.1)) / 2.0
    };
    let whole = area(red, green, blue);
    let parts = [area(white, green, blue), area(red, white, blue), area(red, green, white)];
    let has_light = [white, red, green, blue].iter().all(|point| point.1 > 0.0);
    has_light && whole.abs() > LEAST_AREA && parts.iter().all(|part| part / whole > LEAST_SHARE)
}

fn points(chromaticities: SourceChromaticities) -> [(f64, f64); 4] {
    let SourceChromaticities { white, red, green, blue } = chromaticities;
    let point = |(x, y): (png::ScaledFloat, png::ScaledFloat)| {
        (f64::from(x.into_value()), f64::from(y.into_value()))
    };
    [white, red, green, blue].map(point)
}

fn srgb_curve() -> ToneReprCurve {
    ColorProfile::new_srgb().red_trc.unwrap_or(ToneReprCurve::Parametric(vec![2.2]))
}

/// Adds the profile of Adobe RGB, which cameras name by a code in Exif in its place (DCF, 2.0).
pub(super) fn of_exif(metadata: &mut Metadata) {
    if metadata.icc_profile.is_none() && metadata.is_adobe_rgb() {
        metadata.icc_profile = ColorProfile::new_adobe_rgb().encode().ok();
    }
}
