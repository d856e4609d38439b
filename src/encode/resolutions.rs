//! A picture at several resolutions: training begins with a coarse one, at which few Gaussians need few pixels.

use super::error::Result;
use super::job::Job;
use super::progress::Observer;
use super::reduced::averages;
use super::source::{Source, SourceSamples};
use super::tiled_source::TiledSource;
use crate::color::SampleDepth;

// Constants: docs/tuning.md, "Growth".
/// Most copies.
const MOST: u32 = 3;
/// Fewest pixels of a copy.
const LEAST_PIXELS: usize = 1 << 12;
/// The least error of a fit at a copy, as a share of what the copy lacks: where the fit shows more, it learns what is
/// not in the picture. What is sharp is lost in copies that are of use for what is not.
const LEAST_SHARE: f64 = 0.5;
/// What a copy lacks is measured at one pixel of so many rows and columns, which are not a multiple of each other: what
/// repeats is met at all of its phases.
const INTERVALS: [usize; 2] = [9, 7];

/// A picture, and smaller copies of it.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Resolutions<'a> {
    pub(crate) picture: &'a TiledSource,
    /// Each has half the resolution of the one before, the first that of the picture.
    pub(crate) copies: &'a [Reduced],
}

impl<'a> Resolutions<'a> {
    /// That of the picture alone.
    pub(crate) fn single(picture: &'a TiledSource) -> Self {
        Self { picture, copies: &[] }
    }

    /// The picture with its resolution halved this often.
    pub(crate) fn halved(&self, halvings: usize) -> &'a TiledSource {
        halvings.checked_sub(1).map_or(self.picture, |copy| &self.copies[copy].tiled)
    }

    /// Size in bytes.
    pub(crate) fn memory(&self) -> usize {
        self.picture.memory() + self.copies.iter().map(|copy| copy.tiled.memory()).sum::<usize>()
    }
}

/// A copy of a picture at a lower resolution.
#[derive(Debug)]
pub(crate) struct Reduced {
    tiled: TiledSource,
    /// The mean squared error of the copy when it is enlarged, where a full sample is 1.
    error: f64,
}

impl Reduced {
    /// Whether training at the copy is of use for so many Gaussians with at least `density` pixels each, and this mean
    /// squared error.
    pub(crate) fn suits(&self, count: usize, density: u32, error: f64) -> bool {
        let has_enough = self.tiled.pixels() >= count.saturating_mul(density as usize);
        has_enough && error >= LEAST_SHARE * self.error
    }
}

/// The copies of a job's picture that training may begin with.
pub(crate) fn copies(job: &Job<'_>, observer: &mut Observer<'_>) -> Result<Vec<Reduced>> {
    let (source, mut copies) = (job.source, Vec::new());
    let most = if job.training.coarse_to_fine.is_some() { MOST } else { 0 };
    for halvings in 1..=most {
        let factor = 1 << halvings;
        let size = source.size().map(|side| side.div_ceil(factor));
        if size[0] * size[1] < LEAST_PIXELS {
            break;
        }
        let samples = averages(source, factor, observer)?;
        let eight: Vec<u8>;
        let samples = match source.depth() {
            SampleDepth::Eight => {
                let rounded = |&sample: &u16| ((u32::from(sample) + 128) / 257) as u8;
                eight = samples.iter().map(rounded).collect();
                SourceSamples::Eight(&eight)
            }
            SampleDepth::Sixteen => SourceSamples::Sixteen(&samples),
        };
        let copy = source.resized(size, samples);
        let error = error_of_enlarged(&copy, source, factor, observer)?;
        copies.push(Reduced { tiled: TiledSource::new(&copy, job.tune, observer)?, error });
    }
    Ok(copies)
}

