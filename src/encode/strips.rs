//! Division of a large picture into strips.

use super::error::EncodeError;
use super::progress::Observer;
use crate::region::Region;
use crate::render::{Picture, RenderOptions};

/// Pixels of a strip for each thread. They bound the time from one poll of the observer to the next.
const STRIP_PIXELS: u32 = 1 << 17;
/// Most pixels of a strip. They bound the memory of a rendering to floats.
const MOST_STRIP_PIXELS: u32 = 1 << 20;

/// Renders the first `prefix` Gaussians of a picture, of which there are no limits, strip by strip from
/// the top, and shows every strip to `visit`: float samples, plane after plane.
///
/// # Errors
/// [`EncodeError::Cancelled`] when the caller cancels.
pub(crate) fn render(
    picture: &Picture<'_>,
    prefix: u32,
    observer: &mut Observer<'_>,
    mut visit: impl FnMut(Region, &[f32]),
) -> Result<(), EncodeError> {
    let header = picture.header();
    let mut planes = Vec::new();
    for region in strips(header.width, header.height) {
        observer.poll()?;
        planes.resize(region.pixels() as usize * header.color.channels(), 0.0);
        let options = RenderOptions::new().with_region(region).with_prefix(prefix);
        picture.render_planes(&options, &mut planes).expect("there are no limits");
        observer.poll()?;
        visit(region, &planes);
    }
    Ok(())
}

/// Size in bytes of a strip that is rendered to floats.
pub(crate) fn memory(width: u32, height: u32, channels: usize) -> usize {
    let largest = strips(width, height).next().map_or(0, |region| region.pixels());
    largest as usize * channels * size_of::<f32>()
}

/// The strips of a picture from top to bottom, each of whole rows, of which the number is even except
/// at the bottom.
pub(crate) fn strips(width: u32, height: u32) -> impl Iterator<Item = Region> {
    let threads = u32::try_from(rayon::current_num_threads()).unwrap_or(u32::MAX);
    let pixels = STRIP_PIXELS.saturating_mul(threads).min(MOST_STRIP_PIXELS);
    let rows = (pixels / width).max(2) & !1;
    let region = move |y| Region { x: 0, y, width, height: rows.min(height - y) };
    (0..height).step_by(rows as usize).map(region)
}
