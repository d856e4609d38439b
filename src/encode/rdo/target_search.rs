//! The search for the codes with which a file meets its target.

use super::code_optimizer::CodeOptimizer;
use super::step_search::{Aim, StepSearch};
use crate::coding::entropy::LatticeCodes;
use crate::encode::error::EncodeError;
use crate::encode::file::FileLayout;
use crate::encode::options::Target;
use crate::encode::progress::Observer;
use crate::encode::raster::Raster;
use crate::encode::rate_model;
use crate::encode::source::Source;
use crate::encode::verify::Verified;
use crate::gaussian::Gaussian;

/// How often steps are tried at most: by rounding alone, with a few passes over the codes, with all.
const MOST_ROUNDINGS: u32 = 8;
const MOST_SCOUTINGS: u32 = 4;
const MOST_TRIES: u32 = 4;
/// How near is near enough for more passes, as a logarithm to base 2.
const CLOSE: f64 = 0.02;
/// How much less the size becomes after rounding, and size and error after the first pass, as
/// logarithms to base 2.
const SETTLING_OF_ROUNDED: f64 = 0.12;
const SETTLING: f64 = 0.045;
/// More than anything is off, as a logarithm to base 2.
const LARGEST_OFF: f64 = 10.0;
/// How far what a bit is worth may change, as a logarithm to base 2.
const STEERED_BY: f64 = 1.0;
/// Most passes until a target is met.
const MOST_PASSES: u32 = 12;
/// By how much finer steps are taken where nothing else gives the PSNR, as logarithms to base 2.
const FINER: [f64; 4] = [0.5, 0.5, 1.0, 2.0];
/// The finest step that is tried, as a logarithm to base 2 of its ratio to the step that suits the
/// fit's error: there, rounding adds a 256th of what it adds with that step, and a finer one would only
/// make the file larger.
const FINEST: f64 = -4.0;
/// How often it is tried to do without some Gaussians.
const MOST_TRIMMINGS: u32 = 32;

/// What fitted Gaussians are coded for.
#[derive(Debug)]
pub(crate) struct TargetSearch<'a> {
    source: &'a Source<'a>,
    raster: &'a Raster,
    layout: &'a FileLayout<'a>,
    /// How often every code is looked at, or a little more for a target.
    passes: u32,
    codes: CodeOptimizer<'a>,
}

impl<'a> TargetSearch<'a> {
    pub(crate) fn new(
        source: &'a Source<'a>,
        raster: &'a Raster,
        layout: &'a FileLayout<'a>,
        passes: u32,
    ) -> Self {
        Self { source, raster, layout, passes, codes: CodeOptimizer::new(raster, layout) }
    }

    /// Codes `gaussians`, whose picture has the squared error `error`, for a target.
    pub(crate) fn run(
        &self,
        gaussians: &[Gaussian],
        error: f64,
        target: Target,
        observer: &mut Observer<'_>,
    ) -> Result<LatticeCodes, EncodeError> {
        let step = rate_model::step_for(error, gaussians.len());
        let Some(aim) = Aim::new(target, self.raster.pixels()) else {
            let mut coded = self.codes.rounded(gaussians, step);
            self.codes.descend(&mut coded, 0.0, self.passes, observer)?;
            return Ok(coded);
        };
        let finest = step + FINEST;
        let step = self.first_step(gaussians, step, finest, aim, observer)?;
        let (mut coded, mut off, step) = self.aimed(gaussians, step, finest, aim, observer)?;
        if let Some(bytes) = target.bytes(self.raster.pixels()) {
            self.shorten(&mut coded, bytes, observer)?;
            return Ok(coded);
        }
        if aim.miss(off) > 0.0 {
            // A few Gaussians are hard to steer, but finer steps are always better in the end.
            let mut finer = step;
            for change in FINER {
                finer -= change;
                if off <= 0.0 || finer < finest {
                    break;
                }
                (coded, off) = self.passed(gaussians, finer, self.passes, aim, observer)?;
            }
        }
        self.trim(coded, off, aim, observer)
    }

