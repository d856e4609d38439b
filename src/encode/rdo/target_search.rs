//! The search for the codes with which a file meets its target.

use super::code_optimizer::CodeOptimizer;
use super::search_work::{MOST_PASSES, SearchWork};
use super::step_search::{Aim, StepSearch};
use crate::coding::entropy::LatticeCodes;
use crate::encode::error::EncodeError;
use crate::encode::file::FileLayout;
use crate::encode::options::Target;
use crate::encode::progress::Observer;
use crate::encode::quality::Judge;
use crate::encode::raster::Raster;
use crate::encode::rate_model;
use crate::encode::source::Source;
use crate::encode::verify::Verified;
use crate::gaussian::Gaussian;

/// Most steps that are tried: by rounding alone, after the first passes of coordinate descent, and after
/// all passes.
const MOST_ROUNDING_TRIES: u32 = 8;
const MOST_FIRST_TRIES: u32 = 4;
const MOST_TRIES: u32 = 4;
/// With at most this deviation, a base-2 logarithm, a step is worth more passes.
const CLOSE: f64 = 0.02;
/// By how much the size falls between rounding and the last pass, and size and error between the first
/// pass and the last, as base-2 logarithms.
const SETTLING_OF_ROUNDED: f64 = 0.12;
const SETTLING: f64 = 0.045;
/// The deviation of a file that decodes to an exact copy, which has no finite PSNR.
const LARGEST_DEVIATION: f64 = 10.0;
/// By how much lambda may change to meet a target, as a base-2 logarithm.
const MOST_LAMBDA_CHANGE: f64 = 1.0;
/// Refinements of the step, one after the other, where the search does not reach the PSNR; base-2
/// logarithms.
const FINER: [f64; 4] = [0.5, 0.5, 1.0, 2.0];
/// The finest step that is tried, as the base-2 logarithm of its ratio to the step that suits the fit's
/// error. There, rounding adds a 256th of the error that it adds with that step: a finer one would only
/// make the file larger.
const FINEST: f64 = -4.0;
/// How often a file that exceeds its PSNR is tried with fewer Gaussians.
const MOST_TRIMMINGS: u32 = 32;

/// Rate-distortion optimisation of a fit's codes for a target.
#[derive(Debug)]
pub(crate) struct TargetSearch<'a> {
    source: &'a Source<'a>,
    raster: &'a Raster,
    judge: &'a Judge,
    layout: &'a FileLayout<'a>,
    /// How many passes there shall be, and what they cost; for a target there may be a few more.
    work: SearchWork,
    codes: CodeOptimizer<'a>,
}

impl<'a> TargetSearch<'a> {
    pub(crate) fn new(
        source: &'a Source<'a>,
        raster: &'a Raster,
        judge: &'a Judge,
        layout: &'a FileLayout<'a>,
        work: SearchWork,
    ) -> Self {
        Self { source, raster, judge, layout, work, codes: CodeOptimizer::new(raster, layout) }
    }

    /// The codes of `gaussians`, whose rendering has this distortion, for a target.
    pub(crate) fn run(
        &self,
        gaussians: &[Gaussian],
        distortion: f64,
        target: Target,
        observer: &mut Observer<'_>,
    ) -> Result<LatticeCodes, EncodeError> {
        let step = match target {
            Target::Lambda(lambda) => rate_model::step_for_lambda(lambda),
            _ => rate_model::step_for(distortion, gaussians.len()),
        };
        observer.expect(self.work.whole());
        let Some(aim) = Aim::new(target, self.raster.pixels()) else {
            let mut coded = self.codes.rounded(gaussians, step, observer)?;
            self.codes.descend(&mut coded, 0.0, 0..self.work.passes, observer)?;
            return Ok(coded);
        };
        let finest = step + FINEST;
        let step = self.first_step(gaussians, step, finest, aim, observer)?;
        let (mut coded, mut deviation, step) =
            self.aimed(gaussians, step, finest, aim, observer)?;
        if let Some(bytes) = target.bytes(self.raster.pixels()) {
            self.shorten(&mut coded, bytes, observer)?;
            return Ok(coded);
        }
        if aim.miss(deviation) > 0.0 {
            // With few Gaussians the PSNR jumps from step to step, but it rises as steps get finer.
            let mut finer = step;
            for change in FINER {
                finer -= change;
                if deviation <= 0.0 || finer < finest {
                    break;
                }
                (coded, deviation) =
                    self.passed(gaussians, finer, self.work.passes, aim, observer)?;
            }
        }
        self.trim(coded, deviation, aim, observer)
    }

