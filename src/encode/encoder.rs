//! The public interface of the encoder: its options, and the file and report that it returns.

use core::ops::ControlFlow;
use std::sync::Arc;

use super::adopted;
use super::aim::Aim;
use super::appearance::Curve;
use super::error::{EncodeError, OptionError};
use super::fit::training::Training;
use super::importance::Importance;
use super::job::Job;
use super::options::{Precision, Target, Tune};
use super::outcome::Outcome;
use super::pipeline;
use super::progress::{Observer, Progress};
use super::shortfall::Shortfall;
use super::source::Source;
use super::stopwatch::Stopwatch;
use super::texture::USUAL_STRENGTH;
use crate::color::ColorModel;
use crate::container::{Header, Metadata};
use crate::kernel::Kernel;
use crate::limits::Limits;
use crate::render::Picture;
use crate::threads::Threads;

/// A way from jobs for a source, of rising effort, to the file of the last one.
type Encode<'a> = dyn Fn(&[Job<'_>], &mut Observer<'_>) -> Result<Outcome, EncodeError> + Sync + 'a;

// Constants: docs/tuning.md, "Iterations".
/// For the efforts 1 to 7: iterations of training, and passes of rate-distortion optimization over
/// the codes of an entropy-coded file. In a short run, time is better spent on iterations.
const EFFORTS: [(u32, u32); 7] =
    [(36, 1), (75, 2), (170, 4), (350, 8), (700, 10), (1_400, 10), (2_800, 12)];
/// Fewest iterations for a target that sets the error instead of the number of Gaussians: a fit
/// of fewer iterations needs far too many Gaussians to reach the error.
const MIN_ITERATIONS_BY_ERROR: u32 = 180;

/// The strongest texture.
const MOST_STRENGTH: u8 = 100;

/// Pictures of at most so many pixels are encoded with the lower efforts as well.
const SMALL: usize = 1 << 15;

/// Encodes interleaved 8-bit samples, rows from the top, with the default options of [`Encoder`],
/// and returns the `.gip` file.
///
/// ```no_run
/// # fn main() -> Result<(), Box<dyn std::error::Error>> {
/// let pixels = vec![128; 640 * 480 * 3];
/// let file = image_gip::encode(640, 480, image_gip::ColorModel::Rgb, &pixels)?;
/// std::fs::write("picture.gip", file)?;
/// # Ok(())
/// # }
/// ```
///
/// # Errors
/// [`EncodeError::Source`] when a side is not 1 to 2^20 pixels long, or `samples` does not hold
/// width x height x channels samples; [`EncodeError::Limit`] when the picture exceeds the default
/// [`Limits`].
pub fn encode(
    width: u32,
    height: u32,
    color: ColorModel,
    samples: &[u8],
) -> Result<Vec<u8>, EncodeError> {
    let source = Source::new_u8(width, height, color, samples)?;
    Ok(Encoder::new().encode(&source)?.bytes)
}

/// An encoder of `.gip` files and its options. For the default options,
/// [`encode`](crate::encode()) is a single call.
///
/// ```no_run
/// # fn main() -> Result<(), Box<dyn std::error::Error>> {
/// use image_gip::{ColorModel, Encoder, Source, Target};
///
/// let pixels = vec![128; 640 * 480 * 3];
/// let source = Source::new_u8(640, 480, ColorModel::Rgb, &pixels)?;
/// let encoded = Encoder::new().with_target(Target::Gaussians(2000)).encode(&source)?;
/// std::fs::write("picture.gip", &encoded.bytes)?;
/// println!("{:.2} dB with {} Gaussians", encoded.report.psnr, encoded.report.gaussians);
/// # Ok(())
/// # }
/// ```
#[derive(Clone, Debug)]
#[must_use]
pub struct Encoder {
    target: Target,
    tune: Tune,
    effort: u8,
    precision: Precision,
    texture: u8,
    first_layer: Option<u32>,
    seed: u64,
    threads: Threads,
    limits: Limits,
    pub(crate) metadata: Metadata,
    training: Option<Training>,
    keep_invisible: bool,
    importance: Option<Arc<dyn Importance>>,
}

