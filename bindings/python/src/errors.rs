//! The crate's errors as the exceptions of `image_gip._errors`.

use image_gip::{ChunkType, DecodeError, EncodeError, LimitKind, OptionError};
use pyo3::exceptions::{PyRuntimeError, PyValueError};
use pyo3::prelude::*;

/// An exception of the class with this name.
fn exception<'py>(py: Python<'py>, class: &str, message: String) -> PyResult<Bound<'py, PyAny>> {
    py.import("image_gip._errors")?.getattr(class)?.call1((message,))
}

/// Makes an exception; the error of making it, if that fails.
fn raised<'py>(made: PyResult<Bound<'py, PyAny>>) -> PyErr {
    made.map_or_else(|error| error, PyErr::from_value)
}

/// The exception for an error of the decoder.
pub(crate) fn decode_error(py: Python<'_>, error: DecodeError) -> PyErr {
    let message = error.to_string();
    let of_chunk = |class: &str, chunk: Option<ChunkType>| {
        let exception = exception(py, class, message.clone())?;
        exception.setattr("chunk", chunk.map(|chunk| chunk.to_string()))?;
        Ok(exception)
    };
    raised(match error {
        DecodeError::Signature => of_chunk("SignatureError", None),
        DecodeError::Malformed { chunk, .. } => of_chunk("MalformedError", Some(chunk)),
        DecodeError::Unsupported { chunk, .. } => of_chunk("UnsupportedError", Some(chunk)),
        DecodeError::UnexpectedEnd { chunk } => of_chunk("UnexpectedEndError", chunk),
        DecodeError::Limit { kind, wanted, allowed } => {
            limit_error(py, &message, kind, wanted, allowed)
        }
        DecodeError::Request(request) => return PyValueError::new_err(request.to_string()),
        DecodeError::Io(error) => return error.into(),
        _ => exception(py, "GipError", message),
    })
}

/// A `LimitError`, which says how to raise the limit.
fn limit_error<'py>(
    py: Python<'py>,
    message: &str,
    kind: LimitKind,
    wanted: u64,
    allowed: u64,
) -> PyResult<Bound<'py, PyAny>> {
    let field = match kind {
        LimitKind::Width => "max_width",
        LimitKind::Height => "max_height",
        LimitKind::Pixels => "max_pixels",
        LimitKind::Gaussians => "max_gaussians",
        LimitKind::Memory => "max_memory",
        LimitKind::Work => "max_work",
        _ => "...",
    };
    let message = format!("{message}; limits=image_gip.Limits({field}=...) raises it");
    let exception = exception(py, "LimitError", message)?;
    exception.setattr("limit", kind.to_string())?;
    exception.setattr("wanted", wanted)?;
    exception.setattr("allowed", allowed)?;
    Ok(exception)
}

/// The exception for an error of the encoder.
pub(crate) fn encode_error(py: Python<'_>, error: &EncodeError) -> PyErr {
    match error {
        EncodeError::Source(error) => PyValueError::new_err(error.to_string()),
        EncodeError::Limit { kind, wanted, allowed } => {
            raised(limit_error(py, &error.to_string(), *kind, *wanted, *allowed))
        }
        EncodeError::Option(OptionError::Threads(_)) => PyRuntimeError::new_err(error.to_string()),
        EncodeError::Option(error) => PyValueError::new_err(error.to_string()),
        _ => raised(exception(py, "CancelledError", error.to_string())),
    }
}

/// Warns the caller, with a class of `image_gip._errors`.
pub(crate) fn warn(py: Python<'_>, class: &str, what: &str) -> PyResult<()> {
    let class = py.import("image_gip._errors")?.getattr(class)?;
    py.import("warnings")?.call_method1("warn", (what, class, 1))?;
    Ok(())
}
