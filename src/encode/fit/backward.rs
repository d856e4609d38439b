//! The rest of the backward pass: from the gradients by splats to those by trained values and
//! quantizers.

use super::components::{Bounds, Components, Slope};
use super::paper::{LsqQuantizers, QuantizerGradients, add, decoded};
use super::parameterization::OwnFrame;
use super::pass::{Pass, SplatGradient};
use crate::encode::tiled_source::TiledSource;
use crate::gaussian::Gaussian;

/// A pass, and what its gradients depend on.
#[derive(Clone, Copy, Debug)]
pub(super) struct Backward<'a> {
    pub(super) pass: &'a Pass,
    pub(super) tiled: &'a TiledSource,
    pub(super) bounds: Bounds,
    pub(super) quantizers: Option<&'a LsqQuantizers>,
}

impl Backward<'_> {
    /// The gradient by the splat of a Gaussian that has these values.
    #[inline(always)]
    pub(super) fn by_splat(&self, index: usize, values: &Components) -> Slope<SplatGradient> {
        let Gaussian { center, cholesky, .. } = values.gaussian(self.bounds.parameterization);
        let perceptual_weight = self.tiled.loss.weight_under(center, cholesky);
        Slope { gradient: self.pass.gradient(index, self.bounds.channels), perceptual_weight }
    }

    /// The gradient by trained values. That by the quantizers is added to `by_quantizers`.
    pub(super) fn by_values(
        &self,
        index: usize,
        trained: &Components,
        by_quantizers: &mut QuantizerGradients,
    ) -> Slope {
        let parameterization = self.bounds.parameterization;
        let decoded = decoded(self.quantizers, trained);
        let Slope { gradient: by_splat, perceptual_weight } = self.by_splat(index, &decoded);
        let (center, shape) = parameterization.gradients(&by_splat.geometry, decoded.shape);
        let mut gradient = Components { center, shape, color: by_splat.color };
        if let Some(quantizers) = self.quantizers {
            add(by_quantizers, &quantizers.backward(trained, &decoded, &mut gradient));
        }
        Slope { gradient, perceptual_weight }
    }

    /// [`Self::by_values`] in the Gaussian's own frame.
    pub(super) fn in_own_frame(
        &self,
        index: usize,
        trained: &Components,
        by_quantizers: &mut QuantizerGradients,
    ) -> Slope {
        let Slope { gradient, perceptual_weight } = self.by_values(index, trained, by_quantizers);
        let frame = OwnFrame::new(self.bounds.parameterization, trained.shape);
        let (center, shape) = frame.gradient(gradient.center, gradient.shape);
        Slope { gradient: Components { center, shape, ..gradient }, perceptual_weight }
    }
}