impl Default for Encoder {
    fn default() -> Self {
        Self::new()
    }
}

impl Encoder {
    /// An encoder with the default options: [`Target::Auto`], [`Tune::Visual`], effort 4,
    /// [`Precision::Entropy`].
    pub fn new() -> Self {
        Self {
            target: Target::default(),
            tune: Tune::default(),
            effort: 4,
            precision: Precision::Entropy,
            texture: USUAL_STRENGTH,
            first_layer: None,
            seed: 0,
            threads: Threads::Pool,
            limits: Limits::default(),
            metadata: Metadata::default(),
            training: None,
            keep_invisible: false,
            importance: None,
        }
    }

    /// The target that the file has to meet: a number of Gaussians, a size, a rate, a PSNR or a
    /// quality. Default [`Target::Auto`].
    pub fn with_target(mut self, target: Target) -> Self {
        self.target = target;
        self
    }

    /// What to minimize for the size of the file. Default [`Tune::Visual`].
    pub fn with_tune(mut self, tune: Tune) -> Self {
        self.tune = tune;
        self
    }

    /// How much time to spend, from 1 (least) to 7 (most). Default 4. Each effort takes about twice as
    /// long as the one before. A picture of at most 32,768 pixels is encoded with the lower efforts as well,
    /// and one that is to have at most 1,000 bytes several times; the best file is kept.
    pub fn with_effort(mut self, effort: u8) -> Self {
        self.effort = effort;
        self
    }

    /// How the attributes of the Gaussians are stored. Default [`Precision::Entropy`].
    pub fn with_precision(mut self, precision: Precision) -> Self {
        self.precision = precision;
        self
    }

    /// How strong the texture is, from 0 (none) to 100. Default 50, with which pictures look most like their
    /// sources. It takes the place of fine irregular detail that the file has no bits for, such as sand, water
    /// and leaves, and takes 1 to 3 % of the file. Only files of [`Precision::Entropy`] with [`Tune::Visual`] have
    /// one, and only where the source has such detail. A file that is to have at most 1,000 bytes has none.
    pub fn with_texture(mut self, strength: u8) -> Self {
        self.texture = strength;
        self
    }

    /// Most bytes of the file that the first layer makes ([`Prefixes`](crate::Prefixes)): a placeholder, with which the
    /// whole file begins. What says its colours and an orientation count as well; all other metadata then stand
    /// after the first layer, but Exif that turns the picture. Default `None`: the first layer has about a tenth of the file. Files of
    /// [`Precision::Packed`] and [`Precision::Float`] have layers of the usual size in any case.
    pub fn with_first_layer(mut self, bytes: Option<u32>) -> Self {
        self.first_layer = bytes;
        self
    }

    /// The seed of all random numbers. The same source, options and seed give the same file.
    /// Default 0.
    pub fn with_seed(mut self, seed: u64) -> Self {
        self.seed = seed;
        self
    }

    /// The threads to use; the file does not depend on them. Default [`Threads::Pool`].
    pub fn with_threads(mut self, threads: Threads) -> Self {
        self.threads = threads;
        self
    }

    /// The limits of the decoder that is to read the file: what it would refuse is not encoded.
    /// Default [`Limits::default`], those of every decoder that is not told otherwise.
    pub fn with_limits(mut self, limits: Limits) -> Self {
        self.limits = limits;
        self
    }

    /// The ICC profile, Exif, XMP and texts to store with the picture, as they are. Default: none.
    /// `Metadata::retain` (feature `metadata`) drops what is private before.
    ///
    /// An orientation in Exif says how the samples are to be turned for display. Of samples that have been
    /// turned, `Metadata::reset_orientation` says so.
    pub fn with_metadata(mut self, metadata: Metadata) -> Self {
        self.metadata = metadata;
        self
    }

