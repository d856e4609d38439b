//! What an error prints, and the exit status that it ends with.

use image_gip::{EncodeError, OptionError};
use thiserror::Error;

use crate::limits;

/// The exit status when some of several files failed.
pub(crate) const SOME_FAILED: u8 = 3;

/// The user asked for something that makes no sense.
#[derive(Debug, Error)]
#[error("{0}")]
pub(crate) struct WrongUsage(pub(crate) String);

/// The exit status after an error: 2 for wrong usage, 1 for all else.
pub(crate) fn exit_status(error: &anyhow::Error) -> u8 {
    let is_option = matches!(error.downcast_ref(), Some(EncodeError::Option(_)));
    if is_option || error.is::<WrongUsage>() { 2 } else { 1 }
}

/// An error and its causes on one line. A cause that the text of an error repeats is printed once.
pub(crate) fn one_line(error: &anyhow::Error) -> String {
    let mut line = String::new();
    for cause in error.chain() {
        let cause = cause.to_string();
        let cause = cause.split_whitespace().collect::<Vec<_>>().join(" ");
        if !line.contains(&cause) {
            if !line.is_empty() {
                line.push_str(": ");
            }
            line.push_str(&cause);
        }
    }
    if let Some(advice) = advice(error) {
        line.push_str("; ");
        line.push_str(&advice);
    }
    line
}

/// What the user can do about an error.
fn advice(error: &anyhow::Error) -> Option<String> {
    let is_by_metadata = error.chain().any(|cause| {
        matches!(cause.downcast_ref(), Some(EncodeError::Option(OptionError::Size { .. })))
    });
    if is_by_metadata {
        return Some("--metadata safe or none leaves room".to_owned());
    }
    limits::advice(error)
}
