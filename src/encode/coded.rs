//! From fitted Gaussians to a file of coding 1 that meets its target.

use super::EncodeError;
use super::budget::Budget;
use super::control::Finished;
use super::descent::Descent;
use super::fit::Fit;
use super::layout::Layout;
use super::options::{PSNR_TOLERANCE, SIZE_TOLERANCE, Target};
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
pub(crate) const BITS_PER_GAUSSIAN: f64 = 31.0;
/// The share of the error that is there before rounding.
pub(crate) const SHARE_OF_FIT: f64 = 0.84;
/// How often every code is looked at, when the steps are being sought and for the file.
const SCOUTING_PASSES: u32 = 2;
const PASSES: u32 = 8;
/// The first layers of a file, as shares of its Gaussians: a tenth of the file already shows the
/// picture.
const LAYERS: [f64; 2] = [0.08, 0.24];
/// Fewest Gaussians that are worth layers.
const LEAST_LAYERED: usize = 250;
/// How often steps are tried.
const MAX_TRIES: u32 = 5;
/// How often a finished fit may be extended.
const MAX_ROUNDS: u32 = 8;
/// What is aimed at beyond a PSNR, in dB.
const PSNR_AIMED: f64 = 0.02;
/// Steps that a lattice may have.
const STEPS: (f64, f64) = (1e-4, 16.0);
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

/// How many Gaussians a file of a size holds, about, up to `most`.
pub(crate) fn count_for_size(
    bytes: u64,
    most: usize,
    layout: &Layout<'_>,
) -> Result<usize, EncodeError> {
    let least = layout.write_set(&Coded::empty(layout.header().color)).len() as u64;
    layout.check_size(bytes, least)?;
    Ok((((bytes - least) * 8) as f64 / BITS_PER_GAUSSIAN).min(most as f64) as usize)
}

/// The file of a finished fit for the target.
pub(crate) fn finish(
    mut fit: Fit<'_>,
    raster: &Raster,
    layout: &Layout<'_>,
    target: Target,
    extension: u32,
    observer: &mut Observer<'_>,
) -> Result<Finished, EncodeError> {
    if let Target::Psnr(psnr) = target {
        extend(&mut fit, SHARE_OF_FIT * raster.error_of(psnr), extension, observer)?;
    }
    let (gaussians, error, work) = (fit.gaussians(), fit.best_error(), fit.work());
    // The descent needs the memory.
    drop(fit);
    let coded = Coder::new(raster, layout).encode(&gaussians, error, target, observer)?;
    Ok(Finished { file: layout.write_set(&coded), work })
}

/// Extends a fit until its squared error is at most `error`, or nothing helps.
fn extend(
    fit: &mut Fit<'_>,
    error: f64,
    iterations: u32,
    observer: &mut Observer<'_>,
) -> Result<(), EncodeError> {
    for _ in 0..MAX_ROUNDS {
        let before = fit.len();
        let wanted = Budget::Error(error).wanted(before, fit.best_error(), fit.most());
        if fit.best_error() <= error || wanted <= before {
            break;
        }
        fit.extend(wanted - before, iterations, observer)?;
        if fit.len() == before {
            break;
        }
    }
    Ok(())
}

/// Gaussians on a lattice.
#[derive(Clone, Debug)]
pub(crate) struct Coded {
    pub(crate) lattice: Lattice,
    pub(crate) codes: Vec<Code>,
}

impl Coded {
    fn empty(model: ColorModel) -> Self {
        Self { lattice: lattice(1.0, model), codes: Vec::new() }
    }
}

/// Layers of coded Gaussians.
#[derive(Debug)]
pub(crate) struct Written {
    pub(crate) payloads: Vec<Vec<u8>>,
    /// Of the cell of each Gaussian.
    levels: Vec<u32>,
    /// As they are after the last layer.
    models: Models,
}

/// Codes Gaussians in layers, the strongest first; sorts and rounds them as a file has them.
pub(crate) fn write_layers(coding: &SetCoding<'_>, codes: &mut [Code]) -> Written {
    let mut written =
        Written { payloads: Vec::new(), levels: Vec::new(), models: Models::default() };
    codes.sort_by_key(|code| core::cmp::Reverse(code.strength()));
    let mut rest = codes;
    for count in layer_sizes(rest.len()) {
        let (layer, later) = rest.split_at_mut(count);
        rest = later;
        let payload = coding.write(layer, &mut written.levels, &mut written.models);
        written.payloads.push(payload);
    }
    written
}

/// The sizes of the layers of a file.
fn layer_sizes(count: usize) -> Vec<usize> {
    let mut sizes: Vec<usize> = if count < LEAST_LAYERED {
        Vec::new()
    } else {
        LAYERS.iter().map(|share| (share * count as f64) as usize).collect()
    };
    let last = count - sizes.iter().sum::<usize>();
    if last > 0 {
        sizes.push(last);
    }
    sizes
}

/// The lattice of a step of colour.
fn lattice(step: f32, model: ColorModel) -> Lattice {
    Lattice {
        position: POSITION,
        size: SIZE,
        ratio: RATIO,
        slant: SLANT,
        color: vec![step; model.channels()],
    }
}

