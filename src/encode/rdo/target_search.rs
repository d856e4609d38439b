//! The search for the codes with which a file meets its target.

use super::code_optimizer::{CodeOptimizer, Optimized};
use super::step_search::{Aim, StepSearch};
use crate::coding::entropy::LatticeCodes;
use crate::encode::error::EncodeError;
use crate::encode::file::{CodedLayers, FileLayout};
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
/// Most passes of coordinate descent until a target is met.
const MOST_PASSES: u32 = 12;
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
    /// Passes of coordinate descent; for a target there may be a few more.
    passes: u32,
    codes: CodeOptimizer<'a>,
}

impl<'a> TargetSearch<'a> {
    pub(crate) fn new(
        source: &'a Source<'a>,
        raster: &'a Raster,
        judge: &'a Judge,
        layout: &'a FileLayout<'a>,
        passes: u32,
    ) -> Self {
        Self { source, raster, judge, layout, passes, codes: CodeOptimizer::new(raster, layout) }
    }

    /// The codes of `gaussians`, whose rendering has this distortion, for a target.
    pub(crate) fn run(
        &mut self,
        gaussians: &[Gaussian],
        distortion: f64,
        target: Target,
        observer: &mut Observer<'_>,
    ) -> Result<CodedLayers, EncodeError> {
        let step = match target {
            Target::Lambda(lambda) => rate_model::step_for_lambda(lambda),
            _ => rate_model::step_for(distortion, gaussians.len()),
        };
        let Some(aim) = Aim::new(target, self.raster.pixels()) else {
            return Ok(self.descended(gaussians, step, self.passes, observer)?.coded);
        };
        let finest = step + FINEST;
        let step = self.first_step(gaussians, step, finest, aim, observer)?;
        let (mut coded, mut deviation, step) =
            self.aimed(gaussians, step, finest, aim, observer)?;
        if let Some(bytes) = target.bytes(self.raster.pixels()) {
            return self.shortened(coded, bytes, observer);
        }
        if aim.miss(deviation) > 0.0 {
            // With few Gaussians the PSNR jumps from step to step, but it rises as steps get finer.
            let mut finer = step;
            for change in FINER {
                finer -= change;
                if deviation <= 0.0 || finer < finest {
                    break;
                }
                (coded, deviation) = self.passed(gaussians, finer, self.passes, aim, observer)?;
            }
        }
        self.trimmed(coded, deviation, aim, observer)
    }

