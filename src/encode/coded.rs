//! From fitted Gaussians to a file of coding 1 that meets its target.

use super::EncodeError;
use super::descent::Descent;
use super::layout::Layout;
use super::options::Target;
use super::patch;
use super::progress::Observer;
use super::raster::Raster;
use crate::coding::set::{Costs, Models, SetCoding};
use crate::color::ColorModel;
use crate::gaussian::Gaussian;
use crate::lattice::{self, Code, Grid, Lattice, MAX_CLASS};
use crate::limits::Limits;
use crate::render::{Picture, RenderOptions};

/// Bits that a Gaussian takes, about: what decides how many a size holds.
pub(crate) const BITS_PER_GAUSSIAN: f64 = 35.0;
/// The share of the error that is there before rounding.
pub(crate) const SHARE_OF_FIT: f64 = 0.84;
/// How often every code is looked at, when the steps are being sought and for the file.
const SCOUTING_PASSES: u32 = 2;
const PASSES: u32 = 8;
/// How often steps are tried.
const MAX_TRIES: u32 = 5;
/// The share of a size that is aimed at, and the least that will do.
const AIMED: f64 = 0.996;
const ENOUGH: f64 = 0.99;
/// What is aimed at beyond a PSNR, and how much at most, in dB.
const PSNR_AIMED: f64 = 0.02;
const PSNR_TOLERANCE: f64 = 0.05;
/// Steps of geometry that harm as much as a step of colour, for a Gaussian of amplitude 1: from
/// integrals of the quartic kernel's derivatives.
const POSITION: f32 = 1.25;
const SIZE: f32 = 0.66;
const RATIO: f32 = 0.935;
const SLANT: f32 = 1.87;
/// Squared error that a bit is worth, in squared steps of colour: where the error of rounding
/// falls as fast by finer steps as it grows by their bits.
const LAMBDA: f32 = 0.322;
/// The squared step of colour for a squared error of 1 per Gaussian.
const STEP: f64 = 0.094;

/// Gaussians on a lattice.
#[derive(Clone, Debug)]
pub(crate) struct Coded {
    pub(crate) lattice: Lattice,
    pub(crate) codes: Vec<Code>,
}

/// What fitted Gaussians are coded for.
#[derive(Debug)]
pub(crate) struct Coder<'a> {
    raster: &'a Raster,
    layout: &'a Layout<'a>,
    grid: Grid,
    model: ColorModel,
}

impl<'a> Coder<'a> {
    pub(crate) fn new(raster: &'a Raster, layout: &'a Layout<'a>) -> Self {
        let header = layout.header();
        let grid = Grid::new(header.width, header.height);
        Self { raster, layout, grid, model: header.color }
    }

    /// Codes `gaussians`, whose picture has the squared error `error`, for a target.
    pub(crate) fn encode(
        &self,
        gaussians: &[Gaussian],
        error: f64,
        target: Target,
        observer: &mut Observer<'_>,
    ) -> Result<Coded, EncodeError> {
        let mut step = (STEP * error / gaussians.len().max(1) as f64).sqrt();
        let bytes = target.bytes(self.raster.pixels());
        let mut passes = if bytes.is_some() { SCOUTING_PASSES } else { PASSES };
        let mut coded = self.coded(gaussians, step as f32, passes, observer)?;
        for _ in 0..MAX_TRIES {
            let next = match (bytes, target) {
                (Some(bytes), _) => self.step_for_size(&coded, step, bytes),
                (None, Target::Psnr(psnr)) => self.step_for_psnr(&coded, step, error, psnr),
                _ => None,
            };
            match next {
                Some(next) => step = next,
                None if passes == PASSES => break,
                None => {}
            }
            passes = PASSES;
            coded = self.coded(gaussians, step as f32, passes, observer)?;
        }
        Ok(coded)
    }

    /// The step that brings the file to a size; `None` if it is there.
    fn step_for_size(&self, coded: &Coded, step: f64, bytes: u64) -> Option<f64> {
        let size = self.layout.write_set(coded).len() as f64;
        let wanted = bytes as f64;
        let is_met = (ENOUGH * wanted..=wanted).contains(&size);
        // Each of eight attributes takes a bit less when the step doubles.
        let gaussians = coded.codes.len().max(1) as f64;
        let factor = ((size - AIMED * wanted) / gaussians).clamp(-1.0, 1.0).exp2();
        (!is_met).then_some(step * factor)
    }

