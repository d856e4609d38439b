//! The training loop, which fits Gaussians to a picture (paper, section "Methodology").

mod adam;
mod backward;
mod bins;
pub(crate) mod budget;
mod checkpoint;
mod components;
mod densify;
mod distortion_map;
mod gauss_newton;
mod lsq;
mod parameterization;
mod parameters;
mod pass;
mod rate_term;
mod schedule;
mod state;
pub(crate) mod training;
mod training_tile;
pub(crate) mod vector_quantizer;

use backward::Backward;
use bins::reset;
use budget::Budget;
use checkpoint::Checkpoint;
use components::{Bounds, Components};
use densify::{Densifier, MIN_COLOR};
use lsq::{LsqQuantizers, decoded};
use parameters::Parameters;
use pass::{Pass, Rendered};
use rate_term::RateTerm;
use schedule::TrainingSchedule;
use training::{Portion, Training};
use training_tile::RenderingError;

use super::error::EncodeError;
use super::options::{MAX_GAUSSIANS, Precision};
use super::progress::Observer;
use super::raster::Raster;
use super::rate_model;
use super::workload::Workload;
use crate::coding::packed::{PackedCodes, Quantizer};
use crate::gaussian::{Gaussian, component_count};
use crate::render::splat::Splat;

// Constants: docs/tuning.md, "Iterations".
/// The error after training as a share of the error during growth: training continues to lower the
/// error when no more Gaussians are added.
const FORESEEN: f64 = 0.75;
/// The squared error, as a multiple of that before quantization, from which on it is mostly rounding.
const LOST: f64 = 2.0;
/// Passes with the same bins, while no Gaussians are added or removed.
const REBIN_INTERVAL: u32 = 8;
/// Work to turn a Gaussian into a splat, or to look at it.
const WORK: f64 = 20.0;
/// Gaussians that one task turns into splats.
const CHUNK: usize = 256;

/// What fits have cost.
#[derive(Clone, Copy, Debug, Default)]
pub(crate) struct Work {
    pub(crate) iterations: u32,
    /// Evaluations of the kernel, one for each pair of a Gaussian and a pixel.
    pub(crate) evaluations: u64,
    /// In bytes.
    pub(crate) peak_memory: usize,
}

/// The Gaussians of a picture during training.
#[derive(Debug)]
pub(crate) struct Fit<'a> {
    raster: &'a Raster,
    training: &'a Training,
    budget: Budget,
    precision: Precision,
    base: [f32; 4],
    bounds: Bounds,
    parameters: Parameters,
    /// The quantizers, once quantization-aware training has started.
    quantizers: Option<LsqQuantizers>,
    /// The squared error before quantization started; 0 without it.
    float_error: f64,
    /// The state of least error since Gaussians were last added or removed.
    best: Option<Checkpoint>,
    pass: Pass,
    /// Passes for which the present bins remain valid.
    binned_for: u32,
    /// The splats of the last pass; after a step, those of the next one if `has_splats`.
    splats: Vec<Splat>,
    /// Whether `splats` are those of the present values.
    has_splats: bool,
    /// The error of the last pass.
    error: RenderingError,
    work: Work,
    rng: fastrand::Rng,
}

impl<'a> Fit<'a> {
    pub(crate) fn new(
        raster: &'a Raster,
        training: &'a Training,
        budget: Budget,
        precision: Precision,
        base: [f32; 4],
        seed: u64,
        work: Work,
    ) -> Self {
        Self {
            raster,
            training,
            budget,
            precision,
            base,
            bounds: Bounds::new(
                training.parameterization,
                raster.channels,
                [raster.width as u32, raster.height as u32],
            ),
            parameters: Parameters::new(&training.optimizer),
            quantizers: None,
            float_error: 0.0,
            best: None,
            pass: Pass::new(raster),
            binned_for: 0,
            splats: Vec::new(),
            has_splats: false,
            error: RenderingError::default(),
            work,
            rng: fastrand::Rng::with_seed(seed),
        }
    }

