//! The training loop.

use super::budget::Budget;
use super::components::Components;
use super::parameters::Parameters;
use super::schedule::TrainingSchedule;
use super::trained::{Fit, Next};
use super::training::Training;
use crate::encode::error::Result;
use crate::encode::progress::Observer;
use crate::encode::workload::Workload;
use crate::gaussian::Gaussian;

// Constants: docs/tuning.md, "Growth".
/// The error after training as a share of the error during growth: training continues to lower the
/// error when no more Gaussians are added.
const FORESEEN: f64 = 0.75;
/// The share of the iterations from which on the resolution is that of the picture.
const COARSE_UNTIL: f32 = 0.5;

/// Of how many parts of the fewest Gaussians that are enough there may be one more.
const PARTS: usize = 32;

/// What an iteration depends on.
#[derive(Clone, Copy, Debug)]
struct Iteration {
    /// For the progress that is reported.
    work: f64,
    starts_quantization: bool,
    /// Scales all learning rates.
    factor: f32,
    /// Iterations that are planned in total.
    planned: u32,
    next: Next,
}

impl Fit<'_> {
    /// Trains from nothing. `workload` is what was expected of it, for the progress that is reported.
    pub(crate) fn run(&mut self, workload: Workload, observer: &mut Observer<'_>) -> Result<()> {
        let Training { iterations, densification, schedule, .. } = self.training;
        let plan = TrainingSchedule::new(self.training, self.precision);
        self.set_halvings(self.resolutions.copies.len());
        let first = loop {
            self.forward(Next::Growth, observer)?;
            let first = densification.initial * self.wanted(1.0) as f32;
            let first = (first.ceil() as usize).max(1);
            let halvings = self.halvings_for(first);
            if halvings >= self.halvings {
                break first;
            }
            self.set_halvings(halvings);
        };
        self.grow(first, 0, observer)?;
        let mut kept = usize::MAX;
        let planned = self.work.iterations + iterations;
        for iteration in 0..*iterations {
            let done = iteration + 1;
            let is_late = iteration as f32 >= COARSE_UNTIL * *iterations as f32;
            let most = if is_late { 0 } else { self.halvings };
            self.set_halvings(self.halvings_for(self.len()).min(most));
            let growths_left = plan.growths_left(done);
            let grown = 2.0 * f64::from(iteration) / f64::from(*iterations);
            let step = Iteration {
                work: workload.halved(self.halvings).iteration(grown.min(1.0)),
                starts_quantization: iteration == plan.quantized_from,
                factor: schedule.factor(iteration, *iterations),
                planned,
                next: if growths_left.is_some() { Next::Growth } else { Next::Pass },
            };
            self.iterate(step, observer)?;
            if done % densification.prune_interval == 0 {
                self.prune(observer)?;
            }
            if let Some(steps_left) = growths_left {
                kept = self.wanted(FORESEEN);
                let portion = self.portion(kept, steps_left);
                let replaced = (densification.replaced * self.len() as f32) as usize;
                self.grow(portion, replaced, observer)?;
            }
            if let Some(culls_left) = plan.culls_left(done) {
                // In a simple picture the error may fall much faster with the count than foreseen.
                kept = kept.max(self.wanted(FORESEEN));
                // Growth may have ended before the budget, where there is little to correct.
                let surplus = self.len().saturating_sub(kept);
                self.cull(surplus / (culls_left as usize + 1), observer)?;
            }
        }
        self.settle(observer)
    }

    /// Takes Gaussians from elsewhere, within the bounds of training, for a fit that is not trained; the most important
    /// ones if the budget has no room for all.
    pub(crate) fn adopt(
        &mut self,
        gaussians: &[Gaussian],
        observer: &mut Observer<'_>,
    ) -> Result<()> {
        let parameterization = self.bounds.parameterization;
        let components = |&Gaussian { center, cholesky, color }: &Gaussian| {
            let shape = parameterization.shape_of(cholesky);
            self.bounds.clamped(Components { center, shape, color })
        };
        let components = gaussians.iter().map(components).collect();
        self.is_adopted = true;
        self.hold(components, observer)?;
        let surplus = self.len().saturating_sub(self.wanted(1.0));
        if surplus > 0 {
            self.cull(surplus, observer)?;
            self.settle(observer)?;
        }
        observer.report(0, 0, self.len(), self.psnr())
    }

    /// Keeps the fewest of the Gaussians that are enough, always the most important ones. Without effect if all are too
    /// few.
    pub(crate) fn reduce(
        &mut self,
        is_enough: &dyn Fn(&Self, &mut Observer<'_>) -> Result<bool>,
        observer: &mut Observer<'_>,
    ) -> Result<()> {
        if !is_enough(self, observer)? {
            return Ok(());
        }
        let by_importance = self.by_importance(observer)?;
        let (mut too_few, mut enough) = (0, by_importance.len());
        while enough - too_few > 1 + enough / PARTS {
            let count = too_few.midpoint(enough);
            self.hold(by_importance[..count].to_vec(), observer)?;
            match is_enough(self, observer)? {
                true => enough = count,
                false => too_few = count,
            }
        }
        // Unless these are those that were tried last.
        if self.len() != enough {
            self.hold(by_importance[..enough].to_vec(), observer)?;
        }
        Ok(())
    }

    /// Replaces the Gaussians by others, which are not trained.
    fn hold(&mut self, values: Vec<Components>, observer: &mut Observer<'_>) -> Result<()> {
        self.parameters.replace(values);
        self.parameters.sort(observer)?;
        self.invalidate();
        self.settle(observer)
    }

    /// Trains from nothing again, with this many Gaussians.
    pub(crate) fn restart(&mut self, count: usize, observer: &mut Observer<'_>) -> Result<()> {
        self.budget = Budget::Count(count);
        self.parameters = Parameters::new(&self.training.optimizer);
        self.quantizers = None;
        self.invalidate();
        self.run(Workload::new(self.tiled.pixels(), count), observer)
    }

    /// Adds or removes Gaussians of a finished fit, so that there are `count`, and trains all for a
    /// quarter of the iterations more: at first without quantization, because quantizers of the others
    /// would round what is new to nothing.
    pub(crate) fn resize(&mut self, count: usize, observer: &mut Observer<'_>) -> Result<()> {
        if let Some(best) = self.best.take() {
            self.parameters.replace(best.values);
        }
        let was_quantized = self.quantizers.take().is_some();
        self.invalidate();
        self.forward(Next::Growth, observer)?;
        self.cull(self.len().saturating_sub(count), observer)?;
        self.grow(count.saturating_sub(self.len()), 0, observer)?;
        let iterations = self.training.iterations.div_ceil(4);
        let planned = self.work.iterations + iterations;
        let quantized_from = (self.training.quantization.warm_up * iterations as f32) as u32;
        let quantized_from = quantized_from.min(iterations - 1);
        let workload = Workload::new(self.tiled.pixels(), self.len());
        for iteration in 0..iterations {
            let step = Iteration {
                work: workload.iteration(1.0),
                starts_quantization: was_quantized && iteration == quantized_from,
                factor: 0.5 * (1.0 - iteration as f32 / iterations as f32),
                planned,
                next: Next::Pass,
            };
            self.iterate(step, observer)?;
        }
        self.settle(observer)
    }

    /// One iteration: a pass, and a step of the optimizer.
    fn iterate(&mut self, iteration: Iteration, observer: &mut Observer<'_>) -> Result<()> {
        let Iteration { work, starts_quantization, factor, planned, next } = iteration;
        observer.advance(work)?;
        if starts_quantization {
            self.start_quantization();
        }
        self.forward(next, observer)?;
        if self.is_lost() {
            self.return_to_best();
            self.forward(next, observer)?;
        }
        self.keep_if_best();
        observer.report(self.work.iterations, planned, self.len(), self.psnr())?;
        self.work.iterations += 1;
        self.step(factor, next, observer)?;
        let memory = self.memory();
        self.work.peak_memory = self.work.peak_memory.max(memory);
        Ok(())
    }

    /// Ends training: renders the values of the last step, keeps them if they are the best, and
    /// frees memory.
    fn settle(&mut self, observer: &mut Observer<'_>) -> Result<()> {
        self.set_halvings(0);
        self.binned_for = 0;
        self.forward(Next::Pass, observer)?;
        self.keep_if_best();
        self.binned_for = 0;
        self.free_bins();
        Ok(())
    }
}