    /// The codes that come nearest to an aim, their deviation from it, and the step that would be tried
    /// next; `step` is the first.
    fn aimed(
        &self,
        gaussians: &[Gaussian],
        step: f64,
        finest: f64,
        aim: Aim,
        observer: &mut Observer<'_>,
    ) -> Result<(LatticeCodes, f64, f64), EncodeError> {
        let passes = self.work.first_passes();
        let mut settling = SETTLING / f64::from(passes);
        let mut search = StepSearch::new(step, aim.by_step(), finest);
        let mut first_try = self.passed(gaussians, search.at, passes, aim, observer)?;
        for _ in 1..MOST_FIRST_TRIES {
            let expected = first_try.1 - settling;
            if expected.abs() < CLOSE || search.is_exhausted(expected) {
                break;
            }
            search.tell(expected);
            observer.expect(self.work.first_try() + self.work.later_tries());
            first_try = self.passed(gaussians, search.at, passes, aim, observer)?;
        }
        observer.expect(self.work.later_tries());
        let mut search = StepSearch::new(search.at, aim.by_step(), finest);
        let mut first_try = Some(first_try);
        let mut best: Option<(LatticeCodes, f64)> = None;
        for _ in 0..MOST_TRIES {
            let (mut coded, before) = match first_try.take() {
                Some(first_try) => first_try,
                None => {
                    observer.expect(self.work.one_more_try());
                    self.passed(gaussians, search.at, passes, aim, observer)?
                }
            };
            // A target that is out of reach gets no more passes than an encoding without target.
            let exhausted = search.is_exhausted(before - settling);
            let most = if exhausted { self.work.passes } else { MOST_PASSES };
            let (deviation, lambda) =
                self.adjust_lambda(&mut coded, before, settling, most, aim, observer)?;
            if best.as_ref().is_none_or(|(_, least)| aim.miss(deviation) < aim.miss(*least)) {
                best = Some((coded, deviation));
            }
            if aim.miss(deviation) == 0.0 || exhausted {
                break;
            }
            // Now it is known by how much the deviation falls after the first passes.
            let with_usual_lambda = deviation - lambda * aim.by_lambda();
            settling = before - with_usual_lambda;
            search.tell(with_usual_lambda);
        }
        let (coded, deviation) = best.expect("at least one was tried");
        Ok((coded, deviation, search.at))
    }

    /// The first step to try. Rounding alone nearly tells the size of a file.
    fn first_step(
        &self,
        gaussians: &[Gaussian],
        step: f64,
        finest: f64,
        aim: Aim,
        observer: &mut Observer<'_>,
    ) -> Result<f64, EncodeError> {
        let mut search = StepSearch::new(step, aim.by_step(), finest);
        if !matches!(aim, Aim::Size { .. }) {
            return Ok(search.at);
        }
        for _ in 0..MOST_ROUNDING_TRIES {
            let mut coded = self.codes.rounded(gaussians, search.at, observer)?;
            self.codes.written(&mut coded, observer)?;
            let deviation = self.deviation(&coded, aim, observer)? - SETTLING_OF_ROUNDED;
            if search.is_exhausted(deviation) {
                break;
            }
            search.tell(deviation);
            if deviation.abs() < CLOSE {
                break;
            }
        }
        Ok(search.at)
    }

    /// The codes of a step after some passes, and their deviation from an aim.
    fn passed(
        &self,
        gaussians: &[Gaussian],
        step: f64,
        passes: u32,
        aim: Aim,
        observer: &mut Observer<'_>,
    ) -> Result<(LatticeCodes, f64), EncodeError> {
        let mut coded = self.codes.rounded(gaussians, step, observer)?;
        self.codes.descend(&mut coded, 0.0, 0..passes, observer)?;
        let deviation = self.deviation(&coded, aim, observer)?;
        Ok((coded, deviation))
    }

