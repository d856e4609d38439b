//! The codes of Gaussians for a quantization step: rounding to the lattice, and passes of
//! coordinate descent over the codes.

use core::ops::Range;

use super::coordinate_descent::{CodeContext, CoordinateDescent, touched_tiles};
use super::residuals::Residuals;
use crate::coding::entropy::{CenterGrid, EncodedLayer, Lattice, LatticeCodes, LayerCoder};
use crate::color::ColorModel;
use crate::encode::error::EncodeError;
use crate::encode::file::{FileLayout, write_entropy_layers};
use crate::encode::progress::Observer;
use crate::encode::raster::Raster;
use crate::encode::rate_model;
use crate::encode::strips;
use crate::encode::workload::Workload;
use crate::gaussian::Gaussian;
use crate::limits::Limits;
use crate::render::Picture;

/// A penalty for the time that a decoder takes, in bits per Gaussian on average, shared out by the
/// tiles that each Gaussian touches. It lowers the number of those tiles by 2 to 4 % at the same
/// PSNR.
const DECODING_TIME_BITS: f32 = 4.0;
/// Work to round a Gaussian, and to make one from its code.
const WORK: (f64, f64) = (200.0, 50.0);
/// Codes whose bits are added up from one poll of the observer to the next.
const PART: usize = 1 << 14;

/// The contexts of a layer's codes, which determine their rate.
fn contexts_of(layer: &EncodedLayer) -> impl Iterator<Item = CodeContext<'_>> {
    layer.levels.iter().map(|&level| CodeContext { level, costs: &layer.costs })
}

/// Rounds Gaussians to a lattice and optimizes their codes, for the file of one picture.
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

    /// Rounds `gaussians` to the lattice for a step of colour, given by its base-2 logarithm.
    ///
    /// # Errors
    /// [`EncodeError::Cancelled`] when the caller cancels.
    pub(super) fn rounded(
        &self,
        gaussians: &[Gaussian],
        step: f64,
        observer: &mut Observer<'_>,
    ) -> Result<LatticeCodes, EncodeError> {
        let lattice = rate_model::lattice(step, self.model);
        let codes = observer.map(WORK.0, gaussians.iter(), |gaussian| {
            let sensitivity = self.raster.sensitivity_near(gaussian.center);
            let class = rate_model::class_of(gaussian, sensitivity, &lattice, self.model);
            lattice.code(gaussian, class, &self.grid, self.model)
        })?;
        Ok(LatticeCodes { lattice, codes })
    }

    /// Runs these passes of coordinate descent over the codes, counted from rounding, and ends early
    /// when a pass changes none. The Lagrange multiplier is 2^`lambda` times that of the rate model. The codes
    /// are then in the order of the file.
    ///
    /// # Errors
    /// [`EncodeError::Cancelled`] when the caller cancels.
    pub(super) fn descend(
        &self,
        coded: &mut LatticeCodes,
        lambda: f64,
        passes: Range<u32>,
        observer: &mut Observer<'_>,
    ) -> Result<(), EncodeError> {
        let lambda = rate_model::lambda(&coded.lattice) * lambda.exp2() as f32;
        let mut residuals = Residuals::new(self.raster, observer)?;
        let workload = Workload::new(self.raster.pixels(), coded.codes.len());
        for pass in passes {
            let layers = self.written(coded, observer)?;
            let contexts: Vec<CodeContext<'_>> = layers.iter().flat_map(contexts_of).collect();
            self.render(coded, &mut residuals, observer)?;
            let coder = self.coder(&coded.lattice);
            let bytes: usize = layers.iter().map(|layer| layer.payload.len()).sum();
            let (mut attribute_bits, mut tiles) = (0.0, 0.0);
            for (codes, contexts) in coded.codes.chunks(PART).zip(contexts.chunks(PART)) {
                observer.poll()?;
                for (code, context) in codes.iter().zip(contexts) {
                    let shape = coder.lattice.shape(code);
                    attribute_bits += coder.cost(*code, &shape, context.level, context.costs);
                    tiles += touched_tiles(shape.cholesky);
                }
            }
            let tree_bits = 8.0 * bytes as f32 - attribute_bits;
            let tree_bits = (tree_bits / coded.codes.len().max(1) as f32).max(0.0);
            let tile_bits = DECODING_TIME_BITS * coded.codes.len() as f32 / tiles.max(1.0);
            let work = workload.descent(pass + 1, 1);
            let descent =
                CoordinateDescent { coder, model: self.model, tree_bits, tile_bits, lambda, work };
            if descent.pass(&mut residuals, &mut coded.codes, &contexts, observer)? == 0 {
                break;
            }
        }
        // Sorts the codes and rounds their centres as in the file.
        self.written(coded, observer)?;
        Ok(())
    }

    fn coder<'b>(&self, lattice: &'b Lattice) -> LayerCoder<'b> {
        LayerCoder::new(lattice, self.layout.header())
    }

    /// Writes the layers of the codes, which sorts the codes into the order of the file and rounds
    /// their centres as the decoder reads them.
    ///
    /// # Errors
    /// [`EncodeError::Cancelled`] when the caller cancels.
    pub(super) fn written(
        &self,
        coded: &mut LatticeCodes,
        observer: &mut Observer<'_>,
    ) -> Result<Vec<EncodedLayer>, EncodeError> {
        write_entropy_layers(&self.coder(&coded.lattice), &mut coded.codes, observer)
    }

    /// Sets `residuals` to those of the codes as the decoder renders them.
    fn render(
        &self,
        coded: &LatticeCodes,
        residuals: &mut Residuals,
        observer: &mut Observer<'_>,
    ) -> Result<(), EncodeError> {
        let LatticeCodes { lattice, codes } = coded;
        let gaussian = |code| lattice.gaussian(code, &lattice.shape(code), &self.grid, self.model);
        let gaussians = observer.map(WORK.1, codes.iter(), gaussian)?;
        let header = self.layout.header();
        let limits = Limits::none();
        let rendering = Picture::new(header, &gaussians, &limits, 0);
        strips::render(&rendering, u32::MAX, observer, |region, planes| {
            residuals.set(self.raster, region.y as usize, planes);
        })?;
        if let Some(sensitivity) = &self.raster.sensitivity {
            residuals.shift(sensitivity, observer)?;
        }
        Ok(())
    }
}
