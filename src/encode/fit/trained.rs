//! The Gaussians of a picture during training: their passes, their steps and their best state.

use super::backward::Backward;
use super::bins::reset;
use super::budget::Budget;
use super::checkpoint::Checkpoint;
use super::components::{Bounds, Components};
use super::paper::{LsqQuantizers, decoded};
use super::parameters::Parameters;
use super::pass::{Pass, Scene};
use super::rate_term::RateTerm;
use super::training::Training;
use crate::coding::packed::{PackedCodes, Quantizer};
use crate::encode::error::Result;
use crate::encode::loss::{RenderingError, SquaredError};
use crate::encode::options::Precision;
use crate::encode::progress::Observer;
use crate::encode::resolutions::Resolutions;
use crate::encode::tiled_source::TiledSource;
use crate::gaussian::{Gaussian, MAX_GAUSSIANS, component_count};
use crate::render::splat::Splat;

// Constants: docs/tuning.md, "Iterations".
/// The squared error, as a multiple of that before quantization, from which on it is mostly rounding.
const LOST: f64 = 2.0;
/// Passes with the same bins, while no Gaussians are added or removed.
const REBIN_INTERVAL: u32 = 8;

/// What fits have cost.
#[derive(Clone, Copy, Debug, Default)]
pub(crate) struct Work {
    pub(crate) iterations: u32,
    /// Evaluations of the kernel, one for each pair of a Gaussian and a pixel.
    pub(crate) evaluations: u64,
    /// In bytes.
    pub(crate) peak_memory: usize,
}

/// What follows a pass and its step.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum Next {
    /// Gaussians are added where the pass went wrong.
    Growth,
    /// Another pass.
    Pass,
}

/// The Gaussians of a picture during training.
#[derive(Debug)]
pub(crate) struct Fit<'a> {
    pub(super) resolutions: Resolutions<'a>,
    /// How often the resolution is halved at present.
    pub(super) halvings: usize,
    /// The source at this resolution.
    pub(super) tiled: &'a TiledSource,
    pub(super) training: &'a Training,
    pub(super) budget: Budget,
    pub(super) precision: Precision,
    pub(super) base: [f32; 4],
    pub(super) bounds: Bounds,
    pub(super) parameters: Parameters,
    /// The quantizers, once quantization-aware training has started.
    pub(super) quantizers: Option<LsqQuantizers>,
    /// The squared error before quantization started; 0 without it.
    float_error: SquaredError,
    /// The state of least error since Gaussians were last added or removed.
    pub(super) best: Option<Checkpoint>,
    pub(super) pass: Pass,
    /// Passes for which the present bins remain valid.
    pub(super) binned_for: u32,
    /// The splats of the last pass; after a step, those of the next one if `has_splats`.
    pub(super) splats: Vec<Splat>,
    /// Whether `splats` are those of the present values.
    has_splats: bool,
    /// The error of the last pass.
    pub(super) error: RenderingError,
    pub(super) work: Work,
    pub(super) rng: fastrand::Rng,
    /// Whether the Gaussians are from elsewhere.
    pub(super) is_adopted: bool,
}

