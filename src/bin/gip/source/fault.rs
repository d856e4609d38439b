//! Why a picture is not read, or not all of it, in plain words: those of libraries are for programmers.

use std::error::Error as StdError;
use std::io::{self, ErrorKind};
use std::iter::successors;

use anyhow::{Error, anyhow};
use image::{ImageError, ImageFormat};
use image_gip::Limits;
use thiserror::Error;
use tiff::TiffError;
use tiff::TiffUnsupportedError::UnsupportedCompressionMethod;

use super::format::Format;
use crate::limits::MemoryLimit;

/// Of a file that has fewer data than it has to.
pub(super) const SHORT: &str = "the data end too early";
/// Of a file whose data mean nothing.
const INVALID: &str = "invalid data";
/// How libraries say the former. Of some of their errors only the text is left.
const SHORT_OF_LIBRARIES: [&str; 3] =
    ["failed to fill whole buffer", "unexpected end of file", "not enough data"];

/// What is wrong with a file.
#[derive(Debug, Error)]
pub(super) enum Fault {
    #[error("the file is damaged: {0}")]
    Damage(&'static str),
    /// Of a format with this name.
    #[error("the file is damaged, or of a kind of {0} that is not read")]
    DamageOrKind(&'static str),
}

/// What the error of a library is about.
#[derive(Clone, Copy)]
enum Cause {
    /// Reading any file.
    System,
    Memory,
    /// A compression of TIFF that there is no decoder for.
    Compression(u16),
    Damage(&'static str),
}

/// The error of reading a file of this format, without a library's words.
pub(super) fn plain(error: Error, format: Format, limits: &Limits, allow_partial: bool) -> Error {
    let error = without_library(error, format, limits);
    match error.downcast_ref::<Fault>() {
        Some(fault) if allow_partial => anyhow!("{fault}; nothing of it can be read"),
        _ => error,
    }
}

fn without_library(error: Error, format: Format, limits: &Limits) -> Error {
    let is_unsupported = matches!(error.downcast_ref(), Some(ImageError::Unsupported(_)));
    if is_unsupported && format == Format::Image(ImageFormat::Dds) {
        return anyhow!("DDS is read with the compression DXT1, DXT3 or DXT5 alone");
    }
    match cause(error.as_ref()) {
        None | Some(Cause::System) => error,
        Some(Cause::Memory) => MemoryLimit { allowed: limits.max_memory }.into(),
        Some(Cause::Compression(code)) => anyhow!("TIFF with the compression {code} is not read"),
        Some(Cause::Damage(SHORT)) => Fault::Damage(SHORT).into(),
        Some(Cause::Damage(_)) => Fault::DamageOrKind(format.name()).into(),
    }
}

/// What is damaged in a file that a decoder stops at; `None` if the error is about something else.
pub(super) fn damage(error: &(dyn StdError + 'static)) -> Option<&'static str> {
    match cause(error)? {
        Cause::Damage(damage) => Some(damage),
        _ => None,
    }
}

/// `None` if the error is not one of a library.
fn cause(error: &(dyn StdError + 'static)) -> Option<Cause> {
    Some(if let Some(error) = error.downcast_ref() {
        match error {
            ImageError::IoError(error) => of_io(error),
            ImageError::Limits(_) => Cause::Memory,
            error => of_text(error),
        }
    } else if let Some(error) = error.downcast_ref() {
        match error {
            TiffError::IoError(error) => of_io(error),
            TiffError::UnsupportedError(UnsupportedCompressionMethod(method)) => {
                Cause::Compression(method.to_u16())
            }
            error => of_text(error),
        }
    } else if let Some(error) = error.downcast_ref() {
        match error {
            png::DecodingError::IoError(error) => of_io(error),
            png::DecodingError::LimitsExceeded => Cause::Memory,
            error => of_text(error),
        }
    } else if let Some(error) = error.downcast_ref() {
        match error {
            gif::DecodingError::Io(error) => of_io(error),
            error => of_text(error),
        }
    } else {
        of_io(error.downcast_ref()?)
    })
}

fn of_io(error: &io::Error) -> Cause {
    use ErrorKind::{InvalidData, InvalidInput, Other, UnexpectedEof};
    match error.kind() {
        UnexpectedEof => Cause::Damage(SHORT),
        InvalidData | InvalidInput | Other => of_text(error),
        _ => Cause::System,
    }
}

fn of_text(error: &(dyn StdError + 'static)) -> Cause {
    let is_short = |error: &(dyn StdError + 'static)| {
        let text = error.to_string().to_ascii_lowercase();
        SHORT_OF_LIBRARIES.iter().any(|short| text.contains(short))
    };
    let mut causes = successors(Some(error), |error| (*error).source());
    Cause::Damage(if causes.any(is_short) { SHORT } else { INVALID })
}
