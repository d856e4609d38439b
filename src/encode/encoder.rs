//! What a caller holds: the encoder with its options, and what it returns.

use core::ops::ControlFlow;
use std::time::Instant;

use super::error::{EncodeError, OptionError};
use super::fit::training::Training;
use super::job::Job;
use super::options::{Precision, Target};
use super::pipeline;
use super::progress::{Observer, Progress};
use super::shortfall::Shortfall;
use super::source::Source;
use crate::color::ColorModel;
use crate::container::Metadata;
use crate::kernel::Kernel;
use crate::threads::Threads;

/// Iterations by effort, from 1 to 9, and passes over the codes of coded Gaussians: where time is
/// short, iterations gain more, and in the end they gain little without the passes.
const EFFORTS: [(u32, u32); 9] = [
    (60, 2),
    (90, 2),
    (180, 2),
    (300, 4),
    (600, 8),
    (1_200, 12),
    (2_400, 16),
    (4_800, 16),
    (9_600, 16),
];
/// Fewest iterations where the error decides how many Gaussians there are: after fewer, it would take
/// far too many.
const FEWEST_BY_ERROR: u32 = 180;

/// Encodes interleaved 8-bit samples, rows from the top, with the default options of [`Encoder`].
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
/// When a side is not 1 to 2^20, or there are not width x height x channels samples.
pub fn encode(
    width: u32,
    height: u32,
    color: ColorModel,
    samples: &[u8],
) -> Result<Vec<u8>, EncodeError> {
    let source = Source::new_u8(width, height, color, samples)?;
    Ok(Encoder::new().encode(&source)?.bytes)
}

/// Encodes pictures to `.gip`, with options. [`encode`](crate::encode()) is the short way without
/// them.
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
    effort: u8,
    precision: Precision,
    seed: u64,
    threads: Threads,
    pub(crate) metadata: Metadata,
    training: Option<Training>,
}

impl Default for Encoder {
    fn default() -> Self {
        Self::new()
    }
}

impl Encoder {
    /// An encoder that picks the number of Gaussians by itself, at default effort, entropy coded.
    pub fn new() -> Self {
        Self {
            target: Target::default(),
            effort: 5,
            precision: Precision::Entropy,
            seed: 0,
            threads: Threads::Pool,
            metadata: Metadata::default(),
            training: None,
        }
    }

    /// What the file shall meet: a count, a size, a rate, a quality.
    pub fn with_target(mut self, target: Target) -> Self {
        self.target = target;
        self
    }

    /// How much time to spend, 1 (least) to 9 (most). Default 5.
    pub fn with_effort(mut self, effort: u8) -> Self {
        self.effort = effort;
        self
    }

    /// How attributes are stored. Default [`Precision::Entropy`].
    pub fn with_precision(mut self, precision: Precision) -> Self {
        self.precision = precision;
        self
    }

    /// Seed of everything random. Same source, options and seed give the same file.
    pub fn with_seed(mut self, seed: u64) -> Self {
        self.seed = seed;
        self
    }

    /// The threads to use. Default [`Threads::Pool`]. The file does not depend on them.
    pub fn with_threads(mut self, threads: Threads) -> Self {
        self.threads = threads;
        self
    }

    /// ICC profile, Exif, XMP and texts to store with the picture.
    pub fn with_metadata(mut self, metadata: Metadata) -> Self {
        self.metadata = metadata;
        self
    }

    /// Sets the constants of training in place of those that the effort implies.
    pub fn with_training(mut self, training: Training) -> Self {
        self.training = Some(training);
        self
    }

    /// Encodes `source`.
    ///
    /// # Errors
    /// When an option is out of range, or no file can meet the target.
    pub fn encode(&self, source: &Source<'_>) -> Result<Encoded, EncodeError> {
        self.encode_with(source, &mut |_| ControlFlow::Continue(()))
    }

    /// Encodes `source` and calls `progress` at every iteration, and every few milliseconds of what
    /// takes longer.
    ///
    /// # Errors
    /// As [`Encoder::encode`], and [`EncodeError::Cancelled`] when `progress` breaks.
    pub fn encode_with(
        &self,
        source: &Source<'_>,
        progress: &mut (dyn FnMut(&Progress) -> ControlFlow<()> + Send),
    ) -> Result<Encoded, EncodeError> {
        let start = Instant::now();
        let (training, passes) = self.check()?;
        let mut observer = Observer::new(progress, training.iterations);
        let job = Job {
            source,
            target: self.target,
            precision: self.precision,
            seed: self.seed,
            metadata: &self.metadata,
            training: &training,
            passes,
        };
        let mut run = || pipeline::encode(&job, &mut observer);
        let outcome = match self.threads {
            Threads::Pool => run(),
            Threads::One => pool_of_one()?.install(run),
        }?;
        Ok(Encoded {
            bytes: outcome.file,
            report: Report {
                gaussians: outcome.gaussians,
                psnr: outcome.distortion.psnr,
                psnr_float: outcome.distortion.psnr_float,
                iterations: outcome.work.iterations,
                evaluations: outcome.work.evaluations,
                seconds: start.elapsed().as_secs_f64(),
                peak_memory: outcome.work.peak_memory as u64,
                shortfall: outcome.shortfall,
            },
        })
    }

    /// Checks all options and settles the training's constants and the passes over codes.
    fn check(&self) -> Result<(Training, u32), EncodeError> {
        let Some(&(iterations, passes)) = EFFORTS.get(usize::from(self.effort).wrapping_sub(1))
        else {
            return Err(OptionError::Effort(self.effort).into());
        };
        self.target.check()?;
        let fewest = if self.target.is_by_error() { FEWEST_BY_ERROR } else { 1 };
        let iterations = iterations.max(fewest);
        self.metadata.check().map_err(OptionError::Metadata)?;
        let training = self.training.clone().unwrap_or_else(|| Training::fast(iterations));
        training.check().map_err(OptionError::Training)?;
        if self.precision == Precision::Entropy && training.kernel != Kernel::Quartic {
            return Err(OptionError::Training("entropy coding needs the quartic kernel").into());
        }
        Ok((training, passes))
    }
}

/// A pool for those who want one thread: training knows of no other way to share work.
fn pool_of_one() -> Result<rayon::ThreadPool, OptionError> {
    let pool = rayon::ThreadPoolBuilder::new().num_threads(1).build();
    pool.map_err(|error| OptionError::Threads(error.to_string()))
}

/// A file and how it came about.
#[derive(Clone, Debug)]
#[non_exhaustive]
#[must_use]
pub struct Encoded {
    /// The whole `.gip` file.
    pub bytes: Vec<u8>,
    /// Figures.
    pub report: Report,
}

/// Figures of one encoding.
#[derive(Clone, Debug)]
#[non_exhaustive]
pub struct Report {
    /// Gaussians in the file.
    pub gaussians: u32,
    /// PSNR of the decoded file against the source at the source's depth, in dB; infinite for an
    /// exact copy.
    pub psnr: f64,
    /// PSNR of the decoded file before it is rounded to samples (but clamped), in dB: what papers
    /// report.
    pub psnr_float: f64,
    /// Iterations of training.
    pub iterations: u32,
    /// Kernel evaluations of training: pairs of a Gaussian and a pixel, each with its gradient.
    pub evaluations: u64,
    /// Wall-clock time in seconds.
    pub seconds: f64,
    /// Most bytes that the encoder held at a time, the source and the file not counted.
    pub peak_memory: u64,
    /// Why the target was not met within 1 % of size or 0.05 dB; `None` when it was.
    pub shortfall: Option<Shortfall>,
}