/// How a trial went.
#[derive(Clone, Copy, Debug)]
struct Judgement {
    /// Bytes, or dB.
    reached: f64,
    aimed: f64,
    /// What doubling the step should change.
    slope: f64,
    /// 0 if the target is met; the less the better, and large where it is passed on the wrong
    /// side.
    miss: f64,
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
        // Steps are sought by their logarithms to base 2.
        let mut octave = 0.5 * (STEP * error / gaussians.len().max(1) as f64).log2();
        let steered = matches!(target, Target::Psnr(_)) || target.bytes(self.pixels()).is_some();
        let mut before: Option<(f64, f64)> = None;
        let mut best: Option<(Coded, f64)> = None;
        for trial in 0..MAX_TRIES {
            let scouting = steered && trial == 0;
            let passes = if scouting { SCOUTING_PASSES } else { PASSES };
            let coded = self.coded(gaussians, octave.exp2(), passes, observer)?;
            let judgement = self.judged(&coded, target, error);
            let Judgement { reached, aimed, slope, miss } = judgement;
            if !scouting && best.as_ref().is_none_or(|(_, least)| miss < *least) {
                best = Some((coded, miss));
                if miss == 0.0 {
                    break;
                }
            }
            // What was seen between the last two trials, if it is not far from what is expected.
            let seen = before.filter(|(there, _)| trial > 1 && (octave - there).abs() > 1e-3);
            let seen = seen.map(|(there, then)| (reached - then) / (octave - there));
            let slope = seen.filter(|seen| (0.2..5.0).contains(&(seen / slope))).unwrap_or(slope);
            before = Some((octave, reached));
            octave += ((aimed - reached) / slope).clamp(-1.0, 1.0);
        }
        let (mut coded, _) = best.expect("at least one was tried");
        if let Some(bytes) = target.bytes(self.pixels()) {
            self.shorten(&mut coded, bytes);
        }
        Ok(coded)
    }

    /// How far a trial is from the target.
    fn judged(&self, coded: &Coded, target: Target, fit: f64) -> Judgement {
        if let Some(bytes) = target.bytes(self.pixels()) {
            let (reached, wanted) = (self.layout.write_set(coded).len() as f64, bytes as f64);
            // Each of eight attributes takes a bit less when the step doubles.
            let slope = -(coded.codes.len().max(1) as f64);
            // What is a little too long will be shortened.
            let off = (reached - wanted).abs() - (1.0 - SIZE_TOLERANCE) * wanted;
            return Judgement { reached, aimed: wanted, slope, miss: off.max(0.0) };
        }
        let Target::Psnr(psnr) = target else {
            return Judgement { reached: 0.0, aimed: 0.0, slope: -1.0, miss: 0.0 };
        };
        let error = self.rendered(coded).error();
        let reached = 10.0 * (self.raster.error_of(0.0) / error).log10();
        // What rounding adds to the error quadruples when the step doubles.
        let slope = -(6.0 * (error - fit) / error).clamp(0.3, 6.0);
        let above = reached - psnr;
        let miss = if above < 0.0 { 1e3 - above } else { (above - PSNR_TOLERANCE).max(0.0) };
        Judgement { reached, aimed: psnr + PSNR_AIMED, slope, miss }
    }

    /// Removes the weakest Gaussians until the file has at most `bytes`.
    fn shorten(&self, coded: &mut Coded, bytes: u64) {
        loop {
            let size = self.layout.write_set(coded).len() as u64;
            let Some(excess) = size.checked_sub(bytes).filter(|&excess| excess > 0) else { break };
            // Four bytes a Gaussian, and at least one.
            let count = excess.div_ceil(4).min(coded.codes.len() as u64) as usize;
            coded.codes.sort_by_key(|code| core::cmp::Reverse(code.strength()));
            coded.codes.truncate(coded.codes.len() - count);
        }
    }

    fn pixels(&self) -> usize {
        self.raster.pixels()
    }

    /// Rounds `gaussians` to the lattice of a step, and descends from there.
    fn coded(
        &self,
        gaussians: &[Gaussian],
        step: f64,
        passes: u32,
        observer: &mut Observer<'_>,
    ) -> Result<Coded, EncodeError> {
        let step = step.clamp(STEPS.0, STEPS.1) as f32;
        let lattice = lattice(step, self.model);
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
        let coding = self.coding(&coded.lattice);
        let written = write_layers(&coding, &mut coded.codes);
        let bytes = written.payloads.iter().map(Vec::len).sum::<usize>();
        (written.models.costs(), written.levels, 8.0 * bytes as f32)
    }

    /// The picture of the codes, as the decoder makes it.
    fn rendered(&self, coded: &Coded) -> patch::Picture {
        let gaussians: Vec<Gaussian> = coded
            .codes
            .iter()
            .map(|code| {
                let shape = coded.lattice.shape(code);
                coded.lattice.gaussian(code, &shape, &self.grid, self.model)
            })
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
