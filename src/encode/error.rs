//! What can go wrong while encoding.

use thiserror::Error;

/// Why a picture was not encoded.
#[derive(Debug, Error)]
#[non_exhaustive]
pub enum EncodeError {
    /// The source is not a picture that the format can hold.
    #[error("invalid source: {0}")]
    Source(String),
    /// An option is out of range; the text says what is allowed.
    #[error("invalid option: {0}")]
    Option(String),
    /// The progress callback asked to stop.
    #[error("encoding was cancelled")]
    Cancelled,
}