    /// Adjusts lambda from pass to pass, in `most` passes, so that codes after their first passes, which
    /// deviate by `deviation`, come as near to an aim as lambda can bring them; without that, passes
    /// lower the deviation by `settling`. Returns the deviation then, and the base-2 logarithm of what
    /// lambda was multiplied by.
    fn adjust_lambda(
        &self,
        coded: &mut LatticeCodes,
        mut deviation: f64,
        settling: f64,
        most: u32,
        aim: Aim,
        observer: &mut Observer<'_>,
    ) -> Result<(f64, f64), EncodeError> {
        let first = self.work.first_passes();
        let mut lambda: f64 = 0.0;
        for pass in first..most {
            if pass >= self.work.passes && aim.miss(deviation) == 0.0 {
                break;
            }
            let expected = deviation - settling * f64::from(first) / f64::from(pass);
            lambda -= (expected / aim.by_lambda()).clamp(-0.5, 0.5);
            lambda = lambda.clamp(-MOST_LAMBDA_CHANGE, MOST_LAMBDA_CHANGE);
            self.codes.descend(coded, lambda, pass..pass + 1, observer)?;
            deviation = self.deviation(coded, aim, observer)?;
        }
        Ok((deviation, lambda))
    }

    /// The deviation from an aim.
    fn deviation(
        &self,
        coded: &LatticeCodes,
        aim: Aim,
        observer: &mut Observer<'_>,
    ) -> Result<f64, EncodeError> {
        let file = self.layout.write_entropy(coded, observer)?;
        let deviation = match aim {
            Aim::Size { most } => (file.len() as f64 / most).log2(),
            Aim::Psnr(psnr) => {
                let verified = Verified::new(&file, self.source, observer)?;
                let reached = verified.distortion(verified.gaussians(), observer)?.psnr;
                ((psnr - reached) * 0.1 * 10_f64.log2()).max(-LARGEST_DEVIATION)
            }
            Aim::Dissimilarity(dissimilarity) => {
                let verified = Verified::new(&file, self.source, observer)?;
                let reached = self.judge.dissimilarity(&verified.picture(), observer)?;
                (reached / dissimilarity).log2().max(-LARGEST_DEVIATION)
            }
        };
        observer.advance(self.work.comparison())?;
        Ok(deviation)
    }

    /// Removes the weakest Gaussians until the file has at most so many bytes.
    fn shorten(
        &self,
        coded: &mut LatticeCodes,
        bytes: u64,
        observer: &mut Observer<'_>,
    ) -> Result<(), EncodeError> {
        loop {
            let size = self.layout.write_entropy(coded, observer)?.len() as u64;
            let Some(excess) = size.checked_sub(bytes).filter(|&excess| excess > 0) else {
                return Ok(());
            };
            // Four bytes a Gaussian, and at least one.
            let count = excess.div_ceil(4).min(coded.codes.len() as u64) as usize;
            coded.codes.sort_by_key(|code| core::cmp::Reverse(code.strength()));
            coded.codes.truncate(coded.codes.len() - count);
        }
    }

    /// Removes the weakest Gaussians of a picture that is too good, as many as can be spared.
    fn trim(
        &self,
        mut coded: LatticeCodes,
        mut deviation: f64,
        aim: Aim,
        observer: &mut Observer<'_>,
    ) -> Result<LatticeCodes, EncodeError> {
        if deviation > 0.0 || aim.miss(deviation) == 0.0 {
            return Ok(coded);
        }
        coded.codes.sort_by_key(|code| core::cmp::Reverse(code.strength()));
        // Those from `end` on cannot be spared, and likely not many more at a time.
        let mut end = coded.codes.len();
        let mut portion = end.div_ceil(2);
        for _ in 0..MOST_TRIMMINGS {
            let mut fewer = coded.clone();
            let start = end.saturating_sub(portion);
            fewer.codes.drain(start..end);
            let deviation_with_fewer = self.deviation(&fewer, aim, observer)?;
            if deviation_with_fewer <= 0.0 {
                (coded, deviation, end) = (fewer, deviation_with_fewer, start);
            } else if portion > 1 {
                portion /= 2;
            } else {
                end -= 1;
            }
            if end == 0 || aim.miss(deviation) == 0.0 {
                break;
            }
        }
        Ok(coded)
    }
}
