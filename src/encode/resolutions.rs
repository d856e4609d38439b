//! A picture at several resolutions: training begins with a coarse one, at which few Gaussians need few pixels.

use super::error::Result;
use super::job::Job;
use super::progress::Observer;
use super::reduced::averages;
use super::source::SourceSamples;
use super::tiled_source::TiledSource;
use crate::color::SampleDepth;

// Constants: docs/tuning.md, "Growth".
/// Most copies.
const MOST: u32 = 3;
/// Fewest pixels of a copy.
const LEAST_PIXELS: usize = 1 << 12;

/// A picture, and smaller copies of it.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Resolutions<'a> {
    pub(crate) picture: &'a TiledSource,
    /// Each has half the resolution of the one before, the first that of the picture.
    pub(crate) copies: &'a [TiledSource],
}

impl<'a> Resolutions<'a> {
    /// That of the picture alone.
    pub(crate) fn single(picture: &'a TiledSource) -> Self {
        Self { picture, copies: &[] }
    }

    /// The picture with its resolution halved this often.
    pub(crate) fn halved(&self, halvings: usize) -> &'a TiledSource {
        halvings.checked_sub(1).map_or(self.picture, |copy| &self.copies[copy])
    }

    /// Size in bytes.
    pub(crate) fn memory(&self) -> usize {
        self.picture.memory() + self.copies.iter().map(TiledSource::memory).sum::<usize>()
    }
}

/// The copies of a job's picture that training may begin with.
pub(crate) fn copies(job: &Job<'_>, observer: &mut Observer<'_>) -> Result<Vec<TiledSource>> {
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
        copies.push(TiledSource::new(&source.resized(size, samples), job.tune, observer)?);
    }
    Ok(copies)
}