    /// Trains from nothing. `workload` is what was expected of it, for the progress that is told.
    pub(crate) fn run(
        &mut self,
        workload: Workload,
        observer: &mut Observer<'_>,
    ) -> Result<(), EncodeError> {
        let Training { iterations, densification, schedule, .. } = self.training;
        let plan = TrainingSchedule::new(self.training, self.precision);
        self.forward(true, observer)?;
        let first = densification.initial * self.wanted(1.0) as f32;
        self.grow((first.ceil() as usize).max(1), 0, observer)?;
        let mut kept = usize::MAX;
        let total = self.work.iterations + iterations;
        for iteration in 0..*iterations {
            let grown = 2.0 * f64::from(iteration) / f64::from(*iterations);
            observer.advance(workload.iteration(grown.min(1.0)))?;
            if iteration == plan.quantized_from {
                self.start_quantization();
            }
            let factor = schedule.factor(iteration, *iterations);
            let done = iteration + 1;
            let growths_left = plan.growths_left(done);
            let grows = growths_left.is_some();
            self.iterate(factor, total, grows, observer)?;
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

    /// Trains from nothing again, with this many Gaussians.
    pub(crate) fn restart(
        &mut self,
        count: usize,
        observer: &mut Observer<'_>,
    ) -> Result<(), EncodeError> {
        self.budget = Budget::Count(count);
        self.parameters = Parameters::new(&self.training.optimizer);
        self.quantizers = None;
        self.invalidate();
        self.run(Workload::new(self.raster.pixels(), count), observer)
    }

    /// Adds or removes Gaussians of a finished fit, so that there are `count`, and trains all for a
    /// quarter of the iterations more: at first without quantization, because quantizers of the others
    /// would round what is new to nothing.
    pub(crate) fn resize(
        &mut self,
        count: usize,
        observer: &mut Observer<'_>,
    ) -> Result<(), EncodeError> {
        if let Some(best) = self.best.take() {
            self.parameters.replace(best.values);
        }
        let was_quantized = self.quantizers.take().is_some();
        self.invalidate();
        self.forward(true, observer)?;
        self.cull(self.len().saturating_sub(count), observer)?;
        self.grow(count.saturating_sub(self.len()), 0, observer)?;
        let iterations = self.training.iterations.div_ceil(4);
        let total = self.work.iterations + iterations;
        let quantized_from = (self.training.quantization.warm_up * iterations as f32) as u32;
        let quantized_from = quantized_from.min(iterations - 1);
        let workload = Workload::new(self.raster.pixels(), self.len());
        for iteration in 0..iterations {
            observer.advance(workload.iteration(1.0))?;
            if was_quantized && iteration == quantized_from {
                self.start_quantization();
            }
            let factor = 0.5 * (1.0 - iteration as f32 / iterations as f32);
            self.iterate(factor, total, false, observer)?;
        }
        self.settle(observer)
    }

    /// The best Gaussians so far as codes of the packed coding: those of the trained quantizers, or
    /// floats.
    pub(crate) fn fitted(&self) -> PackedCodes {
        let empty = Checkpoint::new();
        let Checkpoint { values, quantizers, .. } = self.best.as_ref().unwrap_or(&empty);
        match quantizers {
            Some(quantizers) => PackedCodes {
                quantizers: quantizers.stored(),
                codes: values.iter().map(|values| quantizers.codes(values).to_array()).collect(),
            },
            None => PackedCodes {
                quantizers: vec![Quantizer::Float; component_count(self.raster.channels)],
                codes: values.iter().map(|values| values.to_array().map(f32::to_bits)).collect(),
            },
        }
    }

    /// The best Gaussians so far, without quantization.
    pub(crate) fn gaussians(&self) -> Vec<Gaussian> {
        let values = self.best.as_ref().map_or(&[][..], |best| &best.values);
        values.iter().map(|values| values.gaussian(self.bounds.parameterization)).collect()
    }

    /// The error of the best Gaussians so far.
    pub(crate) fn best_error(&self) -> RenderingError {
        self.best.as_ref().map_or(self.error, |best| best.error)
    }

    /// Whether most of the error is that of quantization: fewer Gaussians, which overlap less, may show a
    /// better picture.
    pub(crate) fn is_lost_to_rounding(&self) -> bool {
        self.quantizers.is_some() && self.best_error().squared > LOST * self.float_error
    }

    /// What training has cost so far.
    pub(crate) fn work(&self) -> Work {
        self.work
    }

    /// Number of Gaussians.
    pub(crate) fn len(&self) -> usize {
        self.parameters.len()
    }

    /// Most Gaussians that the picture may get: one per pixel.
    pub(crate) fn most(&self) -> usize {
        self.raster.pixels().min(MAX_GAUSSIANS as usize)
    }

    /// The number of Gaussians that the budget sets, if training changes the error by the factor
    /// `foreseen`.
    fn wanted(&self, foreseen: f64) -> usize {
        let RenderingError { squared, distortion, .. } = self.error;
        let measured = match self.budget {
            Budget::Count(_) => 0.0,
            Budget::Bits { .. } => self.component_bits(distortion * foreseen),
            Budget::SquaredError(_) => squared * foreseen,
            Budget::DistortionPerGaussian(_) => distortion * foreseen,
        };
        self.budget.wanted(self.len(), measured, self.most())
    }

    /// The bits of a component on average, if the picture has this distortion.
    fn component_bits(&self, distortion: f64) -> f64 {
        if self.len() == 0 {
            return rate_model::USUAL_COMPONENT_BITS;
        }
        let step = rate_model::color_step(rate_model::step_for(distortion, self.len()));
        let bits = |values: &Components| {
            rate_model::component_bits(&values.gaussian(self.bounds.parameterization), step)
        };
        self.parameters.values.iter().map(bits).sum::<f64>() / self.len() as f64
    }

    /// How many Gaussians this growth step adds. `kept` Gaussians remain when the surplus has been
    /// culled; `steps_left` growth steps follow this one.
    fn portion(&self, kept: usize, steps_left: u32) -> usize {
        let densification = &self.training.densification;
        let grown = kept as f64 * (1.0 + f64::from(densification.surplus));
        let missing = (grown.round() as usize).saturating_sub(self.len());
        match densification.portion {
            _ if steps_left == 0 => missing,
            Portion::Even => missing.div_ceil(steps_left as usize + 1),
            Portion::Half => missing.div_ceil(2),
            Portion::Fixed(count) => missing.min(count as usize),
        }
    }

    /// One iteration: a pass, and a step of the optimizer, where `factor` scales all learning
    /// rates. `iterations` is how many are planned in total, for the progress report; `grows` tells that
    /// Gaussians are added after it.
    fn iterate(
        &mut self,
        factor: f32,
        iterations: u32,
        grows: bool,
        observer: &mut Observer<'_>,
    ) -> Result<(), EncodeError> {
        self.forward(grows, observer)?;
        if self.is_lost() {
            self.return_to_best();
            self.forward(grows, observer)?;
        }
        self.keep_if_best();
        observer.report(self.work.iterations, iterations, self.len(), self.psnr())?;
        self.work.iterations += 1;
        self.step(factor, grows, observer)?;
        let memory = self.memory();
        self.work.peak_memory = self.work.peak_memory.max(memory);
        Ok(())
    }

    /// Whether the last step lost what training had. Codes that flip make the error jump, which is no
    /// loss: the best state is kept in any case.
    fn is_lost(&self) -> bool {
        let samples = self.raster.pixels() * self.raster.channels;
        let best = self.best.as_ref().filter(|_| self.quantizers.is_none());
        best.is_some_and(|best| best.is_lost(self.error, samples))
    }

    /// Renders the Gaussians as the file would store them, and computes error and gradients.
    /// Measures the distortions if Gaussians are to be added.
    fn forward(&mut self, grows: bool, observer: &mut Observer<'_>) -> Result<(), EncodeError> {
        let measure = grows.then_some(self.training.densification.distortion);
        if !self.has_splats {
            self.make_splats(observer)?;
        }
        let kernel = self.training.kernel;
        if self.binned_for == 0 {
            self.pass.bin(self.raster, &self.splats, kernel, observer)?;
            self.binned_for = REBIN_INTERVAL;
        }
        self.binned_for -= 1;
        self.work.evaluations += self.pass.evaluations();
        self.error =
            self.pass.run(self.raster, &self.splats, kernel, self.base, measure, observer)?;
        Ok(())
    }

    /// Sets the splats to those of the present values.
    fn make_splats(&mut self, observer: &mut Observer<'_>) -> Result<(), EncodeError> {
        let (parameterization, quantizers) = (self.bounds.parameterization, &self.quantizers);
        reset(&mut self.splats, self.parameters.len(), Splat::NOWHERE);
        let chunks = self.parameters.values.chunks(CHUNK);
        let chunks = chunks.zip(self.splats.chunks_mut(CHUNK));
        observer.map(WORK * CHUNK as f64, chunks, |(values, splats)| {
            for (values, splat) in values.iter().zip(splats) {
                *splat = decoded(quantizers.as_ref(), values).splat(parameterization);
            }
        })?;
        self.has_splats = true;
        Ok(())
    }

    /// A step of the optimizer against the gradients by trained values, and one against those by the
    /// quantizers. The splats of the last pass are kept if Gaussians are to be added where it went wrong.
    fn step(
        &mut self,
        factor: f32,
        grows: bool,
        observer: &mut Observer<'_>,
    ) -> Result<(), EncodeError> {
        let channels = self.raster.channels;
        let rate_term = (self.precision == Precision::Entropy)
            .then(|| RateTerm::new(self.error.distortion, self.len(), channels));
        let backward = Backward {
            pass: &self.pass,
            raster: self.raster,
            bounds: self.bounds,
            rate_term,
            quantizers: self.quantizers.as_ref(),
        };
        // A step of the quantizers changes the splats again.
        self.has_splats = !grows && self.quantizers.is_none();
        let splats = if self.has_splats { &mut self.splats[..] } else { &mut [] };
        let by_quantizers = self.parameters.step(&backward, factor, splats, observer)?;
        if let Some(quantizers) = &mut self.quantizers {
            let rate = self.training.quantization.learning_rate * factor;
            quantizers.step(&by_quantizers, &self.parameters.values, rate);
        }
        Ok(())
    }

    /// Densification: adds up to `count` Gaussians where the distortion is large, and up to `replaced`
    /// more in place of the least important ones. Where there is no place for all, fewer are replaced.
    fn grow(
        &mut self,
        count: usize,
        replaced: usize,
        observer: &mut Observer<'_>,
    ) -> Result<(), EncodeError> {
        if count + replaced == 0 {
            return Ok(());
        }
        let pass = Rendered {
            pass: &self.pass,
            raster: self.raster,
            splats: &self.splats,
            kernel: self.training.kernel,
            base: self.base,
        };
        let densifier = Densifier {
            options: &self.training.densification,
            filter: self.training.filter,
            pass,
            bounds: self.bounds,
            count: self.parameters.len() - replaced,
        };
        let new = densifier.new_gaussians(count + replaced, &mut self.rng, observer)?;
        observer.poll()?;
        self.cull(new.len() * replaced / (count + replaced), observer)?;
        self.free_bins();
        self.parameters.extend(&new);
        self.parameters.sort(observer)?;
        self.invalidate();
        Ok(())
    }

    /// Discards the best state and the bins, which are not valid after Gaussians were added,
    /// removed or quantized.
    fn invalidate(&mut self) {
        self.best = None;
        self.binned_for = 0;
        self.has_splats = false;
    }

    /// Culling: removes the `count` Gaussians of least importance.
    fn cull(&mut self, count: usize, observer: &mut Observer<'_>) -> Result<(), EncodeError> {
        let count = count.min(self.len());
        if count == 0 {
            return Ok(());
        }
        let parameterization = self.bounds.parameterization;
        let chunks = self.parameters.values.chunks(CHUNK).enumerate();
        // In the order of importance, and of equal ones in that of the Gaussians.
        let keys = observer.map(WORK * CHUNK as f64, chunks, |(chunk, values)| {
            let key = |(index, values): (usize, &Components)| {
                let gaussian = values.gaussian(parameterization);
                let Gaussian { center, cholesky, .. } = gaussian;
                let sensitivity = self.raster.sensitivity_under(center, cholesky);
                u64::from(ordered(gaussian.importance() * sensitivity)) << 32 | index as u64
            };
            (chunk * CHUNK..).zip(values).map(key).collect::<Vec<u64>>()
        })?;
        let mut keys = keys.concat();
        observer.poll()?;
        keys.select_nth_unstable(count - 1);
        let mut keep = vec![true; keys.len()];
        for key in &keys[..count] {
            // The cast leaves the index.
            keep[*key as u32 as usize] = false;
        }
        observer.poll()?;
        self.parameters.retain(|index| keep[index]);
        self.invalidate();
        observer.poll()
    }

    /// Pruning: removes Gaussians that are invalid, nearly without colour, or outside the picture.
    fn prune(&mut self, observer: &mut Observer<'_>) -> Result<(), EncodeError> {
        let values = &self.parameters.values;
        let parameterization = self.bounds.parameterization;
        let quantizers = self.quantizers.as_ref();
        let is_visible = |index: usize| {
            let gaussian = decoded(quantizers, &values[index]).gaussian(parameterization);
            let has_color = gaussian.color.iter().any(|color| color.abs() >= MIN_COLOR);
            let is_inside = self.pass.touches(index);
            gaussian.is_drawable() && has_color && is_inside
        };
        let keep = observer.map(WORK, 0..values.len(), is_visible)?;
        if keep.contains(&false) {
            self.parameters.retain(|index| keep[index]);
            self.invalidate();
        }
        observer.poll()
    }

    /// Starts quantization-aware training (paper, section "Compression Framework").
    fn start_quantization(&mut self) {
        for values in &mut self.parameters.values {
            *values = self.bounds.clamped(*values);
        }
        self.float_error = self.error.squared;
        self.quantizers = Some(LsqQuantizers::new(
            &self.parameters.values,
            self.bounds,
            &self.training.quantization,
        ));
        self.invalidate();
    }

    /// Ends training: renders the values of the last step, keeps them if they are the best, and
    /// frees memory.
    fn settle(&mut self, observer: &mut Observer<'_>) -> Result<(), EncodeError> {
        self.binned_for = 0;
        self.forward(false, observer)?;
        self.keep_if_best();
        self.binned_for = 0;
        self.free_bins();
        Ok(())
    }

    /// Frees the bins and splats, which the next pass makes again.
    fn free_bins(&mut self) {
        self.pass.free_bins();
        self.splats = Vec::new();
        self.has_splats = false;
    }

    /// Keeps a copy of the values of the last pass if their error is the least so far.
    fn keep_if_best(&mut self) {
        let best = self.best.get_or_insert_with(Checkpoint::new);
        if self.error.distortion < best.error.distortion {
            let (tiles, values) = (self.pass.tile_distortions(), &self.parameters.values);
            best.set(self.error, tiles, values, self.quantizers.as_ref());
        }
    }

    /// Takes the values of the best state again after a setback, and smaller steps from there where the
    /// distortion rose.
    fn return_to_best(&mut self) {
        let Some(best) = &mut self.best else { return };
        let blamed = best.blamed(self.pass.tile_distortions());
        self.parameters.values.copy_from_slice(&best.values);
        let pass = &self.pass;
        self.parameters.slow_down(|values| blamed[pass.tile_near(values.center)]);
        self.binned_for = 0;
        self.has_splats = false;
    }

    /// PSNR of the last pass, in dB.
    fn psnr(&self) -> f64 {
        let samples = (self.raster.pixels() * self.raster.channels) as f64;
        10.0 * (samples / self.error.squared).log10()
    }

    /// Size in bytes.
    fn memory(&self) -> usize {
        let best = self.best.as_ref().map_or(0, |best| best.values.capacity());
        self.raster.memory()
            + self.pass.memory()
            + self.parameters.memory()
            + best * size_of::<Components>()
            + self.splats.capacity() * size_of::<Splat>()
    }
}

/// A number that is larger for larger values, in the order of [`f32::total_cmp`].
fn ordered(value: f32) -> u32 {
    let bits = value.to_bits();
    if bits >> 31 == 0 { bits | 1 << 31 } else { !bits }
}

#[cfg(test)]
mod tests {
    use super::ordered;

    #[test]
    fn ordered_numbers_are_in_total_order() {
        let values =
            [-f32::NAN, f32::NEG_INFINITY, -2.0, -0.0, 0.0, 1e-40, 1.0, f32::INFINITY, f32::NAN];
        assert!(values.is_sorted_by(|a, b| a.total_cmp(b).is_lt()));
        assert!(values.is_sorted_by(|a, b| ordered(*a) < ordered(*b)));
    }
}
