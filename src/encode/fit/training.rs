//! The constants of training, by name (paper, sections "Methodology" and "Experimental Setup").

use crate::gaussian::Parameterization;
use crate::kernel::Kernel;

/// How a picture is fitted.
///
/// [`Training::fast`] is what [`Encoder`](crate::Encoder) uses; [`Training::paper`] is
/// GaussianImage++ as published, for study and comparison. Both are starting points: every field
/// may be changed.
#[derive(Clone, Debug, PartialEq)]
#[non_exhaustive]
pub struct Training {
    /// Iterations in all, at least 1 (paper: 50,000).
    pub iterations: u32,
    /// The kernel to fit with and to store (paper: [`Kernel::PAPER`]).
    pub kernel: Kernel,
    /// What is trained and stored of a shape (paper: [`Parameterization::Covariance`]; GaussianImage:
    /// [`Parameterization::Cholesky`], [`Parameterization::RotationScale`]).
    pub parameterization: Parameterization,
    /// Distortion-driven densification (paper: D3).
    pub densification: Densification,
    /// The variance that a Gaussian is born with (paper: CAF).
    pub filter: GaussianFilter,
    /// Learning rates and their schedule.
    pub optimizer: Optimizer,
    /// Quantization-aware training.
    pub quantization: Quantization,
}

/// When, where and how Gaussians are added and removed (paper, section "Distortion Driven
/// Densification").
#[derive(Clone, Debug, PartialEq)]
#[non_exhaustive]
pub struct Densification {
    /// Gaussians at the start, as a share of the budget, in (0, 1] (paper: 0.5; 1 is no growth).
    pub initial: f32,
    /// How many times Gaussians are added, at equal intervals (paper: 9).
    pub steps: u32,
    /// Share of the iterations after which none are added any more, in (0, 1] (paper: 0.9).
    pub end: f32,
    /// How many are added each time.
    pub portion: Portion,
    /// What growth adds beyond the budget, as a share of it (paper: 0). The least important
    /// Gaussians go again, so what stays has stood the test.
    pub surplus: f32,
    /// Share of the iterations by which the surplus is gone, at least `end`, at most 1.
    pub culled: f32,
    /// Share of the Gaussians, the least important, that each growth step replaces by new ones
    /// elsewhere, in [0, 1) (paper: 0).
    pub replaced: f32,
    /// What is measured at each pixel.
    pub distortion: Distortion,
    /// Which pixels are chosen.
    pub placement: Placement,
    /// The colour of a new Gaussian.
    pub color: NewColor,
    /// The shape of a new Gaussian, before the filter.
    pub shape: NewShape,
    /// Iterations between two prunings of invalid and useless Gaussians (paper: 100).
    pub prune_interval: u32,
}

/// How many Gaussians a growth step adds, given how many are missing.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
#[non_exhaustive]
pub enum Portion {
    /// The same share at every step.
    Even,
    /// Half of what is missing, all of it at the last step (the paper's text).
    Half,
    /// This many, all of what is missing at the last step (the paper's released code: 1,000).
    Fixed(u32),
}

/// The distortion of a pixel, from its residuals by channel.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
#[non_exhaustive]
pub enum Distortion {
    /// The sum of absolute residuals (paper).
    L1,
    /// The cube of the residuals' Euclidean length.
    L3,
}

/// Which pixels new Gaussians are put on.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
#[non_exhaustive]
pub enum Placement {
    /// Those of largest distortion (paper). They come in clusters.
    Top,
    /// As many everywhere as the distortion has its share there, evenly spread, and born the smaller
    /// the more they are.
    Spread,
}

/// The colour that a new Gaussian starts with.
#[derive(Clone, Copy, Debug, PartialEq)]
#[non_exhaustive]
pub enum NewColor {
    /// No colour (the paper's released code, and its first Gaussians).
    Zero,
    /// The colour of the source there (the paper's text).
    Source,
    /// This share of what is missing there.
    Residual(f32),
}

