//! What the header of a BMP says that its decoder does not.

use super::colors;
use super::square::Density;
use super::stored::Stored;
use crate::picture::DAMAGED_PROFILE;

/// Where the header begins, which begins with its length, and where the densities are.
const HEADER: usize = 14;
const DENSITY: usize = HEADER + 24;
/// Where the kind of the colour space is, the XYZ of its primaries with 30 bits after the point and its gammas
/// with 16, and the place in the header and the length of a profile.
const KIND: usize = HEADER + 56;
const PRIMARIES: usize = HEADER + 60;
const GAMMAS: usize = HEADER + 96;
const PROFILE: usize = HEADER + 112;
/// The least lengths of a header with these.
const WITH_DENSITY: u32 = 40;
const WITH_PRIMARIES: u32 = 108;
const WITH_PROFILE: u32 = 124;

/// Kinds of colour spaces: by primaries and gammas, by a profile in the file, and by one in another.
const CALIBRATED: u32 = 0;
const EMBEDDED: u32 = u32::from_be_bytes(*b"MBED");
const LINKED: u32 = u32::from_be_bytes(*b"LINK");
/// The gamma that stands for sRGB, and how far others that do may be from it.
const SRGB_GAMMA: f64 = 2.2;
const SAME_GAMMA: f64 = 0.05;

pub(super) fn density(file: &[u8]) -> Option<Density> {
    let density = |at: usize| Some(f64::from(number(file, at)?.cast_signed()));
    let has_density = number(file, HEADER)? >= WITH_DENSITY;
    has_density.then(|| density(DENSITY).zip(density(DENSITY + 4)))?
}

/// Keeps the profile, or tells what cannot be kept.
pub(super) fn colors(file: &[u8], stored: &mut Stored) {
    let length = number(file, HEADER).unwrap_or(0);
    match number(file, KIND) {
        Some(EMBEDDED) if length >= WITH_PROFILE => {
            stored.metadata.icc_profile = profile(file).map(<[u8]>::to_vec);
            if stored.metadata.icc_profile.is_none() {
                stored.warnings.push(DAMAGED_PROFILE.into());
            }
        }
        Some(LINKED) if length >= WITH_PROFILE => {
            stored.warnings.push("its ICC profile is in another file and cannot be kept".into());
        }
        Some(CALIBRATED) if length >= WITH_PRIMARIES && is_other_than_srgb(file) == Some(true) => {
            let lost = "its primaries and gammas cannot be kept, and are taken as sRGB's";
            stored.warnings.push(lost.into());
        }
        _ => {}
    }
}

fn profile(file: &[u8]) -> Option<&[u8]> {
    let start = HEADER.checked_add(number(file, PROFILE)? as usize)?;
    file.get(start..start.checked_add(number(file, PROFILE + 4)? as usize)?)
}

/// Whether primaries and gammas are those of another colour space. Many files have zeros in their place, and
/// none has a white.
fn is_other_than_srgb(file: &[u8]) -> Option<bool> {
    let fixed = |at: usize, bits: i32| Some(f64::from(number(file, at)?) / 2_f64.powi(bits));
    let mut points = colors::SRGB;
    for (index, point) in points.iter_mut().skip(1).enumerate() {
        let at = PRIMARIES + 12 * index;
        let [x, y, z] = [fixed(at, 30)?, fixed(at + 4, 30)?, fixed(at + 8, 30)?];
        let sum = x + y + z;
        if sum > 0.0 {
            *point = (x / sum, y / sum);
        }
    }
    let mut is_other = !colors::is_srgb(&points);
    for index in 0..3 {
        let gamma = fixed(GAMMAS + 4 * index, 16)?;
        is_other |= gamma > 0.0 && (gamma / SRGB_GAMMA - 1.0).abs() > SAME_GAMMA;
    }
    Some(is_other)
}

fn number(file: &[u8], at: usize) -> Option<u32> {
    Some(u32::from_le_bytes(*file.get(at..)?.first_chunk()?))
}
