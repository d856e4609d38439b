//! `StreamDecoder`.

use std::sync::{Mutex, MutexGuard, PoisonError};

use image_gip::DecodeError;
use pyo3::exceptions::PyValueError;
use pyo3::prelude::*;
use pyo3::sync::MutexExt;

use crate::errors::decode_error;
use crate::input;
use crate::numbers::{Integer, Real};
use crate::objects::{self, Limits};
use crate::output::Output;
use crate::request::Request;
use crate::threads;

/// Decodes a file as it arrives, in pieces of any size. After each piece it can give the picture of
/// the Gaussians that have arrived.
///
/// Several threads may use one decoder; they wait for each other. If the whole file is at hand,
/// `decode` is faster.
///
/// Args:
///     limits: What the file may cost at most. Default: Limits().
#[pyclass(frozen, module = "image_gip")]
#[derive(Debug)]
pub(crate) struct StreamDecoder(Mutex<image_gip::StreamDecoder>);

impl StreamDecoder {
    /// Waits for other threads, while not attached to the interpreter.
    fn lock(&self) -> MutexGuard<'_, image_gip::StreamDecoder> {
        self.0.lock().unwrap_or_else(PoisonError::into_inner)
    }

    /// As [`StreamDecoder::lock`], while attached.
    fn lock_attached(&self, py: Python<'_>) -> MutexGuard<'_, image_gip::StreamDecoder> {
        self.0.lock_py_attached(py).unwrap_or_else(PoisonError::into_inner)
    }
}

fn no_header() -> PyErr {
    PyValueError::new_err("the header has not arrived yet")
}

#[pymethods]
impl StreamDecoder {
    #[new]
    #[pyo3(signature = (*, limits=None))]
    fn new(limits: Option<Limits>) -> Self {
        Self(Mutex::new(image_gip::StreamDecoder::new().with_limits(Limits::of(limits))))
    }

    /// Takes the next bytes of the file; what follows its end is ignored.
    ///
    /// Args:
    ///     data: Bytes or any contiguous buffer, which is not copied and must not change during the call.
    ///
    /// Returns:
    ///     The decoder itself, so that calls can be chained.
    ///
    /// Raises:
    ///     GipError: The file was refused. `image` still gives the picture of the Gaussians before
    ///         the error; the decoder takes no more bytes.
    fn feed<'py>(slf: PyRef<'py, Self>, data: &Bound<'py, PyAny>) -> PyResult<PyRef<'py, Self>> {
        let py = slf.py();
        let data = input::buffer("data", data)?;
        let (bytes, decoder) = (data.as_slice()?, &*slf);
        let fed = py.detach(|| decoder.lock().feed(bytes).map(|_| ()));
        fed.map_err(|error| decode_error(py, error))?;
        Ok(slf)
    }

    /// Says that there are no more bytes.
    ///
    /// Raises:
    ///     UnexpectedEndError: The file is not complete.
    fn finish(&self, py: Python<'_>) -> PyResult<()> {
        self.lock_attached(py).finish().map_err(|error| decode_error(py, error))
    }

    /// Renders the Gaussians that have arrived.
    ///
    /// Args:
    ///     size, scale, region, mode, background, planar, dtype, out, texture, threads: As for `decode`.
    ///     prefix: Render only so many Gaussians, the first of the file.
    ///
    /// Returns:
    ///     The samples, as `decode` returns them.
    ///
    /// Raises:
    ///     ValueError: The header has not arrived yet, an argument is out of range, or `out` does not
    ///         fit.
    ///     TypeError: An argument has the wrong type.
    ///     LimitError: The output or the work exceeds a limit.
    #[pyo3(signature = (*, size=None, scale=None, region=None, mode=None, background=None, planar=false, dtype=None, out=None, prefix=None, texture=true, threads=1))]
    #[expect(clippy::too_many_arguments, reason = "they are keywords in Python")]
    fn image<'py>(
        &self,
        py: Python<'py>,
        size: Option<(Integer<'py>, Integer<'py>)>,
        scale: Option<Real>,
        region: Option<(Integer<'py>, Integer<'py>, Integer<'py>, Integer<'py>)>,
        mode: Option<&str>,
        background: Option<&Bound<'py, PyAny>>,
        planar: bool,
        dtype: Option<&Bound<'py, PyAny>>,
        out: Option<&Bound<'py, PyAny>>,
        prefix: Option<Integer<'py>>,
        texture: bool,
        #[pyo3(from_py_with = threads::checked)] threads: usize,
    ) -> PyResult<Bound<'py, PyAny>> {
        let request = Request {
            size,
            scale,
            region,
            mode,
            background,
            planar,
            dtype,
            out,
            prefix,
            texture,
            threads,
        };
        let rendering = request.check()?;
        let failed = |error| decode_error(py, error);

        let (header, options) = {
            let stream = self.lock_attached(py);
            let picture = stream.picture().ok_or_else(no_header)?;
            let options = rendering.options(picture.header());
            picture.output_len(&options).map_err(failed)?;
            (picture.header().clone(), options)
        };
        let mut output = Output::new(py, &header, &rendering, &request)?;
        let samples = output.samples()?;
        let rendered = py.detach(|| {
            let stream = self.lock();
            let Some(picture) = stream.picture() else { return Ok(Ok(())) };
            threads::decoding(rendering.threads, |threads| {
                samples.render(&picture, &options.with_threads(threads))
            })
        })?;
        rendered.map_err(|error: DecodeError| decode_error(py, error))?;
        Ok(output.into_array())
    }

    /// The Gaussians that have arrived, as the function `gaussians` gives them.
    ///
    /// Raises:
    ///     ValueError: The header has not arrived yet.
    #[pyo3(signature = (*, cholesky=false))]
    fn gaussians<'py>(&self, py: Python<'py>, cholesky: bool) -> PyResult<Bound<'py, PyAny>> {
        let stream = self.lock_attached(py);
        let header = stream.header().ok_or_else(no_header)?;
        objects::gaussians(py, stream.gaussians(), header.color.channels(), cholesky)
    }

    /// How many Gaussians are enough for a preview of this size in pixels: a sixth of all where that is
    /// one for every 16 pixels, and all of them otherwise. The first Gaussians of a file are the strongest.
    ///
    /// Raises:
    ///     ValueError: The header has not arrived yet, or a side is out of range.
    fn gaussians_for(
        &self,
        py: Python<'_>,
        width: Integer<'_>,
        height: Integer<'_>,
    ) -> PyResult<u32> {
        let width = width.within("width", 0..=u32::MAX)?;
        let height = height.within("height", 0..=u32::MAX)?;
        let stream = self.lock_attached(py);
        Ok(stream.header().ok_or_else(no_header)?.gaussians_for(width, height))
    }

    /// The number of Gaussians that have arrived.
    #[getter]
    fn arrived(&self, py: Python<'_>) -> usize {
        self.lock_attached(py).gaussians().len()
    }

    /// Whether the whole file has arrived.
    #[getter]
    fn is_complete(&self, py: Python<'_>) -> bool {
        self.lock_attached(py).is_complete()
    }

    /// The `Info` of what has arrived; None until the header has. The metadata is complete when the
    /// whole file has arrived.
    #[getter]
    fn info<'py>(&self, py: Python<'py>) -> PyResult<Option<Bound<'py, PyAny>>> {
        let stream = self.lock_attached(py);
        objects::info(py, &stream, stream.metadata())
    }
}
