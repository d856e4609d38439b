//! The search for the codes with which a file meets its target.

use super::code_optimizer::{CodeOptimizer, Optimized};
use super::residuals::Residuals;
use super::search_work::SearchWork;
use super::step_search::StepSearch;
use super::window::Window;
use crate::coding::entropy::{Code, QuantizedCodes};
use crate::encode::aim::{Aim, FileAim};
use crate::encode::error::Result;
use crate::encode::file::{CodedLayers, FileLayout};
use crate::encode::loss::Distortion;
use crate::encode::progress::Observer;
use crate::encode::quality::Judge;
use crate::encode::rate_model::{self, SizeModel};
use crate::encode::strips;
use crate::encode::tiled_source::TiledSource;
use crate::encode::verify::Verified;
use crate::gaussian::Gaussian;

// Constants: docs/tuning.md, "Search for a target".
/// Most steps that are tried: by rounding alone, and with passes of coordinate descent.
const MOST_ROUNDING_TRIES: u32 = 8;
const MOST_TRIES: u32 = 4;
/// With at most this log ratio of rounded codes, the step that follows from it is good.
const CLOSE_OF_ROUNDED: f64 = 0.025;
/// The size that the first step aims at, as a log ratio: a file that is a little too large is shortened, and
/// one that is too small gets Gaussians back.
const AIMED: f64 = -0.004;
/// What passes take off the bits that the model of the size gives ([`SizeModel`]), as a base-2 logarithm, and how
/// much steeper the size falls with the step: more and more Gaussians are too weak for a coarser one.
const FALL_OF_BITS: f64 = 0.17;
const STEEPER: f64 = 1.5;
/// Gaussians of at most this energy are weak: most of them are not worth their bits.
const WEAK: i64 = 2;
/// The fall of size and of error, as base-2 logarithms, that further passes of coordinate descent bring
/// after the first one. After n passes, 1 / n of it is still to come.
const SETTLING: f64 = 0.03;
/// The additional fall in the first pass after a change of the step.
const SETTLING_AGAIN: f64 = 0.012;
/// The log ratio of a file that decodes to an exact copy, which has no finite PSNR.
const LARGEST_LOG_RATIO: f64 = 10.0;
/// By how much lambda may change to meet a target, as a base-2 logarithm.
const MOST_LAMBDA_CHANGE: f64 = 1.0;
/// Most passes of coordinate descent until a target is met.
const MOST_PASSES: u32 = 12;
/// Up to this pass, the step may change.
const MOST_ROUNDED_PASSES: u32 = 10;
/// Refinements of the step, one after the other, where the search does not reach the PSNR; base-2
/// logarithms.
const FINER: [f64; 4] = [0.5, 0.5, 1.0, 2.0];
/// The finest step that is tried, as the base-2 logarithm of its ratio to the step that suits the fit's
/// error. There, rounding adds a 256th of the error that it adds with that step: a finer one would only
/// make the file larger.
const FINEST: f64 = -4.0;
/// The same for Gaussians whose error is that of a fit from elsewhere, which may be any.
const FINEST_AT_ANY_ERROR: f64 = -12.0;
/// Bytes that one of the least useful Gaussians takes, about.
const BYTES_OF_LEAST_USEFUL: f64 = 2.3;
/// How often a file that is too small gets some of them back.
const MOST_FILLINGS: u32 = 4;
/// The least share of a number of Gaussians that is asked for which a file has, if need be with finer
/// steps: the step that suits the error is too coarse where they make hardly anything of the picture.
const LEAST_KEPT: f64 = 0.5;
/// How often the step is halved for that.
const MOST_HALVINGS: u32 = 8;
/// How often a file that exceeds its PSNR is tried with fewer Gaussians.
const MOST_TRIMMINGS: u32 = 32;

/// The share of weak Gaussians.
fn weak_share(coded: &CodedLayers) -> f64 {
    let weak = coded.codes.iter().filter(|code| code.energy() <= WEAK).count();
    weak as f64 / coded.codes.len().max(1) as f64
}

