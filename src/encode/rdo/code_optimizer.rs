//! The codes of Gaussians for a quantization step: rounding to the quantization grid, and passes of
//! coordinate descent over the codes.

use super::coordinate_descent::{CodeContext, CoordinateDescent, touched_tiles};
use super::residuals::Residuals;
use crate::coding::entropy::{CenterGrid, Code, EncodedLayer, QuantizedCodes};
use crate::color::ColorModel;
use crate::encode::error::Result;
use crate::encode::file::{CodedLayers, FileLayout};
use crate::encode::progress::Observer;
use crate::encode::rate_model;
use crate::encode::strips;
use crate::encode::tiled_source::TiledSource;
use crate::gaussian::Gaussian;
use crate::limits::Limits;
use crate::render::Picture;

// Constants: docs/tuning.md, "Search for a target".
/// The usual penalty for decoding time, in bits per Gaussian on average; each Gaussian has a share that is
/// proportional to the number of tiles that it touches.
const DECODING_TIME_BITS: f32 = 4.0;

/// Codes whose bits one task adds up.
const PART: usize = 4096;

/// The contexts of a layer's codes, which determine their rate.
fn contexts_of(layer: &EncodedLayer) -> impl Iterator<Item = CodeContext<'_>> {
    layer.levels.iter().map(|&level| CodeContext { level, costs: &layer.costs })
}

/// Codes as they are in a file, and sorted by how much they lower the error.
#[derive(Debug)]
pub(super) struct Optimized {
    pub(super) coded: CodedLayers,
    /// The codes before their centres were rounded for the file, sorted by how much each lowers the error
    /// per bit, the most first.
    pub(super) by_use: Vec<Code>,
    /// Those of Gaussians that were removed, sorted likewise.
    pub(super) spare: Vec<Code>,
}

impl Optimized {
    /// The codes as they are in a file, without the memory of the others.
    pub(super) fn into_coded(self) -> CodedLayers {
        self.coded
    }
}

/// Rounds Gaussians to a quantization grid and optimizes their codes, for the file of one picture.
#[derive(Debug)]
pub(super) struct CodeOptimizer<'a> {
    tiled: &'a TiledSource,
    layout: &'a FileLayout<'a>,
    grid: CenterGrid,
    model: ColorModel,
    /// The penalty for decoding time, in bits per Gaussian on average.
    decoding_time_bits: f32,
    /// Those of the codes that are optimized at present.
    residuals: Residuals,
}

impl<'a> CodeOptimizer<'a> {
    pub(super) fn new(
        tiled: &'a TiledSource,
        layout: &'a FileLayout<'a>,
        observer: &mut Observer<'_>,
    ) -> Result<Self> {
        let header = layout.header();
        let grid = CenterGrid::new(header.width, header.height);
        let residuals = Residuals::new(tiled, observer)?;
        let (model, decoding_time_bits) = (header.color, DECODING_TIME_BITS);
        Ok(Self { tiled, layout, grid, model, decoding_time_bits, residuals })
    }

    /// The same without a penalty for decoding time.
    pub(super) fn at_any_decoding_time(self) -> Self {
        Self { decoding_time_bits: 0.0, ..self }
    }

    /// Rounds `gaussians` to the quantization grid for a step of colour, given by its base-2 logarithm.
    pub(super) fn rounded(
        &self,
        gaussians: &[Gaussian],
        step: f64,
        observer: &mut Observer<'_>,
    ) -> Result<CodedLayers> {
        let loss = &self.tiled.loss;
        let quantization = rate_model::quantization(step, loss.axis_steps());
        let curvature = loss.color_curvature();
        let codes = observer.map(gaussians.iter(), |gaussian| {
            let Gaussian { center, cholesky, .. } = *gaussian;
            let weight = loss.weight_under(center, cholesky);
            let exponent =
                rate_model::step_exponent(gaussian, weight, &curvature, &quantization, self.model);
            quantization.code(gaussian, exponent, &self.grid, self.model)
        })?;
        self.layout.coded(QuantizedCodes { quantization, codes }, observer)
    }

    /// The Gaussians of codes.
    pub(super) fn gaussians(
        &self,
        coded: &CodedLayers,
        observer: &mut Observer<'_>,
    ) -> Result<Vec<Gaussian>> {
        let CodedLayers { quantization, codes, .. } = coded;
        let gaussian =
            |code| quantization.gaussian(code, &quantization.shape(code), &self.grid, self.model);
        observer.map(codes.iter(), gaussian)
    }

    /// Runs a pass of coordinate descent over the codes. The Lagrange multiplier is 2^`lambda` times
    /// that of the rate model. `work` is that of the pass, for the progress that is reported.
    pub(super) fn descend(
        &mut self,
        coded: CodedLayers,
        lambda: f64,
        work: f64,
        observer: &mut Observer<'_>,
    ) -> Result<Optimized> {
        self.render(&coded, observer)?;
        let CodedLayers { quantization, codes, layers } = coded;
        let contexts: Vec<CodeContext<'_>> = layers.iter().flat_map(contexts_of).collect();
        let coder = self.layout.header().layer_coder(&quantization);
        let bytes: usize = layers.iter().map(|layer| layer.bytes.len()).sum();
        let parts = codes.chunks(PART).zip(contexts.chunks(PART));
        let sums = observer.map(parts, |(codes, contexts)| {
            let (mut bits, mut tiles) = (0.0, 0.0);
            for (code, context) in codes.iter().zip(contexts) {
                let shape = quantization.shape(code);
                bits += coder.geometry_cost(code, &shape, context.level, context.costs);
                bits += coder.color_cost(code, context.costs);
                tiles += touched_tiles(shape.cholesky);
            }
            [bits, tiles]
        })?;
        // Added part by part, so that the sums do not depend on the threads.
        let (mut attribute_bits, mut tiles) = (0.0, 0.0);
        for [bits_of_part, tiles_of_part] in sums {
            attribute_bits += bits_of_part;
            tiles += tiles_of_part;
        }
        let tree_bits = 8.0 * bytes as f32 - attribute_bits;
        let tree_bits = (tree_bits / codes.len().max(1) as f32).max(0.0);
        let tile_bits = self.decoding_time_bits * codes.len() as f32 / tiles.max(1.0);
        let lambda = rate_model::lambda(&quantization) * lambda.exp2() as f32;
        let descent =
            CoordinateDescent { coder, model: self.model, tree_bits, tile_bits, lambda, work };
        let [by_use, spare] = descent.pass(&mut self.residuals, &codes, &contexts, observer)?;
        // Coding needs memory of its own.
        drop((contexts, codes));
        drop(layers);
        let codes = QuantizedCodes { quantization, codes: by_use.clone() };
        Ok(Optimized { coded: self.layout.coded(codes, observer)?, by_use, spare })
    }

    /// Sets the residuals to those of the codes as the decoder renders them.
    fn render(&mut self, coded: &CodedLayers, observer: &mut Observer<'_>) -> Result<()> {
        let gaussians = self.gaussians(coded, observer)?;
        let header = self.layout.header();
        let limits = Limits::none();
        let rendering = Picture::new(header, &gaussians, &limits, 0);
        let (tiled, residuals) = (self.tiled, &mut self.residuals);
        strips::render(&rendering, u32::MAX, observer, |region, planes| {
            residuals.set(tiled, region.y as usize, planes);
        })?;
        residuals.shift(&tiled.loss, observer)
    }
}
