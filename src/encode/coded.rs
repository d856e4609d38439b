//! From fitted Gaussians to the codes of coding 1.

use super::EncodeError;
use super::descent::Descent;
use super::layout::Layout;
use super::patch;
use super::progress::Observer;
use super::raster::Raster;
use crate::coding::set::{Costs, Models, SetCoding};
use crate::color::ColorModel;
use crate::gaussian::Gaussian;
use crate::lattice::{self, Code, Grid, Lattice, MAX_CLASS};
use crate::limits::Limits;
use crate::render::{Picture, RenderOptions};

/// How often every code is looked at.
const PASSES: u32 = 8;
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
    pub(crate) raster: &'a Raster,
    pub(crate) layout: &'a Layout<'a>,
    pub(crate) grid: Grid,
    pub(crate) model: ColorModel,
}

impl Coder<'_> {
    /// Rounds `gaussians`, whose picture has the squared error `error`, to a lattice, and descends
    /// from there.
    pub(crate) fn code(
        &self,
        gaussians: &[Gaussian],
        error: f64,
        fineness: f32,
        observer: &mut Observer<'_>,
    ) -> Result<Coded, EncodeError> {
        let step = fineness * (STEP * error / gaussians.len().max(1) as f64).sqrt() as f32;
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
        for _ in 0..PASSES {
            let (costs, levels, bits) = self.walked(&mut coded);
            let mut picture = self.rendered(&coded);
            let coding = self.coding(&coded.lattice);
            let own: f32 = coded
                .codes
                .iter()
                .zip(&levels)
                .map(|(code, level)| coding.cost(*code, *level, &costs))
                .sum();
            let tree = (bits - own) / coded.codes.len().max(1) as f32;
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

    fn coding<'a>(&self, lattice: &'a Lattice) -> SetCoding<'a> {
        SetCoding { lattice, grid: self.grid, channels: self.model.channels() }
    }

    /// Sorts and rounds the codes as the file has them; what symbols cost then, the levels of the
    /// cells, and the bits of all.
    fn walked(&self, coded: &mut Coded) -> (Costs, Vec<u32>, f32) {
        let (mut models, mut levels) = (Models::default(), Vec::new());
        let payload = self.coding(&coded.lattice).write(&mut coded.codes, &mut levels, &mut models);
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
