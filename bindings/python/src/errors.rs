//! The crate's errors as the exceptions of `image_gip._errors`.

use image_gip::{
    ChunkType, DecodeError, EncodeError, LimitKind, OptionError, PictureError, RequestError,
    WriteError,
};
use pyo3::exceptions::{PyMemoryError, PyRuntimeError, PyValueError};
use pyo3::prelude::*;

use crate::numbers::shown;
use crate::request::mode_name;

/// An exception of the class with this name.
fn exception<'py>(py: Python<'py>, class: &str, message: String) -> PyResult<Bound<'py, PyAny>> {
    py.import("image_gip._errors")?.getattr(class)?.call1((message,))
}

/// Makes an exception; the error of making it, if that fails.
fn raised<'py>(made: PyResult<Bound<'py, PyAny>>) -> PyErr {
    made.map_or_else(|error| error, PyErr::from_value)
}

/// A `GipError` of no subclass.
pub(crate) fn gip_error(py: Python<'_>, message: &str) -> PyErr {
    raised(exception(py, "GipError", message.into()))
}

/// The exception for an error of the decoder.
pub(crate) fn decode_error(py: Python<'_>, error: DecodeError) -> PyErr {
    let message = error.to_string();
    let of_chunk = |class: &str, chunk: Option<ChunkType>| {
        let exception = exception(py, class, message.clone())?;
        exception.setattr("chunk", chunk.map(|chunk| chunk.letters().to_string()))?;
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
        DecodeError::Request(RequestError::ColorModel { from, to }) => {
            let (from, to) = (mode_name(from), mode_name(to));
            return PyValueError::new_err(format!(
                "mode {to:?} of a picture with mode {from:?}; colours do not become gray"
            ));
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

/// The exception for Gaussians or a header of the caller that no picture can have.
pub(crate) fn picture_error(py: Python<'_>, error: &PictureError) -> PyErr {
    let message = error.to_string();
    let PictureError::Count { found, allowed } = *error else {
        return PyValueError::new_err(message);
    };
    let (wanted, allowed) = (found as u64, allowed.into());
    raised(limit_error(py, &message, LimitKind::Gaussians, wanted, allowed))
}

/// The exception for an error of the encoder.
pub(crate) fn encode_error(py: Python<'_>, error: &EncodeError) -> PyErr {
    match error {
        EncodeError::Source(error) => PyValueError::new_err(error.to_string()),
        EncodeError::Limit { kind, wanted, allowed } => {
            raised(limit_error(py, &error.to_string(), *kind, *wanted, *allowed))
        }
        EncodeError::Option(OptionError::Threads(_)) => PyRuntimeError::new_err(error.to_string()),
        EncodeError::Option(OptionError::Target { name, value, least, most }) => {
            let value = shown(*value);
            PyValueError::new_err(format!("{name} {value}; it must be {least} to {most}"))
        }
        EncodeError::Option(error) => PyValueError::new_err(error.to_string()),
        _ => raised(exception(py, "CancelledError", error.to_string())),
    }
}

/// The exception for an error of the writer.
pub(crate) fn write_error(py: Python<'_>, error: &WriteError) -> PyErr {
    match error {
        WriteError::Picture(error) => picture_error(py, error),
        WriteError::Limit { kind, wanted, allowed } => {
            raised(limit_error(py, &error.to_string(), *kind, *wanted, *allowed))
        }
        WriteError::Option(OptionError::Threads(_)) => PyRuntimeError::new_err(error.to_string()),
        _ => PyValueError::new_err(error.to_string()),
    }
}

/// Warns the caller, with a class of `image_gip._errors`.
pub(crate) fn warn(py: Python<'_>, class: &str, what: &str) -> PyResult<()> {
    let errors = py.import("image_gip._errors")?;
    errors.call_method1("warn", (what, errors.getattr(class)?))?;
    Ok(())
}

/// A vector with room for so many elements.
pub(crate) fn vec_for<T>(length: usize) -> PyResult<Vec<T>> {
    let mut elements = Vec::new();
    elements.try_reserve_exact(length).map_err(|_| {
        let bytes = length.saturating_mul(size_of::<T>());
        PyMemoryError::new_err(format!("{bytes} bytes could not be allocated"))
    })?;
    Ok(elements)
}