/// The mean squared error of a copy that is enlarged by a factor, bilinearly, where a full sample is 1. Colours count as
/// they show: times alpha.
fn error_of_enlarged(
    copy: &Source<'_>,
    source: &Source<'_>,
    factor: usize,
    observer: &mut Observer<'_>,
) -> Result<f64> {
    let ([width, height], channels) = (source.size(), source.color().channels());
    let shown = |of: &Source<'_>, [x, y]: [usize; 2]| {
        let pixel = (y * of.size()[0] + x) * channels;
        let sample = |channel| f64::from(of.wide_sample(pixel + channel)) / 65_535.0;
        let alpha = if source.is_premultiplied() { sample(channels - 1) } else { 1.0 };
        let scale = move |channel| if channel + 1 < channels { alpha } else { 1.0 };
        [0, 1, 2, 3].map(|at| if at < channels { scale(at) * sample(at) } else { 0.0 })
    };
    // The two columns or rows of the copy about that of a pixel, and the weight of the second.
    let about = |at: usize, side: usize| {
        let at = ((at as f64 + 0.5) / factor as f64 - 0.5).clamp(0.0, (side - 1) as f64);
        (at as usize, (at as usize + 1).min(side - 1), at.fract())
    };
    let [columns, rows] = INTERVALS;
    let sums = observer.map(0..height.div_ceil(rows), |row| {
        let y = row * rows;
        let (above, below, down) = about(y, copy.size()[1]);
        let mut sum = 0.0;
        for x in (row % columns..width).step_by(columns) {
            let (left, right, along) = about(x, copy.size()[0]);
            let [a, b] = [above, below].map(|y| [shown(copy, [left, y]), shown(copy, [right, y])]);
            let expected = shown(source, [x, y]);
            for channel in 0..channels {
                let between = |[from, to]: [[f64; 4]; 2]| {
                    from[channel] + along * (to[channel] - from[channel])
                };
                let enlarged = between(a) + down * (between(b) - between(a));
                sum += (enlarged - expected[channel]).powi(2);
            }
        }
        let count = width.saturating_sub(row % columns).div_ceil(columns) * channels;
        (sum, count)
    })?;
    let (sum, count) = sums.iter().fold((0.0, 0), |all, row| (all.0 + row.0, all.1 + row.1));
    Ok(sum / count.max(1) as f64)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::color::ColorModel;
    use crate::encode::options::Tune;
    use crate::encode::progress::unobserved;
    use crate::encode::testing::source;

    /// The error of a copy of half the resolution of a picture of 64 x 64 pixels.
    fn error(color: ColorModel, pixel: impl Fn(usize, usize) -> [u8; 2]) -> f64 {
        let channels = color.channels();
        let samples: Vec<u8> = (0..64 * 64)
            .flat_map(|index| pixel(index % 64, index / 64).into_iter().take(channels))
            .collect();
        let source = source([64, 64], color, &samples);
        unobserved(|observer| {
            let samples = averages(&source, 2, observer)?;
            let copy = source.resized([32, 32], SourceSamples::Sixteen(&samples));
            error_of_enlarged(&copy, &source, 2, observer)
        })
    }

    fn checkers(side: usize) -> f64 {
        error(ColorModel::Gray, |x, y| [255 * ((x / side + y / side) % 2) as u8, 0])
    }

    #[test]
    fn a_copy_lacks_what_is_sharp() {
        assert!((checkers(1) - 0.25).abs() < 1e-4);
        // The copy has all of their contrast, but not their edges.
        let large = [checkers(2), checkers(8), checkers(16)];
        assert!(large[0] < 0.25 && large[1] < large[0] && large[2] < large[1], "{large:?}");
        assert!(large[2] > 0.005, "{large:?}");
        let ramp = error(ColorModel::Gray, |x, y| [(2 * x + y) as u8, 0]);
        assert!(ramp < 1e-5, "{ramp}");
    }

    #[test]
    fn what_is_transparent_is_not_lacked() {
        let hidden =
            |alpha| error(ColorModel::GrayAlpha, |x, y| [255 * ((x + y) % 2) as u8, alpha]);
        assert_eq!(hidden(0), 0.0);
        assert!((hidden(255) - 0.125).abs() < 1e-4);
    }

    #[test]
    fn a_copy_is_of_use_for_few_gaussians_and_a_large_error() {
        let samples = [128; 64 * 64];
        let source = source([64, 64], ColorModel::Gray, &samples);
        let tiled = unobserved(|observer| TiledSource::new(&source, Tune::Psnr, observer));
        let copy = Reduced { tiled, error: 0.01 };
        assert!(copy.suits(256, 16, 0.005) && copy.suits(0, 16, 1.0));
        assert!(!copy.suits(257, 16, 0.005) && !copy.suits(256, 16, 0.0049));
    }
}
