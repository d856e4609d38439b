//! The encoder: pixels to Gaussians to bytes (paper: GaussianImage++).

mod error;
mod options;
mod source;
mod writer;

use std::ops::ControlFlow;
use std::time::Instant;

pub use error::EncodeError;
pub use options::{Precision, Target};
pub use source::Source;

use crate::container::{Header, Metadata};
use crate::gaussian::Chart;
use crate::quantizer::Quantizer;
use crate::render::Kernel;

/// Encodes pictures to `.gip`.
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
    threads: Option<usize>,
    pub(crate) metadata: Metadata,
}

impl Default for Encoder {
    fn default() -> Self {
        Self::new()
    }
}

impl Encoder {
    /// An encoder that picks the number of Gaussians by itself, at default effort, packed.
    pub fn new() -> Self {
        Self {
            target: Target::default(),
            effort: 5,
            precision: Precision::Packed,
            seed: 0,
            threads: None,
            metadata: Metadata::default(),
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

    /// Whether attributes are quantized. Default [`Precision::Packed`].
    pub fn with_precision(mut self, precision: Precision) -> Self {
        self.precision = precision;
        self
    }

    /// Seed of everything random. Same source, options and seed give the same file.
    pub fn with_seed(mut self, seed: u64) -> Self {
        self.seed = seed;
        self
    }

    /// How many threads to use; `None`, the default, uses the current `rayon` pool. The file does
    /// not depend on it.
    pub fn with_threads(mut self, threads: Option<usize>) -> Self {
        self.threads = threads;
        self
    }

    /// ICC profile, Exif, XMP and texts to store with the picture.
    pub fn with_metadata(mut self, metadata: Metadata) -> Self {
        self.metadata = metadata;
        self
    }

    /// Encodes `source`.
    ///
    /// # Errors
    /// When an option is out of range.
    pub fn encode(&self, source: &Source<'_>) -> Result<Encoded, EncodeError> {
        self.encode_with(source, &mut |_| ControlFlow::Continue(()))
    }

    /// Encodes `source` and calls `progress` several times a second.
    ///
    /// # Errors
    /// When an option is out of range, and [`EncodeError::Cancelled`] when `progress` breaks.
    pub fn encode_with(
        &self,
        source: &Source<'_>,
        progress: &mut dyn FnMut(&Progress) -> ControlFlow<()>,
    ) -> Result<Encoded, EncodeError> {
        let start = Instant::now();
        if progress(&Progress { iteration: 0, iterations: 1, gaussians: 0, psnr: 0.0 }).is_break() {
            return Err(EncodeError::Cancelled);
        }
        let header = Header {
            version: 0,
            width: source.width(),
            height: source.height(),
            color: source.color(),
            depth: source.depth(),
            gaussians: 0,
            layers: 0,
            kernel: Kernel::Quartic,
            chart: Chart::Cholesky,
            base_color: [32768; 4],
        };
        let header =
            Header {
                base_color: std::array::from_fn(|c| {
                    if c < header.color.channels() { 32768 } else { 0 }
                }),
                ..header
            };
        let quantizers = vec![Quantizer::Float; header.components()];
        let bytes = writer::write(&header, &self.metadata, &quantizers, &[]);
        Ok(Encoded {
            bytes,
            report: Report {
                gaussians: 0,
                psnr: 0.0,
                psnr_float: 0.0,
                iterations: 0,
                seconds: start.elapsed().as_secs_f64(),
                peak_memory: 0,
                shortfall: None,
            },
        })
    }
}

/// How far the encoder is.
#[derive(Clone, Copy, Debug)]
#[non_exhaustive]
pub struct Progress {
    /// Iterations done.
    pub iteration: u32,
    /// Iterations in all, as far as known.
    pub iterations: u32,
    /// Gaussians at this moment.
    pub gaussians: u32,
    /// PSNR of the float rendering at this moment, in dB.
    pub psnr: f64,
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
    /// PSNR of the float rendering before quantization, clamped but not rounded, in dB.
    pub psnr_float: f64,
    /// Iterations of training.
    pub iterations: u32,
    /// Wall-clock time in seconds.
    pub seconds: f64,
    /// Most bytes that the encoder held at a time, the source and the file not counted.
    pub peak_memory: u64,
    /// Why the target was not met within 1 % of size or 0.05 dB; `None` when it was.
    pub shortfall: Option<String>,
}
