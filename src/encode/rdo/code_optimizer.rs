//! The codes of Gaussians for a step: rounding, and passes of coordinate descent over them.

use rayon::prelude::*;

use super::coordinate_descent::{CodeContext, CoordinateDescent, tiles};
use super::residuals::Residuals;
use crate::coding::entropy::{CenterGrid, EncodedLayer, Lattice, LatticeCodes, LayerCoder};
use crate::color::ColorModel;
use crate::encode::error::EncodeError;
use crate::encode::file::{FileLayout, write_entropy_layers};
use crate::encode::progress::Observer;
use crate::encode::raster::Raster;
use crate::encode::rate_model;
use crate::encode::strips::strips;
use crate::gaussian::Gaussian;
use crate::limits::Limits;
use crate::render::{Picture, RenderOptions};

/// What the time that decoders take for a Gaussian is worth on average, in bits: there are 2 to 4 %
/// fewer tiles to look at then, and PSNR stays as it is.
const BITS_FOR_TIME: f32 = 4.0;

/// What decides the rate of each of a layer's codes.
fn contexts_of(layer: &EncodedLayer) -> impl Iterator<Item = CodeContext<'_>> {
    layer.levels.iter().map(|&level| CodeContext { level, costs: &layer.costs })
}

/// What Gaussians are coded for.
#[derive(Debug)]
pub(super) struct CodeOptimizer<'a> {
    raster: &'a Raster,
    layout: &'a FileLayout<'a>,
    grid: CenterGrid,
    model: ColorModel,
}

impl<'a> CodeOptimizer<'a> {
    pub(super) fn new(raster: &'a Raster, layout: &'a FileLayout<'a>) -> Self {
        let header = layout.header();
        let grid = CenterGrid::new(header.width, header.height);
        Self { raster, layout, grid, model: header.color }
    }

    /// Rounds `gaussians` to the lattice of a step, given by its logarithm to base 2.
    pub(super) fn rounded(&self, gaussians: &[Gaussian], step: f64) -> LatticeCodes {
        let lattice = rate_model::lattice(step, self.model);
        let codes = gaussians.par_iter().map(|gaussian| {
            let class = rate_model::class_of(gaussian, &lattice, self.model);
            lattice.code(gaussian, class, &self.grid, self.model)
        });
        let codes = codes.collect();
        LatticeCodes { lattice, codes }
    }

    /// Looks at every code `passes` times and chooses the best, a bit being worth 2^`lambda` times
    /// as much as usual.
    pub(super) fn descend(
        &self,
        coded: &mut LatticeCodes,
        lambda: f64,
        passes: u32,
        observer: &mut Observer<'_>,
    ) -> Result<(), EncodeError> {
        let lambda = rate_model::lambda(&coded.lattice) * lambda.exp2() as f32;
        let mut residuals = Residuals::new(self.raster);
        for _ in 0..passes {
            observer.poll()?;
            let layers = self.written(coded);
            let contexts: Vec<CodeContext<'_>> = layers.iter().flat_map(contexts_of).collect();
            self.render(coded, &mut residuals, observer)?;
            let coder = self.coder(&coded.lattice);
            let bytes: usize = layers.iter().map(|layer| layer.payload.len()).sum();
            let (mut own, mut touched) = (0.0, 0.0);
            for (code, context) in coded.codes.iter().zip(&contexts) {
                let shape = coder.lattice.shape(code);
                own += coder.cost(*code, &shape, context.level, context.costs);
                touched += tiles(shape.cholesky);
            }
            let tree = ((8.0 * bytes as f32 - own) / coded.codes.len().max(1) as f32).max(0.0);
            let tile = BITS_FOR_TIME * coded.codes.len() as f32 / touched.max(1.0);
            let descent = CoordinateDescent { coder, model: self.model, tree, tile, lambda };
            if descent.pass(&mut residuals, &mut coded.codes, &contexts, observer)? == 0 {
                break;
            }
        }
        // For the file's order and centres.
        observer.poll()?;
        self.written(coded);
        Ok(())
    }

    fn coder<'b>(&self, lattice: &'b Lattice) -> LayerCoder<'b> {
        LayerCoder::new(lattice, self.layout.header())
    }

    /// Codes what there is, which sorts and rounds the codes as the file has them.
    pub(super) fn written(&self, coded: &mut LatticeCodes) -> Vec<EncodedLayer> {
        write_entropy_layers(&self.coder(&coded.lattice), &mut coded.codes)
    }

    /// Sets `residuals` to those of the codes, as the decoder renders them.
    fn render(
        &self,
        coded: &LatticeCodes,
        residuals: &mut Residuals,
        observer: &mut Observer<'_>,
    ) -> Result<(), EncodeError> {
        let LatticeCodes { lattice, codes } = coded;
        let gaussian = |code| lattice.gaussian(code, &lattice.shape(code), &self.grid, self.model);
        let gaussians: Vec<Gaussian> = codes.iter().map(gaussian).collect();
        let header = self.layout.header();
        let limits = Limits::none();
        let rendering = Picture::new(header, &gaussians, &limits, 0);
        let mut planes = Vec::new();
        for region in strips(header.width, header.height) {
            observer.poll()?;
            planes.resize(region.pixels() as usize * self.raster.channels, 0.0);
            let options = RenderOptions::new().with_region(region);
            rendering.render_planes(&options, &mut planes).expect("there are no limits");
            residuals.set(self.raster, region.y as usize, &planes);
        }
        observer.poll()
    }
}
