//! `prefixes` and `prefix`.

use image_gip::Prefixes;
use pyo3::exceptions::PyValueError;
use pyo3::prelude::*;
use pyo3::types::PyBytes;

use crate::errors::{decode_error, gip_error};
use crate::input::Bytes;
use crate::numbers::Integer;

/// The small files that the first layers of a file make, without making them.
///
/// Each is a valid file of its own: that of the first layer is a placeholder of a few hundred bytes, and each
/// further layer adds detail. They keep what says how the picture is shown: `cicp`, `mastering_display`,
/// `content_light`, `icc`, and the orientation in Exif. Texture and other metadata are left out. Nothing is
/// decoded.
///
/// Args:
///     src: The file, the beginning of one, or one that is damaged after its first layer: bytes or any
///         contiguous buffer (which is not copied, and must not change during the call), a path, or a
///         binary file object.
///
/// Returns:
///     A list of `Prefix`: one for each number of layers, from 1 to that of the layers that `src` has
///     completely. It is empty if there is none. A whole file without Gaussians has one, of no layers.
///
/// Raises:
///     UnexpectedEndError: `src` ends before its header does.
///     GipError: The file was refused before its first layer is complete. The Gaussians are not looked at.
///     OSError: The file cannot be read.
#[pyfunction]
pub(crate) fn prefixes<'py>(
    py: Python<'py>,
    src: &Bound<'py, PyAny>,
) -> PyResult<Vec<Bound<'py, PyAny>>> {
    let file = Bytes::of_file(src)?;
    let found = find(py, file.as_slice()?)?;
    let class = py.import("image_gip._types")?.getattr("Prefix")?;
    let prefixes = found.iter();
    prefixes.map(|p| class.call1((p.layers, p.gaussians, p.bytes, p.end))).collect()
}

/// The longest small file of first layers that fits a number of bytes, as `prefixes` describes them.
///
/// Args:
///     src: The file, or the beginning of one, as for `prefixes`.
///     max_bytes: Most bytes of the result, from 0.
///
/// Returns:
///     The small file.
///
/// Raises:
///     ValueError: The file of the first layer has more bytes than `max_bytes`; the message says how many.
///     GipError: The file was refused, as by `prefixes`, or has no complete layer.
///     OSError: The file cannot be read.
#[pyfunction]
pub(crate) fn prefix<'py>(
    py: Python<'py>,
    src: &Bound<'py, PyAny>,
    max_bytes: Integer<'py>,
) -> PyResult<Bound<'py, PyBytes>> {
    let most = max_bytes.within("max_bytes", 0..=usize::MAX)?;
    let file = Bytes::of_file(src)?;
    let found = find(py, file.as_slice()?)?;
    let Some(first) = found.iter().next() else {
        return Err(gip_error(py, "the file has no complete layer"));
    };
    let Some(longest) = found.within(most) else {
        let least = first.bytes;
        let message = format!(
            "the file of the first layer has {least} bytes; max_bytes {most} must be {least} at least"
        );
        return Err(PyValueError::new_err(message));
    };
    Ok(PyBytes::new(py, &py.detach(|| found.file(longest))))
}

fn find<'a>(py: Python<'_>, file: &'a [u8]) -> PyResult<Prefixes<'a>> {
    py.detach(|| Prefixes::new(file)).map_err(|error| decode_error(py, error))
}