    /// The codes that come nearest to an aim, how far from it they are, and the step that would be
    /// tried next; `step` is the first.
    fn aimed(
        &self,
        gaussians: &[Gaussian],
        step: f64,
        finest: f64,
        aim: Aim,
        observer: &mut Observer<'_>,
    ) -> Result<(LatticeCodes, f64, f64), EncodeError> {
        let passes = self.scouting_passes();
        let mut settling = SETTLING / f64::from(passes);
        let mut search = StepSearch::new(step, aim.by_step(), finest);
        let mut scouted = self.passed(gaussians, search.at, passes, aim, observer)?;
        for _ in 1..MOST_SCOUTINGS {
            let expected = scouted.1 - settling;
            if expected.abs() < CLOSE || search.is_exhausted(expected) {
                break;
            }
            search.tell(expected);
            scouted = self.passed(gaussians, search.at, passes, aim, observer)?;
        }
        let mut search = StepSearch::new(search.at, aim.by_step(), finest);
        let mut scouted = Some(scouted);
        let mut best: Option<(LatticeCodes, f64)> = None;
        for _ in 0..MOST_TRIES {
            let (mut coded, before) = match scouted.take() {
                Some(scouted) => scouted,
                None => self.passed(gaussians, search.at, passes, aim, observer)?,
            };
            // What is out of reach gets no more passes than what is not aimed at.
            let exhausted = search.is_exhausted(before - settling);
            let most = if exhausted { self.passes } else { MOST_PASSES };
            let (off, lambda) = self.steer(&mut coded, before, settling, most, aim, observer)?;
            if best.as_ref().is_none_or(|(_, least)| aim.miss(off) < aim.miss(*least)) {
                best = Some((coded, off));
            }
            if aim.miss(off) == 0.0 || exhausted {
                break;
            }
            // Now it is known how much happens after scouting.
            let unsteered = off - lambda * aim.by_lambda();
            settling = before - unsteered;
            search.tell(unsteered);
        }
        let (coded, off) = best.expect("at least one was tried");
        Ok((coded, off, search.at))
    }

    /// The first step to try: how long a file gets can nearly be told from rounding alone.
    fn first_step(
        &self,
        gaussians: &[Gaussian],
        step: f64,
        finest: f64,
        aim: Aim,
        observer: &mut Observer<'_>,
    ) -> Result<f64, EncodeError> {
        let mut search = StepSearch::new(step, aim.by_step(), finest);
        if matches!(aim, Aim::Psnr(_)) {
            return Ok(search.at);
        }
        for _ in 0..MOST_ROUNDINGS {
            observer.poll()?;
            let mut coded = self.codes.rounded(gaussians, search.at);
            self.codes.written(&mut coded);
            let off = self.off(&coded, aim, observer)? - SETTLING_OF_ROUNDED;
            if search.is_exhausted(off) {
                break;
            }
            search.tell(off);
            if off.abs() < CLOSE {
                break;
            }
        }
        Ok(search.at)
    }

    fn scouting_passes(&self) -> u32 {
        self.passes.div_ceil(4)
    }

    /// Codes of a step after some passes, and how far they are from an aim.
    fn passed(
        &self,
        gaussians: &[Gaussian],
        step: f64,
        passes: u32,
        aim: Aim,
        observer: &mut Observer<'_>,
    ) -> Result<(LatticeCodes, f64), EncodeError> {
        let mut coded = self.codes.rounded(gaussians, step);
        self.codes.descend(&mut coded, 0.0, passes, observer)?;
        let off = self.off(&coded, aim, observer)?;
        Ok((coded, off))
    }

    /// Goes on with scouted codes that are `off`, and gets as near to an aim as what a bit is worth
    /// can bring them, in `most` passes; by `settling` they become less off anyway. How far they are from the aim
    /// then, and what a bit was worth, as a logarithm to base 2.
    fn steer(
        &self,
        coded: &mut LatticeCodes,
        mut off: f64,
        settling: f64,
        most: u32,
        aim: Aim,
        observer: &mut Observer<'_>,
    ) -> Result<(f64, f64), EncodeError> {
        let first = self.scouting_passes();
        let mut lambda: f64 = 0.0;
        for pass in first..most {
            if pass >= self.passes && aim.miss(off) == 0.0 {
                break;
            }
            let expected = off - settling * f64::from(first) / f64::from(pass);
            lambda -= (expected / aim.by_lambda()).clamp(-0.5, 0.5);
            lambda = lambda.clamp(-STEERED_BY, STEERED_BY);
            self.codes.descend(coded, lambda, 1, observer)?;
            off = self.off(coded, aim, observer)?;
        }
        Ok((off, lambda))
    }

    /// How far from an aim.
    fn off(
        &self,
        coded: &LatticeCodes,
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
                // An exact copy is off by no number.
                ((psnr - reached) * 0.1 * 10_f64.log2()).max(-LARGEST_OFF)
            }
        })
    }

    /// Removes the weakest Gaussians until the file has at most so many bytes.
    fn shorten(
        &self,
        coded: &mut LatticeCodes,
        bytes: u64,
        observer: &mut Observer<'_>,
    ) -> Result<(), EncodeError> {
        loop {
            observer.poll()?;
            let size = self.layout.write_entropy(coded).len() as u64;
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
        mut off: f64,
        aim: Aim,
        observer: &mut Observer<'_>,
    ) -> Result<LatticeCodes, EncodeError> {
        if off > 0.0 || aim.miss(off) == 0.0 {
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
            let off_with_fewer = self.off(&fewer, aim, observer)?;
            if off_with_fewer <= 0.0 {
                (coded, off, end) = (fewer, off_with_fewer, start);
            } else if portion > 1 {
                portion /= 2;
            } else {
                end -= 1;
            }
            if end == 0 || aim.miss(off) == 0.0 {
                break;
            }
        }
        Ok(coded)
    }
}