/// The fall of the size in the first pass, as a base-2 logarithm, given the share of weak Gaussians.
fn settling_of_rounded(weak: f64) -> f64 {
    0.02 + 1.05 * weak
}

/// By how much size and error will still fall after so many passes.
fn settling(passes: u32) -> f64 {
    SETTLING / f64::from(passes)
}

/// Rate-distortion optimisation of a fit's codes for a target.
#[derive(Debug)]
pub(crate) struct TargetSearch<'a> {
    judge: &'a Judge<'a>,
    layout: &'a FileLayout<'a>,
    /// How many passes there shall be, and what they cost; for a target there may be a few more.
    work: SearchWork,
    /// The finest step that is tried, relative to that which suits the fit's error.
    finest: f64,
    codes: CodeOptimizer<'a>,
}

impl<'a> TargetSearch<'a> {
    pub(crate) fn new(
        judge: &'a Judge<'a>,
        tiled: &'a TiledSource,
        layout: &'a FileLayout<'a>,
        work: SearchWork,
        observer: &mut Observer<'_>,
    ) -> Result<Self> {
        let codes = CodeOptimizer::new(tiled, layout, observer)?;
        Ok(Self { judge, layout, work, finest: FINEST, codes })
    }

    /// The same for a file whose time to decode is no matter, as it has few Gaussians.
    pub(crate) fn at_any_decoding_time(self) -> Self {
        Self { codes: self.codes.at_any_decoding_time(), ..self }
    }

    /// The same for Gaussians whose error tells nothing of the step that suits them.
    pub(crate) fn at_any_error(self) -> Self {
        Self { finest: FINEST_AT_ANY_ERROR, ..self }
    }

    /// The most memory of a search for codes of some Gaussians, in bytes, with that of the source.
    pub(crate) fn memory(tiled: &TiledSource, gaussians: &[Gaussian]) -> usize {
        let strip = strips::memory(tiled.width as u32, tiled.height as u32, tiled.channels);
        let window = Window::memory(tiled, gaussians);
        // Gaussians and their rendering; codes before a pass and after it, with what they are chosen by.
        let by_gaussian = 2 * size_of::<Gaussian>() + 3 * size_of::<Code>() + size_of::<[u64; 4]>();
        tiled.memory()
            + Residuals::memory(tiled)
            + strip.max(window)
            + gaussians.len() * by_gaussian
    }

    /// Finds codes of `gaussians`, whose rendering has this distortion, for an aim. Returns them with their
    /// log ratio from it (see [`FileAim`]); it is 0 where no error is asked for.
    pub(crate) fn run(
        &mut self,
        gaussians: &[Gaussian],
        distortion: Distortion,
        aim: Aim,
        observer: &mut Observer<'_>,
    ) -> Result<(CodedLayers, f64)> {
        let step = aim.step(distortion, gaussians.len());
        let least = rate_model::least_step(gaussians, self.layout.header().color);
        let step = step.max(least);
        observer.expect(self.work.whole());
        let Some(aim) = aim.of_file() else {
            let is_counted = matches!(aim, Aim::Count(_));
            let kept = if is_counted { LEAST_KEPT * gaussians.len() as f64 } else { 0.0 };
            let coded = self.keeping(kept.ceil() as usize, gaussians, step, least, observer)?;
            return Ok((coded, 0.0));
        };
        let finest = (step + self.finest).max(least);
        let step = self.first_step(gaussians, step, finest, aim, observer)?;
        let (mut coded, mut log_ratio, step) =
            self.aimed(gaussians, step, finest, aim, observer)?;
        if let FileAim::Size(bytes) = aim {
            return Ok((self.shortened(coded, bytes, observer)?, 0.0));
        }
        if aim.violation(log_ratio, weak_share(&coded.coded)) > 0.0 {
            // With few Gaussians the PSNR jumps from step to step, but it rises as steps get finer.
            let mut finer = step;
            for change in FINER {
                finer -= change;
                if log_ratio <= 0.0 || finer < finest {
                    break;
                }
                let other = self.descended(gaussians, finer, self.work.passes, observer)?;
                let log_ratio_of_other = self.log_ratio(&other.coded, aim, observer)?;
                // That of Gaussians that fit badly may rise: fine steps leave them as they are.
                if log_ratio_of_other < log_ratio {
                    (coded, log_ratio) = (other, log_ratio_of_other);
                }
            }
        }
        self.trimmed(coded, log_ratio, aim, observer)
    }

