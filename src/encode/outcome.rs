//! A finished encoding, and which of two is better.

use super::aim::{Aim, FileAim};
use super::error::Result;
use super::file::FileLayout;
use super::fit::Work;
use super::job::Job;
use super::options::Tune;
use super::progress::Observer;
use super::quality::{self, Judge};
use super::shortfall::{Reached, Shortfall};
use super::verify::{FilePsnr, TextureCost, Verified};

// Constants: docs/tuning.md, "Search for a target".
/// What twice the size must bring, in dB or in points of quality.
pub(crate) const LEAST_GAIN: f64 = 0.5;
const LEAST_POINTS: f64 = 1.0;
/// Files that differ by less, in doublings, are of the same size.
const SAME_SIZE: f64 = 0.1;

/// A finished encoding, verified.
#[derive(Debug)]
pub(crate) struct Outcome {
    pub(crate) file: Vec<u8>,
    pub(crate) work: Work,
    pub(crate) gaussians: u32,
    pub(crate) psnr: FilePsnr,
    /// The visual quality, from 0 to 100.
    pub(crate) quality: f64,
    pub(crate) texture: TextureCost,
    pub(crate) shortfall: Option<Shortfall>,
    /// Whether most of the error is that of codes of fixed depths.
    pub(crate) is_lost_to_rounding: bool,
}

impl Outcome {
    /// That of a file for a job whose aim was `asked`: decodes it to tell what it shows.
    pub(crate) fn of(
        file: Vec<u8>,
        mut work: Work,
        job: &Job<'_>,
        asked: Aim,
        judge: &Judge<'_>,
        layout: &FileLayout<'_>,
        observer: &mut Observer<'_>,
    ) -> Result<Self> {
        let source = job.source;
        let verified = Verified::within(&file, source, job.limits, observer)?;
        let (gaussians, texture) = (verified.gaussians(), verified.texture());
        observer.expect(job.workload(gaussians as usize).verification());
        let (psnr, verdict) = verified.judged(judge, observer)?;
        work.peak_memory = work.peak_memory.max(quality::memory(source));
        // The estimate of an exact copy would have rounding errors.
        let is_exact = psnr.rounded == f64::INFINITY;
        let quality = if is_exact { 100.0 } else { verdict.quality() };
        let exact_psnr = 10.0 * (12.0 * f64::from(source.depth().max_sample()).powi(2)).log10();
        let reached = Reached {
            bytes: file.len(),
            metadata: layout.metadata_length(),
            psnr: psnr.rounded,
            exact_psnr,
            quality,
            verdict,
            gaussians,
        };
        let shortfall = asked.of_file().and_then(|aim| Shortfall::of(aim, reached));
        let is_lost_to_rounding = false;
        Ok(Self { file, work, gaussians, psnr, quality, texture, shortfall, is_lost_to_rounding })
    }

    /// Whether this file is better than another one for an aim: the smaller one of two that reach a PSNR or a
    /// quality, else the one that shows the better picture.
    pub(crate) fn is_better_than(&self, other: &Self, aim: Aim, tune: Tune) -> bool {
        let shows_more = |by_quality: bool| {
            let [mine, others] = [self, other].map(|outcome| {
                let (quality, psnr) = (outcome.quality, outcome.psnr.rounded);
                if by_quality { [quality, psnr] } else { [psnr, quality] }
            });
            mine > others
        };
        match aim {
            // Size and error are weighed against each other, which the error alone does not tell.
            Aim::Lambda(_) => false,
            Aim::Count(_) | Aim::File(FileAim::Size(_)) => {
                shows_more(tune == Tune::Visual) && self.is_worth_its_size(other)
            }
            Aim::File(aim) => match (self.is_short(), other.is_short()) {
                (false, false) => self.file.len() < other.file.len(),
                (true, true) => shows_more(matches!(aim, FileAim::Quality(_))),
                (is_short, _) => !is_short,
            },
        }
    }

    /// Whether it is not much larger than another one, or so much better.
    fn is_worth_its_size(&self, other: &Self) -> bool {
        let doublings = self.doublings(other);
        doublings < SAME_SIZE
            || self.gain(other) >= LEAST_GAIN * doublings
            || self.quality - other.quality >= LEAST_POINTS * doublings
    }

    /// The base-2 logarithm of the ratio of its size to that of another one.
    pub(crate) fn doublings(&self, other: &Self) -> f64 {
        (self.file.len() as f64 / other.file.len() as f64).log2()
    }

    /// By how many dB its PSNR is higher than that of another one.
    pub(crate) fn gain(&self, other: &Self) -> f64 {
        self.psnr.rounded - other.psnr.rounded
    }

    /// Whether it does not reach its PSNR or quality.
    fn is_short(&self) -> bool {
        let shortfall = self.shortfall;
        matches!(shortfall, Some(Shortfall::PsnrBelow { .. } | Shortfall::QualityBelow { .. }))
    }
}