    /// Trains with these constants instead of those that the effort implies. The effort then sets
    /// only the number of passes of rate-distortion optimization ([`Precision::Entropy`]).
    pub fn with_training(mut self, training: Training) -> Self {
        self.training = Some(training);
        self
    }

    /// Whether colours are kept where alpha is 0. Default `false`: what does not show gets the colours
    /// around it, which takes fewer bytes and leaves no fringes when the picture is scaled; errors of a
    /// colour count times alpha. With `true` all samples count as they are stored, as for masks that
    /// are no opacity.
    pub fn with_keep_invisible(mut self, keep_invisible: bool) -> Self {
        self.keep_invisible = keep_invisible;
        self
    }

    /// What part of the picture matters more: how much errors count by their place, with [`Tune::Visual`]. The target
    /// is still that of the whole picture. Default `None`: everything matters the same.
    pub fn with_importance(mut self, importance: Option<Arc<dyn Importance>>) -> Self {
        self.importance = importance;
        self
    }

    /// Encodes `source`. A target that cannot be met is not an error: the file comes as close as
    /// it can, and [`Report::shortfall`] gives the reason.
    ///
    /// # Errors
    /// [`EncodeError::Option`] when an option is out of range, when the target is a size that only
    /// the metadata keep out of reach, or when no thread can be started. [`EncodeError::Limit`] when
    /// the decoder would refuse the file: for the size of the picture, its metadata or the target's
    /// number of Gaussians, before any work is done; for what the Gaussians take, at the end.
    pub fn encode(&self, source: &Source<'_>) -> Result<Encoded, EncodeError> {
        self.encode_with(source, &mut |_| ControlFlow::Continue(()))
    }

    /// As [`Encoder::encode`], with a callback: `progress` is called at every iteration of
    /// training, and every few milliseconds during everything that takes longer, always on one thread. (Where
    /// the platform has no clock, it is called as often as the stages of the work begin.)
    /// It cancels the encoding by returning [`ControlFlow::Break`].
    ///
    /// # Errors
    /// Those of [`Encoder::encode`], and [`EncodeError::Cancelled`] when `progress` cancels.
    pub fn encode_with(
        &self,
        source: &Source<'_>,
        progress: &mut (dyn FnMut(&Progress) -> ControlFlow<()> + Send),
    ) -> Result<Encoded, EncodeError> {
        self.run(source, &pipeline::encode, progress)
    }

    /// Encodes Gaussians that were fitted to `source` by other means: codes are chosen for the target as they are
    /// for those of [`Encoder::encode`], by coordinate descent over rate and distortion. Nothing is trained. The
    /// base colour is that of the picture's header.
    ///
    /// A Gaussian whose colour exceeds 2 full samples, whose centre is far outside of the picture, or one of whose
    /// standard deviations exceeds twice the longer side, begins with the nearest values within. Those that are not
    /// worth their bytes are left out, and of those for which a number of Gaussians or bytes has no room, or which a
    /// PSNR or quality does not need, the least important ones. For a target of more bytes or quality than the
    /// Gaussians have, see [`Report::shortfall`]. [`Writer`](crate::Writer) stores Gaussians as they are, without a
    /// source.
    ///
    /// # Errors
    /// Those of [`Encoder::encode`]; and [`EncodeError::Option`] when the precision is not
    /// [`Precision::Entropy`], when the picture's header has another size, colour model or depth than the source,
    /// or when its kernel is not the quartic one.
    pub fn encode_fitted(
        &self,
        source: &Source<'_>,
        fitted: &Picture<'_>,
    ) -> Result<Encoded, EncodeError> {
        self.encode_fitted_with(source, fitted, &mut |_| ControlFlow::Continue(()))
    }

