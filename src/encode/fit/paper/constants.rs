//! The paper's constants (sections "Methodology" and "Experimental Setup"; appendix, section
//! "Implementation Details"). docs/tuning.md has what was measured where the text and the released code differ.

use crate::encode::fit::training::{
    Adam, Densification, GaussianFilter, LearningRateSchedule, NewColor, NewShape, Optimizer,
    Placement, Portion, Quantization, Training,
};
use crate::encode::loss::ErrorNorm;
use crate::gaussian::Parameterization;
use crate::kernel::Kernel;

impl Training {
    /// GaussianImage++ as published. Where the text and the released code differ, these are the
    /// variants that gave the better results. From the text: learning rates of 0.18 (code: 0.018)
    /// and growth by half of what is missing (code: 1,000 at a time). From the code: new Gaussians
    /// without colour (text: the source's colour) and quantizers that round (text: that truncate).
    #[must_use]
    pub fn paper() -> Self {
        Self {
            iterations: 50_000,
            coarse_to_fine: None,
            kernel: Kernel::PAPER,
            parameterization: Parameterization::Covariance,
            densification: Densification {
                initial: 0.5,
                steps: 9,
                end: 0.9,
                portion: Portion::Half,
                surplus: 0.0,
                culled: 0.9,
                replaced: 0.0,
                error_norm: ErrorNorm::L1,
                placement: Placement::Top,
                color: NewColor::Zero,
                shape: NewShape::Random,
                prune_interval: 100,
            },
            filter: GaussianFilter::PAPER,
            optimizer: Optimizer::Adam(Adam {
                center: 0.18,
                shape: 0.18,
                color: 0.18,
                beta1: 0.9,
                beta2: 0.999,
                epsilon: 1e-15,
            }),
            schedule: LearningRateSchedule::Halving(20_000),
            quantization: Quantization::from_share(0.12),
        }
    }
}
