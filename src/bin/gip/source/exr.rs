//! What of an OpenEXR file is lost.

use std::io::Cursor;

use exr::meta::MetaData;
use exr::meta::header::Header;
use image_gip::Orientation;

use super::stored::left_out;
use super::{colors, square};

/// The channels that are taken, but for alpha.
const COLORS: [&str; 3] = ["R", "G", "B"];

/// What its header has and the picture lacks.
pub(super) fn lost(file: &[u8]) -> Vec<String> {
    let meta = MetaData::read_from_buffered(Cursor::new(file), false);
    let headers = meta.map(|meta| meta.headers).unwrap_or_default();
    let layers = headers.len();
    let layers =
        (layers > 1).then(|| format!("only the first of its {layers} layers that is RGB is taken"));
    let mut lost: Vec<_> = layers.into_iter().collect();
    // As in `image`, the first that has these is taken.
    let count = |header: &Header, names: &[&str]| {
        let channels = header.channels.list.iter();
        channels.filter(|channel| names.iter().any(|name| channel.name.eq(name))).count()
    };
    let Some(header) = headers.iter().find(|header| !header.deep && count(header, &COLORS) == 3)
    else {
        return lost;
    };
    let all = header.channels.list.len();
    lost.extend(left_out(all - 3 - count(header, &["A"]), all));
    let attributes = &header.shared_attributes;
    if let Some(found) = attributes.chromaticities {
        let points = [found.white, found.red, found.green, found.blue];
        let points = points.map(|exr::math::Vec2(x, y)| (f64::from(x), f64::from(y)));
        if !colors::is_srgb(&points) {
            lost.push(
                "its primaries (chromaticities) cannot be kept, and are taken as sRGB's".into(),
            );
        }
    }
    let density = (1.0, f64::from(attributes.pixel_aspect));
    lost.extend(square::warning(density, Orientation::NoTransforms));
    lost
}
