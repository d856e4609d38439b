//! The constants of training (paper, sections "Methodology" and "Experimental Setup"; appendix,
//! section "Implementation Details").

use std::sync::Arc;

use super::components::Components;
use super::custom_placement::CustomPlacement;
use super::paper::vector_quantizer::VectorQuantizer;
use crate::encode::loss::ErrorNorm;
use crate::gaussian::Parameterization;
use crate::kernel::Kernel;

/// The constants of training: how Gaussians are fitted to a picture.
///
/// [`Training::fast`] is what [`Encoder`](crate::Encoder) uses by default; [`Training::paper`] is
/// GaussianImage++ as published, for study and comparison. Every field of either may be changed.
#[derive(Clone, Debug, PartialEq)]
#[non_exhaustive]
pub struct Training {
    /// Number of iterations, at least 1 (paper: 50,000).
    pub iterations: u32,
    /// Pixels per Gaussian, at least 1, from which on a lower resolution is enough: training begins with a copy
    /// of the picture of half the resolution, a quarter or an eighth that has so many, and leaves it when there
    /// are more Gaussians, or half of the iterations are over (paper: `None`, no copies).
    pub coarse_to_fine: Option<u32>,
    /// The kernel that is fitted and stored (paper: [`Kernel::PAPER`]). [`Precision::Entropy`]
    /// needs [`Kernel::Quartic`].
    ///
    /// [`Precision::Entropy`]: crate::Precision::Entropy
    pub kernel: Kernel,
    /// The shape values that are trained, and stored by the packed coding (paper:
    /// [`Parameterization::Covariance`]; GaussianImage: [`Parameterization::Cholesky`] and
    /// [`Parameterization::RotationScale`]).
    pub parameterization: Parameterization,
    /// Distortion-driven densification (D3 in the paper).
    pub densification: Densification,
    /// The variance of new Gaussians (the content-aware Gaussian filter, CAF, in the paper).
    pub filter: GaussianFilter,
    /// The optimizer with its learning rates.
    pub optimizer: Optimizer,
    /// How the learning rates fall during training.
    pub schedule: LearningRateSchedule,
    /// Quantization-aware training (QAT), for [`Precision::Packed`](crate::Precision::Packed) only.
    pub quantization: Quantization,
}

/// Distortion-driven densification: when, where and how Gaussians are added and removed (paper,
/// section "Distortion Driven Densification", D3).
#[doc(alias = "D3")]
#[derive(Clone, Debug, PartialEq)]
#[non_exhaustive]
pub struct Densification {
    /// Number of Gaussians at the start, as a share of the budget, in (0, 1] (paper: 0.5).
    pub initial: f32,
    /// Number of growth steps, in which Gaussians are added. They are at equal intervals (paper:
    /// 9).
    pub steps: u32,
    /// The last growth step, as a share of the iterations, in (0, 1] (paper: 0.9).
    pub end: f32,
    /// How many Gaussians a growth step adds.
    pub portion: Portion,
    /// The surplus: how many Gaussians growth adds beyond the budget, as a share of it, at least 0
    /// (paper: 0). Afterwards, as many Gaussians are culled, the least important ones.
    pub surplus: f32,
    /// The end of culling, as a share of the iterations, from `end` to 1 (paper: no culling).
    pub culled: f32,
    /// The share of the Gaussians, the least important ones, that each growth step replaces by new
    /// ones at other positions, in [0, 1) (paper: 0).
    pub replaced: f32,
    /// The error of a pixel.
    pub error_norm: ErrorNorm,
    /// How the pixels for new Gaussians are chosen by their errors.
    pub placement: Placement,
    /// The colour of a new Gaussian.
    pub color: NewColor,
    /// The shape of a new Gaussian, before the filter's variance is added.
    pub shape: NewShape,
    /// Iterations from one pruning to the next, at least 1 (paper: 100). Pruning removes Gaussians
    /// that are invalid, outside the picture, or nearly without colour.
    pub prune_interval: u32,
}

/// How many Gaussians a growth step adds, out of those that are missing from the budget and the
/// surplus.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
#[non_exhaustive]
pub enum Portion {
    /// The same number at every remaining step.
    Even,
    /// Half of those that are missing, and all of them at the last step (the paper's text).
    Half,
}