    /// The codes of a step, which is halved while there are fewer than `count`.
    fn keeping(
        &mut self,
        count: usize,
        gaussians: &[Gaussian],
        mut step: f64,
        least: f64,
        observer: &mut Observer<'_>,
    ) -> Result<CodedLayers> {
        let mut halvings = 0;
        loop {
            let coded = self.descended(gaussians, step, self.work.passes, observer)?.coded;
            if coded.codes.len() >= count || step <= least || halvings == MOST_HALVINGS {
                return Ok(coded);
            }
            halvings += 1;
            step = (step - 1.0).max(least);
            observer.expect(self.work.one_more_try());
        }
    }

    /// Tries up to [`MOST_TRIES`] steps, `step` first. Returns the codes that come nearest to an aim, their
    /// log ratio from it, and the step at which the search has arrived.
    fn aimed(
        &mut self,
        gaussians: &[Gaussian],
        step: f64,
        finest: f64,
        aim: FileAim,
        observer: &mut Observer<'_>,
    ) -> Result<(Optimized, f64, f64)> {
        let mut search = StepSearch::new(step, aim.by_step(), finest);
        let mut best: Option<(Optimized, f64, f64)> = None;
        for _ in 0..MOST_TRIES {
            let (optimized, log_ratio, expected) = self.tried(gaussians, &search, aim, observer)?;
            let violation = aim.violation(log_ratio, weak_share(&optimized.coded));
            if best.as_ref().is_none_or(|&(.., least)| violation < least) {
                best = Some((optimized, log_ratio, violation));
            }
            if violation == 0.0 || search.is_exhausted(expected) {
                break;
            }
            search.report(expected);
            observer.expect(self.work.one_more_try());
        }
        let (optimized, log_ratio, _) = best.expect("at least one was tried");
        Ok((optimized, log_ratio, search.at))
    }

    /// Tries the step at which the search is; passes with other lambdas, or another rounding, bring the codes
    /// nearer to the aim. Returns the codes, their log ratio from the aim, and an estimate of the log ratio
    /// that the step itself has, with the usual lambda.
    fn tried(
        &mut self,
        gaussians: &[Gaussian],
        search: &StepSearch,
        aim: FileAim,
        observer: &mut Observer<'_>,
    ) -> Result<(Optimized, f64, f64)> {
        let first = self.work.first_passes();
        let mut optimized = self.descended(gaussians, search.at, first, observer)?;
        let (mut pass, mut step, mut lambda): (u32, f64, f64) = (first, search.at, 0.0);
        loop {
            let mut log_ratio = self.log_ratio(&optimized.coded, aim, observer)?;
            if let FileAim::Size(_) = aim
                && pass >= self.work.passes
                && aim.violation(log_ratio, weak_share(&optimized.coded)) > 0.0
                && log_ratio < 0.0
            {
                (optimized, log_ratio) = self.filled(optimized, log_ratio, aim, observer)?;
            }
            let expected = log_ratio - settling(pass) + settling(self.work.passes.max(pass + 1));
            let is_within_lambda = aim.is_within_lambda(expected);
            // The squared error of codes that are rounded twice is too large.
            let can_be_rounded = matches!(aim, FileAim::Size(_)) && pass < MOST_ROUNDED_PASSES;
            let can_change = is_within_lambda || can_be_rounded;
            let is_enough = pass >= self.work.passes
                && (aim.violation(log_ratio, weak_share(&optimized.coded)) == 0.0
                    || pass >= MOST_PASSES
                    || lambda.abs() == MOST_LAMBDA_CHANGE
                    // A target that is out of reach gets no more passes than an encoding without
                    // target.
                    || search.is_exhausted(expected));
            if is_enough || !can_change {
                let by_step = aim.by_step() * (step - search.at);
                return Ok((
                    optimized,
                    log_ratio,
                    expected - aim.change_by_lambda(lambda) - by_step,
                ));
            }
            if pass >= self.work.passes {
                observer.expect(self.work.one_more_pass(pass));
            }
            let mut coded = optimized.into_coded();
            if is_within_lambda {
                let change = aim.lambda_against(aim.beyond(expected));
                lambda = (lambda + change.clamp(-0.7, 0.7))
                    .clamp(-MOST_LAMBDA_CHANGE, MOST_LAMBDA_CHANGE);
            } else {
                // Codes on a new quantization grid, which a pass improves as it improves those of the fit.
                let too_much = expected - SETTLING_AGAIN - aim.middle();
                step = (step - too_much / aim.by_step()).max(search.finest);
                lambda = 0.0;
                let gaussians = self.codes.gaussians(&coded, observer)?;
                coded = self.codes.rounded(&gaussians, step, observer)?;
            }
            optimized = self.codes.descend(coded, lambda, self.work.pass(pass), observer)?;
            pass += 1;
        }
    }

