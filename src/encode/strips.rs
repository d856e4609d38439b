//! Division of a large picture into strips.

use super::error::Result;
use super::progress::Observer;
use crate::region::Region;
use crate::render::{BAND_HEIGHT, Picture, RenderOptions};

// Constants: docs/tuning.md, "Search for a target".
/// Pixels of a strip per thread, unless [`BANDS`] bands have more. The size of a strip bounds the memory of a
/// rendering to floats, and the time between two polls of the observer.
const PIXELS: usize = 3 << 14;
/// Least number of bands of a strip per thread: with one, threads would wait for the slowest.
const BANDS: usize = 2;
/// Most pixels of a strip, unless a band has more.
const MOST_PIXELS: usize = 1 << 21;

/// Renders the first `prefix` Gaussians of a picture, without its texture, strip by strip from the top, and hands
/// every strip to `visit`: float samples, plane after plane. The number of rows of a strip is a multiple of
/// [`BAND_HEIGHT`], except at the bottom. The picture must have no [`Limits`](crate::Limits).
pub(crate) fn render(
    picture: &Picture<'_>,
    prefix: u32,
    observer: &mut Observer<'_>,
    mut visit: impl FnMut(Region, &[f32]),
) -> Result<()> {
    observer.poll()?;
    let options = RenderOptions::new().with_prefix(prefix).with_texture(false);
    picture.render_strips(&options, bands(picture.header().width), |region, planes| {
        observer.poll()?;
        visit(region, planes);
        observer.poll()
    })
}

/// Size in bytes of a strip that is rendered to floats.
pub(crate) fn memory(width: u32, height: u32, channels: usize) -> usize {
    rows(width, height) * width as usize * channels * size_of::<f32>()
}

/// Number of rows of a strip.
pub(crate) fn rows(width: u32, height: u32) -> usize {
    (bands(width) * BAND_HEIGHT).min(height as usize)
}

/// Number of bands of a strip.
fn bands(width: u32) -> usize {
    let pixels = width as usize * BAND_HEIGHT;
    let for_all = rayon::current_num_threads() * (PIXELS / pixels).max(BANDS);
    for_all.min(MOST_PIXELS / pixels).max(1)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::color::ColorModel;
    use crate::encode::progress::unobserved;
    use crate::encode::testing::source;
    use crate::encode::{Encoder, Target};
    use crate::{StreamDecoder, Threads};

    #[test]
    fn strips_make_the_picture() {
        let (width, height) = (70, 5 * BAND_HEIGHT as u32 + 3);
        let mut rng = fastrand::Rng::with_seed(8);
        let samples: Vec<u8> = (0..width * height * 3).map(|_| rng.u8(..)).collect();
        let source = source([width, height].map(|side| side as usize), ColorModel::Rgb, &samples);
        let encoder = Encoder::new().with_effort(1).with_target(Target::Gaussians(300));
        let encoded = encoder.with_threads(Threads::One).encode(&source).expect("no target");
        let mut stream = StreamDecoder::new();
        stream.feed(&encoded.bytes).expect("a sound file");
        let picture = stream.picture().expect("the header was read");
        for prefix in [100, u32::MAX] {
            let options = RenderOptions::new().with_prefix(prefix);
            let mut whole = vec![0.0; samples.len()];
            picture.render_planes(&options, &mut whole).expect("a small picture");
            let pixels = (width * height) as usize;
            for bands in [1, 2, 9] {
                let mut next = 0;
                let shown =
                    picture.render_strips(&options, bands, |region, planes| -> Result<()> {
                        assert_eq!(region.y, next);
                        next += region.height;
                        let count = region.pixels() as usize;
                        for (channel, plane) in planes.chunks_exact(count).enumerate() {
                            let at = channel * pixels + (region.y * width) as usize;
                            assert_eq!(plane, &whole[at..][..count], "{bands} bands, {channel}");
                        }
                        Ok(())
                    });
                assert!(shown.is_ok() && next == height, "{bands} bands: {next} rows");
            }
            unobserved(|observer| {
                render(&picture, prefix, observer, |region, planes| {
                    let at = (region.y * width) as usize;
                    assert_eq!(planes[0], whole[at]);
                })
            });
        }
    }
}