/// How the pixels for new Gaussians are chosen by their errors.
#[derive(Clone, Debug, PartialEq)]
#[non_exhaustive]
pub enum Placement {
    /// The pixels of largest error (paper). They form clusters.
    Top,
    /// Pixels evenly spread, with a density proportional to the error. The denser the new
    /// Gaussians are, the less variance they have.
    Spread,
    /// Those that a placement of one's own chooses.
    Custom(Arc<dyn CustomPlacement>),
}

/// The initial colour of a new Gaussian.
#[derive(Clone, Copy, Debug, PartialEq)]
#[non_exhaustive]
pub enum NewColor {
    /// 0 in all channels (the paper's released code; its text for the first Gaussians).
    Zero,
    /// This share of source minus rendering at the pixel; not with [`Placement::Top`].
    Residual(f32),
}

/// The initial shape of a new Gaussian, before the filter's variance is added.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
#[non_exhaustive]
pub enum NewShape {
    /// A point, so that the shape is a circle of the filter's variance.
    Point,
    /// The three shape values of the parameterization, drawn from [0, 1); 0.5 is added to the two
    /// that must be positive (paper). An angle is drawn from [0, 2 pi).
    Random,
}

/// The filter: a variance in square pixels that is added to both axes of a Gaussian's covariance
/// when the Gaussian is added (paper, section "Content Aware Gaussian Filters", CAF).
///
/// The sum is trained from then on. For a directly trained covariance this is exactly the paper's
/// filter: adding a constant to a trained value is the same as training from the sum.
#[doc(alias = "CAF")]
#[derive(Clone, Copy, Debug, PartialEq)]
#[non_exhaustive]
pub enum GaussianFilter {
    /// HW / (alpha N), where HW is the number of pixels and N the number of Gaussians, the new ones
    /// included; at most `cap`. It is large for the first Gaussians and small for later ones.
    ContentAware {
        /// Positive (paper: 9 pi, with which N discs of three standard deviations have the area of
        /// the picture).
        alpha: f32,
        /// In square pixels, positive (the paper's released code: 300).
        cap: f32,
    },
    /// The same variance for all Gaussians, in square pixels, at least 0 (3D Gaussian splatting:
    /// 0.3; GaussianImage: 0.5).
    Constant(f32),
}

/// The optimizer.
#[derive(Clone, Debug, PartialEq)]
#[non_exhaustive]
pub enum Optimizer {
    /// Adam (paper).
    Adam(Adam),
    /// Gauss-Newton steps with momentum: gradients divided by curvatures.
    GaussNewton(GaussNewton),
}

/// Adam (paper). The centre moves in pixels, and the shape changes in the parameterization's own
/// units.
#[derive(Clone, Debug, PartialEq)]
#[non_exhaustive]
pub struct Adam {
    /// Learning rate of the centre, positive.
    pub center: f32,
    /// Learning rate of the shape, positive.
    pub shape: f32,
    /// Learning rate of the colour, positive, where a full sample is 1.
    pub color: f32,
    /// Decay of the moving average of the gradient, in [0, 1) (paper: 0.9).
    pub beta1: f32,
    /// Decay of the moving average of the squared gradient, in [0, 1) (paper: 0.999).
    pub beta2: f32,
    /// What is added to the square root of the latter, at least 0 (paper: 1e-15).
    pub epsilon: f32,
}

/// Gauss-Newton steps with momentum: every gradient is divided by the curvature that the squared error
/// would have if the Gaussian were alone, an integral of the kernel. As Gaussians overlap, each has a step
/// size of its own, which rises while successive gradients agree and falls when they turn round.
///
/// A step is taken in the Gaussian's own frame: its centre moves in standard deviations, and its shape
/// changes relative to itself. The same rate suits Gaussians of all sizes and colours.
#[derive(Clone, Debug, PartialEq)]
#[non_exhaustive]
pub struct GaussNewton {
    /// Learning rate at first, positive: 1 takes a Gaussian without neighbours to its optimum.
    pub rate: f32,
    /// Decay of the moving average of the gradient, in [0, 1).
    pub momentum: f32,
    /// What is added to the magnitude of the colour in the curvature by the geometry, positive, where
    /// a full sample is 1: the geometry of a faint Gaussian is uncertain.
    pub damping: f32,
    /// The trust region: the largest change of the geometry in a step, in standard deviations and
    /// relative to the shape, positive.
    pub trust_region: f32,
}