    /// The first step to try. Rounding alone nearly tells the size of a file.
    fn first_step(
        &self,
        gaussians: &[Gaussian],
        step: f64,
        finest: f64,
        aim: FileAim,
        observer: &mut Observer<'_>,
    ) -> Result<f64> {
        if !matches!(aim, FileAim::Size(_)) {
            return Ok(step);
        }
        // What is no code: chunks, metadata, texture.
        let empty = self.codes.rounded(&[], step, observer)?;
        let fixed = aim.wanted() * self.log_ratio(&empty, aim, observer)?.exp2();
        let room = (AIMED.exp2() * aim.wanted() - fixed).max(1.0);
        let model = SizeModel::new(gaussians, self.layout.header().color.channels());
        let mut step = model.step_for_bits(8.0 * room * FALL_OF_BITS.exp2()).max(finest);
        for _ in 0..MOST_ROUNDING_TRIES {
            let coded = self.codes.rounded(gaussians, step, observer)?;
            let fall =
                settling_of_rounded(weak_share(&coded)) + settling(1) - settling(self.work.passes);
            let bytes = aim.wanted() * self.log_ratio(&coded, aim, observer)?.exp2() - fixed;
            let log_ratio = (bytes.max(1.0) / room).log2() - fall;
            let is_exhausted = step <= finest && log_ratio < 0.0;
            step = model.step_for_change(step, -log_ratio / STEEPER).max(finest);
            if is_exhausted || log_ratio.abs() < CLOSE_OF_ROUNDED {
                break;
            }
        }
        Ok(step)
    }

    /// The codes of a step after some passes.
    fn descended(
        &mut self,
        gaussians: &[Gaussian],
        step: f64,
        passes: u32,
        observer: &mut Observer<'_>,
    ) -> Result<Optimized> {
        let rounded = self.codes.rounded(gaussians, step, observer)?;
        let mut optimized = self.codes.descend(rounded, 0.0, self.work.pass(0), observer)?;
        for pass in 1..passes {
            let work = self.work.pass(pass);
            optimized = self.codes.descend(optimized.into_coded(), 0.0, work, observer)?;
        }
        Ok(optimized)
    }

    /// The log ratio from an aim.
    fn log_ratio(
        &self,
        coded: &CodedLayers,
        aim: FileAim,
        observer: &mut Observer<'_>,
    ) -> Result<f64> {
        let file = self.layout.write_entropy(coded, observer)?;
        let log_ratio = match aim {
            FileAim::Size(_) => (file.len() as f64 / aim.wanted()).log2(),
            FileAim::Psnr(_) => {
                let verified = Verified::new(&file, self.judge.source(), observer)?;
                let reached = verified.psnr(verified.gaussians(), observer)?;
                ((aim.wanted() - reached) * 0.1 * 10_f64.log2()).max(-LARGEST_LOG_RATIO)
            }
            FileAim::Quality(quality) => {
                let verified = Verified::new(&file, self.judge.source(), observer)?;
                let verdict = self.judge.judge(&verified.picture(), observer)?;
                verdict.excess(quality).log2().max(-LARGEST_LOG_RATIO)
            }
        };
        observer.advance(self.work.comparison())?;
        Ok(log_ratio)
    }

