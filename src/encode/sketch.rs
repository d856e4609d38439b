//! Sketches: files of so few bytes that they show no more than a small copy of the picture would.
//!
//! Gaussians are fitted to that copy. This takes a fraction of the time, and what counts to the eye is what
//! it sees at such a size. As it is chance where so few Gaussians come to rest, several fits are coded, and
//! the file that shows the best picture is kept.

use super::aim::{Aim, FileAim};
use super::error::Result;
use super::file::FileLayout;
use super::fit::budget::Budget;
use super::fit::{Fit, Work};
use super::job::Job;
use super::loss::Distortion;
use super::options::{Precision, Tune};
use super::progress::Observer;
use super::quality::Judge;
use super::rdo::{SearchWork, TargetSearch};
use super::reduced::averages;
use super::resolutions::Resolutions;
use super::source::{Source, SourceSamples};
use super::tiled_source::TiledSource;
use super::verify::{Verified, squared_error};
use crate::container::Header;
use crate::gaussian::Gaussian;
use crate::limits::Limits;
use crate::render::Picture;

// Constants: docs/tuning.md, "Sketches".
/// Most bytes of a sketch.
const MOST_BYTES: u64 = 1000;
/// Least pixels of the copy.
const LEAST_PIXELS: usize = 1 << 12;
/// By how much the copy is smaller, at least: files of smaller pictures are no sketches.
const LEAST_FACTOR: usize = 4;
/// Most pixels for a byte of a file that is compared with one of the picture itself: fewer bytes show no more of any
/// picture, and the comparison takes many times as long.
const PIXELS_PER_BYTE: usize = 1024;
/// Gaussians of a sketch take this many times the usual bits.
const MORE_BITS: f64 = 1.3;
/// Most fits that are coded.
const MOST_TRIES: u32 = 8;

/// A small copy of a picture.
#[derive(Debug)]
pub(crate) struct Sketch {
    /// By how much it is smaller, in both directions.
    factor: usize,
    size: [usize; 2],
    /// 16 bits each.
    samples: Vec<u16>,
    tiled: TiledSource,
}

/// Whether a file for this aim is too small for more than a sketch.
pub(crate) fn is_small(aim: Aim) -> bool {
    matches!(aim, Aim::File(FileAim::Size(bytes)) if bytes <= MOST_BYTES)
}

/// Whether the file of a job may be a sketch.
pub(crate) fn is_for(job: &Job<'_>) -> bool {
    let is_coded = job.precision == Precision::Entropy;
    is_coded && is_small(job.aim) && factor(job.pixels()) >= LEAST_FACTOR
}

/// Whether the picture of such a job may be so simple that its file has room for details that no sketch shows.
pub(crate) fn may_be_too_little(job: &Job<'_>) -> bool {
    let Aim::File(FileAim::Size(bytes)) = job.aim else { return false };
    bytes as usize * PIXELS_PER_BYTE >= job.pixels()
}

/// By how much the copy of a picture is smaller: a power of two.
fn factor(pixels: usize) -> usize {
    1 << ((pixels / LEAST_PIXELS).max(1).ilog2() / 2)
}

impl Sketch {
    /// That of a job for which a sketch is.
    pub(crate) fn of(job: &Job<'_>, observer: &mut Observer<'_>) -> Result<Self> {
        let factor = factor(job.pixels());
        let size = job.source.size().map(|side| side.div_ceil(factor));
        let samples = averages(job.source, factor, observer)?;
        let source = job.source.resized(size, SourceSamples::Sixteen(&samples));
        let tiled = TiledSource::new(&source, job.tune, observer)?;
        Ok(Self { factor, size, samples, tiled })
    }

    /// The picture itself by tiles, where errors count as they do in the copy.
    pub(crate) fn tiled(
        &self,
        source: &Source<'_>,
        observer: &mut Observer<'_>,
    ) -> Result<TiledSource> {
        let loss = |source: &Source<'_>| self.tiled.loss.enlarged(source, self.factor);
        TiledSource::with_loss(source, |source, _| Ok(loss(source)), observer)
    }