    /// The codes that come nearest to an aim, their deviation from it, and the step that would be tried
    /// next; `step` is the first.
    fn aimed(
        &mut self,
        gaussians: &[Gaussian],
        step: f64,
        finest: f64,
        aim: Aim,
        observer: &mut Observer<'_>,
    ) -> Result<(Optimized, f64, f64), EncodeError> {
        let passes = self.first_passes();
        let mut settling = SETTLING / f64::from(passes);
        let mut search = StepSearch::new(step, aim.by_step(), finest);
        let mut first_try = self.passed(gaussians, search.at, passes, aim, observer)?;
        for _ in 1..MOST_FIRST_TRIES {
            let expected = first_try.1 - settling;
            if expected.abs() < CLOSE || search.is_exhausted(expected) {
                break;
            }
            search.tell(expected);
            first_try = self.passed(gaussians, search.at, passes, aim, observer)?;
        }
        let mut search = StepSearch::new(search.at, aim.by_step(), finest);
        let mut first_try = Some(first_try);
        let mut best: Option<(Optimized, f64)> = None;
        for _ in 0..MOST_TRIES {
            let (coded, before) = match first_try.take() {
                Some(first_try) => first_try,
                None => self.passed(gaussians, search.at, passes, aim, observer)?,
            };
            // A target that is out of reach gets no more passes than an encoding without target.
            let exhausted = search.is_exhausted(before - settling);
            let most = if exhausted { self.passes } else { MOST_PASSES };
            let (coded, deviation, lambda) =
                self.adjust_lambda(coded, before, settling, most, aim, observer)?;
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
            observer.poll()?;
            let coded = self.codes.rounded(gaussians, search.at);
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

    fn first_passes(&self) -> u32 {
        self.passes.div_ceil(4)
    }

    /// The codes of a step after some passes.
    fn descended(
        &mut self,
        gaussians: &[Gaussian],
        step: f64,
        passes: u32,
        observer: &mut Observer<'_>,
    ) -> Result<Optimized, EncodeError> {
        let rounded = self.codes.rounded(gaussians, step);
        let mut optimized = self.codes.descend(rounded, 0.0, observer)?;
        for _ in 1..passes {
            optimized = self.codes.descend(optimized.coded, 0.0, observer)?;
        }
        Ok(optimized)
    }

    /// The codes of a step after some passes, and their deviation from an aim.
    fn passed(
        &mut self,
        gaussians: &[Gaussian],
        step: f64,
        passes: u32,
        aim: Aim,
        observer: &mut Observer<'_>,
    ) -> Result<(Optimized, f64), EncodeError> {
        let optimized = self.descended(gaussians, step, passes, observer)?;
        let deviation = self.deviation(&optimized.coded, aim, observer)?;
        Ok((optimized, deviation))
    }

    /// Adjusts lambda from pass to pass, in `most` passes, so that codes after their first passes, which
    /// deviate by `deviation`, come as near to an aim as lambda can bring them; without that, passes
    /// lower the deviation by `settling`. Returns the deviation then, and the base-2 logarithm of what
    /// lambda was multiplied by.
    fn adjust_lambda(
        &mut self,
        mut optimized: Optimized,
        mut deviation: f64,
        settling: f64,
        most: u32,
        aim: Aim,
        observer: &mut Observer<'_>,
    ) -> Result<(Optimized, f64, f64), EncodeError> {
        let first = self.first_passes();
        let mut lambda: f64 = 0.0;
        for pass in first..most {
            if pass >= self.passes && aim.miss(deviation) == 0.0 {
                break;
            }
            let expected = deviation - settling * f64::from(first) / f64::from(pass);
            lambda -= (expected / aim.by_lambda()).clamp(-0.5, 0.5);
            lambda = lambda.clamp(-MOST_LAMBDA_CHANGE, MOST_LAMBDA_CHANGE);
            optimized = self.codes.descend(optimized.coded, lambda, observer)?;
            deviation = self.deviation(&optimized.coded, aim, observer)?;
        }
        Ok((optimized, deviation, lambda))
    }

    /// The deviation from an aim.
    fn deviation(
        &self,
        coded: &CodedLayers,
        aim: Aim,
        observer: &mut Observer<'_>,
    ) -> Result<f64, EncodeError> {
        observer.poll()?;
        let file = self.layout.write_entropy(coded);
        Ok(match aim {
            Aim::Size { most } => (file.len() as f64 / most).log2(),
            Aim::Psnr(psnr) => {
                let verified = Verified::new(&file, self.source);
                let reached = verified.distortion(verified.gaussians(), observer)?.psnr;
                ((psnr - reached) * 0.1 * 10_f64.log2()).max(-LARGEST_DEVIATION)
            }
            Aim::Dissimilarity(dissimilarity) => {
                let verified = Verified::new(&file, self.source);
                let reached = self.judge.dissimilarity(&verified.picture(), observer)?;
                (reached / dissimilarity).log2().max(-LARGEST_DEVIATION)
            }
        })
    }

    /// The codes without the least useful ones, such that the file has at most so many bytes.
    fn shortened(
        &self,
        optimized: Optimized,
        bytes: u64,
        observer: &mut Observer<'_>,
    ) -> Result<CodedLayers, EncodeError> {
        let Optimized { mut coded, mut by_use } = optimized;
        loop {
            observer.poll()?;
            let size = self.layout.write_entropy(&coded).len() as u64;
            let Some(excess) = size.checked_sub(bytes).filter(|&excess| excess > 0) else {
                return Ok(coded);
            };
            // Four bytes a Gaussian, and at least one.
            let count = excess.div_ceil(4).min(by_use.len() as u64) as usize;
            by_use.truncate(by_use.len() - count);
            let codes = by_use.clone();
            coded = self.layout.coded(LatticeCodes { lattice: coded.lattice, codes });
        }
    }

    /// The codes of a picture that is too good without the least useful ones, as many as can be spared.
    fn trimmed(
        &self,
        optimized: Optimized,
        mut deviation: f64,
        aim: Aim,
        observer: &mut Observer<'_>,
    ) -> Result<CodedLayers, EncodeError> {
        let Optimized { mut coded, mut by_use } = optimized;
        if deviation > 0.0 || aim.miss(deviation) == 0.0 {
            return Ok(coded);
        }
        // Those from `end` on cannot be spared, and likely not many more at a time.
        let mut end = by_use.len();
        let mut portion = end.div_ceil(2);
        for _ in 0..MOST_TRIMMINGS {
            let start = end.saturating_sub(portion);
            let codes = [&by_use[..start], &by_use[end..]].concat();
            let lattice = coded.lattice.clone();
            let fewer = self.layout.coded(LatticeCodes { lattice, codes });
            let deviation_with_fewer = self.deviation(&fewer, aim, observer)?;
            if deviation_with_fewer <= 0.0 {
                by_use.drain(start..end);
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