    /// The codes with the most useful of those that were removed, as many as a file that is too small has room
    /// for, and their log ratio from the size.
    fn filled(
        &self,
        mut optimized: Optimized,
        mut log_ratio: f64,
        aim: FileAim,
        observer: &mut Observer<'_>,
    ) -> Result<(Optimized, f64)> {
        let Optimized { coded, by_use, spare } = &mut optimized;
        for _ in 0..MOST_FILLINGS {
            let missing = aim.wanted() * (1.0 - log_ratio.exp2());
            let count = (missing / BYTES_OF_LEAST_USEFUL).ceil() as usize;
            if log_ratio >= 0.0 || count == 0 || spare.is_empty() {
                break;
            }
            by_use.extend(spare.drain(..count.min(spare.len())));
            let quantization = coded.quantization.clone();
            let codes = QuantizedCodes { quantization, codes: by_use.clone() };
            *coded = self.layout.coded(codes, observer)?;
            log_ratio = self.log_ratio(coded, aim, observer)?;
        }
        Ok((optimized, log_ratio))
    }

    /// The codes without the least useful ones, such that the file has at most so many bytes.
    fn shortened(
        &self,
        optimized: Optimized,
        bytes: u64,
        observer: &mut Observer<'_>,
    ) -> Result<CodedLayers> {
        let Optimized { mut coded, mut by_use, .. } = optimized;
        let all = by_use.len();
        let mut size = self.layout.write_entropy(&coded, observer)?.len() as u64;
        let largest = size;
        while size > bytes && !by_use.is_empty() {
            let removed = all - by_use.len();
            // As many bytes a Gaussian as before, and a Gaussian at least.
            let bytes_each = match removed {
                0 => BYTES_OF_LEAST_USEFUL,
                _ => (largest.saturating_sub(size) as f64 / removed as f64).max(1.0),
            };
            let count = ((size - bytes) as f64 / bytes_each).ceil() as usize;
            by_use.truncate(by_use.len().saturating_sub(count));
            let codes = by_use.clone();
            let codes = QuantizedCodes { quantization: coded.quantization, codes };
            coded = self.layout.coded(codes, observer)?;
            size = self.layout.write_entropy(&coded, observer)?.len() as u64;
        }
        Ok(coded)
    }

    /// The codes of a picture that is too good without the least useful ones, as many as can be spared, and
    /// their log ratio from the aim.
    fn trimmed(
        &self,
        optimized: Optimized,
        mut log_ratio: f64,
        aim: FileAim,
        observer: &mut Observer<'_>,
    ) -> Result<(CodedLayers, f64)> {
        let Optimized { mut coded, mut by_use, .. } = optimized;
        if log_ratio > 0.0 || aim.violation(log_ratio, 0.0) == 0.0 {
            return Ok((coded, log_ratio));
        }
        // Those from `end` on cannot be spared, and likely not many more at a time.
        let mut end = by_use.len();
        let mut portion = end.div_ceil(16);
        for _ in 0..MOST_TRIMMINGS {
            let start = end.saturating_sub(portion);
            let codes = [&by_use[..start], &by_use[end..]].concat();
            let quantization = coded.quantization.clone();
            let fewer = self.layout.coded(QuantizedCodes { quantization, codes }, observer)?;
            let log_ratio_with_fewer = self.log_ratio(&fewer, aim, observer)?;
            if log_ratio_with_fewer <= 0.0 {
                by_use.drain(start..end);
                (coded, log_ratio, end) = (fewer, log_ratio_with_fewer, start);
            } else if portion > 1 {
                portion /= 2;
            } else {
                end -= 1;
            }
            if end == 0 || aim.violation(log_ratio, 0.0) == 0.0 {
                break;
            }
        }
        Ok((coded, log_ratio))
    }
}