impl<'a> Fit<'a> {
    pub(crate) fn new(
        resolutions: Resolutions<'a>,
        training: &'a Training,
        budget: Budget,
        precision: Precision,
        base: [f32; 4],
        seed: u64,
        work: Work,
    ) -> Self {
        let tiled = resolutions.picture;
        Self {
            resolutions,
            halvings: 0,
            tiled,
            training,
            budget,
            precision,
            base,
            bounds: bounds_of(training, tiled),
            parameters: Parameters::new(&training.optimizer),
            quantizers: None,
            float_error: SquaredError::default(),
            best: None,
            pass: Pass::new(tiled),
            binned_for: 0,
            splats: Vec::new(),
            has_splats: false,
            error: RenderingError::default(),
            work,
            rng: fastrand::Rng::with_seed(seed),
            is_adopted: false,
        }
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
                quantizers: vec![Quantizer::Float; component_count(self.tiled.channels)],
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

    /// Whether the Gaussians are from elsewhere, so that their error tells nothing of their number.
    pub(crate) fn is_adopted(&self) -> bool {
        self.is_adopted
    }

    /// Whether most of the error is that of quantization: fewer Gaussians, which overlap less, may show a
    /// better picture.
    pub(crate) fn is_lost_to_rounding(&self) -> bool {
        self.quantizers.is_some() && self.best_error().squared.0 > LOST * self.float_error.0
    }

    /// Goes on at another resolution, where the picture is halved this often.
    pub(super) fn set_halvings(&mut self, halvings: usize) {
        if halvings == self.halvings {
            return;
        }
        let factor = (self.halvings as f32 - halvings as f32).exp2();
        self.parameters.scale(factor, self.training.parameterization);
        self.halvings = halvings;
        self.tiled = self.resolutions.halved(halvings);
        self.bounds = bounds_of(self.training, self.tiled);
        self.pass = Pass::new(self.tiled);
        self.invalidate();
    }

    /// How often the resolution may be halved for so many Gaussians, at the error of the last pass.
    pub(super) fn halvings_for(&self, count: usize) -> usize {
        let Some(density) = self.training.coarse_to_fine else { return 0 };
        let error = self.error.squared.0 / self.tiled.samples() as f64;
        let copies = self.resolutions.copies.iter();
        copies.take_while(|copy| copy.suits(count, density, error)).count()
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
        self.resolutions.picture.pixels().min(MAX_GAUSSIANS as usize)
    }

    /// Whether the last step lost what training had. Codes that flip make the error jump, which is no
    /// loss: the best state is kept in any case.
    pub(super) fn is_lost(&self) -> bool {
        let best = self.best.as_ref().filter(|_| self.quantizers.is_none());
        best.is_some_and(|best| best.is_lost(self.error, self.tiled.samples()))
    }

    /// Renders the Gaussians as the file would store them, and computes error and gradients.
    /// Measures the placement errors if Gaussians are to be added.
    pub(super) fn forward(&mut self, next: Next, observer: &mut Observer<'_>) -> Result<()> {
        let norm = (next == Next::Growth).then_some(self.training.densification.error_norm);
        if !self.has_splats {
            self.make_splats(observer)?;
        }
        let (kernel, base) = (self.training.kernel, self.base);
        let scene = Scene { tiled: self.tiled, splats: &self.splats, kernel, base };
        if self.binned_for == 0 {
            self.pass.bin(&scene, observer)?;
            self.binned_for = REBIN_INTERVAL;
        }
        self.binned_for -= 1;
        self.work.evaluations += self.pass.evaluations();
        self.error = self.pass.run(&scene, norm, observer)?;
        Ok(())
    }

    /// Sets the splats to those of the present values.
    fn make_splats(&mut self, observer: &mut Observer<'_>) -> Result<()> {
        let (parameterization, quantizers) = (self.bounds.parameterization, &self.quantizers);
        reset(&mut self.splats, self.parameters.len(), Splat::NOWHERE);
        let items = self.parameters.values.iter().zip(&mut self.splats);
        observer.map(items, |(values, splat)| {
            *splat = decoded(quantizers.as_ref(), values).splat(parameterization);
        })?;
        self.has_splats = true;
        Ok(())
    }

    /// A step of the optimizer against the gradients by trained values, and one against those by the
    /// quantizers. The splats of the last pass are kept if Gaussians are to be added where it went wrong.
    pub(super) fn step(
        &mut self,
        factor: f32,
        next: Next,
        observer: &mut Observer<'_>,
    ) -> Result<()> {
        let TiledSource { channels, loss, .. } = self.tiled;
        let rate_term = (self.precision == Precision::Entropy)
            .then(|| RateTerm::new(loss.tune(), self.error.distortion, self.len(), *channels));
        let backward = Backward {
            pass: &self.pass,
            tiled: self.tiled,
            bounds: self.bounds,
            quantizers: self.quantizers.as_ref(),
        };
        // A step of the quantizers changes the splats again.
        self.has_splats = next == Next::Pass && self.quantizers.is_none();
        let splats = if self.has_splats { &mut self.splats[..] } else { &mut [] };
        let by_quantizers = self.parameters.step(&backward, rate_term, factor, splats, observer)?;
        if let Some(quantizers) = &mut self.quantizers {
            let rate = self.training.quantization.learning_rate * factor;
            quantizers.step(&by_quantizers, &self.parameters.values, rate);
        }
        Ok(())
    }

    /// Discards the best state and the bins, which are not valid after Gaussians were added,
    /// removed or quantized.
    pub(super) fn invalidate(&mut self) {
        self.best = None;
        self.binned_for = 0;
        self.has_splats = false;
    }

    /// Starts quantization-aware training (paper, section "Compression Framework").
    pub(super) fn start_quantization(&mut self) {
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

    /// Frees the bins and splats, which the next pass makes again.
    pub(super) fn free_bins(&mut self) {
        self.pass.free_bins();
        self.splats = Vec::new();
        self.has_splats = false;
    }

    /// Keeps a copy of the values of the last pass if their error is the least so far.
    pub(super) fn keep_if_best(&mut self) {
        let best = self.best.get_or_insert_with(Checkpoint::new);
        if self.error.distortion < best.error.distortion {
            let (tiles, values) = (self.pass.tile_distortions(), &self.parameters.values);
            best.set(self.error, tiles, values, self.quantizers.as_ref());
        }
    }

    /// Takes the values of the best state again after a setback, and smaller steps from there where the
    /// distortion rose.
    pub(super) fn return_to_best(&mut self) {
        let Some(best) = &mut self.best else { return };
        let blamed = best.blamed(self.pass.tile_distortions());
        self.parameters.values.copy_from_slice(&best.values);
        let pass = &self.pass;
        self.parameters.slow_down(|values| blamed[pass.tile_near(values.center)]);
        self.binned_for = 0;
        self.has_splats = false;
    }

    /// PSNR of the last pass, in dB.
    pub(super) fn psnr(&self) -> f64 {
        self.error.squared.psnr(self.tiled.samples())
    }

    /// Size in bytes.
    pub(super) fn memory(&self) -> usize {
        let best = self.best.as_ref().map_or(0, |best| best.values.capacity());
        self.resolutions.memory()
            + self.pass.memory()
            + self.parameters.memory()
            + best * size_of::<Components>()
            + self.splats.capacity() * size_of::<Splat>()
    }
}

/// The bounds of trained values for a source.
fn bounds_of(training: &Training, tiled: &TiledSource) -> Bounds {
    let size = [tiled.width as u32, tiled.height as u32];
    Bounds::new(training.parameterization, tiled.channels, size)
}