/// How the learning rates fall during training.
#[derive(Clone, Copy, Debug, PartialEq)]
#[non_exhaustive]
pub enum LearningRateSchedule {
    /// They are halved every so many iterations, at least 1 (paper: 20,000).
    Halving(u32),
    /// They are constant for this share of the iterations, and then fall linearly to 0.
    Linear(f32),
}

/// Quantization-aware training (QAT) with LSQ+ (paper, section "Compression Framework").
#[doc(alias = "QAT")]
#[doc(alias = "LSQ+")]
#[derive(Clone, Debug, PartialEq)]
#[non_exhaustive]
pub struct Quantization {
    /// The share of the iterations before quantization starts, in (0, 1] (paper: 0.12). It starts
    /// after culling in any case.
    pub warm_up: f32,
    /// Bit depth of each of the two coordinates of the centre, 1 to 16 (paper: 12).
    pub position_bits: u8,
    /// Bit depth of each of the three shape values, 1 to 16 (paper: 10).
    pub shape_bits: u8,
    /// Bit depth of each colour channel, 1 to 16 (paper: 6).
    pub color_bits: u8,
    /// Learning rate of scales and offsets, positive, relative to the scale (paper: 0.001,
    /// absolute).
    pub learning_rate: f32,
    /// What quantizes the centre in place of LSQ+ (paper: nothing).
    pub center: Option<Arc<dyn VectorQuantizer>>,
    /// What quantizes the colour in place of LSQ+ (paper: nothing).
    pub color: Option<Arc<dyn VectorQuantizer>>,
}

// Constants: docs/tuning.md, "Steps of training".
impl Quantization {
    /// The paper's, from a share of the iterations on.
    pub(super) fn from_share(warm_up: f32) -> Self {
        Self {
            warm_up,
            position_bits: 12,
            shape_bits: 10,
            color_bits: 6,
            learning_rate: 1e-3,
            center: None,
            color: None,
        }
    }

    /// The bit depths of all components; none of those that something else quantizes than LSQ+.
    pub(crate) fn depths(&self) -> Components<Option<u8>> {
        let center = self.center.is_none().then_some(self.position_bits);
        let color = self.color.is_none().then_some(self.color_bits);
        Components::by_attribute(center, Some(self.shape_bits), color)
    }
}

impl Training {
    /// The encoder's defaults, tuned for quality in few iterations. Growth is early, in many steps
    /// and beyond the budget; new Gaussians are spread by the error, and the surplus is culled
    /// by energy. The optimizer takes Gauss-Newton steps, and the learning rates fall to 0.
    #[must_use]
    pub fn fast(iterations: u32) -> Self {
        // Constants: docs/tuning.md, "Growth" and "Steps of training". In a short run there is no time to
        // be careful, and little to correct.
        let (end, culled) = if iterations < 50 { (0.7, 0.8) } else { (0.6, 0.7) };
        let hurry = 1.0 / iterations.max(30) as f32;
        Self {
            iterations,
            coarse_to_fine: Some(16),
            kernel: Kernel::Quartic,
            parameterization: Parameterization::Cholesky,
            densification: Densification {
                initial: 0.02,
                steps: (iterations / 10).clamp(10, 160),
                end,
                portion: Portion::Even,
                surplus: 0.3,
                culled,
                replaced: (iterations as f32 / 300.0).min(0.2),
                error_norm: ErrorNorm::L3,
                placement: Placement::Spread,
                color: NewColor::Residual(0.3),
                shape: NewShape::Point,
                prune_interval: 25,
            },
            filter: GaussianFilter::PAPER,
            optimizer: Optimizer::GaussNewton(GaussNewton {
                rate: 1.2 + 6.0 * hurry,
                momentum: 0.8 - 6.0 * hurry,
                damping: 0.02,
                trust_region: 0.2 + 3.0 * hurry,
            }),
            schedule: LearningRateSchedule::Linear(0.7),
            quantization: Quantization::from_share(0.6),
        }
    }

