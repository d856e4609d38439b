//! The errors of the encoder.

use thiserror::Error;

use crate::color::ColorModel;
use crate::container::{MAX_SIDE, MetadataError};
use crate::error::{LimitKind, PictureError};

/// What a stage of the encoder returns. Its error is [`EncodeError::Cancelled`], when the caller cancels;
/// other ones come from `pipeline.rs` and `verify.rs` alone.
pub(crate) type Result<T, E = EncodeError> = core::result::Result<T, E>;

/// Why a picture could not be encoded.
#[derive(Debug, Error)]
#[non_exhaustive]
pub enum EncodeError {
    /// The source is not a picture that the format can hold.
    #[error("invalid source: {0}")]
    Source(#[from] SourceError),
    /// An option is out of range.
    #[error("invalid option: {0}")]
    Option(#[from] OptionError),
    /// A decoder with the limits of [`Encoder::with_limits`](crate::Encoder::with_limits) would refuse
    /// the file.
    #[error(
        "a decoder with these limits would refuse the file: {kind}: {wanted} required, {allowed} allowed; \
         raise the limit for encoder and decoder alike"
    )]
    Limit {
        /// Which limit.
        kind: LimitKind,
        /// What the file requires, in the unit of the limit; it may require more.
        wanted: u64,
        /// The limit.
        allowed: u64,
    },
    /// The progress callback cancelled the encoding.
    #[error("encoding was cancelled")]
    Cancelled,
}

/// Why Gaussians could not be written.
#[derive(Clone, Debug, PartialEq, Error)]
#[non_exhaustive]
pub enum WriteError {
    /// The header or a Gaussian is out of range.
    #[error(transparent)]
    Picture(#[from] PictureError),
    /// A Gaussian of the texture's map is out of range.
    #[error("texture: {0}")]
    Texture(#[source] PictureError),
    /// An option is out of range.
    #[error("invalid option: {0}")]
    Option(#[from] OptionError),
    /// The quantizers are not such that a file can have them; the text is the rule that they break.
    #[error("quantizers: {0}")]
    Quantizers(&'static str),
    /// No file of this colour model can have the steps.
    #[error("steps that no file can have; take those of a file")]
    Steps,
    /// The step of colour is out of range.
    #[error("a step of colour of {0}; it must be 10^-6 to 1000")]
    ColorStep(f32),
    /// A decoder with the limits of [`Writer::with_limits`](crate::Writer::with_limits) would refuse the file.
    #[error(
        "a decoder with these limits would refuse the file: {kind}: {wanted} required, {allowed} allowed"
    )]
    Limit {
        /// Which limit.
        kind: LimitKind,
        /// What the file requires, in the unit of the limit; it may require more.
        wanted: u64,
        /// The limit.
        allowed: u64,
    },
}

/// Why a source is not a picture that the format can hold.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Error)]
#[non_exhaustive]
pub enum SourceError {
    /// A side is not 1 to 2^20 pixels long.
    #[error("{width}x{height} pixels; each side must be 1 to {MAX_SIDE}")]
    Size {
        /// Width in pixels.
        width: u32,
        /// Height in pixels.
        height: u32,
    },
    /// The number of samples is not width x height x channels.
    #[error("{found} samples; {width}x{height} {color:?} needs {wanted}")]
    SampleCount {
        /// Number of samples given.
        found: usize,
        /// Number of samples that the picture needs.
        wanted: u64,
        /// Width in pixels.
        width: u32,
        /// Height in pixels.
        height: u32,
        /// What the channels mean.
        color: ColorModel,
    },
}

/// An option that is out of range; the text says what is allowed.
#[derive(Clone, Debug, PartialEq, Error)]
#[non_exhaustive]
pub enum OptionError {
    /// The effort is not 1 to 7.
    #[error("effort {0}; it must be 1 to 7")]
    Effort(u8),
    /// The strength of the texture is more than 100.
    #[error("texture {0}; it must be 0 to 100")]
    Texture(u8),
    /// Importance is given, but all errors are to count the same.
    #[error("importance; the tuning for PSNR counts all errors the same")]
    Importance,
    /// The number in a [`Target`](crate::Target) is out of range.
    #[error("{name} {value}; it must be {least} to {most}")]
    Target {
        /// Name of the quantity, with its unit.
        name: &'static str,
        /// The number.
        value: f64,
        /// The least number allowed.
        least: f64,
        /// The largest number allowed.
        most: f64,
    },
    /// The target is a size that a file without Gaussians exceeds by its metadata alone.
    #[error(
        "a size of {bytes} bytes; this picture takes at least {least} without any Gaussian, of which \
         {metadata} are metadata"
    )]
    Size {
        /// The target in bytes.
        bytes: u64,
        /// Size in bytes of the file without Gaussians.
        least: u64,
        /// Size in bytes of the metadata in it.
        metadata: u64,
    },
    /// The first layer cannot be so small.
    #[error(
        "a first layer that makes a file of {bytes} bytes; that of this picture takes at least {least}, with what \
         says its colours and which way is up"
    )]
    FirstLayer {
        /// Most bytes of the file that was asked for.
        bytes: u32,
        /// The least that can be asked for.
        least: u32,
    },
    /// The metadata cannot be stored.
    #[error(transparent)]
    Metadata(#[from] MetadataError),
    /// A constant of [`Training`](crate::training::Training) is out of range; the text is the rule
    /// that it breaks.
    #[error("training: {0}")]
    Training(&'static str),
    /// Gaussians that are given cannot be encoded so; the text is the rule that they break.
    #[error("Gaussians: {0}")]
    Fitted(&'static str),
    /// No thread could be started.
    #[error("no thread could be started: {0}")]
    Threads(String),
}