/// The shape that a new Gaussian starts with, before the filter's variance is added.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
#[non_exhaustive]
pub enum NewShape {
    /// A point: the filter alone gives it its size.
    Point,
    /// The three values of the parameterization drawn from [0, 1), the two that must be positive
    /// plus 0.5 (paper).
    Random,
}

/// The variance, in square pixels, that is added to the covariance of a Gaussian when it is born
/// and trained with it from then on (paper, section "Content Aware Gaussian Filters"; for the
/// directly trained covariance this is the paper's filter exactly, as adding a constant to a
/// trained parameter is the same as starting from the sum).
#[derive(Clone, Copy, Debug, PartialEq)]
#[non_exhaustive]
pub enum GaussianFilter {
    /// s = HW / (alpha N) with N Gaussians, the new ones included, and at most `cap`: large for
    /// the first Gaussians, small for later ones.
    ContentAware {
        /// Paper: 9 pi, so that N discs of three standard deviations cover the picture once.
        alpha: f32,
        /// Paper's released code: 300 square pixels.
        cap: f32,
    },
    /// The same for all (3D Gaussian splatting: 0.3; GaussianImage: 0.5).
    Constant(f32),
}

/// Adam and its learning rates.
#[derive(Clone, Debug, PartialEq)]
#[non_exhaustive]
pub struct Optimizer {
    /// What a learning rate of 1 means.
    pub units: Units,
    /// Learning rate of the centre.
    pub center: f32,
    /// Learning rate of the shape.
    pub shape: f32,
    /// Learning rate of the colour, in full samples.
    pub color: f32,
    /// Decay of the mean of gradients (paper: 0.9).
    pub beta1: f32,
    /// Decay of the mean of squared gradients (paper: 0.999).
    pub beta2: f32,
    /// What is added to the root of the latter (paper: 1e-15).
    pub epsilon: f32,
    /// How learning rates fall.
    pub schedule: LearningRateSchedule,
}

/// The units of the steps that centre and shape take.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
#[non_exhaustive]
pub enum Units {
    /// Pixels and the parameterization's own units (paper).
    Absolute,
    /// The Gaussian's own frame: centre in standard deviations, shape relative to itself. One
    /// rate serves all sizes.
    Relative,
}

/// How learning rates fall over the iterations.
#[derive(Clone, Copy, Debug, PartialEq)]
#[non_exhaustive]
pub enum LearningRateSchedule {
    /// Halved every so many iterations (paper: 20,000).
    Halving(u32),
    /// Constant up to this share of the iterations, then linearly to zero.
    Linear(f32),
}

/// Quantization-aware training with LSQ+ (paper, section "Compression Framework").
#[derive(Clone, Debug, PartialEq)]
#[non_exhaustive]
pub struct Quantization {
    /// Share of the iterations that run before quantization, in (0, 1] (paper: 0.12).
    pub warm_up: f32,
    /// Bit depth of each of the two coordinates, 1 to 16 (paper: 12).
    pub position_bits: u8,
    /// Bit depth of each of the three shape values, 1 to 16 (paper: 10).
    pub shape_bits: u8,
    /// Bit depth of each colour channel, 1 to 16 (paper: 6).
    pub color_bits: u8,
    /// Learning rate of scales and offsets, relative to the scale (paper: 0.001, absolute).
    pub learning_rate: f32,
}

