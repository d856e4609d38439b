//! The training loop: from a picture to Gaussians (paper, section "Methodology").

mod adam;
mod bins;
pub(crate) mod budget;
mod densify;
mod lsq;
mod parameterization;
mod pass;
mod schedule;
pub(crate) mod training;

use glam::Vec2;
use rayon::prelude::*;

use adam::{Domain, Parameters, Row, shape_of};
use budget::Budget;
use densify::{Site, USELESS_COLOR};
use lsq::{LsqQuantizers, QuantizerGradients};
use pass::Pass;
use schedule::TrainingSchedule;
use training::{Portion, Training};

use super::error::EncodeError;
use super::options::{MAX_GAUSSIANS, Precision};
use super::progress::{Observer, Progress};
use super::raster::Raster;
use super::rate_model::Shrinkage;
use crate::coding::packed::{PackedCodes, Quantizer};
use crate::gaussian::{Gaussian, MAX_COMPONENTS};
use crate::render::splat::Splat;

/// How much the error is expected to fall by training alone, once growth has ended.
const FORESEEN: f64 = 0.75;
/// Passes from one binning to the next, while no Gaussians come or go.
const REBIN_INTERVAL: u32 = 8;
/// Gaussians that one thread prepares in one go.
const CHUNK: usize = 512;

/// What fits took.
#[derive(Clone, Copy, Debug, Default)]
pub(crate) struct Work {
    pub(crate) iterations: u32,
    pub(crate) evaluations: u64,
    /// Bytes.
    pub(crate) peak_memory: usize,
}

/// A picture being fitted.
#[derive(Debug)]
pub(crate) struct Fit<'a> {
    raster: &'a Raster,
    training: &'a Training,
    budget: Budget,
    precision: Precision,
    base: [f32; 4],
    bounds: Domain,
    parameters: Parameters,
    quantizers: Option<LsqQuantizers>,
    best: Option<Snapshot>,
    pass: Pass,
    /// Passes for which the bins are good yet.
    binned_for: u32,
    splats: Vec<Splat>,
    /// Sum of squared errors of the last pass.
    error: f64,
    work: Work,
    rng: fastrand::Rng,
}

