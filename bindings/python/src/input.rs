//! Files as they come from Python: buffers, paths and file objects.

use std::io::{self, Read};

use numpy::PyReadonlyArray1;
use pyo3::exceptions::{PyTypeError, PyValueError};
use pyo3::prelude::*;
use pyo3::types::{PyMemoryView, PyString};

/// The bytes of a buffer, which are borrowed and not copied.
pub(crate) struct Bytes<'py>(PyReadonlyArray1<'py, u8>);

impl<'py> Bytes<'py> {
    /// The bytes of an object that has the buffer protocol; `None` if it has not.
    pub(crate) fn of_buffer(object: &Bound<'py, PyAny>) -> PyResult<Option<Self>> {
        // NumPy borrows any buffer as an array, which spares the unsafe code to do so.
        let Ok(buffer) = PyMemoryView::from(object) else { return Ok(None) };
        let array = object.py().import("numpy")?.getattr("frombuffer")?.call1((buffer, "u1"));
        let array: PyReadonlyArray1<'py, u8> =
            array.map_err(|_| PyValueError::new_err("the buffer is not contiguous"))?.extract()?;
        Ok(Some(Self(array)))
    }

    /// The whole file `src`: a buffer, a path, or an object with a method `read`.
    pub(crate) fn of_file(src: &Bound<'py, PyAny>) -> PyResult<Self> {
        if let Some(bytes) = Self::of_buffer(src)? {
            return Ok(bytes);
        }
        let py = src.py();
        let read = if src.hasattr("read")? {
            src.call_method0("read")?
        } else if src.is_instance_of::<PyString>() || src.hasattr("__fspath__")? {
            let file = py.import("io")?.call_method1("open", (src, "rb"))?;
            let read = file.call_method0("read");
            file.call_method0("close")?;
            read?
        } else {
            return Err(unreadable("src", src)?);
        };
        Self::of_read(&read)
    }

    /// What the method `read` of a file object has returned.
    fn of_read(read: &Bound<'py, PyAny>) -> PyResult<Self> {
        Self::of_buffer(read)?.ok_or_else(|| {
            PyTypeError::new_err(
                "read() of the file object must return bytes: open it in binary mode",
            )
        })
    }

    pub(crate) fn as_slice(&self) -> PyResult<&[u8]> {
        Ok(self.0.as_slice()?)
    }
}

/// The bytes of the buffer `data`.
pub(crate) fn buffer<'py>(name: &str, data: &Bound<'py, PyAny>) -> PyResult<Bytes<'py>> {
    match Bytes::of_buffer(data)? {
        Some(bytes) => Ok(bytes),
        None => {
            let kind = data.get_type().name()?;
            Err(PyTypeError::new_err(format!("{name} must be bytes-like, not {kind}")))
        }
    }
}

fn unreadable(name: &str, object: &Bound<'_, PyAny>) -> PyResult<PyErr> {
    let kind = object.get_type().name()?;
    Ok(PyTypeError::new_err(format!(
        "{name} must be bytes-like, a path, or a file object with a method read, not {kind}"
    )))
}

/// Reads from a Python file object. The caller holds the interpreter lock or not.
pub(crate) struct FileObject(pub(crate) Py<PyAny>);

impl Read for FileObject {
    fn read(&mut self, buffer: &mut [u8]) -> io::Result<usize> {
        Python::attach(|py| {
            let read = self.0.bind(py).call_method1("read", (buffer.len(),))?;
            let read = Bytes::of_read(&read)?;
            let read = read.as_slice()?;
            let Some(start) = buffer.get_mut(..read.len()) else {
                return Err(io::Error::other("read() returned more than was asked for"));
            };
            start.copy_from_slice(read);
            Ok(read.len())
        })
    }
}
