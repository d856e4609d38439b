//! Whether pixels are square, as those of .gip are.

use image_gip::Orientation;

/// Pixels per unit across and down, in any unit.
pub(super) type Density = (f64, f64);

/// By how much, relative to the other side, pixels that are meant to be square differ: files have densities
/// in whole numbers.
const SAME: f64 = 0.01;
/// Where GIF has the ratio.
const GIF_RATIO: usize = 12;

/// What is said of pixels that are not square, of a picture that is turned like this. Densities that are no
/// positive numbers mean nothing.
pub(super) fn warning(density: Density, orientation: Orientation) -> Option<String> {
    let (across, down) = density;
    let is_turned = orientation.turned_size(1, 2) == (2, 1);
    let width = if is_turned { across / down } else { down / across };
    let ratio = width.max(width.recip());
    if !(across > 0.0 && down > 0.0 && ratio.is_finite() && ratio > 1.0 + SAME) {
        return None;
    }
    let (more, less) = if width > 1.0 { ("wide", "high") } else { ("high", "wide") };
    let ratio = (ratio * 1000.0).round() / 1000.0;
    Some(format!("its pixels, which are {ratio} times as {more} as {less}, are taken as square"))
}

pub(super) fn of_png(info: &png::Info<'_>) -> Option<Density> {
    info.pixel_dims.map(|density| (density.xppu.into(), density.yppu.into()))
}

/// A GIF has width by height, in steps that begin with a fourth.
pub(super) fn of_gif(file: &[u8]) -> Option<Density> {
    let ratio = *file.get(GIF_RATIO)?;
    (ratio != 0).then(|| (64.0, f64::from(ratio) + 15.0))
}