    /// As [`Encoder::encode_fitted`], with a callback as that of [`Encoder::encode_with`].
    ///
    /// # Errors
    /// Those of [`Encoder::encode_fitted`], and [`EncodeError::Cancelled`] when `progress` cancels.
    pub fn encode_fitted_with(
        &self,
        source: &Source<'_>,
        fitted: &Picture<'_>,
        progress: &mut (dyn FnMut(&Progress) -> ControlFlow<()> + Send),
    ) -> Result<Encoded, EncodeError> {
        self.check_fitted(source, fitted.header())?;
        let encode =
            |jobs: &[Job<'_>], observer: &mut Observer<'_>| adopted::encode(jobs, fitted, observer);
        self.run(source, &encode, progress)
    }

    /// Encodes `source` in a way.
    fn run(
        &self,
        source: &Source<'_>,
        encode: &Encode<'_>,
        progress: &mut (dyn FnMut(&Progress) -> ControlFlow<()> + Send),
    ) -> Result<Encoded, EncodeError> {
        let start = Stopwatch::start();
        let (aim, runs) = self.check(source.pixels())?;
        let iterations = runs.iter().map(|(training, _)| training.iterations).sum();
        let mut observer = Observer::new(progress, iterations);
        let source = source.keeping_invisible(self.keep_invisible);
        let source = source.seen_by(Curve::of(&self.metadata));
        let source = source.weighted_by(self.importance.as_deref());
        let jobs: Vec<_> = runs
            .iter()
            .map(|(training, passes)| Job {
                source: &source,
                aim,
                tune: self.tune,
                precision: self.precision,
                texture: self.texture,
                first_layer: self.first_layer,
                seed: self.seed,
                metadata: &self.metadata,
                training,
                limits: &self.limits,
                passes: *passes,
            })
            .collect();
        let outcome = on_threads(self.threads, || encode(&jobs, &mut observer))??;
        Ok(Encoded {
            bytes: outcome.file,
            report: Report {
                gaussians: outcome.gaussians,
                psnr: outcome.psnr.rounded,
                psnr_float: outcome.psnr.exact,
                quality: outcome.quality,
                texture_gaussians: outcome.texture.gaussians,
                texture_bytes: outcome.texture.bytes,
                iterations: outcome.work.iterations,
                evaluations: outcome.work.evaluations,
                seconds: start.elapsed().as_secs_f64(),
                peak_memory: outcome.work.peak_memory as u64,
                shortfall: outcome.shortfall,
            },
        })
    }

    /// Checks that Gaussians with this header can be encoded for a source.
    fn check_fitted(&self, source: &Source<'_>, header: &Header) -> Result<(), OptionError> {
        let is_of_source = [header.width, header.height] == [source.width(), source.height()]
            && header.color == source.color()
            && header.depth == source.depth();
        let rules = [
            (
                self.precision == Precision::Entropy,
                "only the entropy coding fits their codes to a source",
            ),
            (
                is_of_source,
                "they must be of a picture of the source's size, channels and bits per sample",
            ),
            (header.kernel == Kernel::Quartic, "entropy coding needs the quartic kernel"),
        ];
        match rules.into_iter().find(|(holds, _)| !holds) {
            Some((_, rule)) => Err(OptionError::Fitted(rule)),
            None => Ok(()),
        }
    }

    /// Checks all options; returns the aim for a picture with so many pixels, and the constants of training and
    /// the number of passes of rate-distortion optimization, of lower efforts as well if it is small.
    fn check(&self, pixels: usize) -> Result<(Aim, Vec<(Training, u32)>), EncodeError> {
        let efforts = EFFORTS.get(..usize::from(self.effort)).filter(|efforts| !efforts.is_empty());
        let efforts = efforts.ok_or(OptionError::Effort(self.effort))?;
        if self.texture > MOST_STRENGTH {
            return Err(OptionError::Texture(self.texture).into());
        }
        if self.importance.is_some() && self.tune == Tune::Psnr {
            return Err(OptionError::Importance.into());
        }
        let aim = Aim::new(self.target, pixels)?;
        let fewest = if aim.is_by_error() { MIN_ITERATIONS_BY_ERROR } else { 1 };
        self.metadata.check().map_err(OptionError::Metadata)?;
        let run = |&(iterations, passes): &(u32, u32)| {
            let fast = Training::fast(iterations.max(fewest));
            let training = match &self.training {
                Some(training) => training.clone(),
                None if self.precision == Precision::Packed => fast.with_quantization(),
                None => fast,
            };
            (training, passes)
        };
        let is_small = pixels <= SMALL && self.training.is_none();
        // Efforts with no more than the fewest iterations have the same fit.
        let lowest = efforts.iter().rposition(|&(iterations, _)| iterations <= fewest).unwrap_or(0);
        let lowest = if is_small { lowest } else { efforts.len() - 1 };
        let runs: Vec<_> = efforts[lowest..].iter().map(run).collect();
        for (training, _) in &runs {
            training.check().map_err(OptionError::Training)?;
            if self.precision == Precision::Entropy && training.kernel != Kernel::Quartic {
                return Err(OptionError::Training("entropy coding needs the quartic kernel").into());
            }
        }
        Ok((aim, runs))
    }
}

/// Runs work on some threads: always in a pool.
pub(super) fn on_threads<T: Send>(
    threads: Threads,
    work: impl FnOnce() -> T + Send,
) -> Result<T, OptionError> {
    Ok(match threads {
        // On one of the pool's threads: handing every parallel loop over to the pool, and waking up
        // afterwards, would take longer than many of the loops.
        Threads::Pool => rayon::scope(|_| work()),
        Threads::One => {
            let pool = rayon::ThreadPoolBuilder::new().num_threads(1).build();
            pool.map_err(|error| OptionError::Threads(error.to_string()))?.install(work)
        }
    })
}

/// An encoded file and a report about it.
#[derive(Clone, Debug)]
#[non_exhaustive]
#[must_use]
pub struct Encoded {
    /// The whole `.gip` file.
    pub bytes: Vec<u8>,
    /// What the encoding achieved and cost.
    pub report: Report,
}

/// What an encoding achieved and cost.
#[derive(Clone, Debug)]
#[non_exhaustive]
pub struct Report {
    /// Number of Gaussians in the file, without those of the texture.
    pub gaussians: u32,
    /// PSNR in dB of the decoded file without its texture against the source, over all samples at the source's
    /// depth; infinite for an exact copy. Colours count as they show, times their alpha, unless those under
    /// alpha 0 are kept ([`Encoder::with_keep_invisible`]).
    pub psnr: f64,
    /// PSNR in dB of the decoded file without its texture against the source, where the decoded samples are
    /// floats, clamped but not rounded. This is the PSNR that papers report.
    pub psnr_float: f64,
    /// An estimate of the visual quality of the decoded file without its texture, from 0 to 100: the score that
    /// the metric SSIMULACRA2 would give, within about 2. The metric compares pixel by pixel, so it takes texture
    /// for an error, whatever it looks like. Of a picture with alpha it is the lower one of those over
    /// black and over white; of a picture below 8 x 8 pixels, which the metric does not take, that among
    /// its mirror images.
    pub quality: f64,
    /// Number of Gaussians of the texture's map; 0 if the file has no texture.
    pub texture_gaussians: u32,
    /// Size in bytes of the texture in the file.
    pub texture_bytes: u64,
    /// Iterations of training.
    pub iterations: u32,
    /// Evaluations of the kernel and its gradient during training, one for each pair of a Gaussian
    /// and a pixel.
    pub evaluations: u64,
    /// Wall-clock time in seconds; 0 where the platform has no clock (`wasm32-unknown-unknown`).
    pub seconds: f64,
    /// Largest amount of memory in bytes that the encoder's buffers took at one time, not counting
    /// the source and the file.
    pub peak_memory: u64,
    /// Why the file misses its target by more than the tolerance (1 % of a size, 0.05 dB of a
    /// PSNR, 1 of a quality); `None` when it meets the target.
    pub shortfall: Option<Shortfall>,
}