/// A state of training that can be written to a file.
#[derive(Clone, Debug)]
struct Snapshot {
    error: f64,
    rows: Vec<Row>,
    quantizers: Option<LsqQuantizers>,
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
            bounds: Domain {
                parameterization: training.parameterization,
                channels: raster.channels,
                size: Vec2::new(raster.width as f32, raster.height as f32),
            },
            parameters: Parameters::default(),
            quantizers: None,
            best: None,
            pass: Pass::new(raster),
            binned_for: 0,
            splats: Vec::new(),
            error: 0.0,
            work,
            rng: fastrand::Rng::with_seed(seed),
        }
    }

    /// Trains from nothing.
    pub(crate) fn run(&mut self, observer: &mut Observer<'_>) -> Result<(), EncodeError> {
        let Training { iterations, densification, optimizer, .. } = self.training;
        let plan = TrainingSchedule::new(self.training, self.precision);
        self.forward(observer)?;
        let first = densification.initial * self.wanted(1.0) as f32;
        self.grow((first.ceil() as usize).max(1), observer)?;
        let mut kept = usize::MAX;
        let total = self.work.iterations + iterations;
        for iteration in 0..*iterations {
            if iteration == plan.quantized_from {
                self.start_quantization();
            }
            let factor = optimizer.schedule.factor(iteration, *iterations);
            self.iterate(factor, total, plan.is_settled(iteration), observer)?;
            let done = iteration + 1;
            if done % densification.prune_interval == 0 {
                self.prune();
            }
            if let Some(steps_left) = plan.growths_left(done) {
                kept = self.wanted(FORESEEN);
                let portion = self.portion(kept, steps_left);
                let replaced = (densification.replaced * self.len() as f32) as usize;
                self.cull(replaced);
                self.grow(portion + replaced, observer)?;
            }
            if let Some(culls_left) = plan.culls_left(done) {
                // In a simple picture the error may fall much faster with the count than foreseen.
                kept = kept.max(self.wanted(FORESEEN));
                // Growth may have ended before the budget, where there is little to correct.
                let surplus = self.len().saturating_sub(kept);
                self.cull(surplus / (culls_left as usize + 1));
            }
        }
        self.settle(observer)
    }

    /// Adds `count` Gaussians to a finished fit and trains all for a quarter of the iterations more.
    pub(crate) fn extend(
        &mut self,
        count: usize,
        observer: &mut Observer<'_>,
    ) -> Result<(), EncodeError> {
        if let Some(best) = self.best.take() {
            self.parameters.replace(best.rows);
            self.quantizers = best.quantizers;
            self.binned_for = 0;
        }
        self.forward(observer)?;
        self.grow(count, observer)?;
        let iterations = self.training.iterations.div_ceil(4);
        let total = self.work.iterations + iterations;
        for iteration in 0..iterations {
            let factor = 0.5 * (1.0 - iteration as f32 / iterations as f32);
            self.iterate(factor, total, true, observer)?;
        }
        self.settle(observer)
    }

    /// The best Gaussians so far.
    pub(crate) fn fitted(&self) -> PackedCodes {
        let empty = Snapshot { error: 0.0, rows: Vec::new(), quantizers: None };
        let Snapshot { rows, quantizers, .. } = self.best.as_ref().unwrap_or(&empty);
        match quantizers {
            Some(quantizers) => PackedCodes {
                quantizers: quantizers.stored(),
                codes: rows.iter().map(|row| quantizers.codes(row)).collect(),
            },
            None => PackedCodes {
                quantizers: vec![Quantizer::Float; 5 + self.raster.channels],
                codes: rows.iter().map(|row| row.map(f32::to_bits)).collect(),
            },
        }
    }

    /// The best Gaussians so far, as they are.
    pub(crate) fn gaussians(&self) -> Vec<Gaussian> {
        let rows = self.best.as_ref().map_or(&[][..], |best| &best.rows);
        let components = 5 + self.raster.channels;
        let gaussian =
            |row: &Row| Gaussian::from_components(&row[..components], self.bounds.parameterization);
        rows.iter().map(gaussian).collect()
    }

    /// The squared error of the best Gaussians.
    pub(crate) fn best_error(&self) -> f64 {
        self.best.as_ref().map_or(self.error, |best| best.error)
    }

    /// What training has taken so far.
    pub(crate) fn work(&self) -> Work {
        self.work
    }

    pub(crate) fn len(&self) -> usize {
        self.parameters.len()
    }

    /// Most Gaussians that this picture may get: one per pixel.
    pub(crate) fn most(&self) -> usize {
        self.raster.pixels().min(MAX_GAUSSIANS as usize)
    }

    /// The count that the budget asks for, if training lowers the error by `foreseen`.
    fn wanted(&self, foreseen: f64) -> usize {
        self.budget.wanted(self.parameters.len(), self.error * foreseen, self.most())
    }

    /// How many Gaussians to add if `kept` are to stay, with so many steps to come after this one.
    fn portion(&self, kept: usize, steps_left: u32) -> usize {
        let densification = &self.training.densification;
        let grown = kept as f64 * (1.0 + f64::from(densification.surplus));
        let missing = (grown.round() as usize).saturating_sub(self.parameters.len());
        match densification.portion {
            _ if steps_left == 0 => missing,
            Portion::Even => missing.div_ceil(steps_left as usize + 1),
            Portion::Half => missing.div_ceil(2),
            Portion::Fixed(count) => missing.min(count as usize),
        }
    }

    /// One iteration: a pass, and a step of everything that is trained. If `settled`, the values
    /// of the pass are kept where they are the best so far.
    fn iterate(
        &mut self,
        factor: f32,
        iterations: u32,
        settled: bool,
        observer: &mut Observer<'_>,
    ) -> Result<(), EncodeError> {
        self.forward(observer)?;
        if settled {
            self.remember();
        }
        observer.tell(Progress {
            iteration: self.work.iterations,
            iterations,
            gaussians: self.parameters.len() as u32,
            psnr: self.psnr(),
        })?;
        self.work.iterations += 1;
        self.step(factor);
        let memory = self.memory();
        self.work.peak_memory = self.work.peak_memory.max(memory);
        Ok(())
    }

    /// Renders what the file would hold now, and takes the gradient.
    fn forward(&mut self, observer: &mut Observer<'_>) -> Result<(), EncodeError> {
        let (parameterization, quantizers) = (self.bounds.parameterization, &self.quantizers);
        let components = 5 + self.raster.channels;
        self.splats.clear();
        self.splats.reserve_exact(self.parameters.len());
        self.parameters
            .values
            .par_iter()
            .with_min_len(CHUNK)
            .map(|row| {
                let row = decoded(quantizers.as_ref(), row);
                let gaussian = Gaussian::from_components(&row[..components], parameterization);
                Splat::new(&gaussian).unwrap_or(Splat::NOWHERE)
            })
            .collect_into_vec(&mut self.splats);
        let kernel = self.training.kernel;
        if self.binned_for == 0 {
            observer.poll()?;
            self.pass.bin(self.raster, &self.splats, kernel);
            self.binned_for = REBIN_INTERVAL;
        }
        self.binned_for -= 1;
        self.work.evaluations += self.pass.evaluations();
        self.error = self.pass.run(self.raster, &self.splats, kernel, self.base, observer)?;
        Ok(())
    }

    /// Carries the pass's gradients on to the trained values and the quantizers, and takes a step
    /// of both.
    fn step(&mut self, factor: f32) {
        let (parameterization, channels) = (self.bounds.parameterization, self.raster.channels);
        let (pass, quantizers) = (&self.pass, self.quantizers.as_ref());
        let options = &self.training.optimizer;
        let shrinkage = (self.precision == Precision::Entropy)
            .then(|| Shrinkage::new(self.error, self.len(), channels));
        let by_chunk: Vec<QuantizerGradients> =
            self.parameters.step(options, self.bounds, factor, |index, row, sum| {
                let decoded = decoded(quantizers, row);
                let by_splat = pass.gradient(index, channels);
                let (center, shape) =
                    by_splat.moments.gradients(parameterization, shape_of(&decoded));
                let mut gradient = [0.0; MAX_COMPONENTS];
                gradient[..2].copy_from_slice(&center.to_array());
                gradient[2..5].copy_from_slice(&shape.to_array());
                gradient[5..].copy_from_slice(&by_splat.color);
                if let Some(shrinkage) = shrinkage {
                    let gaussian =
                        Gaussian::from_components(&decoded[..5 + channels], parameterization);
                    let by_color = shrinkage.gradient(&gaussian);
                    gradient[5..].iter_mut().zip(by_color).for_each(|(sum, part)| *sum += part);
                }
                if let Some(quantizers) = quantizers {
                    add(sum, &quantizers.backward(row, &decoded, &mut gradient));
                }
                gradient
            });
        if let Some(quantizers) = &mut self.quantizers {
            // In the order of the Gaussians, whatever thread was first.
            let mut total = QuantizerGradients::default();
            by_chunk.iter().for_each(|sum| add(&mut total, sum));
            let rate = self.training.quantization.learning_rate * factor;
            quantizers.step(&total, self.parameters.len(), rate);
        }
    }

    fn grow(&mut self, count: usize, observer: &mut Observer<'_>) -> Result<(), EncodeError> {
        if count == 0 {
            return Ok(());
        }
        // They are of no use to the new population, and room for the map of distortions.
        self.unbin();
        let site = Site {
            options: &self.training.densification,
            filter: self.training.filter,
            raster: self.raster,
            pass: &self.pass,
            bounds: self.bounds,
            present: self.parameters.len(),
        };
        observer.poll()?;
        let newcomers = site.newcomers(count, &mut self.rng);
        observer.poll()?;
        self.parameters.extend(&newcomers);
        self.parameters.sort();
        self.restarted();
        Ok(())
    }

    /// Forgets what was known of the values before: other Gaussians, or elsewhere.
    fn restarted(&mut self) {
        self.best = None;
        self.binned_for = 0;
    }

    /// Removes the `count` Gaussians of least importance.
    fn cull(&mut self, count: usize) {
        let count = count.min(self.len());
        if count == 0 {
            return;
        }
        let (parameterization, components) =
            (self.bounds.parameterization, 5 + self.raster.channels);
        let rows = self.parameters.values.par_iter();
        let importances: Vec<f32> = rows
            .map(|row| Gaussian::from_components(&row[..components], parameterization).importance())
            .collect();
        let mut order: Vec<u32> = (0..importances.len() as u32).collect();
        order.select_nth_unstable_by(count - 1, |a, b| {
            importances[*a as usize].total_cmp(&importances[*b as usize]).then_with(|| a.cmp(b))
        });
        let mut keep = vec![true; importances.len()];
        for &index in &order[..count] {
            keep[index as usize] = false;
        }
        self.parameters.retain(|index| keep[index]);
        self.restarted();
    }

    /// Removes Gaussians that are invalid, or that nobody would miss.
    fn prune(&mut self) {
        let values = &self.parameters.values;
        let (parameterization, components) =
            (self.bounds.parameterization, 5 + self.raster.channels);
        let quantizers = self.quantizers.as_ref();
        let useful = |index: usize| {
            let row = decoded(quantizers, &values[index]);
            let gaussian = Gaussian::from_components(&row[..components], parameterization);
            let visible = gaussian.color.iter().any(|color| color.abs() >= USELESS_COLOR);
            let inside = self.pass.touches(index);
            gaussian.is_drawable() && visible && inside
        };
        let keep: Vec<bool> = (0..values.len()).into_par_iter().map(useful).collect();
        if keep.contains(&false) {
            self.parameters.retain(|index| keep[index]);
            self.restarted();
        }
    }

    fn start_quantization(&mut self) {
        for row in &mut self.parameters.values {
            *row = self.bounds.confined(*row);
        }
        self.quantizers = Some(LsqQuantizers::new(
            &self.parameters.values,
            self.bounds,
            &self.training.quantization,
        ));
        self.restarted();
    }

    /// Looks at the values of the last step, which no pass has seen yet.
    fn settle(&mut self, observer: &mut Observer<'_>) -> Result<(), EncodeError> {
        self.binned_for = 0;
        self.forward(observer)?;
        self.remember();
        self.binned_for = 0;
        self.unbin();
        Ok(())
    }

    /// Gives back what passes need and the next one makes anew.
    fn unbin(&mut self) {
        self.pass.unbin();
        self.splats = Vec::new();
    }

    /// Keeps the values of the last pass if they are the best so far.
    fn remember(&mut self) {
        if self.best.as_ref().is_none_or(|best| self.error < best.error) {
            let best = self.best.get_or_insert_with(|| Snapshot {
                error: 0.0,
                rows: Vec::new(),
                quantizers: None,
            });
            best.error = self.error;
            // Without room for more, which `clone_from` would take.
            best.rows.clear();
            best.rows.reserve_exact(self.parameters.len());
            best.rows.extend_from_slice(&self.parameters.values);
            best.quantizers.clone_from(&self.quantizers);
        }
    }

    /// PSNR of the last pass, in dB.
    fn psnr(&self) -> f64 {
        let samples = (self.raster.pixels() * self.raster.channels) as f64;
        10.0 * (samples / self.error).log10()
    }

    fn memory(&self) -> usize {
        let best = self.best.as_ref().map_or(0, |best| best.rows.capacity());
        self.raster.memory()
            + self.pass.memory()
            + self.parameters.memory()
            + best * size_of::<Row>()
            + self.splats.capacity() * size_of::<Splat>()
    }
}

/// The values that a file would hold for a trained row.
fn decoded(quantizers: Option<&LsqQuantizers>, row: &Row) -> Row {
    quantizers.map_or(*row, |quantizers| quantizers.decoded(&quantizers.codes(row)))
}

fn add(sum: &mut QuantizerGradients, values: &QuantizerGradients) {
    for (sum, value) in sum.as_flattened_mut().iter_mut().zip(values.as_flattened()) {
        *sum += value;
    }
}