    /// The file that shows the best picture at the size of the copy, of several fits. `tiled` is that of
    /// [`Sketch::tiled`].
    pub(crate) fn encode(
        &self,
        job: &Job<'_>,
        budget: Budget,
        tiled: &TiledSource,
        layout: &FileLayout<'_>,
        mut work: Work,
        observer: &mut Observer<'_>,
    ) -> Result<(Vec<u8>, Work)> {
        let budget = match budget {
            Budget::Bits { bits, tune } => Budget::Bits { bits: bits / MORE_BITS, tune },
            budget => budget,
        };
        let copy = job.source.resized(self.size, SourceSamples::Sixteen(&self.samples));
        let judge = Judge::new(&copy);
        let search_work = SearchWork::new(job, 0);
        let mut search =
            TargetSearch::new(&judge, tiled, layout, search_work, observer)?.at_any_decoding_time();
        let tries = job.passes.min(MOST_TRIES);
        observer.expect(f64::from(tries) * search_work.whole());
        let mut best: Option<(f64, Vec<u8>)> = None;
        for index in 0..tries {
            let seed = job.seed.wrapping_add(u64::from(index) << 32);
            let (training, base) = (job.training, layout.base());
            let mut fit = Fit::new(
                Resolutions::single(&self.tiled),
                training,
                budget,
                job.precision,
                base,
                seed,
                work,
            );
            let (file, error) = observer.silently(|observer| {
                fit.run(job.workload(0), observer)?;
                let gaussians: Vec<_> =
                    fit.gaussians().into_iter().map(|gaussian| self.enlarged(gaussian)).collect();
                let squared = (self.factor * self.factor) as f64;
                let distortion = Distortion(squared * fit.best_error().distortion.0);
                let (coded, _) = search.run(&gaussians, distortion, job.aim, observer)?;
                let file = layout.write_entropy(&coded, observer)?;
                let error = self.error(&file, &judge, job.tune, observer)?;
                let memory = TargetSearch::memory(tiled, &gaussians) + self.memory();
                work = fit.work();
                work.peak_memory = work.peak_memory.max(memory);
                Ok((file, error))
            })?;
            observer.advance(search_work.whole())?;
            if best.as_ref().is_none_or(|&(least, _)| error < least) {
                best = Some((error, file));
            }
        }
        let (_, file) = best.expect("there is at least one try");
        Ok((file, work))
    }

    /// How much a file differs from the copy.
    fn error(
        &self,
        file: &[u8],
        judge: &Judge<'_>,
        tune: Tune,
        observer: &mut Observer<'_>,
    ) -> Result<f64> {
        let verified = Verified::new(file, judge.source(), observer)?;
        let picture = verified.picture();
        let [width, height] = self.size.map(|side| side as u32);
        let header = Header { width, height, ..picture.header().clone() };
        let gaussians: Vec<_> =
            picture.gaussians().iter().map(|gaussian| self.reduced(*gaussian)).collect();
        let limits = Limits::none();
        let picture = Picture::new(&header, &gaussians, &limits, 0);
        match tune {
            Tune::Visual => Ok(judge.judge(&picture, observer)?.worst()),
            Tune::Psnr => squared_error(&picture, judge.source(), observer),
        }
    }

    /// A Gaussian of the copy in the picture.
    fn enlarged(&self, gaussian: Gaussian) -> Gaussian {
        scaled(gaussian, self.factor as f32)
    }

    /// The reverse of [`Sketch::enlarged`].
    fn reduced(&self, gaussian: Gaussian) -> Gaussian {
        scaled(gaussian, 1.0 / self.factor as f32)
    }

    /// Size in bytes.
    fn memory(&self) -> usize {
        size_of_val(&self.samples[..]) + self.tiled.memory()
    }
}

fn scaled(Gaussian { center, cholesky, color }: Gaussian, factor: f32) -> Gaussian {
    let (center, cholesky) = (center.map(|at| at * factor), cholesky.map(|side| side * factor));
    Gaussian { center, cholesky, color }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_copy_has_about_as_many_pixels_whatever_the_picture() {
        let factors = [1, 16_383, 16_384, 65_536, 768 * 512, 6000 * 4000].map(factor);
        assert_eq!(factors, [1, 1, 2, 4, 8, 64]);
    }

    #[test]
    fn only_sizes_are_small() {
        assert!(is_small(Aim::File(FileAim::Size(MOST_BYTES))));
        assert!(!is_small(Aim::File(FileAim::Size(MOST_BYTES + 1))));
        assert!(!is_small(Aim::File(FileAim::Quality(1.0))) && !is_small(Aim::Count(1)));
    }
}