    /// The step that brings the picture to a PSNR; `None` if it is there.
    fn step_for_psnr(&self, coded: &Coded, step: f64, fit: f64, psnr: f64) -> Option<f64> {
        let samples = (self.raster.pixels() * self.raster.channels) as f64;
        let error = self.rendered(coded).error();
        let reached = 10.0 * (samples / error).log10();
        let is_met = (psnr..=psnr + PSNR_TOLERANCE).contains(&reached);
        let wanted =
            samples * (-(psnr + PSNR_AIMED) / 10.0).exp2().powf(core::f64::consts::LOG2_10);
        // What rounding adds grows with the square of the step.
        let factor = ((wanted - fit).max(0.01 * wanted) / (error - fit).max(0.01 * wanted)).sqrt();
        (!is_met).then_some(step * factor.clamp(0.25, 4.0))
    }

    /// Rounds `gaussians` to the lattice of a step, and descends from there.
    fn coded(
        &self,
        gaussians: &[Gaussian],
        step: f32,
        passes: u32,
        observer: &mut Observer<'_>,
    ) -> Result<Coded, EncodeError> {
        let lattice = Lattice {
            position: POSITION,
            size: SIZE,
            ratio: RATIO,
            slant: SLANT,
            color: vec![step; self.model.channels()],
        };
        let codes = gaussians.iter().map(|gaussian| {
            let class = class_of(gaussian, step, self.model);
            lattice.code(gaussian, class, &self.grid, self.model)
        });
        let mut coded = Coded { codes: codes.collect(), lattice };
        for _ in 0..passes {
            let (costs, levels, bits) = self.walked(&mut coded);
            let mut picture = self.rendered(&coded);
            let coding = self.coding(&coded.lattice);
            let codes = coded.codes.iter().zip(&levels);
            let own: f32 = codes.map(|(code, level)| coding.cost(*code, *level, &costs)).sum();
            let tree = ((bits - own) / coded.codes.len().max(1) as f32).max(0.0);
            let lambda = LAMBDA * step * step;
            let descent = Descent { coding, model: self.model, costs: &costs, tree, lambda };
            let changed = descent.pass(&mut picture, &mut coded.codes, &levels, observer)?;
            if changed == 0 {
                break;
            }
        }
        // For the file's order and centres.
        self.walked(&mut coded);
        Ok(coded)
    }

    fn coding<'b>(&self, lattice: &'b Lattice) -> SetCoding<'b> {
        SetCoding { lattice, grid: self.grid, channels: self.model.channels() }
    }

    /// Sorts and rounds the codes as the file has them; what symbols cost then, the levels of the
    /// cells, and the bits of all.
    fn walked(&self, coded: &mut Coded) -> (Costs, Vec<u32>, f32) {
        let (mut models, mut levels) = (Models::default(), Vec::new());
        let coding = self.coding(&coded.lattice);
        let payload = coding.write(&mut coded.codes, &mut levels, &mut models);
        (models.costs(), levels, 8.0 * payload.len() as f32)
    }

    /// The picture of the codes, as the decoder makes it.
    fn rendered(&self, coded: &Coded) -> patch::Picture {
        let gaussians: Vec<Gaussian> = coded
            .codes
            .iter()
            .map(|code| coded.lattice.gaussian(code, &self.grid, self.model))
            .collect();
        let limits = Limits::none();
        let picture = Picture::new(self.layout.header(), &gaussians, &limits, 0);
        let options = RenderOptions::new();
        let mut planes = vec![0.0; self.raster.pixels() * self.raster.channels];
        picture.render_planes(&options, &mut planes).expect("there are no limits");
        patch::Picture::new(self.raster, &planes)
    }
}

/// The class of precision for a Gaussian's strength.
fn class_of(gaussian: &Gaussian, step: f32, model: ColorModel) -> u32 {
    let [l11, _, l22] = gaussian.cholesky;
    let squared = lattice::to_axes(gaussian.color, model).iter().map(|c| c * c).sum::<f32>();
    let steps = (squared * l11 * l22).sqrt() / step;
    steps.max(1.0).log2().round().min(MAX_CLASS as f32) as u32
}