    /// These constants for quantization-aware training: growth and culling are over when quantization
    /// starts, and steps are smaller, because quantizers round them.
    pub(crate) fn with_quantization(mut self) -> Self {
        let Densification { end, culled, .. } = &mut self.densification;
        let share = (self.quantization.warm_up / *culled).min(1.0);
        *end *= share;
        *culled *= share;
        if let Optimizer::GaussNewton(GaussNewton { rate, momentum, .. }) = &mut self.optimizer {
            (*rate, *momentum) = (1.1, 0.7);
        }
        self
    }

    /// Refuses constants that are out of range, with the rule that is broken.
    pub(crate) fn check(&self) -> Result<(), &'static str> {
        let share = |value: f32| value > 0.0 && value <= 1.0;
        let positive = |value: f32| value > 0.0 && value.is_finite();
        let depth = |bits: u8| (1..=16).contains(&bits);
        let Self { densification: d, quantization: q, .. } = self;
        let (rates, decays, epsilon) = match &self.optimizer {
            Optimizer::Adam(adam) => {
                ([adam.center, adam.shape, adam.color], [adam.beta1, adam.beta2], adam.epsilon)
            }
            Optimizer::GaussNewton(o) => {
                ([o.rate, o.damping, o.trust_region], [o.momentum, 0.0], 0.0)
            }
        };
        let rules = [
            (self.iterations >= 1, "iterations must be at least 1"),
            (self.coarse_to_fine != Some(0), "coarse_to_fine must be at least 1"),
            (share(d.initial), "densification.initial must be in (0, 1]"),
            (share(d.end), "densification.end must be in (0, 1]"),
            (
                d.culled >= d.end && d.culled <= 1.0,
                "densification.culled must be at least densification.end and at most 1",
            ),
            (
                d.surplus >= 0.0 && d.surplus.is_finite(),
                "densification.surplus must be finite, not negative",
            ),
            ((0.0..1.0).contains(&d.replaced), "densification.replaced must be in [0, 1)"),
            (d.prune_interval >= 1, "densification.prune_interval must be at least 1"),
            (
                d.placement != Placement::Top || d.color == NewColor::Zero,
                "densification.color must be Zero where densification.placement is Top",
            ),
            (
                self.filter.variance(1, 1).is_some(),
                "filter must be finite, its alpha and cap positive, and not negative",
            ),
            (
                rates.into_iter().all(positive) && positive(q.learning_rate),
                "learning rates, damping and trust_region must be positive and finite",
            ),
            (
                decays.iter().all(|decay| (0.0..1.0).contains(decay)),
                "beta1, beta2 and momentum must be in [0, 1)",
            ),
            (epsilon >= 0.0 && epsilon.is_finite(), "epsilon must be finite, not negative"),
            (
                self.schedule != LearningRateSchedule::Halving(0),
                "the halving interval must be at least 1",
            ),
            (share(q.warm_up), "quantization.warm_up must be in (0, 1]"),
            (
                depth(q.position_bits) && depth(q.shape_bits) && depth(q.color_bits),
                "bit depths must be 1 to 16",
            ),
        ];
        match rules.iter().find(|(holds, _)| !holds) {
            Some((_, rule)) => Err(rule),
            None => Ok(()),
        }
    }
}

impl GaussianFilter {
    /// The paper's filter with its released code's constants.
    pub const PAPER: Self = Self::ContentAware { alpha: 9.0 * core::f32::consts::PI, cap: 300.0 };

    /// The variance for new Gaussians, with which there are `count`; `None` if the constants are
    /// out of range.
    pub(crate) fn variance(self, pixels: usize, count: usize) -> Option<f32> {
        let (variance, is_valid) = match self {
            Self::ContentAware { alpha, cap } => {
                ((pixels as f32 / (alpha * count as f32)).min(cap), alpha > 0.0 && cap > 0.0)
            }
            Self::Constant(variance) => (variance, variance >= 0.0),
        };
        (is_valid && variance.is_finite()).then_some(variance)
    }
}

impl LearningRateSchedule {
    /// The factor on all learning rates at an iteration out of `iterations`.
    pub(crate) fn factor(self, iteration: u32, iterations: u32) -> f32 {
        match self {
            Self::Halving(interval) => 0.5_f32.powi((iteration / interval) as i32),
            Self::Linear(from) => {
                let done = iteration as f32 / iterations as f32;
                if done < from { 1.0 } else { (1.0 - done) / (1.0 - from) }
            }
        }
    }
}