impl Training {
    /// Fast and good: growth early, often and beyond the budget, evenly spread where the error is,
    /// culled by importance; steps in each Gaussian's own frame; learning rates down to zero.
    #[must_use]
    pub fn fast(iterations: u32) -> Self {
        let steps = (iterations / 30).clamp(20, 160);
        // The longer the run, the more is left for settling.
        let (end, culled) = if iterations > 2_400 { (0.4, 0.5) } else { (0.5, 0.65) };
        Self {
            iterations,
            kernel: Kernel::Quartic,
            parameterization: Parameterization::Cholesky,
            densification: Densification {
                initial: 0.03,
                steps,
                end,
                portion: Portion::Even,
                surplus: 0.3,
                culled,
                replaced: (2.0 / steps as f32).max(0.05),
                distortion: Distortion::L3,
                placement: Placement::Spread,
                color: NewColor::Residual(0.1),
                shape: NewShape::Point,
                prune_interval: 25,
            },
            filter: GaussianFilter::PAPER,
            optimizer: Optimizer {
                units: Units::Relative,
                center: 0.1,
                shape: 0.1,
                // A short run must get to its colours in fewer steps.
                color: 0.015 * (300.0 / iterations.max(1) as f32).clamp(1.0, 4.0).sqrt(),
                beta1: 0.9,
                beta2: 0.99,
                epsilon: 1e-15,
                schedule: LearningRateSchedule::Linear(0.6),
            },
            quantization: Quantization {
                warm_up: 0.6,
                position_bits: 12,
                shape_bits: 10,
                color_bits: 6,
                learning_rate: 1e-3,
            },
        }
    }

    /// GaussianImage++ as published. Where the paper and its released code differ, this has what
    /// measured better: learning rates of 0.18 and growth by half of what is missing (text; code:
    /// 0.018 and 1,000 at a time), newcomers without colour and quantizers that round (code; text:
    /// the source's colour, quantizers that truncate).
    #[must_use]
    pub fn paper() -> Self {
        Self {
            iterations: 50_000,
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
                distortion: Distortion::L1,
                placement: Placement::Top,
                color: NewColor::Zero,
                shape: NewShape::Random,
                prune_interval: 100,
            },
            filter: GaussianFilter::PAPER,
            optimizer: Optimizer {
                units: Units::Absolute,
                center: 0.18,
                shape: 0.18,
                color: 0.18,
                beta1: 0.9,
                beta2: 0.999,
                epsilon: 1e-15,
                schedule: LearningRateSchedule::Halving(20_000),
            },
            quantization: Quantization {
                warm_up: 0.12,
                position_bits: 12,
                shape_bits: 10,
                color_bits: 6,
                learning_rate: 1e-3,
            },
        }
    }

    /// Says what is out of range, if anything is, and what is allowed.
    pub(crate) fn check(&self) -> Result<(), &'static str> {
        let share = |value: f32| value > 0.0 && value <= 1.0;
        let positive = |value: f32| value > 0.0 && value.is_finite();
        let depth = |bits: u8| (1..=16).contains(&bits);
        let Self { densification: d, optimizer: o, quantization: q, .. } = self;
        let rules = [
            (self.iterations >= 1, "iterations must be at least 1"),
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
            (d.portion != Portion::Fixed(0), "densification.portion must be at least 1"),
            (
                self.filter.variance(1, 1).is_some(),
                "filter must be finite, its alpha and cap positive, and not negative",
            ),
            (
                [o.center, o.shape, o.color, q.learning_rate].into_iter().all(positive),
                "learning rates must be positive and finite",
            ),
            (
                [o.beta1, o.beta2].iter().all(|beta| (0.0..1.0).contains(beta)),
                "beta1 and beta2 must be in [0, 1)",
            ),
            (o.epsilon >= 0.0 && o.epsilon.is_finite(), "epsilon must be finite, not negative"),
            (
                o.schedule != LearningRateSchedule::Halving(0),
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

    /// The variance for newcomers that make the number of Gaussians `count`; `None` if the
    /// constants make no variance.
    pub(crate) fn variance(self, pixels: usize, count: usize) -> Option<f32> {
        let (variance, sound) = match self {
            Self::ContentAware { alpha, cap } => {
                ((pixels as f32 / (alpha * count as f32)).min(cap), alpha > 0.0 && cap > 0.0)
            }
            Self::Constant(variance) => (variance, variance >= 0.0),
        };
        (sound && variance.is_finite()).then_some(variance)
    }
}

impl LearningRateSchedule {
    /// The factor on all learning rates at an iteration.
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
